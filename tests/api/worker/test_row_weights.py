"""Weights of rows, with the worker alone: only their ratios matter, a row of weight 0 changes nothing, and a job in
which all weights are 0 is refused. Also: warnings about parameters that the rows do not determine."""
import csv
import io
import json
import os
import subprocess

import pytest
from daemon_under_test import program
from small_cloth import TABLE, hair

pytestmark = [pytest.mark.slow, pytest.mark.skipif(not os.access(program("selvedge-worker"), os.X_OK), reason="no selvedge-worker in the build folder")]


def table(weight=1, dead_weight=None):
    rows = list(csv.DictReader(line for line in io.StringIO(TABLE) if not line.startswith("#")))
    for row in rows:
        row["weight"] = weight if row["set"] == "fit" else 1
    if dead_weight is not None:
        rows.append({**rows[0], "light_theta_deg": "33", "r": 0, "g": 0, "b": 0, "weight": dead_weight, "set": "fit"})
        if "index" in rows[0]:
            rows[-1]["index"] = "99"
    out = io.StringIO()
    writer = csv.DictWriter(out, list(rows[0]))
    writer.writeheader()
    writer.writerows(rows)
    return out.getvalue()


def run(folder, text, **fit):
    os.makedirs(folder / "input")
    document = {"sample": "weights", "fibers": {"file": "cloth.hair"}, "measurements": {"file": "rows.csv"},
                "fit": {"model": "two_lobe.v1", "path_budget": 60000, "render_px": 8, "render_samples": 1, **fit}}
    (folder / "job.json").write_text(json.dumps(document))
    (folder / "input" / "cloth.hair").write_bytes(hair())
    (folder / "input" / "rows.csv").write_text(text)
    worker = subprocess.run([program("selvedge-worker"), "--quiet", "--threads", "1", str(folder)], capture_output=True, timeout=600)
    if worker.returncode != 0:
        return json.loads((folder / "status.json").read_text())
    return json.loads((folder / "results" / "result.json").read_text())


@pytest.fixture(scope="module")
def plain(tmp_path_factory):
    return run(tmp_path_factory.mktemp("plain") / "job", table())


def fitted(result):
    return {p["name"]: (pytest.approx(p["value"], rel=1e-6), pytest.approx(p["standard_error"], rel=1e-6), p["determined"]) for p in result["parameters"]}


@pytest.mark.parametrize("weight", [1e-4, 4096])
def test_only_ratios_count(plain, tmp_path, weight):
    result = run(tmp_path / "job", table(weight))
    assert fitted(plain) == fitted(result)
    for key in ("objective", "fit_rel_rms", "heldout_rel_rms"):
        assert result[key] == pytest.approx(plain[key], rel=1e-6), key
    assert result["converged"] == plain["converged"] and result["n_path_fit"] == plain["n_path_fit"]


def test_a_row_of_weight_0_changes_nothing(plain, tmp_path):
    result = run(tmp_path / "job", table(dead_weight=0))
    assert fitted(plain) == fitted(result) and result["n_path_fit"] == plain["n_path_fit"]
    assert len(result["rows"]) == len(plain["rows"]) + 1  # the row is rendered and shown all the same
    # the paths differ; with the row the error is 1 or more
    assert result["fit_rel_rms"] == pytest.approx(plain["fit_rel_rms"], abs=0.05)
    assert not any("zero in all channels" in w for w in result["warnings"])
    bad = run(tmp_path / "counted", table(dead_weight=1))
    assert bad["fit_rel_rms"] > 0.3 and any("zero in all channels" in w for w in bad["warnings"])


def test_no_weight_at_all(tmp_path):
    status = run(tmp_path / "job", table(weight=0))
    assert status["state"] == "failed" and status["error"]["field"] == "measurements.file", status
    assert "weight 0" in str(status["error"])


def test_warnings_name_what_is_not_known(plain, tmp_path):
    for flag, says in (("at_bound", "at the edge"), ("determined", "not determined")):
        told = [w for w in plain["warnings"] if says in w]
        flagged = [p["name"] for p in plain["parameters"] if (p["at_bound"] if flag == "at_bound" else not p["determined"])]
        assert [w.split(": ")[1].split(", ") for w in told] == ([flagged] if flagged else []), told
    assert any("not determined" in w for w in plain["warnings"])  # 60,000 paths do not determine nine parameters
    tied = run(tmp_path / "job", table(), tied=[["C_R"], ["C_TT"]])
    assert not any("free parameters" in w for w in tied["warnings"])


def test_few_rows_for_the_free_parameters(tmp_path):
    rows = table().splitlines()
    fit = [line for line in rows[1:] if line.startswith("fit") or ",fit," in line or line.endswith(",fit")]
    text = "\n".join([rows[0], *fit[:1]]) + "\n"
    said = [w for w in run(tmp_path / "nine", text)["warnings"] if "free parameters" in w]
    assert len(said) == 1 and "3 numbers for 9 free parameters" in said[0]
    said = [w for w in run(tmp_path / "three", text, tied=[["C_R"], ["C_TT"]], fixed={"beta_R": 5, "beta_TT": 15})["warnings"] if "free parameters" in w]
    assert said == []  # C_R, C_TT and gamma_TT: three numbers for three parameters
