"""Renders rows of an exported scene with Mitsuba 3, and prints a line with the mean radiance of each: mitsuba_row.py FORMAT FOLDER ROW[,ROW...] PX
SPP. Run by a Python that has Mitsuba (pip install mitsuba usd-core), in a process of its own, because Mitsuba may end the process on an error.

FORMAT mitsuba: the scene as it is. mitsuba_plugin: the scene with the exported plug-ins, which is fast with LLVM 19 named in DRJIT_LIBLLVM_PATH.
pbrt: what a reader of pbrt's grammar finds in the view of that row, with Mitsuba's hair material, which is the same as pbrt's. usd: what the USD
library finds in the stage, with the hair material of its MaterialX network; lamp and camera are those of the row in rows.csv, which the stage has
for the first row only. usd_preview: the same with the principled BSDF of the numbers of its preview surface.
textures: a plane with the maps of the U3M material."""
import csv
import importlib
import json
import os
import subprocess
import sys

import drjit
import mitsuba
import numpy

SUPPORT = os.path.join(os.path.dirname(os.path.dirname(os.path.abspath(__file__))), "support", "python")
sys.path.insert(0, SUPPORT)
import pbrt_file  # noqa: E402  pylint: disable=wrong-import-position


def place_of(folder, row):
    with open(os.path.join(folder, "rows.csv"), encoding="utf-8") as f:
        wanted = list(csv.DictReader(f))[row]
    return {key.replace("_mm", ""): value for key, value in wanted.items() if key.startswith(("lamp_", "camera_", "up_"))}


def mitsuba_scene(folder, row, px, spp):
    return mitsuba.load_file(os.path.join(folder, "scene.xml"), px=px, spp=spp, **place_of(folder, row))


def mitsuba_plugin_scene(folder, row, px, spp):
    sys.path.insert(0, folder)
    importlib.import_module("selvedge_fiber")
    return mitsuba.load_file(os.path.join(folder, "exact.xml"), px=px, spp=spp, **place_of(folder, row))


def curves(folder, name, fibers, bsdf):
    """A shape of B-splines from (points, radius) of each fiber."""
    path = os.path.join(folder, f"curves-{name}.txt")
    with open(path, "w", encoding="utf-8") as f:
        for points, radius in fibers:
            f.writelines(f"{x} {y} {z} {radius}\n" for x, y, z in points)
            f.write("\n")
    return {"type": "bsplinecurve", "filename": path, "bsdf": bsdf}


def rgb(value):
    return {"type": "rgb", "value": list(value)}


def square(corners, **more):
    """A shape of two triangles over corners a, a + u, a + v, a + u + v."""
    a, u, v = (numpy.array(corners[k]) for k in range(3))
    middle, n = (u + v) / 2, numpy.cross(u - a, v - a)
    turn = numpy.eye(4)
    turn[:3, 0], turn[:3, 1], turn[:3, 2], turn[:3, 3] = (u - a) / 2, (v - a) / 2, n / numpy.linalg.norm(n), middle
    return {"type": "rectangle", "to_world": mitsuba.ScalarTransform4f(turn), **more}


def sensor(camera, target, up, kind, px, spp, near=1.0):
    """kind: (half width of an orthographic camera, None) or (None, angle of view in degrees)."""
    half, fov = kind
    place = mitsuba.ScalarTransform4f().look_at(origin=camera, target=target, up=up)
    film = {"type": "hdrfilm", "width": px, "height": px, "rfilter": {"type": "box"}}
    more = {"type": "perspective", "fov": fov} if half is None else {"type": "orthographic"}
    if half is not None:
        place = place @ mitsuba.ScalarTransform4f().scale([half, half, 1])
    return {**more, "to_world": place, "film": film, "near_clip": near, "sampler": {"type": "independent", "sample_count": spp}}


def assemble(shapes, at, others):
    scene = {"type": "scene", "integrator": {"type": "path", "max_depth": -1}, **others}
    scene["tile"] = {"type": "shapegroup", **{f"s{i}": s for i, s in enumerate(shapes)}}
    for i, where in enumerate(at):
        scene[f"i{i}"] = {"type": "instance", "shapegroup": {"type": "ref", "id": "tile"}, "to_world": mitsuba.ScalarTransform4f().translate(list(where))}
    return mitsuba.load_dict(scene)


def threes(flat):
    return [flat[i:i + 3] for i in range(0, len(flat), 3)]


def pbrt_surroundings(found, px, spp):
    """Lamps, sheet and camera of a view."""
    others = {}
    for i, (mesh, _, light) in enumerate(found["meshes"]):
        more = {"emitter": {"type": "area", "radiance": rgb(light["L"])}} if light else {}
        others[f"m{i}"] = square(threes(mesh["P"]), bsdf={"type": "diffuse", "reflectance": rgb((0, 0, 0))}, **more)
    for i, (kind, light) in enumerate(found["lights"]):
        others[f"l{i}"] = {"type": "constant", "radiance": rgb(light["L"])} if kind == "infinite" else {
            "type": "directional", "direction": [b - a for a, b in zip(light["from"], light["to"])], "irradiance": rgb(light["L"])}
    at = found["view"]["LookAt"][1]
    plugin, p = found["view"]["Camera"]
    kind = (p["screenwindow"][1], None) if plugin == "orthographic" else (None, p["fov"][0])
    near = 0.9 * float(numpy.linalg.norm(at[:3]))
    others["sensor"] = sensor(at[:3], at[3:6], at[6:], kind, px, spp, near)
    return others


def hair_of_pbrt(m):
    return {"type": "hair", "longitudinal_roughness": m["beta_m"][0], "azimuthal_roughness": m["beta_n"][0], "scale_tilt": m["alpha"][0],
            "int_ior": m["eta"][0], "sigma_a": rgb(m["sigma_a"])}


def pbrt_scene(folder, row, px, spp):
    found = pbrt_file.read_scene(os.path.join(folder, f"view-{row}.pbrt"))
    fibers = {}
    for shape, (_, m) in found["objects"]["tile"]:
        fibers.setdefault(json.dumps(m), []).append((threes(shape["P"]), shape["width"][0] / 2))
    shapes = []
    for i, (m, of_material) in enumerate(fibers.items()):
        m = json.loads(m)
        shapes.append(curves(folder, i, of_material, {
            "type": "blendbsdf", "weight": m["amount"][0], **{f"hair{k}": hair_of_pbrt(hair) for k, (_, hair) in enumerate(m["materials"])}}))
    others = pbrt_surroundings(found, px, spp)
    return assemble(shapes, [where for _, where in found["instances"]], others)


def turned_bsdf():
    """Registers the BSDF `turned`: the one inside it with its frame turned about the normal by the texture `turns`, which Mitsuba has no input for."""
    class Turned(mitsuba.BSDF):
        def __init__(self, props):
            mitsuba.BSDF.__init__(self, props)
            self.inner, self.turns = props["inner"], props["turns"]
            self.m_components = [self.inner.flags(i) for i in range(self.inner.component_count())]
            self.m_flags = self.inner.flags()

        def frame(self, si, active):
            angle = self.turns.eval_1(si, active) * (2 * drjit.pi)
            return drjit.cos(angle), drjit.sin(angle)

        @staticmethod
        def turn(v, cosine, sine):
            return mitsuba.Vector3f(cosine * v.x + sine * v.y, cosine * v.y - sine * v.x, v.z)

        def inside(self, si, active):
            cosine, sine = self.frame(si, active)
            turned = mitsuba.SurfaceInteraction3f(si)
            turned.wi = self.turn(si.wi, cosine, sine)
            return turned, cosine, sine

        def sample(self, ctx, si, sample1, sample2, active=True):
            turned, cosine, sine = self.inside(si, active)
            found, value = self.inner.sample(ctx, turned, sample1, sample2, active)
            found.wo = self.turn(found.wo, cosine, -sine)
            return found, value

        def eval(self, ctx, si, wo, active=True):
            turned, cosine, sine = self.inside(si, active)
            return self.inner.eval(ctx, turned, self.turn(wo, cosine, sine), active)

        def pdf(self, ctx, si, wo, active=True):
            turned, cosine, sine = self.inside(si, active)
            return self.inner.pdf(ctx, turned, self.turn(wo, cosine, sine), active)

        def eval_pdf(self, ctx, si, wo, active=True):
            turned, cosine, sine = self.inside(si, active)
            return self.inner.eval_pdf(ctx, turned, self.turn(wo, cosine, sine), active)

    mitsuba.register_bsdf("turned", Turned)


def textures_scene(folder, row, px, spp):
    """A plane with the maps of the U3M material under Mitsuba's principled BSDF, in the light of pbrt's view of that row. What a fiber shades or
    lets through is in the maps, so there is no sheet below."""
    with open(os.path.join(folder, "cloth.u3m"), encoding="utf-8") as f:
        front = json.load(f)["material"]["front"]
    found = pbrt_file.read_scene(os.path.join(os.path.dirname(folder), "pbrt", f"view-{row}.pbrt"))
    found["meshes"] = [m for m in found["meshes"] if m[2]]
    half = 30.0

    def pixels_of(key, raw=True):
        bitmap = mitsuba.Bitmap(os.path.join(folder, front[key]["texture"]["image"]["path"]))
        if raw:  # numbers are stored as they are, whatever the file says of a curve
            return numpy.array(bitmap, dtype=numpy.float32)[..., :3] / 255.0
        return numpy.array(bitmap.convert(component_format=mitsuba.Struct.Type.Float32, srgb_gamma=False))[..., :3]

    def texture(key, pixels):
        image = front[key]["texture"]["image"]
        size = mitsuba.ScalarTransform4f().scale([2 * half / image["width"], 2 * half / image["height"], 1])
        return {"type": "bitmap", "bitmap": mitsuba.Bitmap(numpy.ascontiguousarray(pixels, dtype=numpy.float32)), "raw": True, "to_uv": size}

    def colors(key):
        factor = front[key]["texture"]["factor"]
        return texture(key, pixels_of(key, raw=False) * numpy.array([factor[c] for c in "rgb"]))

    def numbers(key):
        scale = front[key]["texture"]
        return texture(key, scale["offset"] + scale["factor"] * pixels_of(key)[..., :1])

    normal = (2 * pixels_of("normal") - 1) * numpy.array([front["normal"]["texture"]["scale"]] * 2 + [1])
    normal /= numpy.linalg.norm(normal, axis=2, keepdims=True)
    turned_bsdf()
    surface = {"type": "principled", "base_color": colors("basecolor"), "roughness": numbers("roughness"), "anisotropic": numbers("anisotropy_value"),
               "specular": front["specular_value"]["constant"], "sheen": front["sheen_value"]["constant"], "sheen_tint": front["sheen_tint"]["constant"]}
    turned = {"type": "turned", "inner": surface, "turns": numbers("anisotropy_rotation")}
    bsdf = {"type": "normalmap", "normalmap": texture("normal", 0.5 * (normal + 1)), "use_shadowing_function": False,
            "flip_invalid_normals": False, "bsdf": turned}
    if front["alpha"]["texture"]:
        bsdf = {"type": "mask", "opacity": numbers("alpha"), "bsdf": bsdf}
    plane = {"type": "rectangle", "to_world": mitsuba.ScalarTransform4f().scale([half, half, 1]), "bsdf": bsdf}
    return mitsuba.load_dict({"type": "scene", "integrator": {"type": "path"}, "plane": plane, **pbrt_surroundings(found, px, spp)})


def preview_surface(surface):
    """A UsdPreviewSurface without metal and coat: diffuse under a dielectric."""
    return {"type": "principled", "base_color": rgb(surface["color"]), "roughness": surface["roughness"], "eta": max(surface["index"], 1.001)}


def hair_of_materialx(mixture):
    """MaterialX's hair without tilt, with pbrt's ratios of the roughnesses, is that of pbrt and Mitsuba."""
    hair = [{"type": "hair", "longitudinal_roughness": h["longitudinal"], "azimuthal_roughness": h["azimuthal"], "scale_tilt": 0, "int_ior": h["index"],
             "sigma_a": rgb(h["absorption"])} for h in mixture["hair"]]
    return {"type": "blendbsdf", "weight": mixture["share"], "hair0": hair[0], "hair1": hair[1]}


def usd_preview_scene(folder, row, px, spp):
    return usd_scene(folder, row, px, spp, preview=True)


def usd_scene(folder, row, px, spp, preview=False):
    # a process of its own: Mitsuba and the USD library in one process end it
    done = subprocess.run([sys.executable, os.path.join(SUPPORT, "usd_stage.py"), os.path.join(folder, "cloth.usda")], stdout=subprocess.PIPE, check=True)
    found = json.loads(done.stdout)
    place = place_of(folder, row)
    lamp, camera, up = ([float(place[f"{name}_{a}"]) for a in "xyz"] for name in ("lamp", "camera", "up"))
    shapes = []
    for i, group in enumerate(found["curves"]):
        material = preview_surface(group["surface"]) if preview else hair_of_materialx(group["mixture"])
        shapes.append(curves(folder, i, [(f["points"], f["radius"]) for f in group["fibers"]], material))
    turn = mitsuba.ScalarTransform4f().look_at(origin=lamp, target=[0, 0, 0], up=[0, 0.1, 1])
    half = found["lamp"]["side"] / 2
    others = {
        "lamp": {"type": "rectangle", "to_world": turn @ mitsuba.ScalarTransform4f().scale([half, half, 1]),
                 "emitter": {"type": "area", "radiance": rgb([found["lamp"]["radiance"]] * 3)}},
        "sheet": square([found["sheet"][k] for k in (0, 1, 3)], bsdf={"type": "diffuse", "reflectance": rgb(found["sheet_surface"]["color"])}),
        "sensor": sensor(camera, [0, 0, 0], up, (None, found["camera"]["fov_deg"]), px, spp, 0.9 * float(numpy.linalg.norm(camera)))}
    return assemble(shapes, found["instances"], others)


def main():
    form, folder, rows, px, spp = sys.argv[1], sys.argv[2], [int(r) for r in sys.argv[3].split(",")], int(sys.argv[4]), int(sys.argv[5])
    mitsuba.set_variant("llvm_ad_rgb" if "DRJIT_LIBLLVM_PATH" in os.environ else "scalar_rgb")
    mitsuba.set_log_level(mitsuba.LogLevel.Error)  # warnings would stand in what is printed
    makers = {"mitsuba": mitsuba_scene, "mitsuba_plugin": mitsuba_plugin_scene,
              "pbrt": pbrt_scene, "usd": usd_scene, "usd_preview": usd_preview_scene, "textures": textures_scene}
    for row in rows:
        picture = numpy.array(mitsuba.render(makers[form](folder, row, px, spp)))
        print(json.dumps([float(x) for x in picture[..., :3].mean((0, 1))]), flush=True)


if __name__ == "__main__":
    main()
