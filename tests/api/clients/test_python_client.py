"""The Python package clients/python against a daemon: what programs do with it, broken connections, and its installation by pip."""
import http.server
import json
import os
import random
import select
import shutil
import subprocess
import sys
import threading

import pytest
from daemon_under_test import DOCUMENT, FILES, ROOT, Daemon, document, wait_until

PACKAGE = os.path.join(ROOT, "clients", "python")
sys.path.insert(0, PACKAGE)
import selvedge  # noqa: E402


@pytest.fixture
def sample(tmp_path):
    folder = tmp_path / "sample"
    folder.mkdir()
    for name, (_, data) in FILES.items():
        (folder / name).write_bytes(data)
    return write(folder, document("succeed"))


def write(folder, doc):
    (folder / "job.json").write_text(json.dumps(doc))
    return folder


def test_submit_wait_result_and_files(daemon, sample, tmp_path):
    client, states, progress = selvedge.Client(daemon.url), [], []
    job = client.submit(sample / "job.json", on_progress=progress.append)
    state = job.wait(states.append, timeout_s=60)
    assert state.state == "succeeded" and state.ended and states[-1] == state and str(state).startswith("succeeded")
    total = sum(len(data) for _, data in FILES.values())
    assert [p.phase for p in progress][0] == "checking" and progress[-1] == selvedge.Progress("uploading", "rows.csv", total, total)
    result = job.result()
    assert isinstance(result, selvedge.Result) and result.parameter("beta_R").value == 5.0 and result.raw["run"] == 1
    with pytest.raises(KeyError):
        result.parameter("beta_X")
    assert [f.path for f in job.results()] == ["empty.txt", "pictures/view.png", "result.json"]
    assert job.download_file("pictures/view.png", str(tmp_path / "one.png")) == str(tmp_path / "one.png")
    everything = job.download(str(tmp_path / "all"), progress.append)
    assert (tmp_path / "one.png").read_bytes() == (tmp_path / "all" / "pictures" / "view.png").read_bytes() != b""
    assert len(everything) == 3 and progress[-1].phase == "downloading" and progress[-1].n_done == progress[-1].n_total
    with pytest.raises(selvedge.Problem) as problem:
        job.download_file("no.txt", str(tmp_path / "no.txt"))
    assert problem.value.code == "not_found" and not os.path.exists(tmp_path / "no.txt.part")


def test_edit_filter_and_keys(daemon, sample):
    client = selvedge.Client(daemon.url)
    job = client.submit(document("fail"), str(sample), key="once")
    assert client.submit(document("fail"), str(sample), key="once", start=False).id == job.id
    with pytest.raises(selvedge.JobFailed, match="page 2 is cut off") as failure:
        job.wait()
    assert failure.value.job.error == selvedge.JobError("format", "volume.files", "cannot read volume 'scan.tif': page 2 is cut off")
    assert job.id in [j.id for j in client.jobs(state="failed")] and job.id in [j.id for j in client.jobs(sample="ake: fai")]
    assert job.id not in [j.id for j in client.jobs(state="succeeded")] and list(client.jobs(verdict="good")) == []

    def correct(doc):
        doc["sample"] = "fake: succeed"

    assert job.edit(correct).state == "draft" and job.document()["sample"] == "fake: succeed"

    def race(doc):
        daemon.put(f"/v1/jobs/{job.id}/document", json=dict(doc, sample="fake: other"))

    with pytest.raises(selvedge.Problem) as problem:
        job.edit(race)
    assert problem.value.status == 412 and problem.value.code == "precondition"
    job.edit(dict(DOCUMENT))
    job.start()
    assert job.wait().state == "succeeded"
    job.delete()
    with pytest.raises(selvedge.Problem):
        job.state()


def test_a_filter_holds_for_every_page(daemon_maker):
    """The list comes in pages of 100 jobs; the cancelled jobs are the oldest and the newest."""
    client = selvedge.Client(daemon_maker().url)
    cancelled = [client.create(DOCUMENT)]
    drafts = [client.create(DOCUMENT).id for _ in range(102)]
    cancelled.append(client.create(DOCUMENT))
    for job in cancelled:
        job.cancel()
    assert [j.id for j in client.jobs(state="draft")] == drafts[::-1]
    assert [j.id for j in client.jobs(state="cancelled")] == [cancelled[1].id, cancelled[0].id]
    assert [j.id for j in client.jobs()] == [cancelled[1].id, *drafts[::-1], cancelled[0].id]


def test_a_wait_that_takes_too_long(daemon, sample):
    job = selvedge.Client(daemon.url).submit(write(sample, document("work")) / "job.json")
    with pytest.raises(TimeoutError):
        job.wait(timeout_s=0.3)
    assert job.cancel().state in ("running", "cancelled")
    with pytest.raises(selvedge.JobFailed, match="cancelled"):
        job.wait()
    assert job.retry().state in ("queued", "running")
    job.delete()


def test_uploads_continue_through_kills_of_the_daemon(tmp_path, sample):
    """The client is given a port that stays the same; the daemon behind it dies twice in mid-upload."""
    data = random.Random(1).randbytes(30_000_000)
    (sample / "scan.tif").write_bytes(data)
    socket_path = str(tmp_path / "s")
    d = Daemon(tmp_path / "data", options={"server.unix_socket": socket_path, "upload.commit_bytes": 1 << 20, "upload.max_patch_bytes": 1 << 20})
    command = [*d.command(), "--port", "0"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    assert process.stdout.readline()
    kills = []

    def show(p):
        nonlocal process
        if p.phase == "uploading" and p.n_done > 8_000_000 * (len(kills) + 1) and len(kills) < 2:
            kills.append(p.n_done)
            process.kill()
            process.communicate()
            process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
            assert process.stdout.readline()

    try:
        client = selvedge.Client(f"unix:{socket_path}")
        job = client.submit(sample / "job.json", on_progress=show)
        assert len(kills) == 2 and job.wait(timeout_s=60).state == "succeeded"
        assert client.request("GET", f"/v1/jobs/{job.id}/files/scan.tif").read() == data
    finally:
        process.terminate()
        process.communicate()


def test_the_token_is_sent(monkeypatch):
    """To a server that writes down what it gets, because the daemon may run without tokens."""
    seen = []

    class Recorder(http.server.BaseHTTPRequestHandler):
        def do_GET(self):
            seen.append(self.headers.get("Authorization"))
            self.send_response(200)
            self.send_header("Content-Length", "2")
            self.end_headers()
            self.wfile.write(b"{}")

        def log_message(self, *unused):
            """Nothing is printed."""

    server = http.server.HTTPServer(("127.0.0.1", 0), Recorder)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    url = f"http://127.0.0.1:{server.server_port}"
    selvedge.Client(url, token="abc").about()
    monkeypatch.setenv("SELVEDGE_TOKEN", "def")
    selvedge.Client(url).about()
    server.shutdown()
    server.server_close()
    assert seen == ["Bearer abc", "Bearer def"]


def test_errors_have_types(monkeypatch):
    monkeypatch.setattr("selvedge.transport.MAX_TRY", 1)
    with pytest.raises(selvedge.Unreachable):
        selvedge.Client("unix:/nonexistent/socket").request("GET", "/livez", n_try=1)
    with pytest.raises(ValueError):
        selvedge.Client("ftp://somewhere")
    assert issubclass(selvedge.Problem, selvedge.SelvedgeError) and issubclass(selvedge.JobFailed, selvedge.SelvedgeError)


def test_a_client_is_shared_by_threads(daemon):
    client, ids = selvedge.Client(daemon.url), []

    def create():
        for _ in range(5):
            ids.append(client.create(DOCUMENT).id)

    threads = [threading.Thread(target=create) for _ in range(4)]
    for t in threads:
        t.start()
    for t in threads:
        t.join()
    assert len(set(ids)) == 20 and set(ids) <= {j.id for j in client.jobs()}


def test_an_idle_connection_that_the_server_has_closed(daemon_maker):
    d = daemon_maker(options={"server.idle_timeout_s": 1})
    client = selvedge.Client(d.url)
    job = client.create(DOCUMENT)
    sock = client.transport.own.connection.sock
    assert wait_until(lambda: select.select([sock], [], [], 0)[0])
    job.delete()  # is sent once only
    assert list(client.jobs()) == []


@pytest.mark.slow
def test_installation_by_pip(daemon, sample, tmp_path):
    venv = tmp_path / "venv"
    if subprocess.run(["/usr/bin/python3", "-m", "venv", venv], capture_output=True).returncode != 0:
        pytest.skip("python3-venv is not installed")
    copy = shutil.copytree(PACKAGE, tmp_path / "package", ignore=shutil.ignore_patterns("build", "*.egg-info", "__pycache__"))
    pip = subprocess.run([venv / "bin" / "pip", "install", "--disable-pip-version-check", copy], capture_output=True, text=True)
    if "No matching distribution" in pip.stderr or "Could not fetch" in pip.stderr:
        pytest.skip("pip cannot load setuptools: no network")
    assert pip.returncode == 0, pip.stderr
    program = ("import selvedge, sys\njob = selvedge.Client(sys.argv[1]).submit(sys.argv[2])\nprint(job.wait().state, selvedge.__file__, "
               "selvedge.__version__, job.result().parameter('beta_R').value)")
    run = subprocess.run([venv / "bin" / "python", "-I", "-c", program, daemon.url, str(sample / "job.json")], capture_output=True, text=True)
    state, path, version, value = run.stdout.split()
    assert (state, version, value) == ("succeeded", selvedge.__version__, "5.0") and path.startswith(str(venv))
    listed = subprocess.run([venv / "bin" / "pip", "show", "-f", "selvedge-client"], capture_output=True, text=True).stdout
    assert "selvedge/py.typed" in listed and "Requires: \n" in listed and f"Version: {version}" in listed
