"""The score of `make bench-cloth` for recovered cloths: what other draws of the photographs' noise would give in the mean."""
import math
import os
import random
import sys

import pytest
from daemon_under_test import ROOT

sys.path.insert(0, os.path.join(ROOT, "tests", "bench"))
import bench_cloth  # noqa: E402

NOISE, TRACED, N = 0.005, 0.002, 1200


def made(own, rng):
    """Results of a fit whose means are off by `own`, and photographs, both with noise of tracing that they state."""
    rows, photographs = [], []
    for i in range(N):
        true = [0.2 + 0.1 * rng.random() for _ in range(3)]
        brightness = sum(true) / 3
        rows.append({"set": "held-out" if i % 2 else "fit", "rendered_se": [TRACED * brightness] * 3,
                     "rendered": [t + brightness * (rng.gauss(0, own) + rng.gauss(0, TRACED)) for t in true]})
        photographs.append({"mean_rgb": [t + brightness * rng.gauss(0, TRACED) for t in true], "mean_rgb_se": [TRACED * brightness] * 3})
    return {"rows": rows}, {"noise": NOISE, "photographs": photographs}


@pytest.mark.parametrize("own", [0, 0.004, 0.012])
def test_noise_of_tracing_is_taken_off(own):
    (ratio, found), (ratio_se, found_se) = bench_cloth.scores(*made(own, random.Random(3)))
    noise = math.hypot(NOISE, TRACED)  # of a photograph
    assert found ** 2 == pytest.approx(own ** 2, abs=5e-7 + 0.12 * own ** 2)
    assert ratio == pytest.approx(math.hypot(own, noise) / noise, abs=0.06)
    if own > 0:
        assert abs(found - own) < 4 * found_se < 0.002 and 0 < ratio_se < 0.1


def test_fitted_rows_do_not_count():
    result, truth = made(0.004, random.Random(4))
    for row in result["rows"]:
        if row["set"] == "fit":
            row["rendered"] = [9, 9, 9]
    assert bench_cloth.scores(result, truth)[0][1] == pytest.approx(0.004, abs=0.0005)
