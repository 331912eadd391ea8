"""Records a daemon at work, and rebuilds the states that its disk may have after a power cut at any moment."""
import copy
import os
import pathlib
import random
import shutil
import tempfile
import time

import pytest
from daemon_under_test import Daemon
from disks.disk_record import read_record, strace_wrapper
from disks.disk_states import Disk, save_all, save_least, save_some

EVERY = os.environ.get("SELVEDGE_EVERY") == "1"


class Journal:
    """What was confirmed, and when: changes of what is expected of a job."""

    def __init__(self):
        self.changes, self.there = [], None

    def begin(self, folder):
        """Keeps a copy of what is in the folder before the first call."""
        if os.path.isdir(folder):
            self.there = str(folder) + ".there"
            shutil.copytree(folder, self.there)

    def disk(self):
        """Returns the disk before the first call, and path -> size of its files."""
        disk = Disk()
        return disk, disk.load(self.there) if self.there else {}

    def say(self, job, **expected):
        self.changes.append((time.time(), job, expected))

    def before(self, time_s):
        """Returns job -> expectations from all that was confirmed (or asked for) before this time."""
        jobs = {}
        for when, job, expected in self.changes:
            if when < time_s:
                known = jobs.setdefault(job, {"files": {}})
                known["files"].update(expected.get("files", {}))
                known.update({k: v for k, v in expected.items() if k != "files"})
        return copy.deepcopy(jobs)


def record(folder, scenario, **more):
    """Runs a daemon under strace, in folder/data, which may have files. Returns the calls and what was confirmed, after a
    check that the calls lead to the files that are there."""
    trace, data = folder / "trace", folder / "data"
    journal = Journal()
    journal.begin(data)
    d = Daemon(data, wrapper=strace_wrapper(trace), **more).start()
    scenario(d, journal)
    d.stop()
    disk, size = journal.disk()
    calls = wait_for_record(trace, data, size)
    for call in calls:
        disk.apply(call)
    save_all(disk, folder / "again")
    assert content_of(folder / "again") == content_of(data), "the record does not lead to the files that are there"
    return calls, journal


def wait_for_record(trace, data, before):
    """strace writes its last lines after the program has ended."""
    size = -1
    while size != os.path.getsize(trace):
        size = os.path.getsize(trace)
        time.sleep(0.2)
    return read_record(trace, data, before)


def content_of(folder):
    found = {}
    for path, _, names in os.walk(folder):
        for name in names:
            with open(os.path.join(path, name), "rb") as f:
                found[os.path.relpath(os.path.join(path, name), folder)] = f.read()
    return found


def states(disk, calls, rng, shares, begin):
    """Yields (index of the last call, function that saves the state) for all states, or a sample of them. Without a
    sync the least state stays the same while more is confirmed, so only its last moment is of interest."""
    least, others = (1.0, 1.0) if EVERY else shares
    for i, call in enumerate(calls):
        disk.apply(call)
        if i < begin:
            continue
        last = i + 1 == len(calls)
        chosen = rng.random() < least or not last and "all" in calls[i + 1].flags  # there are few syncs of everything
        if (last or calls[i + 1].name == "sync") and chosen:
            yield i, lambda path: save_least(disk, path)
        if rng.random() < others:
            yield i, lambda path: save_some(disk, path, rng)
        if rng.random() < others:
            yield i, lambda path: save_all(disk, path)


def try_states(calls, journal, folder, check, enough=5, shares=(0.2, 0.03), begin=0):
    """Returns (number of states tried, [what was lost]). Ends after `enough` losses. shares: of the least states and of
    the others that are tried, from the call `begin` on."""
    n, lost = 0, []
    for i, save in states(journal.disk()[0], calls, random.Random(1), shares, begin):
        until_s = calls[i + 1].begin_s if i + 1 < len(calls) else float("inf")
        save(folder / "cut")
        n += 1
        try:
            check(folder / "cut", journal.before(until_s))
        except AssertionError as e:
            lost.append(f"after call {i} ({calls[i].name} {os.fsdecode(calls[i].path)}): {e}")
        if len(lost) >= enough:
            break
    return n, lost


@pytest.fixture
def memory_folder():
    """A folder in memory, where there is one: states are many, and need no disk."""
    with tempfile.TemporaryDirectory(dir="/dev/shm" if os.path.isdir("/dev/shm") else None) as folder:
        yield pathlib.Path(folder)
