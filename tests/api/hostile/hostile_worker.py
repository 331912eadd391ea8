#!/usr/bin/python3
"""A program in place of selvedge-worker that has been taken over: its job's sample name, "hostile: ACT ARGUMENT", says what it
writes into its folder or takes of the machine. It has no sandbox, so it may do more than input could make the worker do."""
import json
import os
import signal
import sys
import threading
import time
import zlib

if "--check" in sys.argv and os.path.exists(os.path.join(sys.argv[-1], "endless.tif")):
    while True:  # its report is memory of the daemon's
        os.write(1, b"[" * (1 << 20))
if "--check" in sys.argv:
    print('{"faults": [], "warnings": [], "n_file": 0}')
    sys.exit(0)

job = sys.argv[-1]
with open(os.path.join(job, "attempt.json")) as f:
    attempt = json.load(f)["attempt"]
with open(os.path.join(job, "job.json")) as f:
    act, _, argument = json.load(f)["sample"].removeprefix("hostile: ").partition(" ")
again = attempt > 1
SCRIPT = "var r = new XMLHttpRequest(); r.open('POST', '/v1/jobs', false); r.setRequestHeader('Content-Type', 'application/json'); " \
         "r.send(JSON.stringify({sample: 'made by a script', volume: {files: ['scan.tif'], voxel_size_um: 2}, measurements: {file: 'rows.csv'}}));"


def put(path, text):
    path = os.path.join(job, path)
    os.makedirs(os.path.dirname(path), exist_ok=True)
    with open(path, "wb" if isinstance(text, bytes) else "w") as f:
        f.write(text)


def status(**more):
    return json.dumps({"state": "succeeded", "attempt": attempt, "stage": "fit", "i_stage": 5, "n_stage": 8, "stage_fraction": 1, "fraction": 1,
                       "eta_s": None, "heartbeat_unix_s": time.time(), "started_unix_s": time.time(), "message": "", "objective": None,
                       "objective_se": None, "step": None, "warnings": [], "error": None, "peak_rss_bytes": 0, "cpu_s": 0, **more})


def nested(depth):
    return "[" * depth + "]" * depth


def record(text):
    return f"{zlib.crc32(text.encode()):08x} {text}\n"


def replace(path, make):
    """Puts something else than a file at a path."""
    path = os.path.join(job, path)
    if os.path.isdir(path) and not os.path.islink(path):
        os.rename(path, path + ".moved")
    elif os.path.lexists(path):
        os.remove(path)
    make(path)


def pages():
    """Pages and pictures that act as whoever opens them, and a harmless page with style and picture beside it."""
    put("results/evil.svg", f'<svg xmlns="http://www.w3.org/2000/svg"><script>{SCRIPT}</script><script href="evil.js"/><text y="20">x</text></svg>')
    put("results/evil.html", f"<p id=p>x<script>{SCRIPT}</script><script src=evil.js></script>")
    put("results/evil.js", SCRIPT)
    put("results/evil.xhtml", f'<html xmlns="http://www.w3.org/1999/xhtml"><body><script>{SCRIPT}</script></body></html>')
    put("results/dot.svg", '<svg xmlns="http://www.w3.org/2000/svg" width="30" height="20"><rect width="30" height="20"/></svg>')
    put("results/page.css", "#p { color: rgb(1, 2, 3); }")
    put("results/page.html", "<link rel=stylesheet href=page.css><p id=p>x</p><img id=i src=dot.svg>")


def huge_report():
    """12 MB of empty lists, which are 289 MB once they are parsed, before the inputs that the daemon looks for."""
    put("results/report.json", '{"a": [' + "[]," * 4_000_000 + '[]], "inputs": [{"name": "scan.tif", "role": "volume", "size": 1, "sha256": null}]}')


def huge_json():
    """Every JSON file of the job, with so many bytes of empty lists."""
    lists = "[" + "{}," * (int(argument) // 3) + "{}]"
    for name in ("results/result.json", "results/report.json", "plan.json", "run.json", "backend.json", "status.json", "kept"):
        put(name, '{"a": ' + lists + "}")


def deep_json():
    for name in ("results/result.json", "results/report.json", "plan.json", "run.json", "backend.json", "status.json", "kept"):
        put(name, '{"parameters": %s, "verdict": %s, "inputs": %s}' % ((nested(int(argument)),) * 3))


def long_line():
    """A series, a journal and a log of one line of so many bytes, which take no room on the disk."""
    for name in ("series.rec", "journal.rec", "log.txt"):
        with open(os.path.join(job, name), "a") as f:
            f.write("00000000 {")
            f.truncate(int(argument))


def long_record():
    """Whole records of so many bytes each."""
    text = '{"step":%d,"parameter":[' + "[]," * (int(argument) // 3) + "[]]}"
    put("series.rec", "".join(record(text % i) for i in range(3)))


def deep_record():
    put("series.rec", record('{"step":0,"objective":1,"parameter":[1]}') + record('{"step":1,"parameter":' + nested(int(argument)) + "}"))


def each(make):
    for name in ("status.json", "series.rec", "journal.rec", "log.txt", "console.txt", "run.json", "plan.json", "backend.json", "attempt.json",
                 "job.json", "results/result.json", "results/report.json", "input/scan.tif", "kept"):
        replace(name, make)


def pipes():
    each(os.mkfifo)


def links():
    each(lambda path: os.symlink("/dev/zero", path))


def devices():
    each(lambda path: os.mknod(path, 0o20666, os.makedev(1, 5)))


def folders():
    each(os.mkdir)


def linked_folders():
    for name in ("results", "versions", "input", "work"):
        replace(name, lambda path: os.symlink(argument, path))


def wrong_types():
    """JSON of the right names, and of other types than they have."""
    for wrong in ({"code": 1}, "text", [], 1):
        put("status.json", json.dumps({**dict.fromkeys(json.loads(status()), wrong), "attempt": attempt, "warnings": [wrong]}))
        time.sleep(0.3)
    put("status.json", status(warnings=[1, {}], verdict={"code": [], "text": {}}, peak_rss_bytes=-1, started_unix_s=-1e300, fraction=1e300))
    parameters = [1, {"name": 2}, {"name": "x", "value": "y", "unit": 3}]
    put("results/result.json", json.dumps({"parameters": parameters, "verdict": [], "model": {}, "fit_rel_rms": "z"}))
    put("results/report.json", json.dumps({"inputs": [1, "x", {}]}))
    records = ['{"step":0,"parameter":1,"i_model":"x","phase":[]}', '{"step":1e9}', '{"step":-5}', '{"step":9223372036854775807}', "[]",
               '{"step":3,"parameters":7,"i_model":0}', '{"step":4,"i_model":9223372036854775807}']
    put("series.rec", "".join(map(record, records)))
    put("plan.json", json.dumps({"cpu_s": 1, "wall_s": "x", "stages": {}, "n_thread": []}))


def many_records():
    """A series of so many models, each with a description."""
    text = '{"step":%d,"i_model":%d,"model":"m","parameter":[1],"parameters":[' + "1," * 500 + "1]}"
    put("series.rec", "".join(record(text % (i, i)) for i in range(int(argument))))


def damaged_lines():
    for name in ("series.rec", "journal.rec"):
        with open(os.path.join(job, name), "a") as f:
            f.write("x\n" * int(argument))


def many_files():
    for i in range(int(argument)):
        put(f"results/many/{i}", "")


def left_folders():
    """Folders in each other, made like a program would that goes down as far as it can."""
    os.chdir(job)
    for _ in range(int(argument)):
        os.mkdir("d")
        os.chdir("d")


def deep_folders():
    left_folders()
    put(os.path.join(job, "status.json"), status(state="running"))
    time.sleep(60)


def threads():
    for _ in range(int(argument)):
        try:
            threading.Thread(target=time.sleep, args=(60,), daemon=True).start()
        except RuntimeError:
            break
    put("threads", str(threading.active_count()))
    time.sleep(60)


def hold():
    held = []
    while True:
        held.append(b"\1" * (16 << 20))


def big_file():
    """One file as large as it may be. It has no bytes on the disk, and Python does not ignore the signal."""
    signal.signal(signal.SIGXFSZ, signal.SIG_DFL)
    with open(os.path.join(job, "big"), "wb") as f:
        f.truncate(int(argument))


def forever():
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    while True:
        put("status.json", status(state="running"))
        time.sleep(0.1)


put("results/new.json", json.dumps({"parameters": [], "verdict": None}))
os.replace(os.path.join(job, "results", "new.json"), os.path.join(job, "results", "result.json"))  # a reader never finds half of it
put("status.json", status())
if not again:
    globals()[act]()
