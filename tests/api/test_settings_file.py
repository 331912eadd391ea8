"""config/selvedge.conf is the printed table of settings, and the daemon can read it."""
import os
import subprocess

import pytest
from daemon_under_test import ROOT, program

CONF = os.path.join(ROOT, "config", "selvedge.conf")


def test_file_and_table_agree():
    printed = subprocess.run([program("selvedged"), "--print-config"], capture_output=True, text=True, check=True).stdout
    with open(CONF) as f:
        assert f.read() == printed
    lines = printed.splitlines()
    for i, line in enumerate(lines):
        if " =" in line and not line.startswith(";"):
            assert lines[i - 1].startswith("; ") and len(lines[i - 1]) > 12, f"no explanation of {line}"


def test_the_daemon_runs_with_it(daemon_maker):
    d = daemon_maker(wrapper=None)
    d.stop()
    command = d.command()
    d.command = lambda: command + ["--config", CONF]
    d.start()
    assert d.get("/livez").ok


@pytest.mark.parametrize("text, why", [
    ("[server]\nprot = 80\n", "'server.prot' does not exist"),
    ("[sever]\nport = 80\n", "'sever.port' does not exist"),
    ("port = 80\n", "'.port' does not exist"),
    ("[server]\nport = eighty\n", "not a whole number"),
    ("[server]\nport = 65536\n", "outside 0..65535"),
    ("[server]\nport\n", "line 2"),
    ("[server\n", "line 1"),
    ("[jobs]\nsandbox = requierd\n", "'jobs.sandbox' is 'requierd'"),
])
def test_mistakes_in_the_file(tmp_path, text, why):
    path = tmp_path / "bad.conf"
    path.write_text(text)
    r = subprocess.run([program("selvedged"), "--config", str(path), "--data", str(tmp_path / "d")], capture_output=True, text=True, timeout=150)
    assert r.returncode == 2 and why in r.stderr and "bad.conf" in r.stderr, r.stderr
