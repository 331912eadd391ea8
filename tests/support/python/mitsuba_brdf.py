"""Evaluates a file by Mitsuba's BSDF `measured`: mitsuba_brdf.py FILE < JSON list of [light, camera]; prints f cos(camera) at 500 nm as JSON. Run
by a Python that has Mitsuba."""
import json
import sys

import mitsuba

mitsuba.set_variant("scalar_spectral")
bsdf = mitsuba.load_dict({"type": "measured", "filename": sys.argv[1]})
si = mitsuba.SurfaceInteraction3f()
si.wavelengths = [500.0] * 4
values = []
for light, camera in json.load(sys.stdin):
    si.wi = light
    values.append(float(bsdf.eval(mitsuba.BSDFContext(), si, camera)[0]))
print(json.dumps(values))
