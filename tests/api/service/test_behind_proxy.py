"""The daemon on a unix socket, and behind a proxy that publishes it under another address."""
import http.client
import os
import re
import shutil
import socket
import stat
import subprocess

import pytest
import requests
from daemon_under_test import DOCUMENT, FILES, ROOT, Daemon, problem, program, wait_until

ORIGIN = "https://selvedge.example.org"


class UnixConnection(http.client.HTTPConnection):
    def __init__(self, path):
        super().__init__("localhost")
        self.path = path

    def connect(self):
        self.sock = socket.socket(socket.AF_UNIX)
        self.sock.connect(self.path)

    def call(self, method, path, body=None, **headers):
        self.request(method, path, body, headers)
        answer = self.getresponse()
        return answer.status, answer.read()


class UnixDaemon:
    """A daemon that listens on a unix socket."""

    def __init__(self, folder, **options):
        self.socket = str(folder / "http.sock")
        self.daemon = Daemon(folder / "data", options={"server.unix_socket": self.socket, **options})

    def __enter__(self):
        os.makedirs(os.path.dirname(self.daemon.data), exist_ok=True)
        self.process = subprocess.Popen(self.daemon.command(), stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        assert self.process.stdout.readline() == f"selvedged listens on unix:{self.socket}\n"
        return self

    def __exit__(self, *unused):
        self.process.terminate()
        assert self.process.wait(30) == 0
        self.process.stdout.close()


def test_a_unix_socket_is_for_this_user_only(tmp_path):
    with UnixDaemon(tmp_path) as d:
        assert stat.S_IMODE(os.stat(d.socket).st_mode) == 0o600
        assert UnixConnection(d.socket).call("GET", "/livez")[0] == 200
        listed = subprocess.run([program("selvedge"), "list", "--server", f"unix:{d.socket}", "--json"], capture_output=True, text=True, check=False)
        assert listed.returncode == 0 and listed.stdout.strip() == "[]", listed.stderr
        other = subprocess.run([program("selvedged"), "--data", str(tmp_path / "b"), "--set", f"server.unix_socket={d.socket}"],
                               capture_output=True, text=True, check=False)
        assert other.returncode == 1 and "another process does" in other.stderr
        assert UnixConnection(d.socket).call("GET", "/livez")[0] == 200
        d.process.kill()
        d.process.wait()
        assert os.path.exists(d.socket)
        d.__enter__()  # the file of a killed daemon is replaced
        assert UnixConnection(d.socket).call("GET", "/livez")[0] == 200
    assert not os.path.exists(d.socket)


def test_a_file_in_the_place_of_the_socket_stays(tmp_path):
    (tmp_path / "precious").write_text("x")
    done = subprocess.run([program("selvedged"), "--data", str(tmp_path / "data"), "--set", f"server.unix_socket={tmp_path / 'precious'}"],
                          capture_output=True, text=True, check=False)
    assert done.returncode == 1 and (tmp_path / "precious").read_text() == "x"


@pytest.mark.parametrize("host, origin, status", [
    ("selvedge.example.org", ORIGIN, 201), ("localhost", ORIGIN, 201), ("Selvedge.Example.org", None, 201),
    ("selvedge.example.org", "http://selvedge.example.org", 403), ("selvedge.example.org", "https://evil.example", 403),
    ("evil.example", None, 400), ("evil.example", ORIGIN, 400), ("selvedge.example.org:8443", None, 400), ("localhost", "http://localhost", 201)])
def test_the_public_origin_is_the_only_other_one(daemon_maker, host, origin, status):
    d = daemon_maker(options={"server.public_origin": ORIGIN})
    headers = {"Host": host, **({"Origin": origin} if origin else {})}
    assert d.post("/v1/jobs", json=DOCUMENT, headers=headers).status_code == status


@pytest.mark.parametrize("origin", ["selvedge.example.org", "https://", "ftp://x", "https://x/path", "https://user@x"])
def test_what_is_no_origin_is_refused(tmp_path, origin):
    done = subprocess.run([program("selvedged"), "--data", str(tmp_path / "data"), "--port", "0", "--set", f"server.public_origin={origin}"],
                          capture_output=True, text=True, check=False)
    assert done.returncode == 1 and "server.public_origin" in done.stderr + "server.public_origin" and "not an origin" in done.stderr


def certificate(folder):
    subprocess.run(["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes", "-days", "2",
                    "-keyout", folder / "key.pem", "-out", folder / "cert.pem", "-subj", "/CN=selvedge.example.org", "-addext", "subjectAltName=IP:127.0.0.1"],
                   check=True, capture_output=True)


def test_tls_by_the_settings(tmp_path):
    certificate(tmp_path)
    options = {"server.tls_certificate": tmp_path / "cert.pem", "server.tls_key": tmp_path / "key.pem"}
    with Daemon(tmp_path / "data", options=options) as d:
        assert d.url.startswith("https://127.0.0.1:")
        d.session.trust_env, d.session.verify = False, str(tmp_path / "cert.pem")
        job = d.start_job("succeed")
        assert d.wait_state(job, "succeeded")["result"]["objective"] == 0.01
        own, foreign = f"https://127.0.0.1:{d.port}", f"http://127.0.0.1:{d.port}"
        assert [d.post("/v1/jobs", json=DOCUMENT, headers={"Origin": o}).status_code for o in (own, foreign)] == [201, 403]
        with pytest.raises(requests.ConnectionError):
            requests.get(f"http://127.0.0.1:{d.port}/livez", timeout=100)
        with pytest.raises(requests.exceptions.SSLError):
            session = requests.Session()
            session.trust_env = False
            session.get(d.url + "/livez", timeout=100)


@pytest.mark.parametrize("spoil", ["readable", "no_key", "garbage", "missing"])
def test_what_tls_cannot_use_is_refused(tmp_path, spoil):
    certificate(tmp_path)
    if spoil == "garbage":
        (tmp_path / "cert.pem").write_text("no certificate")
    os.chmod(tmp_path / "key.pem", 0o644 if spoil == "readable" else 0o600)
    key = {"no_key": "", "missing": tmp_path / "other.pem"}.get(spoil, tmp_path / "key.pem")
    done = subprocess.run([program("selvedged"), "--data", str(tmp_path / "data"), "--port", "0", "--set", f"server.tls_certificate={tmp_path / 'cert.pem'}",
                           "--set", f"server.tls_key={key}"], capture_output=True, text=True, check=False)
    assert done.returncode == 1 and "listens" not in done.stdout
    assert {"readable": "other users may read", "no_key": "needs both", "garbage": "cannot start the HTTP server with certificate",
            "missing": "other.pem"}[spoil] in done.stderr


def free_port():
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return s.getsockname()[1]


def nginx_configuration(folder, sock, port, with_tokens):
    """config/nginx.conf with the paths of this test; with access tokens in place of passwords, as it says itself."""
    with open(os.path.join(ROOT, "config", "nginx.conf")) as f:
        text = f.read()
    for old, new in [("/run/selvedge/http.sock", sock), ("listen 443 ssl", f"listen 127.0.0.1:{port} ssl"),
                     ("/etc/selvedge/passwords", folder / "passwords"),
                     ("/etc/ssl/certs/selvedge.example.org.pem", folder / "cert.pem"), ("/etc/ssl/private/selvedge.example.org.key", folder / "key.pem")]:
        assert old in text
        text = text.replace(old, str(new))
    if with_tokens:
        text = re.sub(r"(?m)^ *(auth_basic.*|proxy_set_header Authorization.*)\n", "", text)
    own = "".join(f"{name}_temp_path {folder}/{name};" for name in ("client_body", "proxy", "fastcgi", "uwsgi", "scgi"))
    user = "user root;" if os.geteuid() == 0 else ""
    (folder / "nginx.conf").write_text(f"{user} daemon off; pid {folder}/pid; error_log stderr; events {{}} http {{ access_log off; {own} {text} }}")
    return str(folder / "nginx.conf")


@pytest.mark.parametrize("with_tokens", [False, True])
def test_the_nginx_example(tmp_path, with_tokens):
    nginx = shutil.which("nginx") or shutil.which("nginx", path="/usr/sbin")
    if nginx is None or shutil.which("openssl") is None:
        pytest.skip("nginx or openssl is not installed")
    certificate(tmp_path)
    hashed = subprocess.run(["openssl", "passwd", "-apr1", "secret"], check=True, capture_output=True, text=True).stdout
    (tmp_path / "passwords").write_text(f"ada:{hashed}")
    with UnixDaemon(tmp_path, **{"server.public_origin": ORIGIN}) as d:
        token = d.daemon.make_token("root") if with_tokens else None
        proxy, port = None, 0
        for _ in range(5):  # another program may take the port first
            port = free_port()
            proxy = subprocess.Popen([nginx, "-p", tmp_path, "-c", nginx_configuration(tmp_path, d.socket, port, with_tokens)], stderr=subprocess.DEVNULL)
            if wait_until(lambda: proxy.poll() is not None or answers(port), what="nginx answers") and proxy.poll() is None:
                break
        try:
            use(port, tmp_path / "cert.pem", token)
        finally:
            proxy.terminate()
            proxy.wait(20)


def answers(port):
    try:
        socket.create_connection(("127.0.0.1", port)).close()
        return True
    except OSError:
        return False


def use(port, trusted, token):
    session, url = requests.Session(), f"https://127.0.0.1:{port}"
    session.trust_env, session.verify = False, str(trusted)
    session.headers.update({"Host": "selvedge.example.org", "Origin": ORIGIN})
    assert session.get(url + "/v1/jobs", timeout=100).status_code == 401
    if token:
        session.headers["Authorization"] = f"Bearer {token}"
    else:
        session.auth = ("ada", "secret")
    page = session.get(url + "/", timeout=100)
    assert page.status_code == 200 and "Selvedge" in page.text
    job = session.post(url + "/v1/jobs", json=DOCUMENT, timeout=100).json()["id"]
    for name, (role, data) in FILES.items():
        declared = session.post(f"{url}/v1/jobs/{job}/files", json={"name": name, "role": role, "size": len(data), "sha256": None}, timeout=100).json()
        sent = session.patch(url + declared["upload_url"], data=data, timeout=100, headers={
            "Tus-Resumable": "1.0.0", "Upload-Offset": "0", "Content-Type": "application/offset+octet-stream"})
        assert sent.status_code == 204 and sent.headers["Upload-Offset"] == str(len(data))
    assert session.post(f"{url}/v1/jobs/{job}/start", timeout=100).status_code == 202
    wait_until(lambda: session.get(f"{url}/v1/jobs/{job}", timeout=100).json()["state"] == "succeeded", what="the job succeeds")
    assert session.get(f"{url}/v1/jobs/{job}/results.tar", timeout=100).content[:100] != b""
    answer = session.post(url + "/v1/jobs", json=DOCUMENT, headers={"Origin": "https://evil.example"}, timeout=100)
    problem(answer, 403, "origin")
