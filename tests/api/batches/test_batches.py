"""Batches: submitting a table, submitting it again, acting on all jobs at once, progress, failures, results."""
import csv
import io
import json
import os
import threading
import time

import pytest
from daemon_under_test import document, problem, selvedged, sha256, wait_until

SCAN = b"II*\0 not really a scan" * 100
ROWS = b"set,r,g,b\n" * 20


def described(name, data):
    return {"name": name, "size": len(data), "sha256": sha256(data)}


def row(sample, files=True, **replace):
    return {"sample": sample, "replace": replace, "files": [described("scan.tif", SCAN), described("rows.csv", ROWS)] if files else []}


def table(name, samples, **more):
    return {"name": name, "template": document(), "samples": samples, **more}


def submit(d, name, samples, expect=201, **more):
    r = d.post("/v1/batches", json=table(name, samples, **more))
    assert r.status_code == expect, r.text
    return r.json()


def know_files(d):
    """Makes the bytes of SCAN and ROWS known, so that batches need no upload."""
    job = d.create()
    d.upload(job, "scan.tif", SCAN)
    d.upload(job, "rows.csv", ROWS, "measurements")


def jobs_of(batch):
    return {one["sample"]: one["job"] for one in batch["samples"]}


def ended(d, batch, timeout_s=30):
    def look():
        b = d.get(f"/v1/batches/{batch}").json()
        return b if not sum(b["states"][s] for s in ("draft", "queued", "running", "paused")) else None
    return wait_until(look, timeout_s, "the end of the batch")


def test_a_batch_from_table_to_results(daemon):
    know_files(daemon)
    made = submit(daemon, "first", [row("fake: succeed", **{"volume.voxel_size_um": 3.5}), row("fake: fail"), row("fake: series 5", **{"/fit": {"seed": 7}})])
    assert made["states"]["draft"] == made["n_sample"] == 3 and [one["outcome"] for one in made["samples"]] == ["new"] * 3 and made["left"] == []
    jobs = jobs_of(made)
    first = daemon.get(f"/v1/jobs/{jobs['fake: succeed']}").json()
    assert first["document"]["volume"] == {"files": ["scan.tif"], "voxel_size_um": 3.5} and first["missing_files"] == []
    assert first["batch"] == {"id": made["id"], "name": "first"}
    assert daemon.get(f"/v1/jobs/{jobs['fake: series 5']}").json()["document"]["fit"] == {"seed": 7}
    started = daemon.post(f"/v1/batches/{made['id']}/start?priority=2")
    assert started.status_code == 202 and started.json()["n_changed"] == 3 and started.json()["refused"] == []
    assert daemon.get(f"/v1/jobs/{jobs['fake: fail']}").json()["priority"] == 2
    end = ended(daemon, made["id"])
    assert end["states"]["succeeded"] == 2 and end["states"]["failed"] == 1 and end["fraction"] == 1 and end["expected_end_unix_s"] is None
    (failure,) = end["failures"]
    assert failure == {"sample": "fake: fail", "job": jobs["fake: fail"], "code": "format", "field": "volume.files",
                       "text": "cannot read volume 'scan.tif': page 2 is cut off"}
    results = daemon.get(f"/v1/batches/{made['id']}/results.json").json()["samples"]
    assert [one["sample"] for one in results] == ["fake: succeed", "fake: fail", "fake: series 5"]
    (parameter,) = results[0]["parameters"]
    assert (parameter["name"], parameter["value"], parameter["standard_error"]) == ("beta_R", 5.0, 0.1)
    assert results[1]["parameters"] == [] and results[1]["error"]["code"] == "format"
    lines = list(csv.DictReader(io.StringIO(daemon.get(f"/v1/batches/{made['id']}/results.csv").text)))
    assert [line["beta_R"] for line in lines] == ["5", "", "5"] and lines[0]["beta_R_se"] == "0.1" and lines[1]["error"].startswith("cannot read")
    retried = daemon.post(f"/v1/batches/{made['id']}/retry")
    assert retried.status_code == 202 and retried.json()["n_changed"] == 1
    ended(daemon, made["id"])
    assert daemon.get(f"/v1/jobs?batch={made['id']}&state=failed").json()["jobs"][0]["attempt"] == 2
    assert daemon.get(f"/v1/batches/{made['id']}").headers["ETag"]


def test_the_same_table_again_changes_nothing(daemon):
    know_files(daemon)
    samples = [row(f"fake: succeed {i}") for i in range(3)]
    made = submit(daemon, "twice", samples)
    r = daemon.post("/v1/batches", json=table("twice", samples))
    assert r.status_code == 200 and r.headers["Idempotent-Replay"] == "true"
    assert jobs_of(r.json()) == jobs_of(made) and {one["outcome"] for one in r.json()["samples"]} == {"taken_over"}
    assert r.json()["n_sample"] == 3


def test_only_what_changed_runs_again(daemon):
    know_files(daemon)
    samples = [row("fake: succeed a"), row("fake: succeed b"), row("fake: succeed c"), row("fake: work 60")]
    made = submit(daemon, "changed", samples)
    daemon.post(f"/v1/batches/{made['id']}/start")
    wait_until(lambda: daemon.get(f"/v1/batches/{made['id']}").json()["states"]["succeeded"] == 3)
    other = ROWS + b"another line\n"
    changed = [row("fake: succeed c"), dict(row("fake: succeed b"), files=[described("scan.tif", SCAN), described("rows.csv", other)]),
               row("fake: succeed a", **{"volume.voxel_size_um": 9}), row("fake: succeed d")]
    body = problem(daemon.post("/v1/batches", json=table("changed", changed)), 409, "exists", "name")
    assert (body["batch"], body["n_new"], body["n_left"]) == (made["id"], 3, 3)
    again = submit(daemon, "changed", changed, expect=200, update=True)
    assert again["id"] == made["id"] and [one["outcome"] for one in again["samples"]] == ["taken_over", "changed", "changed", "new"]
    before, now = jobs_of(made), jobs_of(again)
    assert now["fake: succeed c"] == before["fake: succeed c"] and now["fake: succeed a"] != before["fake: succeed a"]
    assert {(one["sample"], one["cancelled"]) for one in again["left"]} == {("fake: succeed a", False), ("fake: succeed b", False), ("fake: work 60", True)}
    daemon.wait_state(before["fake: work 60"], "cancelled")
    assert daemon.job(before["fake: succeed a"])["result"] and daemon.job(before["fake: succeed a"])["batch"] is None  # its result stays
    assert daemon.get(f"/v1/jobs/{now['fake: succeed b']}").json()["missing_files"] == ["rows.csv"]
    refused = daemon.post(f"/v1/batches/{made['id']}/start").json()
    assert refused["n_changed"] == 2 and [(one["sample"], one["code"]) for one in refused["refused"]] == [("fake: succeed b", "files_missing")]
    daemon.upload(now["fake: succeed b"], "rows.csv", other, "measurements")
    assert daemon.post(f"/v1/batches/{made['id']}/start").json()["n_changed"] == 1
    assert ended(daemon, made["id"])["states"]["succeeded"] == 4
    assert [one["sample"] for one in daemon.get(f"/v1/batches/{made['id']}/results.json").json()["samples"]] == [one["sample"] for one in changed]


def test_a_job_that_was_deleted_or_edited_is_made_again(daemon):
    know_files(daemon)
    samples = [row("fake: succeed x"), row("fake: succeed y")]
    made = jobs_of(submit(daemon, "edited", samples))
    daemon.delete(f"/v1/jobs/{made['fake: succeed x']}")
    edited = dict(document(), sample="fake: succeed y", volume={"files": ["scan.tif"], "voxel_size_um": 1})
    assert daemon.put(f"/v1/jobs/{made['fake: succeed y']}/document", json=edited).status_code == 200
    again = submit(daemon, "edited", samples, expect=200, update=True)
    assert [one["outcome"] for one in again["samples"]] == ["new", "changed"]


@pytest.mark.parametrize("change, field, words", [
    (lambda t: t.update(name=""), "name", "name"),
    (lambda t: t.update(colour=1), "colour", "no member"),
    (lambda t: t.update(template=[]), "template", "job document"),
    (lambda t: t.update(samples=[]), "samples", "list"),
    (lambda t: t.update(samples=[5]), "samples[0]", "object"),
    (lambda t: t["samples"].append(row("fake: succeed a")), "samples[2].sample", "two rows"),
    (lambda t: t["samples"][1].update(sample=""), "samples[1].sample", "name"),
    (lambda t: t["samples"][1]["replace"].update({"volume.colour": 1}), "samples[1].volume.colour", "colour"),
    (lambda t: t["samples"][1]["replace"].update({"volume.files[7]": "x"}), "samples[1].replace.volume.files[7]", "no place"),
    (lambda t: t["samples"][1]["replace"].update({"volume..files": "x"}), "samples[1].replace.volume..files", "no path"),
    (lambda t: t["samples"][1]["replace"].update({"/volume/~2": "x"}), "samples[1].replace./volume/~2", "no path"),
    (lambda t: t["samples"][1]["replace"].update({"sample": "x"}), "samples[1].replace.sample", "row"),
    (lambda t: t["samples"][1].update(files=[]), "samples[1].files", "scan.tif"),
    (lambda t: t["samples"][1]["files"].append(described("more.tif", SCAN)), "samples[1].files", "more.tif"),
    (lambda t: t["samples"][1]["files"][0].pop("sha256"), "samples[1].files.sha256", "sha256"),
    (lambda t: t["samples"][1]["files"][0].update(sha256="g" * 64), "samples[1].sha256", "hexadecimal"),
    (lambda t: t["samples"][1]["files"][0].update(size=0), "samples[1].size", "empty"),
])
def test_a_bad_table_makes_nothing(daemon, change, field, words):
    t = table("bad", [row("fake: succeed a"), row("fake: succeed b")])
    change(t)
    body = problem(daemon.post("/v1/batches", json=t), 422, "invalid", field)
    assert words in body["detail"], body["detail"]
    assert all(one["name"] != "bad" for one in daemon.get("/v1/batches?limit=500").json()["batches"])


def test_all_bad_rows_are_named(daemon):
    t = table("bad rows", [row(f"fake: succeed {i}", **({"volume.colour": i} if i % 2 else {})) for i in range(6)])
    body = problem(daemon.post("/v1/batches", json=t), 422, "invalid", "samples[1].volume.colour")
    assert [e["field"] for e in body["errors"]] == [f"samples[{i}].volume.colour" for i in (1, 3, 5)]
    assert "sample 'fake: succeed 1'" in body["errors"][0]["detail"]


def test_lists_and_deletion_are_explicit_about_jobs(daemon):
    know_files(daemon)
    kept, gone = (submit(daemon, name, [row(f"fake: succeed {name}")]) for name in ("kept", "gone"))
    listed = daemon.get("/v1/batches?limit=2").json()
    assert [one["name"] for one in listed["batches"]] == ["gone", "kept"] and listed["next_cursor"]
    assert "kept" not in [one["name"] for one in daemon.get(f"/v1/batches?cursor={listed['next_cursor']}").json()["batches"]]
    problem(daemon.delete(f"/v1/batches/{kept['id']}"), 422, "invalid", "jobs")
    assert daemon.delete(f"/v1/batches/{kept['id']}?jobs=keep").status_code == 204
    assert daemon.delete(f"/v1/batches/{gone['id']}?jobs=delete").status_code == 204
    (job,) = jobs_of(kept).values()
    assert daemon.get(f"/v1/jobs/{job}").json()["batch"] is None
    (job,) = jobs_of(gone).values()
    problem(daemon.get(f"/v1/jobs/{job}"), 404, "not_found")
    for batch in (kept, gone):
        problem(daemon.get(f"/v1/batches/{batch['id']}"), 404, "not_found")
    problem(daemon.post("/v1/batches/nothing/start"), 404, "not_found")


def test_cancelling_and_starting_again(daemon_maker):
    d = daemon_maker(options={"jobs.workers": 1})
    know_files(d)
    made = submit(d, "c", [row("fake: climb"), row("fake: succeed 1"), row("fake: succeed 2")])
    d.post(f"/v1/batches/{made['id']}/start")
    wait_until(lambda: d.get(f"/v1/batches/{made['id']}").json()["states"]["running"])
    waiting = d.get(f"/v1/batches/{made['id']}").json()
    assert waiting["states"]["queued"] == 2 and 0 <= waiting["fraction"] < 0.4
    reply = d.post(f"/v1/batches/{made['id']}/cancel")
    assert reply.status_code == 202 and reply.json()["n_changed"] == 3
    assert ended(d, made["id"])["states"]["cancelled"] == 3
    assert d.post(f"/v1/batches/{made['id']}/cancel").status_code == 200
    assert d.post(f"/v1/batches/{made['id']}/retry").json()["n_changed"] == 0  # nothing has failed
    assert d.post(f"/v1/batches/{made['id']}/start").json()["n_changed"] == 3
    d.delete(f"/v1/batches/{made['id']}?jobs=delete")


def test_batches_of_an_owner_take_turns_and_priority_comes_first(daemon_maker):
    """With one worker: a long batch does not keep a short one or a single job waiting."""
    d = daemon_maker(options={"jobs.workers": 1})
    know_files(d)
    holder = d.start_job("climb")
    d.wait_state(holder, "running")
    long = submit(d, "long", [row(f"fake: succeed l{i}") for i in range(8)])
    short = submit(d, "short", [row(f"fake: succeed s{i}") for i in range(2)])
    urgent = submit(d, "urgent", [row(f"fake: succeed u{i}") for i in range(2)])
    for batch in (long, short):
        d.post(f"/v1/batches/{batch['id']}/start")
    single = d.start_job("series 1")
    d.post(f"/v1/batches/{urgent['id']}/start?priority=3")
    d.post(f"/v1/jobs/{holder}/cancel")
    for batch in (long, short, urgent):
        ended(d, batch["id"])
    d.wait_state(single, "succeeded")
    name = {job: sample[-2:] for batch in (long, short, urgent) for sample, job in jobs_of(batch).items()}
    name[single] = "one"
    order = [name[job] for job in sorted(name, key=lambda job: d.job(job)["started_unix_s"])]
    assert order[:2] == ["u0", "u1"], order
    assert [n for n in order if n[0] == "l"] == [f"l{i}" for i in range(8)]
    assert order.index("s1") < 7 and order.index("one") < 6, order


def test_progress_tells_when_it_ends(daemon_maker):
    d = daemon_maker(options={"jobs.workers": 2})
    know_files(d)
    d.wait_state(d.start_job("work 1"), "succeeded")
    made = submit(d, "eta", [row(f"fake: work {60 + i}") for i in range(5)])
    assert d.get(f"/v1/batches/{made['id']}").json()["expected_end_unix_s"] is None  # nothing is queued
    d.post(f"/v1/batches/{made['id']}/start")
    end = wait_until(lambda: d.get(f"/v1/batches/{made['id']}").json()["expected_end_unix_s"])
    assert time.time() - 5 < end < time.time() + 120
    reply = d.get(f"/v1/batches/{made['id']}")
    waited = d.get(f"/v1/batches/{made['id']}?wait=1", headers={"If-None-Match": reply.headers["ETag"]})
    assert waited.status_code in (200, 304)
    d.delete(f"/v1/batches/{made['id']}?jobs=delete")


def test_owners_and_quotas_hold(daemon_maker):
    d = daemon_maker()
    admin = d.of(d.make_token("root"))

    def user(name, **quota):
        return d.of(admin.post("/v1/tokens", json={"name": name, "scope": "submit", **quota}).json()["token"])
    ann, bob = user("ann"), user("bob", jobs=3)
    know_files(ann)
    made = submit(ann, "same name", [row("fake: succeed")])
    assert made["owner"] == "ann"
    for call in ((bob.get, ""), (bob.post, "/start"), (bob.post, "/cancel"), (bob.post, "/retry"), (bob.delete, "?jobs=delete"),
                 (bob.get, "/results.csv"), (bob.get, "/results.json")):
        problem(call[0](f"/v1/batches/{made['id']}{call[1]}"), 404, "not_found")
    assert bob.get("/v1/batches").json()["batches"] == [] and bob.get(f"/v1/jobs?batch={made['id']}").json()["jobs"] == []
    assert [one["name"] for one in admin.get("/v1/batches").json()["batches"]] == ["same name"]
    body = problem(bob.post("/v1/batches", json=table("same name", [row(f"fake: succeed {i}") for i in range(4)])), 507, "quota")
    assert (body["quota_jobs"], body["used"], body["wanted"]) == (3, 0, 4) and bob.get("/v1/batches").json()["batches"] == []
    other = submit(bob, "same name", [row("fake: succeed")])
    assert other["id"] != made["id"]
    # what ann has sent is not known to bob
    assert bob.get(f"/v1/jobs/{jobs_of(other)['fake: succeed']}").json()["missing_files"] == ["scan.tif", "rows.csv"]
    small = user("small", stored_bytes=1000)
    problem(small.post("/v1/batches", json=table("big", [row("fake: succeed")])), 507, "quota")
    assert small.get("/v1/batches").json()["batches"] == [] and small.get("/v1/jobs").json()["jobs"] == []


def test_limits(daemon_maker):
    d = daemon_maker(options={"jobs.max_jobs": 3, "server.max_batch_bytes": 5000})
    problem(d.post("/v1/batches", json=table("n", [row(f"fake: succeed {i}") for i in range(4)])), 429, "too_many")
    problem(d.post("/v1/batches", json=table("n", [row(f"fake: succeed {i}") for i in range(20)])), 413, "too_large")
    assert d.get("/v1/batches").json()["batches"] == []


def test_several_clients_submit_at_once(daemon):
    know_files(daemon)
    outcome = []

    def post():
        outcome.append(daemon.post("/v1/batches", json=table("race", [row(f"fake: succeed r{i}") for i in range(20)])))
    threads = [threading.Thread(target=post) for _ in range(6)]
    for t in threads:
        t.start()
    for t in threads:
        t.join()
    assert sorted(r.status_code for r in outcome) == [200] * 5 + [201]
    assert len({json.dumps(jobs_of(r.json()), sort_keys=True) for r in outcome}) == 1


def test_a_rebuild_brings_batches_back(daemon_maker):
    d = daemon_maker()
    know_files(d)
    made = submit(d, "rebuilt", [row("fake: succeed b"), row("fake: succeed a")])
    d.post(f"/v1/batches/{made['id']}/start")
    ended(d, made["id"])
    d.stop()
    for name in os.listdir(d.data):
        if name.startswith("selvedge.db"):
            os.remove(os.path.join(d.data, name))
    selvedged(d.data, "--rebuild")
    d.start()
    (batch,) = d.get("/v1/batches").json()["batches"]
    assert (batch["id"], batch["name"], batch["states"]["succeeded"]) == (made["id"], "rebuilt", 2)
    assert [one["sample"] for one in d.get(f"/v1/batches/{made['id']}/results.json").json()["samples"]] == ["fake: succeed b", "fake: succeed a"]
    again = d.post("/v1/batches", json=table("rebuilt", [row("fake: succeed b"), row("fake: succeed a")]))
    assert again.status_code == 200 and jobs_of(again.json()) == jobs_of(made)
    assert d.get(f"/v1/batches/{made['id']}").json()["template"] == document()


@pytest.mark.slow
def test_kills_leave_whole_batches(daemon_maker):
    """The daemon is killed while batches are submitted, started and retried. What was acknowledged is there."""
    d = daemon_maker(options={"jobs.workers": 2})
    know_files(d)
    samples = [row(f"fake: succeed k{i}") for i in range(20)]
    for i in range(5):
        killer = threading.Timer(0.01 + 0.02 * i, d.kill)
        killer.start()
        acknowledged = None
        try:
            r = d.session.post(d.url + "/v1/batches", json=table(f"kill {i}", samples), timeout=150)
            acknowledged = r.json() if r.status_code in (200, 201) else None
            if acknowledged:
                d.session.post(d.url + f"/v1/batches/{acknowledged['id']}/start", timeout=150)
        except OSError:
            pass
        killer.join()
        d.start()
        there = [one for one in d.get("/v1/batches?limit=500").json()["batches"] if one["name"] == f"kill {i}"]
        assert not there or there[0]["n_sample"] == 20, "a part of a batch"
        assert there or acknowledged is None, "an acknowledged batch is lost"
        made = submit(d, f"kill {i}", samples, expect=200 if there else 201)
        assert made["n_sample"] == 20 and (acknowledged is None or jobs_of(made) == jobs_of(acknowledged))
        d.post(f"/v1/batches/{made['id']}/start")
        assert ended(d, made["id"], 60)["states"]["succeeded"] == 20
        d.delete(f"/v1/batches/{made['id']}?jobs=delete")
    assert not os.listdir(os.path.join(d.data, "quarantine"))
