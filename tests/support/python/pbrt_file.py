"""Reads scenes for pbrt-v4 by the grammar of its published file format: directives with fixed numbers or with a plugin and typed parameters. What
pbrt would refuse is an error here: unknown directives, plugins and parameters, wrong types and counts, objects and attributes left open."""
import math
import os
import re

TOKEN = re.compile(r"\s+|#[^\n]*|(?P<string>\"[^\"\n]*\")|(?P<bracket>[\[\]])|(?P<word>[^\s\"\[\]#]+)")
NUMBERS = {"LookAt": 9, "Translate": 3, "Scale": 3, "Rotate": 4}
PLAIN = {"WorldBegin", "AttributeBegin", "AttributeEnd", "ObjectEnd"}
NAMED = {"ObjectBegin", "ObjectInstance", "Include", "NamedMaterial"}
PLUGINS = {
    "Camera": {"orthographic": {"screenwindow": "float"}, "perspective": {"fov": "float"}},
    "Film": {"rgb": {"xresolution": "integer", "yresolution": "integer", "filename": "string"}},
    "PixelFilter": {"box": {"xradius": "float", "yradius": "float"}},
    "Sampler": {"independent": {"pixelsamples": "integer"}},
    "Integrator": {"path": {"maxdepth": "integer"}},
    "LightSource": {"distant": {"from": "point3", "to": "point3", "L": "rgb"}, "infinite": {"L": "rgb"}},
    "AreaLightSource": {"diffuse": {"L": "rgb"}},
    "Material": {"hair": {"sigma_a": "rgb", "eta": "float", "beta_m": "float", "beta_n": "float", "alpha": "float"}, "diffuse": {"reflectance": "rgb"},
                 "mix": {"materials": "string", "amount": "float"}},
    "Shape": {"curve": {"type": "string", "basis": "string", "width": "float", "P": "point3"}, "bilinearmesh": {"P": "point3", "alpha": "float"}},
}
OPTIONS_ONLY = {"Camera", "Film", "PixelFilter", "Sampler", "Integrator"}
WORLD_ONLY = {"LightSource", "AreaLightSource", "Material", "MakeNamedMaterial", "NamedMaterial", "Shape",
              "AttributeBegin", "AttributeEnd", "ObjectBegin", "ObjectEnd", "ObjectInstance"}


def tokens(text):
    at = 0
    while at < len(text):
        m = TOKEN.match(text, at)
        assert m, f"pbrt would not read {text[at:at + 20]!r}"
        at = m.end()
        if m.lastgroup:
            yield m.lastgroup, m.group(m.lastgroup)


class Reader:
    def __init__(self, path):
        self.folder = os.path.dirname(path)
        with open(path, encoding="utf-8") as f:
            self.items = list(tokens(f.read()))
        self.at = 0

    def peek(self):
        return self.items[self.at] if self.at < len(self.items) else (None, None)

    def take(self, kind):
        got, value = self.peek()
        assert got == kind, f"a {kind} is missing before {value!r}"
        self.at += 1
        return value.strip('"') if kind == "string" else value

    def values(self, kind):
        """One value, or several in brackets."""
        read = {"float": float, "point3": float, "rgb": float, "integer": int, "string": str}[kind]
        token = "string" if kind == "string" else "word"
        if self.peek() != ("bracket", "["):
            return [read(self.take(token))]
        self.take("bracket")
        found = []
        while self.peek()[0] == token:
            found.append(read(self.take(token)))
        assert self.take("bracket") == "]"
        return found

    def material(self):
        """Type and parameters of a named material, of which the type is the first parameter."""
        assert self.take("string") == "string type"
        (plugin,) = self.values("string")
        assert plugin in PLUGINS["Material"], f"there is no Material {plugin!r}"
        return plugin, self.parameters(PLUGINS["Material"][plugin])

    def parameters(self, allowed):
        found = {}
        while self.peek()[0] == "string":
            kind, name = self.take("string").split()
            assert allowed.get(name) == kind, f"there is no parameter {kind} {name!r}"
            assert name not in found
            found[name] = self.values(kind)
            assert kind not in ("point3", "rgb") or len(found[name]) % 3 == 0
        return found


def directives(path):
    """(name, plugin or None, numbers or parameters) of a file and of those that it includes."""
    r = Reader(path)
    while r.at < len(r.items):
        name = r.take("word")
        if name in NUMBERS:
            yield name, None, [float(r.take("word")) for _ in range(NUMBERS[name])]
        elif name in PLAIN:
            yield name, None, None
        elif name in NAMED:
            what = r.take("string")
            if name == "Include":
                yield from directives(os.path.join(r.folder, what))
            else:
                yield name, what, None
        elif name == "MakeNamedMaterial":
            yield name, r.take("string"), r.material()
        else:
            plugin = r.take("string")
            assert plugin in PLUGINS.get(name, {}), f"there is no {name} {plugin!r}"
            yield name, plugin, r.parameters(PLUGINS[name][plugin])


def check_shape(plugin, p):
    assert len(p["P"]) // 3 == 4 if plugin == "bilinearmesh" else len(p["P"]) // 3 >= 4
    if plugin == "curve":
        assert p["basis"] == ["bspline"] and p["type"] == ["cylinder"] and p["width"][0] > 0


def read_scene(path):  # pylint: disable=too-many-branches
    """What a file describes: view, lights, the curves of each object with their material, where it stands, and other shapes."""
    scene = {"view": {}, "lights": [], "objects": {}, "instances": [], "meshes": []}
    world, stack, object_name, named = False, [], None, {}
    state = {"material": None, "light": None, "translate": [0.0, 0.0, 0.0]}
    for name, plugin, p in directives(path):
        assert name not in OPTIONS_ONLY or not world, f"{name} after WorldBegin"
        assert name not in WORLD_ONLY or world, f"{name} before WorldBegin"
        if name == "WorldBegin":
            world = True
        elif name == "AttributeBegin":
            stack.append(dict(state))
        elif name == "AttributeEnd":
            state = stack.pop()
        elif name == "ObjectBegin":
            assert object_name is None and plugin not in scene["objects"]
            object_name, scene["objects"][plugin] = plugin, []
            stack.append(dict(state))
        elif name == "ObjectEnd":
            object_name, state = None, stack.pop()
        elif name == "ObjectInstance":
            assert plugin in scene["objects"] and object_name is None
            scene["instances"].append((plugin, state["translate"]))
        elif name == "Translate":
            state["translate"] = [a + b for a, b in zip(state["translate"], p)]
        elif name == "Material":
            state["material"] = (plugin, p)
        elif name == "MakeNamedMaterial":
            assert plugin not in named and (p[0] != "mix" or len(p[1]["materials"]) == 2)
            named[plugin] = (p[0], {**p[1], "materials": [named[m] for m in p[1]["materials"]]}) if p[0] == "mix" else p
        elif name == "NamedMaterial":
            state["material"] = named[plugin]
        elif name == "AreaLightSource":
            state["light"] = p
        elif name == "LightSource":
            scene["lights"].append((plugin, p))
        elif name == "Shape":
            check_shape(plugin, p)
            if object_name is None:
                scene["meshes"].append((p, state["material"], state["light"]))
            else:
                scene["objects"][object_name].append((p, state["material"]))
        else:
            scene["view"][name] = (plugin, p)
    assert world and not stack and object_name is None
    assert {"Camera", "LookAt", "Film", "Sampler", "Integrator"} <= set(scene["view"])
    return scene


# ---- pbrt's hair material, after Chiang et al. 2016 and the text of "Physically Based Rendering", 4th edition, section 9.9 ----

def longitudinal(v, sin_i, cos_i, sin_o, cos_o):
    a, b = cos_i * cos_o / v, sin_i * sin_o / v
    terms = [(0.5 * a) ** (2 * k) / math.factorial(k) ** 2 for k in range(60)]
    if v <= 0.1 and a > 12:
        log_i0 = a - 0.5 * math.log(2 * math.pi * a) + math.log1p(1 / (8 * a))
    else:
        log_i0 = math.log(sum(terms))
    return math.exp(log_i0 - b - 1 / v) / (v * (1 - math.exp(-2 / v)))


def fresnel(cos_i, eta):
    cos_t = math.sqrt(1 - (1 - cos_i * cos_i) / eta ** 2)
    parallel, perpendicular = (eta * cos_i - cos_t) / (eta * cos_i + cos_t), (cos_i - eta * cos_t) / (cos_i + eta * cos_t)
    return (parallel ** 2 + perpendicular ** 2) / 2


def hair_lobes(material, h, theta_o, channel):
    """Attenuations A_p, longitudinal variances and exit azimuths of R, TT, TRT and the rest."""
    eta, beta_m, sigma = material["eta"][0], material["beta_m"][0], material["sigma_a"][channel]
    cos_o, sin_o = math.cos(theta_o), math.sin(theta_o)
    cos_t = math.sqrt(1 - (sin_o / eta) ** 2)
    gamma_o, gamma_t = math.asin(h), math.asin(h * cos_o / math.sqrt(eta ** 2 - sin_o ** 2))
    through = math.exp(-sigma * 2 * math.cos(gamma_t) / cos_t)
    f = fresnel(cos_o * math.sqrt(1 - h * h), eta)
    a = [f, (1 - f) ** 2 * through, (1 - f) ** 2 * through ** 2 * f]
    a.append(a[2] * f * through / (1 - through * f))
    v = (0.726 * beta_m + 0.812 * beta_m ** 2 + 3.7 * beta_m ** 20) ** 2
    towards = [2 * p * gamma_t - 2 * gamma_o + p * math.pi for p in range(3)]
    return a, [v, v / 4, 4 * v, 4 * v], towards


def logistic(x, s):
    x = abs((x + math.pi) % (2 * math.pi) - math.pi)
    inside = 2 / (1 + math.exp(-math.pi / s)) - 1
    return math.exp(-x / s) / (s * (1 + math.exp(-x / s)) ** 2) / inside


def mixed_density(material, *direction, **more):
    """The density of a mixture of two hair materials: each point has the second one with the probability `amount`."""
    share = material["amount"][0]
    return sum(part * hair_density(m, *direction, **more) for part, (_, m) in zip((1 - share, share), material["materials"]))


def hair_density(material, theta_o, theta_i, phi, channel, n_offset=24):
    """f cos(theta_i): density of the light from theta_o that leaves into (theta_i, phi), a mean over the width of the hair."""
    beta_n = material["beta_n"][0]
    s = math.sqrt(math.pi / 8) * (0.265 * beta_n + 1.194 * beta_n ** 2 + 5.372 * beta_n ** 22)
    sin_i, cos_i, sin_o, cos_o = math.sin(theta_i), math.cos(theta_i), math.sin(theta_o), math.cos(theta_o)
    total = 0.0
    for k in range(n_offset):
        a, v, towards = hair_lobes(material, -1 + (2 * k + 1) / n_offset, theta_o, channel)
        for p in range(4):
            azimuth = logistic(phi - towards[p], s) if p < 3 else 1 / (2 * math.pi)
            total += a[p] * longitudinal(v[p], sin_i, cos_i, sin_o, cos_o) * azimuth / n_offset
    return total
