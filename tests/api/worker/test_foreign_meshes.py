"""Meshes of other programs: `selvedge check` reads their spellings, and asks where the texture cannot be millimetres of cloth."""
import json
import os
import subprocess

import pytest
from daemon_under_test import program
from small_cloth import TABLE, hair

pytestmark = pytest.mark.skipif(not os.access(program("selvedge-worker"), os.X_OK), reason="no selvedge-worker in the build folder")

POINTS = "v 0 0 0\nv 10 0 0\nv 10 10 0\nv 0 10 0\n"
FULL = POINTS + "vt 0 0\nvt 10 0\nvt 10 10\nvt 0 10\n"


def check(folder, mesh, unit_mm=1):
    (folder / "m.obj").write_bytes(mesh)
    (folder / "rows.csv").write_text(TABLE)
    picture = {"on": "mesh", "mesh_file": "m.obj", "mesh_unit_mm": unit_mm, "width_mm": 12, "px": 32, "samples": 2, "light_theta_deg": 30,
               "light_phi_deg": 0, "camera_theta_deg": 0, "camera_phi_deg": 0}
    (folder / "job.json").write_text(json.dumps({"sample": "m", "cloth": {"weave": "plain", "yarns": [{"fibers": 7}]}, "pictures": [picture],
                                                 "measurements": {"file": "rows.csv"}, "fit": {"models": ["two_lobe.v1"]}}))
    done = subprocess.run([program("selvedge"), "check", "--json", str(folder / "job.json")], capture_output=True, text=True, check=False)
    return json.loads(done.stdout)


@pytest.mark.parametrize("mesh", [
    "\ufeff" + FULL + "f 1/1 2/2 3/3 4/4\n",
    FULL + "f 1/1 2/2 3/3 4/4 # the sheet\n",
    FULL + "f 1/1 2/2 \\\n  3/3 4/4\n",
    FULL.replace("\n", "\r\n") + "f -4/-4 -3/-3 -2/-2 \\\r\n-1/-1\r\n",
], ids=["byte-order-mark", "comment", "continued", "of-windows"])
def test_spellings_of_other_programs_are_read(tmp_path, mesh):
    report = check(tmp_path, mesh.encode())
    assert report["faults"] == [] and report["warnings"] == []


@pytest.mark.parametrize("texture, times", [("1 1", 100), ("10 4", 2.5), ("40 40", 1 / 16), ("40 2.5", 1)], ids=["0-to-1", "one-axis", "large", "equal-area"])
def test_texture_that_is_no_length_of_cloth_is_asked_about(tmp_path, texture, times):
    u, v = texture.split()
    mesh = POINTS + f"vt 0 0\nvt {u} 0\nvt {u} {v}\nvt 0 {v}\nf 1/1 2/2 3/3 4/4\n"
    report = check(tmp_path, mesh.encode())
    assert report["faults"] == []
    assert [w["field"] for w in report["warnings"]] == ["pictures[0].mesh_file"]
    assert f"{times:.3g} times the area" in report["warnings"][0]["detail"]
    assert f"multiply u by {10 / float(u):.4g} and v by {10 / float(v):.4g}" in report["warnings"][0]["detail"]


def test_cloth_that_stretches_a_little_is_no_question(tmp_path):
    assert check(tmp_path, (POINTS + "vt 0 0\nvt 8 0\nvt 8 9\nvt 0 9\nf 1/1 2/2 3/3 4/4\n").encode())["warnings"] == []


def test_what_the_mesh_states_beside_its_surface_is_listed(tmp_path):
    report = check(tmp_path, ("mtllib a.mtl\nusemtl red\n" + FULL + "vn 0 0 1\nf 1/1/1 2/2/1 3/3/1 4/4/1\n").encode())
    assert "m.obj" in json.dumps(report["files"]) and "material library" in json.dumps(report["files"])


@pytest.mark.slow
def test_the_result_of_a_run_has_the_warning_and_the_statements(tmp_path):
    mesh = "usemtl red\n" + POINTS + "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n"
    check(tmp_path, mesh.encode())
    document = json.loads((tmp_path / "job.json").read_text())
    document["fit"].update(max_iterations=1, path_budget=1000, render_px=8, render_samples=1)
    document.update(fibers={"file": "y.hair", "voxel_um": 5})
    del document["cloth"]
    (tmp_path / "input").mkdir()
    for name in ("m.obj", "rows.csv"):
        (tmp_path / name).rename(tmp_path / "input" / name)
    (tmp_path / "input" / "y.hair").write_bytes(hair())
    (tmp_path / "job.json").write_text(json.dumps(document))
    done = subprocess.run([program("selvedge-worker"), "--quiet", str(tmp_path)], capture_output=True, text=True, check=False)
    status = json.loads((tmp_path / "status.json").read_text())
    assert any("100 times the area of its texture" in w for w in status["warnings"]), done.stderr
    result = json.loads((tmp_path / "results" / "result.json").read_text())
    stated = {f["file"]: [s["name"] for s in f["statements"]] for f in result["files"]}
    assert stated == {"m.obj": ["material"], "y.hair": ["tile"]}
