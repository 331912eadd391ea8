"""Fixtures that give a test its daemon. A conftest.py imports those that its tests name."""
from contextlib import contextmanager

import pytest

from daemon_under_test import Daemon
from system_calls import build_shim


@contextmanager
def made_daemons(folder, **common):
    """Makes daemons with settings of their own below a folder, and stops those that still run at the end.

    common: arguments that each Daemon gets unless a call gives others.
    """
    made = []

    def make(name="data", **more):
        made.append(Daemon(folder / name, **{**common, **more}))
        return made[-1].start()

    try:
        yield make
    finally:
        for d in made:
            d.stop()


@pytest.fixture(scope="module")
def daemon(tmp_path_factory):
    """One daemon for all tests of a file. Its worker is tests/support/python/fake_worker.py."""
    with Daemon(tmp_path_factory.mktemp("daemon") / "data") as d:
        yield d


@pytest.fixture
def daemon_maker(tmp_path):
    """Makes daemons with settings of their own, and stops those that still run at the end of the test."""
    with made_daemons(tmp_path) as make:
        yield make


@pytest.fixture(scope="module")
def shim(tmp_path_factory):
    """The library that makes system calls fail or records them (system_calls.py)."""
    return build_shim(tmp_path_factory.mktemp("shim"))
