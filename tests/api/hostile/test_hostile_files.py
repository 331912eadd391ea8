"""A worker that was taken over writes every file of its job as it likes. The daemon answers each request soon, in little memory
and truthfully, and goes on."""
import os

import pytest
from daemon_under_test import ROOT, Daemon, sha256, wait_until

HOSTILE = os.path.join(ROOT, "tests", "api", "hostile", "hostile_worker.py")


SCAN, ROWS = b"II*\0 a scan", b"set,r,g,b\n"
LONG_S, MUCH_BYTES = 5, 96 << 20
PATHS = ("", "/series", "/series?rendered=all&max_points=5000", "/series?after_step=3", "/log", "/log?offset=-100", "/results", "/results.tar",
         "/results/result.json", "/results/report.json", "/versions", "/versions/1", "/versions/1/result.json", "/files", "/files/scan.tif")


def hostile_document(act):
    return {"sample": f"hostile: {act}", "volume": {"files": ["scan.tif"], "voxel_size_um": 2.0}, "measurements": {"file": "rows.csv"}}


@pytest.fixture(scope="module")
def attacked(tmp_path_factory):
    with Daemon(tmp_path_factory.mktemp("attacked") / "data", worker=HOSTILE) as d:
        yield d


def start_hostile(d, act):
    job = d.create(hostile_document(act))
    d.upload(job, "scan.tif", SCAN)
    d.upload(job, "rows.csv", ROWS, "measurements")
    assert d.post(f"/v1/jobs/{job}/start").status_code == 202
    return job


def batch_of_one(d, act):
    """The batch and its job."""
    d.upload(d.create(), "scan.tif", SCAN)
    d.upload(d.create(), "rows.csv", ROWS, "measurements")
    files = [{"name": name, "size": len(data), "sha256": sha256(data)} for name, data in (("scan.tif", SCAN), ("rows.csv", ROWS))]
    made = d.post("/v1/batches", json={"name": act, "template": hostile_document(act), "samples": [{"sample": f"hostile: {act}", "files": files}]})
    assert made.status_code == 201, made.text
    batch = made.json()
    assert d.post(f"/v1/batches/{batch['id']}/start").status_code == 202
    return batch["id"], batch["samples"][0]["job"]


def peak_bytes(d):
    with open(f"/proc/{d.process.pid}/status") as f:
        return 1024 * next(int(line.split()[1]) for line in f if line.startswith("VmHWM"))


def core_seconds(d):
    """Processor time of the daemon, which does not grow when the machine has other work."""
    with open(f"/proc/{d.process.pid}/stat") as f:
        user, system = f.read().rpartition(")")[2].split()[11:13]
    return (int(user) + int(system)) / os.sysconf("SC_CLK_TCK")


class Watched:
    """Requests that must be answered with little work, in little memory, and not with an error of the server."""

    def __init__(self, d):
        self.d = d
        with open(f"/proc/{d.process.pid}/clear_refs", "w") as f:
            f.write("5")  # the peak begins anew
        self.before = peak_bytes(d)

    def __call__(self, method, path, **more):
        start = core_seconds(self.d)
        reply = self.d.request(method, path, **more)
        took_s, grown = core_seconds(self.d) - start, peak_bytes(self.d) - self.before
        assert reply.status_code < 500, f"{method} {path}: {reply.status_code} {reply.text[:500]}"
        assert took_s < LONG_S, f"{method} {path} took {took_s:.1f} s of a core"
        assert grown < MUCH_BYTES, f"{method} {path}: the daemon grew by {grown / 1e6:.0f} MB"
        return reply


@pytest.mark.parametrize("act", [
    "huge_report", "huge_json 12000000", "deep_json 1000", "deep_json 100000", "wrong_types", "long_line 1500000000", "long_record 7000000",
    "many_records 30000", "deep_record 100000", "damaged_lines 2000000", "pipes", "links", "devices", "folders", "linked_folders", "many_files 21000"])
def test_whatever_a_worker_leaves_is_answered(attacked, tmp_path, act):
    d, outside = attacked, tmp_path / "outside"
    outside.mkdir()
    for name in ("result.json", "scan.tif", "precious"):
        (outside / name).write_text('{"planted": 1}')
    batch, job = batch_of_one(d, act + (f" {outside}" if act == "linked_folders" else ""))
    ask = Watched(d)
    url = f"/v1/jobs/{job}"
    wait_until(lambda: d.get(f"/v1/batches/{batch}").json()["states"]["succeeded"], 60, "the end of the job")
    for path in PATHS:
        reply = ask("GET", url + path)
        assert b"planted" not in reply.content, f"{path} gives a foreign file away"
    for path in ("/v1/jobs", f"/v1/batches/{batch}", f"/v1/batches/{batch}/results.json", f"/v1/batches/{batch}/results.csv", "/metrics"):
        ask("GET", path)
    # it is edited and runs again, the result of the first run is kept as far as it is one, and everything is removed
    assert ask("PUT", url + "/document", json=hostile_document("pages")).status_code == 200
    assert ask("POST", url + "/start").status_code == 202
    again = d.wait_state(job, "succeeded", "failed")
    assert again["state"] == "succeeded", again["error"]
    for path in PATHS:
        ask("GET", url + path)
    assert ask("DELETE", url).status_code == 204
    wait_until(lambda: not os.path.exists(os.path.join(d.data, "jobs", job)), what="the end of its folder")
    assert sorted(os.listdir(outside)) == ["precious", "result.json", "scan.tif"]


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
