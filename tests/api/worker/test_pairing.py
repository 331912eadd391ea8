"""Photographs in a wrong order of the cloth's rotation are noticed: the finished fit describes them better in another order."""
import json
import os
import subprocess

import pytest
from daemon_under_test import program
from small_cloth import hair

pytestmark = pytest.mark.skipif(not os.access(program("selvedge-worker"), os.X_OK), reason="no selvedge-worker in the build folder")
HEAD = "set,light_theta_deg,light_phi_deg,camera_theta_deg,camera_phi_deg,cloth_rotation_deg,r,g,b\n"
VIEWS = [(30, 20, 180), (55, 50, 180), (40, 40, 90)]


def fit(folder, rows, **more):
    (folder / "input").mkdir(parents=True)
    (folder / "input" / "cloth.hair").write_bytes(hair(layers=1, n=16))  # all fibers run along x
    (folder / "input" / "rows.csv").write_text(HEAD + rows)
    (folder / "job.json").write_text(json.dumps({
        "sample": "order", "fibers": {"file": "cloth.hair", "voxel_um": 5}, "measurements": {"file": "rows.csv"},
        "fit": {"model": "two_lobe.v1", "path_budget": 100000, "render_px": 8, "render_samples": 1, **more}}))
    subprocess.run([program("selvedge-worker"), "--quiet", "--threads", "2", str(folder)], check=True)
    return json.loads((folder / "results" / "result.json").read_text())


def table(values, turns):
    return "".join(f"fit,{a},0,{b},{c},{turn},{','.join(f'{x:.6g}' for x in values[i][j])}\n"
                   for i, (a, b, c) in enumerate(VIEWS) for j, turn in enumerate(turns))


def warned(result):
    return [w for w in result["warnings"] if "another order of the cloth's rotations" in w]


def test_exchanged_rotations_are_noticed(tmp_path):
    fixed = {"beta_R": 6, "beta_TT": 12, "gamma_TT": 12}
    start = fit(tmp_path / "start", table([[(0.1, 0.1, 0.1)] * 2] * 3, (0, 90)), fixed=fixed, max_iterations=1)
    values = [[start["rows"][2 * i + j]["rendered"] for j in range(2)] for i in range(3)]
    assert max(abs(v[0][0] / v[1][0] - 1) for v in values) > 0.3, "this cloth looks the same in both directions"
    right = fit(tmp_path / "right", table(values, (0, 90)), fixed=fixed)
    assert right["fit_rel_rms"] < 0.05 and not warned(right)
    wrong = fit(tmp_path / "wrong", table(values, (90, 0)), fixed=fixed)
    assert wrong["fit_rel_rms"] > 0.1 and warned(wrong)
