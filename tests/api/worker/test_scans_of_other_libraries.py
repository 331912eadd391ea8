"""Scans that tifffile and pynrrd write, where they are installed: the part of the file that `selvedge check` reads is theirs."""
import json
import os
import subprocess

import pytest
from daemon_under_test import program

try:
    import numpy
except ImportError:
    numpy = None

pytestmark = [pytest.mark.skipif(numpy is None, reason="numpy is not installed"),
              pytest.mark.skipif(not os.access(program("selvedge-worker"), os.X_OK), reason="no selvedge-worker in the build folder")]

SIZE = {"C": 2, "Z": 6, "T": 3, "Y": 16, "X": 32}


def check(folder, name, **volume):
    (folder / "job.json").write_text(json.dumps({"sample": "s", "volume": {"files": [name], "voxel_size_um": 2, **volume}}))
    done = subprocess.run([program("selvedge"), "check", "--json", str(folder / "job.json")], capture_output=True, text=True, check=False)
    return json.loads(done.stdout)


def numbered(axes, kind="u2"):
    """A volume whose voxels are 100 channel + 10 time, both from 1."""
    at = numpy.indices([SIZE[a] for a in axes])
    return (100 * (at[axes.index("C")] + 1) + 10 * (at[axes.index("T")] + 1)).astype(kind)


def assert_parts(folder, name):
    for channel in (1, 2):
        for time in (1, 2, 3):
            faults = check(folder, name, channel=channel, time=time)["faults"]
            assert [f["detail"].split()[-1] for f in faults] == [str(100 * channel + 10 * time)], faults


@pytest.mark.parametrize("axes", ["TZCYX", "CTZYX", "TCZYX", "ZTCYX", "CZTYX"])
@pytest.mark.parametrize("kind", ["imagej", "ome", "shaped"])
def test_stacks_of_tifffile(tmp_path, kind, axes):
    tifffile = pytest.importorskip("tifffile", reason="tifffile is not installed")
    if kind == "imagej" and axes != "TZCYX":
        pytest.skip("ImageJ has one order")
    how = {"imagej": {"imagej": True}, "ome": {"ome": True}, "shaped": {}}[kind]
    tifffile.imwrite(tmp_path / "s.tif", numbered(axes), photometric="minisblack", metadata={"axes": axes}, **how)
    assert_parts(tmp_path, "s.tif")


@pytest.mark.parametrize("how", [{"tile": (2, 16, 16)}, {"tile": (2, 16, 16), "compression": "zlib"}, {}], ids=["tiles", "deflated", "strips"])
def test_volumes_of_tifffile(tmp_path, how):
    tifffile = pytest.importorskip("tifffile", reason="tifffile is not installed")
    tifffile.imwrite(tmp_path / "s.tif", numpy.full((6, 16, 32), 9, "u2"), volumetric=True, **how)
    report = check(tmp_path, "s.tif")
    assert report["faults"][0]["detail"].endswith("the value 9") and "6 slices" in json.dumps(report["files"])


@pytest.mark.parametrize("axes", ["CXYZT", "XYCZT", "XYZCT", "XYZTC"])
def test_volumes_of_pynrrd(tmp_path, axes):
    nrrd = pytest.importorskip("nrrd", reason="pynrrd is not installed")
    kinds = {"C": "list", "T": "time", "X": "space", "Y": "space", "Z": "space"}
    nrrd.write(str(tmp_path / "s.nrrd"), numbered(axes), {"kinds": [kinds[a] for a in axes]}, index_order="F")
    assert_parts(tmp_path, "s.nrrd")
