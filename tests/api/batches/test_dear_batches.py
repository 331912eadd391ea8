"""Large tables: refusals cost little, and other requests are answered beside them."""
import os

import pytest
from daemon_under_test import document, problem

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
