"""Access tokens in the command line client, its watched folder and the Python client."""
import json
import os
import subprocess
import sys
import time

import pytest
from daemon_under_test import DOCUMENT, FILES, ROOT, problem, program
from test_tokens import make

sys.path.insert(0, os.path.join(ROOT, "clients", "python"))
sys.path.insert(0, os.path.join(ROOT, "tests", "api", "clients"))
import selvedge  # noqa: E402
from watched_folder import Watcher, drop, outcome  # noqa: E402


@pytest.fixture
def guarded(daemon_maker, tmp_path, monkeypatch):
    for name in ("SELVEDGE_TOKEN", "SELVEDGE_TOKEN_FILE"):
        monkeypatch.delenv(name, raising=False)
    d = daemon_maker()
    d.admin = d.of(d.make_token("root"))
    d.file = tmp_path / "root.token"
    d.file.write_text(d.admin.session.headers["Authorization"].split()[1] + "\n")
    d.file.chmod(0o600)
    return d


def cli(d, *words, environment=None):
    return subprocess.run([program("selvedge"), "--server", d.url, *map(str, words)], capture_output=True, text=True, check=False,
                          env=dict(os.environ, **(environment or {})))


def test_the_token_comes_from_a_file_or_the_environment(guarded, tmp_path):
    r = cli(guarded, "list")
    assert r.returncode == 1 and "needs an access token" in r.stderr and "SELVEDGE_TOKEN_FILE" in r.stderr
    token = guarded.file.read_text().strip()
    wrong = tmp_path / "wrong"
    wrong.write_text("selvedge_x")
    wrong.chmod(0o600)
    assert cli(guarded, "list", "--token-file", guarded.file).returncode == 0
    assert cli(guarded, "list", environment={"SELVEDGE_TOKEN": token}).returncode == 0
    assert cli(guarded, "list", environment={"SELVEDGE_TOKEN_FILE": str(guarded.file), "SELVEDGE_TOKEN": "x"}).returncode == 0
    assert cli(guarded, "list", "--token-file", wrong, environment={"SELVEDGE_TOKEN": token}).returncode == 1
    r = cli(guarded, "list", "--token", token)  # would be seen in the list of processes
    assert r.returncode == 1 and "not the token itself" in r.stderr and token not in r.stderr
    guarded.file.chmod(0o640)
    r = cli(guarded, "list", "--token-file", guarded.file)
    assert r.returncode == 1 and "other users may read the token" in r.stderr and token not in r.stderr
    assert "cannot read the access token" in cli(guarded, "list", "--token-file", tmp_path / "none").stderr


def test_make_list_and_revoke(guarded, tmp_path):
    def admin(*words):
        return cli(guarded, *words, "--token-file", guarded.file)

    made = admin("token", "make", "ann", "--scope", "submit", "--jobs", "7", "--bytes=1000", "--requests", "600")
    assert made.returncode == 0 and made.stdout.startswith("selvedge_") and "shown only now" in made.stderr
    user = guarded.of(made.stdout.strip())
    who = user.get("/v1/session").json()
    assert who["scope"] == "submit" and who["quota"] == {"requests_per_minute": 600, "stored_bytes": 1000, "jobs": 7}
    saved = tmp_path / "screen.token"
    r = admin("token", "make", "screen", "--scope", "read", "--owner", "ann", "--out", saved)
    assert r.returncode == 0 and r.stdout == "" and saved.stat().st_mode & 0o777 == 0o600
    assert guarded.of(saved.read_text().strip()).get("/v1/session").json()["owner"] == "ann"
    r = admin("token", "make", "other", "--scope", "read", "--out", saved)
    assert r.returncode == 1 and "exists already" in r.stderr and len(guarded.admin.get("/v1/tokens").json()["tokens"]) == 3
    table = admin("token", "list").stdout.splitlines()
    assert [line.split()[:3] for line in table[1:]] == [["screen", "ann", "read"], ["ann", "ann", "submit"], ["root", "root", "admin"]]
    assert [t["name"] for t in json.loads(admin("token", "list", "--json").stdout)] == ["screen", "ann", "root"]
    assert admin("token", "revoke", "ann").returncode == 0
    problem(user.get("/v1/jobs"), 401, "token")
    for words, what in ((("revoke", "ann"), "does not exist"), (("make", "x"), "needs --scope"),
                        (("make", "root", "--scope", "read"), "a token named 'root' exists"),
                        (("make", "x", "--scope", "all"), "read, submit or admin"), (("make",), "needs a name"), (("list", "x"), "takes no name"),
                        (("burn", "x"), "can make, list and revoke"), (("revoke", "../jobs"), "no name of a token")):
        r = admin("token", *words)
        assert r.returncode in (1, 2) and what in r.stderr, (words, r.stderr)
    r = cli(guarded, "token", "list", "--token-file", saved)
    assert r.returncode == 1 and "needs a token with scope admin" in r.stderr


def test_a_job_from_start_to_end_with_a_token(guarded, tmp_path):
    saved = tmp_path / "ann.token"
    assert cli(guarded, "token", "make", "ann", "--scope", "submit", "--out", saved, "--token-file", guarded.file).returncode == 0
    for name, (_, data) in FILES.items():
        (tmp_path / name).write_bytes(data)
    (tmp_path / "job.json").write_text(json.dumps(DOCUMENT))
    r = cli(guarded, "submit", tmp_path / "job.json", "--watch", "--token-file", saved)
    assert r.returncode == 0, r.stderr
    r = cli(guarded, "results", r.stdout.split()[0], "--out", tmp_path / "results", "--token-file", saved)
    assert r.returncode == 0 and (tmp_path / "results" / "result.json").exists(), r.stderr
    client = selvedge.Client(guarded.url, token_file=str(saved))
    job = client.submit(str(tmp_path / "job.json"))
    assert job.wait().state == "succeeded" and len(list(client.jobs())) == 2
    with pytest.raises(selvedge.Problem) as refused:
        selvedge.Client(guarded.url).about()
    assert refused.value.status == 401 and refused.value.code == "token"
    saved.chmod(0o644)
    with pytest.raises(ValueError, match="other users may read the token"):
        selvedge.Client(guarded.url, token_file=str(saved))


def test_a_watched_folder_with_a_token(guarded, tmp_path):
    watched = tmp_path / "watched"
    watched.mkdir()
    token = tmp_path / "folder.token"
    token.write_text(make(guarded.admin, "folder"))
    token.chmod(0o600)
    drop(str(watched), "one")
    with Watcher(watched, guarded.url, "--once", "--token-file", str(token)) as w:
        assert w.process.wait(60) == 0, w.text()
    assert outcome(str(watched), "one")["state"] == "succeeded"
    assert [j["owner"] for j in guarded.admin.get("/v1/jobs").json()["jobs"]] == ["folder"]


def test_clients_wait_when_the_quota_of_requests_is_used_up(guarded):
    token = make(guarded.admin, "eager", requests_per_minute=30)
    client = selvedge.Client(guarded.url, token=token)
    started = time.monotonic()
    for _ in range(31):
        client.about()
    assert time.monotonic() - started > 1  # two seconds a request after the first 30
    r = cli(guarded, "list", environment={"SELVEDGE_TOKEN": token})
    assert r.returncode == 0, r.stderr
