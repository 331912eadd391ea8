"""The tables of fast pictures: an attempt that is killed while it makes them, and visibility from tables."""
import json
import os
import signal
import struct
import subprocess
import time

import pytest

from daemon_under_test import problem, program
from small_cloth import hair
from test_surface_pictures import VIEW, run_worker

HEADER_BYTES = 16


def folder_of(folder, *pictures):
    (folder / "input").mkdir(parents=True)
    given = {"sample": "s", "fibers": {"file": "cloth.hair"}, "pictures": list(pictures), "fit": {"model": "isotropic.v1", "fixed": {"C": [0.8, 0.5, 0.3]}}}
    (folder / "job.json").write_text(json.dumps(given))
    (folder / "input/cloth.hair").write_bytes(hair(layers=3))
    return folder


def size_of(path):
    return path.stat().st_size if path.exists() else 0


@pytest.mark.slow
def test_a_killed_attempt_goes_on(tmp_path):
    """Killed once the journal has a record; the next attempt ends with the bytes of one that was not killed."""
    view = {"on": "flat", "width_mm": 3, **VIEW, "method": "fast", "visibility": "tables"}
    whole, killed = folder_of(tmp_path / "whole", view), folder_of(tmp_path / "killed", view)
    run_worker(whole)
    journal, tables = killed / "work/report/fast.journal", "work/report/fast.tables"
    worker = subprocess.Popen([program("selvedge-worker"), "--quiet", str(killed)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    deadline = time.monotonic() + 60
    while size_of(journal) <= HEADER_BYTES and worker.poll() is None and time.monotonic() < deadline:
        time.sleep(0.005)
    os.kill(worker.pid, signal.SIGKILL)
    worker.wait()
    assert size_of(journal) > HEADER_BYTES and not (killed / tables).exists(), "killed while the tables were made"
    run_worker(killed)
    assert (killed / tables).read_bytes() == (whole / tables).read_bytes()
    assert not journal.exists() and not (whole / "work/report/fast.journal").exists()
    assert (killed / "results/pictures/on-1.exr").read_bytes() == (whole / "results/pictures/on-1.exr").read_bytes()


@pytest.mark.slow
def test_visibility_from_tables(tmp_path):
    """The means are near those of path tracing, with the error of one traced hit, and the tables are longer."""
    view = {"on": "flat", "width_mm": 3, **VIEW, "samples": 64}
    both = folder_of(tmp_path / "tables", {**view, "method": "fast", "visibility": "tables"}, view)
    traced = folder_of(tmp_path / "traced", {**view, "method": "fast", "deep_light": "cells"})
    run_worker(both)
    run_worker(traced)
    tables, path = (sum(json.loads((both / f"results/pictures/on-{i}.json").read_text())["mean"]) / 3 for i in (1, 2))
    assert abs(tables - path) < 0.25 * path
    assert size_of(both / "work/report/fast.tables") > size_of(traced / "work/report/fast.tables") + 1000


def test_deep_light_by_directions(tmp_path):
    """The mean of a flat cloth is that of path tracing within the noise of both and the stated one of the table, and the tables hold it."""
    view = {"on": "flat", "width_mm": 3, **VIEW, "samples": 16, "px": 64}
    folder = folder_of(tmp_path / "deep", {**view, "method": "fast", "deep_light_paths": 100000}, view)
    run_worker(folder)
    deep, path = (json.loads((folder / f"results/pictures/on-{i}.json").read_text())["mean"] for i in (1, 2))
    tables = (folder / "work/report/fast.tables").read_bytes()
    traced, edge, side, error = struct.unpack_from("<IIIf", tables, 120)
    assert (traced, edge, side) == (3, 12, 1) and 0 < error < 1
    assert all(abs(a - b) < 0.05 * b for a, b in zip(deep, path, strict=True))


def test_deep_light_belongs_to_the_fast_method(real):
    doc = {"sample": "s", "fibers": {"file": "a.hair"}, "pictures": [{"on": "flat", **VIEW, "deep_light": "cells"}], "fit": {"model": "two_lobe.v1"}}
    assert "method" in problem(real.post("/v1/jobs", json=doc), 422, "invalid", "pictures[0].deep_light")["detail"]


def test_paths_of_deep_light_need_its_table(real):
    for other in ({}, {"method": "dual"}, {"method": "fast", "deep_light": "cells"}, {"method": "fast", "visibility": "tables"}):
        view = {"on": "flat", **VIEW, "deep_light_paths": 100000}
        doc = {"sample": "s", "fibers": {"file": "a.hair"}, "pictures": [{**view, "method": "fast"}, {**view, **other}], "fit": {"model": "two_lobe.v1"}}
        said = problem(real.post("/v1/jobs", json=doc), 422, "invalid", "pictures[1].deep_light_paths")["detail"]
        assert (list(other)[-1] if other else "method") in said


def test_a_method_that_was_removed_says_so(real):
    doc = {"sample": "s", "fibers": {"file": "a.hair"}, "pictures": [{"on": "flat", **VIEW, "method": "corrected"}], "fit": {"model": "two_lobe.v1"}}
    assert "was removed" in problem(real.post("/v1/jobs", json=doc), 422, "invalid", "pictures[0].method")["detail"]


def test_visibility_belongs_to_the_fast_method(real):
    doc = {"sample": "s", "fibers": {"file": "a.hair"}, "pictures": [{"on": "flat", **VIEW, "visibility": "tables"}], "fit": {"model": "two_lobe.v1"}}
    assert "method" in problem(real.post("/v1/jobs", json=doc), 422, "invalid", "pictures[0].visibility")["detail"]
