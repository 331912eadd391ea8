import inspect
import os
import sys

import pytest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.dirname(os.path.abspath(__file__))), "support", "python"))
from daemon_under_test import Daemon, program  # noqa: E402
from system_calls import build_shim  # noqa: E402

OF_SQLITE = ("sqlite3", "selvedge.db", "--rebuild", "database(", "older_database", "shim", "EXPLAIN", "file_rows_locked")


def pytest_collection_modifyitems(items):
    """With another store than SQLite (SELVEDGE_TEST_STORE), tests that open its file or rebuild it are left out."""
    if os.environ.get("SELVEDGE_TEST_STORE", "sqlite") == "sqlite":
        return
    for item in items:
        source = inspect.getsource(item.function)
        if any(word in source for word in OF_SQLITE):
            item.add_marker(pytest.mark.skip("it is about the file of SQLite"))


@pytest.fixture(scope="module")
def daemon(tmp_path_factory):
    """One daemon for all tests of a file. Its worker is tests/support/python/fake_worker.py."""
    with Daemon(tmp_path_factory.mktemp("daemon") / "data") as d:
        yield d


@pytest.fixture(scope="module")
def real(tmp_path_factory):
    """The same with the real worker."""
    with Daemon(tmp_path_factory.mktemp("real") / "data", worker=program("selvedge-worker")) as d:
        yield d


@pytest.fixture
def daemon_maker(tmp_path):
    """Makes daemons with settings of their own, and stops those that still run at the end of the test."""
    made = []

    def make(name="data", **more):
        made.append(Daemon(tmp_path / name, **more))
        return made[-1].start()

    yield make
    for d in made:
        d.stop()


@pytest.fixture(scope="module")
def shim(tmp_path_factory):
    """The library that makes system calls fail or records them (support/python/system_calls.py)."""
    return build_shim(tmp_path_factory.mktemp("shim"))
