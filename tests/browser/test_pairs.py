"""Measured and rendered pictures on the page of a job: what is drawn and read out is what the OpenEXR files hold."""
import base64
import math
import urllib.request

import pytest

pytest.importorskip("selenium.webdriver", reason="python3-selenium is not installed")
import selvedge  # noqa: E402
import small_cloth  # noqa: E402
from browser_page import (  # noqa: E402
    click_on, complaints, keep, open_tab, scrolls_sideways, sized, small_weave, start_daemon, stop_daemon, text_of, texts, wait_for)
from selenium.webdriver.common.action_chains import ActionChains  # noqa: E402
from selenium.webdriver.common.by import By  # noqa: E402
from selenium.webdriver.common.keys import Keys  # noqa: E402
from small_exr import exr, read_exr  # noqa: E402

FIXED = {"C_R": [0.1, 0.1, 0.1], "beta_R": 8, "beta_TT": 12, "gamma_TT": 30}


@pytest.fixture(scope="module")
def fitted(tmp_path_factory):
    """A real fit to photographs of a phantom, and one to a table without photographs."""
    folder = tmp_path_factory.mktemp("pairs")
    photographs = small_weave(folder, "--px", "32", "--paths", "4096", "--param", "C_TT=0.7,0.5,0.3")
    (folder / "cloth.hair").write_bytes(small_cloth.hair())
    (folder / "rows.csv").write_text(small_cloth.TABLE)
    fit = {"model": "two_lobe.v1", "path_budget": 100000, "render_px": 24, "render_samples": 4, "fixed": FIXED}
    process, url = start_daemon(tmp_path_factory.mktemp("data"))
    client = selvedge.Client(url)
    inputs = [{"sample": "photographs", "fibers": {"file": "truth.hair"}, "photographs": photographs[:9] + photographs[16:20]},
              {"sample": "table", "fibers": {"file": "cloth.hair"}, "measurements": {"file": "rows.csv"}}]
    jobs = [client.submit({**document, "fit": fit}, str(folder)) for document in inputs]
    for job in jobs:
        job.wait()
    yield url, *jobs
    stop_daemon(process)


def linear(url, job, path):
    with urllib.request.urlopen(f"{url}/v1/jobs/{job.id}/results/{path}") as answer:
        return read_exr(answer.read(), "filtered." if path.startswith("renderings/") else "")  # what the page shows


def srgb(x):
    x = min(1, max(0, x))
    return 255 * (12.92 * x if x <= 0.0031308 else 1.055 * x ** (1 / 2.4) - 0.055)


def factor(text):
    return float(text.split("×")[1].split()[0].rstrip("."))


def drawn(browser, selector, x, y):
    return browser.execute_script("""const c = document.querySelector(arguments[0]);
        return [...c.getContext('2d').getImageData(arguments[1], arguments[2], 1, 1).data].slice(0, 3)""", selector, x, y)


def press(browser, *keys):
    browser.execute_script("document.querySelector('#pair-viewer .window').focus()")
    ActionChains(browser).send_keys(*keys).perform()


def values(text):
    return [float(t) for t in text.split(")")[1].split()]


def near(a, b, share=2e-3):
    return all(abs(x - y) <= share * abs(y) + 1e-6 for x, y in zip(a, b))


def percentile(picture):
    w, h, pixel = picture
    peaks = sorted(max(pixel(x, y)) for y in range(h) for x in range(w))
    return peaks[math.floor(0.98 * (len(peaks) - 1))]


def open_page(browser, url, job):
    browser.get(f"{url}/#{job.id}/pictures")
    wait_for(browser, "document.querySelector('#pairs')")
    browser.execute_script("document.querySelector('#pairs .gallery').scrollIntoView()")


def test_exposures_of_the_gallery(fitted, browser):
    """Automatic exposure keeps each pair below white; without it all have that of the PNG files; the slider multiplies."""
    url, job, _ = fitted
    rows, result = job.result().raw["rows"], job.result().raw
    open_page(browser, url, job)
    wait_for(browser, "[...document.querySelectorAll('.pair .row:last-child')].some((e) => e.textContent.includes('×'))")
    browser.execute_script("for (const p of document.querySelectorAll('.pair')) p.scrollIntoView()")
    wait_for(browser, "[...document.querySelectorAll('.pair .row:last-child')].every((e) => e.textContent.includes('×'))")
    own = [factor(t) for t in texts(browser, ".pair .row:last-child")]
    for row, exposure in zip(rows, own):
        pictures = [linear(url, job, p) for p in (row["photograph_png"].replace(".png", ".exr"), row["rendering_exr"])]
        assert abs(exposure * max(percentile(p) for p in pictures) / 0.8 - 1) < 0.01, row["name"]
    assert max(own) > 1.5 * min(own), "this sample has photographs of one brightness only"
    click_on(browser, "#exposure-automatic")
    shared = [factor(t) for t in texts(browser, ".pair .row:last-child")]
    assert len(set(shared)) == 1 and abs(shared[0] / result["png_exposure"] - 1) < 0.01
    assert "for all pairs" in text_of(browser, "#exposure-words")
    browser.execute_script("const s = document.querySelector('#exposure-stops'); s.value = -2; s.dispatchEvent(new Event('input'))")
    assert abs(factor(texts(browser, ".pair .row:last-child")[3]) / result["png_exposure"] - 0.25) < 0.01
    w, h, pixel = linear(url, job, rows[3]["photograph_png"].replace(".png", ".exr"))
    for x, y in ((0, 0), (w - 1, h // 2), (5, h - 1)):
        wanted = [srgb(v * result["png_exposure"] / 4) for v in pixel(x, y)]
        assert all(abs(a - b) <= 2.5 for a, b in zip(drawn(browser, ".pair:nth-child(4) canvas", x, y), wanted))
    assert complaints(browser) == []


def test_bars_lead_to_pairs(fitted, browser):
    url, job, _ = fitted
    rows = job.result().raw["rows"]
    browser.get(f"{url}/#{job.id}/rows")
    wait_for(browser, "document.querySelectorAll('#residuals li').length")
    bars = texts(browser, "#residuals li")
    hidden = [row["rel_error"] < 2 * row["rel_error_se"] for row in rows]
    assert len(bars) == len(rows) and all(row["name"] in bar and ("below " in bar if low else f"{100 * row['rel_error']:.1f} ±" in bar)
                                          for row, bar, low in zip(rows, bars, hidden)), bars
    assert all(("brighter" in bar) == (sum(row["rendered"]) > sum(row["measured"])) for row, bar in zip(rows, bars))
    browser.execute_script("const s = document.querySelector('#residual-order'); s.value = 'error'; s.dispatchEvent(new Event('change'))")
    worst = sorted(rows, key=lambda r: -r["rel_error"])
    assert [t.split()[0] for t in texts(browser, "#residuals .name")] == [r["name"] for r in worst]
    click_on(browser, "#residuals button", 1)
    wait_for(browser, f"document.querySelector('#pair-title')?.textContent.startsWith('{worst[1]['name']}')")
    wait_for(browser, "document.querySelector('#pair-readout').textContent.includes('measured')")
    keep(browser, "pairs")
    press(browser, Keys.PAGE_DOWN)
    after = rows[(rows.index(worst[1]) + 1) % len(rows)]["name"]
    wait_for(browser, f"document.querySelector('#pair-title').textContent.startsWith('{after}')")
    press(browser, Keys.ESCAPE)
    assert browser.execute_script("return document.querySelector('#pair-viewer').hidden")
    # Back leads to the rows, in the order that was chosen
    browser.back()
    wait_for(browser, "document.querySelector('#residuals')")
    assert browser.execute_script("return document.querySelector('#residual-order').value") == "error"
    assert complaints(browser) == []


def test_zoom_pan_and_readout(fitted, browser):
    """The readout gives the file's values at the place under the pointer, also after wheel, drag and keys."""
    url, job, _ = fitted
    row = job.result().raw["rows"][0]
    measured, rendered = (linear(url, job, p) for p in (row["photograph_png"].replace(".png", ".exr"), row["rendering_exr"]))
    open_page(browser, url, job)
    click_on(browser, ".pair button")
    wait_for(browser, "document.querySelector('#pair-readout').textContent.includes('measured')")
    canvas = browser.find_element(By.CSS_SELECTOR, "#pair-viewer canvas")
    edge = canvas.size["width"]

    def check(x, y, where):
        """The readout is that of the picture's place x, y of 0..1."""
        a, b, apart, words = texts(browser, "#pair-readout span")
        for picture, text in ((measured, a), (rendered, b)):
            w, h, pixel = picture
            u, v = min(w - 1, int(x * w)), min(h - 1, int(y * h))
            assert f"({u}, {v})" in text and near(values(text), pixel(u, v)), (text, u, v, pixel(u, v))
        assert where in words
        if sum(values(a)) == 0:  # a pixel that no path has lit
            assert apart == ""
            return
        ratio = sum(values(b)) / sum(values(a)) - 1
        assert abs(float(apart.replace("−", "-").split()[0]) - 100 * ratio) < 0.1 + 0.002 * abs(100 * ratio)

    check(0.5, 0.5, "in the middle")
    # a quarter from the left and a tenth from the top; offsets are from the middle
    ActionChains(browser).move_to_element_with_offset(canvas, int(-0.25 * edge) + 2, int(-0.4 * edge) + 2).perform()
    check(0.25 + 2 / edge, 0.1 + 2 / edge, "under the pointer")
    # the wheel keeps that place under the pointer, and three steps of 1.2 enlarge
    for _ in range(3):
        browser.execute_script("""const c = document.querySelector('#pair-viewer canvas'), b = c.getBoundingClientRect(), e = arguments[0];
            const clientX = b.left + b.width / 2 + e[0], clientY = b.top + b.height / 2 + e[1];
            c.dispatchEvent(new WheelEvent('wheel', { deltaY: -1, cancelable: true, clientX, clientY }))""",
                               [int(-0.25 * edge) + 2, int(-0.4 * edge) + 2])
    ActionChains(browser).move_by_offset(1, 0).perform()
    check(0.25 + 2 / edge, 0.1 + 2 / edge, "under the pointer")
    # both canvases show the same part, so the rendering moved as well
    zoom = 1.2 ** 3
    middle = [place + (0.5 - place) / zoom for place in (0.25 + 2 / edge, 0.1 + 2 / edge)]
    ActionChains(browser).move_to_element(canvas).click_and_hold().move_by_offset(-60, -30).release().perform()
    middle = [middle[0] + 60 / edge / zoom, middle[1] + 30 / edge / zoom]
    browser.execute_script("document.querySelector('#pair-viewer canvas').dispatchEvent(new PointerEvent('pointerleave'))")
    check(*middle, "in the middle")
    keep(browser, "pair-zoomed")
    press(browser, "0")
    press(browser, "+", Keys.ARROW_RIGHT)
    check(0.5 + 0.1 / 1.5, 0.5, "in the middle")
    assert complaints(browser) == []


def test_difference_and_flicker(fitted, browser):
    url, job, _ = fitted
    row = job.result().raw["rows"][0]
    measured, rendered = (linear(url, job, p) for p in (row["photograph_png"].replace(".png", ".exr"), row["rendering_exr"]))
    open_page(browser, url, job)
    click_on(browser, ".pair button")
    wait_for(browser, "document.querySelector('#pair-readout').textContent.includes('measured')")
    press(browser, "d")
    assert texts(browser, "#pair-viewer figure:not([hidden]) figcaption") == ["rendered − measured"]
    keep(browser, "pair-difference")
    browser.execute_script("const s = document.querySelector('#difference-block'); s.value = 16; s.dispatchEvent(new Event('change'))")
    exposure = factor(text_of(browser, "#pair-note"))

    def mean(picture, i, j, n):
        w, h, pixel = picture
        inside = [sum(pixel(x, y)) / 3 for y in range(j * h // n, (j + 1) * h // n) for x in range(i * w // n, (i + 1) * w // n)]
        return sum(inside) / len(inside)
    n = round(min(measured[0], rendered[0]) / 16)
    size = browser.execute_script("const c = document.querySelector('#pair-viewer canvas'); return [c.width, c.height]")
    for i in range(n):
        for j in range(n):
            d = (mean(rendered, i, j, n) - mean(measured, i, j, n)) / (0.5 / exposure)
            end, share = ((200, 80, 0) if d > 0 else (0, 90, 200)), min(1, abs(d))
            got = drawn(browser, "#pair-viewer canvas", int(size[0] * (i + 0.5) / n), int(size[1] * (j + 0.5) / n))
            assert all(abs(g - (255 + share * (e - 255))) <= 3 for g, e in zip(got, end)), (i, j, d, got)
    press(browser, "f")
    seen = "document.querySelector('#pair-viewer figure:not([hidden]) figcaption').textContent"
    for wanted in ("rendered", "measured", "rendered"):
        wait_for(browser, f"{seen} === '{wanted}'", 5)
    assert len(browser.find_elements(By.CSS_SELECTOR, "#pair-viewer figure:not([hidden])")) == 1
    press(browser, "s")
    with sized(browser, 375, 800):
        assert scrolls_sideways(browser) == []
        browser.execute_script("document.querySelector('#pairs').scrollIntoView()")
        keep(browser, "pairs-375", 375, 800)
    assert complaints(browser) == []


def test_rows_without_photographs(fitted, browser):
    """The mean of the row stands for the photograph."""
    url, _, job = fitted
    row = job.result().raw["rows"][1]
    open_page(browser, url, job)
    open_tab(browser, "rows")
    click_on(browser, "#residuals button", 1)
    wait_for(browser, "document.querySelector('#pair-readout')?.textContent.includes('measured')")
    assert texts(browser, "#pair-viewer figcaption") == ["measured (mean of the row)", "rendered"]
    assert near(values(text_of(browser, "#pair-readout span")), row["measured"])
    keep(browser, "pairs-of-a-table")
    press(browser, "d")
    assert browser.execute_script("const c = document.querySelector('#pair-viewer canvas'); return c.width === c.height && c.width > 100")
    assert complaints(browser) == []


READ = """const done = arguments[1];
import("/pairs/exr_reader.js").then(({ readExr }) => {
  const { width, height, rgb } = readExr(Uint8Array.from(atob(arguments[0]), (c) => c.charCodeAt(0)).buffer);
  done([width, height, [...rgb]]);
}).catch((error) => done(error.message));"""


def test_openexr_reader(stub, browser):
    browser.get(stub[0] + "/")
    wait_for(browser, "document.querySelector('#jobs, .hint')")

    def read(data):
        return browser.execute_async_script(READ, base64.b64encode(data).decode())
    good = exr(3, 2, lambda x, y: (x + 0.5, y + 0.25, -1e-6))
    assert read(good) == [3, 2, pytest.approx([v for y in range(2) for x in range(3) for v in (x + 0.5, y + 0.25, -1e-6)])]
    assert read(b"\x89PNG" + good) == "it is no OpenEXR file"
    assert read(good[:5] + b"\x02" + good[6:]) == "it has tiles, parts or deep pixels"
    at = good.index(b"compression\0compression\0") + len("compression compression ") + 4
    assert read(good[:at] + b"\x03" + good[at + 1:]) == "it is compressed"
    assert all(read(good[:n]) in ("it is cut off",) or "cut off" in read(good[:n]) for n in (4, 40, 200, len(good) - 1))
    assert "instead of R, G, B" in read(good.replace(b"G\0\x02", b"Y\0\x02", 1))
    assert read(good.replace(b"G\0\x02", b"G\0\x01", 1)) == "its channel G has no 32-bit floats"
    window = good.index(b"dataWindow\0box2i\0") + len("dataWindow box2i ") + 4
    assert read(good[:window + 8] + b"\xff\xff\xff\x7f" * 2 + good[window + 16:]).startswith("it has 2147483648 x")
