"""Which test runs which line: every test once, over a build that counts the lines of the judged files.

The record is kept in build/mutants/coverage-*.json. A test is recorded again when its source has changed, or a file that it ran,
or when there is a new file beside one that it ran."""
import hashlib
import json
import os
import pathlib
import re
import subprocess
import time

from mutant_build import PLUGIN, PROGRAMS, SANDBOX, TREE, WORK, Build, data_folder

PYTEST = ["/usr/bin/python3", "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", "-m", "not slow"]
RECORD_LIMIT_S = 90


class Test:
    """name: "unit/base/test_rng" or "api/test_layers"."""

    def __init__(self, name):
        self.name = name
        self.is_c = (TREE / "tests" / (name + ".c")).exists()
        self.source = TREE / "tests" / (name + (".c" if self.is_c else ".py"))
        self.seconds, self.ran = None, {}

    def command(self, build):
        return [build.target(self.name)] if self.is_c else [*PYTEST, str(self.source.relative_to(TREE))]

    def run(self, build, limit_s, scratch=None):
        """(passed, seconds); a test that has no end fails. scratch: its /tmp in a sandbox."""
        start = time.monotonic()
        root = "/mnt/tree" if scratch else str(TREE)
        environment = dict(os.environ, SELVEDGE_BUILD=f"{root}/build/{build.name}", OPENBLAS_NUM_THREADS="1", SELVEDGE_DATA=data_folder(),
                           PYTHONDONTWRITEBYTECODE="1")
        command = [*([SANDBOX, WORK, scratch] if scratch else []), *self.command(build)]
        process = subprocess.Popen(command, cwd=TREE, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                                   env=environment)
        try:
            code = process.wait(limit_s)
        except subprocess.TimeoutExpired:
            process.kill()  # and with it everything in its namespace
            process.wait()
            code = -1
        return code in (0, 5), time.monotonic() - start  # 5: pytest has nothing to run


def all_tests():
    for kind, ending in (("unit", ".c"), ("api", ".py")):
        for source in sorted((TREE / "tests" / kind).rglob("test_*" + ending)):
            yield Test(str(source.relative_to(TREE / "tests").with_suffix("")))


def hash_of(*paths):
    sum_ = hashlib.sha256()
    for path in paths:
        sum_.update(pathlib.Path(path).read_bytes())
    return sum_.hexdigest()[:16]


class Coverage:
    """tests: those that may reach one of the files, with their seconds and the lines that they ran. name: of this choice of
    files, which has a build and a record of its own. asked: beginnings of the names of the tests that are recorded."""

    def __init__(self, name, files, asked, note):
        self.files, self.asked, self.note = set(files), tuple(asked), note
        compiled = [f for f in files if f.endswith(".c")]
        self.build = Build("covered-" + name, "LDFLAGS=--coverage -Wl,-Map=$@.map", "COVERED=" + " ".join(compiled))
        self.path = WORK / f"coverage-{name}.json"
        self.known = json.loads(self.path.read_text()) if self.path.exists() else {"sources": {}, "counted": {}, "tests": {}}
        self.forget_changes({f: hash_of(TREE / f) for f in compiled})
        self.tests = []
        self.contents = {}

    def forget_changes(self, sources):
        changed = {f for f in sources if self.known["sources"].get(f) != sources[f]}
        new = {os.path.dirname(f) for f in changed if f not in self.known["sources"]}
        for name, found in list(self.known["tests"].items()):
            if any(f in changed or os.path.dirname(f) in new for f in found["ran"]):
                del self.known["tests"][name]
        self.known["counted"] = {f: lines for f, lines in self.known["counted"].items() if f not in changed}
        self.known["sources"] = sources

    def record(self):
        """Builds, runs what is not known yet, and keeps the record."""
        tests = [t for t in all_tests() if t.name.startswith(self.asked)]
        built = self.build.has([*PROGRAMS, PLUGIN, *(t.name for t in tests if t.is_c)], options=["-j2"])
        if built.returncode != 0:
            raise SystemExit(f"mutants: the copy of the tree does not build:\n{built.stdout[-3000:]}")
        names = {pathlib.Path(f).name for f in self.files}
        self.contents = {p: self.build.objects_in(p) for p in [*PROGRAMS, PLUGIN]}
        reached = set().union(*self.contents.values()) & names
        for t in tests:
            if (self.build.objects_in(t.name) if t.is_c else reached) & names:
                self.record_one(t)
        self.path.write_text(json.dumps(self.known))

    def record_one(self, test):
        key = hash_of(test.source)
        if self.known["tests"].get(test.name, {}).get("key") != key:
            self.drop_counters()
            passed, seconds = test.run(self.build, RECORD_LIMIT_S)
            ran = self.read_counters()
            self.known["tests"][test.name] = {"key": key, "passed": passed, "seconds": seconds, "ran": ran}
            self.note(f"{test.name}: {seconds:.1f} s, {sum(map(len, ran.values()))} lines" + ("" if passed else ", fails without a fault: left out"))
            self.path.write_text(json.dumps(self.known))
        found = self.known["tests"][test.name]
        test.seconds, test.ran = found["seconds"], {f: set(lines) for f, lines in found["ran"].items()}
        if found["passed"]:
            self.tests.append(test)

    def drop_counters(self):
        for path in self.build.path.rglob("*.gcda"):
            path.unlink()

    def read_counters(self):
        """{file: lines that ran}; notes which lines are counted at all."""
        paths = [str(p) for p in self.build.path.rglob("*.gcda")]
        ran = {}
        if not paths:
            return ran
        out = subprocess.run(["gcov", "--json-format", "--stdout", *paths], cwd=TREE, check=True, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL).stdout
        for document in out.decode().splitlines():
            for f in json.loads(document)["files"] if document.strip() else []:
                if f["file"] in self.files:
                    counted = set(self.known["counted"].get(f["file"], [])) | {x["line_number"] for x in f["lines"]}
                    self.known["counted"][f["file"]] = sorted(counted)
                    ran.setdefault(f["file"], set()).update(x["line_number"] for x in f["lines"] if x["count"] > 0)
        return {name: sorted(lines) for name, lines in ran.items() if lines}

    def lines_at(self, path, first, last, function):
        """The counted lines of a place: those in it, or else the last one before it in the function (first and last line), or the
        first one behind it."""
        counted = [n for n in self.known["counted"].get(path, []) if function is None or function[0] <= n <= function[1]]
        inside = {n for n in counted if first <= n <= last}
        return inside or set([n for n in counted if n < first][-1:]) or set(counted[:1])

    def tests_of(self, path, first, last, function):
        """The tests that run a place, quickest first. A place outside of all functions belongs to all tests of the file."""
        if not path.endswith(".c"):
            return sorted((t for t in self.tests if by_name(t, path)), key=lambda t: t.seconds)
        lines = self.lines_at(path, first, last, function)
        chosen = [t for t in self.tests if (t.ran.get(path, set()) & lines if function is not None else path in t.ran)]
        return sorted(chosen, key=lambda t: t.seconds)

    def contains(self, test, path):
        """Whether a test runs the object of a file."""
        return pathlib.Path(path).name in self.build.objects_in(test.name) if test.is_c else bool(self.programs_with(path))

    def programs_with(self, path):
        return [p for p, objects in self.contents.items() if pathlib.Path(path).name in objects]


def by_name(test, path):
    """Whether a Python test uses a script of a client."""
    stem = re.escape(pathlib.Path(path).stem)
    return path.endswith(".py") and re.search(r'clients"?(/|, )"?python|import ' + stem, test.source.read_text()) is not None
