"""The plane under the cloth of a picture: its shadow, its filtered view, and what is refused."""
import json
import os

import jsonschema
import pytest
from daemon_under_test import ROOT, problem
from small_cloth import hair
from test_surface_pictures import VIEW, run_worker

FIXED = {"C_R": [0.1] * 3, "C_TT": [0.6] * 3, "beta_R": 6, "beta_TT": 12, "gamma_TT": 30}
OVER = {"on": "flat", "size_mm": 3, "width_mm": 12, **VIEW, "px": 32}


def rendered(folder, *pictures, **more):
    (folder / "input").mkdir(parents=True)
    given = {"sample": "s", "fibers": {"file": "cloth.hair"}, "pictures": list(pictures), "fit": {"model": "two_lobe.v1", "fixed": FIXED}, **more}
    (folder / "job.json").write_text(json.dumps(given))
    (folder / "input/cloth.hair").write_bytes(hair(layers=3))
    run_worker(folder)
    result = json.loads((folder / "results/result.json").read_text())
    with open(os.path.join(ROOT, "config", "result.schema.json"), encoding="utf-8") as text:
        jsonschema.Draft202012Validator(json.load(text)).validate(result)
    return result


def test_the_ground_adds_its_light(tmp_path):
    """White, it fills the picture but for cloth and shadow; black, it changes nothing. Other methods stand on it, too."""
    on = [{**OVER, "ground_gap_mm": 2, "ground_albedo": a} for a in (0, 0.4, 0.8)]
    result = rendered(tmp_path / "job", OVER, *on, {**on[2], "method": "dual", "reference": True})
    bare, black, grey, white, dual = [sum(p["mean"]) / 3 for p in result["pictures"]]
    se = 5 * max(p["noise"] * sum(p["mean"]) / 3 for p in result["pictures"]) / OVER["px"]
    assert abs(bare - black) < se and "ground_z_mm" not in result["pictures"][0]
    assert abs(grey - bare - (white - bare) / 2) < se < 0.05 * white
    lamp_cosine = 0.5 ** 0.5
    assert 0.6 * 0.8 * lamp_cosine < white - bare < 0.95 * 0.8 * lamp_cosine, "without what the cloth and its shadow hide"
    assert -2.3 < result["pictures"][1]["ground_z_mm"] < -2 and dual > white - bare
    assert (tmp_path / "job/results/pictures/on-5-reference.png").exists()


def test_a_filtered_shadow_is_marked(tmp_path):
    """The picture itself does not change, and an attempt that has lost the view makes the same one again."""
    one, other = {**OVER, "ground_gap_mm": 2}, {"lamp": {"kind": "directional"}}
    plain = rendered(tmp_path / "plain", one)["pictures"][0]
    filtered = rendered(tmp_path / "filtered", {**one, "filter": True})["pictures"][0]
    view = filtered.pop("filtered")
    assert view.pop("error") > 0 and view == {"file": "pictures/on-1-filtered.png", "filter": "joint.v3+sheared.v1"} and filtered == plain
    pictures = tmp_path / "filtered/results/pictures"
    assert (pictures / "on-1.exr").read_bytes() == (tmp_path / "plain/results/pictures/on-1.exr").read_bytes()
    png = (pictures / "on-1-filtered.png").read_bytes()
    (pictures / "on-1-filtered.png").unlink()
    (pictures / "on-1.json").write_text(json.dumps(filtered))
    (tmp_path / "filtered/work/report.done").unlink()
    run_worker(tmp_path / "filtered")
    assert (pictures / "on-1-filtered.png").read_bytes() == png
    sharp = rendered(tmp_path / "sharp", {**one, "filter": True}, **other)["pictures"][0]
    assert sharp["filtered"]["filter"] == "joint.v3"


def test_a_volume_has_no_ground(tmp_path):
    model = {"model": "microflake.v1", "density_multiplier_per_cm": 3000, "fixed": {"alpha": [0.9, 0.8, 0.7], "gamma": 0.3}}
    result = rendered(tmp_path / "job", {**OVER, "ground_gap_mm": 2}, fit=model)
    assert any("picture 1 has no ground" in w for w in result["warnings"]), result["warnings"]


@pytest.mark.parametrize("change, more, said", [
    ({"light_theta_deg": 120, "black_sheet": False}, {}, "above it"),
    ({}, {"environment": {"radiance": [0.1, 0.1, 0.1]}}, "environment"),
])
def test_what_the_ground_needs(real, change, more, said):
    doc = {"sample": "s", "fibers": {"file": "a.hair"}, "pictures": [{**OVER, "ground_gap_mm": 1, **change}], "fit": {"model": "two_lobe.v1"}, **more}
    assert said in problem(real.post("/v1/jobs", json=doc), 422, "invalid", "pictures[0].ground_gap_mm")["detail"]
