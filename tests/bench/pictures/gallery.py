"""Pictures of the gallery (docs/gallery.md): gallery.py --build DIR --out FOLDER [--px N] [--samples N] [--paths N] [--kinds A,B] [NAME ...]

The six fabrics of six_fabrics.py in the studio, as drape, roll, close-up and lit through, as JPEG files of at most 300 kB,
FOLDER/<fabric>-<kind>.jpg. Each fabric is a job of its own in DIR/gallery; a picture that is finished there is not rendered
again. Prints a line for each picture: its noise before the filter, and its bytes. NAME ...: these fabrics only.
"""
import argparse
import io
import json
import os
import subprocess
import sys

from six_fabrics import FABRIC, document

try:
    from PIL import Image
except ImportError:
    sys.exit("the gallery needs python3-pil, which writes its JPEG files")

KINDS = ("drape", "roll", "close_up", "lit_through")
MOST_BYTES = 300_000


def run(build, name, kinds, a):
    folder = os.path.join(build, "gallery", name)
    os.makedirs(os.path.join(folder, "input"), exist_ok=True)
    size = {"px": a.px, "samples": a.samples, "deep_light_paths": a.paths}
    job = {**document(name, a.px, a.samples), "pictures": [{"kind": kind, **size} for kind in kinds]}
    with open(os.path.join(folder, "job.json"), "w", encoding="utf-8") as f:
        json.dump(job, f, indent=1)
    if subprocess.run([os.path.join(build, "bin", "selvedge-worker"), "--quiet", folder], check=False).returncode != 0:
        with open(os.path.join(folder, "log.txt"), encoding="utf-8") as f:
            sys.exit(f"{name}: {f.read()[-2000:]}")
    with open(os.path.join(folder, "results", "result.json"), encoding="utf-8") as f:
        return [(os.path.join(folder, "results", p["file"].replace(".exr", ".png")), p["noise"]) for p in json.load(f)["pictures"]]


def jpeg(path):
    """The picture as JPEG of the best quality that keeps the limit."""
    for quality in (92, 88, 84, 80, 75, 70, 60):
        out = io.BytesIO()
        Image.open(path).convert("RGB").save(out, "JPEG", quality=quality, optimize=True, progressive=True)
        if len(out.getvalue()) <= MOST_BYTES:
            return out.getvalue()
    sys.exit(f"{path}: no JPEG of {MOST_BYTES} bytes")


def main():
    p = argparse.ArgumentParser()
    p.add_argument("--build", required=True)
    p.add_argument("--out", required=True)
    p.add_argument("--px", type=int, default=1024)
    p.add_argument("--samples", type=int, default=8)
    p.add_argument("--paths", type=int, default=2000000, help="paths of the tables")
    p.add_argument("--kinds", default=",".join(KINDS), help="some of the views")
    p.add_argument("names", nargs="*")
    a = p.parse_args()
    os.makedirs(a.out, exist_ok=True)
    for name in a.names or FABRIC:
        kinds = a.kinds.split(",")
        for kind, (path, noise) in zip(kinds, run(a.build, name, kinds, a)):
            block = jpeg(path)
            with open(os.path.join(a.out, f"{name}-{kind}.jpg"), "wb") as f:
                f.write(block)
            print(f"{name}, {kind}: noise of a pixel {noise:.3f}, {len(block)} bytes", flush=True)


main()
