"""The skill of a fit: every job compares itself with a plain BRDF that is fitted to the same rows."""
import os

import pytest
from daemon_under_test import program
from small_cloth import start_small_job

pytestmark = pytest.mark.skipif(not os.access(program("selvedge-worker"), os.X_OK), reason="no selvedge-worker in the build folder")


def document(**more):
    return {"sample": "skill", "fibers": {"file": "cloth.hair", "voxel_um": 5}, "measurements": {"file": "rows.csv"},
            "fit": {"path_budget": 20000, "render_px": 8, "render_samples": 1}, **more}


@pytest.mark.slow
def test_the_plain_brdf_stands_beside_the_fit(real):
    result = real.wait_state(start_small_job(real, document()), "succeeded", timeout_s=120)["result"]
    plain = result["skill"]["plain_brdf"]
    # four rows of twelve radiances and twelve numbers: the fitted error must be far below that of a constant
    assert 0 <= plain["fit_rel_rms"] < 0.2
    assert plain["heldout_rel_rms"] > 0
    assert result["skill"]["heldout_ratio"] == pytest.approx(result["heldout_rel_rms"] / plain["heldout_rel_rms"])
    assert all(0 <= x <= 1 for key in ("diffuse", "f0", "transmission") for x in plain[key])
    worse = result["heldout_rel_rms"] - 2 * result["heldout_rel_rms_se"] > plain["heldout_rel_rms"]
    assert bool([w for w in result["warnings"] if "plain BRDF" in w]) == worse
    # these rows are the invention of a plain surface, and the cloth's colours are started far from them
    assert worse, "the case does not try the warning any more"


@pytest.mark.slow
def test_a_fit_that_listens_to_the_plain_brdf(real):
    """Expected rows weigh in the fit, and are no rows of the result."""
    fit = document()["fit"]
    deaf = real.wait_state(start_small_job(real, document()), "succeeded", timeout_s=120)["result"]
    listening = real.wait_state(start_small_job(real, document(fit={**fit, "plain_prior": 1})), "succeeded", timeout_s=120)["result"]
    assert [row["name"] for row in listening["rows"]] == [row["name"] for row in deaf["rows"]]
    assert [p["value"] for p in listening["parameters"]] != [p["value"] for p in deaf["parameters"]]
    assert listening["skill"]["plain_brdf"] == deaf["skill"]["plain_brdf"]


def test_no_plain_prior_under_an_environment(real):
    listening = document(environment={"radiance": [0.1, 0.1, 0.1]}, fit={**document()["fit"], "plain_prior": 1})
    result = real.wait_state(start_small_job(real, listening), "succeeded", timeout_s=120)["result"]
    assert [w for w in result["warnings"] if "fit.plain_prior" in w]


def test_no_plain_prior_with_faults_of_photographs(real):
    fit = {**document()["fit"], "plain_prior": 1, "nuisance": {"stray_light": True}}
    reply = real.post("/v1/jobs", json=document(fit=fit))
    assert reply.status_code == 422 and "plain_prior" in reply.json()["detail"]


def test_no_skill_under_an_environment(real):
    result = real.wait_state(start_small_job(real, document(environment={"radiance": [0.1, 0.1, 0.1]})), "succeeded", timeout_s=120)["result"]
    assert result["skill"] is None
    assert not [w for w in result["warnings"] if "plain BRDF" in w]
