"""A power cut at any moment: every state that the disk may have is rebuilt from a record of calls, a daemon starts on
it, and everything that was confirmed before the cut is there.

disks/disk_states.py says what a disk is taken to do. SELVEDGE_EVERY=1 (make test-crash) tries every state in place of
a sample. test_power_paths.py has the other things that are confirmed.
Two tests leave out syncs from the record: the same checks must notice that something is missing."""
import os
import random

import pytest
from daemon_under_test import FILES, TUS, Daemon, document, program, wait_until
from fit_outcome import outcome
from disks.disk_states import Disk, save_all, save_least, save_some
from disks.replay import EVERY, content_of, record, try_states
from small_cloth import start_small_job

WORKER = program("selvedge-worker")
FIT = {"sample": "power", "fibers": {"file": "cloth.hair"}, "measurements": {"file": "rows.csv"},
       "fit": {"model": "two_lobe.v1", "path_budget": 160000, "max_iterations": 12, "render_px": 8, "render_samples": 1, "seed": 7}}
SMALL_COMMITS = {"upload.commit_bytes": 1 << 16}


def upload_in_pieces(d, journal, job, rng):
    data = {name: rng.randbytes(rng.randint(3000, 9000)) for name in FILES}
    url = {name: d.declare(job, name, data[name], FILES[name][0])["upload_url"] for name in FILES}
    at = dict.fromkeys(FILES, 0)
    journal.say(job, files={name: (url[name], data[name], 0) for name in FILES})
    while any(at[name] < len(data[name]) for name in FILES):
        name = rng.choice([n for n in FILES if at[n] < len(data[n])])
        piece = data[name][at[name]:at[name] + rng.randint(1, 4000)]
        assert d.patch(url[name], at[name], piece).status_code == 204
        at[name] += len(piece)
        journal.say(job, files={name: (url[name], data[name], at[name])})


def create(d, journal, behaviour, key):
    doc = document(behaviour)
    job = d.create(doc, **{"Idempotency-Key": key})
    journal.say(job, key=key, created=doc, samples=[doc["sample"]], deleted=False)
    return job


def start(d, journal, job, *ends):
    journal.say(job, draft=False)
    assert d.post(f"/v1/jobs/{job}/start").status_code == 202
    journal.say(job, started=True, ends=ends)


def service_scenario(d, journal, rng):
    """Jobs that succeed, fail, are edited, cancelled and deleted, with uploads in pieces."""
    first = create(d, journal, "succeed", "first")
    upload_in_pieces(d, journal, first, rng)
    start(d, journal, first, "succeeded")
    edited = create(d, journal, "succeed", "edited")
    d.wait_state(first, "succeeded")
    journal.say(edited, samples=["fake: succeed", "fake: fail"])
    assert d.put(f"/v1/jobs/{edited}/document", json=document("fail")).status_code == 200
    journal.say(edited, samples=["fake: fail"])
    upload_in_pieces(d, journal, edited, rng)
    start(d, journal, edited, "failed")
    d.wait_state(edited, "failed")
    cancelled = create(d, journal, "work", "cancelled")
    upload_in_pieces(d, journal, cancelled, rng)
    start(d, journal, cancelled)
    journal.say(cancelled, ends=("cancelled", "running", "queued"))
    assert d.post(f"/v1/jobs/{cancelled}/cancel").status_code in (200, 202)
    journal.say(cancelled, ends=("cancelled",))
    journal.say(first, deleted=None)
    assert d.delete(f"/v1/jobs/{first}").status_code == 204
    journal.say(first, deleted=True)
    d.wait_state(cancelled, "cancelled")


def check_files(d, job, files, draft):
    for name, (url, data, confirmed) in files.items():
        if draft and confirmed < len(data):
            r = d.request("HEAD", url, headers=TUS)
            assert r.status_code == 200, f"upload of {name}: {r.status_code}"
            offset = int(r.headers["Upload-Offset"])
            assert confirmed <= offset <= len(data), f"{name}: {confirmed} bytes were confirmed, {offset} are there"
            if offset < len(data):
                assert d.patch(url, offset, data[offset:]).status_code == 204, name
        content = d.get(f"/v1/jobs/{job}/files/{name}").content
        assert content == data, f"{name} of {len(data)} bytes differs, {confirmed} were confirmed"


def check_job(d, job, expected):
    r = d.get(f"/v1/jobs/{job}")
    if expected["deleted"] is not False and r.status_code == 404:
        return
    assert r.status_code == 200 and not expected["deleted"], f"{r.status_code}, deleted: {expected['deleted']}"
    state = r.json()["state"]
    assert r.json()["sample"] in expected["samples"]
    assert not expected.get("started") or state != "draft", "the start is forgotten"
    check_files(d, job, expected["files"], state == "draft")
    if expected.get("ends"):  # the fake worker syncs no results, so only the state is looked at
        wait_until(lambda: d.get(f"/v1/jobs/{job}").json()["state"] in expected["ends"], what=f"{job}: {expected['ends']}")
    if expected["deleted"] is False:
        again = d.post("/v1/jobs", json=expected["created"], headers={"Idempotency-Key": expected["key"]})
        assert again.status_code in (200, 201) and again.json()["id"] == job, "the key is forgotten"


def check_service(folder, expected):
    """Starts a daemon on this disk. Everything that is expected holds, and new jobs can be made."""
    d = Daemon(folder, options=SMALL_COMMITS).start()
    try:
        for job, what in expected.items():
            check_job(d, job, what)
        assert d.get(f"/v1/jobs/{d.ready_job()}").json()["state"] == "draft"
    finally:
        d.kill()


@pytest.fixture(scope="module")
def service(tmp_path_factory):
    rng = random.Random(3)
    return record(tmp_path_factory.mktemp("service"), lambda d, j: service_scenario(d, j, rng), options=SMALL_COMMITS)


def test_nothing_confirmed_is_lost_by_the_service(service, memory_folder):
    n, lost = try_states(*service, memory_folder, check_service)
    print(f"{len(service[0])} calls, {n} states, {len(lost)} with a loss")
    assert n > 30 and not lost, lost


@pytest.mark.parametrize("part", [b"/upload/", b"selvedge.db"])
def test_a_missing_sync_is_found(service, memory_folder, part):
    """The syncs of uploads, or those of the database (as with synchronous=OFF), are left out of the record."""
    calls, journal = service
    calls = [c for c in calls if c.name != "sync" or part not in c.path]
    n, lost = try_states(calls, journal, memory_folder, check_service, enough=1)
    print(f"{n} states until {lost}")
    assert lost


def fit_scenario(d, journal):
    job = start_small_job(d, FIT)
    journal.say(job, started=True, results=None)
    assert d.wait_state(job, "succeeded", "failed", timeout_s=120)["state"] == "succeeded"
    journal.say(job, results=content_of(os.path.join(d.data, "jobs", job, "results")))


@pytest.fixture(scope="module")
def fit(tmp_path_factory):
    """(calls, journal, folder with the finished job)"""
    folder = tmp_path_factory.mktemp("fit")
    return *record(folder, fit_scenario, worker=WORKER), folder / "data"


def check_fit(folder, expected, whole):
    """The job ends as it would have without the cut. Results that were there already have not changed."""
    d = Daemon(folder, worker=WORKER).start()
    try:
        for job, what in expected.items():
            before = content_of(os.path.join(folder, "jobs", job, "results"))
            assert what["results"] is None or before == what["results"], "results that were there before differ"
            assert d.wait_state(job, "succeeded", "failed", timeout_s=120)["state"] == "succeeded"
            assert outcome(os.path.join(folder, "jobs", job)) == outcome(os.path.join(whole, "jobs", job))
    finally:
        d.kill()


def test_a_fit_goes_on_after_a_power_cut(fit, memory_folder):
    """Cuts between the start of the job and its end, and one after it has succeeded."""
    calls, journal, whole = fit
    rng = random.Random(2)
    started = next(i for i, c in enumerate(calls) if c.path.endswith(b"/attempt.json") or c.target.endswith(b"/attempt.json"))
    cuts = sorted(rng.sample(range(started, len(calls)), 60 if EVERY else 4)) + [len(calls) - 1]
    disk, done = Disk(), 0
    for cut in cuts:
        for call in calls[done:cut + 1]:
            disk.apply(call)
        done = cut + 1
        rng.choice([save_least, save_all, lambda *to: save_some(*to, rng)])(disk, memory_folder / "cut")
        check_fit(memory_folder / "cut", journal.before(calls[done].begin_s if done < len(calls) else float("inf")), whole)


def test_results_that_were_not_synced_are_missed(fit, memory_folder):
    calls, journal, whole = fit
    disk = Disk()
    for call in calls:
        if call.name != "sync" or b"/results" not in call.path:
            disk.apply(call)
    save_least(disk, memory_folder / "cut")
    with pytest.raises(AssertionError, match="results that were there"):
        check_fit(memory_folder / "cut", journal.before(float("inf")), whole)
