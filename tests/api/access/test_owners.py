"""What belongs to one owner does not exist for another one."""
import json
import re
import uuid

import pytest
from daemon_under_test import DOCUMENT, FILES, TUS, Daemon, document, problem, wait_until
from openapi_check import METHODS, load
from test_tokens import make

OPERATIONS = [(path, method, item[method]) for path, item in load()["paths"].items() for method in METHODS if method in item]
ABOUT_JOBS = [o for o in OPERATIONS if "{id}" in o[0] or "{upload}" in o[0] or "{batch}" in o[0]]


@pytest.fixture(scope="module")
def shared(tmp_path_factory):
    """ann's job has succeeded, and her draft has an upload; bob may submit, root sees all."""
    with Daemon(tmp_path_factory.mktemp("shared") / "data", options={"jobs.workers": 2}) as d:
        d.admin = d.of(d.make_token("root"))
        for name in ("ann", "bob"):
            setattr(d, name, d.of(make(d.admin, name)))
        d.auditor = d.of(make(d.admin, "auditor", "read", owner="ann"))
        d.job_of_ann = d.ann.start_job("series 20")
        d.ann.wait_state(d.job_of_ann, "succeeded")
        d.draft_of_ann = d.ann.create()
        d.batch_of_ann = make_batch(d.ann)
        d.upload_of_ann = d.ann.declare(d.draft_of_ann, "scan.tif", b"0123456789")["upload_url"].rsplit("/", 1)[1]
        yield d


def make_batch(user):
    r = user.post("/v1/batches", json={"name": str(uuid.uuid4()), "template": {"measurements": {"file": "rows.csv"}, "geometry": {"job": str(uuid.uuid4())}},
                                       "samples": [{"sample": "fake: succeed", "files": [{"name": "rows.csv", "size": 5, "sha256": "0" * 64}]}]})
    assert r.status_code == 201, r.text
    return r.json()["id"]


def call(user, path, method, operation, job, upload, batch):
    """A request that would succeed for its owner, as far as one request alone can."""
    path = path.replace("{batch}", batch)
    url = path.replace("{id}", job).replace("{upload}", upload).replace("{name}", "scan.tif").replace("{path}", "result.json").replace("{version}", "1")
    more = {"headers": {}}
    if "{upload}" in path:
        more["headers"].update(TUS)
    if "requestBody" in operation:
        kind = next(iter(operation["requestBody"]["content"]))
        more["headers"]["Content-Type"] = kind
        more["data"] = {"deriveJob": json.dumps({"export": {"usd": True}}), "makeShare": "{}",
                        "replaceDocument": json.dumps(DOCUMENT), "uploadBytes": b"01234", "putTags": json.dumps({"tags": ["a"]}),
                        "declareFiles": json.dumps({"name": "more.tif", "role": "volume", "size": 3})}.get(operation["operationId"], "{}")
    if operation["operationId"] == "deleteBatch":
        url += "?jobs=delete"
    if operation["operationId"] == "uploadBytes":
        more["headers"]["Upload-Offset"] = "0"
    return user.request(method.upper(), url, **more)


def told(reply, *ids):
    """All that a reply tells, without the ids that the client has stated itself."""
    text = reply.text
    for one in ids:
        text = text.replace(one, "ID")
    return reply.status_code, text, {k: v for k, v in reply.headers.items() if k not in ("Date", "Content-Length")}


def test_every_route_hides_the_jobs_of_others(shared):
    """Walks the description of the API, so a new operation is tested without being listed here."""
    unknown_job, unknown_upload, unknown_batch = str(uuid.uuid4()), str(uuid.uuid4()), str(uuid.uuid4())
    before = shared.ann.get(f"/v1/jobs/{shared.draft_of_ann}").text
    for path, method, operation in ABOUT_JOBS:
        for job in (shared.job_of_ann, shared.draft_of_ann):
            foreign = call(shared.bob, path, method, operation, job, shared.upload_of_ann, shared.batch_of_ann)
            assert foreign.status_code == 404, (path, method, foreign.text)
            unknown = call(shared.bob, path, method, operation, unknown_job, unknown_upload, unknown_batch)
            assert told(foreign, job, shared.upload_of_ann, shared.batch_of_ann) == told(unknown, unknown_job, unknown_upload, unknown_batch), (path, method)
    assert shared.ann.get(f"/v1/jobs/{shared.draft_of_ann}").text == before
    assert len(ABOUT_JOBS) >= 19


def test_the_same_requests_work_for_the_owner_and_for_admin(shared):
    """Else the test before could pass with a broken request."""
    for user in (shared.ann, shared.admin):
        job = shared.ann.start_job("series 20")
        shared.ann.wait_state(job, "succeeded")
        draft = shared.ann.create()
        upload = shared.ann.declare(draft, "scan.tif", b"0123456789")["upload_url"].rsplit("/", 1)[1]
        batch = make_batch(shared.ann)
        for path, method, operation in sorted(ABOUT_JOBS, key=lambda o: o[1] == "delete"):
            if method == "delete" and "{upload}" not in path:  # deleted below
                continue
            on = draft if operation["operationId"] in ("replaceDocument", "declareFiles", "cancelJob") else job
            r = call(user, path, method, operation, on, upload, batch)
            conflict = r.status_code == 409 and operation["operationId"] in ("retryJob", "planJob", "deriveJob", "startPictures")
            assert r.status_code < 300 or conflict, (path, method, r.text)
        assert user.delete(f"/v1/jobs/{job}/files/rows.csv").status_code == 204
        assert user.delete(f"/v1/jobs/{job}").status_code == 204
        assert user.delete(f"/v1/batches/{batch}?jobs=delete").status_code == 204


def test_lists_show_the_own_jobs_only(shared):
    mine = [shared.bob.create() for _ in range(5)]
    listed, cursor = [], ""
    while cursor is not None:
        page = shared.bob.get(f"/v1/jobs?limit=2&cursor={cursor}" if cursor else "/v1/jobs?limit=2").json()
        assert {j["owner"] for j in page["jobs"]} <= {"bob"}
        listed += [j["id"] for j in page["jobs"]]
        cursor = page["next_cursor"]
    assert listed == mine[::-1]
    assert [j["id"] for j in shared.bob.get("/v1/jobs?state=draft").json()["jobs"]] == listed
    assert shared.bob.get("/v1/jobs?state=succeeded").json()["jobs"] == []
    theirs = {j["id"] for j in shared.ann.get("/v1/jobs?limit=500").json()["jobs"]}
    assert shared.job_of_ann in theirs and not theirs & set(mine)
    assert {j["id"] for j in shared.auditor.get("/v1/jobs?limit=500").json()["jobs"]} == theirs  # another token of the same owner
    everyone = {j["id"] for j in shared.admin.get("/v1/jobs?limit=500").json()["jobs"]}
    assert everyone == theirs | set(mine)
    problem(shared.auditor.post(f"/v1/jobs/{shared.job_of_ann}/start"), 403, "scope")


def test_keys_of_idempotency_are_of_their_owner(shared):
    first = shared.ann.create(**{"Idempotency-Key": "batch-1"})
    other = shared.bob.create(document("succeed", lamp={"side_cm": 9}), **{"Idempotency-Key": "batch-1"})
    assert first != other
    assert shared.ann.create(**{"Idempotency-Key": "batch-1"}) == first


def test_only_the_owner_s_geometry_is_adopted(shared):
    def start(user, geometry):
        job = user.create({"sample": "fake: succeed", "measurements": {"file": "rows.csv"}, "geometry": {"job": geometry}})
        user.upload(job, "rows.csv", FILES["rows.csv"][1], "measurements")
        return user.post(f"/v1/jobs/{job}/start")

    assert start(shared.ann, shared.job_of_ann).status_code == 202
    unknown = str(uuid.uuid4())
    texts = []
    for user, geometry in ((shared.bob, shared.job_of_ann), (shared.bob, unknown), (shared.admin, shared.job_of_ann)):
        r = start(user, geometry)
        problem(r, 422, "invalid", "geometry.job")
        texts.append(r.text.replace(geometry, "ID"))
    assert len(set(texts)) == 1


def test_deliveries_are_of_the_job_s_owner(daemon_maker, tmp_path):
    (tmp_path / "secret").write_text("s" * 20)
    (tmp_path / "secret").chmod(0o600)
    d = daemon_maker(options={"webhook.url": "http://127.0.0.1:9/", "webhook.retry_s": 3600, "webhook.secret_file": tmp_path / "secret"})
    admin = d.of(d.make_token("root"))
    ann, bob = d.of(make(admin, "ann")), d.of(make(admin, "bob"))
    job = ann.create()
    ann.post(f"/v1/jobs/{job}/cancel")
    for query in ("", f"?job={job}"):
        wait_until(lambda q=query: len(ann.get("/v1/deliveries" + q).json()["deliveries"]) == 1)
        assert len(admin.get("/v1/deliveries" + query).json()["deliveries"]) == 1
        assert bob.get("/v1/deliveries" + query).json()["deliveries"] == []


def test_a_page_of_an_owner_is_found_by_an_index(shared):
    """The plan of each query of a list names an index with the owner, so its cost does not grow with the jobs of others."""
    import os
    import sqlite3

    with open(os.path.join(os.path.dirname(__file__), "..", "..", "..", "server", "store", "store_list.c"), encoding="utf-8") as f:
        assert re.search(r"owner = \?4", f.read())
    with sqlite3.connect(os.path.join(shared.data, "selvedge.db"), timeout=10) as db:
        for where, index in (("owner = 'a'", "job_owner"), ("state = 4 AND owner = 'a'", "job_owner_state")):
            plan = " ".join(row[3] for row in db.execute(
                f"EXPLAIN QUERY PLAN SELECT * FROM job WHERE deleted = 0 AND serial < 9 AND {where} ORDER BY serial DESC LIMIT 5"))
            assert re.search(rf"INDEX {index} ", plan) and "TEMP B-TREE" not in plan, plan
