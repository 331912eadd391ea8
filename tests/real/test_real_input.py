"""Real scans with real measured reflectances, end to end (see real_jobs.py)."""
import math
import sys
import os

import pytest

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import real_jobs


@pytest.mark.parametrize("name", sorted(real_jobs.JOBS))
def test_real_input(name, tmp_path):
    missing = real_jobs.missing_data(name)
    if missing:
        pytest.skip(f"real data absent: {', '.join(missing)} (set SELVEDGE_DATA)")
    # fewer paths and smaller pictures than by default: those take minutes on the white fibers that the weave's fit ends at (make bench has them)
    result, series, wall_s = real_jobs.run_job(name, str(tmp_path / "job"), path_budget=2000000, render_px=32, render_samples=8)
    fit, held_out = result["fit_rel_rms"], result["heldout_rel_rms"]
    first, last = series[0]["objective"], result["objective"]
    print(f"{name}: relative RMS error {fit:.3f} over the fitted rows, {held_out:.3f} over the held-out rows; "
          f"objective {first:.4g} -> {last:.4g} in {wall_s:.0f} s; {result['geometry']['n_fiber']} fibers")
    assert len([r for r in result["rows"] if r["set"] == "fit"]) == 16
    assert len([r for r in result["rows"] if r["set"] == "held-out"]) == 24
    assert math.isfinite(held_out) and 0 < fit < 1
    for p in result["parameters"]:
        assert p["lower"] <= p["value"] <= p["upper"]
        assert p["fixed"] or not p["determined"] or p["standard_error"] > 0
    if name == "fiber_ct":  # the bar for the blue fabric
        assert first >= 5 * last, f"the objective fell only {first / last:.2f} times"
