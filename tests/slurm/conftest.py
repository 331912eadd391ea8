import os
import sys

import pytest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.dirname(os.path.abspath(__file__))), "support", "python"))
from servers.daemon_fixtures import made_daemons  # noqa: E402
from slurm_cluster import SlurmCluster, missing  # noqa: E402


@pytest.fixture(scope="session")
def cluster(tmp_path_factory):
    """A cluster of two nodes for all tests."""
    reason = missing()
    if reason:
        pytest.skip(reason)
    with SlurmCluster(tmp_path_factory.mktemp("slurm") / "cluster") as c:
        yield c


@pytest.fixture
def daemon_maker(tmp_path, cluster):
    """Makes daemons whose jobs run on the cluster, and stops those that still run at the end of the test."""
    with made_daemons(tmp_path, environment=cluster.environment) as make:
        yield lambda name="data", options=None, **more: make(name, options=cluster.options(**(options or {})), **more)
    cluster.run("scancel", "--me", check=False)
