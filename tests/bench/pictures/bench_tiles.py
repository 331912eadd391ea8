"""Large tiles of a scan (volume.tiles): how far the period of the scan stands out of a picture: bench_tiles.py --build DIR

A scan of a twill of 8 x 8 yarns, two repeats along each edge, whose fibers wander, is traced with and without `tiles` 4. Both cloths are
rendered flat from above, 4 x 4 scans wide, and draped. Jobs are kept in DIR/tiles; a finished one is not run again. Prints one JSON object
on each line:

  tiles.autocorrelation         Correlation of the flat picture with itself at the period of the scan, less the one at half of it, a repeat
                                of the weave: the mean along x and y; 0 where the period cannot be told.
  tiles.autocorrelation_before  The same without the large tile.
  tiles.free_ends               Share of the ends at cuts that end within the cloth.
"""
import argparse
import json
import os
import shutil
import subprocess
import sys

import numpy

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from png_picture import read_png  # noqa: E402

CLOTH = ["--weave", "twill", "--yarns", "8,8", "--fibers-per-yarn", "19", "--migration", "0.3", "--seed", "5"]
BLOCKS, PX_A_TILE = 4, 96
FIT = {"model": "two_lobe.v1", "fixed": {"C_R": [0.185, 0.047, 0.069], "C_TT": [0.6, 0.330, 0.354], "beta_R": 8, "beta_TT": 12, "gamma_TT": 24}}


def read_json(*path):
    with open(os.path.join(*path), encoding="utf-8") as f:
        return json.load(f)


def rendered(build, name, tiles):
    """Runs a job and returns the folder of its results and the edge of the scan in mm."""
    cloth, folder = os.path.join(build, "tiles", "cloth"), os.path.join(build, "tiles", name)
    if not os.path.exists(os.path.join(cloth, "phantom.json")):
        subprocess.run([os.path.join(build, "bin", "selvedge-phantom"), "cloth", *CLOTH, "--out", cloth], check=True, stdout=subprocess.DEVNULL)
    about = read_json(cloth, "phantom.json")
    edge_mm = about["result"]["tile_mm"][0]
    view = {"light_theta_deg": 50, "light_phi_deg": 30, "samples": 12}
    flat = {"on": "flat", "size_mm": 8 * edge_mm, "width_mm": BLOCKS * edge_mm, "camera_theta_deg": 0, "camera_phi_deg": 270, "px": BLOCKS * PX_A_TILE}
    drape = {"on": "drape", "size_mm": 12 * edge_mm, "width_mm": 12 * edge_mm, "radius_mm": 3 * edge_mm, "camera_theta_deg": 45,
             "camera_phi_deg": 250, "px": 512}
    pictures = [{**flat, **view}, {**drape, **view}]
    results = os.path.join(folder, "results")
    if not os.path.exists(os.path.join(results, "result.json")):
        os.makedirs(os.path.join(folder, "input"), exist_ok=True)
        shutil.copy(os.path.join(cloth, "scan.tif"), os.path.join(folder, "input"))
        volume = {"files": ["scan.tif"], "voxel_size_um": about["cloth"]["voxel_size_um"], "tiles": tiles}
        with open(os.path.join(folder, "job.json"), "w", encoding="utf-8") as f:
            json.dump({"sample": "twill phantom", "volume": volume, "lamp": {"kind": "directional"}, "camera": {"far_field": True},
                       "pictures": pictures, "fit": FIT}, f, indent=1)
        if subprocess.run([os.path.join(build, "bin", "selvedge-worker"), "--quiet", folder], check=False).returncode != 0:
            with open(os.path.join(folder, "log.txt"), encoding="utf-8") as f:
                sys.exit(f"{name}: {f.read()[-2000:]}")
    return results


def standing_out(picture):
    """Correlation at one period of the scan less that at half of it."""
    light = numpy.frombuffer(b"".join(picture), numpy.uint8).reshape(BLOCKS * PX_A_TILE, BLOCKS * PX_A_TILE, 3).mean(axis=2)
    light -= light.mean()
    at = [[numpy.mean(light * numpy.roll(light, shift, axis)) / numpy.mean(light ** 2) for axis in (0, 1)] for shift in (PX_A_TILE, PX_A_TILE // 2)]
    print("correlations at the period, and at half of it:", at, file=sys.stderr)
    return float(numpy.mean(numpy.array(at[0]) - numpy.array(at[1])))


def main():
    p = argparse.ArgumentParser()
    p.add_argument("--build", required=True)
    build = p.parse_args().build
    one, large = rendered(build, "one", 1), rendered(build, "large", BLOCKS)
    before, after = (standing_out(read_png(os.path.join(folder, "pictures", "on-1.png"))) for folder in (one, large))
    tiles = read_json(large, "result.json")["geometry"]["seam_fibers"]["tiles"]
    for name, value, unit in (("autocorrelation", after, "correlation"), ("autocorrelation_before", before, "correlation"),
                              ("free_ends", tiles["n_free"] / tiles["n_cut_end"], "share")):
        print(json.dumps({"name": f"tiles.{name}", "value": round(value, 4), "unit": unit, "better": "lower"}))


main()
