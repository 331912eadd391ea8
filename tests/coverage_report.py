"""Line coverage of the product's C and C++ from the counters under a build folder (`make coverage`): a table of folders,
then one JSON line."""
import collections
import datetime
import json
import os
import subprocess
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
PARTS = ["base", "geometry", "renderer", "optimizer", "server", "clients"]


def measure(build):
    """{file: (lines, lines that ran)}"""
    command = ["gcovr", "--root", ROOT, "--json-summary", "--exclude-throw-branches"]
    for part in PARTS:
        command += ["--filter", os.path.join(ROOT, part) + "/"]
    answer = subprocess.run(command + [os.path.join(ROOT, build)], cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True).stdout
    return {f["filename"]: (f["line_total"], f["line_covered"]) for f in json.loads(answer)["files"]}


def folder_of(path):
    return "/".join(path.split("/")[:-1][:2])


def main():
    files = measure(sys.argv[1])
    folders = collections.defaultdict(lambda: [0, 0])
    for path, counts in files.items():
        for key in (folder_of(path), "all"):
            folders[key][0] += counts[0]
            folders[key][1] += counts[1]
    if folders["all"][0] == 0:
        sys.exit(f"no counters under {sys.argv[1]}")
    print(f"{'folder':28s}{'lines':>8s}{'ran':>8s}{'%':>7s}")
    for name in sorted(folders, key=lambda n: (n == "all", n)):
        total, ran = folders[name]
        print(f"{name:28s}{total:8d}{ran:8d}{100 * ran / total:7.1f}")
    total, ran = folders["all"]
    print(json.dumps({"bench": "line_coverage", "date": datetime.date.today().isoformat(), "tests": "unit, quick API",
                      "lines": total, "lines_ran": ran, "percent": round(100 * ran / total, 1)}))


if __name__ == "__main__":
    main()
