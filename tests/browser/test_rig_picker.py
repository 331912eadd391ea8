"""The views of a rig in the form for a new job."""
import json

import pytest

pytest.importorskip("selenium.webdriver", reason="python3-selenium is not installed")
import selvedge  # noqa: E402
from browser_page import click_on, complaints, keep, sized, text_of, texts, wait_for  # noqa: E402
from selenium.webdriver.common.by import By  # noqa: E402

RIG = {"selvedge_rig": 1, "lamps": {"low": {"theta_deg": 60, "phi_deg": 0}, "high": {"theta_deg": 20, "phi_deg": 0}},
       "cameras": {"top": {"theta_deg": 0, "phi_deg": 0}},
       "views": {"v01": {"lamp": "low", "camera": "top", "cloth_rotation_deg": 90}, "v02": {"lamp": "high", "camera": "top"}}}
ANGLES = {"light_theta_deg": 20, "light_phi_deg": 0, "camera_theta_deg": 45, "camera_phi_deg": 180, "cloth_rotation_deg": 30}


def choose_files(browser, *paths):
    chooser = browser.find_element(By.CSS_SELECTOR, ".drop input:not([webkitdirectory])")
    browser.execute_script("arguments[0].style.display = 'block'", chooser)
    chooser.send_keys("\n".join(map(str, paths)))


def pick(browser, i, view):
    browser.execute_script("""const s = document.querySelector(`#rig-picker select[data-photograph='${arguments[0]}']`);
        s.focus(); s.value = arguments[1]; s.dispatchEvent(new Event('change'))""", i, view)


def test_views_of_a_rig_are_picked(stub, browser, tmp_path):
    url, _ = stub
    document = {"sample": "with a rig", "fibers": {"file": "cloth.hair"},
                "photographs": [{"file": f"p{i}.exr", "set": "fit", **ANGLES} for i in range(2)] + [{"file": "p2.exr", "set": "fit", "view": "v09"}],
                "rig": {"file": "bench.json"}}
    (tmp_path / "job.json").write_text(json.dumps(document))
    (tmp_path / "bench.json").write_text(json.dumps(RIG))
    for name in ("cloth.hair", "p0.exr", "p1.exr", "p2.exr"):
        (tmp_path / name).write_bytes(b"bytes of " + name.encode())
    browser.get(url + "/#new")
    wait_for(browser, "document.querySelector('#rig-picker')")
    assert browser.execute_script("return document.querySelector('#rig-picker').hidden")
    # the rig comes before and after the document, and is not taken for one
    choose_files(browser, tmp_path / "bench.json")
    wait_for(browser, "document.querySelector('#rig-picker').textContent.includes('2 views')")
    choose_files(browser, tmp_path / "job.json")
    wait_for(browser, "document.querySelectorAll('#rig-picker select').length === 3")
    assert json.loads(browser.execute_script("return document.querySelector('#document').textContent"))["sample"] == "with a rig"
    rows = texts(browser, "#rig-picker tbody tr")
    assert "no such view" in rows[2] and "no such view" not in rows[0]
    assert "v01: lamp low, camera top, cloth turned 90°" in text_of(browser, "#rig-picker select")
    # the driver adds to the files that were chosen before, the document too: so all others come before the views
    choose_files(browser, *[tmp_path / name for name in ("cloth.hair", "p0.exr", "p1.exr", "p2.exr")])
    wait_for(browser, "!document.querySelector('#send').disabled")
    pick(browser, 0, "v01")
    pick(browser, 1, "v02")
    pick(browser, 2, "v01")
    assert browser.execute_script("return document.activeElement.dataset.photograph") == "2"  # the focus stays
    assert "no such view" not in text_of(browser, "#rig-picker")
    with sized(browser, 375, 812):
        assert browser.execute_script("""return ['#rig-picker', '#rig-picker .scroll'].every((s) => {
            const n = document.querySelector(s); return n.scrollWidth <= n.clientWidth; })""")
        keep(browser, "rig-phone", 375, 812)
    wait_for(browser, "!document.querySelector('#send').disabled")
    keep(browser, "rig-picker")
    click_on(browser, "#send")
    wait_for(browser, "document.querySelector('.state.succeeded')", 60)
    job = selvedge.Client(url).job(browser.execute_script("return location.hash.slice(1)"))
    stored = job.document()
    assert stored["photographs"][0] == {"file": "p0.exr", "set": "fit", "view": "v01"}
    assert stored["photographs"][1] == {"file": "p1.exr", "set": "fit", "view": "v02", "cloth_rotation_deg": 30}
    assert {f["name"]: f["role"] for f in job.state().raw["files"]}["bench.json"] == "rig"
    # a copy knows the rig of its origin
    browser.get(f"{url}/#new?copy={job.id}")
    browser.refresh()
    wait_for(browser, "document.querySelectorAll('#rig-picker select').length === 3")
    assert browser.execute_script("return [...document.querySelectorAll('#rig-picker select')].map((s) => s.value)") == ["v01", "v02", "v01"]
    assert complaints(browser) == []
