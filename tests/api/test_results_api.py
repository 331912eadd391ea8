"""Reading a job's series, log, results, archive and input files."""
import io
import json
import os
import tarfile
import zlib

import pytest
from daemon_under_test import FILES, problem


@pytest.fixture(scope="module")
def done(daemon):
    job = daemon.start_job("series 1000")
    daemon.wait_state(job, "succeeded")
    return job


def test_series_whole_and_incremental(daemon, done):
    whole = daemon.get(f"/v1/jobs/{done}/series?max_points=5000&rendered=all").json()
    assert [p["step"] for p in whole["points"]] == list(range(1000))
    assert whole["next_after_step"] == 999 and whole["n_step"] == 1000 and whole["generation"] == 1
    assert all("rendered" in p and "n_merged" not in p for p in whole["points"])
    some = daemon.get(f"/v1/jobs/{done}/series?after_step=989").json()
    assert [p["step"] for p in some["points"]] == list(range(990, 1000))
    assert ["rendered" in p for p in some["points"]] == [False] * 9 + [True]
    none = daemon.get(f"/v1/jobs/{done}/series?after_step=999").json()
    assert none["points"] == [] and none["next_after_step"] == 999
    r = daemon.get(f"/v1/jobs/{done}/series")
    assert daemon.get(f"/v1/jobs/{done}/series", headers={"If-None-Match": r.headers["ETag"]}).status_code == 304


@pytest.mark.parametrize("most", [2, 7, 100, 999])
def test_series_is_merged_with_extremes_kept(daemon, done, most):
    points = daemon.get(f"/v1/jobs/{done}/series?max_points={most}").json()["points"]
    truth = [(s * 37) % 101 + 0.5 for s in range(1000)]
    assert len(points) == most and points[-1]["step"] == 999
    assert min(p.get("objective_min", p["objective"]) for p in points) == min(truth)
    assert max(p.get("objective_max", p["objective"]) for p in points) == max(truth)
    assert sum(p.get("n_merged", 1) for p in points) == 1000
    third = [(s * 17) % 23 for s in range(1000)]
    assert max(p.get("parameter_max", p["parameter"])[2] for p in points) == max(third)
    first = -1
    for p in points:
        steps = range(first + 1, p["step"] + 1)
        if "n_merged" in p:
            assert p["n_merged"] == len(steps)
            assert p["objective_min"] == min(truth[s] for s in steps) and p["objective_max"] == max(truth[s] for s in steps)
        first = p["step"]


def test_series_with_a_torn_tail_and_bad_queries(daemon, done):
    path = os.path.join(daemon.data, "jobs", done, "series.rec")
    with open(path, "a") as f:
        f.write("deadbeef {\"step\":10")
    assert daemon.get(f"/v1/jobs/{done}/series").json()["n_step"] == 1000
    text = json.dumps({"step": "x"})
    with open(path, "r+") as f:
        f.seek(0, 2)
        f.truncate(f.tell() - len("deadbeef {\"step\":10"))
        f.seek(0, 2)
        f.write(f"{zlib.crc32(text.encode()):08x} {text}\n")
    assert daemon.get(f"/v1/jobs/{done}/series").json()["n_step"] == 1000
    for bad in ["after_step=-2", "max_points=1", "max_points=5001", "rendered=some", "after_step=x"]:
        problem(daemon.get(f"/v1/jobs/{done}/series?{bad}"), 422, "invalid", bad.split("=")[0])


N_ROW, SEARCH, STEPS = 300, 8, [500, 400]


def write_long_series(path):
    """Writes a search for the radius with the second model and then the fits of two models, with 300 rows in each
    record: 12 MB."""
    rows = ",".join(["[0.123456789,0.234567891,0.345678912]"] * N_ROW)
    with open(path, "w") as f:
        for step in range(SEARCH + sum(STEPS)):
            fit = step - SEARCH
            model = 1 if fit < 0 or fit >= STEPS[0] else 0
            begins = fit in (0, STEPS[0]) or step == 0
            described = f',"parameters":[{{"name":"p","unit":"","lower":{model},"upper":9,"fixed":false}}]' if begins else ""
            parameter = ",".join(["0.5"] * (3 + model))
            text = (f'{{"step":{step},"model":"m{model}","i_model":{model},"phase":"{"radius" if fit < 0 else "gauss_newton"}","objective":{step % 97}.5,'
                    f'"parameter":[{parameter}],"rendered":[{rows}],"n_path_row":[{",".join(["4096"] * N_ROW)}]{described}}}')
            f.write(f"{zlib.crc32(text.encode()):08x} {text}\n")


def process_number(pid, file, name):
    with open(f"/proc/{pid}/{file}") as f:
        return next(int(line.split()[1]) for line in f if line.startswith(name + ":"))


def test_long_series_costs_what_it_answers(daemon_maker):
    d = daemon_maker()
    job = d.start_job("series 3")
    d.wait_state(job, "succeeded")
    path = os.path.join(d.data, "jobs", job, "series.rec")
    write_long_series(path)
    n = SEARCH + sum(STEPS)
    pid = d.process.pid

    def ask(query):
        before = process_number(pid, "io", "rchar")
        r = d.get(f"/v1/jobs/{job}/series?{query}")
        assert r.status_code == 200, r.text
        return r.json(), process_number(pid, "io", "rchar") - before

    peak = process_number(pid, "status", "VmHWM")
    whole, _ = ask("max_points=5000")
    assert [p["step"] for p in whole["points"]] == list(range(n)) and whole["n_step"] == n
    assert [m["id"] for m in whole["models"]] == ["m0", "m1"] and [m["parameters"][0]["lower"] for m in whole["models"]] == [0, 1]
    assert ["rendered" in p or "n_path_row" in p for p in whole["points"]] == [False] * (n - 1) + [True]
    few, _ = ask("max_points=11")
    assert len(few["points"]) == 11 and few["models"] == whole["models"]
    # kB; the file alone has 12 MB, and its parsed records ten times as much
    if not os.environ.get("SELVEDGE_SANITIZED"):  # the address sanitizer keeps freed memory for a while
        assert process_number(pid, "status", "VmHWM") - peak < 8 << 10
    for after in [0, 7, 8, 450, 507, 508, 850]:
        some, _ = ask(f"after_step={after}&max_points=5000")
        assert some["points"] == whole["points"][after + 1:] and some["models"] == whole["models"], after
        assert some["n_step"] == n and some["next_after_step"] == n - 1
    for after in [n - 2, n - 1, n + 50]:
        some, cost = ask(f"after_step={after}")
        assert len(some["points"]) == max(0, n - 1 - after) and some["n_step"] == n and some["models"] == whole["models"]
        assert cost < 1.5e6, (after, cost)
    every, _ = ask("max_points=5000&rendered=all&after_step=100")
    assert all("rendered" in p for p in every["points"]) and 500 < len(every["points"]) < n - 101 == sum(p.get("n_merged", 1) for p in every["points"])
    with open(path, "r+") as f:
        f.truncate(9_000_000)  # as a resumed worker does, but in the middle of a record
    cut = ask("max_points=5000")[0]
    assert 0 < cut["n_step"] < n and cut["points"][:-1] == whole["points"][:cut["n_step"] - 1]
    os.truncate(path, 60_000)
    assert [m["id"] for m in ask("")[0]["models"]] == []  # the search's second model is not listed as the first


def test_the_result_of_a_large_job_is_apart_from_its_view(daemon):
    """A table of thousands of rows in several models makes a result of about 14 MB."""
    job = daemon.start_job("succeed")
    daemon.wait_state(job, "succeeded")
    path = os.path.join(daemon.data, "jobs", job, "results", "result.json")
    with open(path) as f:
        result = json.load(f)
    result["rows"] = ["x" * 100] * 140_000
    with open(path, "w") as f:
        json.dump(result, f)
    view = daemon.job(job)
    assert view["result_url"] == f"/v1/jobs/{job}/results/result.json"
    assert view["result"] == result and view["parameters"] == result["parameters"]
    polled = daemon.get(f"/v1/jobs/{job}")
    assert len(polled.content) < 20_000
    assert daemon.get(f"/v1/jobs/{job}", headers={"If-None-Match": polled.headers["ETag"]}).status_code == 304
    os.utime(path)
    assert daemon.get(f"/v1/jobs/{job}", headers={"If-None-Match": polled.headers["ETag"]}).status_code == 200, "the result has changed"


def test_a_job_without_output_has_empty_answers(daemon):
    job = daemon.create()
    assert daemon.get(f"/v1/jobs/{job}/series").json()["points"] == []
    assert daemon.get(f"/v1/jobs/{job}/results").json()["files"] == []
    log = daemon.get(f"/v1/jobs/{job}/log?offset=77")
    assert log.text == "" and log.headers["Selvedge-Next-Offset"] == "0"
    archive = daemon.get(f"/v1/jobs/{job}/results.tar")
    assert archive.status_code == 200 and tarfile.open(fileobj=io.BytesIO(archive.content)).getnames() == []


def test_log_by_offset(daemon, done):
    path = os.path.join(daemon.data, "jobs", done, "log.txt")
    with open(path, "a") as f:
        f.write("".join(f"line {i}\n" for i in range(1000)))
    whole = open(path).read()
    seen, offset = "", 0
    while True:
        r = daemon.get(f"/v1/jobs/{done}/log?offset={offset}&max_bytes=1000")
        assert r.headers["Content-Type"].startswith("text/plain") and int(r.headers["Selvedge-Log-Size"]) == len(whole)
        if not r.text:
            break
        seen += r.text
        offset = int(r.headers["Selvedge-Next-Offset"])
    assert seen == whole
    assert daemon.get(f"/v1/jobs/{done}/log?offset=-9").text == whole[-9:]
    assert daemon.get(f"/v1/jobs/{done}/log?offset=999999999&max_bytes=5").text == whole[:5]
    for bad in ["offset=x", "max_bytes=0", "max_bytes=1048577"]:
        problem(daemon.get(f"/v1/jobs/{done}/log?{bad}"), 422, "invalid", bad.split("=")[0])


def test_result_list_and_files(daemon, done):
    folder = os.path.join(daemon.data, "jobs", done, "results")
    os.symlink("/etc/passwd", os.path.join(folder, "link.txt"))
    os.symlink("/etc", os.path.join(folder, "linked"))
    open(os.path.join(folder, "x.tmp-AbCdEf"), "w").close()
    open(os.path.join(folder, "odd name"), "w").close()
    listing = daemon.get(f"/v1/jobs/{done}/results").json()
    assert [f["path"] for f in listing["files"]] == ["empty.txt", "pictures/view.png", "result.json"]
    for f in listing["files"]:
        r = daemon.get(f["url"])
        assert r.status_code == 200 and len(r.content) == f["size"] and r.headers["Content-Type"] == f["content_type"]
    archive = tarfile.open(fileobj=io.BytesIO(daemon.get(listing["archive"]).content))
    assert archive.getnames() == ["empty.txt", "pictures/view.png", "result.json"]
    assert archive.extractfile("pictures/view.png").read() == b"not really a picture " * 100


def test_big_archive_is_streamed_whole(daemon, done):
    folder = os.path.join(daemon.data, "jobs", done, "results")
    big = os.urandom(20_000_000)
    with open(os.path.join(folder, "volume.vol"), "wb") as f:
        f.write(big)
    archive = tarfile.open(fileobj=io.BytesIO(daemon.get(f"/v1/jobs/{done}/results.tar").content))
    assert archive.extractfile("volume.vol").read() == big
    os.remove(os.path.join(folder, "volume.vol"))


@pytest.mark.parametrize("path", ["../job.json", "..%2fjob.json", "%2e%2e/job.json", "pictures/../../job.json", "pictures//view.png", "/etc/passwd",
                                  "pictures", "pictures/", "link.txt", "linked/passwd", ".", "..", "result.json%00", "result.json%00.png", "x.tmp-AbCdEf",
                                  "result.json/x", "a" * 600, "a/" * 50 + "b"])
def test_only_listed_paths_are_served(daemon, done, path):
    # http.client sends the path unchanged; requests would normalise it
    import http.client
    c = http.client.HTTPConnection("127.0.0.1", daemon.port)
    c.request("GET", f"/v1/jobs/{done}/results/{path}")
    assert c.getresponse().status == 404
    for base in (f"/v1/jobs/{done}/files/", "/", "/vendor/"):
        if base == "/" and path in (".", ".."):
            continue
        c = http.client.HTTPConnection("127.0.0.1", daemon.port)
        c.request("GET", base + path)
        assert c.getresponse().status == 404, base + path


@pytest.mark.parametrize("which", ["result", "input"])
def test_ranges(daemon, done, which):
    url = f"/v1/jobs/{done}/results/pictures/view.png" if which == "result" else f"/v1/jobs/{done}/files/scan.tif"
    whole = b"not really a picture " * 100 if which == "result" else FILES["scan.tif"][1]
    n = len(whole)
    r = daemon.get(url)
    tag = r.headers["ETag"]
    assert r.status_code == 200 and r.content == whole and r.headers["Accept-Ranges"] == "bytes" and not tag.startswith("W/")
    for header, start, end in [("bytes=0-0", 0, 1), ("bytes=10-19", 10, 20), ("bytes=5-", 5, n), ("bytes=-7", n - 7, n), (f"bytes=0-{n * 9}", 0, n),
                               (f"bytes=-{n * 9}", 0, n), (f"bytes={n - 1}-", n - 1, n)]:
        r = daemon.get(url, headers={"Range": header})
        assert r.status_code == 206 and r.content == whole[start:end], header
        assert r.headers["Content-Range"] == f"bytes {start}-{end - 1}/{n}"
    for header in [f"bytes={n}-", "bytes=-0"]:
        r = daemon.get(url, headers={"Range": header})
        problem(r, 416, "range")
        assert r.headers["Content-Range"] == f"bytes */{n}"
    for header in ["bytes=a-b", "bytes=5-4", "lines=1-2", "bytes=0-1,3-4", "bytes=", "bytes=--5", "bytes=1-2-3", "bytes=99999999999999999999-"]:
        assert daemon.get(url, headers={"Range": header}).status_code == 200, header
    assert daemon.get(url, headers={"Range": "bytes=0-4", "If-Range": tag}).status_code == 206
    assert daemon.get(url, headers={"Range": "bytes=0-4", "If-Range": '"other"'}).status_code == 200
    assert daemon.get(url, headers={"If-None-Match": tag}).status_code == 304
    head = daemon.request("HEAD", url)
    assert head.headers["Content-Length"] == str(n) and head.content == b""
