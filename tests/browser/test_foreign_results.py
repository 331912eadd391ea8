"""Results and inputs that a worker or another user wrote, opened in the browser of someone who is signed in: they run no script,
and pages with styles and pictures beside them look as they should."""
import os
import subprocess
import time

import pytest

pytest.importorskip("selenium.webdriver", reason="python3-selenium is not installed")
import selvedge  # noqa: E402
from browser_page import BIN, ROOT, start_daemon, stop_daemon, wait_for  # noqa: E402

HOSTILE = os.path.join(ROOT, "tests", "api", "hostile", "hostile_worker.py")
SVG = b'<svg xmlns="http://www.w3.org/2000/svg"><script>fetch("/v1/jobs", {method: "POST", body: "{}"}); document.documentElement.id = "ran"</script></svg>'


@pytest.fixture
def foreign(tmp_path, browser):
    """A signed-in browser, a client, and a job with hostile results and a hostile input."""
    process, url = start_daemon(tmp_path / "data", "--worker", HOSTILE)
    make = [os.path.join(BIN, "selvedged"), "--data", str(tmp_path / "data"), "--make-token", "root"]
    made = subprocess.run(make, capture_output=True, text=True, check=True)
    token = made.stdout.strip()
    client = selvedge.Client(url, token=token)
    (tmp_path / "scan.svg").write_bytes(SVG)
    (tmp_path / "rows.csv").write_text("set,r,g,b\n")
    document = {"sample": "hostile: pages", "volume": {"files": ["scan.svg"], "voxel_size_um": 2.0}, "measurements": {"file": "rows.csv"}}
    job = client.submit(document, str(tmp_path))
    job.wait()
    browser.get(url + "/")
    wait_for(browser, "document.querySelector('#sign-in input')")
    browser.find_element("css selector", "#sign-in input").send_keys(token + "\n")
    wait_for(browser, "document.querySelector('#jobs tbody tr')")
    yield browser, client, f"{url}/v1/jobs/{job.id}"
    stop_daemon(process)


def test_no_script_of_a_result_or_an_input_runs(foreign):
    browser, client, job = foreign
    for path in ("results/evil.svg", "results/evil.html", "results/evil.xhtml", "files/scan.svg"):
        browser.get(f"{job}/{path}")
        time.sleep(0.3)
        assert [j.sample for j in client.jobs()] == ["hostile: pages"], f"{path} has made a job"


def test_a_page_shows_the_style_and_the_pictures_beside_it(foreign):
    browser, _, job = foreign
    browser.get(f"{job}/results/page.html")
    assert browser.find_element("id", "p").value_of_css_property("color") == "rgba(1, 2, 3, 1)"
    assert browser.find_element("id", "i").size == {"width": 30, "height": 20}
    browser.get(f"{job}/results/dot.svg")
    assert browser.find_element("tag name", "rect").is_displayed()
