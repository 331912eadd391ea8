"""config/openapi.json is valid and is what the daemon serves. conftest.py compares every reply of every API test with
it."""
import json
import os
import re
import shutil
import subprocess

import hypothesis
import jsonschema
import pytest
import requests
from daemon_under_test import DOCUMENT, ROOT, TUS
from hypothesis import strategies as st
from openapi_check import METHODS, OpenApiCheck, load
from small_cloth import hair

API = load()
OPERATIONS = [(path, method, item[method]) for path, item in API["paths"].items() for method in METHODS if method in item]


def test_the_document_is_sound():
    assert API["openapi"].startswith("3.1.")
    ids = [o["operationId"] for _, _, o in OPERATIONS]
    assert len(ids) == len(set(ids)) >= 26
    for schema in API["components"]["schemas"].values():
        jsonschema.Draft202012Validator.check_schema(schema)
    text = json.dumps(API)
    for name in re.findall(r'"#/components/schemas/(\w+)"', text):
        assert name in API["components"]["schemas"]
    for path, method, operation in OPERATIONS:
        parameters = operation.get("parameters", []) + API["paths"][path].get("parameters", [])
        assert {p["name"] for p in parameters if p["in"] == "path"} == set(re.findall(r"\{(\w+)\}", path)), path
        assert operation["summary"] and all(r["description"] for r in operation["responses"].values())


def properties_without_description(schema, path):
    """Yields the paths of properties that say nothing of their meaning. Conditions (if, then) have none of their own."""
    for key, member in schema.get("properties", {}).items():
        if not member.get("description"):
            yield f"{path}.{key}"
    for key, member in schema.items():
        children = member.items() if key == "properties" else [(key, m) for m in (member if isinstance(member, list) else [member])]
        for name, child in children:
            if isinstance(child, dict) and key not in ("if", "then", "else", "default"):
                yield from properties_without_description(child, f"{path}.{name}")


def test_every_property_is_described():
    found = [p for name, schema in API["components"]["schemas"].items() for p in properties_without_description(schema, name)]
    assert found == []


def test_the_daemon_serves_it(daemon):
    assert daemon.get("/v1/openapi.json").json() == API


def generate_endpoints(root, *arguments):
    program = os.path.join(ROOT, "config", "generate_endpoints.py")
    return subprocess.run([program, "--root", root, *arguments], capture_output=True, text=True)


def test_table_and_page_follow_from_the_description():
    done = generate_endpoints(ROOT, "--check")
    assert done.returncode == 0, done.stdout + done.stderr


def test_a_new_operation_makes_table_and_page_stale(tmp_path):
    for name in ("config/openapi.json", "docs/api.md", "server/endpoints/endpoints.def"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(os.path.join(ROOT, name), tmp_path / name)
    assert generate_endpoints(tmp_path, "--check").returncode == 0
    api = load()
    api["paths"]["/v1/jobs/{id}/state"] = {"get": {"operationId": "getState", "x-scope": "read", "tags": ["Jobs"],
                                                   "summary": "Get the state of a job", "responses": {}}}
    (tmp_path / "config" / "openapi.json").write_text(json.dumps(api))
    stale = generate_endpoints(tmp_path, "--check")
    assert stale.returncode == 1 and "endpoints.def" in stale.stdout and "api.md" in stale.stdout
    assert generate_endpoints(tmp_path).returncode == 0
    row = 'ENDPOINT("GET", "/v1/jobs/{id}/state", get_state, NONE, ACCESS_READ, "")'
    assert row in (tmp_path / "server" / "endpoints" / "endpoints.def").read_text()
    assert "| `GET /v1/jobs/{id}/state` | Get the state of a job. |" in (tmp_path / "docs" / "api.md").read_text()
    assert generate_endpoints(tmp_path, "--check").returncode == 0


def test_every_operation_stands_in_a_section_of_the_page():
    with open(os.path.join(ROOT, "docs", "api.md")) as f:
        text = f.read()
    for path, method, operation in OPERATIONS:
        assert re.search(rf"^\| `{method.upper()} {re.escape(path)}[?`]", text, flags=re.M), (method, path)
        assert operation["tags"][0] in [tag["name"] for tag in API["tags"]]


def test_problem_codes_are_documented():
    with open(os.path.join(ROOT, "server", "jobs", "problem_code.c")) as f:
        source = f.read()
    with open(os.path.join(ROOT, "docs", "api.md")) as f:
        table = f.read().split("## Errors")[1]
    for code, status in re.findall(r'\{"(\w+)", (\d+), "', source):
        assert f"`{code}`" in table and status in table, code


def test_examples_fit_the_description():
    validator = OpenApiCheck().validator({"$ref": "#/components/schemas/JobDocument"})
    folder = os.path.join(ROOT, "config", "examples")
    documents = [name for name in os.listdir(folder) if name.endswith(".json")]
    for name in documents:
        with open(os.path.join(folder, name)) as f:
            validator.validate(json.load(f))
    assert len(documents) >= 5


def test_iterations_of_several_starts(daemon):
    """Description, daemon and guide state the same limit."""
    validator = OpenApiCheck().validator({"$ref": "#/components/schemas/JobDocument"})
    for starts, iterations, good in ((1, 501, True), (2, 500, True), (2, 501, False)):
        document = {"sample": "s", "volume": {"files": ["a.tif"]}, "measurements": {"file": "a.csv"},
                    "fit": {"starts": starts, "max_iterations": iterations}}
        assert validator.is_valid(document) == good
        assert daemon.post("/v1/jobs", json=document).status_code == (201 if good else 422)
    with open(os.path.join(ROOT, "docs", "options.md")) as f:
        rows = [line for line in f if line.startswith("| `max_iterations` ")]
    assert len(rows) == 1 and "several `starts` 1..500" in rows[0]


EVERYTHING = {
    "sample": "everything", "lamp": {"side_cm": 5}, "camera": {"crop_cm": 2}, "black_sheet": False,
    "volume": {"files": ["a.raw"], "raw": {"shape": [9, 9, 9], "type": "uint8"}, "filter": {"h": 5},
               "voxel_size_um": [1, 1, 2], "matrix": [1, 0, 0, 0, 1, 0, 0, 0, 1]},
    "photographs": [{"file": "a.exr", "light_theta_deg": 120, "light_phi_deg": 0, "camera_theta_deg": 1, "camera_phi_deg": 0, "crop_px": [0, 0, 8, 8]}],
    "fit": {"models": ["two_lobe.v1", "microflake.v1"], "fit_radius": {"lower_um": 3}, "tied": [["C_R"], {"beta_TT": 1, "gamma_TT": 2}],
            "bounds": {"beta_R": [2, 8]},
            "priors": {"beta_R": {"mean": 5, "se": 1}}, "nuisance": {"gain": "global"}, "texture": {"block_mm": 1}, "fixed": {"C_TT": [0.1, 0.2, 0.3]},
            "fit_density": True,
            "start": {"C_R.g": 0.2}, "candidates": [{"light_theta_deg": 30, "light_phi_deg": 0, "camera_theta_deg": 1, "camera_phi_deg": 0}]}}


def objects_within(value, path=""):
    if isinstance(value, dict):
        yield path, value
        for key, member in value.items():
            yield from objects_within(member, f"{path}.{key}" if path else key)
    elif isinstance(value, list):
        for i, member in enumerate(value):
            yield from objects_within(member, f"{path}[{i}]")


def test_unknown_fields_are_refused_wherever_they_stand(daemon):
    assert daemon.post("/v1/jobs", json=EVERYTHING).status_code == 201
    for path, _ in objects_within(EVERYTHING):
        document = json.loads(json.dumps(EVERYTHING))
        dict(objects_within(document))[path]["colour"] = 1
        r = daemon.post("/v1/jobs", json=document)
        assert r.status_code == 422 and r.json()["code"] == "invalid", (path, r.text)
        # a name in a list of tied parameters stands for the list
        assert r.json()["field"] in ((path + "." if path else "") + "colour", path), (path, r.json())
        assert "colour" in r.json()["detail"], (path, r.json())


def test_every_operation_answers_as_documented(daemon, daemon_maker):
    """Calls each operation successfully once; the fixture compares every reply with the description."""
    job = daemon.start_job("series 20")
    daemon.wait_state(job, "succeeded")
    draft = daemon.create()
    upload = daemon.declare(draft, "scan.tif", b"0123456789")["upload_url"]
    done = set()

    def call(operation, method, path, **more):
        r = daemon.request(method, path, **more)
        assert r.status_code < 400, (operation, r.status_code, r.text)
        done.add(operation)
        return r

    call("uploadOptions", "OPTIONS", upload)
    call("uploadOffset", "HEAD", upload, headers=TUS)
    assert daemon.patch(upload, 0, b"0123456789").status_code == 204
    done.add("uploadBytes")
    call("checkDocument", "POST", "/v1/check", json=DOCUMENT)
    call("checkJob", "POST", f"/v1/jobs/{draft}/check")
    call("planJob", "POST", f"/v1/jobs/{draft}/plan")
    call("findInput", "GET", "/v1/inputs", params={"sha256": "0" * 64})
    call("listFiles", "GET", f"/v1/jobs/{draft}/files")
    call("getFile", "GET", f"/v1/jobs/{draft}/files/scan.tif")
    call("deleteFile", "DELETE", f"/v1/jobs/{draft}/files/scan.tif")
    call("declareFiles", "POST", f"/v1/jobs/{draft}/files", json={"name": "a.tif", "role": "volume", "size": 4})
    upload = daemon.job(draft)["files"][0]["upload_url"]
    call("terminateUpload", "DELETE", upload, headers=TUS)
    call("replaceDocument", "PUT", f"/v1/jobs/{draft}/document", json=DOCUMENT)
    call("listJobs", "GET", "/v1/jobs")
    call("createJob", "POST", "/v1/jobs", json=DOCUMENT)
    call("getJob", "GET", f"/v1/jobs/{job}")
    call("getSeries", "GET", f"/v1/jobs/{job}/series?max_points=5")
    call("getLog", "GET", f"/v1/jobs/{job}/log")
    call("listResults", "GET", f"/v1/jobs/{job}/results")
    call("getResult", "GET", f"/v1/jobs/{job}/results/result.json")
    call("getArchive", "GET", f"/v1/jobs/{job}/results.tar")
    call("getPictures", "GET", f"/v1/jobs/{job}/pictures")
    assert daemon.post(f"/v1/jobs/{job}/pictures/start").status_code == 409  # jobs.pictures is off; test_picture_stage starts it
    done.add("startPictures")
    call("stopPictures", "POST", f"/v1/jobs/{job}/pictures/stop")
    call("listVersions", "GET", f"/v1/jobs/{job}/versions")
    call("getVersion", "GET", f"/v1/jobs/{job}/versions/1")
    call("getVersionFile", "GET", f"/v1/jobs/{job}/versions/1/result.json")
    call("startJob", "POST", f"/v1/jobs/{job}/start")
    call("cancelJob", "POST", f"/v1/jobs/{draft}/cancel")
    other = daemon.start_job("fail")
    daemon.wait_state(other, "failed")
    call("retryJob", "POST", f"/v1/jobs/{other}/retry")
    call("putTags", "PUT", f"/v1/jobs/{draft}/tags", json={"tags": ["a"]})
    call("listTags", "GET", "/v1/tags")
    call("actOnJobs", "POST", "/v1/actions", json={"action": "cancel", "jobs": [draft]})
    call("deleteJob", "DELETE", f"/v1/jobs/{draft}")
    batch = call("submitBatch", "POST", "/v1/batches", json={"name": "b", "template": {"measurements": {"file": "rows.csv"}, "geometry": {"job": job}},
                 "samples": [{"sample": "fake: fail", "files": [{"name": "rows.csv", "size": 5, "sha256": "0" * 64}]}]}).json()["id"]
    call("listBatches", "GET", "/v1/batches")
    call("startBatch", "POST", f"/v1/batches/{batch}/start")
    call("getBatch", "GET", f"/v1/batches/{batch}")
    call("getBatchPlan", "GET", f"/v1/batches/{batch}/plan?cores=8")
    call("cancelBatch", "POST", f"/v1/batches/{batch}/cancel")
    call("retryBatch", "POST", f"/v1/batches/{batch}/retry")
    call("getBatchResults", "GET", f"/v1/batches/{batch}/results.json")
    call("getBatchTable", "GET", f"/v1/batches/{batch}/results.csv")
    call("deleteBatch", "DELETE", f"/v1/batches/{batch}?jobs=delete")
    call("listDeliveries", "GET", "/v1/deliveries")
    results = os.path.join(daemon.data, "jobs", job, "results")
    with open(os.path.join(results, "fibers.hair"), "wb") as f:
        f.write(hair())
    with open(os.path.join(results, "result.json"), "w", encoding="utf-8") as f:
        json.dump({"sample": "s", "model": "isotropic.v1", "parameters": [{"name": f"C.{c}", "set": None, "value": 0.5} for c in "rgb"], "rows": []}, f)
    call("deriveJob", "POST", f"/v1/jobs/{job}/derive", json={"pictures": [{"on": "mesh", "mesh_file": "a.obj", "light_theta_deg": 45, "light_phi_deg": 0,
                                                                            "camera_theta_deg": 30, "camera_phi_deg": 180}]})
    made = call("makeShare", "POST", f"/v1/jobs/{job}/shares", json={}).json()
    call("listShares", "GET", f"/v1/jobs/{job}/shares")
    call("openShare", "POST", "/v1/shared", json={"secret": made["secret"]})
    call("revokeShare", "DELETE", f"/v1/jobs/{job}/shares/{made['id']}")
    call("keepJob", "PUT", f"/v1/jobs/{job}/keep")
    call("unkeepJob", "DELETE", f"/v1/jobs/{job}/keep")
    call("planRetention", "GET", "/v1/retention?max_bytes=1")
    call("removeByRetention", "POST", "/v1/retention", json={"jobs": [job, "nonsense"]})
    call("listRemovals", "GET", "/v1/removals")
    for operation, path in [("about", "/v1/about"), ("options", "/v1/options"), ("openapi", "/v1/openapi.json"),
                            ("livez", "/livez"), ("readyz", "/readyz"), ("metrics", "/metrics")]:
        call(operation, "GET", path)
    guarded = daemon_maker("guarded")
    daemon, admin = guarded, guarded.make_token("root")
    call("signIn", "POST", "/v1/session", json={"token": admin})
    call("getSession", "GET", "/v1/session")
    call("makeToken", "POST", "/v1/tokens", json={"name": "user", "scope": "read", "jobs": 3})
    call("listTokens", "GET", "/v1/tokens")
    call("revokeToken", "DELETE", "/v1/tokens/user")
    call("signOut", "DELETE", "/v1/session")
    assert done == {o["operationId"] for _, _, o in OPERATIONS}


JSON = st.recursive(st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text(max_size=20),
                    lambda x: st.lists(x, max_size=4) | st.dictionaries(st.text(max_size=12), x, max_size=4), max_leaves=12)
NEAR_JOB = st.fixed_dictionaries({}, optional={
    "sample": st.text(max_size=30) | JSON, "volume": st.fixed_dictionaries({}, optional={
        "files": st.lists(st.sampled_from(["scan.tif", "../x", ""]), max_size=3) | JSON, "voxel_size_um": st.floats(-1, 5) | JSON,
        "axes": st.sampled_from(["xyz", "xxy"]) | JSON}),
    "measurements": JSON, "photographs": JSON, "fit": JSON, "lamp": JSON, "camera": JSON, "fibers": JSON})
NEAR_FILE = st.fixed_dictionaries({}, optional={"name": st.sampled_from(["a.tif", "../b", ""]) | JSON, "role": st.sampled_from(["volume", "poem"]) | JSON,
                                                "size": st.integers(-1, 3000) | JSON, "sha256": st.just("0" * 64) | JSON})
NEAR_ROW = st.fixed_dictionaries({"sample": st.sampled_from(["s", "t", ""]) | JSON}, optional={
    "replace": st.dictionaries(st.sampled_from(["volume.files[0]", "/fit/seed", "a.b", "a[", ""]), JSON) | JSON,
    "files": st.lists(NEAR_FILE | JSON, max_size=3) | JSON})
NEAR_BATCH = st.fixed_dictionaries({"name": st.sampled_from(["a", "b"]), "template": NEAR_JOB | JSON, "samples": st.lists(NEAR_ROW, max_size=4) | JSON},
                                   optional={"update": st.booleans() | JSON})
WORD = st.text(st.characters(min_codepoint=33, max_codepoint=126, blacklist_characters="#?/%\\"), min_size=1, max_size=40).filter(
    lambda w: w not in (".", ".."))


@hypothesis.settings(max_examples=400, deadline=None, derandomize=True, suppress_health_check=list(hypothesis.HealthCheck))
@hypothesis.given(data=st.data())
def test_random_requests_get_documented_answers(daemon, data):
    """Near-valid and random requests always get a documented status, and never a 5xx except for a full disk."""
    path, method, operation = data.draw(st.sampled_from(OPERATIONS))
    if not hasattr(daemon, "fuzz_job"):
        daemon.fuzz_job = daemon.create()
    url = path.replace("{id}", data.draw(st.just(daemon.fuzz_job) | WORD)) if "{id}" in path else path
    for name in re.findall(r"\{(\w+)\}", url):
        url = url.replace("{%s}" % name, requests.utils.quote(data.draw(WORD), safe=""))
    if url.endswith(daemon.fuzz_job) and method == "delete":
        return
    query, headers = {}, {}
    for p in operation.get("parameters", []):
        value = data.draw(st.integers(-3, 10**20).map(str) | WORD | st.sampled_from(["all", "last", "draft", "bytes=0-5", "*", "1.0.0", "0"]))
        if p["in"] == "query" and data.draw(st.booleans()):
            query[p["name"]] = value
        if p["in"] == "header" and data.draw(st.booleans()):
            headers[p["name"]] = value
    body = None
    if "requestBody" in operation:
        kind = next(iter(operation["requestBody"]["content"]))
        headers["Content-Type"] = data.draw(st.sampled_from([kind] * 4 + ["text/plain"]))
        near = NEAR_FILE if path.endswith("/files") else NEAR_BATCH if path == "/v1/batches" else NEAR_JOB
        body = data.draw((near | JSON).map(lambda j: json.dumps(j).encode()) | st.binary(max_size=60))
    r = daemon.request(method.upper(), url, params=query, headers=headers, data=body)
    assert r.status_code < 500 or r.status_code == 507, r.text


@pytest.fixture(scope="module", autouse=True)
def coverage_of_the_check(daemon):
    yield
    assert isinstance(daemon.check, OpenApiCheck) and len(daemon.check.seen) > 40
