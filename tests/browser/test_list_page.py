"""The list of jobs in a real browser: filters, order, pages, live rows, tags and actions on several jobs."""
import pytest

pytest.importorskip("selenium.webdriver", reason="python3-selenium is not installed")
import selvedge  # noqa: E402
from browser_page import click_on, complaints, keep, scrolls_sideways, sized, submit, text_of, texts, wait_for  # noqa: E402
from selenium.webdriver.common.by import By  # noqa: E402

DOCUMENT = {"volume": {"files": ["scan.tif"], "voxel_size_um": 2.0}, "measurements": {"file": "rows.csv"}}
SAMPLES = "return [...document.querySelectorAll('#jobs tbody td.sample a')].map((a) => a.textContent)"


@pytest.fixture(scope="module")
def many(stub):
    """123 drafts, a job that has succeeded and one that has failed."""
    url, folder = stub
    client = selvedge.Client(url)
    for i in range(123):
        client.create({**DOCUMENT, "sample": f"draft {i:03d}"})
    done, failed = submit(url, folder, "blue twill")[0], submit(url, folder, "failing <b>twill")[0]
    done.wait()
    with pytest.raises(selvedge.JobFailed):
        failed.wait()
    return url, client, done, failed


def choose(browser, label, value):
    browser.execute_script("""
        const input = [...document.querySelectorAll('.filters label')].find((l) => l.firstChild.textContent === arguments[0]).querySelector('input, select');
        input.value = arguments[1];
        input.dispatchEvent(new Event(input.type === 'search' ? 'input' : 'change'));""", label, value)


def test_every_job_can_be_found(many, browser):
    url, _, done, failed = many
    browser.get(url + "/")
    wait_for(browser, "document.querySelectorAll('#jobs tbody tr').length === 50")
    seen = browser.execute_script(SAMPLES)
    assert seen[:3] == ["failing <b>twill", "blue twill", "draft 122"]
    for _ in range(2):
        click_on(browser, ".pages button", 1)
        wait_for(browser, f"document.querySelector('#jobs tbody td.sample a')?.textContent === 'draft {124 - len(seen):03d}'")
        seen += browser.execute_script(SAMPLES)
    assert len(seen) == len(set(seen)) == 125
    wait_for(browser, "document.querySelectorAll('.pages button')[1]?.disabled")
    choose(browser, "Sample", "TWILL")
    wait_for(browser, "document.querySelectorAll('#jobs tbody tr').length === 2")
    choose(browser, "State", "failed")
    wait_for(browser, "document.querySelectorAll('#jobs tbody tr').length === 1")
    assert "volume" in text_of(browser, "#jobs td.why") and browser.find_elements(By.CSS_SELECTOR, "#jobs b") == []
    assert "state=failed" in browser.current_url and "sample=TWILL" in browser.current_url
    browser.refresh()  # the address has the filters
    wait_for(browser, "document.querySelectorAll('#jobs tbody tr').length === 1")
    choose(browser, "Sample", "")
    choose(browser, "State", "")
    click_on(browser, "#jobs th button", 0)
    wait_for(browser, "document.querySelector('#jobs tbody td.sample a')?.textContent === 'blue twill'")
    wait_for(browser, "document.querySelector('#jobs th[aria-sort]')?.getAttribute('aria-sort') === 'ascending'")
    wait_for(browser, "document.querySelector('#jobs time')?.title.endsWith(' UTC')")
    assert complaints(browser) == []


def test_rows_change_without_losing_focus_or_scroll(many, browser):
    url, client, done, _ = many
    browser.get(url + "/")
    wait_for(browser, "document.querySelectorAll('#jobs tbody tr').length === 50")
    browser.execute_script("""
        window.held = document.querySelectorAll('#jobs tbody td.sample a')[30];
        held.focus();
        scrollTo(0, 900);""")
    job = client.create({**DOCUMENT, "sample": "a new one"})
    wait_for(browser, "document.querySelector('#jobs tbody td.sample a').textContent === 'a new one'", 5)
    assert browser.execute_script("return document.activeElement === held && scrollY > 500")
    client.request("PUT", f"/v1/jobs/{done.id}/tags", json_body={"tags": ["fresh"]}).json()
    wait_for(browser, "document.querySelector('#jobs .tag.link')?.textContent === 'fresh'", 5)
    browser.execute_script("document.querySelector('#jobs .tag.link').click()")  # the header of the page may cover it
    wait_for(browser, "document.querySelectorAll('#jobs tbody tr').length === 1")
    job.delete()
    client.request("PUT", f"/v1/jobs/{done.id}/tags", json_body={"tags": []}).json()
    wait_for(browser, "document.querySelector('#no-jobs:not(.hidden)')?.textContent.includes('No job fits')", 5)
    # what a poll transfers when one row has changed
    browser.get(url + "/#")
    wait_for(browser, "document.querySelectorAll('#jobs tbody tr').length === 50")
    browser.execute_script("performance.clearResourceTimings()")
    client.request("PUT", f"/v1/jobs/{done.id}/tags", json_body={"tags": ["polled"]}).json()
    wait_for(browser, "document.querySelector('#jobs .tag.link')?.textContent === 'polled'", 5)
    sizes = browser.execute_script("return performance.getEntriesByType('resource').filter((e) => e.name.includes('/v1/jobs?')).map((e) => e.transferSize)")
    assert sizes and max(sizes) < 20000
    client.request("PUT", f"/v1/jobs/{done.id}/tags", json_body={"tags": []}).json()
    assert complaints(browser) == []


def test_many_jobs_at_once(many, browser):
    url, client, done, failed = many
    browser.get(url + "/#?sample=draft%2000")
    wait_for(browser, "document.querySelectorAll('#jobs tbody tr').length === 10")
    for i in range(3):
        click_on(browser, "#jobs tbody input", i)
    assert "3 selected" in text_of(browser, "#bulk")
    browser.find_element(By.CSS_SELECTOR, "#bulk input").send_keys("batch-7\n")
    wait_for(browser, "document.querySelectorAll('#jobs .tag.link').length === 3")
    keep(browser, "list-selected")
    assert {j["tag"]: j["jobs"] for j in client.request("GET", "/v1/tags").json()["tags"]} == {"batch-7": 3}

    def press(text):
        click_on(browser, "#bulk button", next(i for i, t in enumerate(texts(browser, "#bulk button")) if t.startswith(text)))
    press("Cancel")
    wait_for(browser, "document.querySelectorAll('#jobs .state.cancelled').length === 3")
    wait_for(browser, "document.querySelector('#bulk').textContent.includes('3 cancelled')")
    press("Retry")
    wait_for(browser, "document.querySelector('#bulk').textContent.includes('3 refused: cannot start')")
    press("Delete")
    assert len(browser.find_elements(By.CSS_SELECTOR, "#jobs tbody tr")) == 10
    press("Really delete 3")
    wait_for(browser, "document.querySelectorAll('#jobs tbody tr').length === 7")
    assert "3 deleted" in text_of(browser, "#bulk")
    assert complaints(browser) == []


@pytest.mark.parametrize("width, height", [(375, 700), (1280, 720), (1920, 1080)])
def test_list_at_three_sizes(many, browser, width, height):
    url, *_ = many
    with sized(browser, width, height):
        browser.get(url + "/")
        wait_for(browser, "document.querySelectorAll('#jobs tbody tr').length === 50")
        assert scrolls_sideways(browser) == []
        keep(browser, f"list-{width}", width, height)
        assert complaints(browser) == []
