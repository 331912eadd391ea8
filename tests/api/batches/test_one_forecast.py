"""Plan, queue, job and batch say the same about how long a job takes, within the half minute to which the queue rounds."""
import subprocess
import time

from daemon_under_test import document, program, sha256, wait_until

SCAN, ROWS = b"II*\0" + b"x" * 4000, b"set,r,g,b\n" * 20
ROUNDING_S = 31


def submit(d, name, samples):
    job = d.create()
    d.upload(job, "scan.tif", SCAN)
    d.upload(job, "rows.csv", ROWS, "measurements")
    files = [{"name": n, "size": len(data), "sha256": sha256(data)} for n, data in (("scan.tif", SCAN), ("rows.csv", ROWS))]
    r = d.post("/v1/batches", json={"name": name, "template": document(), "samples": [{"sample": s, "files": files} for s in samples]})
    assert r.status_code == 201, r.text
    return r.json()


def test_one_number_for_one_job(daemon_maker):
    """The jobs that ran before took a second, and nobody asks for a plan: the daemon plans what waits."""
    d = daemon_maker(options={"jobs.workers": 1})
    d.wait_state(d.start_job("succeed"), "succeeded")
    running = d.start_job("work 60")
    d.wait_state(running, "running")
    batch = submit(d, "week", ["fake: work 60, planned 600", "fake: work 60, planned 1800"])
    d.post(f"/v1/batches/{batch['id']}/start")
    jobs = [s["job"] for s in batch["samples"]]

    def planned():
        plan = d.get(f"/v1/batches/{batch['id']}/plan").json()
        return plan["expected"]["n"] == 2 and plan
    plan = wait_until(planned, what="plans of the jobs that wait")
    assert plan["expected"]["job_s"] == 2400 and plan["expected"]["wall_s"] == 2400
    time.sleep(1.1)  # the forecast is made once a second
    now, eta_s = time.time(), d.job(running)["eta_s"]
    first, second = (d.job(job) for job in jobs)
    view = d.get(f"/v1/batches/{batch['id']}").json()
    rows = {row["id"]: row for row in d.get("/v1/jobs?view=row&state=queued").json()["jobs"]}
    assert abs(first["expected_start_unix_s"] - now - eta_s) < ROUNDING_S
    assert abs(first["expected_end_unix_s"] - first["expected_start_unix_s"] - 600) < ROUNDING_S, first
    assert abs(second["expected_end_unix_s"] - second["expected_start_unix_s"] - 1800) < ROUNDING_S, second
    assert abs(second["expected_start_unix_s"] - first["expected_end_unix_s"]) < ROUNDING_S
    assert abs(view["expected_end_unix_s"] - second["expected_end_unix_s"]) < ROUNDING_S
    assert [rows[job]["expected_end_unix_s"] for job in jobs] == [first["expected_end_unix_s"], second["expected_end_unix_s"]]
    said = subprocess.run([program("selvedge"), "--server", d.url, "plan", "week"], capture_output=True, text=True, check=True, timeout=300).stdout
    assert "time       40:00 (20:00 to 1:20:00)" in said, said
    d.post("/v1/actions", json={"action": "delete", "jobs": [*jobs, running]})


def test_jobs_of_a_batch_without_a_plan_take_as_long_as_the_others(daemon_maker):
    d = daemon_maker(options={"jobs.workers": 1, "jobs.plan_queued": 0})
    d.wait_state(d.start_job("succeed"), "succeeded")
    running = d.start_job("work 60")
    d.wait_state(running, "running")
    batch = submit(d, "half", ["fake: work 60, planned 600", "fake: work 60, planned 999"])
    jobs = [s["job"] for s in batch["samples"]]
    assert d.post(f"/v1/jobs/{jobs[0]}/plan").json()["wall_s"] == 600
    d.post(f"/v1/batches/{batch['id']}/start")
    time.sleep(4)
    for job in map(d.job, jobs):
        assert abs(job["expected_end_unix_s"] - job["expected_start_unix_s"] - 600) < ROUNDING_S, job
    assert d.get(f"/v1/batches/{batch['id']}/plan").json()["expected"]["n"] == 1, "jobs.plan_queued is off"
    d.post("/v1/actions", json={"action": "delete", "jobs": [*jobs, running]})
