"""Pictures of the studio (pictures[].kind): what a job writes, and the keys that they refuse."""
import os
import sys

import pytest
from daemon_under_test import problem
from small_cloth import hair

sys.path.insert(0, os.path.join(os.path.dirname(__file__), "..", "..", "bench"))
from png_picture import read_png  # noqa: E402

FIXED = {"C_R": [0.1, 0.1, 0.1], "C_TT": [0.5, 0.3, 0.2], "beta_R": 10, "beta_TT": 20, "gamma_TT": 25}


def document(*pictures):
    return {"sample": "studio", "fibers": {"file": "cloth.hair"}, "fit": {"model": "two_lobe.v1", "fixed": FIXED}, "pictures": list(pictures)}


def start(real, doc):
    job = real.create(doc)
    real.upload(job, "cloth.hair", hair(layers=3), "fibers")
    assert real.post(f"/v1/jobs/{job}/start").status_code == 202
    return real.wait_state(job, "succeeded", "failed", timeout_s=240), job


def test_views_of_the_studio(real, tmp_path):
    """Each view has its ground or fills the frame with cloth; the cloth is red, the ground grey; only flat ones have a scale."""
    few = {"px": 48, "samples": 4, "deep_light_paths": 4000}
    kinds = ["swatch", "roll", "fold", "close_up", "lit_through"]
    done, job = start(real, document(*({"kind": k, **few} for k in kinds)))
    assert done["state"] == "succeeded", done["error"]
    pictures = done["result"]["pictures"]
    assert [p["kind"] for p in pictures] == kinds and [p["on"] for p in pictures] == ["flat", "roll", "fold", "flat", "flat"]
    assert all(p["method"] == "fast" and p["tone_curve"] == "khronos_pbr_neutral" and p["filter"] == "joint.v3" for p in pictures)
    # what is known of their error: noise after the filter, and of the tables
    assert all(0 < p["noise"] < 1 and 0 < p["tables"]["error"] < 1 and p["tables"]["difference_se"] > 0 for p in pictures)
    for i, (kind, p) in enumerate(zip(kinds, pictures), 1):
        file = tmp_path / f"{kind}.png"
        file.write_bytes(real.get(f"/v1/jobs/{job}/results/pictures/on-{i}.png").content)
        rows = read_png(os.fspath(file))
        corner, middle = rows[0][:3], rows[24][72:75]
        if kind in ("swatch", "roll", "fold"):
            assert max(corner) - min(corner) < 12 and 60 < corner[1] < 250, (kind, list(corner))
            assert "ground_z_mm" in p
        assert kind == "lit_through" or middle[0] > middle[2] + 10, (kind, list(middle))
        assert real.get(f"/v1/jobs/{job}/results/pictures/on-{i}.exr").content.startswith(b"\x76\x2f\x31\x01")
        assert real.get(f"/v1/jobs/{job}/results/pictures/on-{i}-columns.csv").status_code == 404


@pytest.mark.parametrize("picture, field, words", [
    ({"kind": "drape", "light_theta_deg": 30}, "pictures[0].light_theta_deg", "those of the studio"),
    ({"kind": "roll", "on": "flat"}, "pictures[0].on", "\"roll\""),
    ({"kind": "drape", "method": "path", "reference": True}, "pictures[0].reference", "its own reference"),
    ({"kind": "drape", "method": "diffusion"}, "pictures[0].method", "diffusion"),
    ({"kind": "hat"}, "pictures[0].kind", "lit_through"),
    ({"on": "flat", "light_phi_deg": 0, "camera_theta_deg": 0, "camera_phi_deg": 0}, "pictures[0].light_theta_deg", "is missing"),
    ({"kind": "measurement"}, "pictures[0]", "lacks 'on'"),
])
def test_keys_that_do_not_fit_the_kind(real, picture, field, words):
    assert words in problem(real.post("/v1/jobs", json=document(picture)), 422, "invalid", field)["detail"]
