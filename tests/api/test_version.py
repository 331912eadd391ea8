"""Every program, the daemon's GET /v1/about and the Python client state the version of base/version.h."""
import os
import re
import subprocess
import sys

import pytest
from daemon_under_test import program

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.path.insert(0, os.path.join(ROOT, "clients", "python"))
import selvedge  # noqa: E402


def version():
    with open(os.path.join(ROOT, "base", "version.h"), encoding="utf-8") as header:
        return re.search(r'SELVEDGE_VERSION "([0-9]+\.[0-9]+\.[0-9]+)"', header.read()).group(1)


@pytest.mark.parametrize("name", ["selvedge", "selvedged", "selvedge-worker", "selvedge-phantom"])
def test_programs(name):
    p = subprocess.run([program(name), "--version"], capture_output=True, text=True, timeout=300, check=True)
    assert p.stdout == f"{name} {version()}\n"


def test_service_and_python_client(daemon):
    assert daemon.get("/v1/about").json()["version"] == version() == selvedge.__version__
