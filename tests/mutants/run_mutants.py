"""make mutants: put small faults into a copy of the tree, one at a time, and see whether `make test` notices.

Figures go to standard output as JSON lines, progress to standard error, survivors to build/mutants/survivors.txt, every mutant to
build/mutants/mutants.jsonl. A mutant is caught when a test fails, or runs far longer than it should, and passes again without it. Mutants that do
not compile, or whose object code is the same at -O2, do not count. Tests that cannot be affected (programs that do not
contain the object) are left out, and those that are near to the file run first.
"""
import argparse
import collections
import json
import os
import pathlib
import random
import re
import shutil
import subprocess
import sys
import time

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from faults import faults_of  # noqa: E402

ROOT = pathlib.Path(__file__).resolve().parents[2]
WORK = ROOT / "build" / "mutants"
TREE = WORK / "tree"
SANDBOX = ROOT / "tests" / "mutants" / "sandbox.sh"
# parts and how large a share of the mutants each of them gets
PARTS = {"base": 8, "geometry": 24, "renderer": 24, "optimizer": 26, "server": 12, "clients/cli": 6, "clients/dashboard": 4, "clients/python": 2}
LANGUAGE = {".c": "c", ".js": "js", ".py": "py"}
COMPILE = "WERROR=-Werror=incompatible-pointer-types -Werror=int-conversion -Werror=array-bounds"
PROGRAMS = ["selvedge", "selvedged", "selvedge-worker", "selvedge-phantom", "selvedge-camera"]
LINK_S = 2.0  # what building one test costs beside running it
SLOW_FACTOR, SLOW_S = 8.0, 20.0  # a test that takes SLOW_S seconds and SLOW_FACTOR times as long as usual hangs


def note(text):
    print(text, file=sys.stderr, flush=True)


def copy_tree():
    """The files that git knows, as they are now; only what changed is written, so that objects stay valid."""
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True).stdout
    names = {n for n in listed.split("\0") if n and (ROOT / n).is_file()}
    for old in [p for p in TREE.rglob("*") if p.is_file() and "build" not in p.relative_to(TREE).parts]:
        if str(old.relative_to(TREE)) not in names:
            old.unlink()
    for name in names:
        source, target = ROOT / name, TREE / name
        if target.is_file() and target.read_bytes() == source.read_bytes():
            continue
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(source, target)
    subprocess.run(["git", "init", "-q"], cwd=TREE, check=True)  # checks of the documents ask git for the names of files


def make(*targets, jobs=None):
    """Builds in the copy; every program leaves a link map that names the objects in it."""
    command = ["make", "--no-print-directory", f"-j{jobs or os.cpu_count()}", COMPILE, "LDFLAGS=-Wl,-Map=$@.map", *targets]
    return subprocess.run(command, cwd=TREE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)


class Test:
    def __init__(self, name, command, program):
        self.name, self.command, self.program = name, command, program  # program: what make builds for it, None for Python
        self.seconds = None

    def run(self, limit_s):
        """(passed, seconds); a test that has no end fails."""
        start = time.monotonic()
        environment = dict(os.environ, SELVEDGE_BUILD="/mnt/tree/build", OPENBLAS_NUM_THREADS="1", SELVEDGE_DATA=data_folder(), PYTHONDONTWRITEBYTECODE="1")
        process = subprocess.Popen([SANDBOX, WORK, *self.command], stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                                   stderr=subprocess.DEVNULL, env=environment)
        try:
            code = process.wait(limit_s)
        except subprocess.TimeoutExpired:
            process.kill()  # and with it everything in its namespace
            process.wait()
            code = -1
        return code in (0, 5), time.monotonic() - start  # 5: pytest has nothing to run


def data_folder():
    return os.path.realpath(os.environ.get("SELVEDGE_DATA") or ROOT / ".." / "shared" / "data")


def all_tests(quick):
    tests = []
    for kind in ["unit"] if quick else ["unit", "physics"]:
        for source in sorted((TREE / "tests" / kind).rglob("test_*.c")):
            program = str(pathlib.Path("build", source.relative_to(TREE)).with_suffix(""))
            tests.append(Test(str(source.relative_to(TREE / "tests").with_suffix("")), [program], program))
    for kind in ["api"] if quick else ["api", "crash", "browser", "real"]:
        for source in sorted((TREE / "tests" / kind).rglob("test_*.py")):
            name = str(source.relative_to(TREE))
            command = ["/usr/bin/python3", "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", name]
            tests.append(Test(name[len("tests/"):-3], command + (["-m", "not slow"] if quick else []), None))
    return tests


def time_tests(tests, quick):
    """How long each test takes; kept from run to run. Tests that fail without any fault are dropped."""
    path = WORK / ("seconds-quick.json" if quick else "seconds.json")
    known = json.loads(path.read_text()) if path.exists() else {}
    for t in tests:
        if t.name not in known:
            passed, seconds = t.run(1500)
            known[t.name] = seconds if passed else None
            note(f"{t.name}: {seconds:.1f} s" + ("" if passed else ", fails without a fault and is left out"))
            path.write_text(json.dumps(known, indent=1))
        t.seconds = known[t.name]
    return [t for t in tests if t.seconds is not None]


def objects_in(program):
    """Names of the objects ("upload.c.o") that the linker took for a program."""
    text = (TREE / (program + ".map")).read_text(errors="replace")
    return set(re.findall(r"([\w.]+\.(?:c|cpp)\.o)\b", text))


class Selection:
    """Which tests a fault in a file can make fail, the likeliest first."""

    def __init__(self, tests):
        self.tests = tests
        self.contents = {t.program: objects_in(t.program) for t in tests if t.program}
        self.of_program = {p: objects_in(f"build/bin/{p}") for p in PROGRAMS}
        self.source = {t.name: self.read_source(t) for t in tests}
        for t in tests:
            if t.program is None:
                self.contents[t.name] = set().union(*(self.of_program[p] for p in self.programs_of(t)))

    @staticmethod
    def read_source(test):
        paths = [TREE / "tests" / (test.name + ending) for ending in (".c", ".py")]
        return next(p.read_text() for p in paths if p.exists())

    def programs_of(self, test):
        """The programs that a Python test runs, by the names in it and in the modules of tests/support that it uses; all when none is named."""
        text = self.source[test.name]
        for module in ("small_cloth", "real_jobs"):
            if module in text:
                text += next(p for p in (TREE / "tests").rglob(module + ".py")).read_text()
        named = {p for p in PROGRAMS if f'"{p}"' in text or p in ("selvedge-worker", "selvedge-phantom") and p in text}
        return named | ({"selvedged"} if "aemon" in text else set()) or set(PROGRAMS)

    def affected(self, path):
        name = pathlib.Path(path).name
        if path.endswith(".js"):
            return [t for t in self.tests if t.name.startswith("browser/")]
        if path.endswith(".py"):
            return [t for t in self.tests if re.search(r'clients"?(/|, )"?python|import ' + pathlib.Path(path).stem, self.source[t.name])]
        return [t for t in self.tests if name + ".o" in self.contents[t.program or t.name]]

    def likeliness(self, test, path):
        p = pathlib.Path(path)
        stem_words, test_words = set(p.stem.split("_")), set(pathlib.Path(test.name).name.split("_"))
        score = 2 * len(stem_words & test_words)
        score += 4 * (f'"{p.with_suffix(".h")}"' in self.source[test.name])
        score += 2 * (f'"{p.parent}/' in self.source[test.name])
        score += 2 * (p.parts[0] in test.name.split("/") or (p.parts[0] == "server" and test.name.startswith("api/")) or (
            path.startswith("clients/cli") and "cli" in test_words))
        return score

    def ordered(self, path):
        """Those of some likeliness by it, but quick ones before slow ones; the others by time."""
        def cost(t):
            return (t.seconds + LINK_S) / (1 + self.likeliness(t, path)) ** 2
        return sorted(self.affected(path), key=cost)


def source_files(part):
    for path in sorted((TREE / part).rglob("*")):
        if path.is_file() and path.suffix in LANGUAGE:
            yield str(path.relative_to(TREE))


class Sampler:
    """Draws faults: the part by its share, then the file by its number of faults, then the operator, then the place."""

    def __init__(self, seed, only, selection):
        self.random = random.Random(seed)
        self.faults = {}  # part -> file -> operator -> faults
        for part in PARTS:
            files = {}
            for path in source_files(part):
                if only is not None and not path.startswith(only):
                    continue
                text = (TREE / path).read_text()
                if path.endswith(".js") and not selection.affected(path):
                    continue  # the browser tests are no quick ones
                by_operator = collections.defaultdict(list)
                for f in faults_of(path, text, LANGUAGE[pathlib.Path(path).suffix]):
                    by_operator[f.operator].append(f)
                if by_operator:
                    files[path] = by_operator
            if files:
                self.faults[part] = files
        self.n_possible = sum(len(v) for files in self.faults.values() for o in files.values() for v in o.values())

    def part_of_next(self, done):
        """The part that is farthest behind its share."""
        return min(self.faults, key=lambda p: (done[p] + 0.5) / PARTS[p])

    def draw(self, part):
        files = self.faults[part]
        weight = [sum(len(v) for v in operators.values()) for operators in files.values()]
        path = self.random.choices(list(files), weight)[0]
        operators = files[path]
        operator = self.random.choice(sorted(operators))
        fault = operators[operator].pop(self.random.randrange(len(operators[operator])))
        if not operators[operator]:
            del operators[operator]
        if not operators:
            del files[path]
        if not files:
            del self.faults[part]
        return fault


def object_code(path):
    """The object of a C file at -O2 without debugging information; None when it does not compile."""
    plan = make("-n", "-W", path, f"build/obj/{path}.o").stdout
    line = next((x for x in plan.splitlines() if f"-c {path} " in x), None)
    if line is None:
        raise RuntimeError(f"make says no command for {path}:\n{plan}")
    out = str(WORK / "compared.o")
    words = [w for w in line.split() if w not in ("-g", "-O3", "-MMD", "-MP")]
    words = words[:words.index("-o")] + ["-O2", "-o", out]
    if subprocess.run(words, cwd=TREE, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL).returncode != 0:
        return None
    return pathlib.Path(out).read_bytes()


def differs(fault, original, mutated):
    """Whether the fault compiles and changes the program: "invalid", "equivalent" or None."""
    target = TREE / fault.path
    if fault.path.endswith(".py"):
        try:
            compile(mutated, fault.path, "exec")
        except SyntaxError:
            return "invalid"
        return None
    if fault.path.endswith(".js"):
        if shutil.which("node") is None:
            return None
        probe = WORK / "probe.mjs"
        probe.write_text(mutated)
        return None if subprocess.run(["node", "--check", probe], stderr=subprocess.DEVNULL).returncode == 0 else "invalid"
    before = object_code(fault.path)
    target.write_text(mutated)
    after = object_code(fault.path)
    target.write_text(original)
    if before is None:
        raise RuntimeError(f"'{fault.path}' does not compile without a fault")
    return "invalid" if after is None else "equivalent" if after == before else None


def clean_scratch():
    shutil.rmtree(WORK / "tmp", ignore_errors=True)
    (WORK / "tmp").mkdir()


def build_for(test):
    """Builds what a test runs, from the copy as it is now."""
    return make(*([test.program] if test.program else (f"build/bin/{p}" for p in PROGRAMS))).returncode == 0


def caught_by(test, failed_after_s, limit_s, target, original):
    """Whether a test that failed, or had no end within its limit, has caught the fault: it passes without the fault, and in far
    less time. On a busy machine it may fail for other reasons."""
    mutated = target.read_text()
    target.write_text(original)
    try:
        passed, seconds = test.run(SLOW_FACTOR * limit_s) if build_for(test) else (False, 0.0)
        return passed and (failed_after_s < limit_s or failed_after_s > 0.5 * SLOW_FACTOR * seconds)
    finally:
        target.write_text(mutated)


def try_tests(fault, selection, original, limit_s):
    """("caught" or "survived" or "unfinished", the test that failed, seconds); the copy holds the fault."""
    start = time.monotonic()
    for t in selection.ordered(fault.path):
        if time.monotonic() - start > limit_s:
            return "unfinished", "", time.monotonic() - start
        if not build_for(t):
            return "invalid", t.name, 0.0
        test_limit_s = max(SLOW_S, SLOW_FACTOR * t.seconds)
        passed, seconds = t.run(test_limit_s)
        if not passed and caught_by(t, seconds, test_limit_s, TREE / fault.path, original):
            return "caught", t.name, time.monotonic() - start
    return "survived", "", time.monotonic() - start


def examine(fault, selection, limit_s):
    target = TREE / fault.path
    original = target.read_text()
    mutated = fault.apply(original)
    verdict = differs(fault, original, mutated)
    if verdict is not None:
        return verdict, "", 0.0
    clean_scratch()
    target.write_text(mutated)
    try:
        return try_tests(fault, selection, original, limit_s)
    finally:
        target.write_text(original)


def change_of(fault):
    """The lines that the fault changes, before and after."""
    text = (TREE / fault.path).read_text()
    start = text.rfind("\n", 0, fault.start) + 1
    end = text.find("\n", fault.end)
    return text[start:end].strip(), (text[start:fault.start] + fault.new + text[fault.end:end]).strip()


def describe(fault, verdict, test, seconds):
    before, after = change_of(fault)
    return {"file": fault.path, "line": fault.line, "operator": fault.operator, "verdict": verdict, "test": test, "seconds": round(seconds, 1),
            "before": before, "after": after}


def write_survivors(records):
    with open(WORK / "survivors.txt", "w") as f:
        for r in records:
            if r["verdict"] in ("survived", "unfinished"):
                f.write(f"{r['file']}:{r['line']}: {r['operator']} ({r['verdict']} after {r['seconds']:.0f} s)\n  - {r['before']}\n  + {r['after']}\n")


def figure(name, value, unit, better):
    print(json.dumps({"name": name, "value": value, "unit": unit, "better": better}), flush=True)


def report(records):
    by_part = collections.defaultdict(list)
    for r in records:
        by_part[next(p for p in PARTS if r["file"].startswith(p + "/"))].append(r["verdict"] == "caught")
    all_caught = [c for values in by_part.values() for c in values]
    for part, caught in sorted(by_part.items()):
        figure(f"mutants.{part.replace('/', '.')}.caught_share", round(sum(caught) / len(caught), 4), "1", "higher")
        figure(f"mutants.{part.replace('/', '.')}.n", len(caught), "1", "higher")
    figure("mutants.caught_share", round(sum(all_caught) / max(1, len(all_caught)), 4), "1", "higher")
    figure("mutants.n", len(all_caught), "1", "higher")
    figure("mutants.survived", len(all_caught) - sum(all_caught), "1", "lower")


def prepare(quick):
    """The copy, built, and its tests with their times."""
    TREE.mkdir(parents=True, exist_ok=True)
    clean_scratch()
    if subprocess.run([SANDBOX, WORK, "true"]).returncode != 0:
        sys.exit("mutants: programs with faults need a sandbox: root, or user namespaces (unshare)")
    copy_tree()
    built = make("all", "build-tests")
    if built.returncode != 0:
        sys.exit(f"mutants: the copy of the tree does not build:\n{built.stdout[-3000:]}")
    return Selection(time_tests(all_tests(quick), quick))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--mutants", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--part", help="only files whose path begins so")
    parser.add_argument("--limit-s", type=float, default=900, help="of the tests of one mutant")
    parser.add_argument("--quick", action="store_true", help="the tests of `make check` in place of those of `make test`")
    arguments = parser.parse_args()
    selection = prepare(arguments.quick)
    sampler = Sampler(arguments.seed, arguments.part, selection)
    note(f"{sampler.n_possible} possible faults")
    records, done, discarded = [], collections.Counter(), collections.Counter()
    with open(WORK / "mutants.jsonl", "w") as log:
        while len(records) < arguments.mutants and sampler.faults:
            part = sampler.part_of_next(done)
            fault = sampler.draw(part)
            verdict, test, seconds = examine(fault, selection, arguments.limit_s)
            if verdict in ("invalid", "equivalent"):
                discarded[verdict] += 1
                continue
            done[part] += 1
            records.append(describe(fault, verdict, test, seconds))
            log.write(json.dumps(records[-1]) + "\n")
            log.flush()
            write_survivors(records)
            note(f"{len(records)}/{arguments.mutants} {fault.path}:{fault.line} {fault.operator}: {verdict} {test} ({seconds:.0f} s)")
    note(f"left out: {discarded['invalid']} that do not compile, {discarded['equivalent']} with the same object code")
    note((WORK / "survivors.txt").read_text())
    report(records)


if __name__ == "__main__":
    main()
