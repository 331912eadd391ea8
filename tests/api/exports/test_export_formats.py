"""The formats of exports, of one job: each folder is opened by the program or the library that it is for where Python has it, and otherwise by a
reader of its published grammar."""
import csv
import json
import math
import os
import subprocess

import pbrt_file
import pytest
from daemon_under_test import program
from small_cloth import TABLE, hair

pytestmark = [pytest.mark.slow, pytest.mark.skipif(not os.access(program("selvedge-worker"), os.X_OK), reason="no selvedge-worker in the build folder")]
FIT = {"path_budget": 20000, "render_px": 8, "render_samples": 1, "model": "isotropic.v1"}
FORMATS = ["pbrt"]


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    folder = tmp_path_factory.mktemp("exports") / "job"
    (folder / "input").mkdir(parents=True)
    (folder / "input" / "cloth.hair").write_bytes(hair())
    (folder / "input" / "rows.csv").write_text(TABLE)
    (folder / "job.json").write_text(json.dumps({
        "sample": "exports", "fibers": {"file": "cloth.hair", "voxel_um": 5}, "measurements": {"file": "rows.csv"}, "fit": FIT,
        "export": {name: True for name in FORMATS}}))
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
                value = math.cos(theta_o) * pbrt_file.hair_density(material, theta_o, theta_i, phi, channel, n_offset=12)
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
    (material,), (found,) = {json.dumps(m) for _, (_, m) in curves}, export["materials"]
    material = json.loads(material)
    assert material["sigma_a"] == pytest.approx(found["absorption"], rel=1e-5)
    material["even"] = found["fitted_albedo"][1]
    albedo, turned, rel_rms = hair_shares(material, 1)
    assert albedo == pytest.approx(found["albedo"][1], rel=0.02)
    assert turned == pytest.approx(found["turned_back"][1], rel=0.03)
    assert rel_rms == pytest.approx(found["rel_rms"], rel=0.1)
    assert rel_rms < 0.5


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
