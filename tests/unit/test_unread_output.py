"""A reader that closes a command's output early, as `| head` does."""

import signal
import subprocess
import sys

import pytest

COMMANDS = {
    "rodmodel.cli": ["layouts"],
    "calibration.cli": ["truth"],
    "fem_reference.cli": ["cell", "--elements", "coarse", "--pressure-kpa", "0", "0", "0"],
}


@pytest.mark.parametrize("module", COMMANDS)
def test_output_that_is_not_read_to_its_end_is_no_failure_to_tell_of(module):
    code = f"import sys; from {module} import main; sys.exit(main({COMMANDS[module]!r}))"
    with subprocess.Popen(
        [sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE
    ) as run:
        run.stdout.close()
        assert run.stderr.read() == b""
    # gmsh has the signal end the process itself, which a shell tells as 141 too.
    assert run.returncode in (128 + signal.SIGPIPE, -signal.SIGPIPE)
