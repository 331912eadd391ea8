"""A watched folder for tests: samples that are dropped into it, and `selvedge watch-folder`, which is killed and started again."""
import json
import os
import subprocess

from daemon_under_test import FILES, document, program, sha256


def drop(folder, name, behaviour="succeed", marker="READY", **more):
    """A whole sample. Its files are its own, so that each is a job of its own."""
    sample = os.path.join(folder, name)
    os.makedirs(sample, exist_ok=True)
    for file_name, (_, data) in FILES.items():
        with open(os.path.join(sample, file_name), "wb") as f:
            f.write(data + name.encode())
    with open(os.path.join(sample, "job.json"), "w", encoding="utf-8") as f:
        json.dump(document(behaviour, **more), f)
    if marker:
        open(os.path.join(sample, marker), "w").close()
    return sample


class Watcher:
    def __init__(self, folder, server, *options):
        self.command = [program("selvedge"), "--server", server, "watch-folder", str(folder), *options]
        self.folder, self.process = str(folder), None

    def __enter__(self):
        return self.start()

    def __exit__(self, *unused):
        self.stop()

    def start(self):
        self.log = open(self.folder + ".log", "ab")
        self.process = subprocess.Popen(self.command, stdout=self.log, stderr=self.log)
        return self

    def stop(self, kill=False):
        if self.process is not None:
            (self.process.kill if kill else self.process.terminate)()
            self.code = self.process.wait(60)
            self.log.close()
        self.process = None

    def text(self):
        with open(self.folder + ".log", errors="replace") as f:
            return f.read()


def outcome(folder, name):
    """state.json of a sample, or {}."""
    try:
        with open(os.path.join(folder, name + ".selvedge", "state.json"), encoding="utf-8") as f:
            return json.load(f)
    except FileNotFoundError:
        return {}


def reason(folder, name):
    with open(os.path.join(folder, name + ".selvedge", "reason.txt"), encoding="utf-8") as f:
        return f.read()


def hashes(folder):
    """Path and hash of each file below a folder."""
    found = {}
    for root, _, names in os.walk(folder):
        for name in names:
            path = os.path.join(root, name)
            with open(path, "rb") as f:
                found[os.path.relpath(path, folder)] = sha256(f.read())
    return found
