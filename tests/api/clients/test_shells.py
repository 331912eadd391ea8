"""What the command line client is in a terminal: completion in the shells that are installed, and colors where a person reads."""
import os
import pty
import re
import select
import shutil
import signal
import subprocess
import time

import pytest
from daemon_under_test import BUILD, ROOT, program

SCRIPTS = os.path.join(BUILD, "manual")
pytestmark = pytest.mark.skipif("SELVEDGE_SANITIZED" in os.environ, reason="what is installed is the normal build")
NO_USER = {"HOME": "/nonexistent", "ZDOTDIR": "/nonexistent"}


@pytest.fixture(scope="module", autouse=True)
def scripts():
    subprocess.run(["make", "-s", "-o", "all", "manual", f"BUILD={BUILD}"], cwd=ROOT, check=True, timeout=600, capture_output=True)


def in_terminal(command, timeout_s=20, **environment):
    """What a program shows on a terminal until it ends."""
    pid, end = pty.fork()
    if pid == 0:
        os.execvpe(command[0], command, {**os.environ, "TERM": "xterm", **environment})
    shown = read_until(end, None, timeout_s)
    os.close(end)
    os.waitpid(pid, 0)
    return shown


def read_until(end, pattern, timeout_s):
    """What is read from a terminal until a pattern is seen, or nothing follows."""
    seen, deadline = b"", time.monotonic() + timeout_s
    while time.monotonic() < deadline and not (pattern and re.search(pattern, seen)):
        if not select.select([end], [], [], 0.1)[0]:
            continue
        try:
            piece = os.read(end, 65536)
        except OSError:  # the program has ended
            break
        seen += piece
        if not piece:
            break
    return seen


def bash(line):
    words = " ".join(f"'{w}'" for w in line.split(" "))
    script = f"""source {SCRIPTS}/bash/selvedge
COMP_WORDS=({words}); COMP_CWORD=$(( ${{#COMP_WORDS[@]}} - 1 )); COMP_LINE='{line}'; COMP_POINT=${{#COMP_LINE}}
$(complete -p selvedge | sed 's/.*-F \\([^ ]*\\) .*/\\1/') selvedge "${{COMP_WORDS[COMP_CWORD]}}" "${{COMP_WORDS[COMP_CWORD-1]}}"
printf '%s\\n' "${{COMPREPLY[@]}}\""""
    return subprocess.run(["bash", "--norc", "-c", script], capture_output=True, text=True, check=True, timeout=100).stdout.split()


def fish(line):
    done = subprocess.run(["fish", "--no-config", "-c", f"source {SCRIPTS}/fish/selvedge.fish; complete -C '{line}'"], capture_output=True, text=True,
                          check=True, timeout=100, env={**os.environ, **NO_USER, "HOME": SCRIPTS})
    return [word.split("\t")[0] for word in done.stdout.splitlines()]


def zsh(line):
    """zsh completes on a terminal only. Of what it lists once the tabulator was pressed, a candidate a line: `word  -- text`."""
    start = f"fpath=({SCRIPTS}/zsh $fpath); autoload -U compinit; compinit -D -u; print 'S''ET'\n"
    pid, end = pty.fork()
    if pid == 0:
        os.execvpe("zsh", ["zsh", "-f", "-i"], {**os.environ, **NO_USER, "TERM": "xterm", "COLUMNS": "300", "LINES": "200"})
    os.write(end, start.encode())
    read_until(end, rb"\nSET", 20)
    os.write(end, line.encode() + b"\t\t")
    shown = read_until(end, rb"(--.*\n){2}", 10) + read_until(end, None, 1)
    os.close(end)
    os.kill(pid, signal.SIGKILL)
    os.waitpid(pid, 0)
    plain = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", shown.decode(errors="replace"))
    return re.findall(r"(?m)^([-\w]+)\s+-- ", plain)


SHELLS = [pytest.param(shell, marks=pytest.mark.skipif(shutil.which(shell.__name__) is None, reason=f"no {shell.__name__} on this machine"))
          for shell in (bash, fish, zsh)]


@pytest.mark.parametrize("complete", SHELLS)
def test_commands_and_options_are_completed(complete):
    commands = complete("selvedge re")
    assert {"retry", "results", "render", "reconstruct", "retention"} <= set(commands) and "list" not in commands
    options = complete("selvedge list --s")
    assert {"--state", "--sample", "--server"} <= set(options) and "--voxel-um" not in options
    assert "watch" in complete("selvedge help wa")


def test_colors_are_for_terminals_alone():
    command = [program("selvedge"), "nothing"]
    assert b"\x1b[31merror\x1b[0m: unknown command" in in_terminal(command)
    for environment in ({"NO_COLOR": "1"}, {"TERM": "dumb"}):
        shown = in_terminal(command, **environment)
        assert b"error: unknown command" in shown and b"\x1b" not in shown
    assert b"\x1b" not in subprocess.run(command, capture_output=True, check=False, env={**os.environ, "TERM": "xterm"}).stderr
