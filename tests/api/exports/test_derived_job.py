"""Jobs that show the result of a finished job without a new fit."""
import csv
import json
import math
import os
import shutil
import subprocess
import sys

import pytest
from daemon_under_test import ROOT, problem, program
from small_cloth import hair, start_small_job

sys.path.insert(0, os.path.join(ROOT, "clients", "python"))
import selvedge  # noqa: E402

pytestmark = pytest.mark.skipif(not os.access(program("selvedge-worker"), os.X_OK), reason="no selvedge-worker in the build folder")
DOCUMENT = {"sample": "blue twill", "weight_g_m2": 90, "fibers": {"file": "cloth.hair"}, "measurements": {"file": "rows.csv"}, "camera": {"crop_cm": 0.1},
            "fit": {"path_budget": 20000, "render_px": 8, "render_samples": 1, "model": "two_lobe.v1"},
            "export": {"blender": True, "mitsuba": True}}
VIEW = {"light_theta_deg": 45, "light_phi_deg": 0, "camera_theta_deg": 30, "camera_phi_deg": 180, "px": 16, "samples": 2, "width_mm": 1, "size_mm": 1}


@pytest.fixture(scope="module")
def fitted(real):
    job = start_small_job(real, DOCUMENT)
    real.wait_state(job, "succeeded", timeout_s=400)
    return job


def text_of(real, job, path):
    reply = real.get(f"/v1/jobs/{job}/results/{path}")
    assert reply.status_code == 200, path
    return reply.text


def derive(real, job, **wanted):
    reply = real.post(f"/v1/jobs/{job}/derive", json=wanted)
    assert reply.status_code == 201, reply.text
    made = reply.json()
    assert made["state"] in ("queued", "running"), made
    assert reply.headers["Location"] == f"/v1/jobs/{made['id']}" and made["tags"] == [f"of:{job[:8]}"]
    return made["id"]


def test_an_export_made_later_is_the_export_of_the_fit(real, fitted):
    """The scene with its hair, the stated errors, and the rows with measured and rendered radiances: no fit is made again."""
    job = derive(real, fitted, export={"mitsuba": True, "pbrt": True})
    done = real.wait_state(job, "succeeded", timeout_s=400)
    assert done["document"]["weight_g_m2"] == 90
    assert done["sample"] == "blue twill for mitsuba, pbrt" and done["document"]["fit"]["result_file"] == "result.json"
    assert [e["format"] for e in done["result"]["exports"]] == ["mitsuba", "pbrt"] and done["result"]["method"] is None
    assert text_of(real, job, "export/mitsuba/scene.xml") == text_of(real, fitted, "export/mitsuba/scene.xml")
    assert "those of an earlier export" in real.get(f"/v1/jobs/{job}/log").text
    (blender, first), (again, pbrt) = json.loads(text_of(real, fitted, "result.json"))["exports"], done["result"]["exports"]
    assert blender["row_rel_rms"] == pytest.approx(math.hypot(first["row_rel_rms"], blender["program_deviation"]))
    for key in ("rel_rms", "row_rel_rms", "row_rel_rms_se", "row_rel_errors"):
        assert again[key] == pbrt[key] == pytest.approx(first[key], abs=1e-12)  # taken from the entry of Blender, which comes first
    assert [m["hair"] for m in pbrt["materials"]] == [m["hair"] for m in first["materials"]]
    both = [list(csv.DictReader(text_of(real, j, "export/mitsuba/rows.csv").splitlines())) for j in (job, fitted)]
    assert len(both[0]) == len(both[1]) == 6
    for ours, theirs in zip(*both):
        assert ours.pop("set") == theirs.pop("set")
        assert list(map(float, ours.values())) == pytest.approx(list(map(float, theirs.values())), rel=1e-6, abs=1e-9)
    assert "stage fit" not in real.get(f"/v1/jobs/{job}/log").text


def test_pictures_in_another_light_outlive_the_job(real, fitted):
    """The finished job may be deleted at once, because its files are copied."""
    own = start_small_job(real, {k: v for k, v in DOCUMENT.items() if k != "export"})
    real.wait_state(own, "succeeded", timeout_s=400)
    sky = {"radiance": [0.2, 0.2, 0.3]}
    job = derive(real, own, pictures=[{"on": "drape", "radius_mm": 1, **VIEW}], lamp={"kind": "directional"}, environment=sky, sample="silk")
    assert real.delete(f"/v1/jobs/{own}").status_code == 204
    done = real.wait_state(job, "succeeded", timeout_s=400)
    assert done["sample"] == "silk" and done["document"]["lamp"] == {"kind": "directional"} and len(done["result"]["pictures"]) == 1
    again = derive(real, job, export={"usd": True})
    assert real.wait_state(again, "succeeded", timeout_s=400)["result"]["exports"], "rows of the first job, through the second"


def test_a_mesh_is_uploaded_before_the_start(real, fitted):
    reply = real.post(f"/v1/jobs/{fitted}/derive", json={"pictures": [{"on": "mesh", "mesh_file": "a.obj", **VIEW}]})
    assert reply.status_code == 201 and reply.json()["state"] == "draft" and reply.json()["missing_files"] == ["a.obj"]
    assert real.delete(f"/v1/jobs/{reply.json()['id']}").status_code == 204


def test_a_repeated_request_makes_one_job(real, fitted):
    key, wanted = {"Idempotency-Key": "derive-1"}, {"pictures": [{"on": "flat", **VIEW}]}
    one, two = (real.post(f"/v1/jobs/{fitted}/derive", json=wanted, headers=key) for _ in range(2))
    assert one.status_code == two.status_code == 201 and one.json()["id"] == two.json()["id"] and two.headers["Idempotent-Replay"] == "true"
    real.wait_state(one.json()["id"], "succeeded", timeout_s=60)


@pytest.mark.skipif(shutil.which("weasyprint") is None, reason="WeasyPrint is not installed")
def test_the_report_of_a_finished_job_as_pdf(real, fitted, tmp_path):
    """It is the report of the fit, not of the job that makes the PDF."""
    job = derive(real, fitted, export={"pdf": True})
    real.wait_state(job, "succeeded", timeout_s=400)
    assert text_of(real, job, "report.html") == text_of(real, fitted, "report.html")
    assert real.get(f"/v1/jobs/{job}/results/report.pdf").content.startswith(b"%PDF")
    selvedge.Client(real.url).job(fitted).download(str(tmp_path))
    done = cli("export", tmp_path, "--to", "pdf")
    assert done.returncode == 0 and (tmp_path / "report.pdf").read_bytes().startswith(b"%PDF"), done.stderr


@pytest.mark.parametrize("wanted, field", [({}, "pictures"), ({"sample": "s"}, "pictures"), ({"fit": {}}, "fit"),
                                           ({"export": {"maya": True}}, "export.maya"),
                                           ({"pictures": [{"on": "moon"}]}, "pictures[0].on"),
                                           ({"twin": {"make": True}, "environment": {"file": "sky.exr"}}, "environment.file")])
def test_what_cannot_be_made_is_refused_with_its_key(real, fitted, wanted, field):
    before = len(real.get("/v1/jobs?limit=500").json()["jobs"])
    problem(real.post(f"/v1/jobs/{fitted}/derive", json=wanted), 422, "invalid", field=field)
    assert len(real.get("/v1/jobs?limit=500").json()["jobs"]) == before


def test_a_job_without_a_result_is_refused(real):
    job = real.create(DOCUMENT)
    real.upload(job, "cloth.hair", hair(), "fibers")
    problem(real.post(f"/v1/jobs/{job}/derive", json={"export": {"usd": True}}), 409, "conflict")
    problem(real.post("/v1/jobs/00000000-0000-0000-0000-000000000000/derive", json={"export": {"usd": True}}), 404, "not_found")


def test_the_result_file_belongs_to_given_parameters(real):
    doc = {**DOCUMENT, "fit": {"model": "two_lobe.v1", "result_file": "result.json"}}
    problem(real.post("/v1/jobs", json=doc), 422, "invalid", field="fit.result_file")


@pytest.mark.parametrize("text, said", [("{}", "no list 'rows'"), ('{"rows": [{"set": "fit"}]}', "'light_theta_deg' of row 1"), ("[1]", "result.json"),
                                        ('{"rows": [], "discrepancy": {"scale": [1, 1, 1, 0], "place": [], "log_weight": []}}', "no smooth factor"),
                                        ('{"rows": []}', "has no rows")])
def test_a_result_that_is_none_is_named(real, text, said):
    fixed = {"C_R": 0.1, "C_TT": 0.6, "beta_R": 6, "beta_TT": 12, "gamma_TT": 30}
    job = real.create({"sample": "s", "fibers": {"file": "cloth.hair"}, "export": {"pbrt": True},
                       "fit": {"model": "two_lobe.v1", "fixed": fixed, "result_file": "result.json"}})
    real.upload(job, "cloth.hair", hair(), "fibers")
    real.upload(job, "result.json", text.encode(), "result")
    assert real.post(f"/v1/jobs/{job}/start").status_code == 202
    error = real.wait_state(job, "failed", timeout_s=60)["error"]
    assert error["field"] == "fit.result_file" and said in error["text"], error


def cli(*arguments, **more):
    return subprocess.run([program("selvedge"), *map(str, arguments)], capture_output=True, text=True, timeout=600, check=False, **more)


def test_the_commands_download_what_they_make(real, fitted, tmp_path):
    done = cli("export", fitted[:8], "--to", "mitsuba,pbrt", "--out", tmp_path / "out", "--server", real.url)
    assert done.returncode == 0, done.stderr
    assert sorted(os.listdir(tmp_path / "out")) == ["export"] and sorted(os.listdir(tmp_path / "out/export")) == ["mitsuba", "pbrt"]
    assert (tmp_path / "out/export/mitsuba/scene.xml").read_text() == text_of(real, fitted, "export/mitsuba/scene.xml")
    wrong = cli("export", fitted, "--to", "maya", "--server", real.url)
    assert wrong.returncode == 1 and "'maya'" in wrong.stderr and "mitsuba, pbrt" in wrong.stderr
    (tmp_path / "sheet.obj").write_text("v 0 0 0\nv 1 0 0\nv 1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nf 1/1 2/2 3/3\n")
    shown = cli("render", fitted, "--on", tmp_path / "sheet.obj", "--px", 16, "--samples", 1, "--width-mm", 2, "--out", tmp_path / "shown",
                "--server", real.url)
    assert shown.returncode == 0 and (tmp_path / "shown/pictures/on-1.png").exists(), shown.stderr


def test_a_folder_of_results_is_exported_without_a_server(real, fitted, tmp_path):
    selvedge.Client(real.url).job(fitted).download(str(tmp_path))
    before = (tmp_path / "export/mitsuba/scene.xml").read_text()
    (tmp_path / "export/mitsuba/scene.xml").write_text("old")
    done = cli("export", tmp_path, "--to", "mitsuba", "--server", "http://127.0.0.1:1")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "export/mitsuba/scene.xml").read_text() == before
    # hair of other parameters is not taken
    result = json.loads((tmp_path / "result.json").read_text())
    result["parameters"][0]["value"] *= 1.01
    (tmp_path / "result.json").write_text(json.dumps(result))
    assert cli("export", tmp_path, "--to", "mitsuba").returncode == 0
    assert (tmp_path / "export/mitsuba/scene.xml").read_text() != before
    assert [n for n in os.listdir(tmp_path) if n.startswith(".")] == []
    (tmp_path / "fibers.hair").unlink()
    lost = cli("export", tmp_path, "--to", "usd")
    assert lost.returncode == 1 and "fibers.hair" in lost.stderr
    assert "report.json" in cli("export", "/tmp", "--to", "usd", "--out", tmp_path / "x").stderr


def test_python_exports_and_shows_a_finished_job(real, fitted, tmp_path):
    job = selvedge.Client(real.url).job(fitted)
    assert str(tmp_path / "export/usd/cloth.usda") in job.export("usd", str(tmp_path))
    paths = job.picture(str(tmp_path), "flat", (45, 0), (30, 180), px=16, samples=1, size_mm=1, width_mm=1)
    assert str(tmp_path / "pictures/on-1.png") in paths and all("/pictures/on-1" in p for p in paths)


def test_the_help_names_every_format(real):
    formats = {o["path"].split(".")[1] for o in real.get("/v1/options").json()["options"] if o["path"].startswith("export.") and o["kind"] == "boolean"}
    said = cli("export", "--help").stdout
    assert formats and all(f in said for f in formats), said
