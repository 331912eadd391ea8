"""Chapters 5 and 6 of the fabric thesis, shown again: bench_thesis.py --build DIR [--page PAGE.md] [STEP ...]

  thesis.<fabric>.<model>.heldout   error of a fit to 16 rows over the 492 further ones, truth of the same model (thesis_fits.py)
  thesis.<fabric>.<model>.ratio     that over the error of the plain BRDF of the same 16 rows
  thesis.<fabric>.<model>.on_fibers, on_fibers_ratio
                                    the same of a volume model that is fitted to the truth of the fibers

STEP: beginnings of names of steps, such as "fit.silk"; the others are taken as far as they are finished. Results are kept in
DIR/bench-thesis, one JSON file a step, so that an interrupted run goes on; steps that an older program made are named on standard error.
--page: also writes the page from them, and its pictures beside it in images/.
"""
import argparse
import json
import os
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import thesis_fits  # noqa: E402
import thesis_looks  # noqa: E402
import thesis_pictures  # noqa: E402
from thesis_fabrics import MODELS, NAMES  # noqa: E402
from thesis_jobs import Steps  # noqa: E402
from thesis_page import write_page  # noqa: E402


def figure(name, value, better="lower"):
    print(json.dumps({"name": f"thesis.{name}", "value": round(value, 4), "unit": "1", "better": better}), flush=True)


def fits(steps):
    found = {}
    for fabric in NAMES:
        for model in MODELS:
            own = found[fabric, model] = thesis_fits.fit(steps, fabric, model, model)
            if own is not None:
                figure(f"{fabric}.{model}.heldout", own["heldout"])
                figure(f"{fabric}.{model}.ratio", own["ratio"])
            if model == "two_lobe":
                continue
            cross = thesis_fits.fit(steps, fabric, model, "two_lobe")
            if cross is not None and found[fabric, "two_lobe"]:
                # of the BRDF that has all 16 rows, while microflakes have 14
                cross["ratio"] = cross["heldout"] / found[fabric, "two_lobe"]["brdf"]
            found[fabric, model, "cross"] = cross
            if cross is not None:
                figure(f"{fabric}.{model}.on_fibers", cross["heldout"])
                figure(f"{fabric}.{model}.on_fibers_ratio", cross["ratio"])
        found[fabric, "bisected"] = thesis_fits.bisected(steps, fabric)
    for density in thesis_fits.DENSITIES:
        found["density", density] = thesis_fits.density(steps, density)
    return found


def pictures(steps):
    found = {}
    for fabric in NAMES:
        for model in ("photograph", "volume", "microflake"):
            found["shapes", fabric, model] = thesis_pictures.shapes(steps, fabric, model)
    found.update({("fast", name): value for name, value in thesis_pictures.ablations(steps).items()})
    found.update({("chain", name): thesis_pictures.chain(steps, name) for name in thesis_pictures.CHAIN})
    found.update({("stripes", name): thesis_pictures.stripes(steps, name) for name in ("fitted", "alternative", "microflake")})
    found.update({("seconds", name): (steps.kept(f"fast.{name}") or {}).get("cpu_s") for name in ("path", "dual")})
    return found


def looks(steps):
    found = {("thin", d): thesis_looks.thin(steps, d) for d in thesis_fits.DENSITIES}
    found.update({("tables", fabric): thesis_looks.tables(steps, fabric) for fabric in thesis_looks.TABLE_FABRICS})
    found.update({("mesh", fabric, sheet): thesis_looks.mesh(steps, fabric, sheet) for fabric in thesis_looks.MESH_FABRICS for sheet in (True, False)})
    found.update({("unseen", e): thesis_looks.unseen(steps, f"fast.size-{e}") for e in thesis_pictures.CELL_PATHS})
    rows = steps.kept("truth.silk.two_lobe.f")
    found["silk rows"] = rows and rows["value"]
    return found


def draw(found, folder):
    """The two pictures of the page; a picture whose steps are not there stays as it is."""
    if any(found["shapes", fabric, model] for fabric in NAMES for model in ("photograph", "volume", "microflake")):
        thesis_looks.draw_columns(found, os.path.join(folder, "thesis-columns.svg"))
    thesis_looks.draw_drapes(found, os.path.join(folder, "thesis-drapes.webp"))


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("--build", required=True)
    p.add_argument("--page")
    p.add_argument("steps", nargs="*")
    a = p.parse_args()
    build = os.path.abspath(a.build)
    steps = Steps(build, os.path.join(build, "bench-thesis"), a.steps)
    found = {**fits(steps), **pictures(steps), **looks(steps)}
    standing = steps.standing()
    if a.page:
        write_page(found, standing, a.page)
        draw(found, os.path.join(os.path.dirname(os.path.abspath(a.page)), "images"))


main()
