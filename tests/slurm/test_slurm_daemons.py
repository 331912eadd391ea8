"""Two daemons on one PostgreSQL, and one data folder, whose jobs run on the cluster: when one is killed, the other takes
over its jobs where they are."""
import tempfile

import pytest
from cluster_demo import database, missing_postgresql
from daemon_under_test import wait_until


@pytest.fixture(scope="module")
def store():
    reason = missing_postgresql()
    if reason:
        pytest.skip(reason)
    with tempfile.TemporaryDirectory(prefix="selvedge-postgres-") as folder, database(folder, "postgresql") as options:
        yield options


def test_the_jobs_of_a_killed_daemon_are_adopted(cluster, store, daemon_maker):
    options = dict(store, **{"server.lease_s": 2, "jobs.workers": 2})
    first, second = (daemon_maker(options=options) for _ in range(2))
    jobs = [first.start_job("work 6"), first.start_job("work")]
    wait_until(lambda: all(second.job(j)["fraction"] == 0.5 for j in jobs))
    numbers = [wait_until(lambda j=j: second.job(j)["backend"]["id"]) for j in jobs]
    first.kill()
    done = second.wait_state(jobs[0], "succeeded", timeout_s=40)
    assert done["attempt"] == 1 and done["lost_attempts"] == 0 and done["result"]["run"] == 1
    assert cluster.jobs()[numbers[0]] == "COMPLETED" and cluster.jobs()[numbers[1]] == "RUNNING"
    second.post(f"/v1/jobs/{jobs[1]}/cancel")
    assert second.wait_state(jobs[1], "cancelled")["attempt"] == 1
    third = second.start_job("succeed")
    assert second.wait_state(third, "succeeded")["attempt"] == 1
