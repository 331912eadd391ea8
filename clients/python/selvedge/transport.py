"""HTTP requests over TCP, TLS or a unix socket, with one connection for each thread."""
from __future__ import annotations

import http.client
import json
import select
import socket
import ssl
import threading
import time
import urllib.parse
from types import TracebackType
from typing import Any, Callable, Iterator, Mapping, Optional, Union

PIECE_BYTES = 1 << 20
MAX_TRY = 7
BROKEN = (OSError, http.client.HTTPException)


class SelvedgeError(Exception):
    """The base of all errors of this package."""


class Problem(SelvedgeError):
    """The server has refused a request (RFC 9457). `code` is stable; `field` names the member at fault, or is ""."""

    def __init__(self, status: int, body: Mapping[str, Any]) -> None:
        self.status, self.body = status, body
        self.code, self.field = str(body.get("code", "")), str(body.get("field", ""))
        detail = str(body.get("detail") or body.get("title") or f"HTTP status {status}")
        super().__init__(f"{self.field}: {detail}" if self.field and self.field not in detail else detail)


class Unreachable(SelvedgeError):
    """The server cannot be reached, or the connection broke again and again."""


class JobFailed(SelvedgeError):
    """The job has ended as "failed" or "cancelled". `job` is its last state."""

    def __init__(self, job: Any) -> None:
        self.job = job
        why = f": {job.error.field} {job.error.text}" if job.error else ""
        super().__init__(f"job {job.id} {job.state}{why}")


class UnixConnection(http.client.HTTPConnection):
    """HTTP over a unix socket."""

    def __init__(self, path: str, timeout: float) -> None:
        super().__init__("localhost", timeout=timeout)
        self.path = path

    def connect(self) -> None:
        self.sock = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self.sock.settimeout(self.timeout)
        self.sock.connect(self.path)


class Answer:
    """An answer whose body is read by `read`, `json` or `chunks`, once and wholly."""

    def __init__(self, response: http.client.HTTPResponse, drop: Callable[[], None]) -> None:
        self.response, self.status, self.headers, self.drop = response, response.status, response.headers, drop

    def __enter__(self) -> Answer:
        return self

    def __exit__(self, kind: Optional[type[BaseException]], value: Optional[BaseException], trace: Optional[TracebackType]) -> None:
        if not self.response.isclosed():
            self.drop()  # the rest of the body would be taken for the next answer

    def read(self) -> bytes:
        return self.response.read()

    def text(self) -> str:
        return self.read().decode("utf-8", "replace")

    def json(self) -> Any:
        return json.loads(self.read())

    def chunks(self) -> Iterator[bytes]:
        while chunk := self.response.read(PIECE_BYTES):
            yield chunk


class Transport:
    """Sends requests to one server. May be shared between threads."""

    def __init__(self, url: str, token: Optional[str], timeout_s: float, ca_file: Optional[str]) -> None:
        self.url, self.timeout_s = url.rstrip("/"), timeout_s
        self.parts = urllib.parse.urlsplit(self.url)
        if self.parts.scheme not in ("http", "https", "unix") or not (self.parts.hostname or self.parts.path):
            raise ValueError(f"server '{url}' is not an http://, https:// or unix:/ address")
        self.tls = ssl.create_default_context(cafile=ca_file) if self.parts.scheme == "https" else None
        self.headers = {"Authorization": f"Bearer {token}"} if token else {}
        self.own = threading.local()

    def _new_connection(self, timeout_s: float) -> http.client.HTTPConnection:
        if self.parts.scheme == "unix":
            return UnixConnection(self.parts.path, timeout_s)
        host = self.parts.hostname or "localhost"
        if self.tls is not None:
            return http.client.HTTPSConnection(host, self.parts.port, timeout=timeout_s, context=self.tls)
        return http.client.HTTPConnection(host, self.parts.port, timeout=timeout_s)

    def _once(self, method: str, path: str, body: Optional[bytes], headers: Mapping[str, str], timeout_s: float) -> Answer:
        connection: Optional[http.client.HTTPConnection] = getattr(self.own, "connection", None)
        if connection is not None and connection.sock is not None and select.select([connection.sock], [], [], 0)[0]:
            self.close()  # the server has closed a connection that was idle
            connection = None
        if connection is None:
            connection = self.own.connection = self._new_connection(timeout_s)
        if connection.sock is not None:
            connection.sock.settimeout(timeout_s)
        connection.timeout = timeout_s
        try:
            prefix = self.parts.path if self.parts.scheme != "unix" else ""
            connection.request(method, prefix + path, body, dict(headers))
            return Answer(connection.getresponse(), self.close)
        except BROKEN:
            self.close()
            raise

    def close(self) -> None:
        """Close the connection of this thread."""
        connection = getattr(self.own, "connection", None)
        if connection is not None:
            connection.close()
        self.own.connection = None

    def request(self, method: str, path: str, *, json_body: Any = None, data: Optional[bytes] = None, headers: Optional[Mapping[str, str]] = None,
                more_s: float = 0, n_try: int = MAX_TRY) -> Answer:
        """Send a request that must succeed. It is tried again when the connection breaks or the server is busy, so it must have
        the same effect when it is repeated. more_s: time that the server may wait before it answers. Raises Problem, Unreachable."""
        sent = {**self.headers, **(headers or {})}
        if json_body is not None:
            data = json.dumps(json_body).encode()
            sent["Content-Type"] = "application/json"
        why: Union[BaseException, str] = ""
        for i in range(n_try):
            try:
                answer = self._once(method, path, data, sent, self.timeout_s + more_s)
            except BROKEN as broken:
                why, pause_s = broken, 0.0
            else:
                if answer.status not in (429, 503) or "Retry-After" not in answer.headers:
                    return self._checked(answer)
                why = f"it answers with status {answer.status}"
                wait = answer.headers["Retry-After"]
                pause_s = min(60.0, float(wait)) if wait.isdigit() else 0.0
                answer.read()
            if i + 1 < n_try:
                time.sleep(max(pause_s, 0.05 * 3 ** i))  # the first failure may come from a connection that was idle for too long
        raise Unreachable(f"the server at {self.url} cannot be reached: {why}")

    def _checked(self, answer: Answer) -> Answer:
        if answer.status < 400:
            return answer
        try:
            body = json.loads(answer.read() or b"{}")
        except (ValueError, *BROKEN):
            self.close()
            body = {}
        raise Problem(answer.status, body if isinstance(body, dict) else {})
