"""A server, and its requests that need no job."""
from __future__ import annotations

import os
import urllib.parse
import uuid
from typing import Any, Callable, Iterator, Optional

from .batch import Batch, Samples, submit_batch
from .documents import Document, DocumentOrPath, files_of, read_document
from .job import Job, show_nothing
from .records import JobState, Progress
from .transport import Answer, Transport

PIECE = 16 << 20


def read_token(path: Optional[str] = None) -> Optional[str]:
    """The token in a file, by default SELVEDGE_TOKEN_FILE; else SELVEDGE_TOKEN. A file that others may read is refused."""
    path = path or os.environ.get("SELVEDGE_TOKEN_FILE")
    if not path:
        return os.environ.get("SELVEDGE_TOKEN")
    if os.stat(path).st_mode & 0o066:
        raise ValueError(f"other users may read the token in '{path}'; forbid it with: chmod 600 '{path}'")
    with open(path, encoding="ascii") as f:
        return f.readline().strip() or None


class Client:
    """One server. `url`: http://..., https://... or unix:/path, by default SELVEDGE_SERVER. `token`: access token, sent as
    `Authorization: Bearer`; by default the first line of `token_file` or of the file SELVEDGE_TOKEN_FILE, else SELVEDGE_TOKEN.
    `ca_file`: certificates that https trusts instead of the system's. May be shared between threads."""

    def __init__(self, url: Optional[str] = None, token: Optional[str] = None, timeout_s: float = 60, ca_file: Optional[str] = None,
                 *, token_file: Optional[str] = None) -> None:
        self.transport = Transport(url or os.environ.get("SELVEDGE_SERVER") or "http://127.0.0.1:7878", token or read_token(token_file), timeout_s, ca_file)
        self._piece: Optional[int] = None

    @property
    def url(self) -> str:
        return self.transport.url

    def request(self, method: str, path: str, **more: Any) -> Answer:
        """Send any request of docs/api.md that must succeed (see Transport.request)."""
        return self.transport.request(method, path, **more)

    def about(self) -> dict[str, Any]:
        """Return name, version, stages and limits of the server."""
        about: dict[str, Any] = self.request("GET", "/v1/about").json()
        return about

    def piece_bytes(self) -> int:
        """Size of one piece of an upload: 16 MiB, or the server's limit if that is smaller. The server is asked once."""
        if self._piece is None:
            self._piece = min(PIECE, self.about().get("limits", {}).get("max_patch_bytes", PIECE))
        return self._piece

    def jobs(self, state: Optional[str] = None, sample: Optional[str] = None, verdict: Optional[str] = None) -> Iterator[JobState]:
        """Yield the jobs, newest first: all, or those in a state, with this text in the sample's name, or with this verdict."""
        query = {"limit": "100", **({"state": state} if state else {})}
        while True:
            page = self.request("GET", "/v1/jobs?" + urllib.parse.urlencode(query)).json()
            for raw in page["jobs"]:
                job = JobState.of(raw)
                if (sample is None or sample in job.sample) and (verdict is None or (job.verdict is not None and job.verdict.code == verdict)):
                    yield job
            if not page["next_cursor"]:
                return
            query["cursor"] = page["next_cursor"]

    def job(self, job_id: str) -> Job:
        """Return an existing job."""
        return Job(self, job_id)

    def batches(self) -> Iterator[Batch]:
        """Yield the batches, newest first."""
        path = "/v1/batches?limit=100"
        while True:
            page = self.request("GET", path).json()
            yield from (Batch(self, raw["id"]) for raw in page["batches"])
            if not page["next_cursor"]:
                return
            path = f"/v1/batches?limit=100&cursor={page['next_cursor']}"

    def batch(self, name_or_id: str) -> Batch:
        """Return an existing batch. Raises KeyError."""
        for batch in self.batches():
            if name_or_id in (batch.id, batch.state().name):
                return batch
        raise KeyError(name_or_id)

    def submit_batch(self, name: str, template: DocumentOrPath, samples: Samples, folder: Optional[str] = None, *, update: bool = False,
                     start: bool = True) -> Batch:
        """Create a job of each sample, upload the files that the server does not have, and start them. template: a job document. samples: the
        path of a CSV file, or dicts of "sample", "replace" ({path: value}) and perhaps "folder". folder: where the files are, by
        default beside the table; a sample that has a folder of its own name in it has them there. update: a batch of this name becomes
        like this one, and only samples whose document or files differ run; otherwise that is Problem "exists". The same call may be
        repeated. `submitted` of the batch says what became of each sample."""
        return submit_batch(self, name, template, samples, folder, update, start)

    def has_input(self, sha256: str) -> bool:
        """Tell whether a job of this user has an input with these bytes; uploading it to another job then sends nothing."""
        return bool(self.request("GET", f"/v1/inputs?sha256={sha256}").json()["known"])

    def create(self, document: Document, key: Optional[str] = None) -> Job:
        """Create a draft from a job document. A key makes repeats of the call give the same job."""
        answer = self.request("POST", "/v1/jobs", json_body=document, headers={"Idempotency-Key": key or uuid.uuid4().hex})
        return Job(self, answer.json()["id"])

    def submit(self, document: DocumentOrPath, folder: Optional[str] = None, *, start: bool = True, check: bool = False,
               key: Optional[str] = None, on_progress: Callable[[Progress], None] = show_nothing) -> Job:
        """Create a job, upload its files and start it. document: a dict, or the path of a JSON file, whose folder is then the
        default of `folder`. check: the job starts only if its files have no fault (Job.start). on_progress is called while files are
        read and sent."""
        document, beside = read_document(document)
        job = self.create(document, key)
        job.upload_all([(os.path.join(folder or beside, name), role) for name, role in files_of(document)], on_progress)
        if start:
            job.start(check)
        return job
