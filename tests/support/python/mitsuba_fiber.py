"""Checks selvedge_fiber.py of an export in Mitsuba: mitsuba_fiber.py FILE prints as JSON, for both models and some views, the light that a clear
fiber gives back (the integral of eval), the integral of pdf, and mean and standard error of the weights of samples. Run by a Python that has
Mitsuba."""
import importlib.util
import json
import math
import random
import sys

import mitsuba

mitsuba.set_variant("scalar_rgb")
spec = importlib.util.spec_from_file_location("selvedge_fiber", sys.argv[1])
spec.loader.exec_module(importlib.util.module_from_spec(spec))
CLEAR = {"beta_R": 8, "beta_TT": 20, "gamma_TT": 30, **{f"C_R_{c}": 0.2 for c in "rgb"}, **{f"C_TT_{c}": 1.0 for c in "rgb"}}
MODELS = {"two_lobe.v1": CLEAR, "textile.v3": {**CLEAR, "w": 0.3, "s": 0.5, "f": 0.6, "h": 0.4}}
N_THETA, N_PHI, N_SAMPLE = 90, 72, 3000


def direction(theta, phi):
    return mitsuba.Vector3f(math.cos(theta) * math.sin(phi), math.sin(theta), math.cos(theta) * math.cos(phi))


def view(bsdf, theta_deg, phi_deg):
    si, ctx, source = mitsuba.SurfaceInteraction3f(), mitsuba.BSDFContext(), random.Random(5)
    si.wi = direction(math.radians(theta_deg), math.radians(phi_deg))
    si.sh_frame = mitsuba.Frame3f(mitsuba.Vector3f(1, 0, 0), mitsuba.Vector3f(0, 1, 0), mitsuba.Vector3f(0, 0, 1))
    given = density = 0.0
    for i in range(N_THETA):
        theta = -0.5 * math.pi + (i + 0.5) * math.pi / N_THETA
        for k in range(N_PHI):
            solid = math.cos(theta) * math.pi / N_THETA * 2 * math.pi / N_PHI
            wo = direction(theta, 2 * math.pi * (k + 0.5) / N_PHI)
            given += solid * float(bsdf.eval(ctx, si, wo, True)[1])
            density += solid * float(bsdf.pdf(ctx, si, wo, True))
    weights = []
    for _ in range(N_SAMPLE):
        sample, value = bsdf.sample(ctx, si, source.random(), mitsuba.Point2f(source.random(), source.random()), True)
        assert abs(sample.pdf / bsdf.pdf(ctx, si, sample.wo, True) - 1) < 1e-3
        weights.append(float(value[1]))
    mean = sum(weights) / N_SAMPLE
    spread = math.sqrt(sum((w - mean) ** 2 for w in weights) / N_SAMPLE / (N_SAMPLE - 1))
    return {"model": None, "theta_deg": theta_deg, "given_back": given, "pdf": density, "mean": mean, "se": spread}


print(json.dumps([{**view(bsdf, *at), "model": model}
                  for model, numbers in MODELS.items()
                  for bsdf in [mitsuba.load_dict({"type": "selvedge_fiber", "model": model, **{k: float(v) for k, v in numbers.items()}})]
                  for at in ((0, 10), (35, 50), (-60, -20))]))
