"""The six fabrics of the fabric thesis on a cylinder and draped: six_fabrics.py --build DIR --out PICTURE.png [--px N] [--share S]

Scattering parameters are those of Table 5.3 (fibers, two_lobe.v1). The thesis' scans are not public, so each cloth is a
described one of the same kind of weave: the pictures show how the published parameters look on such cloths, not the
samples of the thesis. Each fabric is a job of its own, run by the worker in DIR/six-fabrics; a picture that is finished
there is not rendered again. Samples of a pixel are as many as the fabric needs (SAMPLES), or the share S of these for a
quick look. NAME ...: these fabrics only, and no contact sheet.
"""
import argparse
import json
import os
import subprocess
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from png_picture import compose, read_png, write_png  # noqa: E402


def yarn(fibers, radius_um, **numbers):
    return {"fibers": fibers, "fiber_radius_um": radius_um, **numbers}


# name: weave, yarns, other numbers of the cloth, C_R, C_TT, beta_R, beta_TT, gamma_TT
FABRIC = {
    "fleece": ({"weave": "jersey", "tile_warps": 2, "tile_wefts": 2, "nap_tilt_deg": 50,
                "yarns": [yarn(50, 8.7, hairs_per_mm=50, hair_length_um=350, packing=0.4)]},
               [0.040, 0.087, 0.087], [0.452, 0.725, 0.948], 7.238, 10.0, 25.989),
    "gabardine": ({"draft": ["110", "101", "011"], "tile_warps": 6, "tile_wefts": 6, "cover_warp": 1.1,
                   "yarns": [yarn(30, 16.1, twist_per_m=600)]},
                  [0.185, 0.047, 0.069], [0.999, 0.330, 0.354], 2.141, 10.0, 23.548),
    "silk": ({"weave": "satin", "yarns": [yarn(40, 4.7, flatness=3, hairs_per_mm=0)]},
             [0.745, 0.008, 0.070], [0.620, 0.553, 0.562], 1.0, 10.0, 19.823),
    "velvet": ({"weave": "velvet", "pile_tilt_deg": 60, "pile_spread_deg": 12, "yarns": [yarn(20, 7), yarn(24, 5)]},
               [0.044, 0.040, 0.040], [0.076, 0.058, 0.057], 1.577, 24.933, 44.881),
    "twill": ({"weave": "twill31", "tile_warps": 8, "tile_wefts": 8, "yarns": [yarn(36, 8, twist_per_m=700)]},
              [0.001, 0.001, 0.024], [0.987, 0.975, 0.825], 1.367, 23.509, 26.419),
    "cotton": ({"weave": "plain", "tile_warps": 6, "tile_wefts": 6,
                "yarns": [yarn(40, 7, twist_per_m=700, hairs_per_mm=9, hair_length_um=500)]},
               [0.989, 0.959, 0.874], [0.999, 0.999, 0.999], 1.0, 27.197, 38.269),
}
# Lobes of one or two degrees meet the camera from few fibers, which takes many samples.
SAMPLES = {"fleece": 300, "gabardine": 250, "silk": 600, "velvet": 600, "twill": 500, "cotton": 600}
LIGHT = {"light_theta_deg": 50, "light_phi_deg": 0, "camera_theta_deg": 0, "camera_phi_deg": 0}
VIEW = [{"on": "cylinder", "radius_mm": 15, "size_mm": 40, "width_mm": 32, "wrap_deg": 200, **LIGHT},
        {"on": "drape", "radius_mm": 10, "size_mm": 40, "width_mm": 36, **LIGHT, "light_phi_deg": 200, "camera_theta_deg": 55, "camera_phi_deg": 250}]


def document(name, px, samples):
    cloth, c_r, c_tt, beta_r, beta_tt, gamma_tt = FABRIC[name]
    return {"sample": f"{name}, Table 5.3", "cloth": cloth, "black_sheet": True,
            "fit": {"model": "two_lobe.v1", "fixed": {"C_R": c_r, "C_TT": c_tt, "beta_R": beta_r, "beta_TT": beta_tt, "gamma_TT": gamma_tt}},
            "pictures": [{**view, "px": px, "samples": samples} for view in VIEW]}


def render(build, name, px, samples):
    folder = os.path.join(build, "six-fabrics", name)
    os.makedirs(os.path.join(folder, "input"), exist_ok=True)
    with open(os.path.join(folder, "job.json"), "w", encoding="utf-8") as f:
        json.dump(document(name, px, samples), f, indent=1)
    if subprocess.run([os.path.join(build, "bin", "selvedge-worker"), "--quiet", folder], check=False).returncode != 0:
        with open(os.path.join(folder, "log.txt"), encoding="utf-8") as f:
            sys.exit(f"{name}: {f.read()[-2000:]}")
    with open(os.path.join(folder, "results", "result.json"), encoding="utf-8") as f:
        for i, p in enumerate(json.load(f)["pictures"], 1):
            print(f"{name} on {p['on']}: mean {sum(p['mean']) / 3:.4f}, noise {p['noise']:.3f}", file=sys.stderr)
    return [read_png(os.path.join(folder, "results", "pictures", f"on-{i}.png")) for i in range(1, len(VIEW) + 1)]


def main():
    p = argparse.ArgumentParser()
    p.add_argument("--build", required=True)
    p.add_argument("--out")
    p.add_argument("--px", type=int, default=144)
    p.add_argument("--share", type=float, default=1)
    p.add_argument("names", nargs="*")
    a = p.parse_args()
    shown = [render(a.build, name, a.px, max(1, round(a.share * SAMPLES[name]))) for name in a.names or FABRIC]
    if a.out:
        write_png(a.out, compose([[pictures[k] for pictures in shown] for k in range(len(VIEW))], a.px))


if __name__ == "__main__":
    main()
