"""One system call of a worker fails, at any place between its start and its end: it ends well or with a reason, and the
next attempt ends with exactly the result of a worker that met no fault.

strace makes the calls fail, also those that the C library makes for itself. SELVEDGE_EVERY=1 (make test-crash) tries
every call in place of a sample. Threads are counted each for themselves."""
import collections
import errno
import os
import re
import subprocess

import pytest
from disks.disk_record import strace_wrapper
from fit_outcome import outcome, read_json
from test_worker_resume import WORKER, make_job

EVERY = os.environ.get("SELVEDGE_EVERY") == "1"
FAULTS = [("write", "ENOSPC"), ("pwrite64", "ENOSPC"), ("fsync", "EIO"), ("fdatasync", "EIO"), ("rename", "EIO"), ("mkdir", "ENOSPC")]


def work(folder, *strace):
    command = [*strace, WORKER, "--threads", "1", folder]
    return subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=600)


def small_job(folder):
    return make_job(str(folder), path_budget=40000)


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """(outcome without a fault, call -> how often the thread that makes most of these calls makes it)"""
    folder = tmp_path_factory.mktemp("whole")
    trace = folder / "trace"
    strace_wrapper(trace)
    job = small_job(folder / "job")
    done = work(job, "strace", "-f", "-qq", "-e", "signal=none", "-e", "trace=" + ",".join(c for c, _ in FAULTS), "-o", str(trace))
    assert done.returncode == 0, done.stderr
    count = collections.Counter(re.findall(r"^(\d+) +(\w+)\(", trace.read_text(errors="replace"), re.M))
    return outcome(job), {call: max(n for (_, c), n in count.items() if c == call) for call, _ in FAULTS}


def sample(n):
    """Every call, or four that lie evenly between the first and the last."""
    return range(1, n + 1) if EVERY else sorted({1 + i * (n - 1) // 3 for i in range(4)})


@pytest.mark.parametrize("call, code", FAULTS)
def test_a_fault_costs_an_attempt_and_no_result(whole, tmp_path, call, code):
    want, count = whole
    n_failed = 0
    for at in sample(count[call]):
        job = small_job(tmp_path / f"job{at}")
        done = work(job, "strace", "-D", "-f", "--seccomp-bpf", "-qq", "-e", "signal=none", "-e", f"trace={call}",
                    "-e", f"inject={call}:error={code}:when={at}", "-o", os.devnull)
        if done.returncode != 0:
            n_failed += 1
            assert os.strerror(getattr(errno, code)) in done.stderr.splitlines()[-1], f"{call} {at}: {done.returncode}, {done.stderr}"
            again = work(job)
            assert again.returncode == 0, f"after {call} {at}: {again.stderr} {read_json(job, 'status.json')}"
        assert outcome(job) == want, f"{call} {at} failed, and the result is another one"
    print(f"{call} {code}: {n_failed} of {len(sample(count[call]))} faults ended the attempt")
    assert n_failed > 0
