"""Jobs whose cloth is described with a photograph of its texture: the draft comes from it, or is compared with it."""
import os

import pytest
from daemon_under_test import problem, program
from small_cloth import TABLE
from small_png import png, weave

pytestmark = [pytest.mark.slow, pytest.mark.skipif(not os.access(program("selvedge-worker"), os.X_OK), reason="no selvedge-worker in the build folder")]
FIT = {"max_iterations": 2, "path_budget": 20000, "render_px": 8, "render_samples": 1}
TWILL = ["110", "011", "101"]


def finish(d, cloth, picture, state="succeeded"):
    document = {"sample": "texture", "cloth": {"texture": "weave.png", "yarns": [{"fibers": 9}], **cloth},
                "measurements": {"file": "rows.csv"}, "fit": FIT}
    job = d.create(document)
    d.upload(job, "rows.csv", TABLE.encode(), "measurements")
    d.upload(job, "weave.png", picture, "photograph")
    assert d.post(f"/v1/jobs/{job}/start").status_code == 202
    return d.wait_state(job, state, timeout_s=120)


def test_the_draft_comes_from_the_photograph(real):
    state = finish(real, {"tile_warps": 3, "tile_wefts": 3}, png(192, weave(TWILL)))
    geometry = state["result"]["geometry"]
    turned = [[row[i:] + row[:i] for row in TWILL[j:] + TWILL[:j]] for i in range(3) for j in range(3)]
    assert geometry["cloth"]["draft"] in turned and geometry["cloth"]["made"]["tile_yarns"] == [3, 3]
    texture = geometry["texture"]
    assert texture["weave"] == "twill 2/1" and texture["draft"] == geometry["cloth"]["draft"]
    assert texture["photograph"] == "weave.png" and not texture["contradicts_draft"]
    assert 0.5 < texture["confidence"]["draft"] <= 1


def test_a_contradiction_is_named(real):
    state = finish(real, {"weave": "plain", "tile_warps": 2, "tile_wefts": 2}, png(192, weave(TWILL)))
    assert state["result"]["geometry"]["texture"]["contradicts_draft"]
    assert state["result"]["geometry"]["cloth"]["weave"] == "plain"
    warning = next(text for text in state["warnings"] if "weave.png" in text)
    assert "'twill 2/1'" in warning and "the job says 'plain'" in warning


def test_a_photograph_without_texture(real):
    error = finish(real, {}, png(128, lambda x, y: 128), "failed")["error"]
    assert error["field"] == "cloth.texture" and "no texture that repeats" in error["text"]


def test_weave_draft_or_texture(real):
    reply = real.post("/v1/jobs", json={"sample": "s", "cloth": {"yarns": [{}]}, "measurements": {"file": "rows.csv"}})
    problem(reply, 422, "invalid", "cloth.weave")
