"""A scan that is processed in files under a small memory setting gives the same bytes as one in memory. No space for
the files is an error."""
import json
import os
import resource
import subprocess

import pytest
from small_cloth import TABLE

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
BUILD = os.environ.get("SELVEDGE_BUILD") or os.path.join(ROOT, "build")
PRODUCTS = ["fibers.hair", "fibers.txt", "direction.vol", "density.vol", "pictures/slice-x.png", "pictures/slice-y.png",
            "pictures/slice-z.png", "scan/x.slices", "scan/y.slices", "scan/z.slices", "scan/fibers.hair", "scan/contrast.u8"]


@pytest.fixture(scope="module")
def scan(tmp_path_factory):
    folder = str(tmp_path_factory.mktemp("phantom"))
    subprocess.run([os.path.join(BUILD, "bin", "selvedge-phantom"), "cloth", "--out", folder, "--weave", "plain", "--yarns", "2,2",
                    "--fibers-per-yarn", "7", "--threads", "2"], check=True, stdout=subprocess.DEVNULL)
    return os.path.join(folder, "scan.tif")


def make_job(folder, scan):
    os.makedirs(os.path.join(folder, "input"))
    document = {"sample": "memory", "volume": {"files": ["scan.tif"], "voxel_size_um": 2}, "measurements": {"file": "rows.csv"},
                "fit": {"path_budget": 20000, "max_iterations": 1, "render_px": 8, "render_samples": 1}}
    with open(os.path.join(folder, "job.json"), "w") as f:
        json.dump(document, f)
    with open(os.path.join(folder, "input", "rows.csv"), "w") as f:
        f.write(TABLE)
    os.link(scan, os.path.join(folder, "input", "scan.tif"))
    return folder


def work(folder, mib, **options):
    command = [os.path.join(BUILD, "bin", "selvedge-worker"), "--quiet", "--threads", "2", "--memory-mib", str(mib), folder]
    return subprocess.run(command, capture_output=True, text=True, timeout=600, **options).returncode


def products(folder):
    data = []
    for name in PRODUCTS:
        with open(os.path.join(folder, "results", name), "rb") as f:
            data.append(f.read())
    return data


def log(folder):
    with open(os.path.join(folder, "log.txt")) as f:
        return f.read()


def test_same_bytes_under_any_setting(scan, tmp_path):
    roomy, tight = make_job(str(tmp_path / "roomy"), scan), make_job(str(tmp_path / "tight"), scan)
    assert work(roomy, 2048) == 0 and work(tight, 1) == 0
    assert "in files" in log(tight) and "in files" not in log(roomy)
    for name, a, b in zip(PRODUCTS, products(roomy), products(tight)):
        assert a == b, name
    assert not [name for _, _, files in os.walk(os.path.join(tight, "work")) for name in files if name.startswith("scratch")]


def test_no_room_is_an_error(scan, tmp_path):
    folder = make_job(str(tmp_path / "job"), scan)
    limit = 300 << 10  # smaller than the densities
    assert work(folder, 1, restore_signals=False, preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))) == 1
    with open(os.path.join(folder, "status.json")) as f:
        error = json.load(f)["error"]
    assert "cannot reserve" in error["text"] and "for densities" in error["text"], error
