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
                   cwd=ROOT, check=True, timeout=600, capture_output=True, text=True)


def files_below(folder):
    return {os.path.relpath(os.path.join(at, name), folder) for at, _, names in os.walk(folder) for name in names}


def test_install_and_uninstall_into_a_staging_folder(tmp_path):
    make("install", DESTDIR=tmp_path, PREFIX="/usr")
    there = files_below(tmp_path)
    assert {f"usr/bin/{p}" for p in PROGRAMS} <= there
    assert {"etc/selvedge/selvedge.conf", f"usr/{UNIT}", "usr/share/selvedge/openapi.json", "usr/share/selvedge/result.schema.json",
            "usr/share/selvedge/dashboard/index.html", "usr/share/doc/selvedge/docs/operating.md"} <= there
    assert {"usr/share/man/man8/selvedged.8", "usr/share/man/man1/selvedge.1", "usr/share/man/man5/selvedge.conf.5",
            "usr/share/bash-completion/completions/selvedge", "usr/share/zsh/vendor-completions/_selvedge",
            "usr/share/fish/vendor_completions.d/selvedge.fish"} <= there
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


def helps(prefix, program):
    """The help of a program and of each of its commands."""
    def ask(*arguments):
        done = subprocess.run([prefix / "bin" / program, *arguments, "--help"], capture_output=True, text=True, timeout=300)
        assert done.returncode == 0, (program, arguments, done.stderr)
        return done.stdout
    yield "", ask()
    names = {"selvedge": r"^  ([a-z-]+) .*", "selvedge-phantom": r"^  selvedge-phantom ([a-z]+)"}.get(program)
    for line in re.finditer(names or "$(^)", ask().split("options of every command")[0], flags=re.M):
        if "needs no daemon" not in line[0]:
            yield line[1], ask(line[1])


@pytest.mark.parametrize("program", sorted(PROGRAMS))
def test_every_option_is_in_manual_and_completion(prefix, program):
    with open(prefix / "share/man" / ("man8" if program == "selvedged" else "man1") / (program + (".8" if program == "selvedged" else ".1"))) as f:
        page = f.read().replace("\\-", "-")
    completions = [(prefix / "share/bash-completion/completions" / program).read_text(),
                   (prefix / "share/zsh/site-functions/_selvedge").read_text(),
                   (prefix / f"share/fish/vendor_completions.d/{program}.fish").read_text().replace(" -l ", " --")]
    n = 0
    for command, text in helps(prefix, program):
        assert command in page and all(command in script for script in completions), command
        # the texts of selvedge name options of selvedged, too
        own = r"^ +(?:-\w, )?(--[a-z][a-z0-9-]*)" if program == "selvedge" else r"(?<![\w-])(--[a-z][a-z0-9-]*)"
        for option in set(re.findall(own, text, flags=re.M)):
            n += 1
            for where in (page, *completions):
                assert re.search(re.escape(option) + r"(?![a-z0-9-])", where), (program, command, option)
    assert n >= 8


def test_bash_completes_commands_and_their_options(prefix):
    script = prefix / "share/bash-completion/completions/selvedge"

    def complete(*words):
        line = f'source "{script}"; COMP_WORDS=({" ".join(map(repr, words))}); COMP_CWORD={len(words) - 1}; _selvedge; echo "${{COMPREPLY[@]}}"'
        return subprocess.run(["bash", "-c", line], capture_output=True, text=True, check=True, timeout=100).stdout.split()

    assert complete("selvedge", "rec") == ["reconstruct"]
    assert complete("selvedge", "reconstruct", "scan.tif", "--vo") == ["--voxel-um"]
    assert complete("selvedge", "list", "--voxel") == []
    assert complete("selvedge", "help", "watch-") == ["watch-folder"]


@pytest.mark.skipif(shutil.which("fish") is None, reason="fish is not installed")
def test_fish_completes_commands_and_their_options(prefix, tmp_path):
    folder = prefix / "share/fish/vendor_completions.d"

    def complete(line):
        script = "".join(f'source "{path}"; ' for path in sorted(folder.glob("*.fish"))) + f'complete -C "{line}"'
        done = subprocess.run(["fish", "--no-config", "-c", script], capture_output=True, text=True, check=True, timeout=100, cwd=tmp_path,
                              env={**os.environ, "HOME": str(tmp_path)})
        assert done.stderr == ""
        return [word.split("\t")[0] for word in done.stdout.splitlines()]

    assert complete("selvedge rec") == ["reconstruct"]
    assert complete("selvedge reconstruct scan.tif --vo") == ["--voxel-um"]
    assert complete("selvedge list --voxel") == []
    assert complete("selvedge help watch-") == ["watch-folder"]
    assert complete("selvedge-phantom clo") == ["cloth"]


def test_every_setting_is_in_its_manual_page(prefix):
    page = (prefix / "share/man/man5/selvedge.conf.5").read_text().replace("\\-", "-")
    with open(os.path.join(ROOT, "config", "selvedge.conf")) as f:
        keys = re.findall(r"^(\w+) =", f.read(), flags=re.M)
    assert len(keys) > 60 and all(f"\\fB{key}\\fR" in page for key in keys)


@pytest.mark.skipif(shutil.which("man") is None, reason="man is not installed")
@pytest.mark.parametrize("page", ["man1/selvedge.1", "man8/selvedged.8", "man1/selvedge-worker.1", "man1/selvedge-phantom.1",
                                  "man1/selvedge-camera.1", "man5/selvedge.conf.5"])
def test_manual_pages_are_sound(prefix, page):
    done = subprocess.run(["man", "--warnings", "-E", "UTF-8", "-l", "-Tutf8", "-Z", prefix / "share/man" / page], capture_output=True,
                          text=True, timeout=300, env={**os.environ, "LC_ALL": "C.UTF-8"})
    assert done.returncode == 0 and done.stderr == ""


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
    said = subprocess.run(["systemd-analyze", "verify", unit], capture_output=True, text=True, timeout=300)
    assert said.returncode == 0 and said.stderr == "", said.stderr
    said = subprocess.run(["systemd-analyze", "security", "--no-pager", "--offline=true", unit], capture_output=True, text=True, timeout=300)
    assert float(re.search(r"exposure level for \S+ ([0-9.]+)", said.stdout).group(1)) <= 2.0, said.stdout


def test_metrics_that_the_documents_name_exist(daemon):
    with open(os.path.join(ROOT, "docs", "operating.md"), encoding="utf-8") as text:
        named = set(re.findall(r"\b(?:selvedge|process)_[a-z_]+_(?:total|bytes|seconds|connections)\b|\bselvedge_jobs\b", text.read()))
    there = set(re.findall(r"^# TYPE (\S+)", daemon.get("/metrics").text, flags=re.M))
    assert len(named) >= 6 and named <= there, named - there
