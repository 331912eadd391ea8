"""A daemon and a page of the dashboard, for the tests in tests/browser. SELVEDGE_SCREENSHOTS=DIR keeps screenshots."""
import contextlib
import json
import math
import os
import subprocess
import sys
import time

ROOT = os.path.abspath(os.path.join(os.path.dirname(__file__), "..", "..", ".."))
BUILD = os.environ.get("SELVEDGE_BUILD") or os.path.join(ROOT, "build")
BIN = os.path.join(BUILD, "bin")
TIMEOUT_S = float(os.environ.get("SELVEDGE_TEST_PATIENCE", "1"))
sys.path.insert(0, os.path.join(ROOT, "clients", "python"))
import selvedge  # noqa: E402


def start_daemon(folder, *more):
    process = subprocess.Popen([os.path.join(BIN, "selvedged"), "--data", str(folder), "--port", "0", "--set", "disk.floor_bytes=0",
                                "--set", "jobs.pictures=0", *more],
                               stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    line = process.stdout.readline()
    assert "listens on http://" in line, line
    return process, line.split()[-1]


def stop_daemon(process):
    process.terminate()
    process.wait(30)
    process.stdout.close()


def small_weave(folder, *photograph, diameter="6"):
    """Makes a small plain weave: scan.tif, truth.hair; with options of `selvedge-phantom photograph` also photographs of it,
    whose part of a job document is returned."""
    make = [os.path.join(BIN, "selvedge-phantom")]
    cloth = ["cloth", "--weave", "plain", "--fibers-per-yarn", "7", "--diameter-voxel", diameter]
    for words in (cloth, ["photograph", "--fibers", f"{folder}/truth.hair", *photograph] if photograph else None):
        if words:
            subprocess.run([*make, *words, "--out", str(folder)], check=True, stdout=subprocess.DEVNULL)
    if not photograph:
        return []
    with open(f"{folder}/photographs.json", encoding="utf-8") as f:
        return json.load(f)


def wait_for(browser, condition, seconds=30):
    """Waits until the JavaScript expression is true."""
    end, pause_s = time.monotonic() + seconds * TIMEOUT_S, 0.02
    while time.monotonic() < end:
        if browser.execute_script(f"return Boolean({condition})"):
            return
        time.sleep(pause_s)
        pause_s = min(0.2, 1.5 * pause_s)
    keep(browser, "timeout")
    page = browser.find_element("tag name", "body").text
    raise AssertionError(f"never true: {condition}\n{page[:2000]}")


def texts(browser, selector):
    """Returns the texts that a reader sees in all elements of a selector, read in one script.

    A page renews its elements whenever it polls. Texts that the driver asks for one by one can belong to elements that are
    gone by then (StaleElementReferenceException)."""
    return browser.execute_script("return [...document.querySelectorAll(arguments[0])].map((e) => e.innerText.replace(/[ \\t]+/g, ' ').trim())", selector)


def text_of(browser, selector):
    """Returns the text of the first element of a selector, which must be there."""
    found = texts(browser, selector)
    assert found, f"nothing on the page matches {selector}"
    return found[0]


def click_on(browser, selector, index=0):
    """Clicks on one element of a selector, found and clicked in one script."""
    script = "const found = document.querySelectorAll(arguments[0]); found[arguments[1]]?.click(); return found.length"
    assert browser.execute_script(script, selector, index) > index, f"nothing on the page matches {selector}[{index}]"


def open_tab(browser, name):
    """Turns to a tab of the page of a job or of a comparison, by its link."""
    wait_for(browser, f"document.querySelector('.tab-bar a[data-tab={name}]')")
    click_on(browser, f".tab-bar a[data-tab={name}]")
    wait_for(browser, f"document.querySelector('.tab-bar a.active')?.dataset.tab === '{name}'")


def error_words(result, key):
    """A relative error of a result as pages write it: with its standard error, or as a bound where noise hides it."""
    value, se = result[key], result.get(f"{key}_se")
    if not se:
        return f"{100 * value:.2f} %"
    if value >= 2 * se:
        return f"{100 * value:.2f} ± {100 * se:.2f} %"
    bound = 100 * (value + 2 * se)
    unit = 10 ** (math.floor(math.log10(bound)) - 1)
    return f"below {unit * math.ceil(bound / unit - 1e-9):.2g} %"


@contextlib.contextmanager
def sized(browser, width, height):
    """A window whose page has this size, also one narrower than Chromium allows."""
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 600})
    browser.page_width = width
    browser.execute_async_script("requestAnimationFrame(() => requestAnimationFrame(arguments[0]))")  # the page hears of its size with a frame
    yield
    del browser.page_width
    browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


WIDER = """const e = document.documentElement, found = [];
    for (const n of document.querySelectorAll("body *")) {
      let p = n.parentElement;
      while (p !== document.body && getComputedStyle(p).overflowX === "visible") p = p.parentElement;
      if (p === document.body && n.getBoundingClientRect().right > e.clientWidth + 1) found.push(`${n.tagName}#${n.id}.${n.className}`);
    }
    return [e.clientWidth, e.scrollWidth, found.slice(0, 8)]"""


def scrolls_sideways(browser):
    """What is wider than the page; nothing if all fits. A phone widens innerWidth to what it shows, so that says nothing; and a
    page without a viewport in its head is laid out for 980 pixels there."""
    width, whole, found = browser.execute_script(WIDER)
    return found or [f"{whole} of {width} pixels"] if whole > width or width > getattr(browser, "page_width", width) else []


def keep(browser, name, width=0, height=0):
    """Keeps a screenshot: of the whole page, or of a window of this size."""
    folder = os.environ.get("SELVEDGE_SCREENSHOTS")
    if not folder:
        return
    os.makedirs(folder, exist_ok=True)
    path = os.path.join(folder, name + ".png")
    if width:
        browser.save_screenshot(path)
        return
    whole = browser.execute_script("return document.documentElement.scrollHeight")
    browser.set_window_size(1280, min(whole + 150, 6000))
    time.sleep(0.5)
    browser.save_screenshot(path)
    browser.set_window_size(1280, 900)


def complaints(browser):
    """Returns the errors of the console: scripts, content security policy, missing files."""
    return [e["message"] for e in browser.get_log("browser") if e["level"] == "SEVERE"]


def made_batch(url, folder, samples, start=True):
    """A batch of samples for the stub worker that share their files."""
    (folder / "batch").mkdir(exist_ok=True)
    (folder / "batch" / "scan.tif").write_bytes(b"scan")
    (folder / "batch" / "cloth.csv").write_text("set\n")
    template = {"volume": {"files": ["scan.tif"], "voxel_size_um": 2.0}, "measurements": {"file": "cloth.csv"}}
    return selvedge.Client(url).submit_batch(f"batch of {samples[0]}", template, [{"sample": name} for name in samples], str(folder / "batch"), start=start)


def submit(url, folder, name):
    sample = folder / name.replace(" ", "-")
    sample.mkdir()
    (sample / "scan.tif").write_bytes(b"scan")
    (sample / "cloth.csv").write_text("set\n")
    document = {"sample": name, "volume": {"files": ["scan.tif"], "voxel_size_um": 2.0}, "measurements": {"file": "cloth.csv"}}
    (sample / "job.json").write_text(json.dumps(document))
    return selvedge.Client(url).submit(str(sample / "job.json")), sample
