"""The largest samples of grid volumes, as Mitsuba reads them: mitsuba_volume.py FILE... Run by a Python that has Mitsuba."""
import json
import sys

import mitsuba
import numpy

mitsuba.set_variant("scalar_rgb")
found = []
for path in sys.argv[1:]:
    volume = mitsuba.load_dict({"type": "gridvolume", "filename": path, "raw": True})
    found.append(float(numpy.array(mitsuba.traverse(volume)["data"]).max()))
print(json.dumps(found))
