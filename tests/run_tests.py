"""Run every test and end with "N passed, N failed[, N skipped]"; exit status 1 when one failed or none ran.

C tests are cmocka programs build/tests/{unit,physics}/test_*, Python tests are pytest folders. A program that crashes,
hangs or writes no results counts as one failed test. Each check of the sources (tests/checks.mk) counts as one test.
--quick runs the checks, the unit tests and the quick API tests, C beside Python: two compute while two wait for daemons
most of the time. --programs leaves out the checks of the sources, which neither sanitizers nor coverage change.
"""
import argparse
import concurrent.futures
import glob
import os
import pathlib
import subprocess
import sys
import tempfile
import threading
import time
import xml.etree.ElementTree as ElementTree

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
CHECKS = ["layers", "format-check", "columns", "lint-c", "lint-javascript", "lint-python", "lint-shell"]
SLOW_CHECKS = ["clang", "tsan-requests"]
TIMEOUT_S = 600
PYTEST_TIMEOUT_S = 1500


def count_junit(path):
    """Returns (passed, failed, skipped, [names of the failed], [skip messages]) of one JUnit file."""
    passed = failed = skipped = 0
    bad, why = [], []
    for case in ElementTree.parse(path).getroot().iter("testcase"):
        if case.find("failure") is not None or case.find("error") is not None:
            failed += 1
            bad.append(case.get("name"))
        elif case.find("skipped") is not None:
            skipped += 1
            why.append(f"{case.get('name')}: {case.find('skipped').get('message') or ''}")
        else:
            passed += 1
    return passed, failed, skipped, bad, why


def run(command, timeout_s, environment):
    start = time.monotonic()
    # a file instead of a pipe, because a process that outlives its test would keep a pipe open
    with tempfile.TemporaryFile() as log:
        try:
            code = subprocess.run(command, cwd=ROOT, env=environment, stdin=subprocess.DEVNULL, stdout=log,
                                  stderr=subprocess.STDOUT, timeout=timeout_s).returncode
        except subprocess.TimeoutExpired:
            code = f"no end after {timeout_s} s"
        log.seek(0)
        return code, log.read().decode(errors="replace"), time.monotonic() - start


def run_lane(own, other):
    """Runs what is in the list `own` from its front, then what is left of the other from its end; other lanes share both."""
    while own or other:
        try:
            task = own.pop(0) if own else other.pop()
        except IndexError:  # another lane was quicker
            continue
        task()


class Totals:
    def __init__(self):
        self.passed = self.failed = self.skipped = 0
        self.lock = threading.Lock()

    def add_one(self, name, code, output, seconds):
        with self.lock:
            self.passed += code == 0
            self.failed += code != 0
            print(f"{'ok' if code == 0 else 'FAILED':7s}{name} ({seconds:.1f} s)" + ("" if code == 0 else "\n" + output), flush=True)

    def add(self, name, junit, code, output, seconds):
        """junit: pattern of the files with the results, one for each group of tests."""
        passed = failed = skipped = 0
        bad, why = [], []
        for path in glob.glob(junit):
            if os.path.getsize(path) == 0:
                continue
            try:
                more = count_junit(path)
                passed, failed, skipped = passed + more[0], failed + more[1], skipped + more[2]
                bad += more[3]
                why += more[4]
            except ElementTree.ParseError:
                failed += 1
                bad.append("results unreadable")
        if passed + failed + skipped == 0 or (code != 0 and failed == 0):
            failed += 1
            bad.append(f"ended with {code}")
        with self.lock:
            self.passed += passed
            self.failed += failed
            self.skipped += skipped
            state = "FAILED" if failed else "ok"
            print(f"{state:7s}{name}: {passed} passed, {failed} failed, {skipped} skipped ({seconds:.1f} s)", flush=True)
            for line in why:
                print(f"       skipped {line}")
            if failed:
                print(f"       failed: {', '.join(str(b) for b in bad)}")
                print("\n".join("       | " + line for line in output.splitlines()[-80:]), flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--build", default="build")
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--programs", action="store_true")
    parser.add_argument("--only", help="run only what has this in its name")
    arguments = parser.parse_args()
    environment = dict(os.environ, SELVEDGE_BUILD=os.path.join(ROOT, arguments.build), OPENBLAS_NUM_THREADS="1")
    environment.setdefault("SELVEDGE_DATA", os.path.join(ROOT, "..", "shared", "data"))
    totals = Totals()
    environment.pop("MAKEFLAGS", None)  # a make that a check starts is no part of the one that started us

    def wanted(name):
        return arguments.only is None or arguments.only in name

    def checks():
        names = [] if arguments.programs else CHECKS if arguments.quick else CHECKS + SLOW_CHECKS
        return [name for name in names if wanted(name)]

    def run_check(name):
        totals.add_one(name, *run(["make", "--silent", f"BUILD={arguments.build}", name], TIMEOUT_S, environment))

    def c_tests():
        for kind in ["unit"] if arguments.quick else ["unit", "physics"]:
            for source in sorted(pathlib.Path(ROOT, "tests", kind).rglob("test_*.c")):
                name = str(source.relative_to(os.path.join(ROOT, "tests")))[:-2]  # "unit/base/test_rng"
                if wanted(name):
                    yield name

    def run_c(folder, name):
        junit = os.path.join(folder, name.replace("/", "."))
        code, output, seconds = run([os.path.join(ROOT, arguments.build, "tests", name)], TIMEOUT_S,
                                    dict(environment, CMOCKA_MESSAGE_OUTPUT="xml", CMOCKA_XML_FILE=junit + ".%g.xml"))
        totals.add(name, junit + ".*.xml", code, output, seconds)

    def python_tests(kinds):
        for kind in kinds:
            for source in sorted(pathlib.Path(ROOT, "tests", kind).rglob("test_*.py")):
                name = str(source.relative_to(os.path.join(ROOT, "tests")))[:-3]  # "api/worker/test_skill"
                if wanted(name):
                    yield name

    def run_python(folder, name):
        junit = os.path.join(folder, name.replace("/", ".") + ".xml")
        command = ["/usr/bin/python3", "-m", "pytest", "-q", "-ra", "-p", "no:cacheprovider",
                   f"--junitxml={junit}", os.path.join("tests", name + ".py")]
        if arguments.quick:
            command += ["-m", "not slow"]
        code, output, seconds = run(command, PYTEST_TIMEOUT_S, environment)
        if code == 5 and arguments.quick:  # all tests of the file are slow ones
            return
        totals.add(name, junit, code, output, seconds)

    # One lane computes and one waits for daemons and browsers most of the time; with --quick there are two of each. A lane
    # that has nothing left takes the last of the other's.
    with tempfile.TemporaryDirectory() as folder:
        computing = [lambda name=name: run_check(name) for name in checks()]
        computing += [lambda name=name: run_c(folder, name) for name in c_tests()]
        waiting = [lambda name=name: run_python(folder, name) for name in python_tests(["api"] if arguments.quick else ["api", "browser"])]
        computing += [lambda name=name: run_python(folder, name) for name in python_tests([] if arguments.quick else ["crash", "real"])]
        lanes = [computing, waiting] * (2 if arguments.quick else 1)
        with concurrent.futures.ThreadPoolExecutor(max_workers=len(lanes)) as pool:
            for done in [pool.submit(run_lane, own, waiting if own is computing else computing) for own in lanes]:
                done.result()

    tail = f", {totals.skipped} skipped" if totals.skipped else ""
    print(f"{totals.passed} passed, {totals.failed} failed{tail}", flush=True)
    return 1 if totals.failed or totals.passed == 0 else 0


if __name__ == "__main__":
    sys.exit(main())
