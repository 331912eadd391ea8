"""What a worker sees of the machine, and what a file that took it over could do: with the real worker, by hand and under
a daemon."""
import ctypes
import json
import os
import shutil
import struct
import subprocess
import zlib

import pytest
from daemon_under_test import ROOT, SANITIZED, program, sha256
from small_cloth import TABLE

WORKER = program("selvedge-worker")
SCAN = {"sample": "hostile", "volume": {"files": ["scan.tif"], "voxel_size_um": 2.0}, "measurements": {"file": "rows.csv"}}


def describes_itself(tmp_path):
    """What the log of a worker says about its sandbox."""
    (tmp_path / "job.json").write_text("{}")
    subprocess.run([WORKER, "--quiet", str(tmp_path)], check=False)
    return (tmp_path / "log.txt").read_text()


def kernel_has_sandbox():
    """Whether the kernel has Landlock (its version is what call 444 returns) and filters of system calls."""
    libc = ctypes.CDLL(None)
    return libc.syscall(444, None, ctypes.c_size_t(0), 1) >= 1 and os.path.exists("/proc/sys/kernel/seccomp/actions_avail")


@pytest.fixture(scope="module")
def hostile(tmp_path_factory):
    folder = tmp_path_factory.mktemp("hostile")
    (folder / "job").mkdir()
    if not os.access(WORKER, os.X_OK):
        pytest.skip("no selvedge-worker in the build folder")
    log = describes_itself(folder / "job")
    if "which this build lacks" in log or not kernel_has_sandbox():
        pytest.skip("no whole sandbox here: " + log.splitlines()[0])
    assert "runs in a sandbox" in log
    path = folder / "hostile.so"
    compiler = shutil.which("cc") or shutil.which("gcc") or pytest.skip("no C compiler")
    subprocess.run([compiler, "-shared", "-fPIC", "-o", path, os.path.join(ROOT, "tests", "api", "service", "hostile_library.c")], check=True)
    return str(path)


def job_folder(folder):
    (folder / "input").mkdir(parents=True)
    (folder / "job.json").write_text(json.dumps(SCAN))
    (folder / "input" / "scan.tif").write_bytes(b"II*\0 nothing that matters")
    (folder / "input" / "rows.csv").write_text(TABLE)
    return folder


def run(hostile, folder, act, *options, **variables):
    environment = {**os.environ, "LD_PRELOAD": hostile, "HOSTILE": act, **variables}
    return subprocess.run([WORKER, "--quiet", *options, str(folder)], env=environment, capture_output=True, text=True, check=False, timeout=300)


def test_a_secret_elsewhere_is_not_visible(hostile, tmp_path):
    """Neither a file of the same user, nor the environment of another process."""
    secret = tmp_path / "secret"
    secret.write_text("planted")
    with subprocess.Popen(["sleep", "60"], env={"PLANTED": "planted"}) as other:
        try:
            for path in (secret, f"/proc/{other.pid}/environ"):
                for options, seen in ((("--sandbox", "off"), True), ((), False)):
                    done = run(hostile, job_folder(tmp_path / str(hash((path, seen)))), f"read {path}", *options)
                    assert ("planted" in done.stderr) == seen and done.returncode == 1, done.stderr
                    assert seen or "hostile: read: Permission denied" in done.stderr
        finally:
            other.kill()


@pytest.mark.parametrize("act", ["write", "overwrite", "remove", "link"])
def test_nothing_outside_of_the_folder_is_written(hostile, tmp_path, act):
    """A link would let the daemon serve a foreign file as a result."""
    target = tmp_path / "target"
    if act != "write":
        target.write_text("kept")
    folder = job_folder(tmp_path / "job")
    done = run(hostile, folder, f"{act} {target}", HOSTILE_TO=str(folder / "results" / "link"))
    denied = "Invalid cross-device link" if act == "link" else "Permission denied"
    assert f"hostile: {act}: {denied}" in done.stderr
    assert target.read_text() == "kept" if act != "write" else not target.exists()
    inside = run(hostile, job_folder(tmp_path / "job2"), f"write {tmp_path / 'job2' / 'work' / 'own'}")
    assert "hostile: write: done" in inside.stderr


def test_an_input_that_is_a_link_is_only_read(hostile, tmp_path):
    """In a folder made by hand; the file that the link leads to belongs to its owner."""
    rows = tmp_path / "rows.csv"
    rows.write_text(TABLE)
    for act, outcome in (("read", "done"), ("overwrite", "Permission denied")):
        folder = job_folder(tmp_path / act)
        (folder / "input" / "rows.csv").unlink()
        (folder / "input" / "rows.csv").symlink_to(rows)
        done = run(hostile, folder, f"{act} {rows}", HOSTILE_TO="")
        assert f"hostile: {act}: {outcome}" in done.stderr, done.stderr


@pytest.mark.parametrize("how", ["daemon", "option"])
def test_a_link_that_a_worker_may_have_made_is_out_of_reach(hostile, tmp_path, how):
    """In the folder of a daemon, which has attempt.json, and where the daemon forbids links."""
    secret = tmp_path / "secret"
    secret.write_text(TABLE)
    folder = job_folder(tmp_path / "job")
    (folder / "input" / "rows.csv").unlink()
    (folder / "input" / "rows.csv").symlink_to(secret)
    if how == "daemon":
        (folder / "attempt.json").write_text(json.dumps({"attempt": 1, "token": "t"}))
    done = run(hostile, folder, f"read {secret}", *(["--no-links"] if how == "option" else []), HOSTILE_TO="")
    assert "hostile: read: Permission denied" in done.stderr, done.stderr


def test_the_file_of_speeds_is_written_in_place(hostile, tmp_path):
    """It is made before the sandbox closes; the folder around it stays out of reach."""
    speeds = tmp_path / "elsewhere" / "speeds.json"
    speeds.parent.mkdir()
    done = run(hostile, job_folder(tmp_path / "job"), f"overwrite {speeds}", "--speeds", str(speeds), HOSTILE_TO="")
    assert "hostile: overwrite: done" in done.stderr, done.stderr
    done = run(hostile, job_folder(tmp_path / "other"), f"write {speeds.parent}/new", "--speeds", str(speeds), HOSTILE_TO="")
    assert "hostile: write: Permission denied" in done.stderr, done.stderr


def test_a_shared_checkpoint_cannot_be_changed(hostile, tmp_path):
    """Files that two jobs have are for reading only (test_geometry_only_job.py), for a worker of root, too."""
    folder = job_folder(tmp_path / "job")
    (folder / "attempt.json").write_text('{"attempt":1,"token":"x"}')
    (folder / "adopted").mkdir()
    for name, mode, outcome in (("shared.bin", 0o400, "Permission denied"), ("own.bin", 0o600, "done")):
        path = folder / "adopted" / name
        path.write_text("kept")
        path.chmod(mode)
        done = run(hostile, folder, f"overwrite {path}", HOSTILE_TO="")
        assert f"hostile: overwrite: {outcome}" in done.stderr, done.stderr


@pytest.mark.parametrize("act", ["socket", "execve", "fork", "kill {pid}", "chmod {file}", "truncate {file}"])
def test_a_forbidden_call_ends_the_worker(hostile, tmp_path, act):
    done = run(hostile, job_folder(tmp_path / "job"), act.format(pid=os.getpid(), file=tmp_path / "job" / "job.json"))
    name = {"fork": "clone"}.get(act, act.split()[0])
    assert done.returncode == -31 and f"the sandbox forbids the system call '{name}'" in done.stderr, done


def test_every_thread_is_restricted(hostile, tmp_path):
    """Also those that libraries start before main."""
    environment = {**os.environ, "LD_PRELOAD": hostile, "HOSTILE": "wait", "OPENBLAS_NUM_THREADS": "4"}
    with subprocess.Popen([WORKER, "--quiet", job_folder(tmp_path / "job")], env=environment, stderr=subprocess.PIPE, text=True) as worker:
        try:
            assert worker.stderr.readline() == "hostile: waits\n"
            lines = []
            for thread in os.listdir(f"/proc/{worker.pid}/task"):
                with open(f"/proc/{worker.pid}/task/{thread}/status") as f:
                    lines += [line for line in f.read().split("\n") if line.startswith(("Seccomp:", "NoNewPrivs:"))]
        finally:
            worker.kill()
    assert lines.count("Seccomp:\t2") == lines.count("NoNewPrivs:\t1") >= 2 and "Seccomp:\t0" not in lines


@pytest.mark.parametrize("path, seen", [("/proc/self/net/tcp", False), ("/proc/thread-self/net/unix", False), ("/proc/net/tcp", False),
                                        ("/proc/self/environ", False), ("/proc/self/mountinfo", False), ("/proc/self/status", True)])
def test_little_is_seen_of_the_machine(hostile, tmp_path, path, seen):
    """Not which sockets it has, which would tell of its services, and not the command lines of other processes."""
    for options, allowed in ((("--sandbox", "off"), True), ((), seen)):
        done = run(hostile, job_folder(tmp_path / str(allowed) / str(len(options))), f"read {path}", *options)
        assert ("hostile: read: Permission denied" in done.stderr) != allowed, done.stderr


def test_the_daemon_names_the_forbidden_call(hostile, daemon_maker):
    d = daemon_maker(worker=WORKER, environment={"LD_PRELOAD": hostile, "HOSTILE": "socket"},
                     options={"jobs.pass_environment": "PATH, LD_PRELOAD HOSTILE", "jobs.sandbox": "required"})
    job = d.create(SCAN)
    d.upload(job, "scan.tif", b"II*\0 nothing that matters")
    d.upload(job, "rows.csv", TABLE.encode(), "measurements")
    d.post(f"/v1/jobs/{job}/start")
    failed = d.wait_state(job, "failed")
    assert failed["error"]["code"] == "forbidden_call" and failed["attempt"] == 1
    assert "forbids the system call 'socket'" in failed["error"]["text"]


@pytest.mark.parametrize("act", ["overwrite", "replace"])
def test_inputs_that_jobs_share_cannot_be_changed(hostile, daemon_maker, act):
    """Neither while a worker runs nor afterwards, when its job's file would be linked to another job."""
    scan = b"II*\0 a scan that two jobs have"
    d = daemon_maker(worker=WORKER, environment={"LD_PRELOAD": hostile, "HOSTILE": act},
                     options={"jobs.pass_environment": "PATH, LD_PRELOAD HOSTILE", "jobs.sandbox": "required"})
    jobs = [d.create(SCAN) for _ in range(3)]
    for job in jobs[:2]:
        d.upload(job, "scan.tif", scan)
        d.upload(job, "rows.csv", TABLE.encode(), "measurements")
    for job in jobs[:2]:  # the inputs of the first are linked to the second
        d.post(f"/v1/jobs/{job}/start")
        d.wait_state(job, "failed")
        outcome = "done" if act == "replace" else "Permission denied"
        with open(os.path.join(d.data, "jobs", job, "console.txt")) as console:
            assert f"hostile: {act}: {outcome}" in console.read()
        if job == jobs[0]:
            assert d.get(f"/v1/jobs/{jobs[1]}/files/scan.tif").content == scan
    if d.declare(jobs[2], "scan.tif", scan)["state"] != "complete":
        d.upload(jobs[2], "scan.tif", scan)
    assert d.get(f"/v1/jobs/{jobs[2]}/files/scan.tif").content == scan


@pytest.mark.skipif(shutil.which("strace") is None, reason="no strace")
@pytest.mark.parametrize("mode", ["auto", "required"])
def test_a_kernel_that_refuses_the_sandbox(hostile, tmp_path, mode):
    """The job goes on with a warning, unless the sandbox is required."""
    strace = ["strace", "-qq", "-o", os.devnull, "-e", "trace=landlock_restrict_self", "-e", "inject=landlock_restrict_self:error=EPERM"]
    if subprocess.run(["strace", "-qq", "-o", os.devnull, "true"], check=False).returncode != 0:
        pytest.skip("strace may not trace here")
    done = subprocess.run([*strace, WORKER, "--quiet", "--sandbox", mode, job_folder(tmp_path / "job")], capture_output=True, text=True, check=False)
    state = json.loads((tmp_path / "job" / "status.json").read_text())
    refusal = "cannot enter the sandbox: Operation not permitted"
    assert done.returncode == 1 and hostile
    assert (refusal in state["error"]["text"]) == (mode == "required")
    assert any(refusal in w for w in map(str, state["warnings"])) == (mode == "auto")


def test_what_a_worker_gets_of_the_daemon(daemon_maker):
    """Few variables, three descriptors, no privileges to gain, and the limits of the settings."""
    limits = {"jobs.open_files": 200, "jobs.file_limit_bytes": 1 << 20, "jobs.memory_limit_bytes": 1 << 30, "jobs.oom_score_adj": 700, "jobs.nice": 7}
    d = daemon_maker(environment={"PLANTED": "secret", "LANG": "C.UTF-8"}, options=limits,
                     wrapper=["bash", "-c", 'exec 9</dev/null; exec "$@"', "bash"])  # a descriptor that the daemon inherits
    seen = d.wait_state(d.start_job("surroundings"), "succeeded")["result"]
    passed = SANITIZED.get("jobs.pass_environment", "").split()
    assert set(seen["environment"]) <= {"PATH", "LANG", "LC_ALL", "TZ", "OPENBLAS_NUM_THREADS", "LC_CTYPE", *passed}
    assert seen["environment"]["LANG"] == "C.UTF-8"
    assert seen["descriptors"] == ["0", "1", "2"]
    assert seen["no_new_privs"] == "1" and seen["oom_score_adj"] == "700" and seen["nice"] == 7
    assert seen["limits"] == {"NOFILE": [200, 200], "FSIZE": [1 << 20, 1 << 20], "AS": [1 << 30, 1 << 30], "CORE": [0, 0],
                              "NPROC": [4096 + 2048 + 2 * 1024] * 2}


def bomb(edge, n_page):
    """A TIFF of n_page pages of edge x edge pixels, half of them black, all with the same deflated strip."""
    strip = zlib.compress((bytes(edge // 2) + b"\xc8" * (edge - edge // 2)) * edge, 9)
    data, links = b"II*\0" + struct.pack("<I", 8 + len(strip)) + strip, []
    tags = [(256, 4, edge), (257, 4, edge), (258, 3, 8), (259, 3, 8), (262, 3, 1), (273, 4, 8), (277, 3, 1), (278, 4, edge), (279, 4, len(strip))]
    directory = struct.pack("<H", len(tags)) + b"".join(struct.pack("<HHII", tag, kind, 1, value) for tag, kind, value in tags)
    for i in range(n_page):
        following = len(data) + (i + 1) * (len(directory) + 4)
        links.append(directory + struct.pack("<I", following if i + 1 < n_page else 0))
    return data + b"".join(links)


def test_a_small_file_with_a_vast_scan_is_refused_unread(real):
    scan = bomb(1560, 1560)
    assert len(scan) < 1_000_000
    job = real.create(SCAN)
    real.upload(job, "scan.tif", scan)
    real.upload(job, "rows.csv", TABLE.encode(), "measurements")
    assert real.get(f"/v1/jobs/{job}/files").json()["files"][0]["sha256"] == sha256(scan)
    real.post(f"/v1/jobs/{job}/start")
    failed = real.wait_state(job, "failed")
    assert failed["error"]["code"] == "too_large" and failed["error"]["field"] == "volume.files", failed["error"]
    assert "83.5 GB are needed" in failed["error"]["text"] and failed["peak_rss_bytes"] < 300e6
