"""Options of selvedge-phantom that set the defaults of others work in both spellings, wherever they stand."""
import json
import os
import subprocess

import pytest
from daemon_under_test import program

pytestmark = pytest.mark.skipif(not os.access(program("selvedge-phantom"), os.X_OK), reason="no selvedge-phantom in the build folder")
YARN = """ply_num: 1
fiber_num: 7
yarn_clock_wise: 0
fiber_clock_wise: 1
yarn_alpha: 0.45
alpha: 0.36
yarn_radius: 0.038
ellipse_long: 0.026
ellipse_short: 0.02
epsilon: 0.1
beta: 0.2
R_max: 1
use_migration: 0
use_flyaways: 0
"""


def cloth(folder, *options):
    p = subprocess.run([program("selvedge-phantom"), "cloth", "--voxel-um", "8", "--out", str(folder), *options], capture_output=True, timeout=120)
    assert p.returncode == 0, p.stderr.decode()
    return json.loads(p.stdout)


def test_weave_and_yarn_in_both_spellings(tmp_path):
    small = ["--felt-tile-um", "160", "--felt-thickness-um", "60"]
    felt = cloth(tmp_path / "a", *small, "--weave", "felt")
    assert felt["cloth"]["weave"] == "felt"
    assert cloth(tmp_path / "b", "--weave=felt", *small) == felt
    (tmp_path / "yarn.txt").write_text(YARN)
    yarn = str(tmp_path / "yarn.txt")
    plied = cloth(tmp_path / "c", "--yarn", yarn, "--weave", "plain")
    assert plied["cloth"]["packing"] == 0.5 and plied["cloth"]["flatness"] == 1.0
    assert cloth(tmp_path / "d", f"--yarn={yarn}", "--weave=plain") == plied
    given = cloth(tmp_path / "e", "--flatness=1.2", "--weave=plain", f"--yarn={yarn}")
    assert given["cloth"]["flatness"] == 1.2 and given["cloth"]["packing"] == 0.5
