"""The Python with Mitsuba, USD and MaterialX that `make test` installs, for tests of exports."""
import os
import subprocess

import pytest
from daemon_under_test import program

PYTHON = os.path.join(os.path.dirname(os.path.dirname(program("selvedge-worker"))), "exports-python", "bin", "python")


def by_python(module, script, *arguments):
    """What a script prints, run by the Python of `make bench-exports`; the test is skipped where this Python has no such module."""
    if not os.access(PYTHON, os.X_OK) or subprocess.run([PYTHON, "-c", f"import {module}"], capture_output=True, check=False).returncode != 0:
        pytest.skip(f"the files are right so far; no Python with {module} to open them with (make test installs it where there is a package index)")
    done = subprocess.run([PYTHON, script, *map(str, arguments)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout
