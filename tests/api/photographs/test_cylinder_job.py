"""One picture of a cloth on a cylinder as the photograph of a job: through the worker to rows, pictures and the report; through the daemon,
what is wrong with a document; and as `selvedge photo` shows it."""
import json
import math
import os
import subprocess

import jsonschema
import pytest
from daemon_under_test import ROOT, program
from small_cloth import hair
from small_exr import exr, read_exr

pytestmark = pytest.mark.skipif(not os.access(program("selvedge-worker"), os.X_OK), reason="no selvedge-worker in the build folder")
RADIUS_PX, MIDDLE_PX, LAMP_DEG = 60.0, 80.0, 40.0
PHOTOGRAPH = {"file": "roll.exr", "set": "fit", "light_theta_deg": LAMP_DEG, "light_phi_deg": 0, "camera_theta_deg": 0, "camera_phi_deg": 270,
              "cylinder_radius_mm": 15, "cylinder_step_deg": 20}
SETUP = {"lamp": {"kind": "directional"}, "camera": {"far_field": True}, "fit": {"path_budget": 10000, "render_px": 16, "render_samples": 2}}


def pixel(x, y, background):
    """A matte cylinder from far away under parallel light, and grey beside it."""
    s = (x + 0.5 - MIDDLE_PX) / RADIUS_PX
    lit = max(0.0, math.cos(math.asin(s) - math.radians(LAMP_DEG))) if abs(s) < 1 else None
    value = background if lit is None else 0.2 * lit * (1.0 + 0.01 * (y % 2))
    return value, 0.8 * value, 0.5 * value


def picture(background=0.3):
    return exr(160, 60, lambda x, y: pixel(x, y, background))


def make(folder, photograph, image):
    (folder / "input").mkdir(parents=True)
    (folder / "input" / "cloth.hair").write_bytes(hair())
    (folder / "input" / "roll.exr").write_bytes(image)
    document = {"sample": "roll", "fibers": {"file": "cloth.hair", "voxel_um": 5}, "photographs": [photograph], **SETUP}
    (folder / "job.json").write_text(json.dumps(document))
    (folder / "input" / "job.json").write_text(json.dumps(document))


@pytest.fixture(scope="module")
def job(tmp_path_factory):
    folder = tmp_path_factory.mktemp("cylinder") / "job"
    make(folder, PHOTOGRAPH, picture())
    subprocess.run([program("selvedge-worker"), "--quiet", "--threads", "2", str(folder)], check=True)
    return folder


def test_columns_are_rows(job):
    """Their light is 0.2 cos(angle - 40 degrees): over 20 degrees its curvature is 0.5 %, and a pixel at the edge of a column 1 %."""
    result = json.loads((job / "results" / "result.json").read_text())
    rows = result["rows"]
    assert [row["name"] for row in rows] == [f"roll-c0{i}.exr" for i in range(1, len(rows) + 1)]
    # of the columns at -20, 0 .. 100 degrees those within 70 degrees of lamp and camera: -20 .. 60
    assert [row["column"]["angle_deg"] for row in rows] == pytest.approx([-20, 0, 20, 40, 60], abs=1.5)
    for i, row in enumerate(rows):
        angle = row["column"]["angle_deg"]
        assert row["column"]["file"] == "roll.exr" and row["column"]["number"] == i + 1 and row["column"]["n"] == 5
        assert row["light_theta_deg"] == pytest.approx(abs(LAMP_DEG - angle), abs=1e-6)
        assert row["camera_theta_deg"] == pytest.approx(abs(angle), abs=1e-6)
        assert row["measured"][0] == pytest.approx(0.201 * math.cos(math.radians(angle - LAMP_DEG)), rel=0.015)
        assert row["measured"][2] == pytest.approx(0.5 * row["measured"][0], rel=1e-5)
        assert all(0 < se < 0.1 * m for se, m in zip(row["measured_se"], row["measured"]))
        width, height, _ = read_exr((job / "results" / row["photograph_png"].replace(".png", ".exr")).read_bytes())
        assert height == 60 and 8 < width < 24
    with open(os.path.join(ROOT, "config", "result.schema.json"), encoding="utf-8") as f:
        jsonschema.Draft202012Validator(json.load(f)).validate(result)
    status = json.loads((job / "status.json").read_text())
    assert any("has 5 columns; left out are" in w if isinstance(w, str) else "has 5 columns; left out are" in str(w) for w in status["warnings"])
    assert "roll-c03.exr" in (job / "results" / "report.html").read_text()


def test_photo_shows_the_columns(job, tmp_path):
    done = subprocess.run([program("selvedge-camera"), "photo", "--job", str(job / "input" / "job.json"), "--out", str(tmp_path / "look"), "--json",
                           str(tmp_path / "rows.json")], capture_output=True, text=True, check=True)
    assert "roll-c05.exr" in done.stdout and os.listdir(tmp_path / "look") == ["roll.exr.png"]
    rows = json.loads((tmp_path / "rows.json").read_text())
    assert [row["column"]["number"] for row in rows] == [1, 2, 3, 4, 5]


def refused(folder, photograph, image):
    make(folder, photograph, image)
    done = subprocess.run([program("selvedge-worker"), "--quiet", str(folder)], check=False, capture_output=True)
    assert done.returncode != 0
    return json.loads((folder / "status.json").read_text())["error"]


def test_an_outline_in_the_dark_is_asked_for(tmp_path):
    error = refused(tmp_path / "dark", PHOTOGRAPH, picture(0.0))
    assert error["field"] == "photographs[0].cylinder_edges_px" and "'roll.exr'" in error["text"] and "were not found" in error["text"]
    error = refused(tmp_path / "steep", {**PHOTOGRAPH, "cylinder_limit_deg": 12}, picture())
    assert error["field"] == "photographs[0].file" and "no column" in error["text"]


def test_the_daemon_says_what_is_wrong(real):
    document = {"sample": "roll", "fibers": {"file": "cloth.hair"}, "photographs": [{**PHOTOGRAPH, "cylinder_axis": "north"}], **SETUP}
    for photograph, field in (({**PHOTOGRAPH, "cylinder_axis": "north"}, "cylinder_axis"), ({**PHOTOGRAPH, "cylinder_radius_mm": 0}, "cylinder_radius_mm"),
                              ({k: v for k, v in PHOTOGRAPH.items() if k != "cylinder_radius_mm"}, "cylinder_step_deg")):
        response = real.post("/v1/jobs", json={**document, "photographs": [photograph]})
        assert response.status_code == 422 and f"photographs[0].{field}" in response.text, response.text
    assert real.post("/v1/jobs", json={**document, "photographs": [{**PHOTOGRAPH, "light_theta_deg": 126}]}).status_code == 201
