"""One job of a server."""
from __future__ import annotations

import os
import time
import urllib.parse
import uuid
from typing import IO, TYPE_CHECKING, Any, Callable, Iterable, Optional, Union

from .documents import Document, declaration
from .records import JobState, Progress, Result, ResultFile, Version
from .transport import BROKEN, JobFailed, Problem, Unreachable

if TYPE_CHECKING:
    from .client import Client

DECLARE_AT_ONCE = 2000  # files in a request, which may have 1 MiB
MAX_FAILURE = 6
WAIT_S = 30
TUS = {"Tus-Resumable": "1.0.0"}


def show_nothing(progress: Progress) -> None:
    """The progress callback that is used when none is given."""


class Job:
    """Methods ask the server every time; only the id is kept."""

    def __init__(self, client: Client, job_id: str) -> None:
        self.client, self.id = client, job_id
        self.path = f"/v1/jobs/{urllib.parse.quote(job_id, safe='')}"

    def __repr__(self) -> str:
        return f"Job({self.id!r})"

    def state(self) -> JobState:
        """Return the present state; its `raw` is the whole job object of docs/api.md."""
        return JobState.of(self.client.request("GET", self.path).json())

    def document(self) -> dict[str, Any]:
        """Return the job document."""
        document: dict[str, Any] = self.state().raw["document"]
        return document

    def edit(self, change: Union[Document, Callable[[dict[str, Any]], Optional[Document]]]) -> JobState:
        """Replace the document, or pass it to a function that changes it in place or returns another. Fails with Problem
        "precondition" when someone else has changed the job meanwhile. The job is a draft then; its files stay."""
        answer = self.client.request("GET", self.path)
        tag, document = answer.headers["ETag"], answer.json()["document"]
        new = (change(document) or document) if callable(change) else change
        return JobState.of(self.client.request("PUT", self.path + "/document", json_body=new, headers={"If-Match": tag}, n_try=1).json())

    def upload(self, path: str, role: str, name: Optional[str] = None, on_progress: Callable[[Progress], None] = show_nothing) -> None:
        """Declare a file and send it by tus; continues an earlier upload. The server checks the SHA-256 at the end."""
        state = self.client.request("POST", self.path + "/files", json_body=declaration(path, role, name)).json()
        self._send_declared(path, state, lambda n: on_progress(Progress("uploading", state["name"], n, state["size"])))

    def upload_all(self, files: Iterable[tuple[str, str]], on_progress: Callable[[Progress], None] = show_nothing) -> None:
        """The same with many files [(path, role), ...]: they are declared in few requests, each of them wholly or not at all."""
        files = list(files)
        total, done, declared = sum(os.path.getsize(path) for path, _ in files), 0, []
        for path, role in files:
            declared.append(declaration(path, role))
            done += declared[-1]["size"]
            on_progress(Progress("checking", declared[-1]["name"], done, total))
        done = 0
        for i in range(0, len(files), DECLARE_AT_ONCE):
            some = declared[i:i + DECLARE_AT_ONCE]
            states = self.client.request("POST", self.path + "/files", json_body=some).json()["files"]
            for (path, _), state in zip(files[i:], states):
                self._send_declared(path, state, lambda n: on_progress(Progress("uploading", state["name"], done + n, total)))
                done += state["size"]

    def _send_declared(self, path: str, state: dict[str, Any], sent: Callable[[int], None]) -> None:
        if state["state"] != "complete":
            with open(path, "rb") as f:
                self._send(f, state["size"], state["upload_url"], sent)
        sent(state["size"])

    def _send(self, f: IO[bytes], size: int, url: str, sent: Callable[[int], None]) -> None:
        failures, offset = 0, None
        while offset is None or offset < size:
            try:
                if offset is None:
                    answer = self.client.request("HEAD", url, headers=TUS, n_try=1)
                else:
                    f.seek(offset)
                    header = {**TUS, "Upload-Offset": str(offset), "Content-Type": "application/offset+octet-stream"}
                    answer = self.client.request("PATCH", url, headers=header, data=f.read(self.client.piece_bytes()), n_try=1)
                    failures = 0
                answer.read()
                offset = int(answer.headers["Upload-Offset"])
                sent(offset)
            except (Unreachable, Problem, *BROKEN) as problem:
                failures += 1
                if failures > MAX_FAILURE or (isinstance(problem, Problem) and problem.status not in (408, 409, 503)):
                    raise
                offset = None
                time.sleep(0.25 * 2 ** failures)

    def check(self) -> dict[str, Any]:
        """Have all inputs opened and judged: {"valid", "errors": [{"code", "field", "detail"}], "warnings", "n_file"}."""
        report: dict[str, Any] = self.client.request("POST", self.path + "/check").json()
        return report

    def start(self, check: bool = False) -> JobState:
        """Queue the job. Raises Problem "files_missing" if inputs are incomplete; with check, Problem "invalid" if they have
        faults, which are then all in its body["errors"]."""
        return JobState.of(self.client.request("POST", self.path + ("/start?check=1" if check else "/start")).json())

    def cancel(self) -> JobState:
        """Ask the worker to stop; its results so far are kept."""
        return JobState.of(self.client.request("POST", self.path + "/cancel").json())

    def retry(self) -> JobState:
        """Start a failed or cancelled job again from its last checkpoint."""
        return JobState.of(self.client.request("POST", self.path + "/retry").json())

    def delete(self) -> None:
        """Remove the job and its files."""
        self.client.request("DELETE", self.path, n_try=1).read()

    def wait(self, on_progress: Optional[Callable[[JobState], None]] = None, timeout_s: Optional[float] = None) -> JobState:
        """Wait until the job has ended; return its state, or raise JobFailed unless it succeeded. on_progress(state) is called
        whenever something has changed (print shows a line). Raises TimeoutError after timeout_s."""
        begin, tag, shown = time.monotonic(), None, None
        while True:
            left = WAIT_S if timeout_s is None else min(WAIT_S, begin + timeout_s - time.monotonic())
            header: dict[str, str] = {"If-None-Match": tag} if tag else {}
            with self.client.request("GET", f"{self.path}?wait={max(0, int(left + 0.999))}", headers=header, more_s=WAIT_S) as answer:
                raw = answer.json() if answer.status == 200 else None
                tag = answer.headers["ETag"]
            if raw is not None:
                job = JobState.of(raw)
                if on_progress is not None and str(job) != shown:
                    on_progress(job)
                shown = str(job)
                if job.ended:
                    if job.state != "succeeded":
                        raise JobFailed(job)
                    return job
            if left <= 0:
                raise TimeoutError(f"job {self.id} has not ended after {timeout_s} s")

    def result(self) -> Optional[Result]:
        """Return the result, or None before the end."""
        url = self.state().raw["result_url"]
        return Result.of(self.client.request("GET", url).json()) if url else None

    def derive(self, *, pictures: Iterable[dict[str, Any]] = (), twin: bool = False, export: Iterable[str] = (), **light: Any) -> Job:
        """Start a job that shows the result of this one without a new fit, and return it. pictures: as in a job document; export:
        names of formats; light: `lamp`, `environment`, `camera`, `black_sheet` in place of those of this job, or `sample`."""
        wanted: dict[str, Any] = dict(light)
        if pictures:
            wanted["pictures"] = list(pictures)
        if twin:
            wanted["twin"] = {"make": True}
        if export:
            wanted["export"] = {name: True for name in export}
        answer = self.client.request("POST", self.path + "/derive", json_body=wanted, headers={"Idempotency-Key": uuid.uuid4().hex})
        return Job(self.client, answer.json()["id"])

    def export(self, formats: Union[str, Iterable[str]], folder: str, on_progress: Optional[Callable[[JobState], None]] = None) -> list[str]:
        """Make the files of one format or of several ("mitsuba", "usd" ...; docs/exports.md) without a new fit, and download them to
        folder/export/FORMAT; "pdf" is the report, folder/report.pdf. Return their paths."""
        names = [formats] if isinstance(formats, str) else list(formats)
        job = self.derive(export=names)
        job.wait(on_progress)
        report = job.download(folder, under="report.pdf") if "pdf" in names else []
        return report + job.download(folder, under="export/")

    def picture(self, folder: str, on: str = "drape", lamp_deg: tuple[float, float] = (45, 0), camera_deg: tuple[float, float] = (30, 180),
                on_progress: Optional[Callable[[JobState], None]] = None, **options: Any) -> list[str]:
        """Render the cloth "flat", on a "cylinder" or as a "drape" without a new fit, and download folder/pictures/on-1.png and .exr.
        lamp_deg, camera_deg: angles from the vertical and around it. options: keys of a picture in a job document, such as px. With
        `kind`, such as kind="roll", it is a picture in the studio, and on, lamp_deg and camera_deg do not count."""
        angles = {"light_theta_deg": lamp_deg[0], "light_phi_deg": lamp_deg[1], "camera_theta_deg": camera_deg[0], "camera_phi_deg": camera_deg[1]}
        view = {} if options.get("kind", "measurement") != "measurement" else {"on": on, **angles}
        job = self.derive(pictures=[{**view, **options}])
        job.wait(on_progress)
        return job.download(folder, under="pictures/on-")

    def twin(self, folder: str, on_progress: Optional[Callable[[JobState], None]] = None) -> list[str]:
        """Make the tables of the twin for a browser without a new fit, and download them to folder/twin."""
        job = self.derive(twin=True)
        job.wait(on_progress)
        return job.download(folder, under="twin/")

    def share(self, days: float = 30) -> str:
        """Make a link that shows this job and its results, read only, to someone without a token, and return its address, which
        nothing gives again. It ends after `days`, or by unshare()."""
        answer = self.client.request("POST", self.path + "/shares", json_body={"days": days}, n_try=1).json()
        return f"{self.client.url}/#share/{answer['secret']}"

    def unshare(self) -> int:
        """Revoke all links of this job; return how many."""
        valid = [s["id"] for s in self.client.request("GET", self.path + "/shares").json()["shares"] if s["open"]]
        for share in valid:
            self.client.request("DELETE", f"{self.path}/shares/{share}").read()
        return len(valid)

    def series(self) -> list[dict[str, Any]]:
        """Return all points of the fit's curve, oldest first (the server merges more than 5000)."""
        points: list[dict[str, Any]] = []
        after = -1
        while True:
            page = self.client.request("GET", f"{self.path}/series?after_step={after}&max_points=5000").json()
            if not page["points"]:
                return points
            points += page["points"]
            after = page["next_after_step"]

    def log(self, offset: int = 0) -> str:
        """Return the log from a byte offset on (negative: from the end)."""
        return self.client.request("GET", f"{self.path}/log?offset={offset}&max_bytes=1048576").text()

    def results(self) -> list[ResultFile]:
        """Return the list of all files among the results."""
        return [ResultFile.of(raw) for raw in self.client.request("GET", self.path + "/results").json()["files"]]

    def versions(self) -> list[Version]:
        """Return the results of all runs that are kept, the oldest first. An edited job keeps its earlier results."""
        return [Version.of(raw) for raw in self.client.request("GET", self.path + "/versions").json()["versions"]]

    def version_result(self, version: int) -> Result:
        """Return the result of one of these runs."""
        return Result.of(self.client.request("GET", f"{self.path}/versions/{version}/result.json").json())

    def version_document(self, version: int) -> dict[str, Any]:
        """Return the job document of one of these runs."""
        document: dict[str, Any] = self.client.request("GET", f"{self.path}/versions/{version}").json()["document"]
        return document

    def download_file(self, name: str, path: Optional[str] = None) -> str:
        """Download one file of the results, such as "report.html", to a path (by default its own name here); return the path."""
        path = path or name.rsplit("/", 1)[-1]
        self._fetch(f"{self.path}/results/{urllib.parse.quote(name)}", path + ".part", lambda n: None)
        os.replace(path + ".part", path)
        return path

    def download(self, folder: str, on_progress: Callable[[Progress], None] = show_nothing, under: str = "") -> list[str]:
        """Download all results, or those whose paths begin with `under`, to a folder and return their paths."""
        paths: list[str] = []
        files, done = [f for f in self.results() if f.path.startswith(under)], 0
        total = sum(f.size for f in files)
        for file in files:
            parts = file.path.split("/")
            if any(p in ("", ".", "..") for p in parts):
                raise ValueError(f"the server lists a result with an unusable name: {file.path!r}")
            path = os.path.join(folder, *parts)
            os.makedirs(os.path.dirname(path), exist_ok=True)
            self._fetch(file.url, path + ".part", lambda n: on_progress(Progress("downloading", file.path, done + n, total)))
            os.replace(path + ".part", path)
            done += file.size
            paths.append(path)
        return paths

    def _fetch(self, url: str, path: str, got: Callable[[int], None]) -> None:
        """Download one file: continue by range after a broken connection, or from the start if the file has changed."""
        failures, n, tag = 0, 0, None
        with open(path, "wb") as f:
            while True:
                header: dict[str, str] = {"Range": f"bytes={n}-", "If-Range": tag} if n and tag else {}
                try:
                    with self.client.request("GET", url, headers=header) as answer:
                        if answer.status != 206:
                            n, tag = 0, answer.headers.get("ETag")
                            f.seek(0)
                            f.truncate()
                        length = answer.headers.get("Content-Length")
                        end = None if length is None else n + int(length)
                        for chunk in answer.chunks():
                            f.write(chunk)
                            n += len(chunk)
                            got(n)
                    if end is None or n == end:
                        return
                    raise ConnectionError(f"'{url}' ended early, after {n} of {end} bytes")
                except Problem:
                    os.remove(path)
                    raise
                except BROKEN as broken:
                    self.client.transport.close()
                    failures += 1
                    if failures > MAX_FAILURE:
                        raise Unreachable(f"cannot download '{url}': {broken}") from broken
                    time.sleep(0.1 * 2 ** failures)
