"""Large tables: refusals cost little, and other requests are answered beside them."""
import os
import threading
import time

import pytest
from daemon_under_test import DOCUMENT, FILES, document, problem, sha256

PHOTOGRAPHS = [{"file": f"p{i}.exr", "camera_theta_deg": 10, "light_theta_deg": 30} for i in range(300)]


def cpu_s(pid):
    with open(f"/proc/{pid}/stat", encoding="ascii") as f:
        fields = f.read().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


@pytest.mark.parametrize("template, words", [
    (document(photographs=PHOTOGRAPHS), "more than 64 MiB together"),
    (dict(document(), volume={"files": [f"s{i}.tif" for i in range(1800)], "voxel_size_um": 2}), "more than 64 MiB together"),
    (document(colour="x" * 5000), "unknown field 'colour'"),
    (document(), "which its row does not have"),
])
def test_a_refusal_of_9000_rows_costs_little(daemon, template, words):
    before = cpu_s(daemon.process.pid)
    table = {"name": "dear", "template": template, "samples": [{"sample": f"{i}"} for i in range(9000)]}
    body = problem(daemon.post("/v1/batches", json=table), 422, "invalid")
    assert words in body["detail"] and len(body["errors"]) <= 100
    assert cpu_s(daemon.process.pid) - before < 3


def test_rows_do_not_change_each_other(daemon):
    """They share what they do not replace with the template."""
    template = document(fit={"seed": 1})
    rows = [{"sample": f"fake: succeed {i}", "replace": {"fit.seed": i, "volume.voxel_size_um": 1 + i} if i % 2 else {}, "files": []} for i in range(4)]
    files = [{"name": name, "size": 100, "sha256": "0" * 64} for name in ("scan.tif", "rows.csv")]
    table = {"name": "shared", "template": template, "samples": [dict(row, files=files) for row in rows]}
    made = daemon.post("/v1/batches", json=table)
    assert made.status_code == 201, made.text
    documents = [daemon.get(f"/v1/jobs/{one['job']}").json()["document"] for one in made.json()["samples"]]
    assert [d["fit"]["seed"] for d in documents] == [1, 1, 1, 3]
    assert [d["volume"]["voxel_size_um"] for d in documents] == [2.0, 2, 2.0, 4]
    assert made.json()["template"] == template


def test_other_requests_are_answered_beside_a_large_batch(daemon_maker):
    """The lock of all jobs is held for a small part of the time at once."""
    d = daemon_maker()
    d.ready_job()
    files = [{"name": name, "size": len(data), "sha256": sha256(data)} for name, (_, data) in FILES.items()]
    table = {"name": "large", "template": DOCUMENT, "samples": [{"sample": f"s{i}", "files": files} for i in range(2000)]}
    made, times = [], []

    def submit():
        start = time.monotonic()
        made.append(d.session.post(d.url + "/v1/batches", json=table, timeout=1500))
        made.append(time.monotonic() - start)
    thread = threading.Thread(target=submit)
    thread.start()
    while thread.is_alive():
        start = time.monotonic()
        assert d.of("").post("/v1/jobs", json=DOCUMENT).status_code == 201
        times.append(time.monotonic() - start)
    batch, took_s = made
    assert batch.status_code == 201 and batch.json()["n_sample"] == 2000
    assert max(times) < 0.15 * took_s, f"{max(times)} of {took_s} s"
    assert os.listdir(os.path.join(d.data, "new")) == []
    jobs = d.get(f"/v1/jobs?batch={batch.json()['id']}&limit=500").json()["jobs"]
    assert len(jobs) == 500 and all(d.get(f"/v1/jobs/{job['id']}").json()["missing_files"] == [] for job in jobs[::50])


def test_folders_of_a_batch_that_was_killed_are_removed(daemon_maker):
    d = daemon_maker()
    d.stop()
    os.makedirs(os.path.join(d.data, "new", "batch", "job", "input"))
    d.start()
    assert not os.path.exists(os.path.join(d.data, "new"))
