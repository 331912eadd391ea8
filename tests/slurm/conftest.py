import os
import sys

import pytest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.dirname(os.path.abspath(__file__))), "support", "python"))
from daemon_under_test import Daemon  # noqa: E402
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
    made = []

    def make(name="data", options=None, **more):
        made.append(Daemon(tmp_path / name, options=cluster.options(**(options or {})), environment=cluster.environment, **more))
        return made[-1].start()

    yield make
    for d in made:
        d.stop()
    cluster.run("scancel", "--me", check=False)
