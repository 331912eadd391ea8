"""The export as glTF: what the files hold, what Khronos' validator and three.js make of them, and how near three.js comes to the stated error."""
import csv
import io
import json
import math
import os
import shutil
import subprocess
import sys

import pytest
from daemon_under_test import ROOT, program
from small_cloth import TABLE, hair

sys.path.insert(0, os.path.join(ROOT, "tests", "support", "exports"))
from gltf_file import GltfFile  # noqa: E402

image = pytest.importorskip("PIL.Image", reason="python3-pil is not installed")
pytestmark = [pytest.mark.slow, pytest.mark.skipif(not os.access(program("selvedge-worker"), os.X_OK), reason="no selvedge-worker in the build folder")]
PACKAGES = os.path.join(os.path.dirname(os.path.dirname(program("selvedge-worker"))), "exports-node")
DOCUMENT = {"sample": "blue twill", "composition": "100 % silk", "fibers": {"file": "cloth.hair", "voxel_um": 5}, "measurements": {"file": "rows.csv"},
            "fit": {"path_budget": 20000, "render_px": 16, "render_samples": 1, "model": "isotropic.v1"}, "export": {"gltf": True}}


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    folder = tmp_path_factory.mktemp("gltf") / "job"
    (folder / "input").mkdir(parents=True)
    (folder / "input" / "cloth.hair").write_bytes(hair())
    (folder / "input" / "rows.csv").write_text(TABLE)
    (folder / "job.json").write_text(json.dumps(DOCUMENT))
    subprocess.run([program("selvedge-worker"), "--quiet", "--threads", "2", str(folder)], check=True)
    return folder / "results"


@pytest.fixture(scope="module")
def export(results):
    (found,) = json.loads((results / "result.json").read_text())["exports"]
    folder = results / "export" / "gltf"
    assert json.loads((folder / "conversion.json").read_text()) == found
    assert sorted(p.name for p in folder.iterdir()) == ["conversion.json", "drape.glb", "rows.csv", "sphere.glb"]
    return found, folder


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def check_mesh(file):
    """Normals and tangents are perpendicular units, triangles turn as their normals do, and the texture has the true size of a tile."""
    (mesh,) = file.document["meshes"]
    (primitive,) = mesh["primitives"]
    p, n, t, uv = (file.values(primitive["attributes"][k]) for k in ("POSITION", "NORMAL", "TANGENT", "TEXCOORD_0"))
    corner = file.values(primitive["indices"])
    assert len(p) == len(n) == len(t) == len(uv) < 65535 and max(corner) == len(p) - 1
    assert all(math.hypot(*a) == pytest.approx(1, abs=1e-5) for a in n)
    assert all(math.hypot(*a[:3]) == pytest.approx(1, abs=1e-5) and a[3] == 1 and abs(dot(a, b)) < 1e-5 for a, b in zip(t, n))
    tile_m = [x / 1000 for x in file.document["asset"]["extras"]["tile_mm"]]
    lengths, right, upright = [], 0, 0
    for i in range(0, len(corner), 3):
        a, b, c = corner[i:i + 3]
        ab, ac = ([x - y for x, y in zip(p[k], p[a])] for k in (b, c))
        upright += dot(cross(ab, ac), n[a]) > 0
        for k, edge in ((b, ab), (c, ac)):
            du, dv = ((uv[k][j] - uv[a][j]) * tile_m[j] for j in (0, 1))
            if abs(dv) < 1e-9 * abs(du):
                lengths.append(math.hypot(*edge) / abs(du))
                right += dot(edge, t[a]) * du > 0
    assert upright == len(corner) // 3 and right == len(lengths) > 100
    return lengths


def test_the_drape_has_its_true_size(export):
    file = GltfFile(export[1] / "drape.glb")
    lengths = check_mesh(file)
    assert sum(lengths) / len(lengths) == pytest.approx(1, abs=0.02) and 0.9 < min(lengths) <= max(lengths) < 1.1
    (bounds,) = [file.document["accessors"][m["primitives"][0]["attributes"]["POSITION"]] for m in file.document["meshes"]]
    assert 0.02 < bounds["max"][0] - bounds["min"][0] < 0.04 and bounds["min"][1] < 0 < bounds["max"][1], "metres, y is up"


def test_the_ball_has_no_seam(export):
    file = GltfFile(export[1] / "sphere.glb")
    check_mesh(file)
    uv = file.values(file.document["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"])
    around = max(u for u, _ in uv) - min(u for u, _ in uv)
    assert around > 1 and abs(around - round(around)) < 1e-4


def test_materials_state_every_factor(export):
    found, folder = export
    (fitted,) = found["materials"]
    file = GltfFile(folder / "drape.glb")
    asset, (first, second) = file.document["asset"], file.document["materials"]
    assert asset["version"] == "2.0" and asset["extras"]["composition"] == "100 % silk"
    assert asset["extras"]["sample"] == "blue twill" and asset["extras"]["thickness_mm"] > 0
    for material in (first, second):
        base, more = material["pbrMetallicRoughness"], material["extensions"]
        assert set(base) == {"baseColorFactor", "baseColorTexture", "metallicFactor", "roughnessFactor", "metallicRoughnessTexture"}
        assert base["metallicFactor"] == 0 and base["roughnessFactor"] == 1 and material["normalTexture"]["scale"] == 1 and material["doubleSided"] is True
        assert more["KHR_materials_sheen"]["sheenColorFactor"] == pytest.approx(fitted["sheen_color"])
        assert more["KHR_materials_sheen"]["sheenRoughnessFactor"] == pytest.approx(fitted["sheen_roughness"])
        assert more["KHR_materials_anisotropy"]["anisotropyStrength"] == pytest.approx(fitted["anisotropy"])
        # the highest layer of this cloth runs along x: the lobe is wide along x or y
        assert more["KHR_materials_anisotropy"]["anisotropyRotation"] == pytest.approx(fitted["anisotropy_rotation"])
        assert abs(math.sin(2 * fitted["anisotropy_rotation"])) < 0.1 or fitted["anisotropy"] == 0
        specular = more["KHR_materials_specular"]
        assert specular["specularFactor"] == pytest.approx(fitted["f90"])
        assert [0.04 * x * specular["specularFactor"] for x in specular["specularColorFactor"]] == pytest.approx(fitted["f0"])
        assert more["KHR_materials_clearcoat"] == {"clearcoatFactor": fitted["coat"], "clearcoatRoughnessFactor": fitted["coat_roughness"]}
        assert more["KHR_materials_ior"]["ior"] == 1.5
    assert "KHR_materials_diffuse_transmission" not in first["extensions"]
    through = second["extensions"]["KHR_materials_diffuse_transmission"]
    assert through["diffuseTransmissionFactor"] == 1 and through["diffuseTransmissionColorFactor"] == [1, 1, 1]
    assert through["diffuseTransmissionTexture"] == through["diffuseTransmissionColorTexture"]
    (primitive,) = file.document["meshes"][0]["primitives"]
    assert primitive["material"] == 0 and len(primitive["extensions"]["KHR_materials_variants"]["mappings"]) == 2


def linear(byte):
    x = byte / 255
    return x / 12.92 if x <= 0.04045 else ((x + 0.055) / 1.055) ** 2.4


def test_textures_hold_what_was_fitted(export):
    """Both materials reflect the same: what the second lets through is taken from its base."""
    found, folder = export
    (fitted,) = found["materials"]
    file = GltfFile(folder / "drape.glb")
    first, second = file.document["materials"]
    through = second["extensions"]["KHR_materials_diffuse_transmission"]["diffuseTransmissionColorTexture"]
    pixels = {name: list(image.open(io.BytesIO(file.picture(index["index"]))).getdata()) for name, index in (
        ("base", first["pbrMetallicRoughness"]["baseColorTexture"]), ("below", second["pbrMetallicRoughness"]["baseColorTexture"]),
        ("normal", second["normalTexture"]), ("rough", second["pbrMetallicRoughness"]["metallicRoughnessTexture"]),
        ("through", through))}
    n = len(pixels["base"])
    for c in range(3):
        base = sum(linear(p[c]) for p in pixels["base"]) / n
        assert base == pytest.approx(fitted["base_color"][c], rel=0.03, abs=0.003)
        assert sum(linear(p[c]) * (1 - t[3] / 255) for p, t in zip(pixels["below"], pixels["through"])) / n == pytest.approx(base, rel=0.05, abs=0.003)
        assert sum(linear(t[c]) * t[3] / 255 for t in pixels["through"]) / n == pytest.approx(fitted["transmission"][c], rel=0.05, abs=0.003)
    assert all(math.hypot(*(2 * x / 255 - 1 for x in p)) == pytest.approx(1, abs=0.02) for p in pixels["normal"])
    assert all(p[0] == 255 and p[2] == 0 for p in pixels["rough"]), "nothing is metal"


def test_the_validator_of_khronos(export):
    if shutil.which("node") is None or not os.path.isdir(os.path.join(PACKAGES, "node_modules", "gltf-validator")):
        pytest.skip("the files are right so far; no gltf-validator (make test installs it where npm and a package index are)")
    files = [export[1] / name for name in ("drape.glb", "sphere.glb")]
    done = subprocess.run(["node", os.path.join(ROOT, "tests", "support", "exports", "validate_gltf.cjs"), PACKAGES, *files], capture_output=True, text=True,
                          check=False)
    assert done.returncode == 0, done.stderr
    for issues in json.loads(done.stdout):
        assert issues["numErrors"] == issues["numWarnings"] == 0, issues
    broken = export[1].parent / "broken.glb"
    broken.write_bytes((export[1] / "sphere.glb").read_bytes().replace(b'"metallicFactor":0.0', b'"metallicFactor":2.0'))
    done = subprocess.run(["node", os.path.join(ROOT, "tests", "support", "exports", "validate_gltf.cjs"), PACKAGES, broken], capture_output=True, text=True,
                          check=False)
    assert json.loads(done.stdout)[0]["numErrors"] > 0, "the check would notice a fault"


@pytest.mark.parametrize("name", ["drape", "sphere"])
def test_blender_opens_it(export, name, tmp_path):
    if shutil.which("blender") is None:
        pytest.skip("there is no Blender to open the files with (Debian package blender)")
    done = subprocess.run(["blender", "-b", "--factory-startup", "--python-exit-code", "1", "--python",
                           os.path.join(ROOT, "tests", "support", "exports", "blender_gltf.py"), "--", export[1] / f"{name}.glb"],
                          capture_output=True, text=True, check=False, env={**os.environ, "HOME": str(tmp_path)})
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr
    found = json.loads(next(line for line in done.stdout.split("\n") if line.startswith("found "))[6:])
    assert 0.02 < max(found["size"]) < 0.05 and found["has_places"] and found["material"] == "cloth", "metres, and what reflects only is shown first"
    assert "BSDF_PRINCIPLED" in found["kinds"] and {"base_color", "normal", "metallic_roughness"} <= set(found["images"])


def test_three_js_shows_the_rows_as_stated(export):
    """The relative RMS difference of its renderings from the job's, over the rows, is the one that the export states."""
    done = subprocess.run(["/usr/bin/python3", os.path.join(ROOT, "tests", "bench", "gltf_rows.py"), export[1], PACKAGES], capture_output=True, text=True,
                          check=False)
    if done.returncode != 0 and "not " in done.stderr and "Traceback" not in done.stderr:
        pytest.skip(done.stderr.strip())
    assert done.returncode == 0, done.stderr
    with open(export[1] / "rows.csv", encoding="utf-8") as f:
        rows = list(csv.DictReader(f))
    square = 0.0
    for theirs, row in zip(json.loads(done.stdout), rows):
        ours = [float(row[f"rendered_{c}"]) for c in "rgb"]
        square += sum((a - b) ** 2 for a, b in zip(ours, theirs)) / max(sum(ours) / 3, 0.02) ** 2 / 3
    assert (square / len(rows)) ** 0.5 == pytest.approx(export[0]["row_rel_rms"], rel=0.25, abs=0.01)
