"""A job without a document: the page of a new job guesses the use of dropped files, asks for the rest and writes the document."""
import json
import os
import struct
import subprocess
import urllib.request
import zlib

import pytest

pytest.importorskip("selenium.webdriver", reason="python3-selenium is not installed")
import selvedge  # noqa: E402
from browser_page import BIN, ROOT, click_on, complaints, keep, scrolls_sideways, sized, start_daemon, stop_daemon, text_of, texts, wait_for  # noqa: E402
from selenium.webdriver.common.action_chains import ActionChains  # noqa: E402
from selenium.webdriver.common.by import By  # noqa: E402
from selenium.webdriver.common.keys import Keys  # noqa: E402

TIFF = b"II*\0\x08\0\0\0\0\0\0\0\0\0"  # no directory entries, so it states no size of a voxel
RIG = {"selvedge_rig": 1, "lamps": {"low": {"theta_deg": 60, "phi_deg": 0}}, "cameras": {"top": {"theta_deg": 0, "phi_deg": 0}},
       "views": {"v01": {"lamp": "low", "camera": "top"}, "v02": {"lamp": "low", "camera": "top", "cloth_rotation_deg": 90}}}
TABLE = "set,light_theta_deg,light_phi_deg,camera_theta_deg,camera_phi_deg,r,g,b\n"


def png(path):
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    rows = b"".join(b"\0" + bytes([40, 80, 160] * 8) for _ in range(8))
    head = chunk(b"IHDR", struct.pack(">IIBBBBB", 8, 8, 8, 2, 0, 0, 0))
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + head + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))


def sample(folder, names):
    """Writes small files of these names; pictures are real ones."""
    for name in names:
        if name.endswith(".png"):
            png(folder / name)
        else:
            (folder / name).write_bytes(TIFF if name.endswith((".tif", ".dng")) else b"bytes of " + name.encode())
    return [folder / name for name in names]


def drop(browser, paths):
    chooser = browser.find_element(By.CSS_SELECTOR, ".drop input:not([webkitdirectory])")
    chooser.send_keys("\n".join(map(str, paths)))
    wait_for(browser, f"document.querySelectorAll('#new-files li').length >= {min(2, len(paths))}")


def answer(browser, question, text):
    browser.execute_script("""const n = document.querySelector(`#ask-${arguments[0]}`);
        n.value = arguments[1]; n.dispatchEvent(new Event("change"))""", question, text)


def written(browser):
    return json.loads(browser.execute_script("return document.querySelector('#document').textContent || '{}'"))


def kinds(browser):
    lines = "[...document.querySelectorAll('#new-files li[data-file]')]"
    return dict(browser.execute_script(f"return {lines}.map((n) => [n.dataset.file, n.querySelector('select')?.value])"))


NAMES = ["scan.tif", "dark-1.dng", "chart.png", *(f"t{t}_p{p}.png" for t in (20, 45, 60, 75) for p in (0, 90, 180, 270))]


def test_the_document_is_written_from_the_files(stub, browser, tmp_path):
    url, _ = stub
    browser.get(url + "/#new")
    drop(browser, sample(tmp_path, NAMES))
    wait_for(browser, "document.querySelectorAll('#new-files .thumbnail canvas').length === 17")
    wait_for(browser, "document.querySelector('#send-state').textContent.includes('edge of a voxel')")
    found = kinds(browser)
    assert found.pop("scan.tif") == "scan" and found.pop("dark-1.dng") == "dark" and found.pop("chart.png") == "chart"
    assert set(found.values()) == {"photograph"} and len(found) == 16
    assert browser.execute_script("return document.querySelector('#presets :checked').value") == "scan_photographs"
    assert browser.execute_script("return document.querySelector('#send').disabled")
    answer(browser, "voxel", "2,5")
    answer(browser, "edition", "from_2014")
    answer(browser, "sample", "twill of the files")
    wait_for(browser, "!document.querySelector('#send').disabled")
    assert text_of(browser, "#send-state") == "Ready." and texts(browser, "#faults li") == []
    keep(browser, "new-job")
    for width in (375, 1920):
        with sized(browser, width, 900):
            assert scrolls_sideways(browser) == []
    click_on(browser, "#send")
    wait_for(browser, "document.querySelector('.state.succeeded')", 60)
    made = selvedge.Client(url).job(browser.execute_script("return location.hash.slice(1)")).state().raw
    document = made["document"]
    assert document["volume"] == {"files": ["scan.tif"], "voxel_size_um": 2.5} and document["sample"] == "twill of the files"
    assert document["camera"] == {"dark_frames": ["dark-1.dng"]} and document["color"] == {"chart": {"file": "chart.png", "edition": "from_2014"}}
    assert document["photographs"][5] == {"file": "t45_p90.png", "light_theta_deg": 45, "light_phi_deg": 90, "camera_theta_deg": 0, "camera_phi_deg": 0}
    assert {f["name"]: f["role"] for f in made["files"]}["chart.png"] == "chart" and len(made["files"]) == len(NAMES)
    assert complaints(browser) == []


@pytest.mark.parametrize("names", [
    NAMES, ["a.hair", "rows.csv", "white-card.png"], ["weave.wif", "lt20_lp0_ct0_cp0_r90.exr", "lt45_lp0_ct0_cp0_r0.exr"],
    ["scan.mhd", "scan.raw", "table.binary"], ["slice_01.tif", "slice_02.tif", "slice_10.tif", "t20_p0.png", "t20.5_p0.png"],
    ["s2.tif", "s10.tif", "s1.tif", "b.png", "A.png"],
    ["cloth.hair", "my-rig.json", "v01.exr", "v02.exr", "chart.png"],
    ["yarn.hair", "t45_p0-1.exr", "t45_p0-2.exr", "t60_p0-1.exr", "t60_p0-2.exr"]])
def test_the_same_document_as_the_shell_writes(stub, browser, tmp_path, names):
    url, _ = stub
    folder = tmp_path / "sample"
    folder.mkdir()
    paths = sample(folder, names)
    if "scan.mhd" in names:
        (folder / "scan.mhd").write_text("ObjectType = Image\nNDims = 3\nElementDataFile = scan.raw\n")
    if "my-rig.json" in names:
        (folder / "my-rig.json").write_text(json.dumps(RIG))
    subprocess.run([os.path.join(BIN, "selvedge"), "init", str(folder)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=False)
    shell = json.loads((folder / "job.json").read_text())
    browser.get(url + "/#new")
    drop(browser, paths)
    answer(browser, "sample", "sample")
    assert written(browser) == shell
    assert browser.execute_script("return document.querySelector('#rig-picker').hidden") == ("my-rig.json" not in names)


def test_a_guess_is_changed(stub, browser, tmp_path):
    url, _ = stub
    browser.get(url + "/#new")
    drop(browser, sample(tmp_path, ["cloth.png", "other.png", "weave.wif"]))
    wait_for(browser, "document.querySelector('#send-state').textContent.includes('the angles of 2 photographs')")
    choose = "const s = document.querySelector(`li[data-file='other.png'] select`); s.value = arguments[0]; s.dispatchEvent(new Event('change'))"
    browser.execute_script(choose, "unused")
    assert [p["file"] for p in written(browser)["photographs"]] == ["cloth.png"] and kinds(browser)["other.png"] == "unused"
    browser.execute_script(choose, "chart")
    assert written(browser)["color"] == {"chart": {"file": "other.png"}} and written(browser)["cloth"] == {"draft_file": "weave.wif"}
    assert complaints(browser) == []


def jpeg_with_exposure(path, seconds):
    """The head of a JPEG with an Exif directory that states the exposure time, as cameras write it."""
    exif = b"MM\0*\0\0\0\x08" + struct.pack(">HHHII", 1, 0x8769, 4, 1, 26) + bytes(4)
    exif += struct.pack(">HHHII", 1, 0x829A, 5, 1, 44) + bytes(4) + struct.pack(">II", 1, round(1 / seconds))
    path.write_bytes(b"\xff\xd8\xff\xe1" + struct.pack(">H", len(exif) + 8) + b"Exif\0\0" + exif + b"\xff\xd9")
    return path


def test_faults_of_the_files_together(stub, browser, tmp_path):
    url, _ = stub
    (tmp_path / "deeper").mkdir()
    without = tmp_path / "t60_p0.jpg"
    without.write_bytes(b"\xff\xd8\xff\xd9" + bytes(16))
    paths = [jpeg_with_exposure(tmp_path / f"t{t}_p0.jpg", 1 / 60) for t in (20, 45)]
    browser.get(url + "/#new")
    drop(browser, [*sample(tmp_path, ["cloth.hair"]), *paths, without, *sample(tmp_path / "deeper", ["cloth.hair"])])
    wait_for(browser, "document.querySelector('#file-notes').textContent.includes('1 of 3 photographs do not state their exposure (t60_p0.jpg)')")
    assert "1/60 s" in text_of(browser, "li[data-file='t20_p0.jpg']") and "Several files have the name cloth.hair" in text_of(browser, "#file-notes")
    assert complaints(browser) == []


def test_angles_by_a_pattern_that_is_changed(stub, browser, tmp_path):
    url, _ = stub
    browser.get(url + "/#new")
    drop(browser, sample(tmp_path, ["cloth.hair", "lamp20az0.png", "lamp45az90.png"]))
    wait_for(browser, "document.querySelector('#angles').textContent.includes('The names do not tell the angles')")
    pattern = browser.find_element(By.CSS_SELECTOR, "#angles .pattern input")
    pattern.send_keys("lamp{elevation}", Keys.TAB)
    assert "unknown place '{elevation}'" in text_of(browser, "#angles .note.bad") and not browser.find_element(By.ID, "send").is_enabled()
    pattern.clear()
    pattern.send_keys("lamp{light_theta}az{light_phi}", Keys.TAB)
    wait_for(browser, "document.querySelector('#angles').textContent.includes('2 of 2 names fit')")
    assert [(p["light_theta_deg"], p["light_phi_deg"], p["camera_theta_deg"]) for p in written(browser)["photographs"]] == [(20, 0, 0), (45, 90, 0)]
    assert complaints(browser) == []


def cell(browser, row, column):
    return browser.find_element(By.CSS_SELECTOR, f"#angles tbody input[data-row='{row}'][data-column='{column}']")


def point(browser, row, column):
    """Puts the cursor into a cell, wherever it is scrolled to."""
    browser.execute_script("arguments[0].focus(); arguments[0].select()", cell(browser, row, column))


def test_angles_by_keys_and_from_a_spreadsheet(stub, browser, tmp_path):
    url, _ = stub
    browser.get(url + "/#new")
    drop(browser, sample(tmp_path, ["cloth.hair", "a.png", "b.png", "c.png"]))
    wait_for(browser, "document.querySelectorAll('#angles tbody tr').length === 3")
    point(browser, 0, 0)
    cell(browser, 2, 4).send_keys("9")
    drop(browser, sample(tmp_path, ["dark-1.png"]))  # the page is shown anew while a cell is being filled
    wait_for(browser, "document.querySelector(`li[data-file='dark-1.png']`)")
    assert cell(browser, 2, 4).get_attribute("value") == "9"
    cell(browser, 2, 4).clear()
    point(browser, 0, 0)
    for word in ("30", Keys.ENTER, "40", Keys.ARROW_DOWN, "5", Keys.ARROW_UP, Keys.ARROW_RIGHT, "270", Keys.TAB):
        ActionChains(browser).send_keys(word).perform()
    assert [p.get("light_theta_deg") for p in written(browser)["photographs"]] == [30, 40, 5] and written(browser)["photographs"][1]["light_phi_deg"] == 270
    # the drawing shows the row under the cursor
    point(browser, 1, 0)
    assert "Lamp 40° from straight above, on the side of −warp" in text_of(browser, "#angle-drawing figcaption")
    before = browser.execute_script("return document.querySelector('svg.angles .lamp .arm').getAttribute('d')")
    point(browser, 0, 0)
    assert "Lamp 30°" in text_of(browser, "#angle-drawing figcaption") and "not given yet" in text_of(browser, "#angle-drawing figcaption")
    assert browser.execute_script("return document.querySelector('svg.angles .lamp .arm').getAttribute('d')") != before
    keep(browser, "angles")
    browser.execute_script("""const data = new DataTransfer(); data.setData("text/plain", "20\\t0\\t0\\t0\\t90\\n45\\t0\\t0\\t0\\t\\n60,5\\t180\\t0\\t0\\t\\n");
        arguments[0].dispatchEvent(new ClipboardEvent("paste", {clipboardData: data, bubbles: true, cancelable: true}))""", cell(browser, 0, 0))
    rows = written(browser)["photographs"]
    assert rows[0] == {"file": "a.png", "light_theta_deg": 20, "light_phi_deg": 0, "camera_theta_deg": 0, "camera_phi_deg": 0, "cloth_rotation_deg": 90}
    assert rows[2]["light_theta_deg"] == 60.5 and "cloth_rotation_deg" not in rows[2]
    # one value for all rows
    everywhere = browser.find_element(By.CSS_SELECTOR, "#angles input[aria-label='Camera from above, all rows']")
    everywhere.send_keys("15", Keys.TAB)
    assert {p["camera_theta_deg"] for p in written(browser)["photographs"]} == {15}
    assert complaints(browser) == []


def test_lamp_and_camera_that_look_exchanged(stub, browser, tmp_path):
    url, _ = stub
    browser.get(url + "/#new")
    drop(browser, sample(tmp_path, ["cloth.hair", "l0_0_c20_0.png", "l0_0_c60_0.png"]))
    wait_for(browser, "document.querySelector('#angles .note:not(.hidden)')?.textContent.includes('are lamp and camera exchanged?')")
    click_on(browser, "#angles p.hint button")
    assert [(p["light_theta_deg"], p["camera_theta_deg"]) for p in written(browser)["photographs"]] == [(20, 0), (60, 0)]
    assert browser.execute_script("return document.querySelector('#angles .note').classList.contains('hidden')")


def test_a_table_that_does_not_say_how_the_cloth_was_turned(stub, browser, tmp_path):
    url, _ = stub
    (tmp_path / "rows.csv").write_text("# by hand\n" + TABLE + "fit,20,0,0,0,.1,.1,.1\nheld-out,60,0,0,0,.1,.1,.1\n")
    browser.get(url + "/#new")
    drop(browser, [*sample(tmp_path, ["cloth.hair"]), tmp_path / "rows.csv"])
    wait_for(browser, "document.querySelector('#no-rotation')")
    click_on(browser, "#no-rotation button")
    wait_for(browser, "!document.querySelector('#no-rotation') && !document.querySelector('#send').disabled")
    click_on(browser, "#send")
    wait_for(browser, "document.querySelector('.state.succeeded')", 60)
    job = selvedge.Client(url).job(browser.execute_script("return location.hash.slice(1)"))
    with urllib.request.urlopen(f"{url}/v1/jobs/{job.id}/files/rows.csv") as f:
        assert f.read().decode().splitlines()[1:3] == [TABLE.strip() + ",cloth_rotation_deg", "fit,20,0,0,0,.1,.1,.1,all"]
    assert complaints(browser) == []


def test_warnings_are_shown_before_the_job_starts(stub, browser, tmp_path):
    url, _ = stub
    browser.get(url + "/#new")
    drop(browser, sample(tmp_path, ["cloth.hair", "rows.csv"]))
    answer(browser, "sample", "warned cloth")
    wait_for(browser, "!document.querySelector('#send').disabled")
    click_on(browser, "#send")
    wait_for(browser, "document.querySelector('#send').textContent === 'Start all the same' && !document.querySelector('#send').disabled")
    assert "lamp and camera look exchanged" in text_of(browser, "#send-state")
    keep(browser, "warned")
    (job,) = [j for j in selvedge.Client(url).jobs() if j.sample == "warned cloth"]
    assert job.state == "draft"
    # another answer changes the document of the draft, which is judged again; then the job starts
    answer(browser, "sample", "warned cloth, second")
    assert text_of(browser, "#send") == "Submit"
    click_on(browser, "#send")
    wait_for(browser, "document.querySelector('#send').textContent === 'Start all the same' && !document.querySelector('#send').disabled")
    click_on(browser, "#send")
    wait_for(browser, "document.querySelector('.state.succeeded')", 60)
    assert [(j.id, j.sample) for j in selvedge.Client(url).jobs() if j.sample.startswith("warned")] == [(job.id, "warned cloth, second")]
    assert complaints(browser) == []


def test_no_scanner_asks_for_the_weave(stub, browser, tmp_path):
    url, _ = stub
    browser.get(url + "/#new")
    click_on(browser, "#presets input[value='no_scanner']")
    assert text_of(browser, "#send-state") == "Still to give: name of the sample; weave; photographs, or a table."
    drop(browser, sample(tmp_path, ["t20_p0.png", "t45_p0.png"]))
    answer(browser, "weave", "twill")
    answer(browser, "warp", "24")
    answer(browser, "scale", "0.9")
    answer(browser, "sample", "described")
    wait_for(browser, "!document.querySelector('#send').disabled")
    assert written(browser)["cloth"] == {"weave": "twill", "warp_per_cm": 24}
    assert [p["scale"] for p in written(browser)["photographs"]] == [0.9, 0.9]
    assert browser.execute_script("return document.querySelector('#ask-voxel').offsetParent === null")
    assert complaints(browser) == []


def test_upload_that_is_cancelled_and_goes_on_after_a_reload(stub, browser, tmp_path):
    url, _ = stub
    paths = sample(tmp_path, ["slow.tif", "rows.csv"])
    (tmp_path / "slow.tif").write_bytes(TIFF + os.urandom(20 << 20))
    (tmp_path / "rows.csv").write_text(TABLE + "fit,20,0,0,0,.1,.1,.1\nfit,20,90,0,0,.1,.1,.1\n")
    browser.get(url + "/#new")
    drop(browser, paths)
    answer(browser, "voxel", "2")
    answer(browser, "sample", "interrupted")
    wait_for(browser, "!document.querySelector('#send').disabled")
    browser.execute_script("""
        window.realFetch = fetch; window.pieces = 0;
        window.fetch = (u, o) => { if (o?.method !== "PATCH" || ++window.pieces === 1) return realFetch(u, o);
          return new Promise((_, failed) => o.signal.addEventListener("abort",
            () => failed(new DOMException("stopped", "AbortError")))); };""")
    click_on(browser, "#send")
    wait_for(browser, "window.pieces === 2 && document.querySelector('#upload progress').value > 0.3")
    assert "8.39 MB of 21.0 MB" in text_of(browser, "#upload") and "1 of 2: slow.tif" in text_of(browser, "#upload")
    assert browser.execute_script("const e = new Event('beforeunload', {cancelable: true}); window.dispatchEvent(e); return e.defaultPrevented")
    keep(browser, "uploading")
    click_on(browser, "#upload button")
    wait_for(browser, "document.querySelector('#send-state').textContent.startsWith('Cancelled.')")
    assert not browser.execute_script("const e = new Event('beforeunload', {cancelable: true}); window.dispatchEvent(e); return e.defaultPrevented")
    browser.refresh()
    wait_for(browser, "document.querySelector('#interrupted')")
    assert "The upload of “interrupted” was interrupted" in text_of(browser, "#interrupted") and "8.39 MB" in text_of(browser, "#interrupted")
    keep(browser, "interrupted")
    click_on(browser, "#interrupted button")
    wait_for(browser, "document.querySelector('#new-files')?.textContent.includes('8.39 MB of 21.0 MB have arrived')")
    assert "drop the same files again" in text_of(browser, "#submit")
    browser.execute_script("""window.sent = 0; window.realFetch = fetch;
        window.fetch = (u, o) => { if (o?.method === "PATCH") window.sent += o.body.size; return realFetch(u, o); };""")
    drop(browser, paths)
    wait_for(browser, "!document.querySelector('#send').disabled")
    click_on(browser, "#send")
    wait_for(browser, "document.querySelector('.state.succeeded')", 60)
    whole = (tmp_path / "slow.tif").stat().st_size + (tmp_path / "rows.csv").stat().st_size
    assert browser.execute_script("return window.sent") == whole - (8 << 20), "what had arrived is not sent again"
    assert [j.sample for j in selvedge.Client(url).jobs()].count("interrupted") == 1
    browser.get(url + "/#new")
    browser.refresh()
    wait_for(browser, "document.querySelector('#send')")
    assert browser.find_elements(By.ID, "interrupted") == []
    assert complaints(browser) == []


def test_the_empty_list_offers_an_example(browser, tmp_path):
    process, url = start_daemon(tmp_path / "data", "--worker", os.path.join(ROOT, "tests", "support", "python", "client_stub_worker.py"))
    try:
        browser.get(url + "/#")
        wait_for(browser, "document.querySelector('#example')?.offsetParent")
        keep(browser, "empty-list")
        click_on(browser, "#example")
        wait_for(browser, "document.querySelector('.state.succeeded')", 60)
        job = selvedge.Client(url).job(browser.execute_script("return location.hash.slice(1)"))
        assert job.document()["cloth"]["weave"] == "twill" and {f["name"] for f in job.state().raw["files"]} == {job.document()["measurements"]["file"]}
        browser.get(url + "/#")
        wait_for(browser, "document.querySelector('#jobs tbody tr')")
        assert browser.find_elements(By.CSS_SELECTOR, "#example") == [] or not browser.find_element(By.ID, "example").is_displayed()
        assert complaints(browser) == []
    finally:
        stop_daemon(process)


def test_the_form_has_words_first_and_a_search(stub, browser, tmp_path):
    url, _ = stub
    browser.get("about:blank")
    complaints(browser)  # forgets the polls of an earlier page whose daemon has ended
    browser.get(url + "/#new")
    drop(browser, sample(tmp_path, ["cloth.hair", "rows.csv"]))
    click_on(browser, "#editor > summary")
    wait_for(browser, "document.querySelector('#editor .search input')")
    # only the sections that the document has are open
    opened = browser.execute_script("return [...document.querySelectorAll('#editor .options details[open]')].map((d) => d.dataset.path)")
    assert opened == ["fibers", "measurements"]
    assert text_of(browser, "#editor details[data-path='lamp'] > summary") == "The lamp of every photograph lamp"
    browser.find_element(By.CSS_SELECTOR, "#editor .search input").send_keys("twist metre")
    wait_for(browser, "document.querySelectorAll('#editor .found button').length >= 2")
    search = browser.find_element(By.CSS_SELECTOR, "#editor .search input")
    browser.execute_script("arguments[0].value = 'seed'; arguments[0].dispatchEvent(new Event('input'))", search)
    seeds = texts(browser, "#editor .found button")
    assert seeds[0].endswith("cloth.seed") and any(s.endswith("fit.seed") for s in seeds)
    click_on(browser, "#editor .found button", next(i for i, s in enumerate(seeds) if s.endswith("fit.seed")))
    row = browser.find_element(By.CSS_SELECTOR, "#editor .option[data-path='fit.seed']")
    assert row.is_displayed() and "Without it: 1" in row.text and browser.execute_script("return arguments[0].contains(document.activeElement)", row)
    keep(browser, "option-search")
    browser.execute_script("document.querySelector('#editor a[download]').click()")
    assert browser.execute_script("return document.querySelector('#editor a[download]').href").startswith("blob:")
    assert complaints(browser) == []


def test_a_folder_gives_the_sample_its_name(stub, browser, tmp_path):
    url, _ = stub
    folder = tmp_path / "green twill"
    folder.mkdir()
    sample(folder, ["cloth.hair", "rows.csv", ".hidden"])
    browser.get(url + "/#new")
    browser.find_element(By.CSS_SELECTOR, ".drop input[webkitdirectory]").send_keys(str(folder))
    wait_for(browser, "!document.querySelector('#send').disabled")
    assert written(browser) == {"sample": "green twill", "fibers": {"file": "cloth.hair"}, "measurements": {"file": "rows.csv"}}
    assert complaints(browser) == []
