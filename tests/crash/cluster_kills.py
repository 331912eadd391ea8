"""Two daemons on one PostgreSQL database and one data folder, which are killed at any moment: nothing acknowledged is lost, whichever
daemon is asked, and no job has two results.

    cluster_kills.py [--kills 200] [--seed 1]

Requests go to either daemon. After a kill the other daemon goes on alone until the killed one is started again; every tenth kill takes
both. Prints the kills and the facts that were confirmed, as lines of JSON; exit status 1 when a fact is lost."""
import argparse
import collections
import json
import os
import random
import re
import sys
import tempfile
import threading
import time

import requests

sys.path.insert(0, os.path.join(os.path.dirname(os.path.dirname(os.path.abspath(__file__))), "support", "python"))
from daemon_under_test import FILES, Daemon, store_options, wait_until  # noqa: E402
from servers.postgres_server import PostgresMissing, PostgresServer  # noqa: E402

LEASE_S = 2
FINAL = ("draft", "succeeded", "failed", "cancelled")
BEHAVIOURS = ("succeed", "fail", "kill_once", "work 0.3", "work 1.0")


def pair(server, folder):
    """Two daemons that share database and data folder."""
    options = {**store_options(server, server.make_database(), folder), "server.lease_s": LEASE_S, "jobs.workers": 2, "jobs.cancel_grace_s": 0}
    return [Daemon(os.path.join(folder, "data"), options=options) for _ in range(2)]


class Traffic:
    """Requests at random, and what was acknowledged: known[job] is draft, started, unknown or None (deleted)."""
    def __init__(self, rng):
        self.rng, self.known, self.facts = rng, {}, 0
        self.lost = set()  # what was acknowledged and is not so, in words

    def request(self, d):
        alive = [j for j, state in self.known.items() if state is not None]
        act = self.rng.choice(["create", "start", "start", "cancel", "delete", "retry"]) if alive else "create"
        if act == "create":
            self.known[d.ready_job(self.rng.choice(BEHAVIOURS), checked=self.rng.random() < 0.5)] = "draft"
            self.facts += 1 + 2 * len(FILES)
            return
        job = self.rng.choice(alive)
        if act == "delete":
            self.known[job] = "unknown"  # until the reply has arrived
            r = d.delete(f"/v1/jobs/{job}")
            assert r.status_code in (204, 404), r.text
            self.known[job] = None
            self.facts += 1
            return
        r = d.post(f"/v1/jobs/{job}/{act}")
        assert r.status_code in (200, 202, 404, 409) and (r.status_code != 404 or self.known[job] == "unknown"), r.text
        if r.status_code == 202 and act in ("start", "retry"):
            self.known[job] = "started"
            self.facts += 1

    def confirm(self, d):
        """Everything that was acknowledged by any daemon is what this one says."""
        for job, state in self.known.items():
            r = d.get(f"/v1/jobs/{job}")
            if state == "unknown":
                if r.status_code == 404:
                    self.known[job] = None
            elif state is None:
                self.check(r.status_code == 404, f"job {job} is deleted, but there: {r.status_code}")
            elif self.check(r.status_code == 200, f"job {job} ({state}) is lost: {r.status_code}"):
                self.check(state != "started" or r.json()["state"] != "draft", f"the start of job {job} is lost")
                for name, (_, content) in FILES.items():
                    self.check(d.get(f"/v1/jobs/{job}/files/{name}").content == content, f"file {name} of job {job} is lost")

    def check(self, kept, words):
        if not kept and words not in self.lost:
            self.lost.add(words)
            print(words, file=sys.stderr)
        return kept


def one_round(traffic, daemons, victims, rng):
    """Requests until the victims are killed."""
    stop_at = time.monotonic() + rng.uniform(0.05, 0.5)

    def kill():
        time.sleep(max(0, stop_at - time.monotonic()))
        for d in victims:
            d.process.kill()
    killer = threading.Thread(target=kill)
    killer.start()
    while killer.is_alive() or time.monotonic() < stop_at:
        try:
            traffic.request(rng.choice(daemons))
        except (requests.ConnectionError, requests.Timeout):
            if len(victims) == len(daemons):
                break
    killer.join()
    for d in victims:
        d.kill()


def finish(traffic, daemons):
    """All jobs reach a final state, with one success each at most, in a folder each."""
    d = daemons[0]

    def jobs():
        return d.get("/v1/jobs?limit=500").json()["jobs"]
    wait_until(lambda: all(j["state"] in FINAL for j in jobs()), 90, "the end of all jobs")
    traffic.confirm(daemons[1])
    # jobs that were being created when a daemon was killed may exist without being known; they are drafts
    strangers = [j for j in jobs() if j["id"] not in traffic.known]
    assert all(j["state"] == "draft" for j in strangers), strangers
    for j in jobs():
        assert j["state"] != "succeeded" or d.job(j["id"])["result"], f"job {j['id']} has succeeded without a result"
    ends = collections.Counter(re.findall(r"job (\S+) is succeeded", d.log_text()))
    twice = [job for job, n in ends.items() if n > 1]
    assert not twice, f"jobs with two results: {twice}"
    wait_until(lambda: set(os.listdir(os.path.join(d.data, "jobs"))) <= {j["id"] for j in jobs()}, 10, "the removal of deleted jobs")
    assert os.listdir(os.path.join(d.data, "quarantine")) == []
    return sum(ends.values())


def run(server, folder, n_kills, seed, pauses_s=(0, 0.2, 1.5 * LEASE_S)):
    """pauses_s: how long the other daemon goes on alone. Returns counts of kills, facts, lost facts and jobs with a result."""
    rng = random.Random(seed)
    daemons = [d.start() for d in pair(server, folder)]
    try:
        kills, traffic, results = loop(daemons, n_kills, pauses_s, rng)
    finally:
        for d in daemons:
            d.stop()
    return {"kills": kills, "facts": traffic.facts, "lost": len(traffic.lost), "results": results}


def loop(daemons, n_kills, pauses_s, rng):
    traffic, kills = Traffic(rng), 0
    while kills < n_kills:
        victims = list(daemons) if kills % 10 == 9 and kills + 2 <= n_kills else [rng.choice(daemons)]
        one_round(traffic, daemons, victims, rng)
        kills += len(victims)
        others = [d for d in daemons if d not in victims]
        if others:  # the other one has all facts at once, and goes on for a while
            traffic.confirm(others[0])
            end = time.monotonic() + rng.choice(pauses_s)
            while time.monotonic() < end:
                traffic.request(others[0])
        for d in victims:
            d.start()
    return kills, traffic, finish(traffic, daemons)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--kills", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    try:
        with tempfile.TemporaryDirectory(prefix="selvedge-kills-") as folder:
            with PostgresServer() as server:
                count = run(server, folder, arguments.kills, arguments.seed)
    except PostgresMissing as why:
        print(f"skipped: {why}")
        return
    for name, value in count.items():
        print(json.dumps({"name": f"cluster.{name}", "value": value, "unit": "1", "better": "lower" if name == "lost" else "higher"}))
    sys.exit(1 if count["lost"] else 0)


if __name__ == "__main__":
    main()
