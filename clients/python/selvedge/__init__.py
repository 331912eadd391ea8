"""Client of the Selvedge HTTP API (docs/api.md), by the standard library alone.

    import selvedge
    client = selvedge.Client("http://127.0.0.1:7878")
    job = client.submit("my-sample/job.json")            # uploads every file that the document names, and starts
    job.wait(print)                                       # prints progress until the job ends
    for p in job.result().parameters:
        print(p.name, p.value, "+-", p.standard_error)
    job.download("results")

Every request that the server refuses raises `Problem`, whose text is "field: detail"; a server that cannot be reached
raises `Unreachable`.
"""
from .batch import Batch, BatchState
from .client import Client
from .documents import files_of
from .job import Job
from .records import JobError, JobState, Model, Parameter, Progress, Result, ResultFile, Verdict, Version
from .transport import JobFailed, Problem, SelvedgeError, Unreachable
from .version import __version__

__all__ = ["Batch", "BatchState", "Client", "Job", "JobError", "JobFailed", "JobState", "Model", "Parameter", "Problem", "Progress", "Result", "ResultFile",
           "SelvedgeError", "Unreachable", "Verdict", "Version", "__version__", "files_of"]
