"""Versions of a job's result in a real browser: the card of the job's page, and the comparison of two runs."""
import json

import pytest

pytest.importorskip("selenium.webdriver", reason="python3-selenium is not installed")
import selvedge  # noqa: E402
from browser_page import click_on, complaints, keep, open_tab, sized, submit, text_of, texts, wait_for  # noqa: E402


def test_versions_of_an_edited_job(stub, browser):
    url, folder = stub
    job, _ = submit(url, folder, "run twice")
    job.wait(timeout_s=60)
    browser.get(f"{url}/#{job.id}/files")
    wait_for(browser, "document.querySelector('#files')")
    assert texts(browser, "#versions") == [], "one run has no earlier result"
    job.edit(lambda doc: doc.update(sample="run with coarser voxels", volume={"files": ["scan.tif"], "voxel_size_um": 2.5}))
    wait_for(browser, "document.querySelectorAll('#versions tbody tr').length === 1", 40)
    job.start()
    job.wait(timeout_s=60)
    wait_for(browser, "document.querySelectorAll('#versions tbody tr').length === 2", 40)
    rows = texts(browser, "#versions tbody tr")
    assert rows[0].startswith("1") and rows[1].startswith("2") and "present result" in rows[1] and "present" not in rows[0]
    click_on(browser, "#versions tbody tr:first-child summary")
    wait_for(browser, "document.querySelector('#versions a[href$=\"/versions/1/version.json\"]')")
    keep(browser, "versions")
    with sized(browser, 375, 800):
        wide = browser.execute_script("return [...document.querySelectorAll('#versions, #versions .wide')].map((e) => e.getBoundingClientRect().right)")
        assert max(wide) <= 375, "the card makes the page scroll sideways"
    link = browser.execute_script("return document.querySelector('#versions a[href$=\"/versions/1/version.json\"]').getAttribute('href')")
    about = browser.execute_async_script("fetch(arguments[0]).then((r) => r.text()).then(arguments[1])", link)
    assert json.loads(about)["document"]["volume"]["voxel_size_um"] == 2.0
    click_on(browser, "#versions .hint a")
    wait_for(browser, "document.querySelectorAll('#compare .compared li').length === 2")
    assert "run 1" in texts(browser, "#compare .compared li")[0]
    open_tab(browser, "settings")
    differ = text_of(browser, "#compare-settings")
    assert "volume.voxel_size_um" in differ and "2.5" in differ and "SHA-256" not in differ
    keep(browser, "versions-compared")
    browser.get(f"{url}/#compare/{job.id}@1,{job.id}@9")
    wait_for(browser, "document.querySelector('#compare .note')?.textContent.includes('no such job or version')")
    assert [c for c in complaints(browser) if "404" not in c] == []
    assert selvedge.Client(url).job(job.id).versions()[0].raw["sample"].startswith("run twice")
