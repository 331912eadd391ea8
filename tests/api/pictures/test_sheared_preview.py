"""Previews of the smooth surface by sheared filtering, the lens of the camera, and what they do not go with."""
import json
import math
import os

import jsonschema
import pytest
from daemon_under_test import ROOT, problem
from small_cloth import hair
from test_surface_pictures import VIEW, run_worker

FIT = {"model": "isotropic.v1", "fixed": {"C": [0.8, 0.5, 0.3]}}


def test_a_preview_is_near_the_paths(tmp_path):
    """On a cylinder, with and without a lens: the mean is within a quarter of the traced one (holes and the width of the
    table's cells are left out), and the filters agree. Noise is not stated."""
    folder = tmp_path / "job"
    (folder / "input").mkdir(parents=True)
    view = {"on": "cylinder", "radius_mm": 1, "width_mm": 3, **VIEW, "samples": 16}
    lens = {"aperture_mm": 80, "focus_mm": 999}
    given = {"sample": "s", "fibers": {"file": "cloth.hair"}, "fit": FIT,
             "pictures": [{**view, "samples": 64, **lens}, {**view, "method": "sheared", **lens},
                          {**view, "method": "sheared", "preview_filter": "none"}, {**view, "method": "sheared", "preview_filter": "axes"}]}
    (folder / "job.json").write_text(json.dumps(given))
    (folder / "input/cloth.hair").write_bytes(hair(layers=3))
    run_worker(folder)
    result = json.loads((folder / "results/result.json").read_text())
    with open(os.path.join(ROOT, "config", "result.schema.json"), encoding="utf-8") as text:
        jsonschema.Draft202012Validator(json.load(text)).validate(result)
    path, *previews = result["pictures"]
    assert [p["method"] for p in previews] == ["sheared"] * 3 and all(p["noise"] is None for p in previews)
    for p in previews:
        assert math.isclose(sum(p["mean"]), sum(path["mean"]), rel_tol=0.25), result["pictures"]
        assert math.isclose(sum(p["mean"]), sum(previews[0]["mean"]), rel_tol=0.05)


@pytest.mark.parametrize("changed,field", [
    ({"aperture_mm": 5, "ground_gap_mm": 1}, "aperture_mm"), ({"aperture_mm": 5, "filter": True}, "filter"),
    ({"focus_mm": 900}, "focus_mm"), ({"method": "sheared", "filter": True}, "filter"), ({"preview_filter": "axes"}, "preview_filter"),
    ({"method": "sheared", "samples": 17}, "samples"), ({"method": "sheared", "samples": 81}, "samples"), ({"method": "sheared", "px": 2049}, "px")])
def test_what_does_not_go_together_is_refused(real, changed, field):
    """By the name of the option."""
    given = {"sample": "s", "fibers": {"file": "cloth.hair"}, "fit": FIT, "pictures": [{"on": "flat", **VIEW, **changed}]}
    problem(real.post("/v1/jobs", json=given), 422, "invalid", f"pictures[0].{field}")
