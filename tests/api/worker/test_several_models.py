"""Several models in one job, through the daemon, the real worker and the command line: surface and volume models on one
cloth of fibers."""
import os
import pathlib
import subprocess
import sys

import pytest
from daemon_under_test import program
from small_cloth import TABLE, start_small_job

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "clients" / "python"))
import selvedge  # noqa: E402

pytestmark = [pytest.mark.slow, pytest.mark.skipif(not os.access(program("selvedge-worker"), os.X_OK), reason="no selvedge-worker in the build folder")]
MODELS = ["microflake.v1", "two_lobe.v1"]


def document(**fit):
    return {"sample": "which model", "fibers": {"file": "cloth.hair", "voxel_um": 5}, "measurements": {"file": "rows.csv"},
            "fit": {"models": MODELS, "path_budget": 100000, "render_px": 8, "render_samples": 1, "density_multiplier_per_cm": 2000, **fit}}


@pytest.fixture(scope="module")
def finished(real):
    job = start_small_job(real, document())
    return job, real.wait_state(job, "succeeded", timeout_s=120)


def test_all_are_fitted_and_compared(finished):
    _, state = finished
    result = state["result"]
    assert [m["id"] for m in result["models"]] == MODELS
    assert [m["kind"] for m in result["models"]] == ["volume", "surface"]
    assert [len(m["parameters"]) for m in result["models"]] == [5, 9]
    d = result["models"][0]["parameters"][-1]
    assert (d["name"], d["unit"], d["value"], d["fixed"]) == ("density_multiplier", "1/cm", 2000, True)
    best = [m for m in result["models"] if m["best"]]
    assert len(best) == 1 and all(m[key] > 0 for m in result["models"] for key in ("fit_rel_rms_se", "heldout_rel_rms_se"))
    # three of four rows are enough for the four parameters of the microflakes, but not for nine, so neither is judged by them
    assert result["chosen_by"] == "fitted_rows" and [m["cross_validation"] is None for m in result["models"]] == [False, True]
    assert best[0]["fit_rel_rms"] == min(m["fit_rel_rms"] for m in result["models"])
    assert any("too few fitted rows for cross-validation" in w for w in result["warnings"]), result["warnings"]
    for m in result["models"]:
        for key in ("fit_channel_rel_rms", "heldout_channel_rel_rms"):
            assert len(m[key]) == len(m[key + "_se"]) == 3 and all(x >= 0 for x in m[key]) and all(x > 0 for x in m[key + "_se"])
    # the top level of the result describes the best model, so clients that expect one model still work
    assert result["model"] == best[0]["id"] and state["parameters"] == best[0]["parameters"]
    for key in ("fit_rel_rms", "heldout_rel_rms", "objective", "n_path_fit", "converged", "correlation"):
        assert result[key] == best[0][key], key
    assert [r["rendered"] for r in result["rows"]] == [r["rendered"] for r in best[0]["rows"]]
    for m in result["models"]:
        assert len(m["rows"]) == 6 and all(x > 0 for r in m["rows"] for x in r["rendered"])


def test_the_best_is_chosen_by_cross_validation(real):
    """Held-out rows that contradict all others change what is reported of them, and not which model is the best."""
    more = "fit,30,0,50,90,0,0.09,0.06,0.04\nfit,70,0,70,180,0,0.3,0.25,0.2\nfit,0,0,40,0,0,0.10,0.07,0.04\nfit,60,0,20,20,90,0.05,0.03,0.02\n"
    strange = TABLE.replace("held-out,30,0,50,180,0,0.12,0.09,0.05", "held-out,30,0,50,180,0,0.9,0.9,0.9")
    results = []
    for table in (TABLE + more, strange + more):
        job = start_small_job(real, document(path_budget=60000), table)
        results.append(real.wait_state(job, "succeeded", timeout_s=120)["result"])
    for result in results:
        folds = [m["cross_validation"] for m in result["models"]]
        assert result["chosen_by"] == "cross_validation" and all(f["n_fold"] == f["n_row"] == 8 and f["rel_rms_se"] > 0 for f in folds)
        best = next(m for m in result["models"] if m["best"])
        # the lowest error decides, unless another model is equal to it within its error and has the lower Akaike criterion
        lowest = min(result["models"], key=lambda m: m["cross_validation"]["rel_rms"])
        assert best is lowest or any("do not tell" in w for w in result["warnings"])
        assert not any("too few fitted rows" in w for w in result["warnings"])
    assert results[0]["model"] == results[1]["model"] and results[0]["cross_validation"] == results[1]["cross_validation"]
    assert results[1]["heldout_rel_rms"] > results[0]["heldout_rel_rms"]


def test_series_says_what_its_numbers_are(real, finished):
    job, state = finished
    series = real.get(f"/v1/jobs/{job}/series?max_points=5000").json()
    assert [m["id"] for m in series["models"]] == MODELS
    for m, of in zip(series["models"], state["result"]["models"]):
        assert [(p["name"], p["unit"], p["lower"], p["upper"], p["fixed"]) for p in m["parameters"]] == \
               [(p["name"], p["unit"], p["lower"], p["upper"], p["fixed"]) for p in of["parameters"]]
    points = series["points"]
    assert [p["step"] for p in points] == list(range(len(points)))
    assert all(p["model"] == MODELS[p["i_model"]] for p in points) and {p["i_model"] for p in points} == {0, 1}
    assert all(len(p["parameter"]) == len(series["models"][p["i_model"]]["parameters"]) for p in points)
    assert all("parameters" not in p for p in points)
    # merged to few points: no point mixes two models, and the description stays although its record is merged
    few = real.get(f"/v1/jobs/{job}/series?max_points=3&after_step=0").json()
    assert few["models"] == series["models"] and len(few["points"]) == 3
    for p in few["points"]:
        assert len(p.get("parameter_min", p["parameter"])) == len(few["models"][p["i_model"]]["parameters"])


def test_each_model_sees_its_own_sections(real):
    """Flat fibers are ellipses for a model that states the width of a section, and round tubes for others, whichever models stand beside it."""
    cloth = {"weave": "plain", "tile_warps": 2, "tile_wefts": 2, "yarns": [{"fibers": 9, "fiber_flatness": 2.5}]}
    fixed = {"eta": 1.55, "a": 2.5, "alpha": 2, "beta": 8, "C_T": [0.7, 0.5, 0.3]}

    def fit(models, **more):
        job = real.create({"sample": "flat fibers", "cloth": cloth, "measurements": {"file": "rows.csv"},
                           "fit": {"models": models, "max_iterations": 1, "path_budget": 20000, "render_px": 8, "render_samples": 1, **more}})
        real.upload(job, "rows.csv", TABLE.encode(), "measurements")
        assert real.post(f"/v1/jobs/{job}/start").status_code == 202
        return {m["id"]: m for m in real.wait_state(job, "succeeded", timeout_s=300)["result"]["models"]}

    together = fit(["isotropic.v1", "elliptical_oriented.v1"], fixed=fixed)
    alone = fit(["isotropic.v1"])
    if os.environ.get("SELVEDGE_TEST_LONG"):  # tables of the flat model take 0.4 s each
        alone |= fit(["elliptical_oriented.v1"], fixed=fixed)
    for model, m in alone.items():
        for key in ("parameters", "rows", "fit_rel_rms"):
            assert m[key] == together[model][key], (model, key)


def test_python_client(real, finished):
    job, state = finished
    assert selvedge.Client(real.url).job(job).result().raw["models"] == state["result"]["models"]


def test_command_line_prints_the_comparison(real, finished):
    job, _ = finished
    shown = subprocess.run([program("selvedge"), "--server", real.url, "status", job], capture_output=True, text=True, check=True).stdout
    lines = [line for line in shown.splitlines() if line.strip().startswith(tuple(MODELS))]
    assert len(lines) == 2 and sum("best" in line for line in lines) == 1, shown
    assert shown.index("held out") < shown.index("of the best model")
    series = subprocess.run([program("selvedge"), "--server", real.url, "series", job], capture_output=True, text=True, check=True).stdout
    assert {line.split("\t")[1] for line in series.splitlines()[1:]} == set(MODELS)


@pytest.mark.parametrize("fit,field,says", [
    ({"models": ["two_lobe.v1", "no_model.v1"]}, "fit.models[1]", "microflake.v1"),
    ({"models": []}, "fit.models", "1 to 32"),
    ({"models": "two_lobe.v1"}, "fit.models", "list"),
    ({"models": ["two_lobe.v1", "two_lobe.v1"]}, "fit.models[1]", "second time"),
    ({"model": "two_lobe.v1"}, "fit.models", "both"),
    ({"start": {"gamma": 0.2, "beta_R": 3, "nothing": 1}}, "fit.start.nothing", "alpha"),
    ({"start": {"gamma": 9}}, "fit.start.gamma", "1.5"),
    ({"fixed": {"density_multiplier": 4000}}, "fit.fixed.density_multiplier", "unknown parameter"),
    ({"density_multiplier_per_cm": 1}, "fit.density_multiplier_per_cm", "10 to 100000"),
    ({"fit_density": True}, "fit.fit_density", "black_sheet false"),
    ({"fit_radius": 8}, "fit.fit_radius", "object"),
    ({"fit_radius": {"lower": 8}}, "fit.fit_radius.lower", "lower_um"),
    ({"fit_radius": {"lower_um": 8, "upper_um": 8}}, "fit.fit_radius.upper_um", "1.1 times"),
    ({"fit_radius": True, "models": ["microflake.v1"]}, "fit.fit_radius", "microflake.v1"),
    ({"models": ["two_lobe.v1"]}, "fit.density_multiplier_per_cm", "volume models"),
    ({"fixed": {"alpha": 0.5, "gamma": 0.2}}, "fit.fixed", "microflake.v1"),
    ({"bounds": {"density_multiplier": [100, 200]}}, "fit.density_multiplier_per_cm", "100 and 200"),
    ({"priors": {"density_multiplier": {"mean": 900, "se": 100}}}, "fit.priors", "fit.fit_density"),
])
def test_bad_input(real, fit, field, says):
    reply = real.post("/v1/jobs", json=document(**fit))
    body = reply.json()
    assert reply.status_code == 422 and body["field"] == field and says in body["detail"], body


def test_fiber_radius(real):
    """The search precedes the fits and leaves its curve in the result, and the fits use the radius found."""
    job = start_small_job(real, document(fit_radius={"lower_um": 5, "upper_um": 12}, path_budget=60000))
    result = real.wait_state(job, "succeeded", timeout_s=120)["result"]
    radius = result["radius"]
    assert radius["model"] == "two_lobe.v1" and abs(radius["start_um"] - 8) < 1e-3 and 8 <= len(radius["curve"]) <= 11
    assert all(5 <= p["radius_um"] * (1 + 1e-9) and p["radius_um"] <= 12 * (1 + 1e-9) and p["objective_se"] > 0 for p in radius["curve"])
    want = radius["minimum_um"] if radius["determined"] or radius["at_bound"] else radius["start_um"]
    assert abs(radius["radius_um"] - want) < 1e-9 and abs(result["geometry"]["mean_radius_um"] - want) < 1e-3 * want
    points = real.get(f"/v1/jobs/{job}/series").json()["points"]
    assert [p["phase"] for p in points[:len(radius["curve"])]] == ["radius"] * len(radius["curve"]) and points[len(radius["curve"])]["phase"] != "radius"
    shown = subprocess.run([program("selvedge"), "--server", real.url, "status", job], capture_output=True, text=True, check=True).stdout
    assert "fiber radius:" in shown


def test_radius_beyond_the_tile(real):
    job = start_small_job(real, document(fit_radius={"lower_um": 5, "upper_um": 500}))
    error = real.wait_state(job, "failed", timeout_s=60)["error"]
    assert error["field"] == "fit.fit_radius.upper_um" and "tile" in error["text"], error


def test_radius_range_without_the_cloths_own(real):
    job = start_small_job(real, document(fit_radius={"lower_um": 20, "upper_um": 30}, path_budget=1000, max_iterations=1))
    warnings = real.wait_state(job, "succeeded", timeout_s=120)["warnings"]
    said = [w for w in warnings if "fit.fit_radius" in w and "20 to 30 um" in w and "radius of 8 um" in w]
    assert len(said) == 1, warnings


def test_density_wants_light_from_behind(real):
    """The worker reads the table, so the error is the same as for photographs but comes later."""
    job = start_small_job(real, {**document(fit_density=True), "black_sheet": False})
    error = real.wait_state(job, "failed", timeout_s=60)["error"]
    assert error["field"] == "fit.fit_density" and "behind the cloth" in error["text"], error


def test_voxels_that_need_too_much(real):
    job = start_small_job(real, {**document(), "fibers": {"file": "cloth.hair", "voxel_um": 0.05}})
    error = real.wait_state(job, "failed", timeout_s=60)["error"]
    assert error["field"] == "fibers.voxel_um" and "limit" in error["text"], error
