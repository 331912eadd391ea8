"""Run every test and end with "N passed, N failed[, N skipped]"; exit status 1 when one failed or none ran.

C tests are cmocka programs build/tests/{unit,physics}/test_*, Python tests are pytest folders. A program that crashes,
hangs or writes no results counts as one failed test. Each check of the sources (tests/checks.mk) counts as one test.
Each line says how long a test took and how many seconds of a core that were. Tests of the API and the browser wait for
daemons most of the time, so four of them run beside one that computes. Python files of a folder that are not long share
a Python, and a browser, FEW at a time, because a start takes half a second of a core. --quick runs the checks, the unit
tests that take at most 4 s of a core and the quick API tests, three that wait beside two that compute. --programs leaves out the checks
of the sources, which neither sanitizers nor coverage change, and runs the long unit tests in spite of --quick.
"""
import argparse
import concurrent.futures
import glob
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import threading
import time
import xml.etree.ElementTree as ElementTree

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
CHECKS = ["layers", "format-check", "columns", "lint-c", "lint-javascript", "lint-python", "lint-shell", "lint-words"]
SLOW_CHECKS = ["clang", "tsan-requests"]
# unit tests that take more than 4 s of a core, which the inner loop leaves to `make test`
LONG_UNIT_TESTS = ["unit/renderer/scattering/test_scattering", "unit/renderer/fast/test_precompute_journal", "unit/renderer/preview/test_joint_filter",
                   "unit/renderer/quick/test_dual_scattering", "unit/geometry/diameter/test_lumen_fill", "unit/geometry/reconstruct/test_lumen_refill",
                   "unit/renderer/fast/test_deep_light", "unit/renderer/glint/test_glint_surface",
                   "unit/renderer/mesh/test_drape", "unit/renderer/fast/test_fast_tables", "unit/geometry/fibers/test_shape_measure",
                   "unit/geometry/weave/test_weave_detect", "unit/renderer/preview/test_ray_filter", "unit/optimizer/report/test_hair_fit",
                   "unit/geometry/volume/test_slice_tiles", "unit/renderer/fast/test_gaussian_light", "unit/geometry/orientation/test_alignment",
                   "unit/geometry/volume/test_bad_input", "unit/geometry/reconstruct/test_reconstruct", "unit/renderer/preview/test_appearance_table"]
# limits in seconds of a core, and how long a test may use next to none
MOST_CORE_S, MOST_PYTEST_CORE_S = 600, 1500
STILL_S, STILL_CORE_S = 900, 2
# Those that take longest start first, so that no lane waits for one of them at the end.
LONGEST = ["physics/test_reconstruct_phantom", "physics/test_derivative_check", "physics/test_scan_trial", "unit/renderer/scattering/test_scattering",
           "real/test_real_input", "api/driven/test_openapi_driven", "browser/test_accessibility", "browser/test_dashboard",
           "api/worker/test_cloth_search_job", "crash/test_worker_resume", "crash/test_daemon_disk", "crash/test_daemon_kill",
           "physics/exact/test_exact_scene", "api/service/test_bodies", "browser/test_dashboard_submit", "api/worker/test_groups",
           "api/worker/test_correction_job", "api/test_recipes", "browser/test_repair", "api/worker/test_several_models",
           "api/test_supervision", "api/test_cli", "api/batches/test_batch_plan", "api/batches/test_batches", "api/service/test_rescue"]
# how many Python files share a process
FEW = 6


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


def core_seconds(pid):
    """Seconds of a core that a process and all its descendants have used so far."""
    children, used, tick = {}, {}, os.sysconf("SC_CLK_TCK")
    for path in glob.glob("/proc/[0-9]*/stat"):
        try:
            with open(path, encoding="utf-8", errors="replace") as text:
                fields = text.read().rsplit(")", 1)[1].split()
        except OSError:  # it has ended
            continue
        one = int(path.split("/")[2])
        children.setdefault(int(fields[1]), []).append(one)
        used[one] = sum(map(int, fields[11:15])) / tick  # its own, and of children that have ended
    family = [pid]
    for one in family:
        family += children.get(one, [])
    return sum(used.get(one, 0) for one in family)


def end_when_stuck(process, most_s, done, why):
    """Kills a test that uses more seconds of a core than most_s, or next to none in STILL_S: it waits for nothing. How long it
    takes says nothing, because it may share its cores with others."""
    before, since = 0, time.monotonic()
    while not done.wait(5):
        used = core_seconds(process.pid)
        if abs(used - before) > STILL_CORE_S:
            before, since = used, time.monotonic()
        if used > most_s:
            why.append(f"no end after {most_s} s of a core")
        elif time.monotonic() - since > STILL_S:
            why.append(f"no progress: less than {STILL_CORE_S} s of a core in {STILL_S} s")
        if why:
            process.kill()
            return


def run(command, most_s, environment):
    """Returns the exit code, the output and how long it took: in seconds, and in seconds of a core with all children."""
    start = time.monotonic()
    # a file instead of a pipe, because a process that outlives its test would keep a pipe open
    with tempfile.TemporaryFile() as log:
        process = subprocess.Popen(command, cwd=ROOT, env=environment, stdin=subprocess.DEVNULL, stdout=log, stderr=subprocess.STDOUT)
        done, why = threading.Event(), []
        watch = threading.Thread(target=end_when_stuck, args=(process, most_s, done, why))
        watch.start()
        # a process that is waited for keeps its number until the watch has ended, so that no other can be killed
        os.waitid(os.P_PID, process.pid, os.WEXITED | os.WNOWAIT)
        done.set()
        watch.join()
        _, status, used = os.wait4(process.pid, 0)
        seconds = time.monotonic() - start
        process.returncode = os.waitstatus_to_exitcode(status)
        log.seek(0)
        return why[0] if why else process.returncode, log.read().decode(errors="replace"), f"{seconds:.1f} s, of a core {used.ru_utime + used.ru_stime:.1f} s"


def longest_first(names):
    return sorted(names, key=lambda name: LONGEST.index(name) if name in LONGEST else len(LONGEST))


def in_groups(names, quick):
    """Lists of the names that share a process, those of the longest tests first. In the inner loop no file is long."""
    alone = [] if quick else [name for name in longest_first(names) if name in LONGEST]
    groups = [[name] for name in alone]
    folders = {}
    for name in names:
        if name not in alone:
            folders.setdefault(os.path.dirname(name), []).append(name)
    for files in folders.values():
        n_group = -(-len(files) // FEW)
        groups += [files[i::n_group] for i in range(n_group)]
    return groups


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

    def add_one(self, name, code, output, time_taken):
        with self.lock:
            self.passed += code == 0
            self.failed += code != 0
            print(f"{'ok' if code == 0 else 'FAILED':7s}{name} ({time_taken})" + ("" if code == 0 else "\n" + output), flush=True)

    def add(self, name, junit, code, output, time_taken):
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
            print(f"{state:7s}{name}: {passed} passed, {failed} failed, {skipped} skipped ({time_taken})", flush=True)
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
    environment.setdefault("SELVEDGE_TEST_PATIENCE", "8")  # limits of waiting: lanes run side by side, on machines that others load
    totals = Totals()
    environment.pop("MAKEFLAGS", None)  # a make that a check starts is no part of the one that started us

    def wanted(name):
        return arguments.only is None or arguments.only in name

    def checks():
        names = [] if arguments.programs else CHECKS if arguments.quick else CHECKS + SLOW_CHECKS
        return [name for name in names if wanted(name)]

    def run_check(name):
        totals.add_one(name, *run(["make", "--silent", f"BUILD={arguments.build}", name], MOST_CORE_S, environment))

    left_out = LONG_UNIT_TESTS if arguments.quick and not arguments.programs and arguments.only is None else []

    def c_tests():
        for kind in ["unit"] if arguments.quick else ["unit", "physics"]:
            for source in sorted(pathlib.Path(ROOT, "tests", kind).rglob("test_*.c")):
                name = str(source.relative_to(os.path.join(ROOT, "tests")))[:-2]  # "unit/base/test_rng"
                if wanted(name) and name not in left_out:
                    yield name

    def run_c(folder, name):
        junit = os.path.join(folder, name.replace("/", "."))
        totals.add(name, junit + ".*.xml", *run([os.path.join(ROOT, arguments.build, "tests", name)], MOST_CORE_S,
                                                dict(environment, CMOCKA_MESSAGE_OUTPUT="xml", CMOCKA_XML_FILE=junit + ".%g.xml")))

    def python_tests(kinds):
        for kind in kinds:
            for source in sorted(pathlib.Path(ROOT, "tests", kind).rglob("test_*.py")):
                name = str(source.relative_to(os.path.join(ROOT, "tests")))[:-3]  # "api/worker/test_skill"
                if wanted(name):
                    yield name

    def run_python(folder, names):
        name = ", ".join([names[0]] + [os.path.basename(one) for one in names[1:]])
        junit = os.path.join(folder, names[0].replace("/", ".") + ".xml")
        # A folder of its own: otherwise pytest removes the files of an earlier run before it ends, which takes many
        # seconds where there are thousands.
        files = tempfile.mkdtemp(dir=folder)
        command = ["/usr/bin/python3", "-m", "pytest", "-q", "-ra", "-p", "no:cacheprovider", f"--basetemp={files}",
                   f"--junitxml={junit}", *[os.path.join("tests", one + ".py") for one in names]]
        if arguments.quick:
            command += ["-m", "not slow"]
        code, output, time_taken = run(command, MOST_PYTEST_CORE_S, environment)
        cleaner.submit(shutil.rmtree, files, ignore_errors=True)
        if code == 5 and arguments.quick:  # all tests of the files are slow ones
            return
        totals.add(name, junit, code, output, time_taken)

    # A lane that has nothing left takes the last of the others'.
    with tempfile.TemporaryDirectory() as folder, concurrent.futures.ThreadPoolExecutor(max_workers=1) as cleaner:
        of_c, of_python = list(c_tests()), list(python_tests(["api"] if arguments.quick else ["api", "browser", "crash", "physics"]))
        real = list(python_tests([] if arguments.quick else ["real"]))
        computing = [lambda name=name: run_check(name) for name in checks()]
        computing += [lambda name=name: run_c(folder, name) if name in of_c else run_python(folder, [name]) for name in longest_first(of_c + real)]
        waiting = [lambda names=names: run_python(folder, names) for names in in_groups(of_python, arguments.quick)]
        lanes = [computing, computing, waiting, waiting, waiting] if arguments.quick else [computing, waiting, waiting, waiting, waiting]
        with concurrent.futures.ThreadPoolExecutor(max_workers=len(lanes)) as pool:
            for done in [pool.submit(run_lane, own, waiting if own is computing else computing) for own in lanes]:
                done.result()

    tail = f", {totals.skipped} skipped" if totals.skipped else ""
    print(f"{totals.passed} passed, {totals.failed} failed{tail}", flush=True)
    return 1 if totals.failed or totals.passed == 0 else 0


if __name__ == "__main__":
    sys.exit(main())
