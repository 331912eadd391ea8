"""New jobs in a real browser: files that are chosen or dropped, the form, and uploads that break."""
import hashlib
import json
import os

import pytest

pytest.importorskip("selenium.webdriver", reason="python3-selenium is not installed")
import selvedge  # noqa: E402
from browser_page import ROOT, click_on, complaints, keep, scrolls_sideways, sized, start_daemon, stop_daemon, submit, text_of, wait_for  # noqa: E402
from selenium.webdriver.common.by import By  # noqa: E402


def test_submit_by_choosing_files(stub, browser):
    url, folder = stub
    _, sample = submit(url, folder, "dropped twill")
    browser.get(url + "/#new")
    chooser = browser.find_element(By.CSS_SELECTOR, ".drop input:not([webkitdirectory])")
    browser.execute_script("arguments[0].style.display = 'block'", chooser)
    chooser.send_keys(str(sample / "job.json"))
    wait_for(browser, "document.querySelector('#submit').textContent.includes('2 of 2 files are still missing')")
    assert not browser.find_element(By.CSS_SELECTOR, "#send").is_enabled()
    chooser.send_keys("\n".join(str(sample / n) for n in ("scan.tif", "cloth.csv")))
    wait_for(browser, "!document.querySelector('#send').disabled")
    click_on(browser, "#send")
    wait_for(browser, "location.hash.length > 10")
    wait_for(browser, "document.querySelector('.state.succeeded')", 60)
    assert text_of(browser, "h1") == "dropped twill"
    files = {f["name"]: f for f in selvedge.Client(url).job(browser.execute_script("return location.hash.slice(1)")).state().raw["files"]}
    assert files["scan.tif"]["state"] == "complete" and files["scan.tif"]["sha256"]
    assert complaints(browser) == []


def drop_in(browser, *paths):
    """Drops files into the submit panel, and waits until it is ready."""
    chooser = browser.find_element(By.CSS_SELECTOR, ".drop input:not([webkitdirectory])")
    browser.execute_script("arguments[0].style.display = 'block'", chooser)
    chooser.send_keys("\n".join(map(str, paths)))
    wait_for(browser, "!document.querySelector('#send').disabled")


def option(browser, path):
    """Returns the row of a key in the form."""
    return browser.find_element(By.CSS_SELECTOR, f'#editor .option[data-path="{path}"]')


def click(browser, element):
    """Clicks an element wherever it is scrolled to: the header of the page may cover it."""
    browser.execute_script("arguments[0].click()", element)


def fill_in(browser, path, text):
    """Sets an option in the form; sections on the way there are opened."""
    for i in (i for i, letter in enumerate(path) if letter in ".["):
        browser.execute_script("const d = document.querySelector(`#editor details[data-path='${arguments[0]}']`); if (d) d.open = true", path[:i])
    wait_for(browser, f"document.querySelector(`#editor .option[data-path='{path}']`)")
    boxes = option(browser, path).find_elements(By.CSS_SELECTOR, "input[type=checkbox]")
    if boxes and not boxes[0].is_selected():
        click(browser, boxes[0])
    browser.execute_script("""
        const input = document.querySelector(`#editor .option[data-path='${arguments[0]}'] .value > :is(input, select, textarea)`);
        input.value = arguments[1];
        input.dispatchEvent(new Event("change"));""", path, text)


def written(browser):
    return json.loads(text_of(browser, "#document"))


def test_form_writes_a_job_document(stub, browser, tmp_path):
    url, _ = stub
    for name, data in (("cloth.hair", b"hair"), ("p0.exr", b"a"), ("p1.exr", b"b")):
        (tmp_path / name).write_bytes(data)
    browser.get(url + "/#new")
    click(browser, browser.find_element(By.CSS_SELECTOR, "#editor > summary"))
    wait_for(browser, "document.querySelectorAll('#editor .options > *').length >= 9")
    for path, text in (("sample", "written twill"), ("fibers.file", "cloth.hair"), ("fibers.tile_mm", "0.8, 0.9"), ("lamp.side_cm", "12.5"),
                       ("black_sheet", "false"), ("fit.model", "microflake.v1"), ("fit.texture.block_mm", "0.5"), ("fit.fixed", '{"gamma": 0.3}')):
        fill_in(browser, path, text)
    fill_in(browser, "fit.seed", "7")
    click(browser, option(browser, "fit.seed").find_element(By.CSS_SELECTOR, "input[type=checkbox]"))  # and not set again
    browser.execute_script("document.querySelector(`#editor details[data-path='photographs']`).open = true")
    wait_for(browser, "document.querySelector('#editor button.add')")
    angles = {"light_theta_deg": 20, "light_phi_deg": 0, "camera_theta_deg": 30, "camera_phi_deg": 180}
    for i in range(3):
        browser.execute_script("document.querySelector(`#editor details[data-path='photographs'] button.add`).click()")
        for key, text in {"file": f"p{i}.exr", **angles}.items():
            fill_in(browser, f"photographs[{i}].{key}", str(text))
    browser.execute_script("document.querySelector(`#editor details[data-path='photographs[2]'] + button`).click()")
    keep(browser, "form")
    document = {"sample": "written twill", "fibers": {"file": "cloth.hair", "tile_mm": [0.8, 0.9]}, "lamp": {"side_cm": 12.5}, "black_sheet": False,
                "fit": {"model": "microflake.v1", "texture": {"block_mm": 0.5}, "fixed": {"gamma": 0.3}},
                "photographs": [{"file": f"p{i}.exr", **angles} for i in range(2)]}
    assert written(browser) == document
    drop_in(browser, *(tmp_path / n for n in ("cloth.hair", "p0.exr", "p1.exr")))
    # the server refuses a value: its row is marked, and the corrected document is another one
    fill_in(browser, "lamp.side_cm", "5000")
    click(browser, browser.find_element(By.CSS_SELECTOR, "#send"))
    wait_for(browser, "document.querySelector(`#editor .option.bad[data-path='lamp.side_cm'] .problem`)?.textContent.includes('0.01 to 1000')")
    keep(browser, "form-refused")
    fill_in(browser, "lamp.side_cm", "12.5")
    assert "bad" not in option(browser, "lamp.side_cm").get_attribute("class")
    click(browser, browser.find_element(By.CSS_SELECTOR, "#send"))
    wait_for(browser, "location.hash.length > 10")
    wait_for(browser, "document.querySelector('.state.succeeded')", 60)
    assert selvedge.Client(url).job(browser.execute_script("return location.hash.slice(1)")).document() == document
    assert [c for c in complaints(browser) if "422" not in c] == []


def test_form_edits_a_dropped_document(stub, browser):
    url, folder = stub
    _, sample = submit(url, folder, "edited twill")
    browser.get(url + "/#new")
    drop_in(browser, *(sample / n for n in ("job.json", "scan.tif", "cloth.csv")))
    before = json.loads((sample / "job.json").read_text())
    click(browser, browser.find_element(By.CSS_SELECTOR, "#editor > summary"))
    wait_for(browser, "document.querySelector(`#editor .option[data-path='volume.voxel_size_um']`)")  # sections that are given are open
    size = option(browser, "volume.voxel_size_um").find_element(By.CSS_SELECTOR, "input[type=text]")
    assert written(browser) == before and size.get_attribute("value") == "2"
    fill_in(browser, "volume.voxel_size_um", "2 2 2.5")
    fill_in(browser, "volume.filter.h", "11")
    assert written(browser) == {**before, "volume": {**before["volume"], "voxel_size_um": [2, 2, 2.5], "filter": {"h": 11}}}
    fill_in(browser, "volume.voxel_size_um", "two")
    assert "is not a number" in option(browser, "volume.voxel_size_um").text and "voxel_size_um" not in written(browser)["volume"]
    # a seed that JavaScript would round: the document is sent as it was written, and the form leaves it alone
    (sample / "job.json").write_text(json.dumps({**before, "fit": {"seed": 2**60 + 1}}))
    drop_in(browser, sample / "job.json")
    wait_for(browser, "document.querySelector('#editor').textContent.includes('cannot edit this document')")
    assert browser.find_elements(By.CSS_SELECTOR, "#editor .option") == [] and str(2**60 + 1) in text_of(browser, "#document")
    assert complaints(browser) == []


def test_pieces_are_no_larger_than_the_server_takes(browser, tmp_path):
    process, url = start_daemon(tmp_path / "data", "--worker", os.path.join(ROOT, "tests", "support", "python", "client_stub_worker.py"),
                                "--set", f"upload.max_patch_bytes={1 << 20}")
    try:
        _, sample = submit(url, tmp_path, "large twill")
        (sample / "scan.tif").write_bytes(os.urandom(2_500_000))
        browser.get(url + "/#new")
        drop_in(browser, *(sample / n for n in ("job.json", "scan.tif", "cloth.csv")))
        click_on(browser, "#send")
        wait_for(browser, "document.querySelector('.state.succeeded')")
        assert complaints(browser) == []
    finally:
        stop_daemon(process)


def test_submit_goes_on_with_its_job_after_a_broken_upload(stub, browser, tmp_path):
    url, folder = stub
    _, sample = submit(url, folder, "broken twill")
    (sample / "scan.tif").write_bytes(b"a scan that the server does not have")

    def jobs():
        return [j.id for j in selvedge.Client(url).jobs()]
    before = jobs()
    browser.get(url + "/#new")
    drop_in(browser, *(sample / n for n in ("job.json", "scan.tif", "cloth.csv")))
    button = browser.find_element(By.CSS_SELECTOR, "#send")
    browser.execute_script("""
        window.realFetch = fetch;
        window.fetch = (u, o) => o.method === "PATCH" ? Promise.resolve(new Response("{}", {status: 500})) : realFetch(u, o);""")
    button.click()
    wait_for(browser, "document.querySelector('#submit .note.bad') && !document.querySelector('#send').disabled")
    (job_id,) = set(jobs()) - set(before)
    # the corrected scan is dropped again and replaces the declared one
    corrected = tmp_path / "scan.tif"
    corrected.write_bytes(b"corrected scan")
    browser.execute_script("window.fetch = realFetch")
    drop_in(browser, sample / "job.json", corrected)
    button.click()
    wait_for(browser, f"location.hash === '#{job_id}'")
    wait_for(browser, "document.querySelector('.state.succeeded')", 60)
    assert set(jobs()) - set(before) == {job_id}
    assert {f["name"]: f["size"] for f in selvedge.Client(url).job(job_id).state().raw["files"]} == {"scan.tif": corrected.stat().st_size, "cloth.csv": 4}
    assert complaints(browser) == []


def test_the_document_is_sent_as_it_was_written(stub, browser):
    """JavaScript's integers are exact to 2^53, but seeds may be larger."""
    url, folder = stub
    _, sample = submit(url, folder, "seeded twill")
    document = json.loads((sample / "job.json").read_text())
    document["fit"] = {"seed": 9007199254740993}
    (sample / "job.json").write_text(json.dumps(document))
    browser.get(url + "/#new")
    drop_in(browser, *(sample / n for n in ("job.json", "scan.tif", "cloth.csv")))
    click_on(browser, "#send")
    wait_for(browser, "location.hash.length > 10")
    job = selvedge.Client(url).job(browser.execute_script("return location.hash.slice(1)"))
    assert job.document() == document


LARGE_SEED = 2 ** 60 + 1  # a double cannot hold it


def test_copy_a_job_with_changes(stub, browser, tmp_path):
    """The form begins with the document of another job; its files are asked for; the other job stays as it is."""
    url, folder = stub
    first, _ = submit(url, folder, "copied <b>twill")
    first.wait()
    browser.get(f"{url}/#{first.id}")
    wait_for(browser, "document.querySelector('#state a.button')")
    click(browser, browser.find_element(By.CSS_SELECTOR, "#state a.button"))
    wait_for(browser, "document.querySelector('#submit').textContent.includes('Ready.')")
    assert browser.current_url.endswith(f"#new?copy={first.id}") and written(browser) == first.state().raw["document"]
    asked = text_of(browser, "#new-files")
    assert "scan.tif" in asked and "cloth.csv" in asked and "4 B in the copied job, on the server already: it is not sent again" in asked
    assert "copied <b>twill" in text_of(browser, "#submit") and browser.find_elements(By.CSS_SELECTOR, "#submit p b") == []
    wait_for(browser, "document.querySelectorAll('#editor .options > *').length >= 9")
    fill_in(browser, "sample", "changed twill")
    fill_in(browser, "volume.voxel_size_um", "2.5")
    (tmp_path / "cloth.csv").write_text("another table\n")
    drop_in(browser, tmp_path / "cloth.csv")  # the scan is that of the copied job
    assert "another file: 4 B in the copied job" in text_of(browser, "#new-files")
    keep(browser, "copy")
    with sized(browser, 375, 800):
        assert scrolls_sideways(browser) == []
        keep(browser, "copy-375", 375, 800)
    click(browser, browser.find_element(By.CSS_SELECTOR, "#send"))
    wait_for(browser, "document.querySelector('.state.succeeded')", 60)
    made = selvedge.Client(url).job(browser.execute_script("return location.hash.slice(1)")).state().raw
    changed = {"sample": "changed twill", "volume": {"files": ["scan.tif"], "voxel_size_um": 2.5}}
    assert made["id"] != first.id and made["document"] == {**first.state().raw["document"], **changed}
    assert first.state().raw["document"]["sample"] == "copied <b>twill"
    inputs = {f["name"]: f["sha256"] for f in made["files"]}
    assert inputs["scan.tif"] == {f["name"]: f["sha256"] for f in first.state().raw["files"]}["scan.tif"]
    assert inputs["cloth.csv"] == hashlib.sha256(b"another table\n").hexdigest()
    assert complaints(browser) == []


def test_copy_from_the_list_keeps_large_numbers(stub, browser):
    url, _ = stub
    document = {"sample": "seed, \"document\": {", "fibers": {"file": "cloth.hair"}, "measurements": {"file": "rows.csv"}, "fit": {"seed": LARGE_SEED}}
    job = selvedge.Client(url).create(document)
    browser.get(f"{url}/#")
    wait_for(browser, f"document.querySelector('#jobs a[href=\"#{job.id}\"]')")
    click(browser, browser.find_element(By.CSS_SELECTOR, f"#jobs tr:has(a[href='#{job.id}']) input"))
    press = {b.text: b for b in browser.find_elements(By.CSS_SELECTOR, "#bulk button")}
    assert press["Copy"].is_enabled() and not press["Compare"].is_enabled()
    click(browser, press["Copy"])
    wait_for(browser, "document.querySelector('#document')?.textContent.includes('seed')")
    assert written(browser) == document and str(LARGE_SEED) in text_of(browser, "#document")
    browser.get(f"{url}/#new?copy=00000000-0000-0000-0000-000000000000")
    wait_for(browser, "document.querySelector('#submit .note.bad')?.textContent.includes('The job to copy is not there')")
    browser.get(f"{url}/#new?copy=%22%3E")
    wait_for(browser, "document.querySelector('#submit .note.bad')?.textContent.includes('names no job')")
    job.delete()
    assert [c for c in complaints(browser) if "404" not in c] == []
