"""A daemon for tests on a free loopback port with a data folder of its own, and helpers for the API.

with Daemon(folder) as d: d.post("/v1/jobs", json=document)
Programs come from SELVEDGE_BUILD (default: build/ of this tree). With SELVEDGE_TEST_STORE=postgresql every daemon has a
database of a PostgreSQL server that is started for the tests."""
import atexit
import copy
import hashlib
import os
import signal
import shutil
import subprocess
import sys
import tempfile
import time

import requests

from openapi_check import OpenApiCheck
from servers.postgres_server import PostgresServer

ROOT = os.path.abspath(os.path.join(os.path.dirname(__file__), "..", "..", ".."))
BUILD = os.path.join(ROOT, os.environ.get("SELVEDGE_BUILD") or "build")
FAKE_WORKER = os.path.join(ROOT, "tests", "support", "python", "fake_worker.py")
TUS = {"Tus-Resumable": "1.0.0"}
DOCUMENT = {"sample": "fake: succeed", "volume": {"files": ["scan.tif"], "voxel_size_um": 2.0},
            "measurements": {"file": "rows.csv"}}
FILES = {"scan.tif": ("volume", b"II*\0 not really a scan" * 100), "rows.csv": ("measurements", b"set,r,g,b\n" * 20)}
# output of a sanitizer or valgrind must not be mistaken for a normal start
TIMEOUT_S = float(os.environ.get("SELVEDGE_TEST_PATIENCE", "1"))
# a worker that a sanitizer observes needs its settings
SANITIZED = {"jobs.pass_environment": "PATH LANG LC_ALL ASAN_OPTIONS TSAN_OPTIONS UBSAN_OPTIONS"} if os.environ.get("SELVEDGE_SANITIZED") else {}


def program(name):
    return os.path.join(BUILD, "bin", name)


def document(behaviour="succeed", **more):
    return dict(DOCUMENT, sample=f"fake: {behaviour}", **more)


def sha256(data):
    return hashlib.sha256(data).hexdigest()


class SharedStore:
    """One PostgreSQL server for all tests of a process, with a database for each data folder."""
    server = None
    databases = {}

    @classmethod
    def options(cls, data):
        """Settings of a daemon with this data folder."""
        if os.environ.get("SELVEDGE_TEST_STORE", "sqlite") == "sqlite":
            return {}
        if cls.server is None:
            cls.folder = tempfile.mkdtemp(prefix="selvedge-postgres-")
            cls.server = PostgresServer().__enter__()
            atexit.register(cls.end)
        if not os.path.isdir(data):  # a new folder of an old name
            cls.databases.pop(data, None)
        database = cls.databases.setdefault(data, None) or cls.server.make_database()
        cls.databases[data] = database
        return store_options(cls.server, database, cls.folder)

    @classmethod
    def end(cls):
        cls.server.__exit__()
        shutil.rmtree(cls.folder, ignore_errors=True)


def store_options(server, database, folder):
    """Settings of a daemon for a database of a PostgresServer; the file with the password is put into the folder."""
    path = os.path.join(str(folder), "store-password")
    with open(path, "w") as f:
        f.write(server.password + "\n")
    os.chmod(path, 0o600)
    return {"server.store": server.address(database), "server.store_password_file": path}


def settings_arguments(options):
    return [argument for key, value in options.items() for argument in ("--set", f"{key}={value}")]


def selvedged(data, *arguments, expect=0):
    """Runs a command of an operator; what it prints."""
    store = settings_arguments(SharedStore.options(str(data)))
    done = subprocess.run([program("selvedged"), "--data", str(data), *store, *arguments], capture_output=True, text=True, check=False, timeout=300)
    assert done.returncode == expect, done.stdout + done.stderr
    return done.stdout + done.stderr


def wait_until(condition, timeout_s=20, what="the condition"):
    end = time.monotonic() + timeout_s * TIMEOUT_S
    while time.monotonic() < end:
        value = condition()
        if value:
            return value
        time.sleep(0.03)
    raise AssertionError(f"{what} did not come true within {timeout_s * TIMEOUT_S} s")


class Daemon:
    checked = True  # whether files are declared with their SHA-256, by which jobs share the bytes that they have in common

    def __init__(self, folder, worker=FAKE_WORKER, options=None, environment=None, wrapper=None):
        self.data = str(folder)
        self.worker = worker
        self.options = {"disk.floor_bytes": 0, "jobs.cancel_grace_s": 1, "jobs.pictures": 0, **SANITIZED, **SharedStore.options(self.data), **(options or {})}
        self.environment = environment or {}
        self.wrapper = wrapper if wrapper is not None else os.environ.get("SELVEDGE_TEST_WRAPPER", "").split()
        self.process = None
        self.log = None
        self.session = requests.Session()
        self.check = OpenApiCheck()  # compares every reply with the description of the API

    def __enter__(self):
        return self.start()

    def __exit__(self, *unused):
        self.stop()

    def command(self):
        command = [*self.wrapper, program("selvedged"), "--data", self.data, "--port", "0"]
        if self.worker:
            command += ["--worker", self.worker]
        return command + settings_arguments(self.options)

    def start(self):
        os.makedirs(os.path.dirname(self.data), exist_ok=True)
        self.log = open(self.data + ".log", "ab")
        self.process = subprocess.Popen(self.command(), stdout=subprocess.PIPE, stderr=self.log, text=True,
                                        env=dict(os.environ, PYTHON=sys.executable, **self.environment))
        line = self.process.stdout.readline()
        if not line.startswith("selvedged listens on "):
            self.process.wait()
            self.close()
            raise AssertionError(f"the daemon did not start: {self.log_text()[-2000:]}")
        self.url = line.split()[-1]
        self.port = int(self.url.rsplit(":", 1)[1])
        self.session = requests.Session()
        return self

    def log_text(self):
        with open(self.data + ".log", errors="replace") as f:
            return f.read()

    def stop(self, expect=0):
        if self.process is None:
            return
        self.process.send_signal(signal.SIGTERM)
        try:
            code = self.process.wait(30 * TIMEOUT_S)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
            raise AssertionError("the daemon did not stop")
        finally:
            self.close()
        assert code == expect, f"the daemon ended with {code}: {self.log_text()[-3000:]}"

    def kill(self):
        self.process.send_signal(signal.SIGKILL)
        self.process.wait()
        self.close()

    def close(self):
        self.process.stdout.close()
        self.log.close()
        self.session.close()
        self.process = None

    def make_token(self, name, scope=None):
        """Makes a token by selvedged --make-token, while the daemon runs or not."""
        made = subprocess.run([program("selvedged"), "--data", self.data, *settings_arguments(self.options), "--make-token", name,
                               *(["--scope", scope] if scope else [])], capture_output=True, text=True, check=False)
        assert made.returncode == 0, made.stderr
        return made.stdout.strip()

    def of(self, token):
        """The same daemon as whoever has this token sees it."""
        other = copy.copy(self)
        other.session = requests.Session()
        other.session.headers["Authorization"] = f"Bearer {token}"
        return other

    # HTTP
    def request(self, method, path, **more):
        more.setdefault("timeout", 30 * TIMEOUT_S)
        reply = self.session.request(method, self.url + path, **more)
        self.check(method, path, reply)
        return reply

    def get(self, path, **more):
        return self.request("GET", path, **more)

    def post(self, path, **more):
        return self.request("POST", path, **more)

    def put(self, path, **more):
        return self.request("PUT", path, **more)

    def delete(self, path, **more):
        return self.request("DELETE", path, **more)

    # one call of the API each; they assert success
    def create(self, doc=None, **headers):
        r = self.post("/v1/jobs", json=doc if doc is not None else DOCUMENT, headers=headers)
        assert r.status_code == 201, r.text
        return r.json()["id"]

    def declare(self, job, name, data, role="volume", checked=None):
        declaration = {"name": name, "role": role, "size": len(data), "sha256": sha256(data) if (self.checked if checked is None else checked) else None}
        r = self.post(f"/v1/jobs/{job}/files", json=declaration)
        assert r.status_code in (200, 201), r.text
        return r.json()

    def patch(self, upload_url, offset, data, **headers):
        return self.request("PATCH", upload_url, data=data, headers={
            **TUS, "Upload-Offset": str(offset), "Content-Type": "application/offset+octet-stream", **headers})

    def offset(self, upload_url):
        r = self.request("HEAD", upload_url, headers=TUS)
        assert r.status_code == 200
        return int(r.headers["Upload-Offset"])

    def upload(self, job, name, data, role="volume", checked=None):
        """Declares and sends a file; with its SHA-256 only if the server does not have it yet."""
        declared = self.declare(job, name, data, role, checked)
        if declared["state"] == "complete":
            return None
        url = declared["upload_url"]
        r = self.patch(url, 0, data)
        assert r.status_code == 204, r.text
        return url

    def ready_job(self, behaviour="succeed", checked=None, **more):
        job = self.create(document(behaviour, **more))
        for name, (role, data) in FILES.items():
            self.upload(job, name, data, role, checked)
        return job

    def start_job(self, behaviour="succeed", **more):
        job = self.ready_job(behaviour, **more)
        r = self.post(f"/v1/jobs/{job}/start")
        assert r.status_code == 202, r.text
        return job

    def job(self, job):
        """The job, with its result and parameters as clients join them."""
        r = self.get(f"/v1/jobs/{job}")
        assert r.status_code == 200, r.text
        j = r.json()
        j["result"] = self.get(j["result_url"]).json() if j["result_url"] else None
        j["parameters"] = j["result"] and j["result"].get("parameters")
        return j

    def wait_state(self, job, *states, timeout_s=20):
        return wait_until(lambda: (lambda j: j if j["state"] in states else None)(self.job(job)), timeout_s,
                          f"state {' or '.join(states)}")


def problem(reply, status, code, field=None):
    """Asserts that the reply is a problem document with this status, code and field."""
    assert reply.status_code == status, f"{reply.status_code}: {reply.text}"
    assert reply.headers["Content-Type"] == "application/problem+json"
    body = reply.json()
    assert body["status"] == status and body["code"] == code, body
    assert body["type"] == f"urn:selvedge:problem:{code}" and body["title"] and body["detail"]
    if field is not None:
        assert body.get("field") == field, body
    return body
