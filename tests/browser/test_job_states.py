"""The page of a job with a stub worker: failed and unknown jobs, a long log, and a hidden page."""
import glob
import os
import time

import pytest

pytest.importorskip("selenium.webdriver", reason="python3-selenium is not installed")
import selvedge  # noqa: E402
from browser_page import complaints, keep, submit, text_of, wait_for  # noqa: E402
from selenium.webdriver.common.by import By  # noqa: E402


def test_failed_job_and_hostile_name(stub, browser):
    url, folder = stub
    job, _ = submit(url, folder, "failing <img src=x onerror=alert(1)>")
    with pytest.raises(selvedge.JobFailed):
        job.wait()
    browser.get(f"{url}/#{job.id}")
    wait_for(browser, "document.querySelector('.note.bad')")
    assert "volume.files" in text_of(browser, ".note.bad")
    assert text_of(browser, "h1") == "failing <img src=x onerror=alert(1)>"
    assert browser.find_elements(By.CSS_SELECTOR, "main img") == []
    assert "Retry from checkpoint" in text_of(browser, "#state")
    keep(browser, "failed")
    assert complaints(browser) == []


def test_unknown_job(stub, browser):
    browser.get(f"{stub[0]}/#00000000-0000-0000-0000-000000000000")
    wait_for(browser, "document.querySelector('#no-job')?.textContent.includes('does not exist')")
    keep(browser, "no-such-job")
    asked = "return performance.getEntriesByType('resource').filter((e) => e.name.includes('/v1/jobs/')).length"
    before = browser.execute_script(asked)
    time.sleep(3)
    assert browser.execute_script(asked) == before  # nobody asks again


def test_long_log_does_not_freeze(stub, browser):
    url, folder = stub
    job, _ = submit(url, folder, "chatty twill")
    job.wait()
    log = glob.glob(os.path.join(str(folder), "**", job.id, "log.txt"), recursive=True)
    assert len(log) == 1
    with open(log[0], "a", encoding="utf-8") as f:
        for block in range(200):
            f.write("".join(f"2026-01-01T00:00:00.000Z INFO line {1000 * block + i} of a very long log\n" for i in range(1000)))
    browser.get(f"{url}/#{job.id}/log")
    wait_for(browser, "document.querySelector('pre.log')?.textContent.includes('line 199999 ')")
    with open(log[0], "a", encoding="utf-8") as f:
        f.write("2026-01-01T00:00:00.000Z INFO the end\n")
    wait_for(browser, "document.querySelector('pre.log').textContent.endsWith('the end')", 30)
    assert browser.execute_script("return document.querySelector('pre.log').textContent.split('\\n').length") <= 1000
    # the whole log by ranges
    assert os.path.getsize(log[0]) > 11 << 20
    browser.execute_script("document.querySelector('#whole-log').open = true")
    wait_for(browser, "document.querySelector('#whole-log pre')?.textContent.includes('line 10 ')")
    press = {b.text: b for b in browser.find_elements(By.CSS_SELECTOR, "#whole-log button")}
    browser.execute_script("arguments[0].click()", press["Later"])
    wait_for(browser, "document.querySelector('#whole-log .hint').textContent.startsWith('bytes 262144 to 524288')")
    browser.execute_script("arguments[0].click()", press["Last"])
    wait_for(browser, "document.querySelector('#whole-log pre').textContent.endsWith('the end\\n')")
    assert not press["Later"].is_enabled() and press["Earlier"].is_enabled()
    browser.execute_script("""
        URL.createObjectURL = (blob) => { window.saved = blob.size; return '#'; };
        arguments[0].click();""", press["Save the whole log"])
    wait_for(browser, f"window.saved === {os.path.getsize(log[0])}")
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
