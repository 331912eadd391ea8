"""Files of other programs, read by our readers under sanitizers: none is read wrong without a word (tests/zoo)."""
import json
import os
import subprocess

import pytest
from daemon_under_test import BUILD, ROOT

PYTHON = os.path.join(BUILD, "zoo-python", "bin", "python")
READER = os.path.join(BUILD, "zoo", "tests", "zoo", "read_files")


@pytest.mark.slow
def test_files_of_other_programs():
    if not os.path.exists(os.path.join(BUILD, "zoo-python", "installed")) or not os.path.exists(READER):
        pytest.skip("`make zoo` has not installed tifffile, Pillow and the other programs of tests/zoo/requirements.txt")
    done = subprocess.run([PYTHON, os.path.join(ROOT, "tests", "zoo", "zoo.py"), "--reader", READER], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-4000:]
    figures = {f["name"]: f["value"] for f in map(json.loads, done.stdout.splitlines())}
    assert figures["files.zoo.silent"] == 0 and figures["files.zoo.right"] + figures["files.zoo.refused"] > 200
