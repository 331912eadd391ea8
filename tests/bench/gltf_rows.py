"""Mean radiances of the rows of an exported glTF folder, by three.js in headless Chromium: gltf_rows.py FOLDER PACKAGES [PX] prints a JSON list of
[r, g, b]. PACKAGES: a folder in which the npm package three is installed (build/exports-node after make test). Run by the system's Python, which has
selenium. Lamps have no size here, and surroundings no light."""
import csv
import json
import os
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.dirname(os.path.abspath(__file__))), "support", "exports"))
import gltf_viewer  # noqa: E402


def places_of(folder):
    with open(os.path.join(folder, "rows.csv"), encoding="utf-8") as f:
        return [{"lamp": [float(row[f"lamp_{a}_mm"]) for a in "xyz"], "camera": [float(row[f"camera_{a}_mm"]) for a in "xyz"],
                 "up": [float(row[f"up_{a}"]) for a in "xyz"], "rotations": int(row["rotations"])} for row in csv.DictReader(f)]


def main():
    folder, packages = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2])
    missing = gltf_viewer.what_is_missing(packages)
    if missing is not None:
        sys.exit(missing)
    print(json.dumps(gltf_viewer.rows(packages, folder, places_of(folder), int(sys.argv[3]) if len(sys.argv) > 3 else 256)))


if __name__ == "__main__":
    main()
