"""A scan whose corners hold no measurement gives the fibers that the same scan gives without padding, and says what is missing."""
import json
import math
import os
import random
import subprocess

import pytest
from daemon_under_test import program
from scan_file import imagej, page16, tag, tiff

pytestmark = [pytest.mark.slow, pytest.mark.skipif(not os.access(program("selvedge-worker"), os.X_OK), reason="no selvedge-worker in the build folder")]

N, PERIOD, RADIUS = 48, 12, 3.5


def pages(padding):
    """Four times four fibers along z, in voxels; padding: the value outside of a round field of view, None for none."""
    noise = random.Random(5)

    def page():
        def value(x, y):
            if padding is not None and math.hypot(x - N / 2 + 0.5, y - N / 2 + 0.5) > N / 2:
                return padding
            solid = min(1, max(0, RADIUS + 0.5 - math.hypot(x % PERIOD - PERIOD / 2 + 0.5, y % PERIOD - PERIOD / 2 + 0.5)))
            return round(20000 + 10000 * solid + noise.gauss(0, 700))
        return page16(value, N, N)
    return [page() for _ in range(40)]


def crossed_pages(padding):
    """Four layers of four fibers, along x and y in turn."""
    noise = random.Random(5)

    def page(z):
        def value(x, y):
            if padding is not None and math.hypot(x - N / 2 + 0.5, y - N / 2 + 0.5) > N / 2:
                return padding
            across = x if z // 10 % 2 else y
            solid = min(1, max(0, RADIUS + 0.5 - math.hypot(across % PERIOD - PERIOD / 2 + 0.5, z % 10 - 4.5)))
            return round(20000 + 10000 * solid + noise.gauss(0, 700))
        return page16(value, N, N)
    return [page(z) for z in range(40)]


def trace(folder, padding, draw=pages):
    (folder / "input").mkdir(parents=True)
    (folder / "input" / "s.tif").write_bytes(tiff(draw(padding), N, N))
    (folder / "job.json").write_text(json.dumps({"sample": "s", "volume": {"files": ["s.tif"], "voxel_size_um": 2}}))
    done = subprocess.run([program("selvedge-worker"), "--quiet", str(folder)], capture_output=True, timeout=1500, check=False)
    assert done.returncode == 0, (folder / "log.txt").read_text()
    return json.loads((folder / "results" / "result.json").read_text()), json.loads((folder / "status.json").read_text())["warnings"]


def test_padding_is_neither_void_nor_material(tmp_path):
    whole, _ = trace(tmp_path / "whole", None)
    assert whole["geometry"]["n_fiber"] == 16 and whole["files"] == []
    for padding in (0, 65535):
        padded, warnings = trace(tmp_path / str(padding), padding)
        geometry = padded["geometry"]
        assert [s["value"].split(" in ")[0] for s in padded["files"][0]["statements"]] == [str(padding)]
        assert 12 <= geometry["n_fiber"] <= 16  # the corners hold four
        assert geometry["density_low"] == pytest.approx(whole["geometry"]["density_low"], rel=0.01)
        assert geometry["density_high"] == pytest.approx(whole["geometry"]["density_high"], rel=0.01)
        assert geometry["radius_um"][2] == pytest.approx(whole["geometry"]["radius_um"][2], rel=0.05)
        assert "padding, which is no measurement, reaches into the tile" in json.dumps(warnings)
        assert padded["verdict"]["code"] != "good"


def test_the_border_of_the_view_is_no_surface_of_fibers(tmp_path):
    """Fibers that the border cuts keep their number and radius, and end there."""
    whole, _ = trace(tmp_path / "whole", None, crossed_pages)
    assert whole["geometry"]["n_fiber"] == 16
    chords = sum(4 * 2 * math.sqrt((N / 2) ** 2 - d * d) for d in (-18, -6, 6, 18)) * 2e-3
    for padding in (0, 65535):
        geometry = trace(tmp_path / str(padding), padding, crossed_pages)[0]["geometry"]
        assert geometry["n_fiber"] == 16
        assert geometry["radius_um"][0] == pytest.approx(whole["geometry"]["radius_um"][0], rel=0.01)
        assert geometry["total_length_mm"] == pytest.approx(chords, rel=0.05)
        assert geometry["radius_spread"] < 0.02


def test_reconstruct_prints_what_the_scan_states(tmp_path, real):
    (tmp_path / "s.tif").write_bytes(tiff(pages(0), N, N, first=[imagej(images=40, slices=40, unit="um", spacing=2), tag(282, 5, (1, 2)), tag(283, 5, (1, 2))]))
    command = [program("selvedge"), "--server", real.url, "reconstruct", str(tmp_path / "s.tif"), "--out", str(tmp_path / "out")]
    done = subprocess.run(command, capture_output=True, text=True, timeout=1500, check=False)
    assert done.returncode == 0, done.stderr
    assert "s.tif states voxel size 2 x 2 x 2 um (ImageJ): applied" in done.stderr
    assert "s.tif states padding value 0 in 2" in done.stderr
    result = json.loads(next((tmp_path / "out").rglob("result.json")).read_text())
    assert {s["name"] for s in result["files"][0]["statements"]} == {"voxel size", "padding value"}
