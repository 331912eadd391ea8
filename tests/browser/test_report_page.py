"""The report as a page that was sent: on a phone, and on a dark screen, where its charts are dark, too."""
import io
import json
import os
import subprocess

import pytest

pytest.importorskip("selenium.webdriver", reason="python3-selenium is not installed")
image = pytest.importorskip("PIL.Image", reason="python3-pil is not installed")
from browser_page import BIN, complaints, scrolls_sideways, sized  # noqa: E402
from small_cloth import TABLE, hair  # noqa: E402


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    """report.html of a small fit to a table."""
    folder = tmp_path_factory.mktemp("report")
    (folder / "input").mkdir()
    (folder / "input" / "cloth.hair").write_bytes(hair())
    (folder / "input" / "rows.csv").write_text(TABLE)
    fit = {"path_budget": 20000, "render_px": 16, "render_samples": 1}
    document = {"sample": "a report", "fibers": {"file": "cloth.hair", "voxel_um": 5}, "measurements": {"file": "rows.csv"}, "fit": fit}
    (folder / "job.json").write_text(json.dumps(document))
    subprocess.run([os.path.join(BIN, "selvedge-worker"), "--quiet", "--threads", "2", str(folder)], check=True)
    return (folder / "results" / "report.html").as_uri()


def mean_level(element):
    """The mean of all channels of what the browser shows of an element, 0 to 255."""
    small = image.open(io.BytesIO(element.screenshot_as_png)).convert("L").resize((1, 1), image.BOX)
    return small.getpixel((0, 0))


@pytest.mark.parametrize("theme, least, most", [("light", 200, 255), ("dark", 0, 70)])
def test_page_and_charts_have_the_theme_of_the_screen(browser, page, theme, least, most):
    browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": [{"name": "prefers-color-scheme", "value": theme}]})
    browser.get(page)
    charts = browser.find_elements("css selector", "svg")
    assert len(charts) >= 4
    for element in [browser.find_element("css selector", "h1"), browser.find_element("css selector", ".numbers"), *charts]:
        assert least <= mean_level(element) <= most, element.get_attribute("outerHTML")[:200]
    text = browser.find_element("css selector", "svg text").value_of_css_property("fill")
    level = sum(int(v) for v in text[4:-1].split(",")) / 3
    assert (level < 110) == (theme == "light"), "labels of charts can be read"
    assert complaints(browser) == []


@pytest.mark.parametrize("theme, least, most", [("light", 200, 255), ("dark", 0, 70)])
def test_the_quality_page_and_its_plots_have_it_too(browser, page, theme, least, most):
    browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": [{"name": "prefers-color-scheme", "value": theme}]})
    browser.get(page.replace("report.html", "quality.html"))
    for element in [browser.find_element("css selector", "h1"), browser.find_element("css selector", "img.plot")]:
        assert least <= mean_level(element) <= most, element.get_attribute("outerHTML")
    assert complaints(browser) == []


def test_a_phone_needs_no_sideways_scrolling(browser, page):
    browser.get(page)
    with sized(browser, 375, 800):
        assert not scrolls_sideways(browser)
        # a table does not scroll by itself either: all of it is within the screen
        assert browser.execute_script("return Math.max(...[...document.querySelectorAll('table')].map((t) => t.getBoundingClientRect().right))") <= 375
