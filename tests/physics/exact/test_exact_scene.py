"""renderer/scene against the cloth by definition (tests/exact), with equal random numbers, and cloths that must look the same
however their fibers are written. `make test-long` compares all cloths and models at 0.2 % of means and 1 % of derivatives."""
import math
import os
import sys

import pytest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__)))), "support", "python"))
from fiber_file import Fibers, straight_plies, write_half_cylinder  # noqa: E402
from paired_scenes import (CLOTHS, CommonDifference, CONFIGURATIONS, EXACT, MODELS, PRODUCT, derivative_differences, make_cloth, mean_and_se,  # noqa: E402
                           mean_differences, parameter_differences, trace)

LONG = bool(os.environ.get("SELVEDGE_TEST_LONG"))
# About five of 10^4 comparisons of correct programs differ by more standard errors (tests/support/agreement.h).
MOST_SE = 3.5
MEAN_BAR, DERIVATIVE_BAR = 0.002, 0.01
MOST_ROUNDS = 60
# by day a difference of 1 % is seen between ways of writing the same cloth, at night one of 0.5 %
FEWER, SAME_VISIBLE = (1, 0.005) if LONG else (4, 0.01)
PATHS = {"two_lobe.v1": 256, "textile.v3": 256, "dielectric_near.v1": 2048}  # of a block: its lobes are narrow


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return str(tmp_path_factory.mktemp("cloths"))


def check(differences, bar, visible):
    """None is larger than the bar or MOST_SE of its standard errors, and all are precise enough to see a difference of `visible`."""
    lines = [f"{key}: {d}" for key, d in differences.items() if abs(d.relative) > max(bar, MOST_SE * d.se)]
    assert not lines, "\n" + "\n".join(lines)
    blind = [f"{key}: {d}" for key, d in differences.items() if MOST_SE * d.se > visible]
    assert not blind, "too few paths:\n" + "\n".join(blind)


def mean_over_rows(one, other):
    return CommonDifference([(a[f"mean.{c}"], b[f"mean.{c}"]) for a, b in zip(one, other) for c in "rgb"])


def check_all(one, other):
    """Each mean and derivative within its standard errors or the bar; the bars are seen in the mean over rows, and in each parameter."""
    check(mean_differences(one, other), MEAN_BAR, math.inf)
    check(derivative_differences(one, other), DERIVATIVE_BAR, math.inf)
    check({"mean over rows": mean_over_rows(one, other)}, MEAN_BAR, MEAN_BAR)
    check(parameter_differences(one, other), DERIVATIVE_BAR, 2 * DERIVATIVE_BAR)


def check_all_with_more(*request, **more):
    """check_all with as many blocks as it needs to see the bars: narrow lobes need forty times those of others. The standard error alone
    says when it is enough, and never the difference."""
    one, other = [], []
    for seed in range(1, MOST_ROUNDS + 1):
        new = [trace(p, *request, blocks=128, paths=512, seed=seed, **more) for p in (PRODUCT, EXACT)]
        for series, rows in zip((one, other), new):
            series[:] = rows if not series else [{key: old[key] + row[key] for key in old} for old, row in zip(series, rows)]
        wide = [d.se for d in parameter_differences(one, other).values()]
        if MOST_SE * mean_over_rows(one, other).se <= MEAN_BAR and MOST_SE * max(wide) <= 2 * DERIVATIVE_BAR:
            break
    check_all(one, other)


@pytest.mark.parametrize("model", ["two_lobe.v1", "textile.v3", "dielectric_near.v1"])
def test_tubes_that_bend_and_touch(folder, model):
    fibers = make_cloth("twill7", folder)
    views = CONFIGURATIONS[:2 if model == "dielectric_near.v1" and not LONG else 4]
    one, other = (trace(p, fibers, model, views, blocks=64, paths=PATHS[model]) for p in (PRODUCT, EXACT))
    check(mean_differences(one, other), MEAN_BAR, 0.04)


def test_other_random_numbers_give_the_same_means(folder):
    fibers = make_cloth("twill7", folder)
    one = trace(PRODUCT, fibers, configurations=CONFIGURATIONS[:3], blocks=64, paths=256, seed=2)
    other = trace(EXACT, fibers, configurations=CONFIGURATIONS[:3], blocks=64, paths=64, seed=3)
    for a, b in zip(one, other):
        (x, x_se), (y, y_se) = mean_and_se(a["mean.g"]), mean_and_se(b["mean.g"])
        assert abs(x - y) <= MOST_SE * math.hypot(x_se, y_se)
        assert x_se < 0.03 * x


def test_bent_cloth(folder):
    mesh = write_half_cylinder(os.path.join(folder, "half.obj"))
    fibers = make_cloth("twill7", folder)
    one, other = (trace(p, fibers, configurations=CONFIGURATIONS[:2], blocks=64, paths=64, mesh=mesh) for p in (PRODUCT, EXACT))
    check(mean_differences(one, other), MEAN_BAR, 0.02)


@pytest.mark.parametrize("program", [PRODUCT, EXACT])
def test_length_of_the_tile(folder, program):
    """Straight fibers in tiles of 2 to 0.02 mm are the same cloth; grazing light runs along them through many tiles."""
    views = [[80, 180, 80, 0, 0], CONFIGURATIONS[0]]
    blocks = {length: trace(program, straight_plies(length).write(os.path.join(folder, "plies.hair")), configurations=views, blocks=64, paths=128 // FEWER)
              for length in (2, 0.4, 0.1, 0.02)}
    for length in (0.4, 0.1, 0.02):
        check(mean_differences(blocks[length], blocks[2]), 0.001, SAME_VISIBLE)


@pytest.mark.parametrize("program", [PRODUCT, EXACT])
def test_the_same_cloth_written_otherwise(folder, program):
    fibers = Fibers.read(make_cloth("twill7", folder))
    views = [CONFIGURATIONS[0], CONFIGURATIONS[4]]

    def blocks(f):
        paths = (1024 if program == PRODUCT else 128) // FEWER
        return trace(program, f.write(os.path.join(folder, "other.hair")), configurations=views, blocks=64, paths=paths)

    as_made = blocks(fibers)
    x, y = fibers.tile
    for other in (fibers.subdivided(2), fibers.subdivided(4), fibers.beginning_at(0.37 * x, 0.61 * y), fibers.repeated(2, 1), fibers.reordered()):
        check(mean_differences(blocks(other), as_made), 0.001, SAME_VISIBLE)


@pytest.mark.skipif(not LONG, reason="make test-long")
@pytest.mark.parametrize("model", list(MODELS))
@pytest.mark.parametrize("cloth", list(CLOTHS))
def test_all_cloths(folder, cloth, model):
    fibers = make_cloth(cloth, folder)
    check_all_with_more(fibers, model)


@pytest.mark.skipif(not LONG, reason="make test-long")
@pytest.mark.parametrize("model", ["two_lobe.v1", "dielectric_near.v1"])
@pytest.mark.parametrize("cloth", list(CLOTHS))
def test_all_cloths_bent(folder, cloth, model):
    mesh = write_half_cylinder(os.path.join(folder, "half.obj"))
    fibers = make_cloth(cloth, folder)
    check_all_with_more(fibers, model, mesh=mesh)
