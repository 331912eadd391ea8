"""The dashboard in a real browser with a real daemon: a small real job while it runs and at its end, and other cases
with a stub worker.

SELVEDGE_SCREENSHOTS=DIR keeps screenshots."""
import glob
import json
import os
import shutil
import subprocess
import sys
import time

import pytest

webdriver = pytest.importorskip("selenium.webdriver", reason="python3-selenium is not installed")
from selenium.webdriver.chrome.options import Options  # noqa: E402
from selenium.webdriver.chrome.service import Service  # noqa: E402
from selenium.webdriver.common.by import By  # noqa: E402

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
BUILD = os.environ.get("SELVEDGE_BUILD") or os.path.join(ROOT, "build")
BIN = os.path.join(BUILD, "bin")
DRIVER = shutil.which("chromedriver") or "/usr/bin/chromedriver"
FLAGS = ["--headless=new", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
         "--disable-component-update", "--disable-sync", "--window-size=1280,900", "--enable-unsafe-swiftshader"]
sys.path[:0] = [os.path.join(ROOT, "clients", "python"), os.path.join(ROOT, "tests", "support")]
import selvedge  # noqa: E402
import small_cloth  # noqa: E402

if not os.path.exists(DRIVER):
    pytest.skip("chromedriver is not installed", allow_module_level=True)


def start_daemon(folder, *more):
    process = subprocess.Popen([os.path.join(BIN, "selvedged"), "--data", str(folder), "--port", "0", "--set", "disk.floor_bytes=0", *more],
                               stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    line = process.stdout.readline()
    assert "listens on http://" in line, line
    return process, line.split()[-1]


def stop_daemon(process):
    process.terminate()
    process.wait(30)
    process.stdout.close()


@pytest.fixture(scope="module")
def real(tmp_path_factory):
    """A daemon with the real worker, and a small real job in it: volume, 9 + 4 photographs, two models, few paths."""
    folder = tmp_path_factory.mktemp("real")
    sample = folder / "sample"
    subprocess.run([os.path.join(BIN, "selvedge-phantom"), "cloth", "--weave", "plain", "--fibers-per-yarn", "7", "--diameter-voxel", "6",
                    "--out", str(sample)], check=True, stdout=subprocess.DEVNULL)
    subprocess.run([os.path.join(BIN, "selvedge-phantom"), "photograph", "--fibers", str(sample / "truth.hair"), "--out", str(sample),
                    "--px", "32", "--paths", "4096", "--param", "C_TT=0.7,0.5,0.3"], check=True, stdout=subprocess.DEVNULL)
    photographs = json.loads((sample / "photographs.json").read_text())
    document = {"sample": "small plain weave", "volume": {"files": ["scan.tif"], "voxel_size_um": 2.0},
                "photographs": photographs[:9] + photographs[16:20],
                "fit": {"models": ["two_lobe.v1", "microflake.v1"], "path_budget": 300000, "render_px": 24, "render_samples": 4,
                        "texture": {"block_mm": 2.5, "weight": 0.01},
                        "candidates": [{"light_theta_deg": t, "light_phi_deg": 0, "camera_theta_deg": 60, "camera_phi_deg": 180}
                                       for t in (20, 65)]}}
    (sample / "job.json").write_text(json.dumps(document))
    process, url = start_daemon(folder / "data")
    yield url, selvedge.Server(url).submit(str(sample / "job.json"))
    stop_daemon(process)


@pytest.fixture(scope="module")
def stub(tmp_path_factory):
    folder = tmp_path_factory.mktemp("stub")
    process, url = start_daemon(folder, "--worker", os.path.join(ROOT, "tests", "support", "client_stub_worker.py"))
    yield url, folder
    stop_daemon(process)


@pytest.fixture
def browser(tmp_path):
    options = Options()
    for flag in [*FLAGS, f"--user-data-dir={tmp_path / 'profile'}"]:
        options.add_argument(flag)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    driver = webdriver.Chrome(service=Service(DRIVER), options=options)
    driver.set_script_timeout(30)
    yield driver
    driver.quit()


def wait_for(browser, condition, seconds=30):
    """Waits until the JavaScript expression is true."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if browser.execute_script(f"return Boolean({condition})"):
            return
        time.sleep(0.2)
    keep(browser, "timeout")
    raise AssertionError(f"never true: {condition}\n{browser.find_element(By.TAG_NAME, 'body').text[:2000]}")


def keep(browser, name):
    folder = os.environ.get("SELVEDGE_SCREENSHOTS")
    if folder:
        os.makedirs(folder, exist_ok=True)
        height = browser.execute_script("return document.documentElement.scrollHeight")
        browser.set_window_size(1280, min(height + 150, 6000))
        time.sleep(0.5)
        browser.save_screenshot(os.path.join(folder, name + ".png"))
        browser.set_window_size(1280, 900)


def complaints(browser):
    """Returns the errors of the console: scripts, content security policy, missing files."""
    return [e["message"] for e in browser.get_log("browser") if e["level"] == "SEVERE"]


def submit(url, folder, name):
    sample = folder / name.replace(" ", "-")
    sample.mkdir()
    (sample / "scan.tif").write_bytes(b"scan")
    (sample / "cloth.csv").write_text("set\n")
    document = {"sample": name, "volume": {"files": ["scan.tif"], "voxel_size_um": 2.0}, "measurements": {"file": "cloth.csv"}}
    (sample / "job.json").write_text(json.dumps(document))
    return selvedge.Server(url).submit(str(sample / "job.json")), sample


def test_real_job_live_and_finished(real, browser):
    url, job = real
    browser.get(url + "/")
    wait_for(browser, "document.querySelector('#jobs tbody tr')")
    assert "small plain weave" in browser.find_element(By.ID, "jobs").text
    keep(browser, "list")
    browser.find_element(By.CSS_SELECTOR, "#jobs tbody tr a").click()
    wait_for(browser, "document.querySelectorAll('.stage').length === 8")
    # while the job runs: curves appear during the fit
    wait_for(browser, "document.querySelectorAll('.chart canvas').length >= 8", 240)
    assert any(e.text.startswith("Objective") for e in browser.find_elements(By.CSS_SELECTOR, ".chart-title"))
    keep(browser, "running")
    # finished
    wait_for(browser, "document.querySelector('.state.succeeded')", 400)
    wait_for(browser, "document.querySelector('#parameters')")
    # the curves of both models under their own names, and the table that compares them

    def titles():
        return [e.text for e in browser.find_elements(By.CSS_SELECTOR, ".chart-title")]
    wait_for(browser, "document.querySelectorAll('#models-shown button').length === 2")
    assert any(t.startswith("alpha") for t in titles()) and not any(t.startswith("C_TT") for t in titles())
    keep(browser, "second-model")
    browser.find_element(By.CSS_SELECTOR, "#models-shown button").click()
    wait_for(browser, "document.querySelectorAll('.chart canvas').length >= 14")
    assert any(t.startswith("beta_TT (°)") for t in titles()) and not any(t.startswith("alpha") for t in titles())
    compared = [e.text for e in browser.find_elements(By.CSS_SELECTOR, "#models tbody tr")]
    assert [c.split()[0] for c in compared] == ["two_lobe.v1", "microflake.v1"] and sum("best" in c for c in compared) == 1 and "best" in compared[0]
    result = job.state()["result"]
    rows = [e.text for e in browser.find_elements(By.CSS_SELECTOR, "#parameters tbody tr")]
    assert len(rows) == 9 and rows[0].startswith("C_R.r") and "±" in rows[3]
    n_positive = sum(m > 0 and r > 0 for row in result["rows"] for m, r in zip(row["measured"], row["rendered"]))
    assert len(browser.find_elements(By.CSS_SELECTOR, "svg.scatter circle")) == n_positive
    pairs = browser.find_elements(By.CSS_SELECTOR, ".pair")
    assert len(pairs) == 13 and sum("held" in p.get_attribute("class") for p in pairs) == 4
    browser.execute_script("for (const i of document.images) i.loading = 'eager'")
    wait_for(browser, "[...document.images].every((i) => i.complete && i.naturalWidth > 0)")
    assert len(browser.find_elements(By.CSS_SELECTOR, ".pair img")) == 26
    assert len(browser.find_elements(By.CSS_SELECTOR, ".slices img")) == 3
    assert "passed" in browser.find_element(By.ID, "certificate").text
    assert len(browser.find_elements(By.CSS_SELECTOR, "#next-photograph tbody tr")) == 2
    textures = [e.text for e in browser.find_elements(By.CSS_SELECTOR, "#textures tbody tr")]
    assert len(textures) == 13 and all("%" in t for t in textures)
    assert all(len(m["rows"][0]["texture"]["rendered_se"]) == 3 for m in result["models"])
    listed = browser.find_element(By.ID, "files").text
    assert "result.json" in listed and "fibers.hair" in listed and "density.vol" in listed
    assert "stage" in browser.find_element(By.CSS_SELECTOR, "pre.log").text
    # fibers in 3D, or a sentence with the reason (a machine without WebGL)
    browser.execute_script("document.querySelector('.view3d button').click()")
    wait_for(browser, "document.querySelector('.view3d canvas') || document.querySelector('.view3d').textContent.includes('not available')")
    # the key figures of the geometry, and the page with all of them
    quality = browser.find_element(By.ID, "quality").text
    assert "material explained" in quality and "direction noise" in quality and "continue" in quality
    keep(browser, "finished")
    assert complaints(browser) == []
    browser.get(browser.find_element(By.CSS_SELECTOR, "#quality a").get_attribute("href"))
    assert job.state()["sample"] in browser.find_element(By.TAG_NAME, "h1").text
    wait_for(browser, "[...document.images].length === 5 && [...document.images].every((i) => i.complete && i.naturalWidth > 0)")
    assert browser.execute_script("return getComputedStyle(document.querySelector('td.number')).textAlign") == "right"
    keep(browser, "quality")
    assert complaints(browser) == []


def test_parameters_of_two_groups(real, browser, tmp_path):
    """The table and the curves show the parameters group by group, under their own names."""
    url, _ = real
    (tmp_path / "cloth.hair").write_bytes(small_cloth.hair(groups=True))
    (tmp_path / "rows.csv").write_text(small_cloth.TABLE)
    (tmp_path / "job.json").write_text(json.dumps({
        "sample": "two colours", "fibers": {"file": "cloth.hair", "groups": ["weft", "warp"]}, "measurements": {"file": "rows.csv"},
        "fit": {"path_budget": 100000, "tied": [["beta_TT"], ["gamma_TT"]], "fixed": {"weft.beta_R": 5}, "render_px": 16, "render_samples": 4}}))
    job = selvedge.Server(url).submit(str(tmp_path / "job.json"))
    job.wait()
    browser.get(f"{url}/#{job.id}")
    wait_for(browser, "document.querySelector('#parameters')")
    rows = [e.text for e in browser.find_elements(By.CSS_SELECTOR, "#parameters tbody tr")]
    assert len(rows) == 20 and rows[0] == "weft" and rows[1].startswith("C_R.r ") and rows[10] == "warp" and rows[11].startswith("C_R.r ")
    assert "fixed" in rows[7] and "tied to weft.beta_TT" in rows[18]
    wait_for(browser, "document.querySelectorAll('.charts').length === 2")
    charts = [[e.text.split()[0] for e in c.find_elements(By.CSS_SELECTOR, ".chart-title")] for c in browser.find_elements(By.CSS_SELECTOR, ".charts")]
    assert charts == [["C_R", "C_TT", "beta_TT", "gamma_TT"], ["C_R", "C_TT", "beta_R", "beta_TT", "gamma_TT"]]
    keep(browser, "groups")
    assert complaints(browser) == []


def test_failed_job_and_hostile_name(stub, browser):
    url, folder = stub
    job, _ = submit(url, folder, "failing <img src=x onerror=alert(1)>")
    with pytest.raises(selvedge.JobFailed):
        job.wait(interval_s=0.2)
    browser.get(f"{url}/#{job.id}")
    wait_for(browser, "document.querySelector('.note.bad')")
    assert "volume.files" in browser.find_element(By.CSS_SELECTOR, ".note.bad").text
    assert browser.find_element(By.TAG_NAME, "h1").text == "failing <img src=x onerror=alert(1)>"
    assert browser.find_elements(By.CSS_SELECTOR, "main img") == []
    assert "Retry from checkpoint" in browser.find_element(By.ID, "state").text
    keep(browser, "failed")
    assert complaints(browser) == []


def test_unknown_job(stub, browser):
    browser.get(f"{stub[0]}/#00000000-0000-0000-0000-000000000000")
    wait_for(browser, "document.getElementById('connection').textContent.includes('does not exist')")


def test_submit_by_choosing_files(stub, browser):
    url, folder = stub
    _, sample = submit(url, folder, "dropped twill")
    browser.get(url + "/")
    chooser = browser.find_element(By.CSS_SELECTOR, ".drop input")
    browser.execute_script("arguments[0].style.display = 'block'", chooser)
    chooser.send_keys(str(sample / "job.json"))
    wait_for(browser, "document.querySelector('.drop').textContent.includes('2 of 2 files are still missing')")
    assert not browser.find_element(By.CSS_SELECTOR, ".drop button").is_enabled()
    chooser.send_keys("\n".join(str(sample / n) for n in ("scan.tif", "cloth.csv")))
    wait_for(browser, "!document.querySelector('.drop button').disabled")
    browser.find_element(By.CSS_SELECTOR, ".drop button").click()
    wait_for(browser, "location.hash.length > 10")
    wait_for(browser, "document.querySelector('.state.succeeded')", 60)
    assert browser.find_element(By.TAG_NAME, "h1").text == "dropped twill"
    files = {f["name"]: f for f in selvedge.Server(url).job(browser.execute_script("return location.hash.slice(1)")).state()["files"]}
    assert files["scan.tif"]["state"] == "complete" and files["scan.tif"]["sha256"]
    assert complaints(browser) == []


def drop_in(browser, *paths):
    """Drops files into the submit panel, and waits until it is ready."""
    chooser = browser.find_element(By.CSS_SELECTOR, ".drop input")
    browser.execute_script("arguments[0].style.display = 'block'", chooser)
    chooser.send_keys("\n".join(map(str, paths)))
    wait_for(browser, "!document.querySelector('.drop button').disabled")


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
        const input = document.querySelector(`#editor .option[data-path='${arguments[0]}'] > input, #editor .option[data-path='${arguments[0]}'] > select,
                                              #editor .option[data-path='${arguments[0]}'] > textarea`);
        input.value = arguments[1];
        input.dispatchEvent(new Event("change"));""", path, text)


def written(browser):
    return json.loads(browser.find_element(By.ID, "document").text)


def test_form_writes_a_job_document(stub, browser, tmp_path):
    url, _ = stub
    for name, data in (("cloth.hair", b"hair"), ("p0.exr", b"a"), ("p1.exr", b"b")):
        (tmp_path / name).write_bytes(data)
    browser.get(url + "/")
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
    browser.execute_script("document.querySelector(`#editor details[data-path='photographs[2]'] button`).click()")
    keep(browser, "form")
    document = {"sample": "written twill", "fibers": {"file": "cloth.hair", "tile_mm": [0.8, 0.9]}, "lamp": {"side_cm": 12.5}, "black_sheet": False,
                "fit": {"model": "microflake.v1", "texture": {"block_mm": 0.5}, "fixed": {"gamma": 0.3}},
                "photographs": [{"file": f"p{i}.exr", **angles} for i in range(2)]}
    assert written(browser) == document
    drop_in(browser, *(tmp_path / n for n in ("cloth.hair", "p0.exr", "p1.exr")))
    # the server refuses a value: its row is marked, and the corrected document is another one
    fill_in(browser, "lamp.side_cm", "5000")
    click(browser, browser.find_element(By.CSS_SELECTOR, ".drop button"))
    wait_for(browser, "document.querySelector(`#editor .option.bad[data-path='lamp.side_cm'] .problem`)?.textContent.includes('0.01 to 1000')")
    keep(browser, "form-refused")
    fill_in(browser, "lamp.side_cm", "12.5")
    assert "bad" not in option(browser, "lamp.side_cm").get_attribute("class")
    click(browser, browser.find_element(By.CSS_SELECTOR, ".drop button"))
    wait_for(browser, "location.hash.length > 10")
    wait_for(browser, "document.querySelector('.state.succeeded')", 60)
    assert selvedge.Server(url).job(browser.execute_script("return location.hash.slice(1)")).state()["document"] == document
    assert [c for c in complaints(browser) if "422" not in c] == []


def test_form_edits_a_dropped_document(stub, browser):
    url, folder = stub
    _, sample = submit(url, folder, "edited twill")
    browser.get(url + "/")
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
    assert browser.find_elements(By.CSS_SELECTOR, "#editor .option") == [] and str(2**60 + 1) in browser.find_element(By.ID, "document").text
    assert complaints(browser) == []


def test_pieces_are_no_larger_than_the_server_takes(browser, tmp_path):
    process, url = start_daemon(tmp_path / "data", "--worker", os.path.join(ROOT, "tests", "support", "client_stub_worker.py"),
                                "--set", f"upload.max_patch_bytes={1 << 20}")
    try:
        _, sample = submit(url, tmp_path, "large twill")
        (sample / "scan.tif").write_bytes(os.urandom(2_500_000))
        browser.get(url + "/")
        drop_in(browser, *(sample / n for n in ("job.json", "scan.tif", "cloth.csv")))
        browser.find_element(By.CSS_SELECTOR, ".drop button").click()
        wait_for(browser, "document.querySelector('.state.succeeded')")
        assert complaints(browser) == []
    finally:
        stop_daemon(process)


def test_submit_goes_on_with_its_job_after_a_broken_upload(stub, browser, tmp_path):
    url, folder = stub
    _, sample = submit(url, folder, "broken twill")

    def jobs():
        return [j["id"] for j in selvedge.Server(url).jobs()]
    before = jobs()
    browser.get(url + "/")
    drop_in(browser, *(sample / n for n in ("job.json", "scan.tif", "cloth.csv")))
    button = browser.find_element(By.CSS_SELECTOR, ".drop button")
    browser.execute_script("""
        window.realFetch = fetch;
        window.fetch = (u, o) => o.method === "PATCH" ? Promise.resolve(new Response("{}", {status: 500})) : realFetch(u, o);""")
    button.click()
    wait_for(browser, "document.querySelector('.drop .note.bad') && !document.querySelector('.drop button').disabled")
    (job_id,) = set(jobs()) - set(before)
    # the corrected scan is dropped again and replaces the declared one
    mended = tmp_path / "scan.tif"
    mended.write_bytes(b"mended scan")
    browser.execute_script("window.fetch = realFetch")
    drop_in(browser, sample / "job.json", mended)
    button.click()
    wait_for(browser, f"location.hash === '#{job_id}'")
    wait_for(browser, "document.querySelector('.state.succeeded')", 60)
    assert set(jobs()) - set(before) == {job_id}
    assert {f["name"]: f["size"] for f in selvedge.Server(url).job(job_id).state()["files"]} == {"scan.tif": 11, "cloth.csv": 4}
    assert complaints(browser) == []


def test_the_document_is_sent_as_it_was_written(stub, browser):
    """JavaScript's integers are exact to 2^53, but seeds may be larger."""
    url, folder = stub
    _, sample = submit(url, folder, "seeded twill")
    document = json.loads((sample / "job.json").read_text())
    document["fit"] = {"seed": 9007199254740993}
    (sample / "job.json").write_text(json.dumps(document))
    browser.get(url + "/")
    drop_in(browser, *(sample / n for n in ("job.json", "scan.tif", "cloth.csv")))
    browser.find_element(By.CSS_SELECTOR, ".drop button").click()
    wait_for(browser, "location.hash.length > 10")
    job = selvedge.Server(url).job(browser.execute_script("return location.hash.slice(1)"))
    assert job.state()["document"] == document


def test_long_log_does_not_freeze(stub, browser):
    url, folder = stub
    job, _ = submit(url, folder, "chatty twill")
    job.wait(interval_s=0.2)
    log = glob.glob(os.path.join(str(folder), "**", job.id, "log.txt"), recursive=True)
    assert len(log) == 1
    with open(log[0], "a", encoding="utf-8") as f:
        for block in range(200):
            f.write("".join(f"2026-01-01T00:00:00.000Z INFO line {1000 * block + i} of a very long log\n" for i in range(1000)))
    browser.get(f"{url}/#{job.id}")
    wait_for(browser, "document.querySelector('pre.log').textContent.includes('line 199999 ')")
    with open(log[0], "a", encoding="utf-8") as f:
        f.write("2026-01-01T00:00:00.000Z INFO the end\n")
    wait_for(browser, "document.querySelector('pre.log').textContent.endsWith('the end')", 30)
    assert browser.execute_script("return document.querySelector('pre.log').textContent.split('\\n').length") <= 1000
    # the page replies at once
    longest = browser.execute_async_script("""
        const done = arguments[0], start = performance.now(); let last = start, longest = 0;
        const tick = () => { const now = performance.now(); longest = Math.max(longest, now - last); last = now;
                             if (now - start < 3000) setTimeout(tick, 10); else done(longest); };
        tick();""")
    assert longest < 1000


def test_hidden_page_asks_less_often(stub, browser):
    url, folder = stub
    job, _ = submit(url, folder, "slow twill")
    browser.get(f"{url}/#{job.id}")
    wait_for(browser, "document.querySelector('.state.running')")
    count = "return performance.getEntriesByType('resource').filter((e) => e.name.includes('/v1/jobs/')).length"
    browser.execute_script("performance.setResourceTimingBufferSize(10000)")
    before = browser.execute_script(count)
    time.sleep(6)
    shown = browser.execute_script(count) - before
    browser.execute_script("Object.defineProperty(document, 'hidden', {get: () => true})")
    time.sleep(2)
    before = browser.execute_script(count)
    time.sleep(6)
    hidden = browser.execute_script(count) - before
    job.cancel()
    assert shown >= 9 and hidden <= shown / 2
