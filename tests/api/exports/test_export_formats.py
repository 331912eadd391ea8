"""The formats of exports, of one job: each folder is opened by the program or the library that it is for where Python has it, and otherwise by a
reader of its published grammar."""
import copy
import csv
import functools
import json
import math
import os
import re
import shutil
import struct
import subprocess
import sys
import zipfile

import jsonschema
import pbrt_file
import pytest
from daemon_under_test import ROOT, program
from exports_python import by_python
from small_cloth import TABLE, hair

sys.path.insert(0, os.path.join(ROOT, "tests", "bench"))
from png_picture import read_png  # noqa: E402

pytestmark = [pytest.mark.slow, pytest.mark.skipif(not os.access(program("selvedge-worker"), os.X_OK), reason="no selvedge-worker in the build folder")]
FIT = {"path_budget": 20000, "render_px": 8, "render_samples": 1, "model": "isotropic.v1"}
FORMATS = ["pbrt", "usd", "blender", "textures"]
SUPPORT = os.path.join(ROOT, "tests", "support")


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    folder = tmp_path_factory.mktemp("exports") / "job"
    (folder / "input").mkdir(parents=True)
    (folder / "input" / "cloth.hair").write_bytes(hair())
    (folder / "input" / "rows.csv").write_text(TABLE)
    (folder / "job.json").write_text(json.dumps({
        "sample": "exports", "composition": "60 % cotton, 40 % bamboo", "weight_g_m2": 180,
        "fibers": {"file": "cloth.hair", "voxel_um": 5}, "measurements": {"file": "rows.csv"}, "fit": FIT,
        "export": {**{name: True for name in FORMATS}, "texture_cm": 2, "texture_px": 512}}))
    subprocess.run([program("selvedge-worker"), "--quiet", "--threads", "2", str(folder)], check=True)
    return folder / "results"


def conversion_of(results, name):
    """What result.json says of a format; the file beside it says the same."""
    (export,) = [e for e in json.loads((results / "result.json").read_text())["exports"] if e["format"] == name]
    assert json.loads((results / "export" / name / "conversion.json").read_text()) == export
    return export


def hair_shares(material, channel, n_theta=16, n_phi=10):
    """Share of the light that pbrt's hair scatters, and of it what turns back; and of a fiber that scatters evenly the relative RMS difference."""
    scattered = turned = weight = difference = whole = 0.0
    for o in range(5):
        theta_o = math.asin((o + 0.5) / 5)
        for i in range(n_theta):
            theta_i = math.asin(-1 + (2 * i + 1) / n_theta)
            for k in range(n_phi):
                phi = math.pi * (k + 0.5) / n_phi
                value = math.cos(theta_o) * pbrt_file.mixed_density(material, theta_o, theta_i, phi, channel, n_offset=12)
                scattered += value * 4 * math.pi / n_theta / n_phi
                turned += value * 4 * math.pi / n_theta / n_phi if phi < math.pi / 2 else 0
                even = math.cos(theta_o) * material["even"] * math.cos(theta_i) / math.pi ** 2
                difference += (value - even) ** 2 / math.cos(theta_o)
                whole += even ** 2 / math.cos(theta_o)
        weight += math.cos(theta_o)
    return scattered / weight, turned / weight, (difference / whole) ** 0.5


def test_a_scene_for_pbrt(results):
    """pbrt is in no package: its grammar is read by pbrt_file, and its hair material is computed a second time there."""
    export, folder = conversion_of(results, "pbrt"), results / "export" / "pbrt"
    assert sorted(p.name for p in folder.iterdir()) == sorted(
        ["cloth.pbrt", "conversion.json", "fibers-0.pbrt", "rows.csv", *(f"view-{i}.pbrt" for i in range(6))])
    scenes = [pbrt_file.read_scene(str(folder / f"view-{i}.pbrt")) for i in range(6)]
    curves = scenes[0]["objects"]["tile"]
    assert len(curves) == json.loads((results / "result.json").read_text())["geometry"]["n_fiber"] and len(scenes[0]["instances"]) >= 4
    (material,), (found,) = {json.dumps(m) for _, m in curves}, export["materials"]
    kind, material = json.loads(material)
    assert kind == "mix" and material["amount"] == pytest.approx([found["hair"][1]["share"]], rel=1e-5)
    assert sum(h["share"] for h in found["hair"]) == pytest.approx(1)
    for (kind, mine), h in zip(material["materials"], found["hair"]):
        assert kind == "hair" and mine["sigma_a"] == pytest.approx(h["absorption"], rel=1e-5)
    material["even"] = found["fitted_albedo"][1]
    albedo, turned, rel_rms = hair_shares(material, 1)
    # fitted on the cloth and to its rows, the mixture is near the fiber, too
    assert albedo == pytest.approx(found["fitted_albedo"][1], abs=0.1)
    assert turned == pytest.approx(found["fitted_turned_back"][1], abs=0.06)
    assert rel_rms < 0.5
    assert 0 < export["rel_rms"] < 0.3 and 0 < export["row_rel_rms"] < 0.3


def test_lamp_and_camera_of_pbrt(results):
    """The lamp of every view faces the cloth from where rows.csv has it, and lights a white diffuser there with radiance 1."""
    folder = results / "export" / "pbrt"
    for i, row in enumerate(csv.DictReader((folder / "rows.csv").open())):
        scene = pbrt_file.read_scene(str(folder / f"view-{i}.pbrt"))
        lamp = [float(row[f"lamp_{a}_mm"]) for a in "xyz"]
        (corners, light), = [(m[0]["P"], m[2]) for m in scene["meshes"] if m[2]]
        at = [corners[3 * k:3 * k + 3] for k in range(4)]
        assert [sum(c) / 4 for c in zip(*at)] == pytest.approx(lamp, abs=1e-3)
        u, v = ([b - a for a, b in zip(at[0], at[k])] for k in (1, 2))
        normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
        distance = math.dist(lamp, (0, 0, 0))
        assert [x / math.dist(u, (0, 0, 0)) ** 2 for x in normal] == pytest.approx([-x / distance for x in lamp], abs=1e-5)
        side, n = math.dist(u, (0, 0, 0)), 40
        steps = [side * ((k + 0.5) / n - 0.5) for k in range(n)]
        lit = sum(distance ** 2 / (distance ** 2 + x * x + y * y) ** 2 for x in steps for y in steps) * (side / n) ** 2 / math.pi
        assert light["L"][0] * lit == pytest.approx(1, rel=1e-3)
        assert scene["view"]["LookAt"][1][:3] == pytest.approx([float(row[f"camera_{a}_mm"]) for a in "xyz"], abs=1e-3)


def test_a_stage_for_usd(results):
    """Opened by the USD library."""
    export, folder = conversion_of(results, "usd"), results / "export" / "usd"
    assert sorted(p.name for p in folder.iterdir()) == ["cloth.usda", "conversion.json", "rows.csv"]
    text = (folder / "cloth.usda").read_text()
    assert text.startswith("#usda 1.0\n") and all(text.count(a) == text.count(b) for a, b in ("{}", "()", "[]"))
    found = json.loads(by_python("pxr", os.path.join(ROOT, "tests", "support", "python", "usd_stage.py"), folder / "cloth.usda"))
    assert found["unit_m"] == 0.001 and found["up"] == "Z" and len(found["instances"]) >= 4 and found["sheet_surface"]["color"] == [0, 0, 0]
    (group,), (material,) = found["curves"], export["materials"]
    assert len(group["fibers"]) == json.loads((results / "result.json").read_text())["geometry"]["n_fiber"]
    assert all(f["radius"] == pytest.approx(0.008, rel=1e-3) for f in group["fibers"])
    surface, preview = group["surface"], material["preview_surface"]
    assert surface["color"] == pytest.approx(preview["diffuse_color"], rel=1e-5) and group["display"] == pytest.approx(surface["color"])
    assert surface["index"] == pytest.approx(preview["index"]) and surface["roughness"] == pytest.approx(preview["roughness"])
    # renderers that read MaterialX get the mixture of hair that the other formats have
    (other,) = conversion_of(results, "pbrt")["materials"]
    assert group["mixture"]["share"] == pytest.approx(material["hair"][1]["share"], rel=1e-5)
    for found_hair, fitted, same in zip(group["mixture"]["hair"], material["hair"], other["hair"]):
        assert fitted == same
        for key, name in (("longitudinal", "longitudinal_roughness"), ("azimuthal", "azimuthal_roughness"), ("index", "index"), ("absorption", "absorption")):
            assert found_hair[key] == pytest.approx(fitted[name], rel=1e-5), key
    for mine, library in zip(group["extent"], group["library_extent"]):
        assert mine == pytest.approx(library, abs=1e-3)
    row = next(csv.DictReader((folder / "rows.csv").open()))
    for name in ("camera", "lamp"):
        at = [float(row[f"{name}_{a}_mm"]) for a in "xyz"]
        assert found[name]["at"] == pytest.approx(at, abs=1e-3)
        assert found[name]["look"] == pytest.approx([-x / math.dist(at, (0, 0, 0)) for x in at], abs=1e-5)
    assert json.loads(by_python("pxr", os.path.join(SUPPORT, "exports", "usd_check.py"), folder / "cloth.usda")) == [[]]
    assert found["lamp"]["side"] == pytest.approx(100) and 100 < found["lamp"]["radiance"] < 1000
    assert found["camera"]["fov_deg"] == pytest.approx(math.degrees(2 * math.atan(0.5 * 0.01 / 1.0)), rel=0.1)


def microfacets(wi, wo, n, index, roughness):
    """GGX of a dielectric, by vectors."""
    h = [a + b for a, b in zip(wi, wo)]
    h = [x / math.hypot(*h) for x in h]
    cos_i, cos_o, cos_h, cos_d = (sum(a * b for a, b in zip(*pair)) for pair in ((wi, n), (wo, n), (h, n), (h, wi)))
    alpha2 = roughness ** 4
    d = alpha2 / (math.pi * (cos_h ** 2 * (alpha2 - 1) + 1) ** 2)
    g = 1.0
    for c in (cos_i, cos_o):
        g *= 2 / (1 + math.sqrt(1 + alpha2 * (1 / c ** 2 - 1)))
    return d * g * pbrt_file.fresnel(cos_d, index) / (4 * cos_i * cos_o)


def test_the_opaque_fiber_of_usd(results):
    """Its own light, the colour by Kubelka and Munk's ratio, and how near it comes to a fiber that scatters evenly, all computed a second time."""
    (material,) = conversion_of(results, "usd")["materials"]
    even, preview = material["fitted_albedo"][1], material["preview_surface"]
    color = preview["diffuse_color"][1]
    n, weight, back, everything, difference, whole = 20, 0.0, 0.0, 0.0, 0.0, 0.0
    for o in range(6):
        sin_o = (o + 0.5) / 6
        cos_o = math.sqrt(1 - sin_o ** 2)
        weight += cos_o
        for i in range(28):
            sin_i = -1 + (2 * i + 1) / 28
            cos_i = math.sqrt(1 - sin_i ** 2)
            for k in range(n):
                phi = math.pi * (k + 0.5) / n
                wo, wi = (cos_o, 0, sin_o), (cos_i * math.cos(phi), cos_i * math.sin(phi), sin_i)
                value = 0.0
                for m in range(16):  # normals that see both
                    a = phi - math.pi / 2 + (math.pi - phi) * (m + 0.5) / 16
                    f = color / math.pi + microfacets(wi, wo, (math.cos(a), math.sin(a), 0), preview["index"], preview["roughness"])
                    value += f * math.cos(a) * math.cos(a - phi) * cos_i / 2 * (math.pi - phi) / 16
                share = cos_o * value * 4 * math.pi / 28 / n
                everything += share
                back += share if phi < math.pi / 2 else 0
                difference += cos_o * (value - even * cos_i / math.pi ** 2) ** 2
                whole += cos_o * (even * cos_i / math.pi ** 2) ** 2
    assert everything / weight == pytest.approx(preview["albedo"][1], rel=0.02)
    assert back / weight == pytest.approx(preview["turned_back"][1], rel=0.02)
    assert (1 - everything / weight) / (back / weight) == pytest.approx((1 - even) / material["fitted_turned_back"][1], rel=0.03)
    assert (difference / whole) ** 0.5 == pytest.approx(preview["rel_rms"], rel=0.05)


def in_blender(folder, tmp_path, *row):
    """What Blender has and renders when it runs the exported script."""
    done = subprocess.run(
        ["blender", "-b", "--factory-startup", "--python-exit-code", "1", "--python", folder / "cloth.py", "--python",
         os.path.join(ROOT, "tests", "support", "python", "blender_scene.py"), "--", tmp_path / "picture.exr", "64", "16", *map(str, row)],
        capture_output=True, text=True, check=False, env={**os.environ, "HOME": str(tmp_path)})
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr
    return json.loads(next(line for line in done.stdout.split("\n") if line.startswith("found "))[6:])


def test_a_scene_for_blender(results, tmp_path):
    export, folder = conversion_of(results, "blender"), results / "export" / "blender"
    made = ["cloth.blend"] if shutil.which("blender") else []
    assert sorted(p.name for p in folder.iterdir()) == [*made, "cloth.py", "conversion.json", "fibers-0.txt", "rows.csv", "scene.json"]
    scene, n_fiber = json.loads((folder / "scene.json").read_text()), json.loads((results / "result.json").read_text())["geometry"]["n_fiber"]
    compile((folder / "cloth.py").read_text(), "cloth.py", "exec")
    if shutil.which("blender") is None:
        pytest.skip("the files are right so far; there is no Blender to open them with (Debian package blender)")
    found = in_blender(folder, tmp_path)
    assert (found["n_object"], found["shared"], found["n_curve"]) == (len(scene["repeats"]), 1, n_fiber)
    assert found["n_point"] == len([x for x in (folder / "fibers-0.txt").read_text().split("\n") if x])
    (material,) = export["materials"]
    assert found["radius"] == pytest.approx(0.008, rel=1e-3) and found["engine"] == "CYCLES"
    assert found["share"] == pytest.approx(material["hair"][1]["share"], rel=1e-5)
    for mine, hair_material in zip(found["hair"], material["hair"]):
        for key, name in (("absorption", "absorption"), ("roughness", "longitudinal_roughness"), ("radial", "azimuthal_roughness"), ("index", "index")):
            assert mine[key] == pytest.approx(hair_material[name], rel=1e-5)
    opened = subprocess.run(["blender", "-b", folder / "cloth.blend", "--python-expr",
                             "import bpy; print('curves', sum(o.type == 'CURVES' for o in bpy.data.objects), bpy.context.scene.camera.name)"],
                            capture_output=True, text=True, check=True, env={**os.environ, "HOME": str(tmp_path)})
    assert f"curves {len(scene['repeats'])} camera\n" in opened.stdout
    rows = list(csv.DictReader((folder / "rows.csv").open()))
    other = in_blender(folder, tmp_path, 2)
    for look, row in ((found, rows[0]), (other, rows[2])):
        assert look["camera"] == pytest.approx([float(row[f"camera_{x}_mm"]) for x in "xyz"], rel=1e-5)
        assert look["mean"] == pytest.approx([float(row[f"rendered_{c}"]) for c in "rgb"], rel=0.4)
    assert found["camera"] != pytest.approx(other["camera"], rel=0.01)


def linear(byte):
    x = byte / 255
    return x / 12.92 if x <= 0.04045 else ((x + 0.055) / 1.055) ** 2.4


def check_image(image, folder):
    """The image of a U3M map: its file is there, and the size on the cloth fits its dots per inch."""
    assert image["repeat"]["mode"] == "normal" and "/" not in image["path"] and 19 < image["width"] < 21 and 19 < image["height"] < 21
    rows = read_png(folder / image["path"])
    width, height = len(rows[0]) / 3, len(rows)
    assert image["width"] / 25.4 * image["dpi"]["x"] == pytest.approx(width) and image["height"] / 25.4 * image["dpi"]["y"] == pytest.approx(height)


def changed(u3m, path, value):
    """A copy with the value at a path, which ... removes."""
    copied = copy.deepcopy(u3m)
    *way, last = path.split(".")
    at = functools.reduce(lambda inner, key: inner[key], way, copied)
    if value is ...:
        del at[last]
    else:
        at[last] = value
    return copied


def check_archive(folder, pictures):
    """The material with its pictures as the part of a zip that U3M 1.1 allows: UTF-8, sizes before the data, nothing beside."""
    data = (folder / "cloth.u3ma").read_bytes()
    with zipfile.ZipFile(folder / "cloth.u3ma") as archive:
        assert archive.testzip() is None and archive.comment == b""
        entries = archive.infolist()
        assert {i.filename for i in entries} == pictures | {"cloth.u3m"}
        for i in entries:
            assert archive.read(i) == (folder / i.filename).read_bytes() and i.date_time[0] >= 2020
            assert (i.create_version, i.create_system, i.extract_version, i.flag_bits, i.compress_type) == (63, 0, 20, 1 << 11, 0)
            assert i.extra == i.comment == b"" and (i.internal_attr, i.external_attr, i.volume) == (0, 0, 0)
            header = struct.unpack_from("<4x5H3I2H", data, i.header_offset)
            assert header[:3] + header[5:8] + header[9:] == (20, 1 << 11, 0, i.CRC, i.file_size, i.file_size, 0)
    assert entries[0].header_offset == 0 and data[-22:-18] == b"PK\5\6"


def test_a_u3m_material(results):
    """The file has what the public schema of version 1.1 (github.com/vizoogmbh/u3m) requires and allows, which notices what it does not allow."""
    folder = results / "export" / "textures"
    u3m = json.loads((folder / "cloth.u3m").read_text())
    with open(os.path.join(SUPPORT, "exports", "u3m_schema.json"), encoding="utf-8") as f:
        schema = jsonschema.Draft7Validator(json.load(f))
    schema.validate(u3m)
    assert re.fullmatch(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ", u3m["material"]["created"])
    for path, value in (("material.front.alpha.constant", 1.1), ("material.front.ior", ...), ("material.front.normal.texture.factor", 1),
                        ("material.front.basecolor.constant.r", -0.1), ("material.front.basecolor.texture.image.path", "../a.png"),
                        ("material.front.roughness.texture.image.path", "aux.png"), ("material.id", "1"),
                        ("material.physics.devices.fab", ""), ("schema", "1.0"), ("extra", 1)):
        assert not schema.is_valid(changed(u3m, path, value)), path
    m, front = u3m["material"], u3m["material"]["front"]
    assert m["name"] == "exports" and m["back"] is m["side"] is None and m["physics"]["thickness"] > 0
    assert m["physics"]["weight"] == 180 and m["physics"]["composition"]["parts"] == [
        {"ratio": 0.6, "type": "Cotton", "name": None}, {"ratio": 0.4, "type": "other", "name": "bamboo"}]
    maps = [v["texture"]["image"] for v in front.values() if isinstance(v, dict) and v.get("texture")]
    assert len(maps) == 7 + (front["alpha"]["texture"] is not None) and front["displacement"]["texture"]["factor"] == pytest.approx(m["physics"]["thickness"])
    check_archive(folder, {i["path"] for i in maps} | {front["preview"]["path"]})
    for image in maps:
        check_image(image, folder)
    principled = conversion_of(results, "textures")["materials"][0]["principled"]
    assert front["basecolor"]["texture"]["image"]["path"] == "principled_base_color.png"
    assert [front["basecolor"]["constant"][c] for c in "rgb"] == pytest.approx(principled["base_color"], rel=1e-6)
    assert front["roughness"]["texture"]["image"]["path"] == "principled_roughness.png" and front["roughness"]["texture"]["factor"] == 1
    assert front["normal"]["texture"]["scale"] == pytest.approx(principled["normal_scale"], rel=1e-6)
    for name in ("specular_value", "sheen_value", "sheen_tint"):
        assert front[name]["constant"] == pytest.approx(principled[name.replace("_value", "")])
    # the mean of the map is the mean that was fitted; holes count as black
    rows, cover = (b"".join(map(bytes, read_png(folder / f"{name}.png"))) for name in ("principled_base_color", "opacity"))
    for c in range(3):
        values = [linear(x) * (o / 255 if front["alpha"]["texture"] else 1) for x, o in zip(rows[c::3], cover[::3])]
        assert sum(values) / len(values) == pytest.approx(principled["base_color"][c], rel=0.03, abs=0.003)


def check_repeats(folder, material):
    """Whole tiles: each is as the first one, and the step from a tile to the next is no larger than steps inside of it."""
    (width, height), repeats = material["size_px"], material["repeats"]
    assert width <= 512 and height <= 512 and width % repeats[0] == height % repeats[1] == 0 and material["size_mm"][0] == pytest.approx(20, abs=1)
    tile = width // repeats[0]
    for name in ("base_color", "normal", "height"):
        rows = read_png(folder / f"{name}.png")
        assert len(rows) == height and len(rows[0]) == 3 * width
        assert rows[height // repeats[1]] == rows[0] and all(row[:3 * tile] == row[3 * tile:6 * tile] for row in rows), name
        steps = [sum(abs(row[3 * x] - row[3 * x + 3]) for row in rows) / height for x in range(tile)]  # the last one leads to the next tile
        assert steps[-1] < 1.6 * max(steps[:-1]) + 1, (name, steps)


def test_textures_of_a_tile(results):
    export, folder = conversion_of(results, "textures"), results / "export" / "textures"
    (material,) = export["materials"]
    assert sorted(p.name for p in folder.iterdir()) == sorted([
        "conversion.json", "cloth.mtlx", "cloth.u3m", "cloth.u3ma", "cloth.usda", "maps.exr", *(f"{n}.png" for n in (
            "preview", "height", "opacity", "base_color", "principled_base_color", "principled_roughness", "principled_anisotropy", "transmission",
            "normal", "roughness", "anisotropy", "anisotropy_rotation", "reflected"))])
    assert json.loads(by_python("pxr", os.path.join(SUPPORT, "exports", "usd_check.py"), folder / "cloth.usda")) == [[]]
    for c in range(3):
        mean = [linear(x) for row in read_png(folder / "reflected.png") for x in row[c::3]]
        assert sum(mean) / len(mean) == pytest.approx(material["albedo"][c], rel=0.03, abs=0.003), "what the preview surface reflects"
    sets = [row["set"] for row in json.loads((results / "result.json").read_text())["rows"]]
    for found in (material, material["principled"]):
        assert 0 < found["rel_rms"] < 0.2 and 0 < found["heldout_rel_rms"] < 0.3 and 0 < found["hemisphere_rel_rms"] < 0.3
        for name, key in (("fit", "rel_rms"), ("held-out", "heldout_rel_rms")):
            assert math.hypot(*(e for e, s in zip(found["row_rel_errors"], sets) if s == name)) / sets.count(name) ** 0.5 == pytest.approx(found[key])
    assert export["row_rel_errors"] == material["principled"]["row_rel_errors"] and 0 < material["pixel_rel_se"] < 0.02
    check_repeats(folder, material)
    # a fiber that scatters less than all its light makes a cloth that does so, too
    both = [a + b for a, b in zip(material["albedo"], material["transmission"])]
    assert all(0 < x < 1 for x in both)
    normal = read_png(folder / "normal.png")
    lengths = [math.hypot(*(2 * x / 255 - 1 for x in row[i:i + 3])) for row in normal for i in range(0, len(row), 3)]
    assert all(x == pytest.approx(1, abs=0.02) for x in lengths) and len({bytes(row) for row in normal}) > 4
    # the highest layer of this cloth runs along x: the surface is rougher along y, a quarter of a turn
    rotation = read_png(folder / "anisotropy_rotation.png")
    turns = sorted(x / 255 for row in rotation for x in row[::3])
    assert turns[len(turns) // 2] == pytest.approx(0.25, abs=0.02)
    found = json.loads(by_python("MaterialX", os.path.join(ROOT, "tests", "support", "python", "materialx_document.py"), folder / "cloth.mtlx"))
    assert found["valid"], found["why"]
    assert found["surface"] == "ND_open_pbr_surface_surfaceshader" and found["unknown"] == found["undefined"] == [] and found["materials"] == ["cloth"]
    assert all((folder / f).exists() for f in found["files"]) and len(found["files"]) == 6 + (material["opacity"] < 0.995)
    assert found["weight"] == pytest.approx(material["specular_weight"], rel=1e-5) and 1 <= material["specular_ior"]
