"""fit.discrepancy: what the fibers leave of the measured radiances as a smooth factor on all renderings."""
import math
import os
import statistics

import pytest
from daemon_under_test import program
from small_cloth import start_small_job

pytestmark = pytest.mark.skipif(not os.access(program("selvedge-worker"), os.X_OK), reason="no selvedge-worker in the build folder")

# (light_theta, camera_theta, camera_phi) in degrees
FITTED = [(20, 20, 180), (45, 45, 180), (70, 70, 180), (60, 0, 180), (45, 45, 90), (65, 65, 90), (70, 40, 150), (40, 40, 45), (70, 50, 30), (15, 65, 120)]
HELD_OUT = [(30, 50, 180), (60, 30, 90), (50, 60, 60)]


def measured(light, camera, phi):
    """Radiance of a surface that no fibers make: matt, and twice as bright at grazing angles."""
    cosine = math.cos(math.radians(light))
    grazing = 1 + math.sin(math.radians(max(light, camera))) ** 2
    return [round(c * cosine * grazing * (1 + 0.2 * math.cos(math.radians(phi))), 6) for c in (0.2, 0.15, 0.1)]


def table():
    lines = ["set,light_theta_deg,light_phi_deg,camera_theta_deg,camera_phi_deg,cloth_rotation_deg,r,g,b"]
    for name, places in (("fit", FITTED), ("held-out", HELD_OUT)):
        lines += [f"{name},{light},0,{camera},{phi},0," + ",".join(map(str, measured(light, camera, phi))) for light, camera, phi in places]
    return "\n".join(lines) + "\n"


def document(**fit):
    return {"sample": "discrepancy", "fibers": {"file": "cloth.hair", "voxel_um": 5}, "measurements": {"file": "rows.csv"},
            "fit": {"model": "two_lobe.v1", "path_budget": 60000, "render_px": 8, "render_samples": 1, **fit}}


def factor(discrepancy, light, camera, phi):
    """The factor as docs/model.md states it, from the numbers of result.json."""
    light, camera, phi = map(math.radians, (light, camera, phi))
    between = math.cos(light) * math.cos(camera) + math.sin(light) * math.sin(camera) * math.cos(phi)
    half = math.sqrt((1 + between) / 2)
    x = [math.acos(min(1, (math.cos(light) + math.cos(camera)) / 2 / half)), math.acos(min(1, half)), light ** 2 + camera ** 2, max(light, camera)]
    kernels = [math.exp(-0.5 * sum(((a - b) / s) ** 2 for a, b, s in zip(x, place, discrepancy["scale"]))) for place in discrepancy["place"]]
    sums = [sum(k * w[c] for k, w in zip(kernels, discrepancy["log_weight"])) for c in range(3)]
    return [math.exp(min(max(s, -0.7), 0.7)) for s in sums]


def run(real, document, rows):
    return real.wait_state(start_small_job(real, document, rows), "succeeded", timeout_s=240)["result"]


@pytest.mark.slow
def test_all_rows_are_rendered_with_the_factor(real):
    without, result = run(real, document(), table()), run(real, document(discrepancy=True), table())
    found = result["discrepancy"]
    assert without["discrepancy"] is None
    assert found["share"] > 0 and len(found["place"]) == len(FITTED)
    assert result["cross_validation"]["rel_rms"] < found["cross_validation_rel_rms_without"]
    assert found["cross_validation_rel_rms_without"] == pytest.approx(without["cross_validation"]["rel_rms"])
    assert result["fit_rel_rms"] < found["fit_rel_rms_without"]
    assert found["heldout_rel_rms_without"] == pytest.approx(without["heldout_rel_rms"])
    assert [p["value"] for p in result["parameters"]] == [p["value"] for p in without["parameters"]]
    fitted = list(zip(FITTED, without["rows"], result["rows"]))
    held_out = list(zip(HELD_OUT, without["rows"][len(FITTED):], result["rows"][len(FITTED):]))
    for place, plain, row in held_out:
        for k, c in zip(factor(found, *place), range(3)):
            assert row["rendered"][c] == pytest.approx(k * plain["rendered"][c], rel=1e-6)
    for place, plain, row in fitted:  # these have paths of their own
        for k, c in zip(factor(found, *place), range(3)):
            error = math.hypot(k * plain["rendered_se"][c], row["rendered_se"][c])
            assert row["rendered"][c] == pytest.approx(k * plain["rendered"][c], abs=5 * error)
    changed = [row["rendered"][0] / plain["rendered"][0] for plain, row in zip(without["rows"], result["rows"])]
    assert max(changed) / min(changed) > 1.05, "the case does not try the factor any more"


@pytest.mark.slow
def test_rows_that_give_the_factor_have_less_noise(real):
    """Their noise would go into all renderings."""
    without, result = (run(real, document(discrepancy=wanted), table()) for wanted in (False, True))
    assert result["discrepancy"]["share"] > 0
    change = {name: statistics.median(a["rendered_se"][1] / a["rendered"][1] / (b["rendered_se"][1] / b["rendered"][1])
                                      for a, b in zip(result["rows"], without["rows"]) if a["set"] == name)
              for name in ("fit", "held-out")}
    assert change["held-out"] == pytest.approx(1)
    assert change["fit"] < 0.95
    assert result["n_path_validation"] > 1.2 * without["n_path_validation"]


def test_too_few_rows_for_a_discrepancy(real):
    """Four rows leave nothing to judge it by."""
    few = "\n".join(table().split("\n")[:5] + table().split("\n")[-4:])
    result = run(real, document(discrepancy=True), few)
    assert result["discrepancy"] is None
    assert [w for w in result["warnings"] if "fit.discrepancy" in w and "too few rows" in w]


def test_no_discrepancy_with_faults_of_photographs(real):
    reply = real.post("/v1/jobs", json=document(discrepancy=True, nuisance={"stray_light": True}))
    assert reply.status_code == 422 and "fit.discrepancy" in reply.json()["detail"]
