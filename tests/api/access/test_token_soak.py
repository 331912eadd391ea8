"""Many threads make, use and revoke tokens at the same time (SELVEDGE_SOAK_S seconds, default 4). What holds throughout: no
request that begins after a revocation has been answered is let in, no owner passes a quota or sees a job of another one."""
import os
import random
import threading
import time

import requests
from test_tokens import make

SOAK_S = float(os.environ.get("SELVEDGE_SOAK_S", "4"))
N_USER = 6
MOST_JOBS = 5


class User(threading.Thread):
    """One owner, whose token is replaced all the time by the administrator."""

    def __init__(self, daemon, i):
        super().__init__()
        self.url, self.owner, self.random = daemon.url, f"user{i}", random.Random(i)
        self.lock, self.token, self.token_name, self.revoked = threading.Lock(), None, None, set()
        self.n, self.n_refused, self.faults, self.stop = 0, 0, [], False
        self.session = requests.Session()

    def replace(self, admin):
        """A token for the same owner in place of the old one; the old one counts as revoked once that has been answered."""
        name = f"{self.owner}.{time.monotonic_ns()}"
        new = make(admin, name, owner=self.owner, jobs=MOST_JOBS, requests_per_minute=self.random.choice([0, 6000]))
        with self.lock:
            old, self.token = self.token, new
        if old is not None:
            assert admin.delete(f"/v1/tokens/{self.token_name}").status_code == 204
            with self.lock:
                self.revoked.add(old)
        self.token_name = name

    def run(self):
        while not self.stop:
            with self.lock:
                token = self.token
                known = self.random.choice(sorted(self.revoked)) if self.revoked and self.random.random() < 0.3 else None
            try:
                self.once(known or token, known is not None)
            except requests.RequestException as broken:
                self.faults.append(repr(broken))
            self.n += 1

    def once(self, token, must_fail):
        headers = {"Authorization": f"Bearer {token}"}
        kind = self.random.random()
        if kind < 0.4:
            r = self.session.get(self.url + "/v1/jobs?limit=100", headers=headers, timeout=300)
            if r.status_code == 200 and ({j["owner"] for j in r.json()["jobs"]} - {self.owner} or len(r.json()["jobs"]) > MOST_JOBS):
                self.faults.append(r.text)
            if r.status_code == 200 and r.json()["jobs"] and kind < 0.1:
                self.session.delete(self.url + "/v1/jobs/" + r.json()["jobs"][0]["id"], headers=headers, timeout=300)
        elif kind < 0.8:
            r = self.session.post(self.url + "/v1/jobs", headers=headers, timeout=300,
                                  json={"sample": "s", "volume": {"files": ["a.tif"]}, "measurements": {"file": "a.csv"}})
        else:
            r = requests.post(self.url + "/v1/session", json={"token": token}, timeout=300)
            if r.status_code == 200:
                r = requests.get(self.url + "/v1/session", cookies=r.cookies, timeout=300)
        if must_fail and r.status_code != 401:
            self.faults.append(f"a revoked token got {r.status_code}")
        if r.status_code not in (200, 201, 401, 429, 507):
            self.faults.append(f"{r.status_code} {r.text}")
        self.n_refused += r.status_code == 401


def test_tokens_come_and_go(daemon_maker):
    d = daemon_maker(options={"access.requests_per_minute": 0})
    admin = d.of(d.make_token("root"))
    users = [User(d, i) for i in range(N_USER)]
    for user in users:
        user.replace(admin)
        user.start()
    until = time.monotonic() + SOAK_S
    n_replaced = 0
    while time.monotonic() < until:
        users[n_replaced % N_USER].replace(admin)
        n_replaced += 1
    for user in users:
        user.stop = True
    for user in users:
        user.join()
        assert user.faults == []
    assert n_replaced >= N_USER and sum(u.n_refused for u in users) > 0
    print(f"{sum(u.n for u in users)} requests, {n_replaced} tokens replaced, {sum(u.n_refused for u in users)} refused")
