"""The browser of all tests of this folder, and a daemon whose worker is a stub."""
import os
import shutil
import sys

import pytest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.dirname(os.path.abspath(__file__))), "support", "python"))
sys.path.insert(0, os.path.join(sys.path[0], "made"))
from browser_page import ROOT, start_daemon, stop_daemon  # noqa: E402

DRIVER = shutil.which("chromedriver") or "/usr/bin/chromedriver"
FLAGS = ["--headless=new", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
         "--disable-component-update", "--disable-sync", "--window-size=1280,900", "--enable-unsafe-swiftshader"]


@pytest.fixture(scope="module")
def stub(tmp_path_factory):
    folder = tmp_path_factory.mktemp("stub")
    process, url = start_daemon(folder, "--worker", os.path.join(ROOT, "tests", "support", "python", "client_stub_worker.py"))
    yield url, folder
    stop_daemon(process)


def start_chromium(profile):
    from selenium import webdriver
    from selenium.webdriver.chrome.service import Service
    options = webdriver.ChromeOptions()
    for flag in [*FLAGS, f"--user-data-dir={profile}"]:
        options.add_argument(flag)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    driver = webdriver.Chrome(service=Service(DRIVER), options=options)
    driver.set_script_timeout(200)
    return driver


@pytest.fixture(scope="session")
def chromium():
    """The running Chromium, by the name "driver"; empty until a test needs it."""
    running = {}
    yield running
    if running:
        running["driver"].quit()


@pytest.fixture
def browser(chromium, tmp_path):
    """A new window without cookies and cache, in the Chromium that all tests of a run share: a start takes two seconds of a
    core. A test that leaves a Chromium that no longer answers takes it along."""
    pytest.importorskip("selenium.webdriver", reason="python3-selenium is not installed")
    from selenium.common.exceptions import WebDriverException
    if not os.path.exists(DRIVER):
        pytest.skip("chromedriver is not installed")
    if not chromium:
        chromium["driver"] = start_chromium(tmp_path / "profile")
    driver = chromium["driver"]
    first = driver.current_window_handle
    driver.switch_to.new_window("window")
    driver.execute_cdp_cmd("Network.clearBrowserCookies", {})
    driver.execute_cdp_cmd("Network.clearBrowserCache", {})
    yield driver
    try:
        driver.get_log("browser")  # what is read here is no complaint of the next test
        driver.close()
        driver.switch_to.window(first)
    except WebDriverException:
        driver.quit()
        chromium.clear()
