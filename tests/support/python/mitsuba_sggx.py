"""What Mitsuba makes of a volume of SGGX flakes: mitsuba_sggx.py SGGX.vol DENSITY.vol X Y Z TX TY TZ, with a place in [0, 1]^3 and the fiber's
direction there. Prints the projected areas of the flakes along the fiber and in two directions across it, and the mean radiance of the volume as a
medium under even light. Run by a Python that has Mitsuba."""
import json
import sys

import mitsuba
import numpy

mitsuba.set_variant("scalar_rgb")
sggx, density = ({"type": "gridvolume", "filename": path, "raw": True} for path in sys.argv[1:3])
place, along = numpy.array(sys.argv[3:6], float), numpy.array(sys.argv[6:9], float)
across = numpy.cross(along, numpy.eye(3)[numpy.argmin(abs(along))])
across /= numpy.linalg.norm(across)
phase = mitsuba.load_dict({"type": "sggx", "S": sggx})


def projected_area(direction):
    at = mitsuba.MediumInteraction3f()
    at.p, at.wi = mitsuba.Point3f(*place), mitsuba.Vector3f(*direction)
    at.sh_frame = mitsuba.Frame3f(at.wi)
    return float(phase.projected_area(at))


medium = {"type": "heterogeneous", "albedo": 0.9, "scale": 20.0, "sigma_t": density, "phase": {"type": "sggx", "S": sggx}}
scene = mitsuba.load_dict({
    "type": "scene", "integrator": {"type": "volpath", "max_depth": 8}, "light": {"type": "constant"},
    "cloth": {"type": "cube", "bsdf": {"type": "null"}, "interior": medium,
              "to_world": mitsuba.ScalarTransform4f().translate(0.5).scale(0.5)},
    "sensor": {"type": "orthographic", "film": {"type": "hdrfilm", "width": 8, "height": 8}, "sampler": {"type": "independent", "sample_count": 8},
               "to_world": mitsuba.ScalarTransform4f().look_at([0.5, 0.5, 3.0], [0.5, 0.5, 0.5], [0, 1, 0]).scale(0.5)}})
areas = [projected_area(w) for w in (along, across, numpy.cross(along, across))]
print(json.dumps({"areas": areas, "radiance": float(numpy.array(mitsuba.render(scene)).mean())}))
