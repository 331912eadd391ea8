"""A job lit by an image of its surroundings, uploaded with the role `environment`."""
import os

import pytest
from daemon_under_test import program
from small_cloth import TABLE, hair
from small_exr import exr

pytestmark = [pytest.mark.slow, pytest.mark.skipif(not os.access(program("selvedge-worker"), os.X_OK), reason="no selvedge-worker in the build folder")]
FIT = {"model": "two_lobe.v1", "fixed": {"C_R": 0.1, "C_TT": 0.6, "beta_TT": 20, "gamma_TT": 20},
       "max_iterations": 1, "path_budget": 20000, "render_px": 8, "render_samples": 1}
GREY = (0.25, 0.5, 1.0)


def finish(d, environment, picture=None, state="succeeded"):
    job = d.create({"sample": "sky", "fibers": {"file": "cloth.hair"}, "measurements": {"file": "rows.csv"}, "fit": FIT, "environment": environment})
    d.upload(job, "cloth.hair", hair(), "fibers")
    d.upload(job, "rows.csv", TABLE.encode(), "measurements")
    if picture is not None:
        d.upload(job, "sky.exr", picture, "environment")
    assert d.post(f"/v1/jobs/{job}/start").status_code == 202
    return d.wait_state(job, state, timeout_s=120)


def rendered(d, *arguments):
    return [row["rendered"] for row in finish(d, *arguments)["result"]["rows"]]


def test_an_uploaded_environment_lights_the_cloth(real):
    dark = rendered(real, {"radiance": [0, 0, 0]})
    sky = rendered(real, {"file": "sky.exr", "scale": 2}, exr(8, 4, lambda x, y: GREY))
    constant = rendered(real, {"radiance": [2 * v for v in GREY]})
    # an even sky is a constant radiance, however the light is sampled
    for row, same, without in zip(sky, constant, dark):
        assert row == pytest.approx(same, rel=0.25)
        assert all(lit > unlit for lit, unlit in zip(row, without)) and row[2] > 1.3 * without[2]


def test_an_environment_that_is_no_picture_fails_the_job(real):
    error = finish(real, {"file": "sky.exr"}, b"no picture", "failed")["error"]
    assert error["field"] == "environment.file" and "sky.exr" in error["text"]


def test_the_environment_must_be_uploaded(real):
    job = real.create({"sample": "sky", "fibers": {"file": "cloth.hair"}, "measurements": {"file": "rows.csv"}, "fit": FIT,
                       "environment": {"file": "sky.exr"}})
    real.upload(job, "cloth.hair", hair(), "fibers")
    real.upload(job, "rows.csv", TABLE.encode(), "measurements")
    reply = real.post(f"/v1/jobs/{job}/start")
    assert reply.status_code == 409 and "sky.exr" in reply.text
