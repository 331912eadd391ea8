"""make mutants: put small faults into a copy of the tree, one at a time, and see whether its tests notice.

Figures go to standard output as JSON lines, progress to standard error, survivors to build/mutants/survivors-SEED.txt, every mutant
to build/mutants/mutants-SEED.jsonl. A mutant is caught when a test fails, or has no end, and passes without the fault. Mutants that do not
compile, or whose object code is the same at -O2, do not count, nor do those of explained.txt. Only tests that run the faulty line
are tried, the quickest first. Exit status 1 when fewer than 95 % are caught.
"""
import argparse
import collections
import concurrent.futures
import json
import os
import pathlib
import random
import re
import subprocess
import sys
import threading
import time

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from faults import faults_of  # noqa: E402
from line_coverage import Coverage  # noqa: E402
from mutant_build import SANDBOX, TREE, WORK, Build, Compiler, Linker, check_script, clean_scratch, copy_tree  # noqa: E402
from parts import GATE, LANGUAGE, WHOLE, Explained, files_of  # noqa: E402

GOAL = 0.95
SLOW_FACTOR, SLOW_S = 8.0, 10.0  # a test that takes SLOW_S seconds and SLOW_FACTOR times as long as usual hangs


def note(text):
    print(text, file=sys.stderr, flush=True)


def functions_of(text):
    """(first, last) lines of the functions of a formatted C file, from the brace to the brace in the first column."""
    lines = text.split("\n")
    opening = None
    for i, line in enumerate(lines, 1):
        if line == "{":
            opening = i
        elif line == "}" and opening is not None:
            yield opening, i
            opening = None
        elif re.match(r"[a-z].*\) \{ .* \}$", line):
            yield i, i


class Sampler:
    """Draws faults of one part: a file by its number of faults, then the operator, then the place."""

    def __init__(self, seed, name, part):
        self.random = random.Random(f"{seed} {name}")
        self.faults = {}  # file -> operator -> faults
        for path in files_of(TREE, part):
            by_operator = collections.defaultdict(list)
            for f in faults_of(path, (TREE / path).read_text(), LANGUAGE[pathlib.Path(path).suffix]):
                by_operator[f.operator].append(f)
            if by_operator:
                self.faults[path] = by_operator

    def draw(self):
        """A fault that was not drawn before, or None."""
        if not self.faults:
            return None
        weight = [sum(len(v) for v in operators.values()) for operators in self.faults.values()]
        path = self.random.choices(list(self.faults), weight)[0]
        operators = self.faults[path]
        operator = self.random.choice(sorted(operators))
        fault = operators[operator].pop(self.random.randrange(len(operators[operator])))
        if not operators[operator]:
            del operators[operator]
        if not operators:
            del self.faults[path]
        return fault


class Judge:
    """Tries faults one after the other, in a build of its own; judges work side by side."""

    def __init__(self, coverage, limit_s, name):
        self.coverage, self.limit_s = coverage, limit_s
        self.clean, self.faulty = Build("clean"), Build(name)
        self.compiler, self.linker = Compiler(self.clean, name), Linker(self.clean, self.faulty)
        self.explained = Explained()

    def things_for(self, test, path):
        """What has to be built for a test."""
        return [test.name] if test.is_c else self.coverage.programs_with(path)

    def prepare(self):
        """Builds everything without a fault."""
        built = self.clean.has([*self.coverage.contents, *(t.name for t in self.coverage.tests if t.is_c)], options=["-j2"])
        if built.returncode != 0:
            raise SystemExit(f"mutants: the copy of the tree does not build:\n{built.stdout[-3000:]}")
        self.linker.restore(self.coverage.contents)

    def tests_for(self, fault, part):
        text = (TREE / fault.path).read_text()
        last = text.count("\n", 0, fault.end) + 1
        function = next((f for f in functions_of(text) if f[0] <= fault.line <= f[1]), None) if fault.path.endswith(".c") else None
        chosen = self.coverage.tests_of(fault.path, fault.line, last, function)
        chosen = [t for t in chosen if t.name.startswith(tuple(part[1]))]
        always = [t for t in self.coverage.tests if t not in chosen and any(t.name.startswith(b) for b in part[2]) and
                  self.coverage.contains(t, fault.path)]
        return sorted(chosen + always, key=lambda t: (not t.is_c, t.seconds))

    def link(self, test, path):
        """What a test runs, with the faulty object; scripts need nothing."""
        return not path.endswith(".c") or all(self.linker.link(thing, path, self.compiler.object) for thing in self.things_for(test, path))

    def passes(self, test, build, limit_s):
        clean_scratch(self.faulty)  # a test that crashed leaves files, and its number as a process, which may name them, comes again
        return test.run(build, limit_s, self.faulty.scratch)[0]

    def try_tests(self, fault, tests):
        """("caught" or "survived" or "unfinished" or "invalid", test)"""
        start, linked = time.monotonic(), False
        for t in tests:
            if time.monotonic() - start > self.limit_s:
                return "unfinished", ""
            if not (linked and not t.is_c) and not self.link(t, fault.path):
                return "invalid", t.name
            linked = linked or not t.is_c
            limit_s = max(SLOW_S, SLOW_FACTOR * t.seconds)
            if not self.passes(t, self.faulty, limit_s) and self.passes(t, self.clean, limit_s):
                return "caught", t.name
        return "survived", ""

    def examine(self, fault, part):
        """The record of a fault."""
        start = time.monotonic()
        target = TREE / fault.path
        original = target.read_text()
        mutated = fault.apply(original)
        before, after = change_of(fault, original)
        record = {"file": fault.path, "line": fault.line, "operator": fault.operator, "before": before, "after": after,
                  "start": fault.start, "end": fault.end, "new": fault.new, "test": "", "n_test": 0}
        record["verdict"] = self.compiler.verdict(fault.path, original, mutated) if fault.path.endswith(".c") else check_script(fault.path, mutated)
        if record["verdict"] is None and self.explained.reason_of(fault.path, before, after) is not None:
            record["verdict"] = "explained"
        if record["verdict"] is None:
            tests = self.tests_for(fault, part)
            if not fault.path.endswith(".c"):
                target.write_text(mutated)
            try:
                record["verdict"], record["test"] = self.try_tests(fault, tests)
            finally:
                target.write_text(original)
                self.linker.restore(self.coverage.programs_with(fault.path))
            record["n_test"] = len(tests)
        record["seconds"] = round(time.monotonic() - start, 1)
        return record


def change_of(fault, text):
    """The lines that the fault changes, before and after, each as one line."""
    start = text.rfind("\n", 0, fault.start) + 1
    end = text.find("\n", fault.end)
    join = lambda lines: " ".join(lines.split())
    return join(text[start:end]), join(text[start:fault.start] + fault.new + text[fault.end:end])


class Records:
    """What was found about faults, kept in build/mutants for each seed."""

    def __init__(self, seed):
        self.path, self.survivors = WORK / f"mutants-{seed}.jsonl", WORK / f"survivors-{seed}.txt"
        self.list, self.lock = [], threading.Lock()

    def read(self):
        self.list = [json.loads(line) for line in open(self.path)]

    def put(self, record, i=None):
        """Adds a record, or replaces the i-th."""
        if i is None:
            self.list.append(record)
        else:
            self.list[i] = record
        with open(self.path, "w") as f:
            f.writelines(json.dumps(r) + "\n" for r in self.list)
        self.write_survivors()
        r = record
        note(f"{len(self.list) if i is None else i + 1} {r['part']} {r['file']}:{r['line']} {r['operator']}: {r['verdict']} {r['test']} "
             f"({r['n_test']} tests, {r['seconds']:.1f} s)")

    def write_survivors(self):
        """As explained.txt has them, so that a line of reason makes one an explained fault."""
        with open(self.survivors, "w") as f:
            for r in self.list:
                if r["verdict"] in ("survived", "unfinished"):
                    f.write(f"{r['file']}: line {r['line']}, {r['operator']}, {r['verdict']} after {r['n_test']} tests in {r['seconds']:.0f} s\n"
                            f"  - {r['before']}\n  + {r['after']}\n")


def draw_and_judge(name, part, sampler, judge):
    """The record of the next fault of a part that can be judged, or None when there is none left."""
    while (fault := sampler.draw()) is not None:
        record = dict(judge.examine(fault, part), part=name)
        if record["verdict"] not in ("invalid", "equivalent"):
            return record
    return None


def side_by_side(judges, work):
    with concurrent.futures.ThreadPoolExecutor(len(judges)) as pool:
        list(pool.map(work, judges))


def sample(n_fault, seed, parts, judges, records):
    """Draws and judges n_fault faults, as many of each part; explained ones come on top. No part is with two judges at a time, so the
    choice of faults does not depend on their number."""
    samplers = {name: Sampler(seed, name, part) for name, part in parts.items()}
    missing = {name: n_fault // len(parts) + (i < n_fault % len(parts)) for i, name in enumerate(parts)}
    waiting = collections.deque(name for name in parts if missing[name] > 0)

    def work(judge):
        while True:
            with records.lock:
                if not waiting:
                    return
                name = waiting.popleft()
            record = draw_and_judge(name, parts[name], samplers[name], judge)
            with records.lock:
                if record is None:
                    continue
                records.put(record)
                missing[name] -= record["verdict"] != "explained"
                if missing[name] > 0:
                    waiting.append(name)
    side_by_side(judges, work)


def find_again(r):
    """The fault of a record, or None: its file may have moved, and have changed elsewhere. Names of files are unique in the tree."""
    path = next((p for p in TREE.rglob(pathlib.Path(r["file"]).name) if "build" not in p.relative_to(TREE).parts), None)
    if path is None:
        return None
    text, path = path.read_text(), str(path.relative_to(TREE))
    same = [f for f in faults_of(path, text, LANGUAGE[pathlib.Path(path).suffix])
            if f.operator == r["operator"] and change_of(f, text) == (r["before"], r["after"])]
    return min(same, key=lambda f: abs(f.line - r["line"]), default=None)


def sample_again(parts, judges, records):
    """Judges again those of the last run that were not caught, as far as their lines are still there."""
    records.read()
    waiting = collections.deque(i for i, r in enumerate(records.list) if r["part"] in parts and r["verdict"] not in ("caught", "explained"))

    def work(judge):
        while True:
            with records.lock:
                if not waiting:
                    return
                i = waiting.popleft()
            r = records.list[i]
            fault = find_again(r)
            if fault is None:
                note(f"{r['file']} has changed: its faults need a new sample")
                continue
            record = dict(judge.examine(fault, parts[r["part"]]), part=r["part"])
            with records.lock:
                records.put(record, i)
    side_by_side(judges, work)


def figure(name, value, unit, better):
    print(json.dumps({"name": name, "value": value, "unit": unit, "better": better}), flush=True)


def report(records):
    """Figures, and a table; returns the share of all that was caught. Explained faults count neither way."""
    by_part = collections.defaultdict(collections.Counter)
    for r in records:
        for key in (r["part"], "all"):
            by_part[key][r["verdict"]] += 1
    note(f"{'part':20s}{'faults':>8s}{'caught':>8s}{'share':>8s}{'explained':>11s}")
    share = {}
    for part, n in by_part.items():
        judged = sum(n.values()) - n["explained"]
        share[part] = n["caught"] / max(1, judged)
        note(f"{part:20s}{judged:8d}{n['caught']:8d}{100 * share[part]:7.1f}%{n['explained']:11d}")
        figure(f"guard.mutants.{part.replace('/', '_')}.caught", round(share[part], 4), "1", "higher")
    return share.get("all", 0.0)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--mutants", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--part", help="one of the parts, or only files whose path begins so")
    parser.add_argument("--limit-s", type=float, default=60, help="of the tests of one mutant")
    parser.add_argument("--whole", action="store_true", help="the whole tree in place of the parts of the gate")
    parser.add_argument("--judges", type=int, default=2, help="faults tried side by side")
    parser.add_argument("--again", action="store_true", help="judge the faults of the last run that were not caught once more")
    arguments = parser.parse_args()
    os.nice(10)
    every = WHOLE if arguments.whole else GATE
    parts = every if arguments.part is None else {arguments.part: every.get(arguments.part, ([arguments.part], ["unit/", "api/"], []))}
    TREE.mkdir(parents=True, exist_ok=True)
    copy_tree()
    if subprocess.run([SANDBOX, WORK, Build("clean").scratch, "true"], check=False).returncode != 0:
        sys.exit("mutants: programs with faults need a sandbox: root, or user namespaces (unshare)")
    counted, name = (every, "whole" if arguments.whole else "gate") if set(parts) <= set(every) else (parts, arguments.part.replace("/", "-"))
    coverage = Coverage(name, [f for part in counted.values() for f in files_of(TREE, part)],
                        sorted({b for part in counted.values() for b in part[1]}), note)
    coverage.record()
    judges = [Judge(coverage, arguments.limit_s, f"faulty-{i}") for i in range(1 if arguments.whole else arguments.judges)]
    for judge in judges:
        judge.prepare()
    records = Records(arguments.seed)
    if arguments.again:
        sample_again(parts, judges, records)
    else:
        sample(arguments.mutants, arguments.seed, parts, judges, records)
    note(records.survivors.read_text())
    if report([r for r in records.list if r["part"] in parts]) < GOAL:
        sys.exit(f"mutants: the tests catch fewer than {100 * GOAL:.0f} %")


if __name__ == "__main__":
    main()
