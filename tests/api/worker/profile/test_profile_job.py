"""Jobs with the profile of a single fiber: through the API, the command line and the Python client; their result as the prior of
a cloth; and tables and documents that are refused. The profile is that of a fiber that scatters evenly, whose radiance is known:
albedo / pi^2 times cos theta_i."""
import json
import math
import os
import random
import subprocess
import sys

import jsonschema
import pytest
from daemon_under_test import ROOT, problem, program
from small_cloth import TABLE, hair

pytestmark = [pytest.mark.slow, pytest.mark.skipif(not os.access(program("selvedge-worker"), os.X_OK), reason="no selvedge-worker in the build folder")]
ALBEDO, ERROR = 0.6, 0.02
DOCUMENT = {"sample": "wool fiber", "profile": {"file": "fiber.csv", "theta_i_deg": -40, "scale": 2}, "fit": {"models": ["kajiya_kay.v1", "isotropic.v1"]}}


def table(seed=3, channels=("",)):
    rng, lines = random.Random(seed), [",".join(["theta_o_deg", "phi_deg"] + ["radiance" + c for c in channels] + [f"radiance{c}_se" for c in channels])]
    for theta_o in range(10, 51, 5):
        for phi in range(-20, 201, 20):
            true = 2 * ALBEDO / math.pi**2 * math.cos(math.radians(40))
            measured = [f"{true * (1 + ERROR * rng.gauss(0, 1)):.6g}" for _ in channels]
            lines.append(",".join([str(theta_o), str(phi), *measured] + [f"{true * ERROR:.4g}"] * len(channels)))
    return "\n".join(lines) + "\n"


def start(d, document, files):
    job = d.create(document)
    for name, role, data in files:
        d.upload(job, name, data, role)
    assert d.post(f"/v1/jobs/{job}/start").status_code == 202
    return job


@pytest.fixture(scope="module")
def finished(real):
    job = start(real, DOCUMENT, [("fiber.csv", "profile", table().encode())])
    return job, real.wait_state(job, "succeeded", timeout_s=120)["result"]


def test_the_result(real, finished):
    job, result = finished
    with open(os.path.join(ROOT, "config", "result.schema.json"), encoding="utf-8") as f:
        jsonschema.validate(result, json.load(f))
    assert result["model"] == "isotropic.v1" and result["geometry"] is None
    assert result["verdict"]["code"] == "good" and result["verdict"]["judged_by"] == "fitted" and real.job(job)["verdict"]["code"] == "good"
    models = {m["id"]: m for m in result["profile"]["models"]}
    best = models["isotropic.v1"]
    assert best["best"] and best["converged"] and best["parameters"] == result["parameters"] and best["scale"] == 2 and best["scale_se"] == 0
    red, green, blue = result["parameters"]
    assert red["value"] == green["value"] == blue["value"], "a grey profile has one value for all channels"
    n = result["profile"]["table"]["n_row"]
    assert n == 108 and 0.7 < red["standard_error"] / (ALBEDO * ERROR / math.sqrt(n)) < 2
    assert abs(red["value"] - ALBEDO) < 4 * red["standard_error"]
    assert 0.015 < best["rel_rms"] < 0.025 and abs(best["chi_square"] - 1) < 4 * math.sqrt(2 / n)
    assert models["kajiya_kay.v1"]["bic"] > best["bic"]
    lines = real.get(f"/v1/jobs/{job}/results/profile.csv").text.splitlines()
    assert lines[0] == "theta_i_deg,theta_o_deg,phi_deg,channel,radiance,kajiya_kay.v1,isotropic.v1" and len(lines) == 109
    assert float(lines[1].split(",")[6]) == pytest.approx(2 * red["value"] / math.pi**2 * math.cos(math.radians(40)), rel=1e-6)
    page, summary = (real.get(f"/v1/jobs/{job}/results/{name}").text for name in ("report.html", "summary.txt"))
    assert page.count("<polyline") == 18 and "isotropic.v1, the best model" in page, "eight charts for each of two models, two on the second page"
    assert "residual" in summary and "108 radiances" in summary
    done = {s["name"] for s in result["stages"] if s["wall_s"] is not None}
    assert done == {"fit"}, "the report is not done while it is written"


def turned_table():
    """Light of a section that is turned by 50 degrees: 20 % brighter where light comes along its short axis."""
    rng, lines = random.Random(4), ["phi_i_deg,theta_o_deg,phi_deg,radiance,radiance_se"]
    for phi_i in range(0, 360, 30):
        for phi in range(0, 360, 30):
            true = 0.1 * (1 + 0.2 * math.cos(2 * math.radians(phi_i - 50)) + 0.1 * math.cos(2 * math.radians(phi_i + phi - 50)))
            lines.append(f"{phi_i},40,{phi},{true * (1 + 0.02 * rng.gauss(0, 1)):.6g},{0.02 * true:.4g}")
    return "\n".join(lines) + "\n"


def test_azimuths_of_the_light(real):
    """A model of flat fibers has a turn; a round one has none. The table is shown with its azimuths."""
    document = {"sample": "ribbon", "profile": {"file": "fiber.csv", "theta_i_deg": -40}, "fit": {"models": ["textile.v3", "isotropic.v1"]}}
    job = start(real, document, [("fiber.csv", "profile", turned_table().encode())])
    result = real.wait_state(job, "succeeded", timeout_s=120)["result"]
    with open(os.path.join(ROOT, "config", "result.schema.json"), encoding="utf-8") as f:
        jsonschema.validate(result, json.load(f))
    flat, even = result["profile"]["models"]
    assert result["profile"]["table"]["phi_i_deg"] == pytest.approx([0, 330]) and "turn_deg" not in even and flat["bic"] < even["bic"]
    off = (flat["turn_deg"] - 50 + 45) % 90 - 45
    assert flat["turn_fitted"] and flat["turn_determined"] and 0 <= flat["turn_deg"] < 180 and abs(off) < 5, flat["turn_deg"]
    lines = real.get(f"/v1/jobs/{job}/results/profile.csv").text.splitlines()
    assert lines[0] == "theta_i_deg,phi_i_deg,theta_o_deg,phi_deg,channel,radiance,textile.v3,isotropic.v1" and len(lines) == 145
    page, summary = (real.get(f"/v1/jobs/{job}/results/{name}").text for name in ("report.html", "summary.txt"))
    assert "phi_i 330" in page and "turn of the section" in page and "turn " in summary
    done = subprocess.run([program("selvedge"), "watch", job, "--server", real.url], capture_output=True, text=True, timeout=60)
    assert "section turned by" in done.stdout, done.stdout + done.stderr


@pytest.mark.parametrize("profile,model,field,says", [
    ({"turn_deg": 20}, "elliptical_oriented.v1", "profile.turn_deg", "'phi_i_deg'"),
    ({"turn_deg": 20}, "isotropic.v1", "profile.turn_deg", "does not change with the turn"),
    ({"mode": "TRT"}, "isotropic.v1", "profile.mode", "isotropic.v1"),
])
def test_turns_and_modes_that_are_refused(tmp_path, profile, model, field, says):
    (tmp_path / "input").mkdir()
    (tmp_path / "input" / "fiber.csv").write_text(table())
    (tmp_path / "job.json").write_text(json.dumps({**DOCUMENT, "profile": {**DOCUMENT["profile"], **profile}, "fit": {"model": model}}))
    done = subprocess.run([program("selvedge-worker"), str(tmp_path)], capture_output=True, text=True, timeout=300)
    error = json.loads((tmp_path / "status.json").read_text())["error"]
    assert done.returncode != 0 and error["field"] == field and says in error["text"], error


def test_a_residual_far_above_the_noise_is_not_good(real):
    """A fiber with a strong highlight, to which a model without one is fitted."""
    lines = ["theta_o_deg,phi_deg,radiance,radiance_se"]
    for theta_o in range(10, 51, 10):
        for phi in range(-20, 201, 20):
            radiance = 0.05 * (1 + 3 * math.exp(-(phi / 40) ** 2))
            lines.append(f"{theta_o},{phi},{radiance:.6g},{0.005 * radiance:.4g}")
    document = {**DOCUMENT, "fit": {"model": "isotropic.v1"}}
    job = real.wait_state(start(real, document, [("fiber.csv", "profile", "\n".join(lines).encode())]), "succeeded", timeout_s=120)
    best, verdict = job["result"]["profile"]["models"][0], job["verdict"]
    assert best["chi_square"] > 5000
    assert verdict["code"] == "does_not_describe_this_cloth" and verdict["words"] == "does not describe this fiber"
    assert "error_beyond_noise" in [r["code"] for r in verdict["reservations"]] and verdict["rel_rms"] == pytest.approx(best["rel_rms"], rel=1e-9)
    assert verdict["words"] in real.get(f"/v1/jobs/{job['id']}/results/summary.txt").text


def cloth(profile_job, **fit):
    return {"sample": "cloth of it", "fibers": {"file": "cloth.hair"}, "measurements": {"file": "rows.csv"},
            "fit": {"model": "isotropic.v1", "max_iterations": 1, "path_budget": 4000, "render_px": 8, "render_samples": 1, "profile_job": profile_job, **fit}}


def start_cloth(d, document):
    return start(d, document, [("cloth.hair", "fibers", hair()), ("rows.csv", "measurements", TABLE.encode())])


def test_the_prior_of_a_cloth(real):
    document = {**DOCUMENT, "fit": {"model": "isotropic.v1"}}
    job = start(real, document, [("fiber.csv", "profile", table(channels=("_r", "_g", "_b")).encode())])
    result = real.wait_state(job, "succeeded", timeout_s=120)["result"]
    document = cloth(job, fixed={"C.b": 0.3}, bounds={"C.g": [0.02, 0.05]})
    fitted = real.wait_state(start_cloth(real, document), "succeeded", timeout_s=120)["result"]
    for p, found, name in zip(fitted["parameters"], result["parameters"], ("C.r", "C.g", "C.b")):
        assert p["name"] == found["name"] == name
        if name == "C.b":
            assert p["fixed"] and p.get("prior") is None, "a fixed parameter takes none"
        elif name == "C.g":
            assert p["prior"] is None and any("'C.g'" in w and "outside of the bounds" in w for w in fitted["warnings"])
        else:
            assert p["prior"]["mean"] == pytest.approx(found["value"]) and p["prior"]["se"] == pytest.approx(found["standard_error"])
            assert abs(p["value"] - ALBEDO) < 0.1, "a sharp prior holds what six rows of another cloth say little of"


def test_colors_take_nothing_from_a_grey_profile(real, finished):
    job, _ = finished
    done = real.wait_state(start_cloth(real, cloth(job)), "succeeded", timeout_s=120)["result"]
    assert all(p["prior"] is None for p in done["parameters"]) and any("none was taken" in w for w in done["warnings"])


def test_priors_that_cannot_be_taken(real, finished):
    job, _ = finished
    draft = real.create(DOCUMENT)
    for document, text in ((cloth(job, model="two_lobe.v1"), "none of this job's models"), (cloth(draft), "no result yet")):
        error = real.wait_state(start_cloth(real, document), "failed", timeout_s=60)["error"]
        assert error["field"] == "fit.profile_job" and text in error["text"]


def test_a_job_that_does_not_exist(real):
    job = real.create(cloth("nothing"))
    real.upload(job, "cloth.hair", hair(), "fibers")
    real.upload(job, "rows.csv", TABLE.encode(), "measurements")
    assert "does not exist" in problem(real.post(f"/v1/jobs/{job}/start"), 422, "invalid", "fit.profile_job")["detail"]


@pytest.mark.parametrize("text,says", [
    ("theta_o_deg,radiance\n10,1\n", ("line 1", "'phi_deg' is missing")),
    ("theta_o_deg,phi_deg,radiance\n10,0,1\n95,0,1\n", ("line 3", "'theta_o_deg' is 95")),
    ("theta_o_deg,phi_deg,radiance\n.17,-.35,1\n.87,3.14,1\n", ("line 3", "radians")),
    ("theta_o_deg,phi_deg,radiance\n10,0,-1\n", ("line 2", "'radiance' is -1")),
    ("theta_o_deg,phi_deg,radiance\n10,0,1\n", ("line 2", "unknowns")),
    ("theta_o_deg,phi_deg,radiance\n10,0,1e-200\n20,0,0\n", ("line 3", "1e-200", "another unit")),
])
def test_tables_that_are_refused(tmp_path, text, says):
    (tmp_path / "input").mkdir()
    (tmp_path / "input" / "fiber.csv").write_text(text)
    (tmp_path / "job.json").write_text(json.dumps({**DOCUMENT, "fit": {"model": "kajiya_kay.v1"}}))
    done = subprocess.run([program("selvedge-worker"), str(tmp_path)], capture_output=True, text=True, timeout=300)
    error = json.loads((tmp_path / "status.json").read_text())["error"]
    assert done.returncode != 0 and error["field"] == "profile.file" and all(s in error["text"] for s in says), error


@pytest.mark.parametrize("document,field", [
    ({**DOCUMENT, "fit": {"method": "published_sgd.v1"}}, "fit.method"),
    ({**DOCUMENT, "fibers": {"file": "a.hair"}}, "fibers"), ({**DOCUMENT, "black_sheet": True}, "black_sheet"),
    ({**DOCUMENT, "fit": {"model": "microflake.v1"}}, "fit.models"), ({**DOCUMENT, "fit": {"path_budget": 5000}}, "fit.path_budget"),
    ({**DOCUMENT, "profile": {"file": "a.csv", "mode": "E"}}, "profile.mode"),
    ({**DOCUMENT, "profile": {"file": "a.csv", "mode": "TRT"}}, "profile.mode"),
    ({**DOCUMENT, "profile": {"file": "a.csv", "theta_i_deg": 95}}, "profile.theta_i_deg"), ({**DOCUMENT, "profile": {}}, "profile.file"),
    ({**DOCUMENT, "fit": {"fixed": {"C_R": 0.1, "C_TT": 0.5}, "model": "two_lobe.v1", "bounds": {"beta_R": [9, 3]}}}, "fit.bounds.beta_R"),
])
def test_documents_that_are_refused(real, document, field):
    assert problem(real.post("/v1/jobs", json=document), 422, "invalid", field)


def test_a_mode_that_the_model_lacks_is_found_by_a_check(real, tmp_path):
    document = {**DOCUMENT, "profile": {"file": "fiber.csv", "mode": "TT"}, "fit": {"models": ["elliptical_oriented.v1", "fur.v1"]}}
    fault = next(f for f in real.post("/v1/check", json=document).json()["errors"] if f["field"] == "profile.mode")
    assert "fur.v1" in fault["detail"]
    (tmp_path / "fiber.csv").write_text(table())
    (tmp_path / "job.json").write_text(json.dumps(document))
    done = subprocess.run([program("selvedge"), "check", str(tmp_path / "job.json")], capture_output=True, text=True, timeout=60)
    assert done.returncode != 0 and "profile.mode" in done.stdout + done.stderr, done.stdout + done.stderr


def test_command_line_and_python(real, tmp_path):
    (tmp_path / "fiber.csv").write_text(table())
    (tmp_path / "job.json").write_text(json.dumps({**DOCUMENT, "fit": {"model": "isotropic.v1"}}))
    environment = dict(os.environ, SELVEDGE_SERVER=real.url, SELVEDGE_TOKEN="", PYTHONPATH=os.path.join(ROOT, "clients", "python"))
    done = subprocess.run([program("selvedge"), "submit", str(tmp_path / "job.json"), "--watch"], env=environment, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stderr
    assert "isotropic.v1" in done.stdout and "of range" in done.stdout and "C.r" in done.stdout, done.stdout
    script = f"""import selvedge
job = selvedge.Client({real.url!r}).submit({str(tmp_path / 'job.json')!r})
assert job.wait(timeout_s=60).state == "succeeded"
result = job.result()
print(result.models[0].id, result.models[0].fit_rel_rms, result.parameter("C.r").value)"""
    done = subprocess.run([sys.executable, "-c", script], env=environment, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0 and done.stdout.startswith("isotropic.v1 0."), done.stderr
