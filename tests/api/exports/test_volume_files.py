"""The volumes that the export of a scan to Mitsuba has."""
import json
import math
import os
import struct
import subprocess

import pytest
from daemon_under_test import ROOT, program
from exports_python import by_python
from small_cloth import TABLE

pytestmark = [pytest.mark.slow, pytest.mark.skipif(not os.access(program("selvedge-worker"), os.X_OK), reason="no selvedge-worker in the build folder")]
FIT = {"path_budget": 20000, "render_px": 8, "render_samples": 1, "model": "isotropic.v1"}


def read_vol(path):
    """Size, channels, box and samples of a grid volume with float32 samples, as Mitsuba's gridvolume reads them."""
    data = path.read_bytes()
    assert data[:4] == b"VOL\x03"
    kind, nx, ny, nz, n_channel, *box = struct.unpack("<5i6f", data[4:48])
    assert kind == 1 and len(data) == 48 + 4 * nx * ny * nz * n_channel
    return (nx, ny, nz), n_channel, box, struct.unpack(f"<{nx * ny * nz * n_channel}f", data[48:])


def test_volumes_of_a_scan(tmp_path):
    folder = tmp_path / "job"
    subprocess.run([program("selvedge-phantom"), "cloth", "--weave", "plain", "--fibers-per-yarn", "7", "--out", tmp_path / "phantom"], check=True,
                   capture_output=True)
    (folder / "input").mkdir(parents=True)
    (tmp_path / "phantom" / "scan.tif").rename(folder / "input" / "scan.tif")
    (folder / "input" / "rows.csv").write_text(TABLE)
    (folder / "job.json").write_text(json.dumps({
        "sample": "scan", "volume": {"files": ["scan.tif"], "voxel_size_um": 2.0}, "measurements": {"file": "rows.csv"}, "fit": FIT,
        "export": {"mitsuba": True, "blender": True}}))
    subprocess.run([program("selvedge-worker"), "--quiet", "--threads", "2", str(folder)], check=True, env={**os.environ, "PATH": "/nowhere"})
    (told,) = [w for w in json.loads((folder / "results" / "result.json").read_text())["warnings"] if "cloth.blend" in w]
    assert "this machine has no Blender: run cloth.py" in told and not (folder / "results" / "export" / "blender" / "cloth.blend").exists()
    made = folder / "results" / "export" / "mitsuba"
    size, n_channel, box, density = read_vol(made / "density.vol")
    assert n_channel == 1 and 0 <= min(density) < 0.05 and 0.5 < max(density) <= 1
    assert [(b - a) / n for a, b, n in zip(box, box[3:], size)] == pytest.approx([0.002] * 3, rel=1e-4)
    same_size, n_channel, same_box, direction = read_vol(made / "direction.vol")
    lengths = [math.hypot(*direction[i:i + 3]) for i in range(0, len(direction), 3)]
    assert (same_size, n_channel, same_box) == (size, 3, box) and all(x == 0 or x == pytest.approx(1, abs=1e-5) for x in lengths)
    inside = [d for d, x in zip(density, lengths) if x > 0]
    outside = [d for d, x in zip(density, lengths) if x == 0]
    assert len(inside) > 1000 and sum(inside) / len(inside) > 2 * sum(outside) / len(outside)
    flat, n_channel, flat_box, sggx = read_vol(made / "sggx.vol")
    assert (flat, n_channel, flat_box) == (size, 6, box)
    voxel = max(range(len(lengths)), key=lambda i: lengths[i] * density[i])
    t, s = direction[3 * voxel:3 * voxel + 3], sggx[6 * voxel:6 * voxel + 6]
    taken = 3 - sum(s[:3])
    assert 0.1 < taken < 1 and [-s[k] / taken for k in (3, 4, 5)] == pytest.approx([t[0] * t[1], t[0] * t[2], t[1] * t[2]], abs=1e-5)
    void = lengths.index(0)
    assert sggx[6 * void:6 * void + 6] == (1, 1, 1, 0, 0, 0)
    seen = by_python("mitsuba", os.path.join(ROOT, "tests", "support", "python", "mitsuba_volume.py"), made / "density.vol", made / "direction.vol")
    assert json.loads(seen) == pytest.approx([max(density), max(direction)])
    place = [(index + 0.5) / n for index, n in zip((voxel % size[0], voxel // size[0] % size[1], voxel // (size[0] * size[1])), size)]
    flakes = json.loads(by_python("mitsuba", os.path.join(ROOT, "tests", "support", "python", "mitsuba_volume.py"), "flakes", made / "sggx.vol",
                                  made / "density.vol", *place, *t))
    assert flakes["areas"] == pytest.approx([math.sqrt(1 - taken), 1, 1], abs=1e-3)
    assert 0.1 < flakes["radiance"] < 1
