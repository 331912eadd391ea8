"""Many samples on one machine: what the dispatch of a batch costs, and the list of a long queue.

A batch of 1,000 samples whose worker sleeps for one second drains on 16 workers. `scale.dispatch_overhead` is the share by which
that takes longer than 1,000 seconds divided by 16. `scale.dispatch_cpu_ms` is the processor time of the daemon
for each job of it, requests of the bench included. `scale.list_10k_ms` and `scale.job_10k_ms` are medians of GET of a page of 50 jobs
and of one job while 10,000 jobs are queued; `scale.submit_1k_s` is the time in which a batch of 1,000 samples is made.
One JSON line per figure. Usage: bench_scale.py [N_SAMPLE]"""
import json
import os
import statistics
import sys
import tempfile
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "support", "python"))
from daemon_under_test import Daemon, document, sha256, wait_until  # noqa: E402

N_WORKER, WORKER_S = 16, 1
DATA = b"set,r,g,b\n" * 20


def print_figure(name, value, unit):
    print(json.dumps({"name": f"scale.{name}", "value": round(value, 5), "unit": unit, "better": "lower"}), flush=True)


def sleeper(folder):
    """A worker that sleeps and succeeds."""
    path = os.path.join(folder, "worker")
    with open(path, "w") as f:
        f.write(f"#!/bin/sh\nexec sleep {WORKER_S}\n")
    os.chmod(path, 0o755)
    return path


def body(name, n):
    files = [{"name": name, "size": len(DATA), "sha256": sha256(DATA)} for name in ("scan.tif", "rows.csv")]
    return {"name": name, "template": document(), "samples": [{"sample": f"sample {i}", "files": files} for i in range(n)]}


def submit(d, name, n):
    begun = time.monotonic()
    r = d.session.post(d.url + "/v1/batches", json=body(name, n), timeout=600)
    assert r.status_code == 201, r.text
    took = time.monotonic() - begun
    batch = r.json()["id"]
    assert d.session.post(d.url + f"/v1/batches/{batch}/start", timeout=600).json()["n_changed"] == n
    return batch, took


def know_files(d):
    job = d.create()
    d.upload(job, "scan.tif", DATA)
    d.upload(job, "rows.csv", DATA, "measurements")


def processor_s(d):
    with open(f"/proc/{d.process.pid}/stat") as f:
        fields = f.read().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def drain(folder, n):
    with Daemon(os.path.join(folder, "drain"), worker=sleeper(folder), options={"jobs.workers": N_WORKER}) as d:
        know_files(d)
        batch, took = submit(d, "drain", n)
        print_figure("submit_1k_s", took * 1000 / n, "s")
        before = processor_s(d)
        wait_until(lambda: time.sleep(1) or d.session.get(d.url + f"/v1/batches/{batch}").json()["states"]["succeeded"] == n, 20 * n * WORKER_S / N_WORKER + 60)
        print_figure("dispatch_cpu_ms", 1000 * (processor_s(d) - before) / n, "ms")
        jobs, cursor = [], ""
        while cursor is not None:
            page = d.session.get(d.url + f"/v1/jobs?limit=500&batch={batch}" + (f"&cursor={cursor}" if cursor else "")).json()
            jobs += page["jobs"]
            cursor = page["next_cursor"]
        wall = max(j["finished_unix_s"] for j in jobs) - min(j["started_unix_s"] for j in jobs)
        print_figure("dispatch_overhead", wall / (WORKER_S * -(-n // N_WORKER)) - 1, "1")


def median_ms(d, path, n=50):
    times = []
    for _ in range(n):
        begun = time.monotonic()
        r = d.session.get(d.url + path)
        r.content
        times.append(1000 * (time.monotonic() - begun))
        assert r.status_code == 200
    return statistics.median(times)


def long_queue(folder, n):
    with Daemon(os.path.join(folder, "queue"), worker=sleeper(folder), options={"jobs.workers": 1, "jobs.max_jobs": 3 * n}) as d:
        know_files(d)
        holder = d.start_job()
        for i in range(-(-n // 5000)):
            batch, _ = submit(d, f"queue {i}", min(5000, n - 5000 * i))
        job = d.session.get(d.url + f"/v1/jobs?limit=1&batch={batch}").json()["jobs"][0]["id"]
        print_figure("list_10k_ms", median_ms(d, "/v1/jobs?limit=50"), "ms")
        print_figure("job_10k_ms", median_ms(d, f"/v1/jobs/{job}"), "ms")
        print_figure("batch_5k_ms", median_ms(d, f"/v1/batches/{batch}", 10), "ms")
        d.session.post(d.url + f"/v1/jobs/{holder}/cancel")
        d.kill()


def main():
    n = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    with tempfile.TemporaryDirectory() as folder:
        drain(folder, n)
        long_queue(folder, 10 * n)


if __name__ == "__main__":
    main()
