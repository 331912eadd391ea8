"""Speckle of single fibers: an option of pictures, which fits do not have."""
import pytest
from daemon_under_test import problem
from test_ground import rendered
from test_surface_pictures import VIEW, document, render, run

SILK = {"model": "wave_silk.v2", "fixed": {"C_T": [0.8] * 3, "beta": 8, "gamma": 8}}
FLAT = {"on": "flat", "width_mm": 0.5, **VIEW}


def test_a_seed_makes_a_pattern(tmp_path):
    """The seed of the job is that of the pattern; the picture beside it, without speckle, keeps its bits."""
    bits = {}
    for name, first, seed in (("one", False, 1), ("same", True, 1), ("again", True, 1), ("other", True, 2)):
        result = rendered(tmp_path / name, {**FLAT, "speckle": first}, FLAT, fit={**SILK, "seed": seed})
        assert [p.get("speckle") for p in result["pictures"]] == [True if first else None, None]
        bits[name] = [(tmp_path / name / f"results/pictures/on-{i}.exr").read_bytes() for i in (1, 2)]
    assert bits["same"] == bits["again"] and bits["one"][1] == bits["same"][1]
    assert bits["one"][0] != bits["same"][0] != bits["other"][0]


@pytest.mark.parametrize("picture, fit, field, word", [
    ({}, {"model": "two_lobe.v1"}, "pictures[0].speckle", "'two_lobe.v1' has no speckle"),
    ({}, {}, "pictures[0].speckle", "'textile.v3' has no speckle"),
    ({}, {"models": ["wave_silk.v2", "chiang.v1"]}, "pictures[0].speckle", "'chiang.v1' has no speckle"),
    ({"method": "dual"}, {"model": "wave_silk.v2"}, "pictures[0].speckle", "not \"path\""),
    ({}, {"model": "wave_silk.v2", "speckle": True}, "fit.speckle", "speckle")])
def test_what_has_no_speckle(real, picture, fit, field, word):
    doc = {**document({**FLAT, "speckle": True, **picture}), "fit": fit}
    assert word in problem(real.post("/v1/jobs", json=doc), 422, "invalid", field)["detail"]


def test_the_command_asks_for_it(real):
    job, _ = run(real, {k: v for k, v in document().items() if k != "pictures"})
    refused = render(real, job, "--speckle")
    assert refused.returncode != 0 and "'two_lobe.v1' has no speckle" in refused.stderr, refused.stderr
