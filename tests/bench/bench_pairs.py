"""How near do renderings come to pairs of photographs, one reflected and one lit through? Prints figures cloth.pairs.*.

    bench_pairs.py [--build DIR] [--keep DIR] [--photographs DIR] [--picture FILE] [NAME ...]

Each pair NAME_R.png, NAME_T.png of --photographs goes through the same procedure: `selvedge-phantom detect` finds the
weave, and one job fits the scattering parameters of warp and weft to crops of both photographs together. The figures
are of the held-out crops, which choose nothing. docs/photo-pairs.md describes the assumptions. Jobs are kept in --keep,
with pictures of renderings beside the photographs; a job that is there already is not run again.
"""
import argparse
import glob
import json
import math
import os
import re
import shutil
import subprocess
import sys

from bench_cloth import DATA, ROOT, Failure, figure, run_job
from png_picture import brighten, compose, read_png, write_png

# The set-up of the photographs is stated nowhere. These are the constants of the renderer that their authors compare
# with them (lxtyin/FabricBTDF-Recovery, render.py), read as centimetres: the camera 8 above the cloth with a field of
# view of 53 degrees; point lights of radiant intensity 300 at (0, 8, 8) in front and (0, 0, -9) behind; a vignette of
# exp(-(r / 450 px)^2) on values of gamma 2.2.
CAMERA_CM, FIELD_OF_VIEW_DEG, EDGE_PX = 8.0, 53.0, 512
LIGHT_CM, LIGHT_INTENSITY = {"R": (0.0, 8.0, 8.0), "T": (0.0, 0.0, -9.0)}, 300.0
VIGNETTE_PX, GAMMA = 450.0, 2.2
PX_PER_CM = EDGE_PX / (2 * CAMERA_CM * math.tan(math.radians(FIELD_OF_VIEW_DEG / 2)))
BLUR_PX = 0.5  # of a sharp photograph through a color filter array

CROP_PX, STEP_PX = 40, 128  # crops of this edge (8 periods of the weave), on a grid about the middle of the photograph
# What photographs of so few pixels a yarn do not show: yarn width over spacing (warp, weft), the yarns' sections.
COVER = (1.0, 1.05)
FLATNESS, PACKING, FIBER_RADIUS_UM, DISORDER = 2.5, 0.6, 10.0, 0.045
# A small source near the cloth, and fibers whose surface has no color of its own.
LAMP = {"side_cm": 1, "distance_cm": 10}
PICTURE_PX = 200  # edge of a crop in pictures
TIED = [["warp.C_R"], ["weft.C_R"], ["beta_R"], ["beta_TT"], ["gamma_TT"], ["w"], ["s"]]


def phantom(arguments, *command):
    """The JSON that a command of selvedge-phantom prints."""
    program = os.path.join(arguments.build, "bin", "selvedge-phantom")
    return json.loads(subprocess.run([program, *map(str, command)], check=True, stdout=subprocess.PIPE).stdout)


def detect(arguments, name):
    """What the photographs tell: which is more certain of the draft, the period in each, and how much larger T shows yarns."""
    answer = phantom(arguments, "detect", *(f"--photograph={arguments.photographs}/{name}_{kind}.png" for kind in "RT"))
    spacing_px = {k: (p["warp"]["spacing_px"], p["weft"]["spacing_px"]) for k, p in zip("RT", answer["photographs"])}
    magnification = {"R": 1.0, "T": math.sqrt(math.prod(spacing_px["T"]) / math.prod(spacing_px["R"]))}
    best = answer["best"][-len("R.png")]
    return {"best": best, "draft": answer["cloth"]["draft"], "spacing_px": spacing_px["R"], "magnification": magnification,
            "period_px": {k: p["texture_period_px"] for k, p in zip("RT", answer["photographs"])}}


def angles(vector):
    """theta and phi in degrees; straight up has the phi that shows the cloth as the photograph does."""
    r = math.hypot(vector[0], vector[1])
    phi = math.degrees(math.atan2(vector[1], vector[0])) if r > 1e-9 else -90.0
    return round(math.degrees(math.atan2(r, vector[2])), 3), round(phi, 3)


def crop(name, kind, column, row, magnification):
    """One crop as an entry of "photographs". It is lit and seen from its own angles: the lights and the camera are near."""
    x_px, y_px = STEP_PX * (column - 1), STEP_PX * (row - 1)
    at_cm = (x_px / PX_PER_CM / magnification, -y_px / PX_PER_CM / magnification, 0.0)
    light, camera = ([a - b for a, b in zip(v, at_cm)] for v in (LIGHT_CM[kind], (0.0, 0.0, CAMERA_CM)))
    vignette = math.exp(-(x_px ** 2 + y_px ** 2) / VIGNETTE_PX ** 2) ** GAMMA
    half = round(CROP_PX * magnification / 2)
    left, top = EDGE_PX // 2 + x_px - half, EDGE_PX // 2 + y_px - half
    (light_theta, light_phi), (camera_theta, camera_phi) = angles(light), angles(camera)
    return {"file": f"{name}_{kind}{row}{column}.png", "set": "fit" if (row + column) % 2 == 0 else "held-out",
            "light_theta_deg": light_theta, "light_phi_deg": light_phi, "camera_theta_deg": camera_theta, "camera_phi_deg": camera_phi,
            # a white diffuser that faces the light has radiance 1
            "scale": math.pi * sum(v * v for v in light) / LIGHT_INTENSITY / vignette,
            "crop_px": [left, top, left + 2 * half, top + 2 * half], "transfer": "srgb"}


def crops(name, found):
    """Nine crops of R and eight of T, whose middle shows the lamp."""
    return [crop(name, kind, column, row, found["magnification"][kind])
            for kind in "RT" for row in range(3) for column in range(3) if (kind, row, column) != ("T", 1, 1)]


def described_cloth(name, found):
    """The worker takes draft, threads per centimetre and crimp from the more certain photograph. The kinds have as many
    fibers as their width over spacing takes."""
    spacing_um = [1e4 * s / PX_PER_CM for s in found["spacing_px"]]
    fibers = [max(7, round(PACKING / FLATNESS * (c * s / (2 * FIBER_RADIUS_UM)) ** 2)) for c, s in zip(COVER, spacing_um)]
    n_warp, n_weft = len(found["draft"][0]), len(found["draft"])
    return {"texture": f"{name}_{found['best']}.png", "texture_px_per_mm": PX_PER_CM / 10 * found["magnification"][found["best"]],
            "tile_warps": n_warp * math.ceil(8 / n_warp), "tile_wefts": n_weft * math.ceil(6 / n_weft), "disorder": DISORDER,
            "warp": [0], "weft": [1],
            "yarns": [{"name": k, "fibers": n, "fiber_radius_um": FIBER_RADIUS_UM, "flatness": FLATNESS, "packing": PACKING}
                      for k, n in zip(("warp", "weft"), fibers)]}


def copies(arguments, name, photographs):
    """Files of the photographs under the names of their crops, because a job names each file once."""
    folder = os.path.join(arguments.keep, "crops")
    os.makedirs(folder, exist_ok=True)
    for p in photographs:
        kind = p["file"][len(name) + 1]
        shutil.copy(os.path.join(arguments.photographs, f"{name}_{kind}.png"), os.path.join(folder, p["file"]))
    return [os.path.join(folder, p["file"]) for p in photographs]


def run_pair(arguments, name, found):
    """Runs the job of a pair. A crop that the worker refuses as saturated is left out."""
    fit = {"models": ["textile.v3"], "path_budget": arguments.path_budget, "render_px": CROP_PX, "render_samples": 64, "tied": TIED,
           "nuisance": {"gain": "global", "gain_prior_rel": 0.15}}
    photographs = everything = crops(name, found)
    while True:
        n_left_out = len(everything) - len(photographs)
        folder = os.path.join(arguments.keep, name if n_left_out == 0 else f"{name}-without-{n_left_out}")
        document = {"sample": name, "cloth": described_cloth(name, found), "lamp": LAMP,
                    "camera": {"crop_cm": CROP_PX / PX_PER_CM, "far_field": True, "blur_mm": 10 * BLUR_PX / PX_PER_CM},
                    "black_sheet": False, "photographs": photographs, "fit": fit}
        try:
            files = copies(arguments, name, photographs) + [os.path.join(arguments.photographs, document["cloth"]["texture"])]
            return folder, document, *run_job(arguments.build, folder, document, files)
        except Failure:
            with open(os.path.join(folder, "status.json"), encoding="utf-8") as f:
                error = json.load(f)["error"] or {}
            place = re.match(r"photographs\[(\d+)\]", error.get("field") or "")
            if place is None or "saturated" not in error["text"]:
                raise
            at = int(place.group(1))
            print(f"{name}: {photographs[at]['file']} is left out, it is saturated", file=sys.stderr)
            photographs = photographs[:at] + photographs[at + 1:]


def look(arguments, folder, document, result, period_px, kind, part):
    """Mean color and contrasts of photograph and rendering over the crops of one photograph and set."""
    color, contrast = {"measured": [], "rendered": []}, {"photograph": [], "rendering": []}
    for p, row in zip(document["photographs"], result["rows"]):
        if p["set"] != part or f"_{kind}" not in p["file"]:
            continue
        answer = phantom(arguments, "look", "--photograph", os.path.join(folder, "input", p["file"]), "--crop-px", ",".join(map(str, p["crop_px"])),
                         "--rendering", os.path.join(folder, "results", row["rendering_exr"]), "--period-px", period_px)
        for key, values in color.items():
            values.append(row[key])
        for key, values in contrast.items():
            values.append(answer[key]["contrast"])
    mean = {k: [sum(column) / len(v) for column in zip(*v)] for k, v in color.items()}
    rms = {k: [math.sqrt(sum(x * x for x in column) / len(v)) for column in zip(*v)] for k, v in contrast.items()}
    ratios = [a / b for a, b in zip(mean["rendered"], mean["measured"])], [a / b for a, b in zip(rms["rendering"], rms["photograph"])]
    return {"color": ratios[0], "contrast": ratios[1], "errors": [math.sqrt(sum((r - 1) ** 2 for r in list_) / 3) for list_ in ratios]}


def judge(arguments, found, job, part):
    """The worse of the two photographs' errors: (color, contrast)."""
    folder, document, result, _ = job
    looks = {kind: look(arguments, folder, document, result, found["period_px"][kind], kind, part) for kind in "RT"}
    for kind, one in looks.items():
        print(f"  {document['sample']}, {part}, {kind}: rendered over measured: color {', '.join(f'{v:.3f}' for v in one['color'])}; contrast at half "
              f"of, at and at twice the period {', '.join(f'{v:.2f}' for v in one['contrast'])}", file=sys.stderr)
    return [max(one["errors"][k] for one in looks.values()) for k in range(2)]


def picture(arguments, name, job):
    """Renderings beside the photographs, the crop above the middle of each: NAME.png in the folder of the jobs. Pictures
    of both lights have an exposure of their own. Returns the renderings."""
    folder, _, result, _ = job
    rows = []
    for kind, factor in (("R", 0.6), ("T", 1.2)):
        row = next(r for r in result["rows"] if r["name"].startswith(f"{name}_{kind}01"))
        files = ((row["photograph_png"], factor), (row["rendering_png"], factor * result["nuisance"][0]["value"]))
        rows.append([brighten(read_png(os.path.join(folder, "results", file)), f) for file, f in files])
    write_png(os.path.join(arguments.keep, f"{name}.png"), compose(rows, PICTURE_PX))
    return [row[1] for row in rows]


def bench_pair(arguments, name):
    found = detect(arguments, name)
    job = run_pair(arguments, name, found)
    renderings = picture(arguments, name, job)
    judge(arguments, found, job, "fit")
    color, contrast = judge(arguments, found, job, "held-out")
    result = job[2]
    print(f"{name}: fitted {result['fit_rel_rms']:.3f}, held out {result['heldout_rel_rms']:.3f}, gain {result['nuisance'][0]['value']:.3f}, "
          f"{'converged' if result['converged'] else 'not converged'}", file=sys.stderr)
    figure(f"cloth.pairs.{name}.colour_error", round(color, 4), "1")
    figure(f"cloth.pairs.{name}.contrast_error", round(contrast, 4), "1")
    figure(f"cloth.pairs.{name}.wall_s", round(job[3], 1), "s")
    return renderings


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", default=os.path.join(ROOT, "build"))
    parser.add_argument("--keep", help="folder of the jobs (default: bench-pairs in the build folder)")
    parser.add_argument("--photographs", default=os.path.join(DATA, "reflection-transmission-photos"))
    parser.add_argument("--path-budget", type=int, default=800000)
    parser.add_argument("--picture", help="write the renderings of all pairs to this PNG: reflected above, lit through below")
    parser.add_argument("what", nargs="*", help="pairs")
    arguments = parser.parse_args()
    arguments.build = os.path.abspath(arguments.build)
    arguments.keep = os.path.abspath(arguments.keep or os.path.join(arguments.build, "bench-pairs"))
    names = sorted(os.path.basename(f)[:-len("_R.png")] for f in glob.glob(os.path.join(arguments.photographs, "*_R.png")))
    if not names:
        print(f"skipped cloth.pairs: no photographs (*_R.png) in {arguments.photographs}", file=sys.stderr)
    os.makedirs(arguments.keep, exist_ok=True)
    renderings = []
    wanted = [name for name in names if not arguments.what or name in arguments.what]
    for name in wanted:
        try:
            renderings.append(bench_pair(arguments, name))
        except Failure as why:
            print(why, file=sys.stderr)
    if arguments.picture and renderings:
        write_png(arguments.picture, compose(list(zip(*renderings)), PICTURE_PX))
    return 0 if len(renderings) == len(wanted) else 1


if __name__ == "__main__":
    sys.exit(main())
