import inspect
import os
import sys

import pytest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.dirname(os.path.abspath(__file__))), "support", "python"))
from servers.daemon_fixtures import daemon, daemon_maker, shim  # noqa: E402, F401
from daemon_under_test import Daemon, program  # noqa: E402

OF_SQLITE = ("sqlite3", "selvedge.db", "--rebuild", "database(", "older_database", "shim", "EXPLAIN", "file_rows_locked", "set_age", "(traced)")


def pytest_collection_modifyitems(items):
    """With another store than SQLite (SELVEDGE_TEST_STORE), tests that open its file or rebuild it are left out."""
    if os.environ.get("SELVEDGE_TEST_STORE", "sqlite") == "sqlite":
        return
    for item in items:
        source = inspect.getsource(item.function)
        if any(word in source for word in OF_SQLITE):
            item.add_marker(pytest.mark.skip("it is about the file of SQLite"))


@pytest.fixture(scope="module")
def real(tmp_path_factory):
    """One daemon with the real worker for all tests of a file."""
    with Daemon(tmp_path_factory.mktemp("real") / "data", worker=program("selvedge-worker")) as d:
        yield d
