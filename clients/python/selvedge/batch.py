"""Many samples with one template."""
from __future__ import annotations

import copy
import csv
import json
import os
import re
import time
import urllib.parse
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Iterable, Mapping, Optional, Union

from .documents import Document, DocumentOrPath, declaration, files_of, read_document
from .job import Job
from .tables import batch_row, to_pandas
from .transport import Problem

if TYPE_CHECKING:
    from .client import Client

Samples = Union[str, "os.PathLike[str]", Iterable[Mapping[str, Any]]]


def replace(document: dict[str, Any], path: str, value: Any) -> None:
    """Replace a member of a document. path: a JSON pointer if it begins with "/", else names between dots and places in brackets
    (photographs[2].scale). Objects that are missing on the way are made. Raises ValueError where a place of a list is missing."""
    if path.startswith("/"):
        names = [name.replace("~1", "/").replace("~0", "~") for name in path[1:].split("/")]
    else:
        names = re.findall(r"[^.\[\]]+", path)
    parent: Any = document
    try:
        for name in names[:-1]:
            parent = parent[int(name)] if isinstance(parent, list) else parent.setdefault(name, {})
        if isinstance(parent, list):
            parent[int(names[-1])] = value
        else:
            parent[names[-1]] = value
    except (IndexError, ValueError, TypeError, AttributeError):
        raise ValueError(f"the template has no place '{path}'") from None


def read_table(path: Union[str, "os.PathLike[str]"]) -> list[dict[str, Any]]:
    """Read the rows of a CSV file: a column "sample", the others are paths of members of the template. An empty cell leaves the
    template's value, a cell that is JSON is that value, and any other is a text."""
    rows = []
    with open(path, newline="", encoding="utf-8-sig") as f:
        for i, cells in enumerate(csv.DictReader(f), 1):
            if "sample" not in cells or None in cells or None in cells.values():
                raise ValueError(f"table '{os.fspath(path)}', row {i}: it needs a column 'sample' and a cell for each column")
            values = {}
            for key, text in cells.items():
                if key != "sample" and text != "":
                    try:
                        values[key] = json.loads(text)
                    except ValueError:
                        values[key] = text
            rows.append({"sample": cells["sample"], "replace": values})
    return rows


@dataclass(frozen=True)
class BatchState:
    """A batch as the server gave it. `states`: the number of jobs in each state; `failures`: a dict of sample, job, code, field and
    text for each failed job. `raw` is the whole object of docs/api.md."""
    name: str
    n_sample: int
    states: Mapping[str, int]
    fraction: float
    expected_end_unix_s: Optional[float]
    failures: tuple[Mapping[str, Any], ...]
    raw: Mapping[str, Any] = field(repr=False)

    @classmethod
    def of(cls, raw: Mapping[str, Any]) -> BatchState:
        return cls(raw["name"], raw["n_sample"], raw["states"], raw["fraction"], raw["expected_end_unix_s"], tuple(raw["failures"]), raw)

    @property
    def ended(self) -> bool:
        """Whether no job is a draft, queued, running or paused."""
        return not any(self.states[state] for state in ("draft", "queued", "running", "paused"))


def filter_of(verdict: Optional[str]) -> str:
    """Return the query of a table whose samples have one of these verdicts; None: of all samples."""
    return "" if verdict is None else "?" + urllib.parse.urlencode({"verdict": verdict}, safe=",")


class Batch:
    """One batch of a server. Methods ask the server every time; only the id and the answer to the submission are kept."""

    def __init__(self, client: Client, batch_id: str, submitted: Optional[Mapping[str, Any]] = None) -> None:
        self.client, self.id, self.submitted = client, batch_id, submitted
        self.path = f"/v1/batches/{batch_id}"

    def _post(self, action: str) -> BatchState:
        return BatchState.of(self.client.request("POST", f"{self.path}/{action}").json())

    def state(self) -> BatchState:
        """Return its progress and its failures."""
        return BatchState.of(self.client.request("GET", self.path).json())

    def start(self) -> BatchState:
        """Queue the drafts and the cancelled jobs. `raw["refused"]` names those whose files are missing."""
        return self._post("start")

    def retry(self) -> BatchState:
        """Queue the failed jobs, all together."""
        return self._post("retry")

    def cancel(self) -> BatchState:
        """Cancel all jobs that have not ended."""
        return self._post("cancel")

    def delete(self, *, jobs: bool) -> None:
        """Remove the batch, with its jobs or without."""
        self.client.request("DELETE", f"{self.path}?jobs={'delete' if jobs else 'keep'}", n_try=1).read()

    def plan(self, cores: Optional[int] = None) -> dict[str, Any]:
        """Return the resources that the samples will need together: processor time, time on so many cores (default: those of the service's
        workers), memory and disk, and the used resources of samples that ran since they were planned. Samples that have not
        run are planned anew; `unplanned` has the reasons of those that cannot be, by sample."""
        path = f"{self.path}/plan" + ("" if cores is None else f"?cores={cores}")
        unplanned = {}
        for one in self.client.request("GET", path).json()["samples"]:
            if one["state"] in ("running", "succeeded"):
                continue
            try:
                self.client.request("POST", f"/v1/jobs/{one['job']}/plan")
            except Problem as e:
                if e.status in (404, 422, 429, 500, 503):
                    unplanned[one["sample"]] = str(e)
                elif e.status != 409:  # it has begun meanwhile
                    raise
        plan: dict[str, Any] = self.client.request("GET", path).json()
        return dict(plan, unplanned=unplanned)

    def results(self, verdict: Optional[str] = None) -> list[dict[str, Any]]:
        """Return the table of results: a dict for each sample, with parameters, standard errors, verdict and flags. verdict: codes
        between commas, to which the samples are limited."""
        rows: list[dict[str, Any]] = self.client.request("GET", f"{self.path}/results.json{filter_of(verdict)}").json()["samples"]
        return rows

    def results_csv(self, verdict: Optional[str] = None) -> str:
        """Return the same table as CSV."""
        text: str = self.client.request("GET", f"{self.path}/results.csv{filter_of(verdict)}").read().decode()
        return text

    def table(self, verdict: Optional[str] = None) -> list[dict[str, Any]]:
        """Return the same table as flat rows: dicts of numbers and texts, with NAME, NAME_se and NAME_determined for each parameter."""
        return [batch_row(sample) for sample in self.results(verdict)]

    def to_pandas(self, verdict: Optional[str] = None) -> Any:
        """Return the same table as a pandas.DataFrame. Raises ImportError where pandas is not installed."""
        return to_pandas(self.table(verdict), ("sample", "verdict"))

    def __repr__(self) -> str:
        return f"Batch({self.id!r})"

    def wait(self, timeout_s: Optional[float] = None, poll_s: float = 2) -> BatchState:
        """Wait until all jobs have ended. Failed ones raise nothing: they are in `failures`. Raises TimeoutError."""
        end = None if timeout_s is None else time.monotonic() + timeout_s
        while True:
            state = self.state()
            if state.ended:
                return state
            if end is not None and time.monotonic() > end:
                raise TimeoutError(f"batch '{state.name}' has not ended within {timeout_s} s")
            time.sleep(poll_s)


def submit_batch(client: Client, name: str, template: DocumentOrPath, samples: Samples, folder: Optional[str], update: bool,
                 start: bool) -> Batch:
    """See Client.submit_batch."""
    document, beside = read_document(template)
    if isinstance(samples, (str, os.PathLike)):
        folder = folder or os.path.dirname(os.path.abspath(samples))
        samples = read_table(samples)
    known: dict[str, dict[str, Any]] = {}
    rows, paths = [], []
    for sample in samples:
        own = os.path.join(folder or beside, sample["sample"])
        where = sample.get("folder") or (own if os.path.isdir(own) else folder or beside)
        resolved = resolve(document, sample)
        files = {file: os.path.join(where, file) for file, _ in files_of(resolved)}
        for path in files.values():
            if path not in known:
                known[path] = declaration(path, "")
        rows.append({"sample": sample["sample"], "replace": dict(sample.get("replace", {})),
                     "files": [{key: known[path][key] for key in ("name", "size", "sha256")} for path in files.values()]})
        paths.append(files)
    body = {"name": name, "template": document, "samples": rows, "update": update}
    answer = client.request("POST", "/v1/batches", json_body=body).json()
    batch = Batch(client, answer["id"], answer)
    sent: set[str] = set()
    for one, files in zip(answer["samples"], paths):
        send_files(Job(client, one["job"]), files, known, sent)
    if start:
        batch.start()
    return batch


def resolve(template: Document, sample: Mapping[str, Any]) -> dict[str, Any]:
    """Return the job document of a sample."""
    document: dict[str, Any] = copy.deepcopy(dict(template))
    document["sample"] = sample["sample"]
    for path, value in sample.get("replace", {}).items():
        replace(document, path, value)
    return document


def send_files(job: Job, files: Mapping[str, str], known: Mapping[str, Mapping[str, Any]], sent: set[str]) -> None:
    """Upload the files that a job does not have. A file that was sent to another job just now is declared again, and complete then."""
    for state in job.client.request("GET", job.path + "/files").json()["files"]:
        if state["state"] == "complete" or state["name"] not in files:
            continue
        path = files[state["name"]]
        if known[path]["sha256"] in sent:
            job.client.request("DELETE", f"{job.path}/files/{urllib.parse.quote(state['name'], safe='')}", n_try=1).read()
        sent.add(known[path]["sha256"])
        job.upload(path, state["role"])
