"""What a reply confirms is on disk before the reply is sent: bytes of uploads, files at their final names, the
database.

A preloaded library records the order of the daemon's writes and syncs. The test cannot cut the power, but a missing
sync shows in the record."""
import errno

import pytest
from daemon_under_test import Daemon, document, sha256
from system_calls import Trace


@pytest.fixture
def traced(shim, tmp_path):
    """A daemon, and the trace of its system calls."""
    trace = Trace(shim, tmp_path / "trace")
    with Daemon(tmp_path / "data", environment=trace.environment) as d:
        yield d, trace


def last(calls, call, part):
    """Returns the index of the last such call on a file with `part` in its path, or -1."""
    return max((i for i, (c, path) in enumerate(calls) if c == call and part in path), default=-1)


def first_after(calls, call, part, start):
    return next((i for i, (c, path) in enumerate(calls) if i > start and c == call and part in path), -1)


def assert_database_is_durable(calls):
    written, synced = last(calls, "write", "selvedge.db-wal"), last(calls, "sync", "selvedge.db-wal")
    assert 0 <= written < synced, f"the write-ahead log was written and not synced: {calls}"


def test_a_new_job_is_durable_when_it_is_confirmed(traced):
    d, trace = traced
    trace.clear()
    d.create(document("succeed"))
    assert_database_is_durable(trace.calls())


def test_received_bytes_are_durable_before_their_offset_is(traced):
    d, trace = traced
    job = d.create(document("succeed"))
    data = b"x" * 3000
    url = d.declare(job, "scan.tif", data)["upload_url"]
    for offset in range(0, 3000, 1000):
        trace.clear()
        assert d.patch(url, offset, data[offset:offset + 1000]).status_code == 204
        calls = trace.calls()
        written = last(calls, "write", "/upload/")
        synced = first_after(calls, "sync", "/upload/", written)
        recorded = first_after(calls, "write", "selvedge.db-wal", written)
        assert 0 <= written < synced < recorded, f"offset {offset}: {calls}"
        assert_database_is_durable(calls)


def test_a_complete_file_is_durable_at_its_final_name(traced):
    """The last bytes are synced first, then the folder that the file is moved to and the folder that it leaves, then
    its row in the database."""
    d, trace = traced
    job = d.create(document("succeed"))
    data = b"x" * 1000
    url = d.declare(job, "scan.tif", data)["upload_url"]
    trace.clear()
    assert d.patch(url, 0, data).status_code == 204
    calls = trace.calls()
    bytes_synced = first_after(calls, "sync", "/upload/", last(calls, "write", "/upload/"))
    for folder in (f"{job}/input", f"{job}/upload"):
        moved = next((i for i, (c, path) in enumerate(calls) if c == "sync" and path.endswith(folder)), -1)
        assert 0 <= bytes_synced < moved < last(calls, "write", "selvedge.db-wal"), f"{folder}: {calls}"
    assert_database_is_durable(calls)


@pytest.mark.parametrize("folder", ["/input", "/upload"])
def test_a_file_whose_folder_cannot_be_synced_is_not_confirmed(shim, tmp_path, folder):
    """Every sync of the folder fails once, from the first on, until none is left: a PATCH that meets it is refused, and
    its repetition completes the file."""
    n_refused, data = 0, b"x" * 1000
    for n in range(1, 20):
        mark = tmp_path / f"mark{n}"
        fault = {"LD_PRELOAD": shim, "FAULT_CALL": "sync", "FAULT_AT": str(n), "FAULT_ERRNO": str(errno.EIO), "FAULT_PATH": folder,
                 "FAULT_MARK": str(mark)}
        with Daemon(tmp_path / f"data{n}", environment=fault) as d:
            job = d.create(document("succeed"))
            declaration = {"name": "scan.tif", "role": "volume", "size": len(data), "sha256": sha256(data)}
            declared = d.post(f"/v1/jobs/{job}/files", json=declaration)
            if mark.exists():
                continue
            url = declared.json()["upload_url"]
            reply = d.patch(url, 0, data)
            if not mark.exists():
                assert reply.status_code == 204 and n_refused > 0, "no sync failed"
                return
            assert reply.status_code == 500, "the fault is not reported"
            n_refused += 1
            at = d.offset(url)
            assert d.patch(url, at, data[at:]).status_code == 204
            assert d.get(f"/v1/jobs/{job}/files/scan.tif").content == data
    raise AssertionError("no end")
