"""selvedge watch-folder: samples become jobs once, when they are complete, and what comes of them lies beside them."""
import json
import os
import shutil
import subprocess
import time

import pytest
from daemon_under_test import DOCUMENT, FILES, document, wait_until
from watched_folder import Watcher, drop, hashes, outcome, reason


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "inbox").mkdir()
    return str(tmp_path / "inbox")


def ended(folder, name, state="succeeded"):
    return wait_until(lambda: (lambda o: o if o.get("state") == state else None)(outcome(folder, name)), 90, f"{name} {state}")


def jobs(daemon):
    return daemon.get("/v1/jobs?limit=500").json()["jobs"]


def once(daemon, folder, *options):
    return subprocess.run([*Watcher(folder, daemon.url).command, "--once", *options], capture_output=True, text=True, timeout=500)


def test_marked_samples_become_jobs_and_results_come_back(daemon_maker, folder):
    d = daemon_maker()
    drop(folder, "one")
    drop(folder, "bad", "fail")
    drop(folder, "half", marker=None)
    with Watcher(folder, d.url) as w:
        state = ended(folder, "one")
        ended(folder, "bad", "failed")
        drop(folder, "later")
        ended(folder, "later")
    assert w.code == 0 and "one: succeeded" in w.text()
    assert len(jobs(d)) == 3 and outcome(folder, "half") == {} and not os.path.exists(os.path.join(folder, "half.selvedge"))
    results = hashes(os.path.join(d.data, "jobs", state["job"], "results"))
    assert hashes(os.path.join(folder, "one.selvedge", "results")) == results and len(results) == 3
    assert "volume.files: cannot read volume 'scan.tif': page 2 is cut off" in reason(folder, "bad")
    assert outcome(folder, "bad")["job"] in reason(folder, "bad")
    assert os.path.getsize(os.path.join(folder, "bad.selvedge", "log.txt")) > 0
    assert os.stat(os.path.join(folder, "bad.selvedge", "reason.txt")).st_mode & 0o777 == 0o666 & ~os.umask(os.umask(0o22))


def test_a_mended_sample_is_tried_again(daemon_maker, folder):
    d = daemon_maker()
    sample = drop(folder, "twill", "fail")
    with Watcher(folder, d.url):
        ended(folder, "twill", "failed")
        with open(os.path.join(sample, "job.json"), "w") as f:
            json.dump(document("succeed"), f)
        ended(folder, "twill")
    assert not os.path.exists(os.path.join(folder, "twill.selvedge", "reason.txt"))
    assert sorted(j["state"] for j in jobs(d)) == ["failed", "succeeded"]


@pytest.mark.parametrize("spoil, words", [
    (lambda s: os.remove(os.path.join(s, "rows.csv")), "names 'rows.csv', which is not in the folder"),
    (lambda s: open(os.path.join(s, "job.json"), "w").write('{"sample": '), "job.json is not a JSON object: line 1"),
    (lambda s: open(os.path.join(s, "job.json"), "w").write(json.dumps(dict(DOCUMENT, colour=1))), "colour"),
    (lambda s: os.remove(os.path.join(s, "job.json")), "no template is given"),
    (lambda s: (os.remove(os.path.join(s, "rows.csv")), os.symlink("/etc/hostname", os.path.join(s, "rows.csv"))), "not in the folder"),
    (lambda s: open(os.path.join(s, "rows.csv"), "w").close(), "is empty"),
])
def test_reasons_are_readable(daemon, folder, spoil, words):
    spoil(drop(folder, "s"))
    n = len(jobs(daemon))
    run = once(daemon, folder)
    assert run.returncode == 1 and words in reason(folder, "s"), run.stderr
    assert len(jobs(daemon)) == n, "nothing is left on the server"


@pytest.mark.slow
def test_a_quiet_sample_is_complete(daemon_maker, folder):
    """A slow copy is not taken before its last byte: the document comes first, and files grow."""
    d = daemon_maker()
    sample = drop(folder, "slow", marker=None)
    with Watcher(folder, d.url, "--quiet", "2.5"):
        for _ in range(4):
            before = os.path.getsize(os.path.join(sample, "scan.tif"))
            with open(os.path.join(sample, "scan.tif"), "ab") as f:
                f.write(b"more")
            time.sleep(1)
            assert jobs(d) == [] and before > 0
        job = ended(folder, "slow")["job"]
    stored = d.get(f"/v1/jobs/{job}/files/scan.tif").content
    assert stored == FILES["scan.tif"][1] + b"slow" + 4 * b"more"


@pytest.mark.slow
def test_a_sample_that_changes_while_it_is_sent(daemon_maker, folder):
    """The change is seen after the upload: the draft is dropped, and the sample is sent again as it is then."""
    d = daemon_maker()
    sample = drop(folder, "s")
    with open(os.path.join(sample, "scan.tif"), "ab") as f:
        f.truncate(60_000_000)
    with Watcher(folder, d.url) as w:
        wait_until(lambda: os.listdir(os.path.join(d.data, "jobs")))
        with open(os.path.join(sample, "job.json"), "w") as f:
            json.dump(document("series 3"), f)
        job = ended(folder, "s")["job"]
    assert "changed while they were sent" in w.text()
    assert [j["id"] for j in jobs(d)] == [job] and d.job(job)["sample"] == "fake: series 3"


@pytest.mark.slow
def test_a_template_fills_in_files_and_names(daemon_maker, folder, tmp_path):
    d = daemon_maker()
    sample = drop(folder, "fake: succeed")
    os.remove(os.path.join(sample, "job.json"))
    shutil.copy(os.path.join(sample, "scan.tif"), os.path.join(sample, "scan-2.tif"))
    template = tmp_path / "template.json"
    template.write_text(json.dumps({"sample": "*", "volume": {"files": ["scan*.tif"], "voxel_size_um": 2.0}, "measurements": {"file": "*.csv"}}))
    once(d, folder, "--template", template)
    document_sent = d.job(outcome(folder, "fake: succeed")["job"])["document"]
    assert document_sent == {"sample": "fake: succeed", "volume": {"files": ["scan-2.tif", "scan.tif"], "voxel_size_um": 2.0},
                             "measurements": {"file": "rows.csv"}}
    shutil.copy(os.path.join(sample, "rows.csv"), os.path.join(sample, "more.csv"))
    shutil.rmtree(os.path.join(folder, "fake: succeed.selvedge"))
    assert once(d, folder, "--template", template).returncode == 1
    assert "'*.csv' of the template must match one file, but 2 files match it" in reason(folder, "fake: succeed")


@pytest.mark.slow
def test_the_same_sample_again_is_the_same_job(daemon_maker, folder):
    d = daemon_maker()
    drop(folder, "a")
    shutil.copytree(os.path.join(folder, "a"), os.path.join(folder, "copy of a"))
    assert once(d, folder).returncode == 0
    first = outcome(folder, "a")
    assert outcome(folder, "copy of a")["job"] == first["job"] and len(jobs(d)) == 1
    shutil.rmtree(os.path.join(folder, "a"))
    drop(folder, "a")
    assert once(d, folder).returncode == 0 and len(jobs(d)) == 1
    shutil.rmtree(os.path.join(folder, "a.selvedge"))
    assert once(d, folder).returncode == 0 and len(jobs(d)) == 1
    assert os.path.exists(os.path.join(folder, "a.selvedge", "results", "result.json"))


def test_links_and_strange_folders_are_not_followed(daemon_maker, folder, tmp_path):
    d, elsewhere = daemon_maker(), tmp_path / "elsewhere"
    elsewhere.mkdir()
    os.symlink(elsewhere, os.path.join(folder, "s.selvedge"))
    drop(folder, "s")
    os.symlink(elsewhere, os.path.join(folder, "link"))
    os.mkdir(os.path.join(folder, ".hidden"))
    with Watcher(folder, d.url) as w:
        wait_until(lambda: "is in the way" in w.text())
    assert os.listdir(elsewhere) == [] and "link: " not in w.text() and "hidden" not in w.text() and jobs(d) == []


def test_two_watchers_of_a_folder(daemon, folder):
    with Watcher(folder, daemon.url) as w:
        wait_until(lambda: "watching" in w.text())
        assert "watched by another process" in once(daemon, folder).stderr


@pytest.mark.slow
def test_kills_of_daemon_and_watcher(daemon_maker, folder):
    """A small run of `make test-watched-folder`."""
    d = daemon_maker()
    for i in range(4):
        drop(folder, f"s{i}", "work 0.2")
    w = Watcher(folder, d.url).start()
    for i in range(2):
        wait_until(lambda: len(os.listdir(os.path.join(d.data, "jobs"))) > i)
        d.kill()
        w.stop(kill=True)
        d.options["server.port"] = d.port
        d.start()
        w.start()
    for i in range(4):
        ended(folder, f"s{i}")
    w.stop()
    assert len(jobs(d)) == 4 and {j["state"] for j in jobs(d)} == {"succeeded"}


def test_once_ends_where_a_link_or_a_file_is_in_the_way(daemon_maker, folder, tmp_path):
    """A link could lead the results elsewhere, so it is not followed, and no results can be written."""
    d = daemon_maker()
    for name in ("good", "linked", "file", "waiting"):
        drop(folder, name, marker=None if name == "waiting" else "READY")
    (tmp_path / "elsewhere").mkdir()
    for name in ("linked", "waiting"):
        os.symlink(tmp_path / "elsewhere", os.path.join(folder, name + ".selvedge"))
    open(os.path.join(folder, "file.selvedge"), "w").close()
    done = once(d, folder)
    assert done.returncode == 1 and outcome(folder, "good")["state"] == "succeeded"
    for name in ("linked", "file", "waiting"):
        assert f"{name}: '{name}.selvedge' is in the way: it is not a folder" in done.stderr + done.stdout
    assert os.listdir(tmp_path / "elsewhere") == [] and len(jobs(d)) == 1
