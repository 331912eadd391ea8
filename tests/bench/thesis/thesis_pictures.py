"""Cylinders, drapes and ablations for bench_thesis.py.

Cylinders and drapes show each fabric by `photograph`, the fibers at Table 5.3, and by the two volume models that were fitted to rows of these. So
they repeat figures 5.22 to 5.26 with pictures of the true fibers in place of photographs; the fit of the fibers to themselves would not differ.
"""
import csv
import math
import os
import shutil
import subprocess
import sys

from thesis_fabrics import MODELS, cloth, truth
from thesis_fits import flat

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "support", "python"))
from small_exr import read_exr  # noqa: E402

ANGLES = (10, 50, 90, 126, 162)
CYLINDER = {"on": "cylinder", "radius_mm": 15, "size_mm": 40, "width_mm": 32, "wrap_deg": 240, "light_phi_deg": 0, "camera_theta_deg": 0, "camera_phi_deg": 270}
DRAPE = {"on": "drape", "radius_mm": 10, "size_mm": 40, "width_mm": 36, "light_theta_deg": 50, "camera_theta_deg": 55, "camera_phi_deg": 250}
SIDE = {"same": 250, "opposite": 70}
BINS = 16
SEEN_MM = 14.5  # beyond it a column meets the cylinder at grazing angles only


def fitted(steps, fabric, model):
    """The fit of a volume model to the fibers, as `fixed` of a document; None until it is there. photograph: Table 5.3."""
    if model == "photograph":
        return truth(fabric, "two_lobe")
    kept = steps.kept(f"cross.{fabric}.{model}")
    return kept and {name: value for name, value, _, _ in kept["value"]["parameters"]}


def document(fabric, model, fixed, pictures):
    return {"sample": f"{fabric}, {model}", "cloth": cloth(fabric), "fit": {"model": MODELS.get(model, "two_lobe.v1"), "fixed": fixed},
            "pictures": pictures}


def take_columns(result, folder):
    """Radiances over BINS even parts of the cylinder that is seen, and their standard errors, for each lamp."""
    tables = []
    for i in range(1, len(ANGLES) + 1):
        with open(os.path.join(folder, "pictures", f"on-{i}-columns.csv"), encoding="utf-8") as f:
            rows = [{k: float(v) for k, v in row.items()} for row in csv.DictReader(f)]
        bins = [[] for _ in range(BINS)]
        for row in rows:
            if abs(row["x_mm"]) < SEEN_MM:
                bins[int((row["x_mm"] / SEEN_MM + 1) / 2 * BINS)].append(row)
        tables.append([[sum(r[c] for r in b) / len(b) for c in "rgb"] + [math.sqrt(sum(r[c + "_se"] ** 2 for r in b)) / len(b) for c in "rgb"] for b in bins])
    return tables


def shapes(steps, fabric, model):
    """Columns of five cylinders, and means of four drapes: lamp on the camera's side and opposite, with the black mesh, then without it."""
    fixed, name = fitted(steps, fabric, model), f"shapes.{fabric}.{model}"
    samples = 32 if model == "microflake" else 12
    views = [{**CYLINDER, "light_theta_deg": a, "px": 48, "samples": samples} for a in ANGLES]
    views += [{**DRAPE, "light_phi_deg": phi, "px": 64, "samples": samples, "black_sheet": sheet} for sheet in (True, False) for phi in SIDE.values()]

    def take(result, folder):
        return {"columns": take_columns(result, folder), "drapes": [sum(p["mean"]) / 3 for p in result["pictures"][len(ANGLES):]]}
    return fixed and steps.job(name, document(fabric, model, fixed, views), {}, take)


# Figure 5.17
ALTERNATIVE = {"C_R": [0.472, 0.460, 0.218], "C_TT": [0.540, 0.435, 0.310]}
BLOCK = 6


def take_contrast(result, folder):
    """Standard deviation over mean of blocks of 6 x 6 pixels (.19 mm), less that of noise by two pictures, and the mean."""
    blocks = []
    for i in (1, 2):
        with open(os.path.join(folder, "pictures", f"on-{i}.exr"), "rb") as f:
            width, height, pixel = read_exr(f.read())
        blocks.append([sum(sum(pixel(BLOCK * x + u, BLOCK * y + v)) for u in range(BLOCK) for v in range(BLOCK)) / (3 * BLOCK ** 2)
                       for y in range(height // BLOCK) for x in range(width // BLOCK)])
    n = len(blocks[0])
    means = [sum(b) / n for b in blocks]
    product = sum((a - means[0]) * (b - means[1]) for a, b in zip(*blocks)) / n
    return {"contrast": math.sqrt(max(0.0, product)) / (sum(means) / 2), "mean": sum(means) / 2}


def stripes(steps, name):
    """name: fitted, alternative, or microflake, which were fitted to the fibers."""
    model = name if name == "microflake" else "two_lobe"
    fixed = fitted(steps, "twill", name) if name == "microflake" else {**truth("twill", "two_lobe"), **(ALTERNATIVE if name == "alternative" else {})}
    view = {"on": "flat", "size_mm": 40, "width_mm": 3, "light_theta_deg": 30, "light_phi_deg": 30,
            "camera_theta_deg": 0, "camera_phi_deg": 0, "px": 96, "samples": 32}
    return fixed and steps.job(f"stripes.{name}", document("twill", model, fixed, [view, view]), {}, take_contrast)


# Figures 6.7 and 6.8: one repeat of gabardine, because tables of cells take long
REPEAT = {**cloth("gabardine"), "tile_warps": 3, "tile_wefts": 3}
CELL_PATHS, ORDERS = (0.5, 1, 1.5, 2, 16), (1, 2, 3, 4, 5, 6)


def take_picture(result, folder):
    """Radiances over fields of 4 x 4 pixels."""
    with open(os.path.join(folder, "pictures", "on-1.exr"), "rb") as f:
        width, height, pixel = read_exr(f.read())
    fields = [[sum(pixel(4 * x + u, 4 * y + v)[c] for u in range(4) for v in range(4)) / 16 for c in range(3)]
              for y in range(height // 4) for x in range(width // 4)]
    return {"mean": sum(result["pictures"][0]["mean"]) / 3, "fields": fields}


def fast(steps, name, **how):
    view = {**DRAPE, "light_phi_deg": SIDE["same"], "px": 64, "samples": 32, **how}
    job = {**document("gabardine", "two_lobe", truth("gabardine", "two_lobe"), [view]), "cloth": REPEAT}
    return steps.job(f"fast.{name}", job, {}, take_picture)


def ablations(steps):
    return {**{f"size-{e}": fast(steps, f"size-{e}", method="fast", deep_light="cells", cell_order=5, cell_paths=e) for e in CELL_PATHS},
            **{f"order-{o}": fast(steps, f"order-{o}", method="fast", deep_light="cells", cell_order=o, cell_paths=2) for o in ORDERS},
            "directions": fast(steps, "directions", method="fast", deep_light_paths=1000000), "path": fast(steps, "path", method="path"),
            "dual": fast(steps, "dual", method="dual")}


# Figures 5.10 and 5.14: a scan of a plain weave of smooth fibers, as a volume with the parameters of Silk
SCAN = ["--weave", "plain", "--fibers-per-yarn", "19", "--diameter-voxel", "6", "--seed", "3"]
CHAIN = {"default": {}, "no_transfer": {"transfer_directions": False}, "subvolumes": {"three_subvolumes": True}}


def make_scan(steps, folder):
    """The scan comes under its name when it is whole."""
    subprocess.run([os.path.join(steps.build, "bin", "selvedge-phantom"), "cloth", "--out", folder + ".new", *SCAN], check=True, stdout=sys.stderr)
    shutil.rmtree(folder, ignore_errors=True)
    os.rename(folder + ".new", folder)


def take_chain(result, folder):
    tables = take_columns(result, folder)
    return {"columns": tables, "fibers": result["geometry"]["n_fiber"]}


def chain(steps, name):
    folder = os.path.join(steps.folder, "scan" + "".join(SCAN).replace("--", "-"))  # steps depend on its name
    scan = os.path.join(folder, "scan.tif")
    if not os.path.exists(scan) and steps.wanted(f"chain.{name}"):
        make_scan(steps, folder)
    views = [{**CYLINDER, "light_theta_deg": a, "px": 48, "samples": 40} for a in ANGLES]
    job = {"sample": f"steps of the published chain: {name}", "volume": {"files": ["scan.tif"], "voxel_size_um": 2, "radius_um": 6, **CHAIN[name]},
           "fit": {"model": MODELS["volume"], "fixed": {**flat(truth("silk", "volume"))}}, "pictures": views}
    return steps.job(f"chain.{name}", job, {"scan.tif": scan}, take_chain)
