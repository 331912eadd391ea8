"""Traces cloths with the two implementations of renderer/scene (tests/exact) and compares them block by block: with equal
random numbers most paths are the same, so that differences have small standard errors."""
import json
import math
import os
import subprocess
import tempfile

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__)))))
BUILD = os.environ.get("SELVEDGE_BUILD", os.path.join(ROOT, "build"))
PRODUCT, EXACT = "cloth_blocks", "cloth_blocks_exact"

# lamp and camera, theta and phi in degrees, and the rotation of the cloth
CONFIGURATIONS = [[30, 180, 20, 0, 0], [60, 100, 50, 20, 35], [45, 250, 40, 90, 90], [10, 0, 45, 180, 20], [70, 180, 70, 0, 0], [80, 200, 60, 30, 90]]
MODELS = {
    "two_lobe.v1": {"C_R": [0.1, 0.2, 0.4], "C_TT": [0.7, 0.5, 0.85], "beta_R": 6, "beta_TT": 15, "gamma_TT": 20},
    "textile.v3": {"C_R": [0.1, 0.2, 0.3], "C_TT": [0.7, 0.5, 0.85], "beta_R": 8, "beta_TT": 20, "gamma_TT": 25, "w": 0.3},
    "dielectric_near.v1": {"C_T": [0.7, 0.5, 0.85], "eta": 1.55, "beta": 8, "gamma": 15},
    "dielectric.v1": {"C_T": [0.7, 0.5, 0.85], "eta": 1.55, "beta": 8, "gamma": 15},
}
# arguments of `selvedge-phantom cloth`
CLOTHS = {
    "twill7": ["--weave", "twill", "--fibers-per-yarn", "7"],
    "twill19": ["--weave", "twill", "--fibers-per-yarn", "19"],
    "velvet": ["--weave", "velvet"],
    "felt": ["--weave", "felt"],
    "plied": ["--weave", "plain", "--yarn", os.path.join(ROOT, "tests", "exact", "plied_yarn.txt")],
}


def make_cloth(name, folder):
    """Path of the .hair file with the fibers of one of CLOTHS, 16 um wide, in a folder that may hold it already."""
    out = os.path.join(folder, name)
    path = os.path.join(out, "truth.hair")
    if not os.path.exists(path):
        subprocess.run([os.path.join(BUILD, "bin", "selvedge-phantom"), "cloth", "--out", out, "--voxel-um", "2", "--diameter-voxel", "8", *CLOTHS[name]],
                       check=True, stdout=subprocess.DEVNULL)
    return path


def trace(program, fibers, model="two_lobe.v1", configurations=None, blocks=64, paths=256, seed=1, **more):
    """The blocks of each configuration: {"mean": [[r, g, b] of a block], "derivative": {"C_R.r": [of a block], "beta_R.g": ...}}. Colours have
    the derivative of their own channel alone."""
    request = dict(fibers=fibers, model=model, parameters=MODELS[model], configurations=configurations or CONFIGURATIONS, blocks=blocks,
                   paths=paths, seed=seed, **more)
    with tempfile.NamedTemporaryFile("w", suffix=".json") as f:
        json.dump(request, f)
        f.flush()
        out = subprocess.run([os.path.join(BUILD, "tests", "exact", program), f.name], check=True, stdout=subprocess.PIPE)
    return [named(json.loads(out.stdout)["parameters"], rows) for rows in json.loads(out.stdout)["configurations"]]


def named(parameters, rows):
    series = {f"mean.{c}": [row[i] for row in rows] for i, c in enumerate("rgb")}
    n = len(parameters)
    for p, name in enumerate(parameters):
        for i, c in enumerate("rgb"):
            if "." not in name:
                series[f"{name}.{c}"] = [row[3 + i * n + p] for row in rows]
            elif name.endswith("." + c):
                series[name] = [row[3 + i * n + p] for row in rows]
    return series


def mean_and_se(values):
    n = len(values)
    mean = math.fsum(values) / n
    return mean, math.sqrt(math.fsum((v - mean) ** 2 for v in values) / (n - 1) / n)


class Difference:
    """Of two series of blocks with equal random numbers: relative to `scale`, by default the second mean."""

    def __init__(self, one, other, scale=None):
        self.one, self.other = mean_and_se(one), mean_and_se(other)
        difference, se = mean_and_se([a - b for a, b in zip(one, other)])
        scale = abs(self.other[0]) if scale is None else scale
        self.relative, self.se = difference / scale, se / scale

    def __str__(self):
        return f"{self.one[0]:.6g} and {self.other[0]:.6g} +- {self.other[1]:.2g}: {100 * self.relative:+.3f} +- {100 * self.se:.3f} %"


def mean_differences(one, other):
    """{(configuration, channel): Difference of the mean radiances}."""
    return {(i, c): Difference(a[f"mean.{c}"], b[f"mean.{c}"]) for i, (a, b) in enumerate(zip(one, other)) for c in "rgb"}


def derivative_differences(one, other):
    """{(configuration, parameter and channel): Difference}, relative to the root mean square of that derivative over the configurations,
    because derivatives by widths change their sign between them."""
    out = {}
    for name in one[0]:
        if name.startswith("mean."):
            continue
        scale = math.sqrt(math.fsum(mean_and_se(b[name])[0] ** 2 for b in other) / len(other))
        for i, (a, b) in enumerate(zip(one, other)):
            out[i, name] = Difference(a[name], b[name], scale)
    return out


class CommonDifference:
    """The factor, less 1, that takes the derivatives of the other scene by one parameter to those of the first: over all configurations and
    channels, weighted by the standard errors of the differences."""

    def __init__(self, pairs):
        top = bottom = 0.0
        for a, b in pairs:
            d = Difference(a, b, 1.0)
            if d.se > 0:
                top += d.other[0] * d.relative / d.se ** 2
                bottom += d.other[0] ** 2 / d.se ** 2
        self.relative, self.se = top / bottom, 1 / math.sqrt(bottom)

    def __str__(self):
        return f"{100 * self.relative:+.3f} +- {100 * self.se:.3f} %"


def parameter_differences(one, other):
    """{parameter, without its channel: CommonDifference of the derivatives by it}."""
    names = [name for name in one[0] if not name.startswith("mean.")]
    return {symbol: CommonDifference([(a[name], b[name]) for name in names if name.split(".")[0] == symbol for a, b in zip(one, other)])
            for symbol in dict.fromkeys(name.split(".")[0] for name in names)}


def root_mean_square(differences):
    """The root mean square of relative differences and its part that the standard errors explain."""
    n = len(differences)
    return (math.sqrt(math.fsum(d.relative ** 2 for d in differences.values()) / n), math.sqrt(math.fsum(d.se ** 2 for d in differences.values()) / n))
