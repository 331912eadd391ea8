"""Webhooks: what a receiver gets, and receivers that fail, hang, redirect and lie."""
import hmac
import http.server
import json
import os
import socket
import subprocess
import threading
import time

import pytest
from daemon_under_test import DOCUMENT, FAKE_WORKER, FILES, ROOT, TIMEOUT_S, program, wait_until

CLIENT_WORKER = os.path.join(ROOT, "tests", "support", "python", "client_stub_worker.py")
SECRET = b"a secret of the laboratory"


class Receiver:
    """Answers each POST by `answer(request number, handler)`, and keeps what came."""
    def __init__(self, answer=None):
        self.got, receiver = [], self

        class Handler(http.server.BaseHTTPRequestHandler):
            def do_POST(self):
                body = self.rfile.read(int(self.headers["Content-Length"]))
                receiver.got.append((dict(self.headers), body))
                if answer is None:
                    self.reply(204)
                else:
                    answer(len(receiver.got), self)

            def reply(self, status, **headers):
                self.send_response(status)
                for name, value in headers.items():
                    self.send_header(name, value)
                self.send_header("Content-Length", "0")
                self.end_headers()

            def log_message(self, *unused):
                """Nothing is printed."""

        class Server(http.server.ThreadingHTTPServer):
            def handle_error(self, *unused):
                """A client that has gone away is expected."""

        self.server = Server(("127.0.0.1", 0), Handler)
        self.server.daemon_threads = True
        self.url = f"http://127.0.0.1:{self.server.server_port}/hook?x=1"
        threading.Thread(target=self.server.serve_forever, daemon=True).start()

    def close(self):
        self.server.shutdown()
        self.server.server_close()


@pytest.fixture
def service(daemon_maker, tmp_path):
    """service(answer, **settings): a daemon and the receiver of its webhook."""
    made = []

    def make(answer=None, secret_mode=0o600, worker=FAKE_WORKER, **settings):
        secret = tmp_path / "secret"
        secret.write_bytes(SECRET + b"\n")
        secret.chmod(secret_mode)
        made.append(Receiver(answer))
        options = {"webhook.url": made[-1].url, "webhook.secret_file": secret, "webhook.retry_s": 1, "webhook.timeout_s": 30}
        return daemon_maker(options={**options, **{"webhook." + k: v for k, v in settings.items()}}, worker=worker), made[-1]

    yield make
    for r in made:
        r.close()


def deliveries(daemon, **query):
    return daemon.get("/v1/deliveries", params=query).json()["deliveries"]


def only(daemon, state):
    return wait_until(lambda: (lambda d: d[0] if len(d) == 1 and d[0]["state"] == state else None)(deliveries(daemon)), what=state)


def check_signature(headers, body):
    fields = dict(part.split("=", 1) for part in headers["Selvedge-Signature"].split(","))
    assert abs(time.time() - int(fields["t"])) < 300
    assert fields["v1"] == hmac.new(SECRET, fields["t"].encode() + b"." + body, "sha256").hexdigest()


def test_every_end_of_a_job_is_delivered_once(service):
    d, receiver = service()
    good, bad, cancelled = d.start_job("succeed"), d.start_job("fail"), d.ready_job()
    d.post(f"/v1/jobs/{cancelled}/cancel")
    listed = wait_until(lambda: (lambda x: x if len(x) == 3 and {y["state"] for y in x} == {"delivered"} else None)(deliveries(d)))
    events = {}
    for headers, body in receiver.got:
        check_signature(headers, body)
        said = json.loads(body)
        assert said["delivery"] == headers["Selvedge-Delivery"] and said["event"] == headers["Selvedge-Event"]
        assert said["job"]["url"] == f"/v1/jobs/{said['job']['id']}" and d.get(said["job"]["url"]).json()["state"] == said["job"]["state"]
        events[said["job"]["id"]] = said
    assert {k: v["event"] for k, v in events.items()} == {good: "job.succeeded", bad: "job.failed", cancelled: "job.cancelled"}
    assert events[good]["job"]["error"] is None and events[bad]["job"]["error"]["field"] == "volume.files"
    assert len(receiver.got) == 3 and {x["id"] for x in listed} == {e["delivery"] for e in events.values()}
    assert [x["job"] for x in deliveries(d, job=bad)] == [bad]
    page = d.get("/v1/deliveries?limit=2").json()
    rest = d.get("/v1/deliveries", params={"limit": 2, "cursor": page["next_cursor"]}).json()
    assert [x["id"] for x in page["deliveries"] + rest["deliveries"]] == [x["id"] for x in listed] and rest["next_cursor"] is None


@pytest.mark.parametrize("code, words", [("good", "good"), ("does_not_describe_this_cloth", "does not describe this cloth"), (None, None)])
def test_a_delivery_has_the_verdict(service, code, words):
    """Code and words, as the job has them; null where the job ended without one."""
    d, receiver = service(worker=CLIENT_WORKER)
    job = d.create(dict(DOCUMENT, sample={"good": "good twill", None: "plain twill"}.get(code, "bad twill")))
    for name, (role, data) in FILES.items():
        d.upload(job, name, data, role)
    assert d.post(f"/v1/jobs/{job}/start").status_code == 202
    only(d, "delivered")
    said = json.loads(receiver.got[0][1])["job"]
    assert said["id"] == job and said["verdict"] == (None if code is None else {"code": code, "words": words})
    assert (d.job(job)["verdict"] or {}).get("words") == words


@pytest.mark.slow
def test_a_receiver_that_fails_is_tried_again(service):
    def answer(n, handler):
        if n == 1:
            handler.connection.shutdown(socket.SHUT_RDWR)
        else:
            handler.reply(500 if n == 2 else 200)

    d, receiver = service(answer)
    d.start_job("succeed")
    seen = only(d, "waiting") if len(receiver.got) < 2 else None
    done = only(d, "delivered")
    assert done["n_try"] == 3 and done["last_status"] == 200 and done["last_error"] is None and done["delivered_unix_s"] >= done["created_unix_s"]
    assert seen is None or seen["next_try_unix_s"] > seen["created_unix_s"] - 1
    assert len({body for _, body in receiver.got}) == 1, "the same bytes each time"
    for headers, body in receiver.got:
        check_signature(headers, body)


def lie_endless(n, handler):
    handler.send_response(200)
    handler.end_headers()
    for _ in range(1000):
        handler.wfile.write(b"x" * 65536)


def lie_length(n, handler):
    handler.send_response(200)
    handler.send_header("Content-Length", "1000")
    handler.end_headers()
    handler.wfile.write(b"short")
    handler.connection.shutdown(socket.SHUT_RDWR)


def drip(n, handler):
    for c in b"HTTP/1.1 200 OK\r\n" + b"X: y\r\n" * 1000:
        handler.wfile.write(bytes([c]))
        time.sleep(0.2)


@pytest.mark.slow
@pytest.mark.parametrize("answer, words", [
    (lambda n, handler: time.sleep(5), "imed out"), (drip, "imed out"), (lie_endless, "more than 65536 bytes"), (lie_length, "transfer closed"),
    (lambda n, handler: handler.reply(302, Location="/elsewhere"), "status 302"),
    (lambda n, handler: handler.wfile.write(b"no HTTP at all\r\n\r\n"), "")])
def test_receivers_that_hang_and_lie(service, answer, words):
    d, receiver = service(answer, max_tries=1, timeout_s=1)
    d.start_job("succeed")
    begin = time.monotonic()
    assert d.get("/livez").status_code == 200 and time.monotonic() - begin < 5 * TIMEOUT_S
    failed = only(d, "failed")
    assert words in failed["last_error"] and failed["n_try"] == 1 and failed["next_try_unix_s"] is None
    assert len(receiver.got) == 1, "a redirect was followed"


@pytest.mark.slow
def test_a_delivery_survives_a_kill(service):
    up = threading.Event()
    d, receiver = service(lambda n, handler: handler.reply(204 if up.is_set() else 503))
    d.start_job("succeed")
    wait_until(lambda: receiver.got)
    d.kill()
    up.set()
    d.start()
    assert only(d, "delivered")["id"] == receiver.got[0][0]["Selvedge-Delivery"] == receiver.got[-1][0]["Selvedge-Delivery"]


@pytest.mark.slow
def test_a_stop_does_not_wait_for_a_receiver_that_hangs(service):
    d, receiver = service(lambda n, handler: time.sleep(200), timeout_s=100)
    d.start_job("succeed")
    wait_until(lambda: receiver.got)
    begin = time.monotonic()
    d.stop()
    assert time.monotonic() - begin < 60


@pytest.mark.parametrize("settings, words", [
    ({"url": "file:///etc/passwd"}, "not an http"), ({"secret_file": ""}, "needs a file"), ({"secret_file": "/nonexistent"}, "cannot read"),
    ({"mode": 0o644}, "other users may read"), ({"secret": b"short"}, "at least 16")])
def test_settings_are_checked(tmp_path, settings, words):
    secret = tmp_path / "secret"
    secret.write_bytes(settings.pop("secret", SECRET))
    secret.chmod(settings.pop("mode", 0o600))
    options = {"url": "http://127.0.0.1:1/", "secret_file": str(secret), **settings}
    command = [program("selvedged"), "--data", str(tmp_path / "data"), "--port", "0"]
    for key, value in options.items():
        command += ["--set", f"webhook.{key}={value}"]
    run = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert run.returncode == 1 and words in run.stderr


def test_a_credential_of_systemd_is_accepted(tmp_path, service, monkeypatch):
    """systemd admits the service by an access list, which shows as permissions of the group."""
    monkeypatch.setenv("CREDENTIALS_DIRECTORY", str(tmp_path))
    d, receiver = service(secret_mode=0o440)
    d.start_job("succeed")
    only(d, "delivered")
    check_signature(*receiver.got[0])


def test_deliveries_end_when_the_webhook_is_switched_off(service):
    """A later address must not get what was meant for this one."""
    d, receiver = service(lambda n, handler: handler.reply(503), retry_s=3600)
    d.start_job("succeed")
    wait_until(lambda: receiver.got)
    d.stop()
    on = d.options
    d.options = {k: v for k, v in on.items() if not k.startswith("webhook.")}
    d.start()
    failed = only(d, "failed")
    assert failed["last_error"] == "the webhook was switched off" and failed["next_try_unix_s"] is None
    d.stop()
    d.options = on
    d.start()
    assert only(d, "failed")["id"] == failed["id"]


def test_nothing_is_kept_without_an_address(daemon_maker):
    d = daemon_maker()
    job = d.start_job("succeed")
    d.wait_state(job, "succeeded")
    assert deliveries(d) == []
