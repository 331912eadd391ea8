"""A drape of lame under a lamp that goes around: lame_pictures.py --build DIR --out PICTURE.webp [--frames N] [--px N] [--samples N]

Warps of dark polyester, wefts of metal film whose flakes glitter one by one. Each frame is a picture of one job in
DIR/lame-pictures; all have the same exposure. The animation loops. Prints its bytes, and what the lamp changes: the correlation of
the brightness of pixels between frames that follow each other, which is high where a picture only grows brighter or darker.
"""
import argparse
import json
import os
import subprocess
import sys

import numpy as np

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "support", "python"))
from small_exr import read_exr  # noqa: E402

try:
    from PIL import Image
except ImportError:
    sys.exit("the animation needs python3-pil")

MOST_BYTES = 1_400_000
SKY = 0.2  # radiance all around, in which the metal shows its color between the glints
GROUND = 0.6  # what it becomes in the picture, in linear light
CLOTH = {"weave": "twill31", "warp": [0], "weft": [1], "tile_warps": 8, "tile_wefts": 8, "crimp": 0.2, "cover_weft": 0.9,
         "yarns": [{"fibers": 20, "fiber_radius_um": 9, "twist_per_m": 400},
                   {"film_width_um": 300, "film_thickness_um": 12, "film_metal": "gold", "film_roughness": 0.3, "film_surface": "flakes",
                    "film_grain_um": 110}]}


def document(frames, px, samples):
    view = {"on": "drape", "radius_mm": 10, "size_mm": 40, "width_mm": 38, "camera_theta_deg": 50, "camera_phi_deg": 250, "light_theta_deg": 45,
            "px": px, "samples": samples, "black_sheet": True}
    return {"sample": "lame", "cloth": CLOTH, "environment": {"radiance": [SKY, SKY, SKY]},
            "pictures": [{**view, "light_phi_deg": 360 * k / frames} for k in range(frames)],
            "fit": {"model": "two_lobe.v1", "fixed": {"C_R": 0.03, "C_TT": [0.15, 0.03, 0.08], "beta_R": 6, "beta_TT": 14, "gamma_TT": 24}}}


def srgb(x):
    x = np.maximum(x, 0) / np.maximum(x.max(axis=2, keepdims=True), 1)  # bright glints keep their hue
    return np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)


def main():
    p = argparse.ArgumentParser()
    p.add_argument("--build", required=True)
    p.add_argument("--out", required=True)
    p.add_argument("--frames", type=int, default=14)
    p.add_argument("--px", type=int, default=288)
    p.add_argument("--samples", type=int, default=32)
    a = p.parse_args()
    folder = os.path.join(a.build, "lame-pictures")
    os.makedirs(os.path.join(folder, "input"), exist_ok=True)
    with open(os.path.join(folder, "job.json"), "w", encoding="utf-8") as f:
        json.dump(document(a.frames, a.px, a.samples), f, indent=1)
    subprocess.run([os.path.join(a.build, "bin", "selvedge-worker"), "--quiet", folder], check=True)
    frames = []
    for k in range(a.frames):
        with open(os.path.join(folder, "results", "pictures", f"on-{k + 1}.exr"), "rb") as f:
            width, height, pixel = read_exr(f.read())
        frames.append(np.array([[pixel(x, y) for x in range(width)] for y in range(height)], dtype=np.float32))
    grey = [np.minimum(x.mean(axis=2), 8).ravel() for x in frames]
    pictures = [Image.fromarray((255 * srgb(GROUND / SKY * x) + 0.5).astype(np.uint8)) for x in frames]
    for quality in (80, 70, 60, 50, 40, 30):
        pictures[0].save(a.out, "WEBP", save_all=True, append_images=pictures[1:], duration=110, loop=0, quality=quality, method=6)
        if os.path.getsize(a.out) <= MOST_BYTES:
            break
    between = [np.corrcoef(grey[k], grey[k - 1])[0, 1] for k in range(len(grey))]
    print(f"{len(pictures)} frames, {os.path.getsize(a.out)} bytes at quality {quality}; correlation of neighbours {np.mean(between):.3f}")


main()
