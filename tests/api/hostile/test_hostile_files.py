"""A worker that was taken over writes every file of its job as it likes. The daemon answers each request soon, in little memory
and truthfully, and goes on."""
import os

import pytest
from daemon_under_test import ROOT, Daemon

HOSTILE = os.path.join(ROOT, "tests", "api", "hostile", "hostile_worker.py")


def hostile_document(act):
    return {"sample": f"hostile: {act}", "volume": {"files": ["scan.tif"], "voxel_size_um": 2.0}, "measurements": {"file": "rows.csv"}}


@pytest.fixture(scope="module")
def attacked(tmp_path_factory):
    with Daemon(tmp_path_factory.mktemp("attacked") / "data", worker=HOSTILE) as d:
        yield d


def start_hostile(d, act):
    job = d.create(hostile_document(act))
    d.upload(job, "scan.tif", b"II*\0 a scan")
    d.upload(job, "rows.csv", b"set,r,g,b\n", "measurements")
    assert d.post(f"/v1/jobs/{job}/start").status_code == 202
    return job


def test_every_file_of_a_job_is_sandboxed_whatever_its_type(attacked):
    """In each of its answers, because a browser takes over the headers of a 304."""
    job = start_hostile(attacked, "pages")
    attacked.wait_state(job, "succeeded")
    names = [f"results/{name}" for name in ("evil.svg", "evil.html", "evil.xhtml", "evil.js", "page.css", "result.json")]
    for path in [*names, "files/scan.tif", "files/rows.csv", "results.tar", "log", "results/none.svg", "versions/1/evil.svg", "versions/1/evil.html"]:
        url = f"/v1/jobs/{job}/{path}"
        first = attacked.get(url)
        tag = first.headers.get("ETag", '"none"')
        for reply in (first, attacked.get(url, headers={"If-None-Match": tag}), attacked.get(url, headers={"Range": "bytes=0-3"}),
                      attacked.get(url, headers={"Range": "bytes=99999999-"})):
            policy = reply.headers["Content-Security-Policy"]
            assert policy.split(";")[0] == ("sandbox allow-same-origin" if path.endswith(".html") else "sandbox"), (path, reply.status_code, policy)
            assert "default-src 'none'" in policy and "script" not in policy and "," not in policy
            assert reply.headers["X-Content-Type-Options"] == "nosniff"
