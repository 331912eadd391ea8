"""`make install` and `make uninstall`, the installed daemon, and the systemd unit."""
import os
import re
import shutil
import subprocess

import pytest
from daemon_under_test import BUILD, ROOT, Daemon

PROGRAMS = {"selvedge", "selvedged", "selvedge-worker", "selvedge-phantom", "selvedge-camera"}
UNIT = "lib/systemd/system/selvedge.service"
# under the thread sanitizer only the daemon is built
pytestmark = pytest.mark.skipif("SELVEDGE_SANITIZED" in os.environ, reason="what is installed is the normal build")


def make(target, **variables):
    # -o all: what is tested is built already
    subprocess.run(["make", "-s", "-o", "all", target, f"BUILD={BUILD}", *(f"{k}={v}" for k, v in variables.items())],
                   cwd=ROOT, check=True, timeout=120, capture_output=True, text=True)


def files_below(folder):
    return {os.path.relpath(os.path.join(at, name), folder) for at, _, names in os.walk(folder) for name in names}


def test_install_and_uninstall_into_a_staging_folder(tmp_path):
    make("install", DESTDIR=tmp_path, PREFIX="/usr")
    there = files_below(tmp_path)
    assert {f"usr/bin/{p}" for p in PROGRAMS} <= there
    assert {"etc/selvedge/selvedge.conf", f"usr/{UNIT}", "usr/share/selvedge/openapi.json", "usr/share/selvedge/result.schema.json",
            "usr/share/selvedge/dashboard/index.html", "usr/share/doc/selvedge/docs/operating.md"} <= there
    assert shutil.which("help2man") is None or "usr/share/man/man8/selvedged.8" in there
    assert os.stat(tmp_path / "etc/selvedge/secrets").st_mode & 0o777 == 0o700
    changed = tmp_path / "etc/selvedge/selvedge.conf"
    changed.write_text("[server]\nport = 7000\n")
    make("install", DESTDIR=tmp_path, PREFIX="/usr")
    assert changed.read_text() == "[server]\nport = 7000\n", "the administrator's configuration is kept"
    make("uninstall", DESTDIR=tmp_path, PREFIX="/usr")
    assert files_below(tmp_path) == {"etc/selvedge/selvedge.conf"}


@pytest.fixture(scope="module")
def prefix(tmp_path_factory):
    folder = tmp_path_factory.mktemp("prefix")
    make("install", PREFIX=folder)
    return folder


def test_the_installed_daemon_finds_its_files(prefix, tmp_path):
    d = Daemon(tmp_path / "data", worker=None)
    command = d.command()
    d.command = lambda: [str(prefix / "bin/selvedged"), "--config", str(prefix / "etc/selvedge/selvedge.conf"), *command[len(d.wrapper) + 1:]]
    with d:
        assert "<title>Selvedge</title>" in d.get("/").text
        assert d.get("/v1/openapi.json").json()["openapi"].startswith("3.")
        assert "was not found" not in d.log_text()


@pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="systemd-analyze is not installed")
def test_unit_is_valid_and_hardened(prefix):
    unit = prefix / UNIT
    assert f"ExecStart={prefix}/bin/selvedged --config {prefix}/etc/selvedge/selvedge.conf" in unit.read_text()
    said = subprocess.run(["systemd-analyze", "verify", unit], capture_output=True, text=True, timeout=60)
    assert said.returncode == 0 and said.stderr == "", said.stderr
    said = subprocess.run(["systemd-analyze", "security", "--no-pager", "--offline=true", unit], capture_output=True, text=True, timeout=60)
    assert float(re.search(r"exposure level for \S+ ([0-9.]+)", said.stdout).group(1)) <= 2.0, said.stdout


def test_metrics_that_the_documents_name_exist(daemon):
    with open(os.path.join(ROOT, "docs", "operating.md"), encoding="utf-8") as text:
        named = set(re.findall(r"\b(?:selvedge|process)_[a-z_]+_(?:total|bytes|seconds|connections)\b|\bselvedge_jobs\b", text.read()))
    there = set(re.findall(r"^# TYPE (\S+)", daemon.get("/metrics").text, flags=re.M))
    assert len(named) >= 6 and named <= there, named - there
