"""Samples are dropped into a watched folder while daemon and watcher are killed: each must end exactly once, with its results beside it.

    watched_folder_kills.py [--build DIR] [--samples 100] [--kills 20] [--seed 1]

The jobs are real: a cloth of a few fibers and a table of six rows, fitted by the real worker. Samples are copied slowly, and half of
them say by a marker that they are complete, the others by being quiet. Prints figures service.folder_*; exit status 1 when one is wrong.
"""
import argparse
import json
import os
import random
import subprocess
import sys
import tempfile
import threading
import time

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.path.insert(0, os.path.join(ROOT, "tests", "support", "python"))
sys.path.insert(0, os.path.join(ROOT, "clients", "python"))
from small_cloth import TABLE, hair  # noqa: E402

import selvedge  # noqa: E402

FIT = {"path_budget": 20000, "render_px": 8, "render_samples": 1, "max_iterations": 2}
QUIET_S = 3


def drop(folder, i, rng):
    """Copies a sample as a slow share does: the document first, then pieces of the files, then the marker."""
    sample = os.path.join(folder, f"sample-{i:03}")
    document = {"sample": f"sample {i}", "fibers": {"file": "cloth.hair", "voxel_um": 5}, "measurements": {"file": "rows.csv"}, "fit": FIT}
    files = {"job.json": json.dumps(document).encode(), "cloth.hair": hair(), "rows.csv": TABLE.encode() + b"# of sample %d\n" % i}
    os.mkdir(sample)
    for name, data in files.items():
        with open(os.path.join(sample, name), "wb", buffering=0) as f:
            for k in range(0, len(data), 2000):
                f.write(data[k:k + 2000])
                time.sleep(rng.uniform(0, 0.05))
    if i % 2 == 0:
        open(os.path.join(sample, "READY"), "w").close()


class Service:
    """Daemon and watcher, which are killed and started again."""
    def __init__(self, build, folder, data):
        programs, self.socket = os.path.join(build, "bin"), os.path.join(folder, "socket")
        self.command = {"daemon": [os.path.join(programs, "selvedged"), "--data", data, "--set", f"server.unix_socket={self.socket}",
                                   "--set", "disk.floor_bytes=0", "--set", "jobs.workers=2", "--set", "jobs.pictures=0"],
                        "watcher": [os.path.join(programs, "selvedge"), "--server", f"unix:{self.socket}", "watch-folder",
                                    os.path.join(folder, "inbox"), "--quiet", str(QUIET_S)]}
        self.log = {name: open(os.path.join(folder, name + ".log"), "ab") for name in self.command}
        self.process = {}

    def start(self, name):
        self.process[name] = subprocess.Popen(self.command[name], stdout=self.log[name], stderr=self.log[name])

    def kill(self, name):
        self.process[name].kill()
        self.process[name].wait()

    def stop(self):
        for name in ("watcher", "daemon"):
            self.process[name].terminate()
            self.process[name].wait()


def states(inbox, n):
    found = []
    for i in range(n):
        try:
            with open(os.path.join(inbox, f"sample-{i:03}.selvedge", "state.json"), encoding="utf-8") as f:
                found.append(json.load(f))
        except FileNotFoundError:
            found.append({})
    return found


def judge(client, inbox, n):
    """The number of samples that did not end exactly once."""
    jobs = {j.sample: [] for j in client.jobs()}
    for j in client.jobs():
        jobs[j.sample].append(j)
    wrong = 0
    for i, state in enumerate(states(inbox, n)):
        mine, beside = jobs.get(f"sample {i}", []), os.path.join(inbox, f"sample-{i:03}.selvedge", "results")
        good = len(mine) == 1 and mine[0].state == "succeeded" and state.get("state") == "succeeded" and state["job"] == mine[0].id
        good = good and all(os.path.getsize(os.path.join(beside, f.path)) == f.size for f in client.job(mine[0].id).results())
        if not good:
            print(f"sample {i}: {state}, jobs {[(j.id, j.state, j.error) for j in mine]}", file=sys.stderr)
        wrong += not good
    return wrong + (sum(map(len, jobs.values())) != n)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", default="build")
    for name, usual in (("samples", 100), ("kills", 20), ("seed", 1)):
        parser.add_argument("--" + name, type=int, default=usual)
    a = parser.parse_args()
    rng, begin = random.Random(a.seed), time.monotonic()
    with tempfile.TemporaryDirectory() as folder:
        inbox = os.path.join(folder, "inbox")
        os.mkdir(inbox)
        service = Service(os.path.abspath(a.build), folder, os.path.join(folder, "data"))
        service.start("daemon")
        service.start("watcher")
        dropper = threading.Thread(target=lambda: [drop(inbox, i, rng) for i in range(a.samples)], daemon=True)
        dropper.start()
        for i in range(a.kills):
            # spread over the whole run: the next kill waits until its share of the samples has ended
            while sum(s.get("state") in ("succeeded", "failed") for s in states(inbox, a.samples)) < i * a.samples * 0.9 / a.kills:
                time.sleep(0.05)
            time.sleep(rng.uniform(0, 0.5))
            names = ("daemon", "watcher") if i % 3 == 0 else ("daemon",)
            for name in names:
                service.kill(name)
            for name in names:
                service.start(name)
        dropper.join()
        while any(s.get("state") not in ("succeeded", "failed") for s in states(inbox, a.samples)) and time.monotonic() < begin + 3600:
            time.sleep(0.2)
        wrong = judge(selvedge.Client(f"unix:{service.socket}"), inbox, a.samples)
        service.stop()
        if wrong:
            for name in service.command:
                with open(os.path.join(folder, name + ".log"), errors="replace") as f:
                    print(f.read()[-3000:], file=sys.stderr)
    for name, value, unit in (("samples", a.samples, "samples"), ("kills", a.kills, "kills"), ("not_once", wrong, "samples"),
                              ("took_s", round(time.monotonic() - begin, 1), "s")):
        print(json.dumps({"name": f"service.folder_{name}", "value": value, "unit": unit}))
    return wrong > 0


if __name__ == "__main__":
    sys.exit(main())
