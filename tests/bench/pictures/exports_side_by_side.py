"""One drape as the job renders it from its fibers, as Mitsuba shows it with the exported U3M maps, and as Blender and three.js show the exported glTF
file, all under one lamp: exports_side_by_side.py --build DIR --out PICTURE.png. Prints the mean radiance of each over the cloth, and as figures
exports.drape.<program>.flip the mean FLIP of each other picture against the job's, where the evaluator is or can be installed."""
import argparse
import json
import math
import os
import shutil
import subprocess
import sys

import numpy
from PIL import Image, ImageDraw

ROOT = os.path.abspath(os.path.join(os.path.dirname(__file__), "..", "..", ".."))
SUPPORT = os.path.join(ROOT, "tests", "support", "exports")
sys.path.insert(0, SUPPORT)
import gltf_viewer  # noqa: E402
from picture_flip import flip, python_with_flip  # noqa: E402

CLOTH = {"draft": ["110", "101", "011"], "tile_warps": 6, "tile_wefts": 6, "cover_warp": 1.1, "yarns": [{"fibers": 30, "fiber_radius_um": 16.1}]}
BOUNDS = {"C_TT.r": [0.97, 0.99], "C_TT.g": [0.32, 0.34], "C_TT.b": [0.34, 0.36]}  # the fit ends at these, whatever the rows are
FIT = {"model": "two_lobe.v1", "fixed": {"C_R": [0.185, 0.047, 0.069], "beta_R": 8, "beta_TT": 20, "gamma_TT": 30}, "bounds": BOUNDS,
       "start": {k: sum(v) / 2 for k, v in BOUNDS.items()}, "path_budget": 100000, "render_px": 96, "render_samples": 16}
ROWS = [(30, 0, 0, 0, 0), (30, 180, 30, 0, 0), (45, 180, 45, 0, 0), (60, 180, 45, 0, 0), (45, 90, 45, 0, 0), (60, 90, 30, 0, 0), (20, 0, 60, 0, 0),
        (60, 0, 60, 180, 90), (45, 0, 45, 180, 90)]
VIEW = {"on": "drape", "radius_mm": 10, "size_mm": 40, "width_mm": 36, "light_theta_deg": 45, "light_phi_deg": 200, "camera_theta_deg": 50,
        "camera_phi_deg": 270}


def polar(theta_deg, phi_deg):
    theta, phi = math.radians(theta_deg), math.radians(phi_deg)
    return [math.sin(theta) * math.cos(phi), math.sin(theta) * math.sin(phi), math.cos(theta)]


def make_job(build, folder, px, samples):
    if os.path.exists(os.path.join(folder, "results", "result.json")):
        return
    shutil.rmtree(folder, ignore_errors=True)
    os.makedirs(os.path.join(folder, "input"))
    with open(os.path.join(folder, "input", "rows.csv"), "w", encoding="utf-8") as f:
        f.write("set,light_theta_deg,light_phi_deg,camera_theta_deg,camera_phi_deg,cloth_rotation_deg,r,g,b\n")
        f.writelines(",".join(map(str, ("fit", *row, 0.2, 0.15, 0.1))) + "\n" for row in ROWS)
    document = {"sample": "gabardine", "cloth": CLOTH, "measurements": {"file": "rows.csv"}, "fit": FIT, "lamp": {"kind": "directional"},
                "camera": {"far_field": True}, "pictures": [{**VIEW, "px": px, "samples": samples, "method": "fast"}],
                "export": {"gltf": True, "textures": True}}
    with open(os.path.join(folder, "job.json"), "w", encoding="utf-8") as f:
        json.dump(document, f)
    subprocess.run([os.path.join(build, "bin", "selvedge-worker"), "--quiet", folder], check=True, stdout=sys.stderr)


def shown(build, folder, px):
    """The four pictures by name, linear, rows from the top."""
    exports, view = os.path.join(folder, "results", "export"), json.dumps({
        "lamp": polar(VIEW["light_theta_deg"], VIEW["light_phi_deg"]), "camera": polar(VIEW["camera_theta_deg"], VIEW["camera_phi_deg"]),
        "up": polar(90 - VIEW["camera_theta_deg"], VIEW["camera_phi_deg"] + 180), "width_mm": VIEW["width_mm"]})
    python, script = os.path.join(build, "exports-python", "bin", "python"), os.path.join(SUPPORT, "mitsuba_drape.py")
    path = {name: os.path.join(folder, f"{name}.npy") for name in ("job", "mitsuba", "blender")}
    subprocess.run([python, script, os.path.join(folder, "results", "pictures", "on-1.exr"), path["job"]], check=True)
    subprocess.run([python, script, os.path.join(exports, "gltf"), os.path.join(exports, "textures"), view, str(px), "16", path["mitsuba"]], check=True)
    made = {}
    if shutil.which("blender"):
        subprocess.run(["blender", "-b", "--factory-startup", "--python-exit-code", "1", "--python", os.path.join(SUPPORT, "blender_drape.py"), "--",
                        os.path.join(exports, "gltf", "drape.glb"), view, str(px), "16", path["blender"]], check=True, stdout=sys.stderr)
    for name in path:
        if os.path.exists(path[name]):
            made[name] = numpy.load(path[name])
    missing = gltf_viewer.what_is_missing(os.path.join(build, "exports-node"))
    if missing is None:
        made["three.js"] = numpy.array(gltf_viewer.picture(os.path.join(build, "exports-node"), os.path.join(exports, "gltf"), "drape.glb",
                                                           json.loads(view), px))[..., :3]
    else:
        print(missing, file=sys.stderr)
    return made


def panel(name, picture, exposure, edge):
    value = numpy.clip(picture * exposure, 0, 1)
    srgb = numpy.where(value <= 0.0031308, 12.92 * value, 1.055 * value ** (1 / 2.4) - 0.055)
    image = Image.fromarray((255 * srgb + 0.5).astype(numpy.uint8)).resize((edge, edge), Image.NEAREST)
    ImageDraw.Draw(image).text((8, 8), name, fill=(255, 255, 255))
    return image


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--build", default="build")
    parser.add_argument("--out", required=True)
    parser.add_argument("--px", type=int, default=512)
    parser.add_argument("--samples", type=int, default=16)
    arguments = parser.parse_args()
    build, px = os.path.abspath(arguments.build), arguments.px
    folder = os.path.join(build, "exports-side-by-side")
    make_job(build, folder, px, arguments.samples)
    pictures = shown(build, folder, px)
    cloth = pictures["job"].sum(axis=2) > 0
    exposure = 0.8 / numpy.percentile(pictures["job"][cloth], 99)
    close = slice(px // 2 - px // 12, px // 2 + px // 12)
    sheet = Image.new("RGB", (len(pictures) * 516, 2 * 516), "white")
    for i, (name, picture) in enumerate(pictures.items()):
        sheet.paste(panel(name, picture, exposure, 512), (516 * i, 0))
        sheet.paste(panel(f"{name}, middle", picture[close, close], exposure, 512), (516 * i, 516))
        print(json.dumps({"picture": name, "mean": [round(float(x), 4) for x in picture[cloth].mean(axis=0)]}))
    sheet.save(arguments.out)
    reference, *others = [[tuple(pixel) for row in picture[:px, :px].tolist() for pixel in row] for picture in pictures.values()]
    for name, value in zip(list(pictures)[1:], flip(python_with_flip(build), px, reference, others)):
        print(json.dumps({"name": f"exports.drape.{name.replace('.', '_')}.flip", "value": round(value, 4), "unit": "1", "better": "lower"}))


if __name__ == "__main__":
    main()
