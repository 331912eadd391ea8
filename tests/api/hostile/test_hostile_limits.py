"""Limits of a worker that was taken over: they are on without a setting, and a Fleece-sized scan stays far below them."""
import os
import subprocess
import time

import pytest
from daemon_under_test import TIMEOUT_S, program, wait_until
from test_hostile_files import HOSTILE, start_hostile

# the largest figures of docs/benchmarks.md: Fleece takes 2.08e9 bytes and 131 s, 2048^3 voxels 3.56e9 bytes; files of 22 bytes a voxel
FLEECE_BYTES, FLEECE_S, FLEECE_VOXELS = 2.08e9, 131, 158e6


def test_limits_are_on_and_a_large_scan_passes_them():
    text = subprocess.run([program("selvedged"), "--print-config"], capture_output=True, text=True, check=True).stdout
    value = {line.split(" = ")[0]: line.split(" = ")[1] for line in text.splitlines() if " = " in line and not line.startswith(";")}
    assert 2 * FLEECE_BYTES < int(value["resident_limit_bytes"]) <= 16 << 30
    assert 22 * FLEECE_VOXELS < int(value["file_limit_bytes"]) <= 1 << 40
    assert 256 <= int(value["thread_limit"]) <= 4096 and 8 <= int(value["folder_depth"]) <= 64
    jobs = text.split("[webhook]")[1].split("[jobs]")[1].split("[slurm]")[0]  # slurm has a limit of this name, too
    assert 1000 * FLEECE_S < int(jobs.split("time_limit_s = ")[1].split()[0]) <= 30 * 86400


def test_the_unit_bounds_the_threads_of_all_workers():
    with open(os.path.join(os.path.dirname(HOSTILE), "..", "..", "..", "config", "selvedge.service")) as f:
        (most,) = [int(line.split("=")[1]) for line in f if line.startswith("TasksMax=")]
    assert most > 2048 + 2 * 1024  # server.max_connections, and a worker and a check with jobs.thread_limit each


@pytest.fixture
def attacked(daemon_maker):
    d = daemon_maker(worker=HOSTILE, options={"jobs.cancel_grace_s": 1, "jobs.workers": 2})
    yield d
    subprocess.run(["rm", "-rf", os.path.join(d.data, "jobs")], check=False)  # Python cannot remove what a failed test has left


@pytest.mark.parametrize("act, code, setting", [
    ("threads 20000", "thread_limit", "jobs.thread_limit"), ("deep_folders 3000", "folder_limit", "jobs.folder_depth"),
    ("left_folders 17", "folder_limit", "jobs.folder_depth"), (f"big_file {1 << 40}", "file_limit", "jobs.file_limit_bytes")])
def test_a_job_beyond_a_limit_fails_at_once_and_says_which(attacked, act, code, setting):
    job = start_hostile(attacked, act)
    failed = attacked.wait_state(job, "succeeded", "failed")
    assert failed["state"] == "failed" and failed["error"]["code"] == code and setting in failed["error"]["text"], failed["error"]
    assert failed["attempt"] == 1 and failed["lost_attempts"] == 0
    assert attacked.get("/livez").ok and attacked.delete(f"/v1/jobs/{job}").status_code == 204
    wait_until(lambda: not os.path.exists(os.path.join(attacked.data, "jobs", job)), what="the end of its folder")


def test_a_thread_bomb_is_ended_while_others_go_on(attacked):
    bomb = start_hostile(attacked, "threads 20000")
    slowest = 0.0
    while attacked.get(f"/v1/jobs/{bomb}").json()["state"] in ("queued", "running"):
        start = time.monotonic()
        assert attacked.get("/readyz").ok
        slowest = max(slowest, time.monotonic() - start)
    assert attacked.job(bomb)["error"]["code"] == "thread_limit" and slowest < 2
    attacked.wait_state(start_hostile(attacked, "pages"), "succeeded")


def test_folders_at_the_limit_are_fine(attacked):
    attacked.wait_state(start_hostile(attacked, "left_folders 16"), "succeeded")


@pytest.mark.parametrize("act, option, code", [
    ("hold", {"jobs.resident_limit_bytes": 300 << 20}, "memory_limit"), ("forever", {"jobs.time_limit_s": 2}, "time_limit")])
def test_memory_and_time_are_bounded(daemon_maker, act, option, code):
    d = daemon_maker(worker=HOSTILE, options=option)
    failed = d.wait_state(start_hostile(d, act), "succeeded", "failed")
    assert failed["state"] == "failed" and failed["error"]["code"] == code and failed["attempt"] == 1
    assert failed["peak_rss_bytes"] < 2e9


def test_the_report_of_a_check_is_bounded(attacked):
    job = attacked.create({"sample": "endless", "volume": {"files": ["endless.tif"], "voxel_size_um": 2.0}, "measurements": {"file": "rows.csv"}})
    attacked.upload(job, "endless.tif", b"II*\0 a scan")
    start = time.monotonic()
    said = attacked.post(f"/v1/jobs/{job}/check").json()
    assert said["valid"] is False and "signal 9" in said["errors"][0]["detail"] and time.monotonic() - start < 10 * TIMEOUT_S
