"""Makes the files of three small jobs, for whoever has no measurements yet: `make examples`, or

    make_examples.py [--bin BUILD/bin] [--threads N] [FOLDER]

FOLDER (default examples) gets scan-and-photographs/, scan-and-table/ and described-cloth/, each with a job.json and its files. The cloths
are synthetic: scans have noise, photographs an error of 0.5 %, and truth.json holds the parameters that a fit should find. A folder that is there is kept.
Uses only the standard library."""
import argparse
import json
import math
import os
import shutil
import subprocess

ANGLES = ("light_theta_deg", "light_phi_deg", "camera_theta_deg", "camera_phi_deg", "cloth_rotation_deg")
ERROR = 0.005
TWILL = {"C_R": (0.06, 0.05, 0.08), "C_TT": (0.72, 0.55, 0.35), "beta_R": 4, "beta_TT": 20, "gamma_TT": 18}
FIT = {"model": "two_lobe.v1", "seed": 1}


def phantom(a, *words):
    subprocess.run([os.path.join(a.bin, "selvedge-phantom"), *map(str, words), "--threads", str(a.threads)], check=True, stdout=subprocess.DEVNULL)


def load(folder, name):
    with open(os.path.join(folder, name), encoding="utf-8") as f:
        return json.load(f)


def write(folder, name, document):
    with open(os.path.join(folder, name), "w", encoding="utf-8") as f:
        json.dump(document, f, indent=1)


def scan(a, folder):
    """Returns the section `volume` of the scan of a twill that is made in the folder, with its true fibers."""
    phantom(a, "cloth", "--weave", "twill", "--seed", 7, "--out", folder)
    return {"files": ["scan.tif"], "voxel_size_um": load(folder, "phantom.json")["cloth"]["voxel_size_um"]}


def photograph(a, folder, paths, px, **parameters):
    """Photographs the true fibers with these parameters; returns the section `photographs`."""
    words = [f"--param={name}={','.join(map(str, value if isinstance(value, tuple) else (value,)))}" for name, value in parameters.items()]
    phantom(a, "photograph", "--fibers", os.path.join(folder, "truth.hair"), "--out", folder, "--seed", 11, "--noise", ERROR, "--paths", paths,
            "--px", px, *words)
    return load(folder, "photographs.json")


def to_table(folder, photographs):
    """Writes the mean radiances of the photographs with their standard errors as a table, and removes the photographs."""
    means = [row["mean_rgb"] + [math.hypot(se, ERROR * x) for x, se in zip(row["mean_rgb"], row["mean_rgb_se"])]
             for row in load(folder, "truth.json")["photographs"]]
    with open(os.path.join(folder, "rows.csv"), "w", encoding="utf-8") as f:
        f.write(",".join(("set", *ANGLES, "r", "g", "b", "r_se", "g_se", "b_se")) + "\n")
        for row, mean in zip(photographs, means):
            f.write(",".join([row["set"], *(f"{row[k]:g}" for k in ANGLES), *(f"{x:.6f}" for x in mean)]) + "\n")
            os.remove(os.path.join(folder, row["file"]))
    return {"file": "rows.csv"}


def scan_and_photographs(a, folder):
    volume = scan(a, folder)
    return {"sample": "twill, scanned and photographed", "volume": volume, "photographs": photograph(a, folder, 131072, 64, **TWILL), "fit": FIT}


def scan_and_table(a, folder):
    volume = scan(a, folder)
    return {"sample": "twill, scanned, with a table", "volume": volume, "measurements": to_table(folder, photograph(a, folder, 131072, 8, **TWILL)), "fit": FIT}


def described_cloth(a, folder):
    cloth = {"weave": "plain", "yarns": [{"fibers": 12, "fiber_radius_um": 8, "twist_per_m": 600}]}
    write(folder, "described.json", cloth)
    phantom(a, "cloth", "--description", os.path.join(folder, "described.json"), "--out", folder)
    os.remove(os.path.join(folder, "scan.tif"))
    shown = photograph(a, folder, 131072, 8, C_R=(0.07, 0.05, 0.05), C_TT=(0.75, 0.4, 0.3), beta_R=5, beta_TT=15, gamma_TT=20)
    return {"sample": "plain weave, described", "cloth": cloth, "measurements": to_table(folder, shown), "fit": FIT}


EXAMPLES = {"scan-and-photographs": scan_and_photographs, "scan-and-table": scan_and_table, "described-cloth": described_cloth}
NEEDED = ("job.json", "truth.json", "scan.tif", "rows.csv")


def make(a, name):
    folder = os.path.join(a.folder, name)
    if os.path.exists(os.path.join(folder, "job.json")):
        print(f"{folder} is there")
        return
    part = f"{folder}.part"
    shutil.rmtree(part, ignore_errors=True)
    os.makedirs(part)
    document = EXAMPLES[name](a, part)
    write(part, "job.json", document)
    for file in os.listdir(part):
        if file not in NEEDED and not file.endswith(".exr"):
            os.remove(os.path.join(part, file))
    shutil.rmtree(folder, ignore_errors=True)
    os.rename(part, folder)
    print(f"{folder}: {document['sample']}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bin", default="build/bin")
    parser.add_argument("--threads", type=int, default=0)
    parser.add_argument("folder", nargs="?", default="examples")
    a = parser.parse_args()
    for name in EXAMPLES:
        make(a, name)
    print(f"run one: {a.bin}/selvedge submit {a.folder}/scan-and-table/job.json --watch")


if __name__ == "__main__":
    main()
