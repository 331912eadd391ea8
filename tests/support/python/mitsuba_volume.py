"""What Mitsuba makes of grid volumes. Run by a Python that has Mitsuba.

mitsuba_volume.py FILE...: the largest sample of each.
mitsuba_volume.py flakes SGGX.vol DENSITY.vol X Y Z TX TY TZ, with a place in [0, 1]^3 and the fiber's direction there: the projected areas of the
flakes along the fiber and in two directions across it, and the mean radiance of the volume as a medium under even light.
"""
import json
import sys

import mitsuba
import numpy

mitsuba.set_variant("scalar_rgb")


def volume(path):
    return {"type": "gridvolume", "filename": path, "raw": True}


def projected_area(phase, place, direction):
    at = mitsuba.MediumInteraction3f()
    at.p, at.wi = mitsuba.Point3f(*place), mitsuba.Vector3f(*direction)
    at.sh_frame = mitsuba.Frame3f(at.wi)
    return float(phase.projected_area(at))


def radiance(density, flakes):
    """Of a cube of the medium, from above."""
    medium = {"type": "heterogeneous", "albedo": 0.9, "scale": 20.0, "sigma_t": density, "phase": flakes}
    camera = {"type": "orthographic", "film": {"type": "hdrfilm", "width": 8, "height": 8}, "sampler": {"type": "independent", "sample_count": 8},
              "to_world": mitsuba.ScalarTransform4f().look_at([0.5, 0.5, 3.0], [0.5, 0.5, 0.5], [0, 1, 0]).scale(0.5)}
    cube = {"type": "cube", "bsdf": {"type": "null"}, "interior": medium, "to_world": mitsuba.ScalarTransform4f().translate(0.5).scale(0.5)}
    scene = mitsuba.load_dict({"type": "scene", "integrator": {"type": "volpath", "max_depth": 8}, "light": {"type": "constant"}, "cloth": cube,
                               "sensor": camera})
    return float(numpy.array(mitsuba.render(scene)).mean())


def flakes_of(sggx, density, *numbers):
    place, along = numpy.array(numbers[:3], float), numpy.array(numbers[3:], float)
    across = numpy.cross(along, numpy.eye(3)[numpy.argmin(abs(along))])
    across /= numpy.linalg.norm(across)
    flakes = {"type": "sggx", "S": volume(sggx)}
    phase = mitsuba.load_dict(flakes)
    return {"areas": [projected_area(phase, place, w) for w in (along, across, numpy.cross(along, across))],
            "radiance": radiance(volume(density), flakes)}


def largest(path):
    return float(numpy.array(mitsuba.traverse(mitsuba.load_dict(volume(path)))["data"]).max())


if sys.argv[1] == "flakes":
    print(json.dumps(flakes_of(*sys.argv[2:])))
else:
    print(json.dumps([largest(path) for path in sys.argv[1:]]))
