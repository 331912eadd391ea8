"""Jobs whose cloth is described: from the document to results, and what cannot be."""
import json
import os

import pytest
from daemon_under_test import ROOT, problem, program
from small_cloth import TABLE

pytestmark = [pytest.mark.slow, pytest.mark.skipif(not os.access(program("selvedge-worker"), os.X_OK), reason="no selvedge-worker in the build folder")]
FIT = {"max_iterations": 2, "path_budget": 20000, "render_px": 8, "render_samples": 1}
LOBES = {"model": "two_lobe.v1"}  # its certificate takes a tenth of that of the default model


def start(d, cloth, **fit):
    job = d.create({"sample": "described", "cloth": cloth, "measurements": {"file": "rows.csv"}, "fit": FIT | fit})
    d.upload(job, "rows.csv", TABLE.encode(), "measurements")
    assert d.post(f"/v1/jobs/{job}/start").status_code == 202
    return job


def test_from_description_to_results(real):
    job = start(real, {"weave": "twill", "tile_warps": 4, "tile_wefts": 4, "warp": [0], "weft": [1], "crimp": 0.4,
                       "yarns": [{"fibers": 12}, {"fibers": 9, "flatness": 2.5, "hairs_per_mm": 3}]})
    state = real.wait_state(job, "succeeded", timeout_s=120)
    geometry = state["result"]["geometry"]
    assert geometry["input"] == "cloth"
    cloth = geometry["cloth"]
    numbers = {n["name"]: n for n in cloth["numbers"]}
    assert cloth["weave"] == "twill" and cloth["draft"] == ["0110", "1100", "1001", "0011"]
    assert numbers["crimp"]["value"] == 0.4 and not numbers["crimp"]["fitted"]
    assert numbers["yarns[1].flatness"]["value"] == 2.5 and numbers["yarns[0].fiber_radius_um"]["unit"] == "um"
    made = cloth["made"]
    assert 0.5 < made["cover"] <= 1 and 0.1 < made["volume_fraction"] < 0.7 and made["thickness_um"] > 50
    assert made["tile_yarns"] == [4, 4] and all(yarn["n_fiber"] > 30 for yarn in made["yarns"])
    # the default model, all of whose parameters are free
    assert state["result"]["model"] == "textile.v3"
    assert [p["name"] for p in state["result"]["parameters"]][-7:] == ["beta_R", "beta_TT", "gamma_TT", "w", "s", "f", "h"]
    files = [f["path"] for f in real.get(f"/v1/jobs/{job}/results").json()["files"]]
    assert "fibers.hair" in files and "quality.html" in files


def test_more_fiber_than_fits(real):
    """Yarns whose fibers cannot lie beside each other are rendered, with a warning that says so."""
    for packing, warned in ((0.85, True), (0.5, False)):
        job = start(real, {"weave": "plain", "tile_warps": 2, "tile_wefts": 2, "yarns": [{"fibers": 40, "packing": packing}]}, **LOBES)
        state = real.wait_state(job, "succeeded", timeout_s=120)
        overlap = state["result"]["geometry"]["cloth"]["made"]["overlap_mean"]
        said = [text for text in state["warnings"] if "more fiber than fits" in text]
        assert (overlap > 0.1) == warned and len(said) == warned, (overlap, said)
        assert not warned or f"by {100 * overlap:.0f} % of their diameter" in said[0]


def test_a_result_describes_its_cloth_to_another_job(real):
    """With kinds of yarn that have names, and with a number that is searched twice in the first job."""
    first = start(real, {"draft": ["10", "01"], "tile_warps": 2, "tile_wefts": 4, "weft": [1], "warp_per_cm": 50,
                         "crimp": {"lower": 0.45, "upper": 0.55},
                         "yarns": [{"name": "red", "fibers": 9}, {"name": "blue", "fibers": 8, "plies": 2, "hairs_per_mm": 5}]}, starts=2, **LOBES)
    result = real.wait_state(first, "succeeded", timeout_s=120)["result"]
    searches = result["starts"]
    assert len(searches) == 2 and sum(search["kept"] for search in searches) == 1
    assert all("cross_validation_rel_rms" in search and search["n_path"] > 0 for search in searches)
    described = result["geometry"]["cloth"]["description"]
    assert [yarn["name"] for yarn in described["yarns"]] == ["red", "blue"]
    made = result["geometry"]["cloth"]["made"]
    assert 0.1 < made["thickness_without_hairs_um"] / made["thickness_um"] < 0.95
    again = start(real, described, **LOBES)
    same = real.wait_state(again, "succeeded", timeout_s=120)["result"]
    assert same["geometry"]["cloth"]["made"] == made and same["geometry"]["cloth"]["description"] == described
    assert [p["name"] for m in same["models"] for p in m["parameters"]] == [p["name"] for m in result["models"] for p in m["parameters"]]
    fibers = [real.get(f"/v1/jobs/{job}/results/fibers.hair").content for job in (first, again)]
    assert fibers[0] == fibers[1]


def test_a_crimp_that_cannot_be(real):
    job = start(real, {"weave": "plain", "tile_warps": 2, "tile_wefts": 2, "crimp": 0, "yarns": [{"fibers": 9, "flatness": 1}]})
    error = real.wait_state(job, "failed", timeout_s=60)["error"]
    assert error["field"] == "cloth.crimp" and "half of its height" in error["text"]


def test_a_mistake_is_refused_at_once(real):
    reply = real.post("/v1/jobs", json={"sample": "s", "cloth": {"weave": "plain", "crimp": 2}, "measurements": {"file": "rows.csv"}})
    problem(reply, 422, "invalid", "cloth.crimp")


def test_the_example_of_the_dashboard_is_without_fault(real):
    """Its files pass the check without a warning, and it asks for the picture and the twin that the button promises."""
    with open(os.path.join(ROOT, "clients", "dashboard", "submit", "example.json"), encoding="utf-8") as f:
        example = json.load(f)
    document = example["document"]
    job = real.create(document)
    real.upload(job, document["measurements"]["file"], ("\n".join(example["table"]) + "\n").encode(), "measurements")
    judged = real.post(f"/v1/jobs/{job}/check").json()
    assert judged["valid"] and judged["errors"] == [] and judged["warnings"] == []
    assert document["twin"]["make"] and [p["on"] for p in document["pictures"]] == ["drape"]
