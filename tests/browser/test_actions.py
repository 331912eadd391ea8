"""The tab of a finished job that makes pictures, exports and links of it, and the page behind a link, with the real worker."""
import pytest

pytest.importorskip("selenium.webdriver", reason="python3-selenium is not installed")
import selvedge  # noqa: E402
from axe_rules import axe_source, serious_findings  # noqa: E402
from browser_page import click_on, complaints, keep, scrolls_sideways, sized, start_daemon, stop_daemon, text_of, wait_for  # noqa: E402
from small_cloth import TABLE, hair  # noqa: E402

DOCUMENT = {"sample": "blue twill", "fibers": {"file": "cloth.hair"}, "measurements": {"file": "rows.csv"}, "camera": {"crop_cm": 0.1},
            "fit": {"path_budget": 20000, "render_px": 8, "render_samples": 1, "model": "two_lobe.v1"}}


@pytest.fixture(scope="module")
def lab(tmp_path_factory):
    folder = tmp_path_factory.mktemp("lab")
    (folder / "cloth.hair").write_bytes(hair())
    (folder / "rows.csv").write_text(TABLE)
    process, url = start_daemon(folder / "data", "--set", "jobs.workers=2")
    client = selvedge.Client(url)
    job = client.submit(DOCUMENT, str(folder))
    job.wait()
    yield url, client, job
    stop_daemon(process)


def choose(browser, words):
    found = "[...document.querySelectorAll('.choice, .format')].find((c) => c.textContent.includes(arguments[0]))"
    browser.execute_script(f"{found}.querySelector('input').click()", words)


def looked_at(browser, name, ready):
    """The page of this moment on a phone and on a desk, by axe."""
    axe, found = axe_source(), []
    for width, height, theme in ((375, 800, "dark"), (1280, 720, "light")):
        browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": [{"name": "prefers-color-scheme", "value": theme}]})
        with sized(browser, width, height):
            wait_for(browser, ready, 60)
            if scrolls_sideways(browser):
                found.append(f"{width}: scrolls sideways: {scrolls_sideways(browser)}")
            found += [f"{width} {theme}: {f}" for f in serious_findings(browser, axe)]
            keep(browser, f"{name}-{width}-{theme}", width, height)
    assert not found, "\n".join(found)


def test_a_picture_and_an_export_of_a_finished_job(lab, browser):
    url, client, job = lab
    browser.get(f"{url}/#{job.id}/more")
    wait_for(browser, "document.querySelector('#make-picture') && document.querySelectorAll('.format input').length >= 5")
    choose(browser, "Flat swatch")
    choose(browser, "Low lamp")
    click_on(browser, "#make-picture")
    wait_for(browser, "document.querySelector('.made img')?.naturalWidth === 256", 120)
    (picture,) = [j for j in client.jobs() if "on flat" in j.sample]
    (asked,) = picture.raw["document"]["pictures"] if "document" in picture.raw else client.job(picture.id).document()["pictures"]
    assert (asked["on"], asked["light_theta_deg"], asked["px"]) == ("flat", 72, 256)
    click_on(browser, "#make-export")
    wait_for(browser, "document.querySelector('#actions [role=alert]')?.textContent.includes('Choose a format')")
    choose(browser, "pbrt")
    click_on(browser, "#make-export")
    wait_for(browser, "[...document.querySelectorAll('.made a')].some((a) => a.textContent === 'Files (pbrt)')", 120)
    (made,) = [j.id for j in client.jobs() if j.sample.endswith("for pbrt")]
    said, result = text_of(browser, ".made .export-errors"), client.job(made).result().raw["exports"][0]
    assert said.startswith("pbrt ") and "from this job's renderings over its rows" in said
    assert ("More than 10 %" in said) == (result["row_rel_rms"] > 0.1), (said, result)
    assert browser.execute_script("return document.querySelector('#actions [role=alert]').hidden")
    looked_at(browser, "actions", "document.querySelector('.made img')?.naturalWidth === 256")
    assert complaints(browser) == []


def test_a_link_shows_the_job_until_it_is_revoked(lab, browser):
    url, client, job = lab
    browser.get(f"{url}/#{job.id}/more")
    wait_for(browser, "document.querySelector('#make-share')")
    click_on(browser, "#make-share")
    wait_for(browser, "document.querySelector('.share-made input') && document.querySelector('.shares .revoke')")
    assert "No access tokens are in use" in text_of(browser, ".share-made")
    address = browser.execute_script("return document.querySelector('.share-made input').value")
    assert address.startswith(f"{url}/#share/")
    browser.get("about:blank")
    browser.get(address)
    wait_for(browser, "document.querySelector('#verdict') && document.querySelector('#parameters') && document.querySelector('#files')")
    assert "blue twill" in text_of(browser, "#state") and "valid until" in text_of(browser, "#state")
    seen = browser.execute_script("return [...document.querySelectorAll('button, a.button')].filter((b) => b.offsetParent).map((b) => b.textContent)")
    assert not {"New job", "Batches", "Delete", "Copy with changes", "Make the picture"} & set(seen), seen
    looked_at(browser, "shared", "document.querySelector('#files')")
    assert complaints(browser) == []
    browser.get(f"{url}/#{job.id}/more")
    wait_for(browser, "document.querySelector('.shares .revoke')")
    click_on(browser, ".shares .revoke")
    wait_for(browser, "document.querySelector('.shares') === null")
    browser.get("about:blank")
    browser.get(address)
    wait_for(browser, "document.querySelector('#state h1')?.textContent.includes('nothing any more')")
