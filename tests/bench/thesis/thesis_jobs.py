"""Steps of bench_thesis.py that are jobs: each is a document and files, run by the worker in a folder of its own. A step that is finished is
one JSON file beside the folder, and is taken from there as long as its document and files are the same; a folder that the same program
was interrupted in goes on where it stopped, as every job does.

A step keeps the day and the program that made it ("made", "program": beginning of the SHA-256 of the worker). A finished step of another
program is taken, because all of them take hours, but `standing` counts it, on standard error and on the page.
"""
import datetime
import hashlib
import json
import os
import resource
import shutil
import subprocess
import sys
import time


def is_path(content):
    return len(content) < 4096 and os.path.exists(content)


class Steps:
    def __init__(self, build, folder, names):
        self.worker = os.path.join(build, "bin", "selvedge-worker")
        self.build, self.folder, self.names = build, folder, names
        with open(self.worker, "rb") as f:
            self.program = hashlib.sha256(f.read()).hexdigest()[:12]
        self.used, self.stale = {}, []
        self.resumed = False  # whether the last job went on with what an interrupted one had left, whose time is not known
        os.makedirs(folder, exist_ok=True)

    def wanted(self, name):
        return not self.names or any(name.startswith(n) for n in self.names)

    def kept(self, name):
        """What is known of a step, or None."""
        path = os.path.join(self.folder, name + ".json")
        if not os.path.exists(path):
            return None
        with open(path, encoding="utf-8") as f:
            return json.load(f)

    def result(self, name):
        """The whole result of the job of a step, or None where its folder is not there."""
        path = os.path.join(self.folder, name, "results", "result.json")
        if not os.path.exists(path):
            return None
        with open(path, encoding="utf-8") as f:
            return json.load(f)

    def keep(self, name, value):
        path = os.path.join(self.folder, name + ".json")
        with open(path + ".new", "w", encoding="utf-8") as f:
            json.dump(value, f)
        os.replace(path + ".new", path)
        return value

    def step(self, name, key, make):
        """make() gives what is kept under the name; key: of what it depends on. None where the step is not wanted and not there."""
        there = self.kept(name)
        mark = hashlib.sha256(json.dumps(key, sort_keys=True).encode()).hexdigest()
        if there is not None and (there["key"] == mark or not self.wanted(name)):
            if there["key"] != mark:
                self.stale.append(name)
            self.used[name] = there
            return there["value"]
        if not self.wanted(name):
            return None
        before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
        self.resumed = False
        value = make()
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        cpu_s = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        print(f"{name}: processor {cpu_s:.1f} s, {time.monotonic() - start:.0f} s", file=sys.stderr, flush=True)
        self.used[name] = self.keep(name, {"key": mark, "program": self.program, "made": datetime.date.today().isoformat(),
                                           "cpu_s": None if self.resumed else round(cpu_s, 1), "value": value})
        return value

    def standing(self):
        """([first, last day of the steps that were taken], or the only one; number of other programs that made some of them)."""
        of = {name: (step.get("program"), step.get("made")) for name, step in self.used.items()}
        others = sorted(name for name, (program, _) in of.items() if program != self.program)
        for what, names in (("another program", others), ("other inputs than today's", self.stale)):
            if names:
                print(f"{len(names)} of {len(of)} steps are of {what}: {' '.join(names)}. Without their files in '{self.folder}' they are made anew.",
                      file=sys.stderr, flush=True)
        days = sorted({made for _, made in of.values() if made})
        return days[:1] + days[-1:] if len(days) > 1 else days, len({program for program, _ in of.values()} - {self.program})

    def job(self, name, document, files, take):
        """take(result, folder of the results) gives what is kept."""
        return self.step(name, [document, self.described(files)], lambda: self.run(name, document, files, take))

    def described(self, files):
        """Contents, and paths as seen from the folder of the steps, which may have moved since."""
        return {name: os.path.relpath(of, self.folder) if is_path(of) else of for name, of in files.items()}

    def run(self, name, document, files, take):
        """files: the content of each, or the path of one that is copied."""
        folder = os.path.join(self.folder, name)
        text = json.dumps([document, self.described(files), self.program], sort_keys=True)
        recipe = os.path.join(folder, "recipe.json")
        if os.path.exists(recipe):
            with open(recipe, encoding="utf-8") as f:
                self.resumed = f.read() == text
            if not self.resumed:
                shutil.rmtree(folder)
        os.makedirs(os.path.join(folder, "input"), exist_ok=True)
        for file, content in files.items():
            if is_path(content):
                shutil.copy(content, os.path.join(folder, "input", file))
                continue
            with open(os.path.join(folder, "input", file), "w", encoding="utf-8") as f:
                f.write(content)
        for path, content in ((os.path.join(folder, "job.json"), json.dumps(document)), (recipe, text)):
            with open(path, "w", encoding="utf-8") as f:
                f.write(content)
        if subprocess.run([self.worker, "--quiet", folder], check=False).returncode != 0:
            with open(os.path.join(folder, "log.txt"), encoding="utf-8") as f:
                raise RuntimeError(f"{name}: {f.read()[-1500:]}")
        results = os.path.join(folder, "results")
        with open(os.path.join(results, "result.json"), encoding="utf-8") as f:
            value = take(json.load(f), results)
        shutil.rmtree(os.path.join(results, "renderings"), ignore_errors=True)
        return value
