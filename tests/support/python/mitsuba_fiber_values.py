"""Values of selvedge_fiber.py of an export: mitsuba_fiber_values.py FILE reads cases as JSON from standard input, and prints for each fiber one line
with the numbers of eval of all its directions. Before them stand the smallest and the largest values of the parameters of each model, and what the
file says of parameters that it refuses. Run by a Python that has Mitsuba.

A case: "model", "parameters" by name in the units of the job, "along" and "normal" of the fiber at the hit in the frame of the cloth, whose normal is
z; "directions", each of light and camera, in that frame."""
import importlib.util
import json
import sys

import mitsuba
import numpy

mitsuba.set_variant("scalar_rgb")
mitsuba.set_log_level(mitsuba.LogLevel.Error)
spec = importlib.util.spec_from_file_location("selvedge_fiber", sys.argv[1])
plugin = importlib.util.module_from_spec(spec)
spec.loader.exec_module(plugin)


def made(model, parameters):
    return mitsuba.load_dict({"type": "selvedge_fiber", "model": model, **parameters})


def refusal(model, parameters):
    try:
        made(model, parameters)
    except (RuntimeError, ValueError) as error:
        return " ".join(str(error).split())
    return "accepted"


def values_of(case):
    bsdf = made(case["model"], case["parameters"])
    si, context, vector = mitsuba.SurfaceInteraction3f(), mitsuba.BSDFContext(), mitsuba.Vector3f
    along, normal = vector(case["along"]), vector(case["normal"])
    si.sh_frame = mitsuba.Frame3f(vector([float(x) for x in numpy.cross(case["along"], case["normal"])]), along, normal)
    found = []
    for light, camera in case["directions"]:
        si.wi = si.to_local(vector(camera))
        found += [float(x) for x in bsdf.eval(context, si, si.to_local(vector(light)), True)]
    return found


cases = json.load(sys.stdin)
for model_name, bounds in plugin.MODELS.items():
    for name, (low, high) in bounds.items():
        print("bound", model_name, name, low, high)
first = cases[0]
for change in ({"beta_R": 1e3}, {"gamma_TT": None}, {"C_R_g": -0.1}, {"beta_TT": "wide"}):
    altered = {k: v for k, v in {**first["parameters"], **change}.items() if v is not None}
    print("refused", next(iter(change)), refusal(first["model"], altered))
print("refused", "model", refusal("two_lobe.v7", first["parameters"]))
for case in cases:
    print("values", *values_of(case))
