"""The verdict on a result is the same in the list, on the job, in result.json, the summary and the client, and the errors of rows
make up the error of the fit."""
import json
import math
import os
import subprocess

import pytest
from daemon_under_test import program
from small_cloth import start_small_job

pytestmark = pytest.mark.skipif(not os.access(program("selvedge-worker"), os.X_OK), reason="no selvedge-worker in the build folder")
DOCUMENT = {"sample": "verdict", "fibers": {"file": "cloth.hair", "voxel_um": 5}, "measurements": {"file": "rows.csv"},
            "fit": {"path_budget": 20000, "render_px": 8, "render_samples": 1}}


def cli(daemon, *arguments):
    return subprocess.run([program("selvedge"), "--server", daemon.url, *arguments], check=True, capture_output=True, text=True).stdout


def test_the_verdict_is_the_same_everywhere(real):
    job = start_small_job(real, DOCUMENT)
    before = real.get("/v1/jobs").json()["jobs"]
    assert all(j["verdict"] is None for j in before if j["state"] != "succeeded")
    state = real.wait_state(job, "succeeded", timeout_s=120)
    verdict, result = state["verdict"], state["result"]
    # the rows are those of a plain surface, far from what this cloth of fibers can show
    assert verdict["code"] == "does_not_describe_this_cloth" and verdict["words"] == "does not describe this cloth"
    codes = [r["code"] for r in verdict["reservations"]]
    assert {"error_beyond_noise", "worse_than_plain_brdf", "parameters_not_determined"} <= set(codes) and len(codes) == len(set(codes))
    assert verdict["judged_by"] == "held_out" and verdict["rel_rms"] == pytest.approx(result["heldout_rel_rms"], rel=1e-9)
    assert verdict["plain_brdf_rel_rms"] == pytest.approx(result["skill"]["plain_brdf"]["heldout_rel_rms"], rel=1e-9)
    left_out = result["skill"]["plain_brdf"]["left_out_rel_rms"]  # rows that the surface has not seen are predicted worse
    assert left_out > result["skill"]["plain_brdf"]["fit_rel_rms"]
    assert all(result["verdict"][key] == verdict[key] for key in ("code", "text", "reservations"))
    listed = next(j for j in real.get("/v1/jobs").json()["jobs"] if j["id"] == job)
    assert listed["verdict"] == verdict
    summary = real.get(f"/v1/jobs/{job}/results/summary.txt").text
    status = cli(real, "status", job)
    for text in [verdict["words"], verdict["text"], *(r["text"] for r in verdict["reservations"])]:
        assert text in summary and text in status
    line = next(line for line in cli(real, "list").splitlines() if line.startswith(job))
    assert "succeeded" in line and "does not describe" in line
    assert json.loads(cli(real, "status", job, "--json"))["verdict"] == verdict
    report = real.get(f"/v1/jobs/{job}/results/report.html")
    assert verdict["text"] in report.text
    rule = report.headers["Content-Security-Policy"]  # no scripts, and the styles inside the page are allowed
    assert rule.startswith("sandbox allow-same-origin; default-src 'none'") and "script" not in rule and "," not in rule
    assert "style-src 'self' 'unsafe-inline'" in rule


def test_row_errors_make_up_the_error_of_the_fit(real):
    result = real.wait_state(start_small_job(real, DOCUMENT), "succeeded", timeout_s=120)["result"]
    for key, name in (("fit_rel_rms", "fit"), ("heldout_rel_rms", "held-out")):
        errors = [r["rel_error"] for r in result["rows"] if r["set"] == name]
        assert result[key] == pytest.approx(math.sqrt(sum(e * e for e in errors) / len(errors)), rel=1e-6)
    assert [r["rel_error"] for r in result["models"][0]["rows"]] == [r["rel_error"] for r in result["rows"]]
