"""Make a notebook of a page of Markdown and execute it in the current folder, in a process of its own.

    python execute_notebook.py PAGE NOTEBOOK

Kernel and client talk over sockets of files, so that no port is opened, and nobody's settings are read.
"""

import os
import sys
import tempfile

import jupytext
import nbformat
from jupyter_client import AsyncKernelManager
from nbclient import NotebookClient

SECONDS_A_CELL = 1200


def main(page: str, file: str) -> None:
    """Write the notebook with what its cells printed; an error in a cell is raised."""
    notebook = jupytext.read(page)
    # The name of a socket may have a hundred letters, and a test's folder may have as many.
    with tempfile.TemporaryDirectory() as folder:
        for variable in ("IPYTHONDIR", "JUPYTER_CONFIG_DIR", "JUPYTER_DATA_DIR", "JUPYTER_RUNTIME_DIR"):
            os.environ[variable] = folder
        kernel = AsyncKernelManager(kernel_name="python3", transport="ipc", ip=f"{folder}/kernel")
        NotebookClient(notebook, km=kernel, timeout=SECONDS_A_CELL).execute()
    nbformat.write(notebook, file)


if __name__ == "__main__":
    main(*sys.argv[1:])
