"""Jobs whose cloth is described with a photograph of its texture: the draft comes from it, or is compared with it."""
import os
import random

import pytest
from daemon_under_test import problem, program
from small_cloth import TABLE
from small_png import png, png_rgb, weave

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


def test_scale_and_colors_of_the_photograph(real):
    """Threads, flatness, crimp and the colors of the kinds come from a photograph whose scale is given."""
    grey, size = weave(TWILL), (8, 10)

    def rgb(x, y):
        warp = TWILL[y // size[1] % 3][x // size[0] % 3] == "1"
        return [grey(x, y) * v for v in ((0.9, 0.6, 0.3) if warp else (0.5, 0.7, 1.0))]
    cloth = {"texture_px_per_mm": 30, "texture_colors": True, "tile_warps": 3, "tile_wefts": 3, "warp": [0], "weft": [1],
             "yarns": [{"fibers": 40, "name": "warp"}, {"fibers": 40, "name": "weft"}]}
    state = finish(real, cloth, png_rgb(256, rgb))
    geometry = state["result"]["geometry"]
    texture, spacing_um = geometry["texture"], geometry["cloth"]["made"]["yarn_spacing_um"]
    assert spacing_um == pytest.approx([1000 * s / 30 for s in size], rel=0.03)
    assert texture["warp"]["yarns_per_cm"] == pytest.approx(1e4 / spacing_um[0], rel=1e-6)
    assert geometry["cloth"]["description"]["crimp"] == pytest.approx(spacing_um[1] ** 2 / (spacing_um[0] ** 2 + spacing_um[1] ** 2), rel=1e-6)
    colors = [f"{k}.C_TT.{c}" for k in ("warp", "weft") for c in "rgb"]
    assert set(texture["taken"]) >= {"warp_per_cm", "weft_per_cm", "crimp", *colors}
    start = {p["name"]: p["start"] for p in state["result"]["parameters"]}
    assert start["warp.C_TT.r"] > start["warp.C_TT.g"] > start["warp.C_TT.b"]
    assert start["weft.C_TT.r"] < start["weft.C_TT.b"] and start["warp.C_TT.r"] > start["weft.C_TT.r"]


def test_a_scale_that_cannot_be(real):
    error = finish(real, {"texture_px_per_mm": 9000}, png(192, weave(TWILL)), "failed")["error"]
    assert error["field"] == "cloth.texture_px_per_mm" and "yarns in a centimetre" in error["text"]


def test_a_contradiction_is_named(real):
    state = finish(real, {"weave": "plain", "tile_warps": 2, "tile_wefts": 2}, png(192, weave(TWILL)))
    assert state["result"]["geometry"]["texture"]["contradicts_draft"]
    assert state["result"]["geometry"]["cloth"]["weave"] == "plain"
    warning = next(text for text in state["warnings"] if "weave.png" in text)
    assert "'twill 2/1'" in warning and "the job says 'plain'" in warning


def test_a_felt_that_shows_a_weave(real):
    state = finish(real, {"weave": "felt", "yarns": [{"fibers": 50}]}, png(192, weave(TWILL)))
    assert state["result"]["geometry"]["texture"]["contradicts_draft"]
    assert any("'twill 2/1'" in text and "the job says 'felt'" in text for text in state["warnings"])


def test_threads_that_the_photograph_contradicts(real):
    """Yarns of 8 and 10 pixels at 30 pixels in a millimetre are 37.5 and 30 in a centimetre."""
    state = finish(real, {"texture_px_per_mm": 30, "warp_per_cm": 20, "weft_per_cm": 31, "tile_warps": 3, "tile_wefts": 3},
                   png(192, weave(TWILL)))
    said = [text for text in state["warnings"] if "in a centimetre" in text]
    assert len(said) == 1 and "shows 37.5 warp yarns" in said[0] and "the job says 20" in said[0] and "30 pixels in a millimetre" in said[0]
    assert state["result"]["geometry"]["cloth"]["description"]["warp_per_cm"] == 20


def noisy(draft):
    """A weave under so much noise that its draft is found, but not certain."""
    grey, rng = weave(draft), random.Random(1)
    return png(192, lambda x, y: min(255, max(0, 0.4 * grey(x, y) + 80 + rng.uniform(-140, 140))))


def test_an_uncertain_draft_is_taken_with_a_warning(real):
    state = finish(real, {"tile_warps": 3, "tile_wefts": 3}, noisy(TWILL))
    confidence = state["result"]["geometry"]["texture"]["confidence"]["draft"]
    assert 0.2 < confidence < 0.7
    warning = next(text for text in state["warnings"] if "weave.png" in text)
    assert "not certain of it" in warning and f"(confidence {confidence:.2f})" in warning


def test_an_uncertain_contradiction(real):
    state = finish(real, {"weave": "plain", "tile_warps": 2, "tile_wefts": 2}, noisy(TWILL))
    warning = next(text for text in state["warnings"] if "weave.png" in text)
    assert "the job says 'plain'" in warning and "the photograph is not certain" in warning


def test_a_certain_draft_is_taken_without_a_warning(real):
    state = finish(real, {"tile_warps": 3, "tile_wefts": 3}, png(192, weave(TWILL)))
    assert not any("weave.png" in text for text in state["warnings"])


def test_a_photograph_without_texture(real):
    error = finish(real, {}, png(128, lambda x, y: 128), "failed")["error"]
    assert error["field"] == "cloth.texture" and "no texture that repeats" in error["text"]


def test_weave_draft_or_texture(real):
    reply = real.post("/v1/jobs", json={"sample": "s", "cloth": {"yarns": [{}]}, "measurements": {"file": "rows.csv"}})
    problem(reply, 422, "invalid", "cloth.weave")
