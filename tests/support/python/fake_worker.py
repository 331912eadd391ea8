#!/usr/bin/python3
"""A worker for tests of the daemon. The job's sample name selects its behaviour ("fake: crash_once"); it uses the real
layout of job folders. It counts its runs in work/runs to distinguish "once" from "always"."""
import fcntl
import json
import mmap
import os
import resource
import signal
import sys
import time
import zlib

if "--check" in sys.argv:
    print('{"faults": [], "warnings": [], "files": [], "n_file": 0}')
    sys.exit(0)
if "--plan" in sys.argv:
    with open(os.path.join(sys.argv[-1], "job.json")) as f:
        sample = json.load(f)["sample"]
    if "unplanned" in sample:
        print(json.dumps({"error": {"code": "format", "field": "volume.files", "text": "cannot read volume 'scan.tif'"}}))
        sys.exit(1)
    while os.path.exists(os.path.join(sys.argv[-1], "hold")):
        time.sleep(0.01)
    wall_s = float(sample.partition("planned ")[2] or 10)  # "fake: work 60, planned 600"
    print(json.dumps({"error": None, "n_thread": 2, "wall_s": wall_s, "wall_low_s": wall_s / 2, "wall_high_s": 2 * wall_s, "cpu_s": 16,
                      "memory_bytes": 1e8, "disk_bytes": 5e6, "stages": [{"name": "fit", "wall_s": wall_s}]}))
    sys.exit(0)

job = sys.argv[-1]
os.makedirs(os.path.join(job, "work"), exist_ok=True)
os.makedirs(os.path.join(job, "results", "pictures"), exist_ok=True)
lock = open(os.path.join(job, "lock"), "w")
try:
    fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
except OSError:
    sys.exit(4)
with open(os.path.join(job, "attempt.json")) as f:
    attempt = json.load(f)["attempt"]
with open(os.path.join(job, "job.json")) as f:
    document = json.load(f)
behaviour, _, argument = document["sample"].removeprefix("fake: ").partition(" ")
with open(os.path.join(job, "work", "runs"), "a+") as f:
    f.seek(0)
    run = len(f.read()) + 1
    f.write("x")


def put(path, text):
    temporary = os.path.join(job, path + ".tmp-fake00")
    with open(temporary, "w") as f:
        f.write(text)
        if behaviour == "synced":
            f.flush()
            os.fsync(f.fileno())
    os.rename(temporary, os.path.join(job, path))
    while behaviour == "synced" and path:
        path = os.path.dirname(path)
        folder = os.open(os.path.join(job, path), os.O_RDONLY)
        os.fsync(folder)
        os.close(folder)


def say(state, fraction, error=None, clock_s=0):
    put("status.json", json.dumps({
        "state": state, "attempt": attempt, "stage": "fit", "i_stage": 5, "n_stage": 8, "stage_fraction": fraction,
        "fraction": fraction, "eta_s": 10 * (1 - fraction), "heartbeat_unix_s": time.time() + clock_s, "started_unix_s": time.time(),
        "message": f"run {run}", "objective": 1 - fraction, "objective_se": 0.01, "step": int(10 * fraction),
        "warnings": ["a warning"] if fraction > 0 else [], "error": error, "peak_rss_bytes": 1000000, "cpu_s": 4.0}))


def record(step):
    text = json.dumps({"step": step, "phase": "fake", "wall_s": step, "n_path": 10, "n_path_total": 10 * step,
                       "objective": (step * 37) % 101 + 0.5, "objective_se": 0.1, "parameter": [step, -step, (step * 17) % 23],
                       "parameter_se": None, "rel_rms": 0.1, "rendered": [[0.1, 0.2, 0.3]], "note": ""})
    with open(os.path.join(job, "series.rec"), "a") as f:
        f.write(f"{zlib.crc32(text.encode()):08x} {text}\n")


def log(text):
    with open(os.path.join(job, "log.txt"), "a") as f:
        f.write(text + "\n")


def finish():
    put("results/result.json", json.dumps({"parameters": [{"name": "beta_R", "value": 5.0, "standard_error": 0.1}],
                                           "objective": 0.01, "run": run, "argument": argument}))
    put("results/pictures/view.png", "not really a picture " * 100)
    put("results/empty.txt", "")
    say("succeeded", 1.0)
    sys.exit(0)


def cancelled(*unused):
    say("cancelled", 0.5)
    sys.exit(3)


def work(seconds, clock_s=0):
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        say("running", 0.5, clock_s=clock_s)
        time.sleep(0.05)


signal.signal(signal.SIGTERM, cancelled)
log(f"run {run}, attempt {attempt}")
say("running", 0.1)
if behaviour in ("succeed", "synced"):  # synced: as the real worker, which syncs its results
    finish()
elif behaviour == "surroundings":
    with open("/proc/self/status") as f:
        status = dict(line.split(":\t", 1) for line in f.read().splitlines())
    with open("/proc/self/oom_score_adj") as f:
        oom_score_adj = f.read().strip()
    put("results/result.json", json.dumps({
        "parameters": [], "environment": dict(os.environ), "no_new_privs": status["NoNewPrivs"], "oom_score_adj": oom_score_adj, "nice": os.nice(0),
        "descriptors": sorted(fd for fd in os.listdir("/proc/self/fd") if os.path.exists(f"/proc/self/fd/{fd}") and int(fd) != lock.fileno()),
        "limits": {name: list(resource.getrlimit(getattr(resource, "RLIMIT_" + name))) for name in ("NOFILE", "FSIZE", "AS", "CORE", "NPROC")}}))
    say("succeeded", 1.0)
    sys.exit(0)
elif behaviour == "series":
    for step in range(int(argument)):
        record(step)
    finish()
elif behaviour == "fail":
    say("failed", 0.3, {"code": "format", "field": "volume.files", "text": "cannot read volume 'scan.tif': page 2 is cut off"})
    sys.exit(1)
elif behaviour == "mute":  # fails and reports it only on stderr
    os.remove(os.path.join(job, "status.json"))
    print("something terrible happened", file=sys.stderr)
    sys.exit(1)
elif behaviour == "chatter":  # writes to the console without end, and dies
    for i in range(int(argument)):
        print(f"line {i} " + "x" * 1000, flush=i % 1000 == 0)
        if i % 1000 == 0:
            say("running", 0.5)
            time.sleep(0.02)
    print("these are my last words", flush=True)
    sys.exit(1) if os.remove(os.path.join(job, "status.json")) is None else None
elif behaviour == "nest":  # folders inside each other, so many levels in each of three places
    for place in ("results", "work", "."):
        os.chdir(os.path.join(job, place))
        for _ in range(int(argument)):
            os.mkdir("deeper")
            os.chdir("deeper")
            with open("file", "w"):
                pass
    finish()
elif behaviour == "work":
    work(float((argument or "3600").partition(",")[0]))
    finish()
elif behaviour == "hold":  # holds so many MB of memory of its own
    held = b"\1" * (int(argument) << 20)
    work(1)
    finish()
elif behaviour == "map":  # maps a file of so many MB, and reads all of it
    with open(os.path.join(job, "work", "mapped"), "wb") as f:
        for _ in range(int(argument)):
            f.write(b"\1" * (1 << 20))
    with open(os.path.join(job, "work", "mapped"), "rb") as f, mmap.mmap(f.fileno(), 0, prot=mmap.PROT_READ) as pages:
        total = sum(pages[::4096])
        work(1)
    finish()
elif behaviour == "climb":  # makes progress until it is stopped
    for i in range(100000):
        say("running", min(0.9, 0.1 + 1e-3 * i))
        time.sleep(0.2)
elif behaviour == "step_once":  # makes steps until it is stopped; the next run succeeds
    for step in range(100000 if run == 1 else 0):
        record(step)
        work(0.2)
    finish()
elif behaviour == "work_once":  # until it is killed; the next run succeeds
    if run == 1:
        work(3600)
    finish()
elif behaviour == "clock_set":  # the wall clock is set forward while this worker runs
    work(float(argument), clock_s=-1e6)
    finish()
elif behaviour == "unreadable":  # works, but for a moment its status file cannot be read
    work(float(argument))
    put("status.json", "{")
    time.sleep(0.3)
    finish()
elif behaviour == "ignore_term":
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    work(3600)
elif behaviour == "kill_once":
    if run == 1:
        os.kill(os.getpid(), signal.SIGKILL)
    finish()
elif behaviour == "kill":
    os.kill(os.getpid(), signal.SIGKILL)
elif behaviour == "segfault":
    print("a last word", file=sys.stderr, flush=True)
    os.kill(os.getpid(), signal.SIGSEGV)
elif behaviour == "exit":
    sys.exit(int(argument))
elif behaviour == "silent_once":
    if run == 1:
        time.sleep(3600)
    finish()
