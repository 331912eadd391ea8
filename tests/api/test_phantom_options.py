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
    p = subprocess.run([program("selvedge-phantom"), "cloth", "--voxel-um", "8", "--out", str(folder), *options], capture_output=True, timeout=600)
    assert p.returncode == 0, p.stderr.decode()
    assert p.stdout.decode().rstrip().endswith(str(folder / "phantom.json")) and p.stdout.count(b"\n") == 1
    return json.loads((folder / "phantom.json").read_text())


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


def test_a_described_cloth_and_its_description(tmp_path):
    """The description that a phantom writes is one that it takes, and it makes the same cloth again."""
    given = tmp_path / "given.json"
    given.write_text(json.dumps({"draft": ["10", "01"], "crimp": 0.6, "disorder": 1 / 30, "tile_warps": 2, "tile_wefts": 4,
                                 "yarns": [{"fibers": 9, "twist_per_m": 700}]}))
    made = cloth(tmp_path / "a", "--description", str(given))
    assert made["cloth"]["crimp"] == 0.6 and made["cloth"]["yarns"][0]["twist_per_m"] == 700 and made["result"]["volume_fraction"] > 0.1
    assert json.loads((tmp_path / "a" / "cloth.json").read_text())["disorder"] == 1 / 30  # with all digits
    again = cloth(tmp_path / "b", f"--description={tmp_path}/a/cloth.json")
    assert again["result"] == made["result"] and (tmp_path / "a" / "truth.hair").read_bytes() == (tmp_path / "b" / "truth.hair").read_bytes()


@pytest.mark.parametrize("weave,options", [("plain", []), ("knit", ["--fibers-per-yarn", "7"]),
                                           ("felt", ["--felt-tile-um", "800", "--felt-thickness-um", "400", "--fibers-per-yarn", "20"])])
def test_a_phantom_describes_itself(tmp_path, weave, options):
    phantom = cloth(tmp_path / "a", "--weave", weave, *options)
    described = cloth(tmp_path / "b", "--description", str(tmp_path / "a" / "cloth.json"))
    per_area = [r["length_mm"] / (r["tile_mm"][0] * r["tile_mm"][1]) for r in (described["result"], phantom["result"])]
    assert abs(per_area[0] / per_area[1] - 1) < 0.3
    assert abs(described["result"]["volume_fraction"] / phantom["result"]["volume_fraction"] - 1) < 0.35


def test_a_wrong_description(tmp_path):
    given = tmp_path / "given.json"
    given.write_text('{"weave": "plain", "crimp": 3}')
    p = subprocess.run([program("selvedge-phantom"), "cloth", "--out", str(tmp_path), "--description", str(given)], capture_output=True, timeout=300)
    assert p.returncode == 2 and b"cloth.crimp" in p.stderr


def test_meshes_of_the_shapes_of_pictures(tmp_path):
    def mesh(*options):
        return subprocess.run([program("selvedge-phantom"), "mesh", *options, "--out", str(tmp_path / "m.obj")], capture_output=True, text=True, timeout=300)
    made = mesh("--on", "cylinder", "--radius-mm", "10", "--size-mm", "20", "--wrap-deg", "90")
    assert made.returncode == 0 and made.stdout == "362 points, 360 triangles\n", made.stderr
    points = [[float(x) for x in line.split()[1:]] for line in (tmp_path / "m.obj").read_text().splitlines() if line.startswith("v ")]
    assert all(abs((x * x + (z + 10)**2)**0.5 - 10) < 1e-4 and abs(y) == 10 for x, y, z in points)
    for options, code, words in ((("--on", "sphere"), 2, "flat, cylinder or drape"), (("--on", "drape", "--radius-mm", "0.1"), 1, "0.1"),
                                 (("--on", "cylinder", "--wrap-deg", "400"), 2, "--wrap-deg")):
        refused = mesh(*options)
        assert refused.returncode == code and words in refused.stderr, refused
