"""The seam of a scanned cloth's tile before and after its fibers are joined: seam_pictures.py --build DIR --out PICTURE.png

A scan of a twill of 8 x 8 yarns, in which warp and weft do not stand quite at right angles, is cropped to about half of its edges. So the
yarns and the single fibers at opposite faces of the tile do not meet. Two jobs trace it, without and with volume.join_seams. The picture
shows, from above, where four tiles meet: on the left as found, on the right joined. Jobs are kept in DIR/seam; a job that is finished there
is not run again. The seam errors of both tiles go to standard output.
"""
import argparse
import json
import os
import shutil
import struct
import subprocess
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from png_picture import compose, write_png  # noqa: E402

SKEW = 0.03
CLOTH = ["--weave", "twill", "--yarns", "8,8", "--fibers-per-yarn", "19", "--migration", "0.15", "--seed", "5"]
VIEW, MARK_PX = 0.5, 8  # edge of the picture in tiles; ticks at its border where the seams are
COLOR = {0: (255, 214, 160), 1: (168, 205, 255)}  # of fibers along x and along y


def run(build, name, document, files):
    """Runs a job of the worker and returns the folder of its results."""
    folder = os.path.join(build, "seam", name)
    results = os.path.join(folder, "results")
    if not os.path.exists(os.path.join(results, "result.json")):
        os.makedirs(os.path.join(folder, "input"), exist_ok=True)
        for path in files:
            shutil.copy(path, os.path.join(folder, "input"))
        with open(os.path.join(folder, "job.json"), "w", encoding="utf-8") as f:
            json.dump(document, f, indent=1)
        if subprocess.run([os.path.join(build, "bin", "selvedge-worker"), "--quiet", folder], check=False).returncode != 0:
            with open(os.path.join(folder, "log.txt"), encoding="utf-8") as f:
                sys.exit(f"{name}: {f.read()[-2000:]}")
    return results


def read_json(*path):
    with open(os.path.join(*path), encoding="utf-8") as f:
        return json.load(f)


def trace(build, join):
    cloth = os.path.join(build, "seam", "cloth")
    if not os.path.exists(os.path.join(cloth, "phantom.json")):
        subprocess.run([os.path.join(build, "bin", "selvedge-phantom"), "cloth", *CLOTH, "--out", cloth], check=True, stdout=subprocess.DEVNULL)
    voxel_um = read_json(cloth, "phantom.json")["cloth"]["voxel_size_um"]
    document = {"sample": "twill phantom", "volume": {"files": ["scan.tif"], "voxel_size_um": voxel_um, "join_seams": join, "crop": "auto",
                                                      "crop_keep": 0.45, "matrix": [1, SKEW, 0, SKEW, 1, 0, 0, 0, 1]}}
    return run(build, "joined" if join else "found", document, [os.path.join(cloth, "scan.tif")])


def read_fibers(path):
    """[(radius, [(x, y, z), ...])] of a .hair file, mm, and the edges of its tile (docs/file-formats.md)."""
    with open(path, "rb") as f:
        data = f.read()
    n_strand, n_point = struct.unpack_from("<II", data, 4)
    text = data[40:128].split(b"\0")[0].decode()
    tile = [float(x) for x in text.split("tile_mm=")[1].split()[0].split(",")]
    segments = struct.unpack_from(f"<{n_strand}H", data, 128)
    at = 128 + 2 * n_strand
    point = struct.unpack_from(f"<{3 * n_point}f", data, at)
    thickness = struct.unpack_from(f"<{n_point}f", data, at + 12 * n_point)
    fibers, first = [], 0
    for n in segments:
        fibers.append((0.5 * thickness[first], [point[3 * i:3 * i + 3] for i in range(first, first + n + 1)]))
        first += n + 1
    return fibers, tile


def stamp(height, picture, px, at, radius, color):
    """Draws a ball as it is seen from above: at x, y, z in pixels."""
    x, y, z = at
    for j in range(max(0, int(y - radius)), min(px, int(y + radius) + 1)):
        for i in range(max(0, int(x - radius)), min(px, int(x + radius) + 1)):
            rise = radius * radius - (i + 0.5 - x) ** 2 - (j + 0.5 - y) ** 2
            if rise > 0.0 and z + rise ** 0.5 > height[j * px + i]:
                height[j * px + i] = z + rise ** 0.5
                picture[j * px + i] = [c * (0.25 + 0.75 * rise ** 0.5 / radius) for c in color]


def draw(path, px):
    """Rows of a picture of the corner of the tile, from above; deeper fibers are darker."""
    fibers, tile = read_fibers(path)
    scale, half = px / (VIEW * tile[0]), 0.5 * VIEW * tile[0]
    height, picture = [-1e9] * (px * px), [(0, 0, 0)] * (px * px)
    top = max(p[2] for _, fiber in fibers for p in fiber)
    depth = top - min(p[2] for _, fiber in fibers for p in fiber)
    for radius, fiber in fibers:
        span = [abs(fiber[-1][a] - fiber[0][a]) for a in (0, 1)]
        color = COLOR[span[1] > span[0]]
        for x, y, z in fiber:
            u, v = ((q + 0.5 * t) % t - 0.5 * t for q, t in zip((x, y), tile))  # from the corner
            if abs(u) < half + radius and abs(v) < half + radius:
                dark = 1.0 - 0.7 * (top - z) / depth
                stamp(height, picture, px, ((u + half) * scale, (half - v) * scale, z * scale), radius * scale, [dark * c for c in color])
    rows = []
    for j in range(px):
        row = bytearray()
        for i in range(px):
            tick = px // 2 in (i, j) and min(i, j, px - 1 - i, px - 1 - j) < MARK_PX
            row += bytes((255, 60, 60)) if tick else bytes(int(c) for c in picture[j * px + i])
        rows.append(bytes(row))
    return rows


def show(build, join, px):
    results = trace(build, join)
    geometry = read_json(results, "result.json")["geometry"]
    print(json.dumps({"joined": join, "seam_fibers": geometry["seam_fibers"], "tile_mm": geometry["tile_mm"]}))
    return draw(os.path.join(results, "fibers.hair"), px)


def main():
    p = argparse.ArgumentParser()
    p.add_argument("--build", required=True)
    p.add_argument("--out", required=True)
    p.add_argument("--px", type=int, default=420)
    a = p.parse_args()
    write_png(a.out, compose([[show(a.build, join, a.px) for join in (False, True)]], a.px))


main()
