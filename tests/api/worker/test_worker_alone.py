"""The worker without a daemon, on job folders made by hand: its messages about tables, warnings and budgets."""
import json
import os
import re
import struct
import subprocess
import zlib

import pytest
from daemon_under_test import program
from small_cloth import TABLE, hair

pytestmark = [pytest.mark.slow, pytest.mark.skipif(not os.access(program("selvedge-worker"), os.X_OK), reason="no selvedge-worker in the build folder")]


def run(folder, table=TABLE, expect=0, photographs=(), set_up=None, **fit):
    """Runs a job of the small cloth with a table, or with photographs [(bytes of a PNG, keys)]. Returns status.json."""
    model = {} if "models" in fit else {"model": "two_lobe.v1"}
    document = {"sample": "alone", "fibers": {"file": "cloth.hair"},
                "fit": {**model, "path_budget": 100000, "render_px": 8, "render_samples": 1, **fit}, **(set_up or {})}
    (folder / "input").mkdir()
    (folder / "input" / "cloth.hair").write_bytes(hair())
    if photographs:
        document["photographs"] = [{"file": f"p{i:02d}.png", "transfer": "linear", **keys} for i, (_, keys) in enumerate(photographs)]
        for i, (data, _) in enumerate(photographs):
            (folder / "input" / f"p{i:02d}.png").write_bytes(data)
    else:
        document["measurements"] = {"file": "rows.csv"}
        (folder / "input" / "rows.csv").write_bytes(table if isinstance(table, bytes) else table.encode())
    (folder / "job.json").write_text(json.dumps(document))
    return run_again(folder, expect)


def run_again(folder, expect=0):
    p = subprocess.run([program("selvedge-worker"), "--quiet", str(folder)], capture_output=True, timeout=600)
    log = (folder / "log.txt").read_text()
    assert p.returncode == expect, log
    return json.loads((folder / "status.json").read_text())


def result(folder):
    return json.loads((folder / "results" / "result.json").read_text())


def png(width, height, value):
    """Returns an 8-bit RGB PNG; value(x, y) is the value of a pixel."""
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    raw = b"".join(b"\0" + bytes(v for x in range(width) for v in value(x, y)) for y in range(height))
    head = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(raw)) + chunk(b"IEND", b"")


@pytest.mark.parametrize("table", [TABLE.replace("set,", "größe,", 1).encode("latin-1"), TABLE.replace("set,", "s" + "é" * 60 + ",", 1).encode()],
                         ids=["latin-1", "cut"])
def test_a_table_of_strange_bytes_fails_with_its_message(tmp_path, table):
    state = run(tmp_path, table, expect=1)
    assert state["state"] == "failed"
    assert state["error"]["field"] == "measurements.file" and "rows.csv" in state["error"]["text"]


@pytest.mark.parametrize("set_up", [{"lamp": {"kind": "directional"}}, {"camera": {"far_field": True, "distance_cm": 1.01}},
                                    {"environment": {"radiance": [0.2, 0.1, 0.3]}}], ids=["lamp", "camera", "environment"])
def test_the_set_up_reaches_the_result(tmp_path, set_up):
    """The same seed gives the same result, unless the set-up is another one."""
    lamp = {"lamp": {"side_cm": 60}, "camera": {"distance_cm": 1.01}}
    rendered = []
    for name, keys in (("plain", {}), ("again", {}), ("changed", set_up)):
        (tmp_path / name).mkdir()
        run(tmp_path / name, set_up={**lamp, **keys}, max_iterations=1, path_budget=20000)
        rendered.append([row["rendered"] for row in result(tmp_path / name)["rows"]])
    assert rendered[0] == rendered[1]
    assert all(a != b for a, b in zip(rendered[0], rendered[2]))


def test_many_uneven_photographs_leave_room_for_other_warnings(tmp_path):
    half = png(32, 32, lambda x, y: (30, 25, 15) if x < 16 else (10, 8, 5))
    angles = [{"light_theta_deg": 1 + i, "light_phi_deg": 0, "camera_theta_deg": 20, "camera_phi_deg": 180} for i in range(60)]
    state = run(tmp_path, photographs=[(half, a) for a in angles], path_budget=1000)
    warnings = state["warnings"]
    uneven = [w for w in warnings if "is not uniform" in w]
    assert len(uneven) == 3 and "57 more warnings about photographs are in the job's log" in warnings
    assert any("60 of 60 photographs ('p00.png' and others) have 8 bits" in w for w in warnings)
    assert (tmp_path / "log.txt").read_text().count("is not uniform") == 60
    assert any("has not converged" in w for w in warnings) and warnings == result(tmp_path)["warnings"]


@pytest.mark.parametrize("method,starts", [("gauss_newton.v1", 1), ("gauss_newton.v1", 2), ("published_sgd.v1", 1)])
def test_a_budget_that_cannot_be_kept_is_said(tmp_path, method, starts):
    fit = {"method": method, "starts": starts, "max_iterations": 12, "fixed": {"C_R": 0.1, "beta_R": 5}}
    rows = TABLE + "fit,45,0,45,90,all,0.05,0.03,0.02\n"  # traced at nine rotations
    for name in ("less", "least"):
        (tmp_path / name).mkdir()
    warnings = run(tmp_path / "less", rows, path_budget=1000, **fit)["warnings"]
    said = [re.search(r"takes up to (\d+) all the same", w) for w in warnings if w.startswith("fit.path_budget: 1000 paths are too few")]
    assert len(said) == 1
    least, taken = int(said[0].group(1)), result(tmp_path / "less")["n_path_fit"]
    assert 0.85 * least < taken <= least  # published_sgd: settling may be left out
    warnings = run(tmp_path / "least", rows, path_budget=least, **fit)["warnings"]
    assert not any("fit.path_budget" in w for w in warnings)
    assert result(tmp_path / "least")["n_path_fit"] <= least


def test_texture_states_the_blocks_that_were_measured(tmp_path):
    flat = png(32, 32, lambda x, y: (20 + (x * 7 + y * 3) % 5, 16 + (x * 5 + y) % 4, 10 + (x + y * 3) % 3))
    angles = [{"light_theta_deg": 20 + 10 * i, "light_phi_deg": 0, "camera_theta_deg": 20, "camera_phi_deg": 180} for i in range(4)]
    run(tmp_path, photographs=[(flat, a) for a in angles], texture={"block_mm": 0.85, "weight": 0})
    for row in result(tmp_path)["rows"]:
        assert row["texture"]["blocks_a_side"] == 12 and row["texture"]["block_mm"] == pytest.approx(10 / 12)
    assert "means of 0.833 mm blocks" in (tmp_path / "results" / "summary.txt").read_text()


def test_as_many_models_as_a_job_takes(tmp_path):
    """Also a run after an interruption in the validation: the finished part is loaded and not computed again."""
    models = ["two_lobe.v1", "two_lobe_balanced.v1", "kajiya_kay.v1", "marschner.v1", "isotropic.v1",
              "phase_two_lobe.v1", "microflake.v1", "phase_isotropic.v1"]
    run(tmp_path, models=models, path_budget=20000)
    first = result(tmp_path)
    assert [m["id"] for m in first["models"]] == models and sum(m["best"] for m in first["models"]) == 1
    assert (tmp_path / "log.txt").read_text().count("validation of ") == 8
    os.remove(tmp_path / "work" / "report.done")
    os.remove(tmp_path / "results" / "result.json")
    run_again(tmp_path)
    again = result(tmp_path)
    assert again["models"] == first["models"]
    assert (tmp_path / "log.txt").read_text().count("validation of ") == 8


@pytest.mark.parametrize("models", [["two_lobe.v1", "two_lobe_diffuse.v1"], ["two_lobe_diffuse.v1", "two_lobe.v1"]], ids=["inner first", "outer first"])
def test_a_model_that_contains_another_starts_from_its_result(tmp_path, models):
    """Three starts: its own, and the result of the contained model with two values of the parameter that it lacks. The
    contained model is fitted first, whatever the order in the job."""
    run(tmp_path, models=models, path_budget=60000)
    found = result(tmp_path)["models"]
    assert [m["id"] for m in found] == models
    assert "fitting two_lobe.v1 (model 1 of 2)" in (tmp_path / "log.txt").read_text()
    inner, outer = (found[models.index(m)] for m in ("two_lobe.v1", "two_lobe_diffuse.v1"))
    found = [p["value"] for p in inner["parameters"]]
    assert len(outer["starts"]) == 3 and inner["starts"] == [] and sum(s["kept"] for s in outer["starts"]) == 1
    for start, w in zip(outer["starts"][1:], (0.02, 0.4)):
        assert start["start"] == pytest.approx([*found, w], rel=1e-6)


def gain_error(row, misfit, prior):
    """Standard error of a row's gain: three channels with the noise of rendering and measurement and the misfit, which is
    relative to the row's brightness but at least to 0.02, beside the prior."""
    brightness = max(sum(row["measured"]) / 3, 0.02)
    information = 1 / prior ** 2
    for mean, se, measured_se in zip(row["rendered"], row["rendered_se"], row["measured_se"]):
        information += mean ** 2 / ((misfit * brightness) ** 2 + se ** 2 + measured_se ** 2)
    return information ** -0.5


def test_a_gain_for_each_photograph(tmp_path):
    """The rows are the cloth's own radiances times known gains. The fit finds the gains, reports errors with and
    without them, and a bad row of weight 0 changes neither."""
    known = {"fixed": {"C_R": 0.1, "C_TT": 0.85, "beta_TT": 10, "gamma_TT": 10}, "bounds": {"beta_R": [4.99, 5.01]}, "path_budget": 400000}
    gains = [1.1, 0.92, 1.05, 0.9, 1.08, 0.93]
    for name in ("own", "told"):
        (tmp_path / name).mkdir()
    run(tmp_path / "own", **known)
    lines = TABLE.splitlines()
    for i, (row, gain) in enumerate(zip(result(tmp_path / "own")["rows"], gains)):
        lines[2 + i] = ",".join(lines[2 + i].split(",")[:6] + [f"{gain * v:.6f}" for v in row["rendered"]]) + ",1"
    lines[1] += ",weight"
    lines.append("fit,20,0,30,90,0,0.9,0.9,0.9,0")
    run(tmp_path / "told", "\n".join(lines) + "\n", nuisance={"gain": "per_photograph", "gain_prior_rel": 0.1}, **known)
    told = result(tmp_path / "told")
    for row, gain in zip(told["rows"], gains):
        assert abs(row["gain"] - gain) < 4 * row["gain_se"] + 0.005, (row["gain"], row["gain_se"], gain)
        assert row["gain_se"] == pytest.approx(gain_error(row, told["misfit_rel_rms"], 0.1), rel=1e-3)
    assert 0.06 < told["fit_rel_rms"] < 0.11 and 0.05 < told["heldout_rel_rms"] < 0.1
    for key in ("fit_rel_rms_with_gains", "heldout_rel_rms_with_gains"):
        assert told[key] < 0.02 + 4 * told[key + "_se"], (key, told[key], told[key + "_se"])
    assert "with them" in (tmp_path / "told" / "results" / "summary.txt").read_text()
