"""A draped and a flat cloth over a plane, as rendered and filtered: ground_pictures.py --build DIR --out PICTURE.png

Left the pictures as they were rendered, right their filtered views: a joint filter of the cloth, sheared filtering of the
soft shadow. The worker makes them in DIR/ground-pictures, where finished ones are not rendered again.
"""
import argparse
import json
import os
import subprocess
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from png_picture import compose, read_png, write_png  # noqa: E402

PX = 256
VIEW = {"camera_theta_deg": 50, "camera_phi_deg": 250, "light_phi_deg": 30, "px": PX, "samples": 16, "filter": True}
PICTURES = [{"on": "drape", "radius_mm": 10, "size_mm": 40, "width_mm": 64, "light_theta_deg": 50, "ground_gap_mm": 0.5, **VIEW},
            {"on": "flat", "size_mm": 20, "width_mm": 50, "light_theta_deg": 40, "ground_gap_mm": 8, **VIEW}]
DOCUMENT = {"sample": "a cloth over a plane", "black_sheet": False, "pictures": PICTURES,
            "cloth": {"weave": "twill31", "tile_warps": 4, "tile_wefts": 4, "yarns": [{"fibers": 20, "fiber_radius_um": 11, "twist_per_m": 700}]},
            "fit": {"model": "two_lobe.v1", "fixed": {"C_R": [0.185, 0.047, 0.069], "C_TT": [0.999, 0.330, 0.354], "beta_R": 5, "beta_TT": 12, "gamma_TT": 24}}}


def main():
    p = argparse.ArgumentParser()
    p.add_argument("--build", required=True)
    p.add_argument("--out", required=True)
    a = p.parse_args()
    folder = os.path.join(a.build, "ground-pictures")
    os.makedirs(os.path.join(folder, "input"), exist_ok=True)
    with open(os.path.join(folder, "job.json"), "w", encoding="utf-8") as f:
        json.dump(DOCUMENT, f, indent=1)
    subprocess.run([os.path.join(a.build, "bin", "selvedge-worker"), "--quiet", folder], check=True)
    shown = [[read_png(os.path.join(folder, "results", "pictures", f"on-{i}{how}.png")) for how in ("", "-filtered")] for i in (1, 2)]
    write_png(a.out, compose([shown[0] + shown[1]], PX))


main()
