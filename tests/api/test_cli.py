"""The command line client and the Python client with a real daemon. The worker is a stub that computes nothing."""
import json
import os
import pty
import select
import shutil
import socket
import subprocess
import sys
import threading
import time
import urllib.request

import pytest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
BUILD = os.environ.get("SELVEDGE_BUILD") or os.path.join(ROOT, "build")
CLI = os.path.join(BUILD, "bin", "selvedge")
STUB = os.path.join(ROOT, "tests", "support", "python", "client_stub_worker.py")
sys.path.insert(0, os.path.join(ROOT, "clients", "python"))
import selvedge  # noqa: E402


class Daemon:
    def __init__(self, folder, *more):
        self.folder = str(folder)
        self.process = subprocess.Popen([os.path.join(BUILD, "bin", "selvedged"), "--data", str(folder), "--port", "0", "--worker", STUB,
                                         "--set", "disk.floor_bytes=0", "--set", "jobs.pictures=0", *more],
                                        stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        line = self.process.stdout.readline()
        assert "listens on http://" in line, line
        self.url = line.split()[-1]
        self.port = int(self.url.rsplit(":", 1)[1])

    def stop(self):
        self.process.terminate()
        self.process.wait(20)
        self.process.stdout.close()


class CuttingProxy:
    """Forwards connections to a port. Those whose number is in `cuts` are broken after that many bytes from the client,
    or with `replies` to it."""

    def __init__(self, port, cuts, replies=False):
        self.port, self.cuts, self.replies, self.n = port, list(cuts), replies, 0
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.url = f"http://127.0.0.1:{self.listener.getsockname()[1]}"
        threading.Thread(target=self.accept, daemon=True).start()

    def accept(self):
        while True:
            try:
                client, _ = self.listener.accept()
            except OSError:
                return
            limit = self.cuts[self.n] if self.n < len(self.cuts) else None
            self.n += 1
            threading.Thread(target=self.forward, args=(client, limit), daemon=True).start()

    def forward(self, client, limit):
        server = socket.create_connection(("127.0.0.1", self.port))
        n, open_ends = 0, [client, server]
        try:
            while True:
                for end in select.select(open_ends, [], [])[0]:
                    data = end.recv(65536)
                    if not data:
                        return
                    if (end is server) == self.replies:
                        n += len(data)
                    if end is client:
                        data = data.replace(f"Host: {self.url[7:]}".encode(), f"Host: 127.0.0.1:{self.port}".encode())
                    (server if end is client else client).sendall(data)
                    if limit is not None and n > limit:
                        return
        except OSError:
            return
        finally:
            client.close()
            server.close()

    def stop(self):
        self.listener.close()


@pytest.fixture(scope="module")
def daemon(tmp_path_factory):
    d = Daemon(tmp_path_factory.mktemp("data"))
    yield d
    d.stop()


@pytest.fixture
def sample(tmp_path):
    """A folder with a job document and the files that it names."""
    folder = tmp_path / "sample"
    folder.mkdir()
    (folder / "scan.tif").write_bytes(os.urandom(3_000_000))
    (folder / "cloth.csv").write_text("set,light_theta_deg\n")
    write_document(folder, "quick twill")
    return folder


def write_document(folder, name, **more):
    document = {"sample": name, "volume": {"files": ["scan.tif"], "voxel_size_um": 2.0}, "measurements": {"file": "cloth.csv"}, **more}
    (folder / "job.json").write_text(json.dumps(document))


def run(url, *words, expect=0, cwd=None):
    done = subprocess.run([CLI, *map(str, words)], env=dict(os.environ, SELVEDGE_SERVER=url, SELVEDGE_TOKEN=""), stdin=subprocess.DEVNULL,
                          stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, timeout=600, cwd=cwd)
    assert done.returncode == expect, f"{words}: exit {done.returncode}\n{done.stdout}\n{done.stderr}"
    return done


def test_from_submit_to_results(daemon, sample, tmp_path):
    done = run(daemon.url, "submit", sample / "job.json", "--watch")
    job_id = done.stdout.splitlines()[0]
    assert "2 files in place" in done.stderr and "fit (6/8)" in done.stderr and "squared errors" in done.stderr
    assert "C_TT.r" in done.stdout and "+- 0.010" in done.stdout and "not determined" in done.stdout
    assert "gamma_TT" in next(line for line in done.stdout.splitlines() if "at upper bound" in line)
    assert "held out: 3 %" in done.stdout
    assert "\x1b" not in done.stderr  # no escape sequences outside a terminal
    out = tmp_path / "results"
    told = run(daemon.url, "results", job_id, "--out", out).stderr
    assert f"{len([f for f in out.rglob('*') if f.is_file()])} of them new" in told
    assert (out / "renderings" / "fit-00.bin").read_bytes() == bytes(range(256)) * 400
    assert json.loads((out / "result.json").read_text())["converged"] is True
    assert "0 of them new" in run(daemon.url, "results", job_id, "--out", out).stderr
    assert job_id in run(daemon.url, "list").stdout
    assert json.loads(run(daemon.url, "status", job_id, "--json").stdout)["state"] == "succeeded"
    assert run(daemon.url, "log", job_id).stdout.count("stage ") == 8
    assert run(daemon.url, "log", job_id, "-f").stdout.count("stage ") == 8
    with urllib.request.urlopen(f"{daemon.url}/v1/jobs/{job_id}") as answer:
        job = json.load(answer)
    with urllib.request.urlopen(daemon.url + job["result_url"]) as answer:
        result = json.load(answer)
    shown = json.loads(run(daemon.url, "status", job_id, "--json").stdout)
    assert shown == {**job, "result": result, "parameters": result["parameters"]}, "digits are lost"
    rows = run(daemon.url, "series", job_id).stdout.splitlines()
    assert len(rows) == 11 and rows[0].startswith("step\t")
    assert len(json.loads(run(daemon.url, "series", job_id, "--json").stdout)) == 10
    run(daemon.url, "delete", job_id)
    assert "does not exist" in run(daemon.url, "status", job_id, expect=1).stderr


def test_failed_job_names_its_field(daemon, sample):
    write_document(sample, "failing twill")
    done = run(daemon.url, "submit", sample / "job.json", "--watch", expect=1)
    assert "error: volume.files: job" in done.stderr and "page 2 is 8-bit" in done.stderr
    job_id = done.stdout.splitlines()[0]
    assert "page 2 is 8-bit" in run(daemon.url, "status", job_id).stdout
    # replace the scan and continue with the same job: only the changed file is sent again
    (sample / "scan.tif").write_bytes(b"another scan")
    write_document(sample, "repaired twill")
    again = run(daemon.url, "submit", "--resume", job_id, sample / "job.json", "--watch")
    assert "1 uploaded now" in again.stderr and again.stdout.splitlines()[0] == job_id


def test_cancel_and_retry(daemon, sample):
    write_document(sample, "slow twill")
    job_id = run(daemon.url, "submit", sample / "job.json", "--id-file", sample / "id").stdout.strip()
    assert (sample / "id").read_text() == job_id + "\n"
    watcher = subprocess.Popen([CLI, "--server", daemon.url, "watch", job_id], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    for _ in range(100):
        if json.loads(run(daemon.url, "status", job_id, "--json").stdout)["state"] == "running":
            break
        time.sleep(0.1)
    run(daemon.url, "cancel", job_id)
    _, text = watcher.communicate(timeout=150)
    assert watcher.returncode == 3 and "was cancelled" in text
    run(daemon.url, "retry", job_id)
    assert json.loads(run(daemon.url, "status", job_id, "--json").stdout)["state"] in ("queued", "running")
    run(daemon.url, "cancel", job_id)


def test_errors_before_anything_is_created(daemon, sample):
    before = [j["id"] for j in json.loads(run(daemon.url, "list", "--json").stdout)]
    (sample / "cloth.csv").unlink()
    assert "cloth.csv' does not exist" in run(daemon.url, "submit", sample / "job.json", expect=1).stderr
    (sample / "cloth.csv").write_text("")
    assert "is empty" in run(daemon.url, "submit", sample / "job.json", expect=1).stderr
    (sample / "cloth.csv").write_text("x")
    write_document(sample, "twill", fit={"model": "three_lobe"})
    assert "error: " in (text := run(daemon.url, "submit", sample / "job.json", expect=1).stderr) and "fit.model" in text
    (sample / "job.json").write_text('{\n  "sample": oops\n}')
    assert "line 2" in run(daemon.url, "submit", sample / "job.json", expect=1).stderr
    assert "cannot read the job document" in run(daemon.url, "submit", sample / "none.json", expect=1).stderr
    assert [j["id"] for j in json.loads(run(daemon.url, "list", "--json").stdout)] == before


def test_exit_status_by_verdict(daemon, sample):
    order = {"good": "good", "undetermined": "good_but_undetermined", "pictures": "pictures_only", "bad": None, "quick": None}
    asked = ["good", "good_but_undetermined", "pictures_only", "usable"]  # the last one is the old word for the third
    for i, (word, code) in enumerate(order.items()):
        write_document(sample, f"{word} twill")
        job_id = run(daemon.url, "submit", sample / "job.json", "--watch").stdout.splitlines()[0]
        assert (job := json.loads(run(daemon.url, "status", job_id, "--json").stdout)["verdict"]) is None or code in (None, job["code"])
        for k, least in enumerate(asked):
            enough = code is not None and i <= k
            text = run(daemon.url, "watch", job_id, "--require", least, expect=0 if enough else 4).stderr
            assert enough or f"worse than '{least}'" in text
    for word in ("best", "none", "does_not_describe_this_cloth"):
        assert "allowed are good, good_but_undetermined and pictures_only" in run(daemon.url, "watch", job_id, "--require", word, expect=2).stderr
    assert "needs --watch" in run(daemon.url, "submit", sample / "job.json", "--require", "good", expect=2).stderr


def test_files_in_place_of_a_document(sample):
    for name, said in {"scan.tif": "`selvedge reconstruct FILE`", "cloth.csv": "'measurements.file'"}.items():
        for command in ("check", "submit"):
            assert said in run("http://127.0.0.1:1", command, sample / name, expect=1).stderr
    assert "is a folder" in run("http://127.0.0.1:1", "check", sample, expect=1).stderr
    (sample / "empty.json").write_text("")
    assert "is empty" in run("http://127.0.0.1:1", "check", sample / "empty.json", expect=1).stderr
    (sample / "list.json").write_text("[]")
    assert "does not begin with {" in run("http://127.0.0.1:1", "check", sample / "list.json", expect=1).stderr


def test_help_of_every_command():
    listed = run("http://x", "help").stdout
    names = [line.split()[0] for line in listed.split("commands:\n")[1].split("\n\n")[0].splitlines()]
    assert {"submit", "doctor", "photo", "bowl"} < set(names)
    for name in names:
        assert name in run("http://x", "help", name).stdout
    assert "did you mean 'photo'" in run("http://x", "foto", expect=2).stderr


def test_server_not_reachable():
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
    text = run(f"http://127.0.0.1:{port}", "list", expect=1).stderr
    assert "cannot reach the server" in text and "selvedged" in text
    assert "did you mean 'submit'" in run("http://x", "sumbit", expect=2).stderr


def test_not_a_selvedge_server(tmp_path):
    server = subprocess.Popen([sys.executable, "-m", "http.server", "--bind", "127.0.0.1", "--directory", str(tmp_path), "0"],
                              stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, env=dict(os.environ, PYTHONUNBUFFERED="1"))
    try:
        port = server.stdout.readline().split("port ")[1].split()[0]
        text = run(f"http://127.0.0.1:{port}", "list", expect=1).stderr
        assert "error: the server replied with HTTP status 404 and no explanation" in text
    finally:
        server.terminate()
        server.wait(10)
        server.stdout.close()


def test_upload_goes_on_after_broken_connections(daemon, sample):
    """The first connections break in the middle of the scan. The client asks for the offset and continues."""
    (sample / "cloth.csv").write_text(f"set,{time.time()}\n")  # the server does not have it yet
    proxy = CuttingProxy(daemon.port, [500_000, 700_000, 400, 900_000])
    try:
        done = run(proxy.url, "submit", sample / "job.json", "--watch")
    finally:
        proxy.stop()
    assert proxy.n >= 5
    assert "2 uploaded now" in done.stderr and "succeeded" in done.stderr


def test_pieces_are_no_larger_than_the_server_takes(sample, tmp_path):
    d = Daemon(tmp_path / "small-pieces", "--set", f"upload.max_patch_bytes={1 << 20}")
    try:
        assert "2 uploaded now" in run(d.url, "submit", sample / "job.json").stderr
        assert selvedge.Client(d.url).submit(str(sample / "job.json")).state().raw["files"][0]["state"] == "complete"
    finally:
        d.stop()


def test_interrupted_submit_is_continued(daemon, sample):
    """A submit is killed in the middle of the upload. --resume needs only the id if the files are in the current
    folder."""
    (sample / "scan.tif").write_bytes(os.urandom(40_000_000))
    client = subprocess.Popen([CLI, "--server", daemon.url, "submit", str(sample / "job.json")], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    job_id = client.stderr.readline().split()[1]
    server = selvedge.Client(daemon.url)
    for _ in range(2000):
        files = server.job(job_id).state().raw["files"]
        if files and files[0]["offset"] > 0:
            break
    client.kill()
    client.communicate()
    state = server.job(job_id).state()
    assert state.state in ("draft", "queued", "running")
    done = run(daemon.url, "submit", "--resume", job_id, "--watch", cwd=sample)
    assert done.stdout.splitlines()[0] == job_id and "2 files in place" in done.stderr


def test_interrupt_says_how_to_continue(daemon, sample):
    write_document(sample, "slow twill")
    client = subprocess.Popen([CLI, "--server", daemon.url, "submit", "--watch", str(sample / "job.json")], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                              text=True)
    job_id = client.stdout.readline().strip()
    time.sleep(0.5)
    client.send_signal(2)
    _, text = client.communicate(timeout=100)
    assert client.returncode == 130 and f"selvedge cancel {job_id}" in text
    run(daemon.url, "cancel", job_id)


def test_live_line_in_a_terminal(daemon, sample):
    """In a terminal one line is redrawn in place and cleared at the end."""
    parent, child = pty.openpty()
    client = subprocess.Popen([CLI, "--server", daemon.url, "submit", "--watch", str(sample / "job.json")], stdout=subprocess.PIPE, stderr=child, text=True)
    os.close(child)
    screen = b""
    while True:
        try:
            piece = os.read(parent, 4096)
        except OSError:
            break
        if not piece:
            break
        screen += piece
    client.communicate(timeout=300)
    os.close(parent)
    assert client.returncode == 0
    assert b"\r\x1b[K[#" in screen and b"ETA" in screen
    drawn = [part for line in screen.replace(b"\r\n", b"\n").split(b"\n") for part in line.split(b"\r\x1b[K") if b" ETA " in part]
    assert len(drawn) > 2 and all(len(part) < 80 for part in drawn)  # a line that wraps cannot be redrawn


def test_a_large_result_that_changed_since_its_download_broke_off(daemon, sample, tmp_path):
    """The downloaded first piece is of the old file, so the whole new file is downloaded, in pieces."""
    job_id = run(daemon.url, "submit", sample / "job.json", "--watch").stdout.split()[0]
    large = os.path.join(daemon.folder, "jobs", job_id, "results", "large.bin")
    with open(large, "wb") as f:
        f.truncate(70 << 20)
        f.write(b"new")
    out = tmp_path / "results"
    os.makedirs(out)
    (out / "large.bin.part").write_bytes(b"old" * 1000)
    (out / "large.bin.part.etag").write_text('"of-the-old-file"')
    run(daemon.url, "results", job_id, "--out", out)
    assert os.path.getsize(out / "large.bin") == 70 << 20
    with open(out / "large.bin", "rb") as f:
        assert f.read(3) == b"new" and not any(f.read())
    assert not [name for name in os.listdir(out) if ".part" in name]


def test_python_client(daemon, sample, tmp_path):
    server = selvedge.Client(daemon.url)
    seen = []
    job = server.submit(str(sample / "job.json"))
    state = job.wait(seen.append)
    assert state.state == "succeeded" and len(seen) > 2
    assert [p.name for p in job.result().parameters][:2] == ["C_R.r", "C_R.g"]
    assert [p["step"] for p in job.series()] == list(range(10))
    assert job.log().count("stage ") == 8
    assert any(j.id == job.id for j in server.jobs())
    paths = job.download(str(tmp_path / "out"))
    assert any(p.endswith("fit-00.bin") for p in paths)
    with pytest.raises(selvedge.Problem) as problem:
        server.create({"sample": ""})
    assert problem.value.status == 422 and problem.value.field == "sample"
    with pytest.raises(selvedge.Problem) as problem:  # the least status that is an error
        server.request("POST", "/v1/jobs", data=b"{", headers={"Content-Type": "application/json"})
    assert problem.value.status == 400
    job.delete()
    with pytest.raises(selvedge.Problem):
        job.state()
    write_document(sample, "failing twill")
    with pytest.raises(selvedge.JobFailed, match="page 2 is 8-bit"):
        server.submit(str(sample / "job.json")).wait()
    shutil.rmtree(tmp_path / "out")


def test_python_client_notices_a_download_that_is_cut_off(daemon, sample, tmp_path):
    job_id = run(daemon.url, "submit", sample / "job.json", "--watch").stdout.split()[0]
    data = os.urandom(3_000_000)
    with open(os.path.join(daemon.folder, "jobs", job_id, "results", "large.bin"), "wb") as f:
        f.write(data)
    proxy = CuttingProxy(daemon.port, [1_000_000, 900_000], replies=True)
    try:
        paths = selvedge.Client(proxy.url).job(job_id).download(str(tmp_path / "out"))
    finally:
        proxy.stop()
    assert proxy.n >= 3, "nothing was cut off"
    assert (tmp_path / "out" / "large.bin").read_bytes() == data
    assert all(os.path.getsize(p) > 0 for p in paths) and not [p for p in os.listdir(tmp_path / "out") if p.endswith(".part")]


def test_example_documents_are_accepted(daemon):
    folder = os.path.join(ROOT, "config", "examples")
    names = [n for n in sorted(os.listdir(folder)) if n.endswith(".json")]
    assert len(names) >= 4
    for name in names:
        with open(os.path.join(folder, name), encoding="utf-8") as f:
            job = selvedge.Client(daemon.url).create(json.load(f))
        assert job.state().state == "draft", name
        job.delete()
