"""The pages of batches in a real browser: list, progress, failures with a button that runs them again, results."""
import pytest

pytest.importorskip("selenium.webdriver", reason="python3-selenium is not installed")
import selvedge  # noqa: E402
from browser_page import click_on, complaints, keep, made_batch, scrolls_sideways, sized, text_of, texts, wait_for  # noqa: E402


def test_from_the_list_to_the_results(stub, browser):
    url, folder = stub
    batch = made_batch(url, folder, ["blue twill", "red <b>satin", "failing jersey", "failing knit"], start=False)
    browser.get(url + "/")
    click_on(browser, "#batches-link")
    wait_for(browser, "document.querySelector('#batches tbody a')")
    assert "4 draft" in text_of(browser, "#batches tbody tr")
    click_on(browser, "#batches tbody a")
    wait_for(browser, "document.querySelector('.batch-facts')")
    assert text_of(browser, "h1") == "batch of blue twill" and browser.title == "batch of blue twill – Selvedge"
    assert browser.execute_script("return document.querySelector('#failures').classList.contains('hidden')")
    click_on(browser, ".batch-actions button", 0)
    wait_for(browser, "document.querySelector('.batch-said')?.textContent === '4 jobs started'")
    wait_for(browser, "document.querySelector('.batch-facts').textContent.includes('2 succeeded, 2 failed')", 60)
    wait_for(browser, "document.querySelectorAll('.batch-failures li').length === 1")  # one reason for both
    assert "2 samples: failing jersey, failing knit" in text_of(browser, ".batch-failures li")
    wait_for(browser, "document.querySelectorAll('#batch-table tbody tr').length === 4")
    rows = texts(browser, "#batch-table tbody tr")
    assert "red <b>satin" in rows[1] and "succeeded" in rows[0] and "failed" in rows[2] and "±" in rows[0]
    assert browser.execute_script("return document.querySelectorAll('#batch-table b').length") == 0
    hrefs = browser.execute_script("return [...document.querySelectorAll('#batch-results .batch-actions a')].map((a) => a.getAttribute('href'))")
    assert hrefs == [f"/v1/batches/{batch.id}/results.csv", f"/v1/batches/{batch.id}/results.json"]
    keep(browser, "batch")
    for width, height in ((375, 800), (1280, 720)):
        with sized(browser, width, height):
            assert not scrolls_sideways(browser)
            keep(browser, f"batch-{width}", width, height)
    before = batch.state().failures
    click_on(browser, "#failures button")
    wait_for(browser, "document.querySelector('.batch-said')?.textContent === '2 jobs queued again'")
    batch.wait(60, 0.2)
    client = selvedge.Client(url)
    assert all(client.job(one["job"]).state().raw["attempt"] == 2 for one in before)
    assert complaints(browser) == []


def test_the_jobs_of_a_batch_and_back(stub, browser):
    url, folder = stub
    batch = made_batch(url, folder, ["wool one", "wool two"], start=False)
    browser.get(f"{url}/#batch/{batch.id}")
    wait_for(browser, "document.querySelector('.batch-actions a')")
    click_on(browser, ".batch-actions a")
    wait_for(browser, "document.querySelectorAll('#jobs tbody tr').length === 2")
    assert "Jobs of all batches" in texts(browser, ".filters button")
    job = batch.submitted["samples"][0]["job"]
    browser.get(f"{url}/#{job}")
    wait_for(browser, f"document.querySelector('#record-dates a[href=\"#batch/{batch.id}\"]')")
    assert complaints(browser) == []


def test_no_batch_and_an_unknown_one(stub, browser):
    url, _ = stub
    browser.get(url + "/#batch/00000000-0000-0000-0000-000000000000")
    wait_for(browser, "document.querySelector('#connection').textContent.includes('does not exist')")
