"""A drape of an exported glTF file with the maps of the U3M material, rendered by Mitsuba 3: mitsuba_drape.py GLTF_FOLDER TEXTURES_FOLDER VIEW PX SPP
OUT.npy, VIEW as JSON (exports_side_by_side.py). With one argument less, mitsuba_drape.py IN.exr OUT.npy, it only reads a picture of radiances."""
import json
import os
import sys

import mitsuba
import numpy

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import gltf_file  # noqa: E402  pylint: disable=wrong-import-position

mitsuba.set_variant("scalar_rgb")
mitsuba.set_log_level(mitsuba.LogLevel.Error)


def read_picture(path):
    picture = mitsuba.Bitmap(path)
    names = [field.name for field in picture.struct_()]
    return numpy.array(picture)[..., [names.index(c) for c in "RGB"]]


def mesh_of(folder, surface):
    """The mesh in millimetres, z up. Returns it with the size of a tile."""
    file = gltf_file.GltfFile(os.path.join(folder, "drape.glb"))
    (primitive,) = file.document["meshes"][0]["primitives"]
    position, normal, place = (numpy.array(file.values(primitive["attributes"][k])) for k in ("POSITION", "NORMAL", "TEXCOORD_0"))
    corner = numpy.array(file.values(primitive["indices"]), dtype=numpy.uint32)
    tile = file.document["asset"]["extras"]["tile_mm"]
    turn = numpy.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]], dtype=float)
    properties = mitsuba.Properties()
    properties["bsdf"] = surface(tile)
    mesh = mitsuba.Mesh("drape", len(position), len(corner) // 3, properties, has_vertex_normals=True, has_vertex_texcoords=True)
    values = mitsuba.traverse(mesh)
    for key, value in (("vertex_positions", 1000 * position @ turn.T), ("vertex_normals", normal @ turn.T), ("vertex_texcoords", place)):
        values[key] = value.astype(numpy.float32).ravel()
    values["faces"] = corner
    values.update()
    return mesh


def surface_of(folder, tile):
    """Mitsuba's principled BSDF with the maps of cloth.u3m, both sides."""
    with open(os.path.join(folder, "cloth.u3m"), encoding="utf-8") as f:
        front = json.load(f)["material"]["front"]

    def bitmap(key, raw=True):
        texture = front[key]["texture"]
        if texture is None:
            return front[key]["constant"]
        image, factor = texture["image"], texture.get("factor", 1.0)
        pixels = numpy.array(mitsuba.Bitmap(os.path.join(folder, image["path"])), dtype=numpy.float32)[..., :3] / 255.0
        if not raw:
            pixels = numpy.where(pixels <= 0.04045, pixels / 12.92, ((pixels + 0.055) / 1.055) ** 2.4)
        factor = numpy.array([factor[c] for c in "rgb"] if isinstance(factor, dict) else factor, dtype=numpy.float32)
        size = mitsuba.ScalarTransform4f().scale([tile[0] / image["width"], tile[1] / image["height"], 1])
        return {"type": "bitmap", "bitmap": mitsuba.Bitmap((pixels * factor).astype(numpy.float32)), "raw": True, "to_uv": size}

    bsdf = {"type": "principled", "base_color": bitmap("basecolor", raw=False), "roughness": bitmap("roughness"),
            "anisotropic": bitmap("anisotropy_value"), "specular": front["specular_value"]["constant"], "sheen": front["sheen_value"]["constant"],
            "sheen_tint": front["sheen_tint"]["constant"], "clearcoat": front["clearcoat_value"]["constant"],
            "clearcoat_gloss": 1.0 - front["clearcoat_roughness"]["constant"]}
    return mitsuba.load_dict({"type": "twosided", "bsdf": {"type": "normalmap", "normalmap": bitmap("normal"), "bsdf": bsdf}})


def main():
    if len(sys.argv) == 3:
        numpy.save(sys.argv[2], read_picture(sys.argv[1]))
        return
    gltf, textures, view, px, spp, out = sys.argv[1], sys.argv[2], json.loads(sys.argv[3]), int(sys.argv[4]), int(sys.argv[5]), sys.argv[6]
    t, half = mitsuba.ScalarTransform4f, 0.5 * view["width_mm"]
    place = t().look_at(origin=[500 * x for x in view["camera"]], target=[0, 0, 0], up=view["up"]) @ t().scale([half, half, 1])
    scene = mitsuba.load_dict({
        "type": "scene", "integrator": {"type": "path", "max_depth": 4}, "drape": mesh_of(gltf, lambda tile: surface_of(textures, tile)),
        "lamp": {"type": "directional", "direction": [-x for x in view["lamp"]], "irradiance": {"type": "rgb", "value": [float(numpy.pi)] * 3}},
        "camera": {"type": "orthographic", "to_world": place, "near_clip": 1, "far_clip": 2000, "sampler": {"type": "independent", "sample_count": spp},
                   "film": {"type": "hdrfilm", "width": px, "height": px, "rfilter": {"type": "box"}}}})
    numpy.save(out, numpy.array(mitsuba.render(scene))[..., :3])


if __name__ == "__main__":
    main()
