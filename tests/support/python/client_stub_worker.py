#!/usr/bin/python3
"""A stub of selvedge-worker for tests of clients. It reports all stages and writes invented curves and results,
but computes nothing.

The sample's name selects its behaviour: "slow ..." takes 40 s for the fit, "failing ..." fails in the first stage with a
field, "twin ..." has tables of a twin among its results, "good ...", "undetermined ...", "pictures ..." and "bad ..." end with this verdict, files
of "faulty ..." have two faults, anything else succeeds within a second or two."""
import json
import math
import os
import signal
import sys
import time
import zlib

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "made"))
import synthetic_twin  # noqa: E402

if "--check" in sys.argv:
    with open(sys.argv[sys.argv.index("--check") + 1], encoding="utf-8") as checked:
        name = json.load(checked)["sample"]
    faulty = name.startswith("faulty")
    warnings = [{"field": "measurements.file", "detail": "lamp and camera look exchanged"}] if name.startswith("warned") else []
    faults = [{"code": "format", "field": "volume.files", "detail": "cannot read volume 'scan.tif': it is no scan"},
              {"code": "format", "field": "measurements.file", "detail": "line 1 of 'cloth.csv' has no numbers"}] if faulty else []
    print(json.dumps({"faults": faults, "warnings": warnings, "files": [], "n_file": 2}))
    sys.exit(int(faulty))

FOLDER = sys.argv[-1]
STAGES = ["volume", "orientation", "fibers", "directions", "scene", "fit", "validation", "report"]
NAMES = ["C_R.r", "C_R.g", "C_R.b", "C_TT.r", "C_TT.g", "C_TT.b", "beta_R", "beta_TT", "gamma_TT"]
STARTED = time.time()


def path(*parts):
    return os.path.join(FOLDER, *parts)


def status(**changes):
    with open(path("attempt.json"), encoding="utf-8") as f:
        attempt = json.load(f)["attempt"]
    value = {"state": "running", "attempt": attempt, "stage": "volume", "i_stage": 0, "n_stage": len(STAGES), "stage_fraction": 0.0,
             "fraction": 0.0, "eta_s": None, "heartbeat_unix_s": time.time(), "started_unix_s": STARTED, "message": "", "objective": None,
             "objective_se": None, "step": None, "warnings": [], "error": None, "peak_rss_bytes": 1 << 20}
    value.update(changes)
    new = path(f"status.json.new-{os.getpid()}")  # a slow machine may still run the worker of the attempt before
    with open(new, "w", encoding="utf-8") as f:
        json.dump(value, f)
    os.replace(new, path("status.json"))


def log(text):
    with open(path("log.txt"), "a", encoding="utf-8") as f:
        f.write(time.strftime("%Y-%m-%dT%H:%M:%S.000Z INFO ", time.gmtime()) + text + "\n")


def verdict(sample):
    """The verdict that a sample's name begins with, or none."""
    known = {"good": ("good", "good"), "undetermined": ("good_but_undetermined", "good, but 2 parameters are undetermined"),
             "pictures": ("pictures_only", "usable for pictures only"), "bad": ("does_not_describe_this_cloth", "does not describe this cloth")}
    if sample.split()[0] not in known:
        return None
    code, words = known[sample.split()[0]]
    return {"code": code, "words": words, "text": "A stub says so.", "judged_by": "held_out",
            "rel_rms": 0.03, "rel_rms_se": 0.001, "allowed_rel_rms": 0.02, "one_color_rel_rms": 0.4, "plain_brdf_rel_rms": 0.1, "reservations": []}


def series(step):
    objective = 0.02 + 2 * math.exp(-step)
    text = json.dumps({"step": step, "phase": "gauss_newton", "wall_s": 0.1 * step, "n_path": 1000, "n_path_total": 1000 * (step + 1),
                       "objective": objective, "objective_se": 0.02 * objective, "parameter": [0.1] * 3 + [max(0.2, 0.85 - 0.02 * step)] * 3 + [5, 20, 18],
                       "parameter_se": [0.01] * 6 + [0.5, 1, 1], "rel_rms": math.sqrt(objective / 3), "rendered": [], "note": ""})
    with open(path("series.rec"), "a", encoding="utf-8") as f:
        f.write(f"{zlib.crc32(text.encode()):08x} {text}\n")
    return objective


def results():
    os.makedirs(path("results", "renderings"), exist_ok=True)
    parameters = [{"name": n, "unit": "" if n[0] == "C" else "deg", "value": 0.1 + i, "standard_error": 0.01, "lower": 0.001, "upper": 45.0,
                   "determined": n != "beta_R", "at_bound": "upper" if n == "gamma_TT" else None, "fixed": False} for i, n in enumerate(NAMES)]
    with open(path("results", "result.json"), "w", encoding="utf-8") as f:
        json.dump({"fit_rel_rms": 0.02, "heldout_rel_rms": 0.03, "converged": True, "parameters": parameters, "rows": []}, f)
    with open(path("results", "renderings", "fit-00.bin"), "wb") as f:
        f.write(bytes(range(256)) * 400)


def cancelled(*_):
    status(state="cancelled", message="stopped")
    os._exit(3)


def main():
    signal.signal(signal.SIGTERM, cancelled)
    with open(path("job.json"), encoding="utf-8") as f:
        sample = json.load(f)["sample"]
    if sample.startswith("failing"):
        status(state="failed", error={"code": "format", "field": "volume.files", "text": "cannot read volume 'scan.tif': page 2 is 8-bit, page 1 is 16-bit"})
        return 1
    # The fit must last so long that a client that polls once a second sees it.
    n_step, pause_s = (80, 0.5) if sample.startswith("slow") else (10, 0.15)
    for i, stage in enumerate(STAGES):
        log(f"stage {stage}")
        n = n_step if stage == "fit" else 10
        for k in range(n):
            objective = series(k) if stage == "fit" else None
            fraction = (i + k / n) / len(STAGES)
            status(stage=stage, i_stage=i, stage_fraction=k / n, fraction=fraction, eta_s=n_step * pause_s * (1 - fraction),
                   objective=objective, objective_se=None if objective is None else 0.02 * objective, step=None if objective is None else k)
            time.sleep(pause_s if stage == "fit" else 0.01)
    results()
    if sample.startswith("twin"):
        synthetic_twin.write(path("results"), sample)
    status(state="succeeded", stage="report", i_stage=len(STAGES) - 1, stage_fraction=1.0, fraction=1.0, eta_s=0.0, verdict=verdict(sample))
    return 0


if __name__ == "__main__":
    sys.exit(main())
