"""Column means of a cloth on a cylinder under five lamps, as figures 5.23 and 5.24 of the fabric thesis have them:
cylinder_columns.py --build DIR --out PICTURE.svg [--px N] [--samples N]

Gabardine with the parameters of Table 5.3 on a described twill, a cylinder of radius 15 mm, the camera above; the lamp goes around
the cylinder (figure 5.22). The job is kept in DIR/cylinder-columns.
"""
import argparse
import csv
import json
import os
import subprocess
import sys

ANGLES = (10, 50, 90, 126, 162)
FIT = {"model": "two_lobe.v1",
       "fixed": {"C_R": [0.185, 0.047, 0.069], "C_TT": [0.999, 0.330, 0.354], "beta_R": 2.141, "beta_TT": 10, "gamma_TT": 23.548}}
CLOTH = {"draft": ["110", "101", "011"], "tile_warps": 6, "tile_wefts": 6, "cover_warp": 1.1,
         "yarns": [{"fibers": 30, "fiber_radius_um": 16.1, "twist_per_m": 600}]}
WIDTH, HEIGHT, LEFT, TOP, GAP = 190, 150, 40, 30, 14
COLOUR = ("#c02020", "#208040", "#2050c0")


def render(build, px, samples):
    folder = os.path.join(build, "cylinder-columns")
    os.makedirs(os.path.join(folder, "input"), exist_ok=True)
    view = {"on": "cylinder", "radius_mm": 15, "size_mm": 40, "width_mm": 32, "wrap_deg": 240, "light_phi_deg": 0, "camera_theta_deg": 0,
            "camera_phi_deg": 270, "px": px, "samples": samples}
    document = {"sample": "gabardine around a cylinder", "cloth": CLOTH, "fit": FIT, "pictures": [{**view, "light_theta_deg": a} for a in ANGLES]}
    with open(os.path.join(folder, "job.json"), "w", encoding="utf-8") as f:
        json.dump(document, f)
    subprocess.run([os.path.join(build, "bin", "selvedge-worker"), "--quiet", folder], check=True, stdout=sys.stderr)
    tables = []
    for i in range(1, len(ANGLES) + 1):
        with open(os.path.join(folder, "results", "pictures", f"on-{i}-columns.csv"), encoding="utf-8") as f:
            tables.append([{k: float(v) for k, v in row.items()} for row in csv.DictReader(f)])
    return tables


def panel(table, angle, x0):
    most = max(max(r["r"], r["g"], r["b"]) for r in table if abs(r["x_mm"]) < 15.5) * 1.05

    def x(mm):
        return x0 + WIDTH * (mm / 32 + 0.5)

    def y(v):
        return TOP + HEIGHT * (1 - min(v, most) / most)
    yield f'<rect x="{x0}" y="{TOP}" width="{WIDTH}" height="{HEIGHT}" fill="none" stroke="#999"/>'
    yield f'<text x="{x0 + WIDTH / 2}" y="{TOP - 8}" text-anchor="middle">lamp {angle}° around</text>'
    yield f'<text x="{x0 + 4}" y="{TOP + 12}" fill="#666">{most:.2g}</text>'
    for mm in (-15, 0, 15):
        yield f'<text x="{x(mm)}" y="{TOP + HEIGHT + 15}" text-anchor="middle" fill="#666">{mm}</text>'
    for name, colour in zip("rgb", COLOUR):
        upper = [f'{x(r["x_mm"]):.1f},{y(r[name] + r[name + "_se"]):.1f}' for r in table]
        lower = [f'{x(r["x_mm"]):.1f},{y(max(0, r[name] - r[name + "_se"])):.1f}' for r in reversed(table)]
        yield f'<polygon points="{" ".join(upper + lower)}" fill="{colour}" opacity="0.25"/>'
        middle = " ".join(f'{x(r["x_mm"]):.1f},{y(r[name]):.1f}' for r in table)
        yield f'<polyline points="{middle}" fill="none" stroke="{colour}" stroke-width="1.2"/>'


def main():
    p = argparse.ArgumentParser()
    p.add_argument("--build", required=True)
    p.add_argument("--out", required=True)
    p.add_argument("--px", type=int, default=80)
    p.add_argument("--samples", type=int, default=20)
    a = p.parse_args()
    tables = render(a.build, a.px, a.samples)
    width = LEFT + len(ANGLES) * (WIDTH + GAP)
    parts = [f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{TOP + HEIGHT + 40}" font-family="sans-serif" font-size="12">',
             '<rect width="100%" height="100%" fill="white"/>']
    for i, (table, angle) in enumerate(zip(tables, ANGLES)):
        parts += panel(table, angle, LEFT / 2 + i * (WIDTH + GAP))
    parts.append(f'<text x="{width / 2}" y="{TOP + HEIGHT + 33}" text-anchor="middle" fill="#666">place across the cylinder, mm; mean radiance of each column, '
                 'with a band of one standard error</text></svg>')
    with open(a.out, "w", encoding="utf-8") as f:
        f.write("\n".join(parts) + "\n")


main()
