"""The form of a new job judges document and files before anything is sent, and skips files that the server has."""
import json

import pytest

pytest.importorskip("selenium.webdriver", reason="python3-selenium is not installed")
import selvedge  # noqa: E402
from browser_page import click_on, complaints, keep, start_daemon, stop_daemon, submit, text_of, texts, wait_for  # noqa: E402


def choose(browser, *paths):
    chooser = browser.find_element("css selector", ".drop input:not([webkitdirectory])")
    browser.execute_script("arguments[0].style.display = 'block'", chooser)
    chooser.send_keys("\n".join(map(str, paths)))


def count(browser, text):
    return browser.execute_script("return performance.getEntriesByType('resource').filter((e) => e.name.includes(arguments[0])).length", text)


def test_faults_are_shown_before_anything_is_sent(stub, browser, tmp_path):
    url, _ = stub
    document = {"sample": "judged", "volume": {"files": ["scan.tif"], "voxel_size_um": -2}, "measurements": {"file": "cloth.csv"}, "lamp": {"side_cm": 5000}}
    (tmp_path / "job.json").write_text(json.dumps(document))
    (tmp_path / "scan.tif").write_bytes(b"")
    (tmp_path / "cloth.csv").write_text("set\n")
    (tmp_path / "scan.tiff").write_bytes(b"scan")
    before = len(list(selvedge.Client(url).jobs()))
    browser.get(url + "/#new")
    choose(browser, *(tmp_path / n for n in ("job.json", "scan.tif", "cloth.csv", "scan.tiff")))
    wait_for(browser, "document.querySelectorAll('#faults li').length === 2")
    faults = texts(browser, "#faults li")
    assert any("volume.voxel_size_um" in f for f in faults) and any("lamp.side_cm" in f for f in faults)
    shown = texts(browser, "#new-files > li")
    assert "is empty" in shown[0] and "scan.tiff" in shown[2] and "Not named by the document" in shown[2]
    assert browser.execute_script("return document.querySelector('#send').disabled")
    click_on(browser, "#editor > summary")
    wait_for(browser, "document.querySelector(`#editor .option[data-path='lamp.side_cm']`)")
    wait_for(browser, "document.querySelector(`#editor .option.bad[data-path='lamp.side_cm'] .problem`)?.textContent.includes('0.01 to 1000')")
    keep(browser, "live-check")
    # a value that is set right takes its fault away, and a file that is not empty makes the form ready
    for path, text in (("lamp.side_cm", "12"), ("volume.voxel_size_um", "2")):
        browser.execute_script("""
            const input = document.querySelector(`#editor .option[data-path='${arguments[0]}'] .value > input`);
            input.value = arguments[1];
            input.dispatchEvent(new Event("change"));""", path, text)
    wait_for(browser, "document.querySelectorAll('#faults li').length === 0")
    (tmp_path / "scan.tif").write_bytes(b"scan")
    choose(browser, tmp_path / "scan.tif")
    wait_for(browser, "!document.querySelector('#send').disabled")
    assert text_of(browser, "#send-state") == "Ready."
    assert len(list(selvedge.Client(url).jobs())) == before and count(browser, "/v1/uploads/") == 0
    assert complaints(browser) == []


def test_a_file_that_is_too_large(tmp_path, browser):
    process, url = start_daemon(tmp_path / "data", "--set", "upload.max_file_bytes=1000")
    document = {"sample": "large", "volume": {"files": ["scan.tif"], "voxel_size_um": 2}, "measurements": {"file": "cloth.csv"}}
    (tmp_path / "job.json").write_text(json.dumps(document))
    (tmp_path / "scan.tif").write_bytes(b"x" * 1001)
    (tmp_path / "cloth.csv").write_text("set\n")
    browser.get(url + "/#new")
    choose(browser, *(tmp_path / n for n in ("job.json", "scan.tif", "cloth.csv")))
    wait_for(browser, "document.querySelector('#send-state').textContent.includes('this server takes')")
    assert browser.execute_script("return document.querySelector('#send').disabled")
    stop_daemon(process)


def test_faults_of_files_are_all_shown_before_the_job_starts(stub, browser, tmp_path):
    url, _ = stub
    (tmp_path / "job.json").write_text(json.dumps({"sample": "faulty files", "volume": {"files": ["scan.tif"], "voxel_size_um": 2},
                                                   "measurements": {"file": "cloth.csv"}}))
    (tmp_path / "scan.tif").write_bytes(b"scan")
    (tmp_path / "cloth.csv").write_text("set\n")
    browser.get(url + "/#new")
    choose(browser, *(tmp_path / n for n in ("job.json", "scan.tif", "cloth.csv")))
    wait_for(browser, "!document.querySelector('#send').disabled")
    click_on(browser, "#send")
    wait_for(browser, "document.querySelector('#send-state').textContent.includes('2 faults')")
    said = text_of(browser, "#send-state")
    assert "volume.files: cannot read volume 'scan.tif': it is no scan" in said and "measurements.file: line 1 of 'cloth.csv'" in said
    keep(browser, "faults-of-files")
    made = next(j for j in selvedge.Client(url).jobs() if j.sample == "faulty files")
    assert made.state == "draft", "it was not started"
    # the server's answer to a form whose fault lies in a file is a 422, which browsers note in the console
    assert all("422" in c for c in complaints(browser))


def test_files_that_the_server_has_are_not_sent(stub, browser):
    url, folder = stub
    first, sample = submit(url, folder, "sent once")
    browser.get(url + "/#new")
    choose(browser, *(sample / n for n in ("job.json", "scan.tif", "cloth.csv")))
    wait_for(browser, "document.querySelectorAll('#new-files > li .hint').length === 2")
    assert all("on the server already: it is not sent again" in t for t in texts(browser, "#new-files > li"))
    keep(browser, "known-inputs")
    click_on(browser, "#send")
    wait_for(browser, "location.hash.length > 10")
    wait_for(browser, "document.querySelector('.state.succeeded')", 60)
    made = selvedge.Client(url).job(browser.execute_script("return location.hash.slice(1)"))
    assert made.id != first.id and count(browser, "/v1/uploads/") == 0
    assert [f["sha256"] for f in made.state().raw["files"]] == [f["sha256"] for f in first.state().raw["files"]]
    assert complaints(browser) == []
