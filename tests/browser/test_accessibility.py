"""Every page in three sizes, light and dark: WCAG 2.1 AA by axe-core without a serious finding, no sideways scroll, no
error on the console; and what the keyboard reaches."""
import functools
import http.server
import json
import threading

import pytest

pytest.importorskip("selenium.webdriver", reason="python3-selenium is not installed")
import selvedge  # noqa: E402
from axe_rules import axe_source, serious_findings  # noqa: E402
from browser_page import complaints, keep, made_batch, scrolls_sideways, sized, small_weave, start_daemon, stop_daemon, submit, wait_for  # noqa: E402
from selenium.webdriver.common.action_chains import ActionChains  # noqa: E402
from selenium.webdriver.common.keys import Keys  # noqa: E402


@pytest.fixture(scope="module")
def axe():
    return axe_source()


@pytest.fixture(scope="module")
def real(tmp_path_factory):
    """A daemon with the real worker, and two finished jobs: a scan with photographs, whose fit has few paths."""
    sample = tmp_path_factory.mktemp("sample")
    photographs = small_weave(sample, "--px", "32", "--paths", "512")
    document = {"sample": "small plain weave", "volume": {"files": ["scan.tif"], "voxel_size_um": 2.0},
                "photographs": photographs[:4] + photographs[16:18],
                "pictures": [{"on": "cylinder", "radius_mm": 1, "width_mm": 3, "px": 16, "samples": 2, "light_theta_deg": 45, "light_phi_deg": 0,
                              "camera_theta_deg": 45, "camera_phi_deg": 180}],
                "fit": {"model": "two_lobe.v1", "path_budget": 50000, "render_px": 24, "render_samples": 4, "texture": {"block_mm": 2.5}}}
    process, url = start_daemon(tmp_path_factory.mktemp("data"))
    jobs = []
    for _ in range(2):
        (sample / "job.json").write_text(json.dumps(document))
        jobs.append(selvedge.Client(url).submit(str(sample / "job.json")))
        document["fit"]["seed"] = 2
    for job in jobs:
        assert job.wait().state == "succeeded"
    yield url, jobs
    stop_daemon(process)


def check(browser, axe, name, ready):
    """Looks at the page of this moment in all sizes. axe sees the phone's, where most is hidden or wraps, and both
    themes in the middle size."""
    found = []
    for width, height, theme in ((375, 800, "dark"), (1280, 720, "light"), (1280, 720, "dark"), (1920, 1080, "light")):
        browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": [{"name": "prefers-color-scheme", "value": theme}]})
        with sized(browser, width, height):
            wait_for(browser, ready, 60)
            where = f"{name}, {width} x {height}, {theme}: "
            if scrolls_sideways(browser):
                found.append(where + f"scrolls sideways: {scrolls_sideways(browser)}")
            if width < 1920:
                found += [where + f for f in serious_findings(browser, axe)]
            keep(browser, f"axe-{name}-{width}-{theme}", width, height)
    assert not found, "\n".join(found)
    assert name == "unknown" or complaints(browser) == []  # of that one the browser itself notes a 404


PAGES = {"finished": ("/#{0}", "document.querySelector('#parameters')"),
         "pictures": ("/#{0}/pictures", "document.querySelector('#pairs') && document.querySelector('#surfaces')"),
         "geometry": ("/#{0}/geometry", "document.querySelector('#quality') && document.querySelector('canvas.slice')"),
         "rows": ("/#{0}/rows", "document.querySelector('#residuals li')"),
         "files": ("/#{0}/files", "document.querySelector('#files tr')"),
         "settings": ("/#{0}/settings", "document.querySelector('#record-settings tr')"),
         "log": ("/#{0}/log", "document.querySelector('pre.log')?.textContent && document.querySelector('#certificate')"),
         "glossary": ("/#glossary", "document.querySelector('#words tr')"),
         "list": ("/", "document.querySelectorAll('#jobs tbody tr').length === 2"),
         "compare": ("/#compare/{0},{1}", "document.querySelector('#compare-errors table')"),
         "compare-rows": ("/#compare/{0},{1}/rows", "document.querySelector('#compare-rows table')"),
         "compare-plots": ("/#compare/{0},{1}/plots", "document.querySelector('#job-scatter svg') && document.querySelector('#job-parallel svg')"),
         "new": ("/#new", "document.querySelector('#send')"),
         "copy": ("/#new?copy={0}", "document.querySelector('#document').textContent.includes('small plain weave')"),
         "unknown": ("/#00000000-0000-0000-0000-000000000000", "document.querySelector('main').textContent.includes('does not exist')"),
         "quality": ("/v1/jobs/{0}/results/quality.html", "document.querySelector('h1')"),
         "report": ("/v1/jobs/{0}/results/report.html", "document.querySelector('h1')")}


@pytest.mark.parametrize("name", PAGES)
def test_pages_of_real_jobs(real, browser, axe, name, tmp_path, request):
    url, jobs = real
    address, ready = PAGES[name]
    address = url + address.format(*(j.id for j in jobs))
    if "/results/" in address:  # the service forbids scripts in results, axe too: it looks at the saved page
        jobs[0].download(str(tmp_path))
        page = next(tmp_path.rglob(f"{name}.html"))
        handler = functools.partial(http.server.SimpleHTTPRequestHandler, directory=str(page.parent))
        server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler)
        threading.Thread(target=server.serve_forever, daemon=True).start()
        request.addfinalizer(server.server_close)
        request.addfinalizer(server.shutdown)
        address = f"http://127.0.0.1:{server.server_port}/{page.name}"
    browser.get(address)
    check(browser, axe, name, ready)


@pytest.mark.parametrize("name, ready", [
    ("slow", "document.querySelector('.state.running') && document.querySelector('.chart canvas')"),
    ("failing", "document.querySelector('.state.failed')"), ("twin above", "document.querySelector('canvas.twin-view')?.twin")])
def test_pages_of_other_jobs(stub, browser, axe, name, ready):
    url, folder = stub
    job = submit(url, folder, f"{name} {len(list(folder.iterdir()))}")[0]
    browser.get(f"{url}/#{job.id}")
    if name.startswith("twin"):
        wait_for(browser, "document.querySelector('#twin')", 60)
        browser.execute_script("document.querySelector('#twin-open')?.click()")
    check(browser, axe, name.split()[0], ready)


def test_page_of_a_new_job_with_files(stub, browser, axe, tmp_path):
    """With its list of files, the questions, the grid of angles, and the form of all options."""
    browser.get(stub[0] + "/#new")
    paths = [tmp_path / name for name in ("scan.tif", "t20_p0.png", "t45_p90.png", "chart.png", "long-name-of-a-picture-that-has-no-angles-at-all.flat.png")]
    for path in paths:
        path.write_bytes(b"bytes of " + path.name.encode())
    browser.find_element("css selector", ".drop input:not([webkitdirectory])").send_keys("\n".join(map(str, paths)))
    wait_for(browser, "document.querySelectorAll('#angles tbody tr').length === 2")
    browser.execute_script("document.querySelector('#editor > summary').click()")
    check(browser, axe, "new-with-files", "document.querySelector('#editor .search') && document.querySelector('#new-files li')")


def test_pages_of_batches(stub, browser, axe):
    url, folder = stub
    batch = made_batch(url, folder, ["axe one", "failing axe"])
    batch.wait(60, 0.2)
    for name, address, ready in (("batches", "/#batches", "document.querySelector('#batches tbody tr')"),
                                 ("batch", f"/#batch/{batch.id}",
                                  "document.querySelector('#batch-table tbody tr') && document.querySelector('.batch-failures li')")):
        browser.get(url + address)
        check(browser, axe, name, ready)


# Tab reaches one radio button of a group; arrow keys choose among them.
FOCUSABLE = """const shown = (e) => e.checkVisibility({visibilityProperty: true}) && e.getClientRects().length > 0;
    return [...document.querySelectorAll("a[href], button, input, select, textarea, summary, [tabindex='0']")]
        .filter((e) => shown(e) && !e.disabled && e.type !== "file" && e.tabIndex >= 0)
        .filter((e, i, all) => e.type !== "radio" || all.find((f) => f.name === e.name) === e)"""


@pytest.mark.parametrize("name", ["list", "finished", "compare", "new"])
def test_the_keyboard_reaches_everything(real, browser, name):
    """Tab goes through all that can be used, and each shows that it has the focus."""
    url, jobs = real
    address, ready = PAGES[name]
    browser.get(url + address.format(*(j.id for j in jobs)))
    wait_for(browser, ready)
    n = browser.execute_script(FOCUSABLE + ".map((e, i) => { e.dataset.wanted = i; return i; }).length")
    assert n > 4
    reached, unseen = set(), []
    for _ in range(2 * n + 20):
        ActionChains(browser).send_keys(Keys.TAB).perform()
        at = browser.execute_script("""const e = document.activeElement, s = getComputedStyle(e);
            return [e.dataset?.wanted ?? null, s.outlineStyle !== "none" && parseFloat(s.outlineWidth) > 0, e.outerHTML.slice(0, 80), e === document.body]""")
        if at[0] in reached and len(reached) == n:
            break
        if not at[1] and not at[3] and at[0] not in reached:  # the parts of a date show by themselves where one is
            unseen.append(at[2])
        if at[0] is not None:
            reached.add(at[0])
    missed = browser.execute_script("return arguments[0].map((i) => document.querySelector(`[data-wanted='${i}']`)?.outerHTML.slice(0, 80))",
                                    [i for i in range(n) if str(i) not in reached])
    assert [m for m in missed if m] == [] and unseen == []
