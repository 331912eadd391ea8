"""The main job on real input: a real scan with a real fabric's measured reflectance, run by the worker on a job folder.

The cloth in the scan is not the cloth that was measured, so a fit is judged by its residuals. Data: fiber-ct/crop256.tif
(libenke/CT_FiberSegmentation, GPL-3.0; 2 um a voxel is our statement), weave-ct/small_weave.tif (nasa/puma, NOSA 1.3; no voxel size
is published, 2 um is our statement), measured-reflectance/*.csv (from asztr/Neural-BRDF, MIT; MERL and Nielsen measurements).
"""
import json
import os
import shutil
import subprocess
import time

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
DATA = os.environ.get("SELVEDGE_DATA") or os.path.join(ROOT, "..", "shared", "data")
BUILD = os.environ.get("SELVEDGE_BUILD") or os.path.join(ROOT, "build")

# figure name -> example job document and the data files that it names
JOBS = {
    "fiber_ct": ("fiber-ct-blue-fabric.json", ["fiber-ct/crop256.tif", "measured-reflectance/merl-blue-fabric.csv"]),
    "weave_ct": ("weave-ct-green-cloth.json", ["weave-ct/small_weave.tif", "measured-reflectance/nielsen-greencloth.csv"]),
}


def missing_data(name):
    """Data files of a job that are not there."""
    return [f for f in JOBS[name][1] if not os.path.exists(os.path.join(DATA, f))]


def run_job(name, folder, timeout_s=900, **fit):
    """Run a job in `folder`; returns (result.json, the series' records, wall seconds). fit: options in place of the example's."""
    document, files = JOBS[name]
    os.makedirs(os.path.join(folder, "input"))
    with open(os.path.join(ROOT, "config", "examples", document)) as f:
        job = json.load(f)
    job["fit"].update({"model": "two_lobe.v1", **fit})  # the published model, whose figures are compared
    with open(os.path.join(folder, "job.json"), "w") as f:
        json.dump(job, f)
    for f in files:
        shutil.copy(os.path.join(DATA, f), os.path.join(folder, "input"))
    start = time.monotonic()
    done = subprocess.run([os.path.join(BUILD, "bin", "selvedge-worker"), folder], timeout=timeout_s,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    wall_s = time.monotonic() - start
    if done.returncode != 0:
        with open(os.path.join(folder, "status.json")) as f:
            raise RuntimeError(f"worker ended with {done.returncode}: {json.load(f).get('error')}\n{done.stdout[-2000:]}")
    with open(os.path.join(folder, "results", "result.json")) as f:
        result = json.load(f)
    with open(os.path.join(folder, "series.rec")) as f:
        series = [json.loads(line[9:]) for line in f]
    return result, series, wall_s
