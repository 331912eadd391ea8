"""A thin client of the Selvedge HTTP API (docs/api.md). Needs `requests` only.

    import selvedge
    server = selvedge.Server("http://127.0.0.1:7878")
    job = server.submit("my-sample/job.json")           # uploads every file that the document names, and starts
    job.wait(print)                                      # prints progress until the job ends
    for p in job.parameters():
        print(p["name"], p["value"], "+-", p["standard_error"])
    job.download("results")

Every failed request raises `Problem`, whose text is "field: detail".
"""
import hashlib
import json
import os
import time
import uuid

import requests

__version__ = "0.1.0"
PIECE = 16 << 20
DECLARE_AT_ONCE = 2000  # files in a request, which may have 1 MiB
ENDED = ("succeeded", "failed", "cancelled")


class Problem(Exception):
    """A problem document (RFC 9457). `code` is stable; `field` names what is at fault, or is ""."""

    def __init__(self, status, body):
        self.status, self.body = status, body
        self.code, self.field = body.get("code", ""), body.get("field", "")
        detail = body.get("detail") or body.get("title") or f"HTTP status {status}"
        super().__init__(f"{self.field}: {detail}" if self.field and self.field not in detail else detail)


class JobFailed(Exception):
    """The job ended as "failed" or "cancelled". `job` is its last state."""

    def __init__(self, job):
        self.job = job
        error = job.get("error") or {}
        super().__init__(f"job {job['id']} {job['state']}: {error.get('field') or ''} {error.get('text') or ''}".rstrip())


def files_of(document):
    """Return the input files that a job document names, each once: [(name, role), ...]."""
    names = [(n, "volume") for n in document.get("volume", {}).get("files", [])]
    for key in ("fibers", "environment", "measurements", "rig"):
        if "file" in document.get(key, {}):
            names.append((document[key]["file"], key))
    if "texture" in document.get("cloth", {}):
        names.append((document["cloth"]["texture"], "photograph"))
    camera, color = document.get("camera", {}), document.get("color", {})
    names += [(camera["noise_file"], "camera_noise")] if "noise_file" in camera else []
    names += [(name, "dark_frame") for name in camera.get("dark_frames", [])]
    names += [(color[key]["file"], role) for key, role in (("chart", "chart"), ("white", "white_reference")) if key in color]
    for p in document.get("photographs", []):
        names += [(q["file"], "photograph") for q in (p, *p.get("more_exposures", []))]
    return list(dict.fromkeys(names))


def declaration(path, role, name=None):
    """Return what declares a file to the server: its name, size and SHA-256."""
    digest = hashlib.sha256()
    with open(path, "rb") as f:
        while chunk := f.read(1 << 20):
            digest.update(chunk)
        return {"name": name or os.path.basename(path), "role": role, "size": f.tell(), "sha256": digest.hexdigest()}


class Server:
    """One daemon. `token`: access token, by default from SELVEDGE_TOKEN. Not to be shared between threads."""

    def __init__(self, url=None, token=None, timeout_s=60):
        self.url = (url or os.environ.get("SELVEDGE_SERVER") or "http://127.0.0.1:7878").rstrip("/")
        self.timeout_s = timeout_s
        self.session = requests.Session()
        self.session.trust_env = False
        self._piece = None
        token = token or os.environ.get("SELVEDGE_TOKEN")
        if token:
            self.session.headers["Authorization"] = f"Bearer {token}"

    def request(self, method, path, **arguments):
        """Send a request that must succeed, and return requests.Response. Raises Problem or requests.ConnectionError."""
        answer = self.session.request(method, self.url + path, timeout=self.timeout_s, **arguments)
        if answer.status_code >= 400:
            try:
                body = answer.json()
            except ValueError:
                body = {}
            raise Problem(answer.status_code, body)
        return answer

    def piece_bytes(self):
        """Size of one piece of an upload: 16 MiB, or the server's limit if that is smaller. The server is asked once."""
        if self._piece is None:
            limits = self.request("GET", "/v1/about").json().get("limits", {})
            self._piece = min(PIECE, limits.get("max_patch_bytes", PIECE))
        return self._piece

    def jobs(self):
        """Return summaries of all jobs, newest first."""
        cursor = ""
        while True:
            page = self.request("GET", f"/v1/jobs?limit=100&cursor={cursor}" if cursor else "/v1/jobs?limit=100").json()
            yield from page["jobs"]
            cursor = page["next_cursor"]
            if not cursor:
                return

    def job(self, job_id):
        """Return an existing job."""
        return Job(self, job_id)

    def create(self, document):
        """Create a draft from a job document (a dict). Retries within one call are safe: they carry an idempotency key."""
        answer = self.request("POST", "/v1/jobs", json=document, headers={"Idempotency-Key": uuid.uuid4().hex})
        return Job(self, answer.json()["id"])

    def submit(self, document, folder=None):
        """Create a job, upload its files and start it. document: a dict, or the path of a JSON file, whose folder is
        then the default of `folder`."""
        if not isinstance(document, dict):
            folder = folder or os.path.dirname(os.path.abspath(document))
            with open(document, encoding="utf-8") as f:
                document = json.load(f)
        job = self.create(document)
        job.upload_all((os.path.join(folder or ".", name), role) for name, role in files_of(document))
        job.start()
        return job


class Job:
    """One job of a server. Methods ask the server every time; only the id is kept."""

    def __init__(self, server, job_id):
        self.server, self.id = server, job_id
        self.path = f"/v1/jobs/{job_id}"

    def state(self):
        """Return the whole job object of docs/api.md."""
        return self.server.request("GET", self.path).json()

    def upload(self, path, role, name=None):
        """Declare a file and send it by tus; continues an earlier upload. The server checks the SHA-256 at the end."""
        self._send_declared(path, self.server.request("POST", self.path + "/files", json=declaration(path, role, name)).json())

    def upload_all(self, files):
        """The same with many files [(path, role), ...]: they are declared in few requests, each of them wholly or not at all."""
        files = list(files)
        for i in range(0, len(files), DECLARE_AT_ONCE):
            some = files[i:i + DECLARE_AT_ONCE]
            declared = [declaration(path, role) for path, role in some]
            states = self.server.request("POST", self.path + "/files", json=declared).json()["files"]
            for (path, _), state in zip(some, states):
                self._send_declared(path, state)

    def _send_declared(self, path, state):
        if state["state"] != "complete":
            with open(path, "rb") as f:
                self._send(f, state["size"], state["upload_url"])

    def _send(self, f, size, url):
        tus, failures, offset = {"Tus-Resumable": "1.0.0"}, 0, None
        while offset is None or offset < size:
            try:
                if offset is None:
                    answer = self.server.request("HEAD", url, headers=tus)
                else:
                    f.seek(offset)
                    header = dict(tus, **{"Upload-Offset": str(offset), "Content-Type": "application/offset+octet-stream"})
                    answer = self.server.request("PATCH", url, headers=header, data=f.read(self.server.piece_bytes()))
                    failures = 0
                offset = int(answer.headers["Upload-Offset"])
            except (requests.ConnectionError, requests.Timeout, Problem) as problem:
                if isinstance(problem, Problem) and problem.status not in (408, 409, 503):
                    raise
                failures += 1
                if failures > 6:
                    raise
                offset = None
                time.sleep(0.25 * 2 ** failures)

    def start(self):
        """Queue the job. Raises Problem "files_missing" if inputs are incomplete."""
        return self.server.request("POST", self.path + "/start").json()

    def cancel(self):
        """Ask the worker to stop; its results so far are kept."""
        return self.server.request("POST", self.path + "/cancel").json()

    def retry(self):
        """Start a failed or cancelled job again from its last checkpoint."""
        return self.server.request("POST", self.path + "/retry").json()

    def delete(self):
        """Remove the job and its files."""
        self.server.request("DELETE", self.path)

    def wait(self, report=None, interval_s=1.0):
        """Wait until the job has ended; return its state, or raise JobFailed unless it succeeded. report(text) is
        called whenever something changed."""
        shown = None
        while True:
            job = self.state()
            line = f"{job['state']} {job['stage'] or ''} {100 * job['fraction']:.0f} %"
            if job["objective"] is not None:
                line += f"  objective {job['objective']:.5g} +- {job['objective_se'] or 0:.2g}"
            if report is not None and line != shown:
                report(line)
            shown = line
            if job["state"] in ENDED:
                if job["state"] != "succeeded":
                    raise JobFailed(job)
                return job
            time.sleep(interval_s)

    def result(self):
        """Return the result (docs/file-formats.md, result.json), or None before the end."""
        url = self.state()["result_url"]
        return url and self.server.request("GET", url).json()

    def parameters(self):
        """Return the fitted parameters: dicts with name, set (the group of fibers, or None), unit, value, standard_error,
        lower, upper, determined ... None before the end."""
        result = self.result()
        return result and result.get("parameters")

    def models(self):
        """Return all models of the job in order: dicts with id, best, fit_rel_rms, heldout_rel_rms, parameters ... None
        before the end."""
        result = self.result()
        return result and result.get("models")

    def series(self):
        """Return all points of the fit's curve, oldest first (the server merges more than 5000)."""
        points, after = [], -1
        while True:
            page = self.server.request("GET", f"{self.path}/series?after_step={after}&max_points=5000").json()
            if not page["points"]:
                return points
            points += page["points"]
            after = page["next_after_step"]

    def log(self, offset=0):
        """Return the log as text from a byte offset on (negative: from the end)."""
        return self.server.request("GET", f"{self.path}/log?offset={offset}&max_bytes=1048576").text

    def download(self, folder):
        """Download all results to a folder and return their paths."""
        paths = []
        for entry in self.server.request("GET", self.path + "/results").json()["files"]:
            parts = entry["path"].split("/")
            if any(p in ("", ".", "..") for p in parts):
                raise ValueError(f"the server lists a result with an unusable name: {entry['path']!r}")
            path = os.path.join(folder, *parts)
            os.makedirs(os.path.dirname(path), exist_ok=True)
            self._fetch(entry["url"], path + ".part")
            os.replace(path + ".part", path)
            paths.append(path)
        return paths

    def _fetch(self, url, path):
        """Download one file: continue by range after a broken connection, or from the start if the file has changed."""
        failures, n, tag = 0, 0, None
        with open(path, "wb") as f:
            while True:
                header = {"Accept-Encoding": "identity"}  # uncompressed, so that the bytes can be counted
                if n and tag:
                    header.update({"Range": f"bytes={n}-", "If-Range": tag})
                try:
                    with self.server.request("GET", url, stream=True, headers=header) as answer:
                        continued = answer.status_code == 206
                        if not continued:
                            n, tag = 0, answer.headers.get("ETag")
                            f.seek(0)
                            f.truncate()
                        # `requests` treats an incomplete reply as ended, so its length is checked
                        length = answer.headers.get("Content-Length")
                        end = None if length is None else n + int(length)
                        for chunk in answer.iter_content(1 << 20):
                            f.write(chunk)
                            n += len(chunk)
                            failures = 0 if continued else failures
                    if end is None or n == end:
                        return
                    raise requests.ConnectionError(f"'{url}' ended early, after {n} of {end} bytes")
                except (requests.ConnectionError, requests.Timeout, requests.exceptions.ChunkedEncodingError):
                    failures += 1
                    if failures > 6:
                        raise
                    time.sleep(0.1 * 2 ** failures)
