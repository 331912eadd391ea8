"""Pictures whose near field follows from the width of a pixel."""
import json
import math
import subprocess

import pytest
from daemon_under_test import problem, program

FIXED = {"fur": {"C_T": [0.8, 0.7, 0.6], "eta": 1.5, "kappa": 0.75, "l": 0.8, "alpha": 3, "beta": 8, "gamma": 7, "sigma_ms": 2, "sigma_ma": 0.01, "g": 0.35},
         "dielectric": {"C_T": [0.8, 0.7, 0.6], "eta": 1.55, "beta": 8, "gamma": 15}}
# a pixel of 32 um is two fibers wide, one of 8 um half of one
VIEW = {"on": "flat", "size_mm": 2, "width_mm": 0.5, "light_theta_deg": 50, "light_phi_deg": 0, "camera_theta_deg": 20, "camera_phi_deg": 200}
WIDE, NARROW = {**VIEW, "px": 16, "samples": 64}, {**VIEW, "px": 64, "samples": 4}


def document(model, *pictures):
    return {"sample": "field", "cloth": {"weave": "plain", "tile_warps": 2, "tile_wefts": 2, "yarns": [{"fibers": 20, "fiber_radius_um": 8}]},
            "fit": {"model": model, "fixed": FIXED[model.split("_")[0].split(".")[0]]}, "pictures": list(pictures)}


def pictures_of(folder, doc):
    (folder / "input").mkdir(parents=True)
    (folder / "job.json").write_text(json.dumps(doc))
    p = subprocess.run([program("selvedge-worker"), "--quiet", str(folder)], capture_output=True, timeout=600)
    assert p.returncode == 0, (folder / "log.txt").read_text()
    return json.loads((folder / "results/result.json").read_text())["pictures"]


@pytest.mark.parametrize("near, far", [("fur_near.v1", "fur.v1"), ("dielectric_near.v1", "dielectric.v1")])
def test_wide_pixels_show_the_far_field(tmp_path, near, far):
    """Wide pixels have the bits of a job of the far field, and narrow ones those without the option."""
    asked = pictures_of(tmp_path / "asked", document(near, *({**p, "field_by_pixel": True} for p in (WIDE, NARROW))))
    plain = pictures_of(tmp_path / "plain", document(near, WIDE, NARROW))
    of_far = pictures_of(tmp_path / "far", document(far, WIDE, NARROW))
    assert [p["model"] for p in asked] == [far, near]
    assert [p["model"] for p in plain] == [near, near] and [p["model"] for p in of_far] == [far, far]
    assert asked[0]["mean"] == of_far[0]["mean"] and asked[1]["mean"] == plain[1]["mean"]
    # the two fields are near each other: neighbours that hide a part of the width move the mean by up to a tenth
    level = [sum(p["mean"]) / 3 for p in (asked[0], plain[0])]
    se = math.hypot(*(p["noise"] * v / 16 for p, v in zip((asked[0], plain[0]), level)))
    assert abs(level[0] - level[1]) < 4 * se + 0.12 * level[1]


def test_the_option_belongs_to_pictures(real):
    doc = {**document("fur_near.v1", WIDE), "field_by_pixel": True}
    assert "field_by_pixel" in problem(real.post("/v1/jobs", json=doc), 422, "invalid", "field_by_pixel")["detail"]


def test_a_model_without_a_far_field_is_refused(real):
    """Before the fit begins. Where the best of several models is shown, one of them with a far field is enough."""
    asked = {**WIDE, "field_by_pixel": True}
    said = problem(real.post("/v1/jobs", json=document("fur.v1", asked)), 422, "invalid", "pictures[0].field_by_pixel")["detail"]
    assert "'fur.v1'" in said and "_near.v1" in said
    several = {**document("fur_near.v1", asked), "fit": {"models": ["two_lobe.v1", "fur_near.v1"]}, "measurements": {"file": "rows.csv"}}
    assert real.post("/v1/jobs", json=several).status_code == 201
