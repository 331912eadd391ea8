"""Pictures and tables of the page of bench_thesis.py that need jobs of their own: drapes of three densities (figure 5.8), drapes with and without a
black mesh for the eye (figure 5.18), and mean free paths (table 6.1); and the two pictures of the page.
"""
import math
import os
import struct

from thesis_fabrics import NAMES, truth
from thesis_pictures import ANGLES, BINS, DRAPE, SEEN_MM, SIDE, document

from fiber_file import Fibers  # thesis_pictures leads to tests/support/python
from small_exr import read_exr

MESH_FABRICS, TABLE_FABRICS = ("gabardine", "twill"), ("fleece", "gabardine", "silk")
MESH_PX = 160


def thin(steps, per_cm):
    """Means of two drapes of Fleece over the black mesh at a density, with the parameters that were fitted with it."""
    kept = steps.kept(f"density.{per_cm}")
    views = [{**DRAPE, "light_phi_deg": phi, "px": 64, "samples": 12, "black_sheet": True} for phi in SIDE.values()]
    if kept is None:
        return None
    job = document("fleece", "volume", {name: value for name, value, _, _ in kept["value"]["parameters"]}, views)
    job["fit"]["density_multiplier_per_cm"] = per_cm
    return steps.job(f"thin.{per_cm}", job, {}, lambda result, _: [sum(p["mean"]) / 3 for p in result["pictures"]])


def mesh(steps, fabric, sheet):
    """Files of two filtered pictures, lamp on the camera's side and opposite. Tables are made over the sheet of the job, so that each is one."""
    name = f"mesh.{fabric}.{'with' if sheet else 'without'}"
    how = {"px": MESH_PX, "samples": 48, "method": "fast", "deep_light_paths": 1000000, "filter": True}
    views = [{**DRAPE, **how, "light_phi_deg": phi} for phi in SIDE.values()]
    job = {**document(fabric, "two_lobe", truth(fabric, "two_lobe"), views), "black_sheet": sheet}
    if steps.job(name, job, {}, lambda result, _: [sum(p["mean"]) / 3 for p in result["pictures"]]) is None:
        return None
    paths = [os.path.join(steps.folder, name, "results", "pictures", f"on-{i}-filtered.exr") for i in (1, 2)]
    return paths if all(map(os.path.exists, paths)) else None


def read_tables_head(folder):
    """(mean free path in um, bytes) of the tables of a finished job (renderer/fast/NOTES.md)."""
    path = os.path.join(folder, "work", "report", "fast.tables")
    with open(path, "rb") as f:
        head = f.read(64)
    if head[:8] != b"SELVFAST":
        raise ValueError(f"'{path}' holds no tables")
    return [1000 * struct.unpack_from("<5d", head, 24)[3], os.path.getsize(path)]


def tables(steps, fabric):
    """[mean free path between later hits (6.4.2) in um, bytes, fibers of the tile]."""
    view = {**DRAPE, "light_phi_deg": SIDE["same"], "px": 16, "samples": 1, "method": "fast", "deep_light_paths": 1000}
    found = steps.job(f"tables.{fabric}", document(fabric, "two_lobe", truth(fabric, "two_lobe"), [view]), {},
                      lambda _, results: read_tables_head(os.path.dirname(results)))
    whole = steps.result(f"tables.{fabric}")
    return found and found + [whole and whole["geometry"]["n_fiber"]]


def unseen_share(tables_path, fibers):
    """Share of the length of fibers that lies in cells without a row of transfer (renderer/fast/NOTES.md)."""
    with open(tables_path, "rb") as f:
        data = f.read()
    tile_x, tile_y, lowest = struct.unpack_from("<3d", data, 24)
    n_x, n_y, n_z = struct.unpack_from("<3I", data, 76)
    cell = struct.unpack_from(f"<{n_x * n_y * n_z}I", data, 168)
    top = max(z + radius for fiber in fibers for _, _, z, radius in fiber)
    length = unseen = 0.0
    for fiber in fibers:
        for a, b in zip(fiber, fiber[1:]):
            x, y, z = ((p + q) / 2 for p, q in zip(a[:3], b[:3]))
            at = [int(n * share) % n for n, share in ((n_x, x / tile_x % 1), (n_y, y / tile_y % 1))]
            down = min(int(n_z * max(top - z, 0) / -lowest), n_z - 1)
            step = math.dist(a[:3], b[:3])
            length += step
            unseen += step * (cell[(down * n_y + at[1]) * n_x + at[0]] == 0xFFFFFFFF)
    return unseen / length


def unseen(steps, name):
    """Of a step of pictures by cells whose folder is there; None: it is not."""
    folder = os.path.join(steps.folder, name)
    paths = os.path.join(folder, "work", "report", "fast.tables"), os.path.join(folder, "results", "fibers.hair")
    return unseen_share(paths[0], Fibers.read(paths[1]).fibers) if all(map(os.path.exists, paths)) else None


# ---- the pictures ----

WIDTH, HEIGHT, LEFT, TOP, GAP = 150, 70, 70, 24, 8
CURVES = (("photograph", "#000"), ("volume", "#2050c0"), ("microflake", "#d07000"))


def panel(tables_of, i_angle, x0, y0):
    """The columns of one cylinder by each model; tables_of: (color, five tables of columns)."""
    level = {color: [(sum(b[:3]) / 3, sum(s * s for s in b[3:]) ** 0.5 / 3) for b in of[i_angle]] for color, of in tables_of}
    most = max(v - se for of in level.values() for v, se in of) * 1.1  # so that one column of noise does not press all others down

    def at(k, value):
        return f"{x0 + WIDTH * (k + 0.5) / BINS:.1f},{y0 + HEIGHT * (1 - min(max(value, 0), most) / most):.1f}"
    yield f'<rect x="{x0}" y="{y0}" width="{WIDTH}" height="{HEIGHT}" fill="none" stroke="#bbb"/><text x="{x0 + 3}" y="{y0 + 11}" fill="#666">{most:.2g}</text>'
    for color, of in level.items():
        band = [at(k, v + se) for k, (v, se) in enumerate(of)] + [at(k, v - se) for k, (v, se) in reversed(list(enumerate(of)))]
        yield f'<polygon points="{" ".join(band)}" fill="{color}" opacity="0.2"/>'
        yield f'<polyline points="{" ".join(at(k, v) for k, (v, _) in enumerate(of))}" fill="none" stroke="{color}" stroke-width="1.2"/>'


def draw_columns(found, path):
    """Figures 5.22 to 5.24: a row for each fabric, a panel for each lamp."""
    height = TOP + len(NAMES) * (HEIGHT + GAP) + 18
    parts = [f'<svg xmlns="http://www.w3.org/2000/svg" width="{LEFT + len(ANGLES) * (WIDTH + GAP)}" height="{height}" font-family="sans-serif" font-size="11">',
             '<rect width="100%" height="100%" fill="white"/>']
    for i, angle in enumerate(ANGLES):
        parts.append(f'<text x="{LEFT + i * (WIDTH + GAP) + WIDTH / 2}" y="{TOP - 8}" text-anchor="middle">lamp {angle}° around</text>')
    for j, fabric in enumerate(NAMES):
        y0 = TOP + j * (HEIGHT + GAP)
        parts.append(f'<text x="4" y="{y0 + HEIGHT / 2}">{fabric.capitalize()}</text>')
        shown = [(color, found["shapes", fabric, model]["columns"]) for model, color in CURVES if found["shapes", fabric, model]]
        for i in range(len(ANGLES) if shown else 0):
            parts += panel(shown, i, LEFT + i * (WIDTH + GAP), y0)
    parts.append(f'<text x="{LEFT}" y="{height - 5}" fill="#666">mean radiance of {BINS} columns from -{SEEN_MM} to {SEEN_MM} mm across the cylinder, '
                 'up to the brightest, less its error (number)</text></svg>')
    with open(path, "w", encoding="utf-8") as f:
        f.write("\n".join(parts) + "\n")


def draw_drapes(found, path):
    """Figure 5.18: columns are Gabardine with and without the mesh, then Twill; one exposure for a fabric's four pictures."""
    import numpy as np
    from PIL import Image
    columns = []
    for fabric in MESH_FABRICS:
        both = [found["mesh", fabric, sheet] for sheet in (True, False)]
        if not all(both):
            return False
        light = []
        for of in both:
            for name in of:
                with open(name, "rb") as f:
                    width, height, pixel = read_exr(f.read())
                light.append(np.array([[pixel(x, y) for x in range(width)] for y in range(height)]))
        most = np.quantile(np.concatenate([v.reshape(-1, 3).max(axis=1) for v in light]), 0.995)
        shown = [np.where(v <= 0.0031308, 12.92 * v, 1.055 * np.maximum(v, 1e-9) ** (1 / 2.4) - 0.055) for v in (np.clip(v / most, 0, 1) for v in light)]
        columns += [np.vstack(shown[:2]), np.vstack(shown[2:])]
    Image.fromarray((255 * np.hstack(columns) + 0.5).astype(np.uint8)).save(path, quality=88)
    return True
