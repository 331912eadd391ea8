"""The dashboard of a daemon with access tokens: signing in, seeing the own jobs, and signing out."""
import os
import re
import subprocess

import pytest

pytest.importorskip("selenium.webdriver", reason="python3-selenium is not installed")
import selvedge  # noqa: E402
from browser_page import BIN, click_on, keep, text_of, wait_for  # noqa: E402
from selenium.webdriver.common.by import By  # noqa: E402

DOCUMENT = {"sample": "of ann", "volume": {"files": ["scan.tif"], "voxel_size_um": 2.0}, "measurements": {"file": "rows.csv"}}


def test_signing_in_and_out(stub, browser):
    url, folder = stub
    made = subprocess.run([os.path.join(BIN, "selvedged"), "--data", str(folder), "--make-token", "root"], capture_output=True, text=True, check=True)
    admin = selvedge.Client(url, token=made.stdout.strip())
    token = {name: admin.request("POST", "/v1/tokens", json_body={"name": name, "scope": "submit"}).json()["token"] for name in ("ann", "bob")}
    selvedge.Client(url, token=token["ann"]).create(DOCUMENT)
    selvedge.Client(url, token=token["bob"]).create({**DOCUMENT, "sample": "of bob"})

    browser.get(url + "/")
    wait_for(browser, "document.querySelector('#sign-in input')")
    keep(browser, "sign_in")
    field = browser.find_element(By.CSS_SELECTOR, "#sign-in input")
    assert field.get_attribute("type") == "password"
    field.send_keys("selvedge_wrong\n")
    wait_for(browser, "document.querySelector('.fault').textContent.includes('unknown or was revoked')")
    field.clear()
    field.send_keys(token["ann"] + "\n")
    wait_for(browser, "document.querySelector('#jobs tbody tr')")
    wait_for(browser, "document.getElementById('user').textContent.includes('ann')")
    keep(browser, "signed_in")
    text = text_of(browser, "#jobs")
    assert "of ann" in text and "of bob" not in text
    # no script of a page can read what stands for the token: there are places in pages, and nothing else
    stored = browser.execute_script("return [document.cookie, ...Object.keys(localStorage), ...Object.entries(sessionStorage).flat()]")
    assert all(text == "" or re.fullmatch(r"selvedge-scroll-\w+|\d+", text) for text in stored), stored
    browser.get(url + "/")
    wait_for(browser, "document.querySelector('#jobs tbody tr')")  # the cookie stays
    admin.request("DELETE", "/v1/tokens/ann")
    wait_for(browser, "document.querySelector('#sign-in input')")  # the next poll is refused
    browser.find_element(By.CSS_SELECTOR, "#sign-in input").send_keys(token["bob"] + "\n")
    wait_for(browser, "document.getElementById('user').textContent.includes('bob')")
    wait_for(browser, "document.querySelector('#jobs tbody tr')")
    assert "of bob" in text_of(browser, "#jobs")
    click_on(browser, "#sign-out")
    wait_for(browser, "document.querySelector('#sign-in input')")
    browser.find_element(By.CSS_SELECTOR, "#sign-in input").send_keys(made.stdout.strip() + "\n")
    wait_for(browser, "document.querySelectorAll('#jobs tbody tr').length === 2")  # an administrator sees whose each job is
    assert text_of(browser, "#jobs").split().count("ann") == 2
    keep(browser, "all_owners")
    click_on(browser, "#sign-out")
    wait_for(browser, "document.querySelector('#sign-in input')")
    assert browser.execute_script("return fetch('/v1/jobs').then((r) => r.status)") == 401
