"""Lame with sequins, draped in the studio: sequin_picture.py --build DIR --out PICTURE.jpg [--px N] [--samples N]

The example lame-and-sequins.json as a job in DIR/sequin-picture, with a picture of this size.
"""
import argparse
import json
import os
import subprocess
import sys

try:
    from PIL import Image
except ImportError:
    sys.exit("the picture needs python3-pil")

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "..")


def main():
    p = argparse.ArgumentParser()
    p.add_argument("--build", required=True)
    p.add_argument("--out", required=True)
    p.add_argument("--px", type=int, default=320)
    p.add_argument("--samples", type=int, default=4)
    a = p.parse_args()
    folder = os.path.join(a.build, "sequin-picture")
    os.makedirs(os.path.join(folder, "input"), exist_ok=True)
    with open(os.path.join(ROOT, "config", "examples", "lame-and-sequins.json"), encoding="utf-8") as f:
        job = json.load(f)
    job["pictures"] = [{"kind": "drape", "px": a.px, "samples": a.samples, "deep_light_paths": 200000}]
    with open(os.path.join(folder, "job.json"), "w", encoding="utf-8") as f:
        json.dump(job, f, indent=1)
    subprocess.run([os.path.join(a.build, "bin", "selvedge-worker"), "--quiet", folder], check=True)
    Image.open(os.path.join(folder, "results", "pictures", "on-1.png")).convert("RGB").save(a.out, "JPEG", quality=86, optimize=True)
    print(f"{os.path.getsize(a.out)} bytes")


main()
