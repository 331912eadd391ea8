#!/usr/bin/python3
"""The share of renderings of described cloths whose yarns and draft `selvedge-phantom detect` finds, and how certain it
is of wrong drafts: six weaves, warp and weft of two colors and of one, three lights. JSON lines; the table goes to
stderr.

    bench_weave_rendered.py BUILD FOLDER
"""
import json
import os
import subprocess
import sys

WEAVES = ["plain", "twill", "twill31", "satin", "basket", "rib"]
WEFT = {"two": "0.2,0.15,0.1", "one": "0.5,0.5,0.55"}
LIGHTS = [20, 45, 0]  # degrees; the last cloth is turned by 17 degrees
PX, CROP_MM = 320, 3.6
TABLE = """set,light_theta_deg,light_phi_deg,camera_theta_deg,camera_phi_deg,cloth_rotation_deg
fit,20,60,0,0,0
fit,45,20,0,0,0
fit,0,0,0,0,17
"""


def repeats(draft):
    """All drafts that are the same but for where they begin."""
    rows = [draft[i:] + draft[:i] for i in range(len(draft))]
    return {tuple(row[i:] + row[:i] for row in turned) for turned in rows for i in range(len(draft[0]))}


def turned(draft):
    """The draft in a picture that is turned by 90 degrees, in which the wefts are the vertical yarns."""
    return ["".join("10"[int(row[i])] for row in draft) for i in reversed(range(len(draft[0])))]


def main():
    phantom, folder = os.path.join(sys.argv[1], "bin", "selvedge-phantom"), sys.argv[2]
    os.makedirs(folder, exist_ok=True)
    with open(os.path.join(folder, "views.csv"), "w") as file:
        file.write(TABLE)
    n = n_yarns = n_draft = 0
    confidence = {True: [], False: []}
    for weave in WEAVES:
        edge = 10 if weave == "satin" else 8
        path = os.path.join(folder, weave)
        os.makedirs(path, exist_ok=True)
        with open(os.path.join(path, "description.json"), "w") as file:
            json.dump({"weave": weave, "tile_warps": edge, "tile_wefts": edge, "weft": [1],
                       "yarns": [{"fibers": 16, "name": "warp"}, {"fibers": 16, "name": "weft"}]}, file)
        subprocess.run([phantom, "cloth", "--voxel-um", "20", "--out", path, "--description", os.path.join(path, "description.json")],
                       check=True, stdout=subprocess.DEVNULL)
        with open(os.path.join(path, "phantom.json")) as file:
            made = json.load(file)["result"]
        draft = {"plain": ["01", "10"], "twill": ["0110", "1100", "1001", "0011"], "twill31": ["1101", "1011", "0111", "1110"],
                 "satin": ["11101", "10111", "11110", "11011", "01111"], "basket": ["1100", "1100", "0011", "0011"],
                 "rib": ["10", "10", "01", "01"]}[weave]
        for colors, weft in WEFT.items():
            pictures = os.path.join(path, colors)
            subprocess.run([phantom, "photograph", "--fibers", os.path.join(path, "truth.hair"), "--out", pictures, "--groups", "warp,weft",
                            "--param", "warp.C_TT=0.5,0.5,0.55", "--param", f"weft.C_TT={weft}", "--table", os.path.join(folder, "views.csv"),
                            "--px", str(PX), "--crop-cm", str(CROP_MM / 10), "--paths", "300000", "--quiet"], check=True)
            for i, light in enumerate(LIGHTS):
                p = subprocess.run([phantom, "detect", "--photograph", os.path.join(pictures, f"fit-{i:02d}.exr")], capture_output=True)
                found = json.loads(p.stdout)["photographs"][0]
                if "error" not in found:
                    # x points down in these pictures
                    wanted = [um * 1e-3 * PX / CROP_MM for um in reversed(made["yarn_spacing_um"])]
                    spacing = [found["warp"]["spacing_px"], found["weft"]["spacing_px"]]
                    yarns = all(abs(s / w - 1) < 0.03 for s, w in zip(spacing, wanted))
                    right = yarns and tuple(found["draft"]) in repeats(turned(draft)) | repeats(turned(turned(turned(draft))))
                    confidence[right].append(found["confidence"]["draft"])
                    n_yarns += yarns
                    n_draft += right
                n += 1
                print(f"{weave:8s} {colors} color, light at {light:2d}: {found.get('weave', found.get('error'))} "
                      f"{found.get('confidence', {})}", file=sys.stderr, flush=True)
    figures = {"yarns_right": n_yarns / n, "draft_right": n_draft / n, "wrong_draft_confidence_max": max(confidence[False], default=0)}
    for name, value in figures.items():
        print(json.dumps({"name": f"weave.rendered.{name}", "value": round(value, 3), "unit": "1",
                          "better": "lower" if "wrong" in name else "higher", "of": n}))


if __name__ == "__main__":
    main()
