"""Renders one row of an exported scene with Mitsuba 3, and prints its mean radiance: mitsuba_row.py FOLDER ROW PX SPP. Run by a Python that has
Mitsuba (pip install mitsuba), in a process of its own, because Mitsuba may end the process on an error."""
import csv
import json
import os
import sys

import mitsuba
import numpy


def main():
    folder, row, px, spp = sys.argv[1], int(sys.argv[2]), sys.argv[3], sys.argv[4]
    mitsuba.set_variant("scalar_rgb")
    with open(os.path.join(folder, "rows.csv"), encoding="utf-8") as f:
        wanted = list(csv.DictReader(f))[row]
    place = {key.replace("_mm", ""): value for key, value in wanted.items() if key.startswith(("lamp_", "camera_", "up_"))}
    scene = mitsuba.load_file(os.path.join(folder, "scene.xml"), px=px, spp=spp, **place)
    picture = numpy.array(mitsuba.render(scene))
    print(json.dumps([float(x) for x in picture[..., :3].mean((0, 1))]))


if __name__ == "__main__":
    main()
