"""Memory kept between arrays: the pages of the second are those of the first."""

import platform
import subprocess
import sys

import pytest

SCRIPT = """
import resource, sys
import numpy as np
from fem_reference import keep_memory

if sys.argv[1] == "keep":
    assert keep_memory()
for k in range(6):
    before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
    array = np.empty(8 << 20)
    array[::512] = 1.0  # a number a page
    del array
    faults = resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before
print(faults)
"""


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="other C libraries are left as they are")
def test_the_pages_of_an_array_are_there_for_the_next() -> None:
    """64 MiB are 16 384 pages, or 32 large ones: a few of them faulted at the sixth time, or all."""
    faults = {}
    for name in ("keep", "plain"):
        run = subprocess.run([sys.executable, "-c", SCRIPT, name], capture_output=True, text=True, check=True)
        faults[name] = int(run.stdout)
    assert faults["keep"] < 8 < faults["plain"]
