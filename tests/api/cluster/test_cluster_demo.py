"""make cluster-demo: six samples on a real Slurm of two virtual nodes, one worker killed in mid-fit, the results as those
of the local backend bit by bit, and nothing left behind."""
import os
import re
import subprocess
import sys
import tempfile

import pytest
from daemon_under_test import BUILD, ROOT

DEMO = os.path.join(ROOT, "tests", "slurm", "cluster_demo.py")
SKIPPED = 77


def of_demo():
    """Ids of the processes that have a folder of the demo in their command line or environment."""
    found = []
    for pid in filter(str.isdigit, os.listdir("/proc")):
        try:
            with open(f"/proc/{pid}/cmdline", "rb") as line, open(f"/proc/{pid}/environ", "rb") as environment:
                if f"{BUILD}/cluster-demo-".encode() in line.read() + environment.read():
                    found.append(int(pid))
        except OSError:
            continue
    return found


def folders():
    """Those of the demo, and of its database."""
    return {name for top in (BUILD, tempfile.gettempdir()) for name in os.listdir(top) if name.startswith("cluster-demo-")}


@pytest.mark.slow
def test_the_demo():
    before = folders()
    done = subprocess.run([sys.executable, DEMO], capture_output=True, text=True, check=False, timeout=5400)
    if done.returncode == SKIPPED:
        pytest.skip(done.stdout.strip())
    assert done.returncode == 0, done.stdout + done.stderr
    assert "6 of 6 samples have the same results bit by bit" in done.stdout
    assert re.search(r"killed the worker of 'cloth \d' \(Slurm job \d+\) after \d+ step", done.stdout)
    # on the cluster and on this machine; within a factor of 2, because the speeds are those of one common machine
    off = [float(x) for x in re.findall(r"took over  core hours ([\d.]+)", done.stdout)]
    assert len(off) == 2 and all(0.5 < x < 2 for x in off), done.stdout
    assert not of_demo(), "processes are left"
    assert folders() == before, "files are left"
