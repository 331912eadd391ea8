"""schemathesis makes requests from config/openapi.json, valid and invalid ones, and holds every reply to it.

It is installed from PyPI into a virtual environment in the build folder; without a network the test is skipped."""
import os
import subprocess

import pytest
from daemon_under_test import BUILD

LONG = bool(os.environ.get("SELVEDGE_TEST_LONG"))
# The phase "coverage" tries each bound of each member of a whole job document, which takes ten times the rest: make test-long has
# it for all operations, make test for those that read a finished job.
PHASES = "examples,coverage,fuzzing,stateful" if LONG else "examples,fuzzing,stateful"
HERE = os.path.dirname(os.path.abspath(__file__))
CONFIG = os.path.join(HERE, "schemathesis.toml")
pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def schemathesis():
    """Returns the path of the program."""
    venv = os.path.join(BUILD, "schemathesis")
    program = os.path.join(venv, "bin", "schemathesis")
    if not os.path.exists(program):
        for command in (["/usr/bin/python3", "-m", "venv", venv], [os.path.join(venv, "bin", "pip"), "install", "-q", "schemathesis==4.*"]):
            done = subprocess.run(command, capture_output=True, text=True)
            if done.returncode != 0:
                pytest.skip(f"schemathesis cannot be installed: {(done.stderr or done.stdout).strip()[-200:]}")
    return program


def drive(schemathesis, daemon, config, *options):
    done = subprocess.run([schemathesis, "--config-file", str(config), "run", daemon.url + "/v1/openapi.json",
                           "--checks", "all", "--seed", "1", "--no-color", *options], cwd=os.path.dirname(daemon.data), capture_output=True, text=True,
                          env=dict(os.environ, SCHEMATHESIS_HOOKS="schemathesis_hooks", PYTHONPATH=HERE))
    assert done.returncode == 0, done.stdout[-6000:] + done.stderr[-1000:]
    assert "Tested: " in done.stdout


def test_every_reply_is_as_the_description_says(schemathesis, daemon):
    """All operations. Identifiers come from earlier replies where schemathesis finds them, else from nowhere."""
    drive(schemathesis, daemon, CONFIG, "--phases", PHASES, "--max-examples", "20" if LONG else "10")


def test_every_reply_about_a_finished_job_is_as_the_description_says(schemathesis, daemon, tmp_path, monkeypatch):
    job = daemon.start_job("series 20")
    daemon.wait_state(job, "succeeded")
    for name, value in (("SELVEDGE_JOB", job), ("SELVEDGE_FILE", "rows.csv"), ("SELVEDGE_RESULT", "result.json")):
        monkeypatch.setenv(name, value)
    with open(CONFIG) as f:
        text = f.read()
    places = '"path.id" = "${SELVEDGE_JOB}"\n"path.name" = "${SELVEDGE_FILE}"\n"path.path" = "${SELVEDGE_RESULT}"\n"path.version" = "1"\n'
    config = tmp_path / "schemathesis.toml"
    config.write_text(text + places)
    drive(schemathesis, daemon, config, "--include-method", "GET", "--include-path-regex", r"\{id\}", "--max-examples", "40" if LONG else "10")
