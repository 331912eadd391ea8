"""What does the daemon cost, and does it answer while it stores uploads? Prints figures service.*.

    bench_service.py [--build DIR] [NAME...]    NAME: list answers uploads slow_disk declare readers watchers guard

list: CPU time of the daemon for one page of the list of jobs, at 100 and at 10,000 jobs. answers: answers a second and 99th
percentile of their time, of a page of the list, a job, its series of 500 steps and the metrics, at 100 and 10,000 jobs, with
no upload and with 8 that go on; without uploads the CPU time of the daemon for an answer, too. uploads: 99th percentile of the
time of GET on a job while 8 clients upload. slow_disk: longest time of GET /livez while one client uploads and each sync
takes 0.5 s. declare: time in which 4,000 slices of a scan are declared. readers: memory of the daemon while 60 clients
read a job and its result of 12 MB at 100 bytes a second. watchers: CPU time of the daemon and 99th percentile of the time of
GET while 200 clients wait for a change of a job or of the list, and the time until the last of them has seen one. guard:
99th percentile and longest time of POST of a job while a batch of 10,000 rows with two known files each is submitted, and the
99th percentile without the batch; processor time of a batch of 9,000 rows that is refused; memory of the daemon that 40 clients
take which each hold back the end of a batch of 16 MiB.
"""
import argparse
import contextlib
import http.client
import json
import multiprocessing
import os
import socket
import sqlite3
import subprocess
import sys
import tempfile
import threading
import time
import uuid

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__)))))
sys.path.insert(0, os.path.join(ROOT, "tests", "support", "python"))
N_LIST, N_SLICE, N_READER, N_WATCHER, N_ROW, RESULT_BYTES = 200, 4000, 60, 200, 10000, 12 << 20
PIECE_BYTES = 16 << 20
UPLOAD_S, ANSWERS_S, N_ASKING = 5.0, 2.0, 2


def figure(name, value, unit, group="service"):
    print(json.dumps({"name": f"{group}.{name}", "value": round(value, 4), "unit": unit, "better": "lower"}), flush=True)


def cpu_s(pid):
    with open(f"/proc/{pid}/stat", encoding="ascii") as f:
        fields = f.read().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def resident_bytes(pid):
    with open(f"/proc/{pid}/statm", encoding="ascii") as f:
        return int(f.read().split()[1]) * os.sysconf("SC_PAGESIZE")


def copy_jobs(data, n):
    """Adds n copies of the only job to the database of a stopped daemon, in each table that has a row of it."""
    with contextlib.closing(sqlite3.connect(os.path.join(data, "selvedge.db"))) as db:
        (first,) = db.execute("SELECT id FROM job").fetchone()
        ids = [str(uuid.uuid4()) for _ in range(n)]
        for table, key in (("job", "id"), ("document", "job_id")):
            columns = [row[1] for row in db.execute(f"PRAGMA table_info({table})") if row[1] != "serial"]
            if not columns:
                continue
            row = list(db.execute(f"SELECT {', '.join(columns)} FROM {table} WHERE {key} = ?", (first,)).fetchone())
            at = columns.index(key)
            db.executemany(f"INSERT INTO {table} ({', '.join(columns)}) VALUES ({', '.join('?' * len(row))})",
                           (row[:at] + [new] + row[at + 1:] for new in ids))
        db.commit()


def bench_list(folder, daemon_type):
    for n, name in ((100, "100"), (10000, "10k")):
        daemon = daemon_type(os.path.join(folder, f"list-{name}"), options={"jobs.max_jobs": 20000})
        with daemon:
            daemon.create()
        copy_jobs(daemon.data, n - 1)
        with daemon:
            client = http.client.HTTPConnection("127.0.0.1", daemon.port)
            for i in range(N_LIST + 10):
                if i == 10:
                    before = cpu_s(daemon.process.pid)
                client.request("GET", "/v1/jobs")
                body = client.getresponse().read()
            figure(f"list_{name}_ms", 1e3 * (cpu_s(daemon.process.pid) - before) / N_LIST, "ms")
            assert len(json.loads(body)["jobs"]) == 50
            client.close()


def send_forever(port, url, size, until):
    """Sends a file in pieces until the time is over."""
    os.nice(10)  # it stands for clients on other machines, which take no time of the daemon's processors
    client, data, offset = http.client.HTTPConnection("127.0.0.1", port), os.urandom(PIECE_BYTES), 0
    while time.monotonic() < until and offset < size:
        n = min(PIECE_BYTES, size - offset)
        client.request("PATCH", url, data[:n], {"Tus-Resumable": "1.0.0", "Upload-Offset": str(offset),
                                                "Content-Type": "application/offset+octet-stream"})
        client.getresponse().read()
        offset += n


def times_of_get(port, path, until, n_connection=8):
    """Times of GET in seconds, one after the other over connections that stay open."""
    clients, times = [http.client.HTTPConnection("127.0.0.1", port) for _ in range(n_connection)], []
    while time.monotonic() < until:
        for client in clients:
            start = time.monotonic()
            client.request("GET", path)
            client.getresponse().read()
            times.append(time.monotonic() - start)
        time.sleep(0.01)
    return sorted(times)


def while_sending(daemon, n_upload, size, path):
    """Times of GET on path, which may contain {job}, while n_upload processes upload a file each."""
    job = daemon.create()
    urls = [daemon.post(f"/v1/jobs/{job}/files", json={"name": f"s{i}.tif", "role": "volume", "size": size, "sha256": None}).json()["upload_url"]
            for i in range(n_upload)]
    until = time.monotonic() + UPLOAD_S
    senders = [multiprocessing.Process(target=send_forever, args=(daemon.port, url, size, until)) for url in urls]
    for sender in senders:
        sender.start()
    times = times_of_get(daemon.port, path.format(job=job), until)
    for sender in senders:
        sender.join()
    return times


def bench_uploads(folder, daemon_type):
    with daemon_type(os.path.join(folder, "uploads")) as daemon:
        times = while_sending(daemon, 8, 1 << 28, "/v1/jobs/{job}")
        figure("get_p99_ms_8_uploads", 1e3 * times[int(0.99 * len(times))], "ms")


def ask_without_pause(port, path, until, answers):
    """Sends its own times of GET through the pipe `answers`."""
    client, times = http.client.HTTPConnection("127.0.0.1", port), []
    while time.monotonic() < until:
        start = time.monotonic()
        client.request("GET", path)
        assert client.getresponse().read()
        times.append(time.monotonic() - start)
    answers.send(times)


def bench_answers_of(daemon, path, name, n_upload):
    """Two clients that ask one after the other, beside n_upload uploads."""
    senders = []
    until = time.monotonic() + ANSWERS_S
    if n_upload:
        job = daemon.create()
        urls = [daemon.post(f"/v1/jobs/{job}/files", json={"name": f"s{i}.tif", "role": "volume", "size": 1 << 28, "sha256": None}).json()["upload_url"]
                for i in range(n_upload)]
        until = time.monotonic() + ANSWERS_S
        senders = [multiprocessing.Process(target=send_forever, args=(daemon.port, url, 1 << 28, until)) for url in urls]
    pipes = [multiprocessing.Pipe(duplex=False) for _ in range(N_ASKING)]
    asking = [multiprocessing.Process(target=ask_without_pause, args=(daemon.port, path, until, end)) for _, end in pipes]
    before = cpu_s(daemon.process.pid)
    for process in senders + asking:
        process.start()
    times = sorted(t for end, _ in pipes for t in end.recv())
    used_s = cpu_s(daemon.process.pid) - before
    for process in senders + asking:
        process.join()
    print(json.dumps({"name": f"service.answers.{name}_per_s", "value": round(len(times) / ANSWERS_S, 1), "unit": "1/s", "better": "higher"}),
          flush=True)
    figure(f"answers.{name}_p99_ms", 1e3 * times[int(0.99 * len(times))], "ms")
    if not n_upload:
        figure(f"answers.{name}_cpu_ms", 1e3 * used_s / len(times), "ms")


def bench_answers(folder, daemon_type):
    for n, jobs in ((100, "100"), (10000, "10k")):
        daemon = daemon_type(os.path.join(folder, f"answers-{jobs}"), options={"jobs.max_jobs": 20000})
        with daemon:
            daemon.create()
        copy_jobs(daemon.data, n - 2)
        with daemon:
            job = daemon.start_job("series 500")
            daemon.wait_state(job, "succeeded")
            paths = {"list": "/v1/jobs", "job": f"/v1/jobs/{job}", "series": f"/v1/jobs/{job}/series", "metrics": "/metrics"}
            for what, path in paths.items():
                for n_upload in (0, 8):
                    bench_answers_of(daemon, path, f"{what}_{jobs}_{n_upload}_uploads", n_upload)


def bench_slow_disk(folder, daemon_type):
    shim = os.path.join(folder, "slow.so")
    subprocess.run(["cc", "-shared", "-fPIC", "-O1", "-o", shim, os.path.join(ROOT, "tests", "crash", "fault_shim.c"), "-ldl"], check=True)
    with daemon_type(os.path.join(folder, "slow"), environment={"LD_PRELOAD": shim, "FAULT_SLOW_SYNC_S": "0.5"}) as daemon:
        figure("livez_max_ms_slow_disk", 1e3 * while_sending(daemon, 1, 1 << 27, "/livez")[-1], "ms")


def bench_declare(folder, daemon_type):
    slices = [{"name": f"slice-{i:04}.tif", "role": "volume", "size": 1000 + i, "sha256": None} for i in range(N_SLICE)]
    with daemon_type(os.path.join(folder, "declare")) as daemon:
        job = daemon.create()
        start = time.monotonic()
        if daemon.session.post(f"{daemon.url}/v1/jobs/{job}/files", json=slices).status_code == 422:  # a version that takes one at a time
            for declaration in slices:
                daemon.session.post(f"{daemon.url}/v1/jobs/{job}/files", json=declaration).raise_for_status()
        figure("declare_4000_s", time.monotonic() - start, "s")
        assert len(daemon.get(f"/v1/jobs/{job}").json()["files"]) == N_SLICE


def read_slowly(port, path, until):
    with socket.create_connection(("127.0.0.1", port)) as client:
        client.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        client.sendall(f"GET {path} HTTP/1.1\r\nHost: localhost\r\n\r\n".encode())
        with contextlib.suppress(OSError):
            while time.monotonic() < until and client.recv(100):
                time.sleep(1)


def bench_readers(folder, daemon_type):
    with daemon_type(os.path.join(folder, "readers")) as daemon:
        job = daemon.start_job("succeed")
        daemon.wait_state(job, "succeeded")
        path = os.path.join(daemon.data, "jobs", job, "results", "result.json")
        with open(path, encoding="utf-8") as f:
            result = json.load(f)
        result["rows"] = [{"name": "r" * 40, "value": i * 1.5} for i in range(RESULT_BYTES // 70)]
        with open(path, "w", encoding="utf-8") as f:
            json.dump(result, f)
        until, most = time.monotonic() + 6, 0
        paths = [f"/v1/jobs/{job}", f"/v1/jobs/{job}/results/result.json"]
        readers = [threading.Thread(target=read_slowly, args=(daemon.port, paths[i % 2 if i else 0], until)) for i in range(N_READER)]
        for reader in readers:
            reader.start()
        while time.monotonic() < until:
            most = max(most, resident_bytes(daemon.process.pid))
            time.sleep(0.1)
        for reader in readers:
            reader.join()
        figure("rss_60_slow_readers_bytes", most, "bytes")


def bench_watchers(folder, daemon_type):
    with daemon_type(os.path.join(folder, "watchers")) as daemon:
        job = daemon.create()
        waiting = []
        for path in [f"/v1/jobs/{job}", "/v1/jobs"] * (N_WATCHER // 2):
            client = http.client.HTTPConnection("127.0.0.1", daemon.port)
            client.request("GET", f"{path}?wait=60", headers={"If-None-Match": daemon.get(path).headers["ETag"]})
            waiting.append(client)
        time.sleep(1)
        before, start = cpu_s(daemon.process.pid), time.monotonic()
        time.sleep(UPLOAD_S)
        figure("watchers_idle_cpu", (cpu_s(daemon.process.pid) - before) / (time.monotonic() - start), "CPU")
        times = times_of_get(daemon.port, f"/v1/jobs/{job}", time.monotonic() + UPLOAD_S)
        figure("watchers_get_p99_ms", 1e3 * times[int(0.99 * len(times))], "ms")
        start = time.monotonic()
        daemon.post(f"/v1/jobs/{job}/cancel")
        assert {client.getresponse().status for client in waiting} == {200}
        figure("watchers_last_s", time.monotonic() - start, "s")


def post_without_pause(port, body, stop, answers):
    """Sends its own times of POST of a job, until `stop` is set, through the pipe `answers`."""
    client, times = http.client.HTTPConnection("127.0.0.1", port), []
    while not stop.is_set():
        start = time.monotonic()
        client.request("POST", "/v1/jobs", body, {"Content-Type": "application/json"})
        reply = client.getresponse()
        assert reply.read() and reply.status == 201
        times.append(time.monotonic() - start)
    answers.send(times)


def times_of_post(port, body, meanwhile):
    """Times of POST of a job in order of size, while `meanwhile` runs."""
    stop, (end, answers) = multiprocessing.Event(), multiprocessing.Pipe(duplex=False)
    posting = multiprocessing.Process(target=post_without_pause, args=(port, body, stop, answers))
    posting.start()
    meanwhile()
    stop.set()
    times = sorted(end.recv())
    posting.join()
    return times


def bench_batch(folder, daemon_type):
    from daemon_under_test import DOCUMENT, FILES, sha256
    files = [{"name": name, "size": len(data), "sha256": sha256(data)} for name, (_, data) in FILES.items()]
    body = json.dumps(DOCUMENT)

    def submit(daemon, name, template, rows, status):
        reply = daemon.session.post(daemon.url + "/v1/batches", json={"name": name, "template": template, "samples": rows}, timeout=600)
        assert reply.status_code == status, reply.text[:200]
    with daemon_type(os.path.join(folder, "batch"), options={"jobs.max_jobs": 100000}) as daemon:
        daemon.ready_job()
        alone = times_of_post(daemon.port, body, lambda: time.sleep(UPLOAD_S))
        rows = [{"sample": f"s{i}", "replace": {"volume.voxel_size_um": 1 + i % 7}, "files": files} for i in range(N_ROW)]
        times = times_of_post(daemon.port, body, lambda: submit(daemon, "large", DOCUMENT, rows, 201))
        figure("post_p99_ms_beside_batch", 1e3 * times[int(0.99 * len(times))], "ms", "guard")
        figure("post_max_ms_beside_batch", 1e3 * times[-1], "ms", "guard")
        figure("post_p99_ms_alone", 1e3 * alone[int(0.99 * len(alone))], "ms", "guard")
        photographs = [{"file": f"p{i}.exr", "camera_theta_deg": 10, "light_theta_deg": 30} for i in range(300)]
        before = cpu_s(daemon.process.pid)
        submit(daemon, "refused", {**DOCUMENT, "photographs": photographs}, [{"sample": f"{i}"} for i in range(9000)], 422)
        figure("refused_batch_cpu_s", cpu_s(daemon.process.pid) - before, "s", "guard")


def hold_back(port, body, held):
    client = socket.create_connection(("127.0.0.1", port))
    held.append(client)
    with contextlib.suppress(OSError):
        client.sendall(f"POST /v1/batches HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nContent-Length: {len(body)}\r\n\r\n".encode())
        client.sendall(body[:-1])


def bench_bodies(folder, daemon_type):
    with daemon_type(os.path.join(folder, "bodies")) as daemon:
        daemon.create()
        before, most, held, body = resident_bytes(daemon.process.pid), 0, [], b"{" + b" " * ((16 << 20) - 2) + b"}"
        threads = [threading.Thread(target=hold_back, args=(daemon.port, body, held)) for _ in range(40)]
        for thread in threads:
            thread.start()
        while any(thread.is_alive() for thread in threads):
            most = max(most, resident_bytes(daemon.process.pid))
            time.sleep(0.05)
        figure("body_budget_bytes", most - before, "bytes", "guard")
        for client in held:
            client.close()


def bench_guard(folder, daemon_type):
    bench_batch(folder, daemon_type)
    bench_bodies(folder, daemon_type)


BENCH = {"list": bench_list, "answers": bench_answers, "uploads": bench_uploads, "slow_disk": bench_slow_disk, "declare": bench_declare,
         "readers": bench_readers, "watchers": bench_watchers, "guard": bench_guard}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", default="build")
    parser.add_argument("name", nargs="*", choices=[*BENCH, []])
    arguments = parser.parse_args()
    os.environ["SELVEDGE_BUILD"] = os.path.join(ROOT, arguments.build)
    from daemon_under_test import Daemon  # it reads SELVEDGE_BUILD
    for name in arguments.name or BENCH:
        with tempfile.TemporaryDirectory() as folder:
            BENCH[name](folder, Daemon)


if __name__ == "__main__":
    main()
