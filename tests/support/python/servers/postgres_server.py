"""A PostgreSQL server for tests: initdb and pg_ctl as an unprivileged user, in a temporary folder that only the server uses.

with PostgresServer() as server: server.make_database() -> address
Raises PostgresMissing, with the reason, where the package is absent."""
import glob
import os
import pwd
import shutil
import socket
import subprocess
import sys
import tempfile
import uuid


class PostgresMissing(Exception):
    """What keeps tests from a PostgreSQL server."""


def programs():
    """Folder of initdb and pg_ctl, the newest version."""
    found = sorted(glob.glob("/usr/lib/postgresql/*/bin/initdb"), key=lambda p: int(p.split("/")[4]))
    if found:
        return os.path.dirname(found[-1])
    other = shutil.which("initdb")
    if other is None:
        raise PostgresMissing("the package postgresql is not installed")
    return os.path.dirname(other)


class PostgresServer:
    def __init__(self, sync=False):
        self.sync = sync  # whether the server syncs its files, which only a power cut would miss
        self.bin = programs()
        self.folder = self.data = None
        # PostgreSQL refuses to run as root
        self.user = pwd.getpwnam("postgres").pw_name if os.geteuid() == 0 else None
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            self.port = probe.getsockname()[1]

    def run(self, program, *arguments):
        command = [os.path.join(self.bin, program), *arguments]
        if self.user:
            command = ["runuser", "-u", self.user, "--", *command]
        done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=300, cwd="/")
        assert done.returncode == 0, f"{command}: {done.stdout}{done.stderr}"
        return done.stdout

    def __enter__(self):
        # not below a folder of the tests, which the server's user may not be able to pass
        self.folder = tempfile.mkdtemp(prefix="selvedge-postgres-")
        self.data = os.path.join(self.folder, "cluster")
        try:
            self.begin()
        except BaseException:
            shutil.rmtree(self.folder, ignore_errors=True)
            raise
        return self

    def begin(self):
        if self.user:
            shutil.chown(self.folder, self.user)
        self.run("initdb", "--no-sync", "--pgdata", self.data, "--auth=scram-sha-256", "--username=selvedge", "--encoding=UTF8", "--locale=C.UTF-8",
                 "--pwfile=" + self.write_password())
        self.start()

    def __exit__(self, *unused):
        try:
            self.stop("immediate")
        finally:
            shutil.rmtree(self.folder, ignore_errors=True)

    def write_password(self):
        self.password = uuid.uuid4().hex
        path = os.path.join(self.folder, "password")
        with open(path, "w") as f:
            f.write(self.password)
        os.chmod(path, 0o600)
        if self.user:
            shutil.chown(path, self.user)
        return path

    def start(self):
        self.run("pg_ctl", "--pgdata", self.data, "--wait", "--log", os.path.join(self.folder, "server.log"), "--options",
                 f"-p {self.port} -c listen_addresses=127.0.0.1 -c unix_socket_directories={self.folder} -c max_connections=60 "
                 f"-c fsync={'on' if self.sync else 'off'}", "start")

    def stop(self, mode="fast"):
        self.run("pg_ctl", "--pgdata", self.data, "--wait", "--mode", mode, "stop")

    def address(self, database="postgres"):
        return f"postgresql://selvedge@127.0.0.1:{self.port}/{database}"

    def query(self, sql, database="postgres"):
        """Runs SQL; what psql prints, without decoration."""
        done = subprocess.run(["psql", "--no-psqlrc", "--quiet", "--tuples-only", "--no-align", "--set=ON_ERROR_STOP=1", "--command", sql,
                               self.address(database)], capture_output=True, text=True, check=False, env=dict(os.environ, PGPASSWORD=self.password))
        assert done.returncode == 0, done.stderr
        return done.stdout.strip()

    def make_database(self):
        """An empty database; its name."""
        name = "t" + uuid.uuid4().hex[:12]
        self.query(f"CREATE DATABASE {name}")
        return name


def serve():
    """For programs of tests: prints the password, then the address of a new database for each line that is read, until there are none."""
    try:
        with PostgresServer() as server:
            print("password", server.password, flush=True)
            for _ in sys.stdin:
                print(server.address(server.make_database()), flush=True)
    except PostgresMissing as why:
        print("missing:", why, flush=True)


if __name__ == "__main__":
    serve()
