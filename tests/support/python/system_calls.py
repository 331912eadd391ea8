"""Makes system calls of a program under test fail, or records them, with the preloaded library
tests/crash/fault_shim.c."""
import os
import shutil
import subprocess

import pytest
from daemon_under_test import BUILD, ROOT


def build_shim(folder):
    """Returns the path of the library, or skips the test."""
    compiler = shutil.which("cc") or shutil.which("gcc")
    if compiler is None:
        pytest.skip("no C compiler for the fault injector")
    if "asan" in BUILD:
        pytest.skip("the address sanitizer wants to be loaded first")
    path = os.path.join(folder, "fault_shim.so")
    source = os.path.join(ROOT, "tests", "crash", "fault_shim.c")
    subprocess.run([compiler, "-shared", "-fPIC", "-O1", "-o", path, source, "-ldl"], check=True)
    return path


class Trace:
    """Writes and syncs of a program started with `environment`, in order."""

    def __init__(self, shim, path):
        self.path = str(path)
        self.environment = {"LD_PRELOAD": shim, "FAULT_TRACE": self.path}

    def clear(self):
        with open(self.path, "wb"):
            pass

    def calls(self):
        """Returns [("write" or "sync", path of the file)]."""
        with open(self.path, errors="replace") as f:
            return [tuple(line.rstrip("\n").split(" ", 1)) for line in f]
