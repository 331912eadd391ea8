"""The page of a job: the result first, then tabs that stand in the address, of bounded height."""
import math
import os
import shutil

import pytest

pytest.importorskip("selenium.webdriver", reason="python3-selenium is not installed")
import selvedge  # noqa: E402
from browser_page import (  # noqa: E402
    ROOT, click_on, complaints, keep, open_tab, scrolls_sideways, sized, small_weave, start_daemon, stop_daemon, submit, text_of, texts, wait_for)
from selenium.webdriver.common.by import By  # noqa: E402

MOST_PX = 3000  # of the tallest tab, at 1280 pixels
ACTIVE = "document.querySelector('.tab-bar a.active')?.dataset.tab"
NAMES = "return [...document.querySelectorAll('.tab-bar a')].map((a) => a.dataset.tab)"


@pytest.fixture(scope="module")
def fitted(tmp_path_factory):
    """A scan with 44 photographs, fitted with few paths: long tables of files, settings and rows."""
    folder = tmp_path_factory.mktemp("tabs")
    photographs = small_weave(folder, "--px", "24", "--paths", "512")
    names = [p["file"] for p in photographs]
    copies = [dict(p, file=f"again-{k}-{p['file']}") for k in range(2) for p in photographs[:14]]
    for copy in copies:
        (folder / copy["file"]).write_bytes((folder / copy["file"].split("-", 2)[2]).read_bytes())
    document = {"sample": "many rows", "volume": {"files": ["scan.tif"], "voxel_size_um": 2.0}, "photographs": photographs[:18] + copies,
                "fit": {"models": ["two_lobe.v1", "microflake.v1"], "path_budget": 60000, "render_px": 16, "render_samples": 2}}
    assert len(names) >= 18
    process, url = start_daemon(tmp_path_factory.mktemp("data"))
    job = selvedge.Client(url).submit(document, str(folder))
    assert job.wait().state == "succeeded"
    yield url, job, str(folder)
    stop_daemon(process)


def test_the_result_comes_first(fitted, browser):
    url, job, _ = fitted
    browser.get(f"{url}/#{job.id}")
    wait_for(browser, "document.querySelector('#front img')?.naturalWidth > 0")
    verdict = job.result().raw["verdict"]
    assert verdict["text"] in text_of(browser, "#verdict") and len(texts(browser, "#key-numbers > div")) == 4
    top = browser.execute_script("return document.querySelector('#key-numbers').getBoundingClientRect().bottom")
    assert top < 900, "verdict, picture and numbers are seen without scrolling"
    assert "objective" not in text_of(browser, "main").lower()
    words = text_of(browser, "#key-numbers")
    determined = sum(p["determined"] and not p["fixed"] for p in job.result().raw["parameters"])
    assert f"{determined} of {sum(not p['fixed'] for p in job.result().raw['parameters'])}" in words
    keep(browser, "front")
    assert complaints(browser) == []


def test_no_tab_is_tall(fitted, browser):
    """Every tab of a job with 46 rows, at three widths; and the words of the fit's inside are in the log alone."""
    url, job, _ = fitted
    browser.get(f"{url}/#{job.id}")
    wait_for(browser, ACTIVE)
    names = browser.execute_script(NAMES)
    assert names == ["parameters", "pictures", "geometry", "rows", "more", "files", "settings", "log"]
    for name in names:
        open_tab(browser, name)
        for width in (1280, 375):
            with sized(browser, width, 900):
                assert scrolls_sideways(browser) == [], (name, width)
                if width == 1280:
                    tall = browser.execute_script("return document.documentElement.scrollHeight")
                    assert tall <= MOST_PX, f"{name} has {tall} pixels"
                keep(browser, f"tab-{name}-{width}", width, 900)
        said = browser.execute_script("return document.querySelector('main').textContent").lower()
        inside = [said[max(0, said.find(word) - 60):][:140] for word in ("objective", "fresh paths", "left out in turn") if word in said]
        assert name == "log" or inside == [], name
    assert complaints(browser) == []


def test_back_and_scroll_position(fitted, browser):
    url, job, _ = fitted
    browser.get(url + "/")
    wait_for(browser, "document.querySelector('#jobs tbody tr a')")
    click_on(browser, "#jobs tbody tr a")
    wait_for(browser, f"{ACTIVE} === 'parameters'")
    wait_for(browser, "document.querySelector('#parameters')")
    open_tab(browser, "rows")
    assert browser.current_url.endswith(f"#{job.id}/rows")
    browser.execute_script("window.scrollTo(0, 250)")
    wait_for(browser, "window.scrollY === 250")
    browser.execute_async_script("setTimeout(arguments[0], 250)")
    open_tab(browser, "files")
    wait_for(browser, "window.scrollY >= 0")
    browser.back()
    wait_for(browser, f"{ACTIVE} === 'rows' && window.scrollY === 250")
    # a poll in between changes neither the tab nor the place
    browser.execute_script("document.dispatchEvent(new Event('visibilitychange'))")
    browser.execute_async_script("setTimeout(arguments[0], 500)")
    wait_for(browser, f"{ACTIVE} === 'rows' && window.scrollY === 250")
    browser.back()
    wait_for(browser, f"{ACTIVE} === 'parameters'")
    browser.back()
    wait_for(browser, "document.querySelector('#jobs tbody tr')")
    browser.forward()
    browser.forward()
    wait_for(browser, f"{ACTIVE} === 'rows' && window.scrollY === 250")
    # a reload keeps the tab
    browser.refresh()
    wait_for(browser, f"{ACTIVE} === 'rows'")
    assert complaints(browser) == []


def test_two_windows_of_one_job(fitted, browser):
    url, job, _ = fitted
    browser.get(f"{url}/#{job.id}/files")
    wait_for(browser, f"{ACTIVE} === 'files'")
    first = browser.current_window_handle
    browser.switch_to.new_window("tab")
    browser.get(f"{url}/#{job.id}/settings")
    wait_for(browser, f"{ACTIVE} === 'settings'")
    open_tab(browser, "log")
    second = browser.current_window_handle
    browser.switch_to.window(first)
    browser.execute_script("document.dispatchEvent(new Event('visibilitychange'))")
    wait_for(browser, f"{ACTIVE} === 'files' && document.querySelector('#files tr')")
    browser.switch_to.window(second)
    wait_for(browser, f"{ACTIVE} === 'log'")
    browser.close()
    browser.switch_to.window(first)
    assert complaints(browser) == []


def test_only_tabs_with_content(stub, browser):
    url, folder = stub
    job, _ = submit(url, folder, "tabs of a failing one")
    browser.get(f"{url}/#{job.id}")
    wait_for(browser, ACTIVE)
    job.wait()
    wait_for(browser, f"{ACTIVE} === 'parameters'")
    wait_for(browser, "document.querySelector('.state.succeeded')")
    assert browser.execute_script(NAMES) == ["parameters", "more", "files", "settings", "log"], "this stub has no rows, pictures and geometry"
    browser.get(f"{url}/#{job.id}/geometry")
    wait_for(browser, f"{ACTIVE} === 'parameters'")
    failed, _ = submit(url, folder, "failing tabs")
    browser.get(f"{url}/#{failed.id}")
    wait_for(browser, "document.querySelector('.state.failed')")
    wait_for(browser, f"{ACTIVE} === 'log'")
    assert browser.execute_script(NAMES) == ["files", "settings", "log"]
    assert complaints(browser) == []


def test_errors_below_the_noise(stub, browser):
    """An error that noise hides is a bound; others have their standard error."""
    browser.get(stub[0] + "/")
    wait_for(browser, "document.querySelector('#jobs, .hint')")
    read = """const [pairs, done] = arguments;
        import("/page_parts.js").then(({ percentWithError }) => done(pairs.map(([x, se]) => percentWithError(x, se))));"""
    pairs = [[0, 0.009], [0.0002, 0.005], [0.047, 0.001], [0.02, 0.01], [0.0199, 0.01], [0.0123, None], [None, 0.1]]
    assert browser.execute_async_script(read, pairs) == ["below 1.8 %", "below 1.1 %", "4.70 ± 0.10 %", "2.00 ± 1.00 %", "below 4 %", "1.23 %", "–"]


def test_the_glossary(stub, browser):
    browser.get(stub[0] + "/#glossary")
    wait_for(browser, "document.querySelectorAll('#words tr').length >= 20")
    words = texts(browser, "#words tr")
    assert any(w.startswith("verdict") for w in words) and not any("**" in w or "`" in w or "](" in w for w in words)
    assert "Azimuthal width of the transmitted lobe TT." in text_of(browser, "main")
    keep(browser, "glossary")
    assert complaints(browser) == []


def test_a_running_job_shows_what_there_is(fitted, browser):
    """Photographs at once, slices with the traced fibers before the fit has ended; no card is empty."""
    url, first, folder = fitted
    document = first.state().raw["document"]
    document["fit"].update(path_budget=50_000_000, models=["two_lobe.v1"])
    document["photographs"] = [p for p in document["photographs"] if not p["file"].startswith("again")]
    job = selvedge.Client(url).submit(document, folder)
    browser.get(f"{url}/#{job.id}")
    wait_for(browser, f"document.querySelectorAll('#so-far img').length >= 18 && {ACTIVE} === 'pictures'", 60)
    wait_for(browser, "[...document.querySelectorAll('#so-far img')].slice(0, 4).every((i) => i.complete && i.naturalWidth > 0)")
    wait_for(browser, "document.querySelector('#front img')?.naturalWidth > 0")
    assert len(texts(browser, "#so-far .none")) == 18, "nothing is rendered yet"
    open_tab(browser, "geometry")
    wait_for(browser, "document.querySelector('canvas.slice')?.dataset.shown", 60)
    assert job.state().state == "running" and "traced fiber" in text_of(browser, "#slices .legend")
    keep(browser, "running-geometry")
    for name in browser.execute_script(NAMES):
        open_tab(browser, name)
        empty = browser.execute_script("""return [...document.querySelectorAll('main .card')].map((c) => [c, c.querySelector('h2')?.innerText ?? ''])
            .filter(([c, head]) => c.innerText.trim() === head.trim() && !c.querySelector('canvas, img, svg')).map(([, head]) => head)""")
        assert empty == [], name
    job.cancel()
    wait_for(browser, "document.querySelector('.state.cancelled')", 60)
    assert complaints(browser) == []


def test_plots_of_many_jobs(stub, browser):
    """Twelve jobs: a scatter plot of two chosen quantities, and a line for each in parallel coordinates."""
    url, folder = stub
    jobs = [submit(url, folder, f"plotted {i}")[0] for i in range(12)]
    for job in jobs:
        job.wait()
    browser.get(f"{url}/#compare/{','.join(job.id for job in jobs)}/plots")
    wait_for(browser, "document.querySelectorAll('#job-scatter circle').length === 12", 60)
    assert "Tables show the first 8 of these 12 jobs" in text_of(browser, "#compare")
    browser.execute_script("""const s = document.querySelector('#plot-across'), wanted = [...s.options].findIndex((o) => o.text.startsWith('gamma_TT'));
        s.selectedIndex = wanted; s.dispatchEvent(new Event('change'))""")
    labels = browser.execute_script("return [...document.querySelectorAll('#job-scatter text.name')].map((t) => t.textContent)")
    assert labels == ["gamma_TT (degrees)", "error over held-out rows"]
    browser.execute_script("""for (const b of document.querySelectorAll('.choices input'))
        if (!b.checked && b.parentElement.textContent.startsWith('C_R')) b.click()""")
    assert len(browser.find_elements(By.CSS_SELECTOR, "#job-parallel polyline")) == 12
    keep(browser, "plots")
    open_tab(browser, "result")
    wait_for(browser, "document.querySelectorAll('#compare-errors thead th').length === 8")
    browser.back()
    wait_for(browser, "document.querySelector('#plot-across')?.selectedOptions[0].text.startsWith('gamma_TT')")
    assert complaints(browser) == []


def test_a_profile_has_its_plot(fitted, browser, tmp_path):
    """The profile of a fiber that scatters evenly: words and numbers fill the first card, and the plot has measured points."""
    true = 2 * 0.6 / math.pi**2 * math.cos(math.radians(40))
    lines = [f"{theta},{phi},{true * (1 + 0.02 * math.sin(7 * theta + phi)):.6g},{0.02 * true:.4g}"
             for theta in range(10, 51, 10) for phi in range(-20, 201, 20)]
    (tmp_path / "fiber.csv").write_text("theta_o_deg,phi_deg,radiance,radiance_se\n" + "\n".join(lines) + "\n")
    document = {"sample": "wool fiber", "profile": {"file": "fiber.csv", "theta_i_deg": -40, "scale": 2}, "fit": {"models": ["isotropic.v1"]}}
    url = fitted[0]
    job = selvedge.Client(url).submit(document, str(tmp_path))
    assert job.wait().state == "succeeded"
    browser.get(f"{url}/#{job.id}")
    wait_for(browser, "document.querySelectorAll('main svg circle').length >= 11")
    card, words = (browser.execute_script(f"return document.querySelector('{s}').getBoundingClientRect().width") for s in ("#front", "#verdict"))
    assert words > 0.9 * card, "no empty place where other jobs have a picture"
    error = job.result().raw["profile"]["models"][0]["rel_rms"]
    assert f"{100 * error:.2f} %" in text_of(browser, "#key-numbers") and complaints(browser) == []


def test_maps_of_a_turned_fiber(fitted, browser, tmp_path):
    """A profile with azimuths of the light: maps of measured beside fitted in one scale, and the turn of the section."""
    lines = [f"{phi_i},{theta},{phi},{(1 + 0.2 * math.cos(2 * math.radians(phi_i - 50))) * math.exp(-(((theta - 40) / 9) ** 2)):.6g}"
             for phi_i in range(0, 360, 30) for theta in range(30, 51, 5) for phi in range(0, 360, 20)]
    (tmp_path / "fiber.csv").write_text("phi_i_deg,theta_o_deg,phi_deg,radiance\n" + "\n".join(lines) + "\n")
    document = {"sample": "ribbon", "profile": {"file": "fiber.csv", "theta_i_deg": -40}, "fit": {"models": ["textile.v3"]}}
    url = fitted[0]
    job = selvedge.Client(url).submit(document, str(tmp_path))
    assert job.wait().state == "succeeded"
    browser.get(f"{url}/#{job.id}/parameters")
    wait_for(browser, "document.querySelectorAll('#profile-plot svg.map').length === 2")
    labels = browser.execute_script("return [...document.querySelectorAll('#profile-plot svg[aria-label]')].map((s) => s.getAttribute('aria-label'))")
    assert labels[0].startswith("measured, light θi -40°, view θo 40°") and labels[1].startswith("fitted, textile.v3")
    assert labels[2].startswith("colour scale from 0 to 1.")
    assert browser.execute_script("return document.querySelectorAll('#profile-plot svg.map path').length") > 10, "cells of many colours"
    keep(browser, "profile-maps")
    shown = {"theta-phi": "svg.map').length === 2", "polar": "svg.polar polygon').length === 6", "curves": "svg.plot polyline').length === 6"}
    for view, condition in shown.items():
        browser.execute_script(f"document.querySelector('#profile-plot button[data-view=\"{view}\"]').click()")
        wait_for(browser, f"document.querySelectorAll('#profile-plot {condition}")
        keep(browser, f"profile-{view}")
    assert "Turn of the section" in text_of(browser, "#profile-models") and complaints(browser) == []


def test_kinds_of_fibers(fitted, browser, tmp_path):
    scan = os.path.join(os.environ.get("SELVEDGE_DATA") or os.path.join(ROOT, "..", "shared", "data"), "unseen-scans", "two-densities.tif")
    if not os.path.exists(scan):
        pytest.skip("no scan with two densities in SELVEDGE_DATA")
    shutil.copy(scan, tmp_path)
    url = fitted[0]
    job = selvedge.Client(url).submit({"sample": "two densities", "volume": {"files": ["two-densities.tif"], "voxel_size_um": 2.0}}, str(tmp_path))
    assert job.wait().state == "succeeded"
    browser.get(f"{url}/#{job.id}/geometry")
    wait_for(browser, "document.querySelectorAll('#fiber-kinds tbody tr').length === 2")
    rows = browser.execute_script("return [...document.querySelectorAll('#fiber-kinds tr')].map((r) => [...r.cells].map((c) => c.textContent))")
    assert rows[0] == ["Kind", "Density", "Radius", "Fibers", "Share of the length"] and rows[1][1] == "100 %"
    assert 25 <= int(rows[2][1].split()[0]) <= 45  # the light kind has 0.35 of the density
    assert complaints(browser) == []
