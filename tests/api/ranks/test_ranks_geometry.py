"""The geometry of a scan by several ranks: directions, fibers and volumes are those of one rank bit by bit, also when a rank
is lost in the middle of it."""
import json
import os
import shutil
import signal
import subprocess
import time

import pytest
from daemon_under_test import program
from fit_outcome import read_json
from test_ranks import WORKER, finish, needs_mpi, processes_of, start

pytestmark = [pytest.mark.slow, needs_mpi, pytest.mark.skipif(not os.access(WORKER, os.X_OK), reason="no selvedge-worker in the build folder")]
# as long in y as the direction filter's halo of two ranks needs, and small otherwise
VOLUME = {"files": ["scan.tif"], "voxel_size_um": 2.0, "fiber_diameter_voxel": 5, "radius_um": 5, "crop_voxel": [0, 0, 0, 48, 200, 37]}
WITH_TIMES = {"report.html", "report.json", "result.json"}


@pytest.fixture(scope="module")
def scan(tmp_path_factory):
    folder = tmp_path_factory.mktemp("felt")
    subprocess.run([program("selvedge-phantom"), "cloth", "--weave", "felt", "--fibers-per-yarn", "24", "--felt-tile-um", "400", "--felt-thickness-um", "30",
                    "--diameter-voxel", "5", "--threads", "1", "--out", str(folder)], check=True, capture_output=True)
    return folder / "scan.tif"


def make_job(folder, scan):
    (folder / "input").mkdir(parents=True)
    (folder / "job.json").write_text(json.dumps({"sample": "ranks", "volume": VOLUME}))
    shutil.copy(scan, folder / "input" / "scan.tif")
    return folder


def files_of(folder):
    """What the geometry has made: all results but those that hold times, and the files of its stages."""
    paths = [p for top in ("results", "work") for p in (folder / top).rglob("*") if p.is_file()]
    found = {str(p.relative_to(folder)): p.read_bytes() for p in paths if p.name not in WITH_TIMES and p.suffix != ".fingerprint"}
    assert {"results/fibers.hair", "results/direction.vol", "work/orientation/direction.bin", "work/directions/direction.bin"} <= set(found)
    return found, read_json(folder, "results/result.json")["geometry"]


@pytest.fixture(scope="module")
def alone(tmp_path_factory, scan):
    folder = make_job(tmp_path_factory.mktemp("alone") / "job", scan)
    finish(folder)
    made = files_of(folder)
    assert made[1]["n_fiber"] > 20
    return made


def assert_same(folder, alone):
    made = files_of(folder)
    assert {name for name in made[0] if made[0][name] != alone[0].get(name)} == set() and set(made[0]) == set(alone[0])
    assert made[1] == alone[1]


@pytest.mark.parametrize("ranks,stages", [(2, ("orientation", "fibers")), (3, ("fibers",))])
def test_ranks_change_no_bit_of_the_geometry(alone, scan, tmp_path, ranks, stages):
    folder = make_job(tmp_path / "job", scan)
    finish(folder, ranks)
    assert_same(folder, alone)
    log = (folder / "log.txt").read_text()
    for stage in stages:
        assert f"stage {stage}: {ranks} ranks shared" in log
    assert "forbids" not in log


def test_a_rank_that_is_lost_amid_the_geometry_costs_no_more_than_time(alone, scan, tmp_path):
    folder = make_job(tmp_path / "job", scan)
    worker, deadline = start(folder, 2), time.monotonic() + 60
    while not (folder / "work" / "orientation.done").exists():
        assert worker.poll() is None and time.monotonic() < deadline, "the job does not come so far"
        time.sleep(0.002)
    lost = processes_of(folder, 1)
    assert len(lost) == 1 and not (folder / "work" / "fibers" / "fibers.bin").exists()
    os.kill(lost[0], signal.SIGKILL)
    _, words = worker.communicate(timeout=600)
    assert worker.returncode == 0, words
    assert "a rank is lost; the job goes on" in words
    assert_same(folder, alone)
