"""The viewer of slices on the page of a scan's job: what is drawn are the scan's densities, which go with the shares of
density.vol, and the directions of direction.vol, across all axes; wheel, keys and fingers; fibers found and filled in, there and in 3D."""
import json
import math
import statistics
import struct
import urllib.request

import pytest

pytest.importorskip("selenium.webdriver", reason="python3-selenium is not installed")
import selvedge  # noqa: E402
from browser_page import complaints, keep, scrolls_sideways, sized, small_weave, start_daemon, stop_daemon, text_of, wait_for  # noqa: E402
from selenium.webdriver.common.action_chains import ActionChains  # noqa: E402
from selenium.webdriver.common.by import By  # noqa: E402
from selenium.webdriver.common.keys import Keys  # noqa: E402

SHOWN = "document.querySelector('canvas.slice')?.dataset.shown"


@pytest.fixture(scope="module")
def scanned(tmp_path_factory):
    """A job that ends with the geometry, of a plain weave whose weft is thicker than its warp."""
    folder = tmp_path_factory.mktemp("scan")
    small_weave(folder, diameter="7,6,6")
    (folder / "job.json").write_text(json.dumps({"sample": "scanned weave", "volume": {"files": ["scan.tif"], "voxel_size_um": 2.0}}))
    process, url = start_daemon(tmp_path_factory.mktemp("data"))
    job = selvedge.Client(url).submit(str(folder / "job.json"))
    assert job.wait().state == "succeeded"
    yield url, job
    stop_daemon(process)


def result(url, job, path):
    with urllib.request.urlopen(f"{url}/v1/jobs/{job.id}/results/{path}") as answer:
        return answer.read()


def volume(data):
    """{n, at(x, y, z)} of a .vol file with bytes."""
    n, channels = struct.unpack("<3i", data[8:20]), {3: 1, 4: 2}[struct.unpack("<i", data[4:8])[0]]
    return n, lambda x, y, z: data[48 + channels * ((z * n[1] + y) * n[0] + x):][:channels]


def open_page(browser, url, job):
    browser.get(f"{url}/#{job.id}/geometry")
    wait_for(browser, "document.querySelector('canvas.slice')")
    browser.execute_script("document.querySelector('canvas.slice').scrollIntoView({block: 'center'})")
    wait_for(browser, SHOWN)


def press(browser, *keys):
    browser.execute_script("document.querySelector('canvas.slice').focus({preventScroll: true})")
    ActionChains(browser).send_keys(*keys).perform()


def pixel(browser, size, u, v):
    """The colour in the middle of a voxel of the whole slice of this size; v points up."""
    return browser.execute_script("""const c = document.querySelector('canvas.slice'), [w, h, u, v] = arguments, s = Math.min(c.width / w, c.height / h);
        const x = c.width / 2 + (u + 0.5 - w / 2) * s, y = c.height / 2 - (v + 0.5 - h / 2) * s;
        return [...c.getContext('2d').getImageData(Math.floor(x), Math.floor(y), 1, 1).data].slice(0, 3)""", *size, u, v)


@pytest.mark.parametrize("axis", "xyz")
def test_what_is_drawn(scanned, browser, axis):
    """Densities go with density.vol place by place (the scan has noise and blur besides); directions have the colours of
    their axes, and only where the job has kept a direction."""
    url, job = scanned
    n, direction = volume(result(url, job, "direction.vol"))
    density = volume(result(url, job, "density.vol"))[1]
    a = "xyz".index(axis)
    u, v = (1 if a == 0 else 0), (1 if a == 2 else 2)
    open_page(browser, url, job)
    browser.execute_script("for (const id of ['slice-centers', 'slice-fibers']) { const b = document.getElementById(id); if (b.checked) b.click(); }")
    press(browser, axis)
    wait_for(browser, f"{SHOWN}?.startsWith('{axis} ')")
    assert browser.execute_script(f"return {SHOWN}") == f"{axis} {n[a] // 2} 0 density"
    press(browser, Keys.PAGE_UP)
    wait_for(browser, f"{SHOWN} === '{axis} {n[a] // 2 + 1} 0 density'")
    seen, share = {}, {}
    for colours in ("density", "direction"):
        if colours == "direction":
            press(browser, "d")
        wait_for(browser, f"{SHOWN} === '{axis} {n[a] // 2 + 1} 0 {colours}'")
        for i in range(2, n[u], 5):
            for j in range(2, n[v], 5):
                place = [0, 0, 0]
                place[u], place[v], place[a] = i, j, n[a] // 2 + 1
                got = pixel(browser, (n[u], n[v]), i, j)
                if colours == "density":
                    assert got[0] == got[1] == got[2], (place, got)
                    seen[i, j], share[i, j] = got[0], density(*place)[0]
                elif direction(*place)[0] == 255:
                    assert got[0] == got[1] == got[2] <= 0.45 * seen[i, j] + 2, (place, got)
                else:
                    assert max(got) - min(got) > 15, (place, got)
                    theta, phi = (x * s for x, s in zip(direction(*place), (3.14159265 / 255, 2 * 3.14159265 / 255)))
                    along = [(phi_part * sine) ** 2 for phi_part, sine in ((math.cos(phi), math.sin(theta)), (math.sin(phi), math.sin(theta)))]
                    if along[0] > 0.8:
                        assert got[0] > got[2] + 20, (place, got)
                    if along[1] > 0.8:
                        assert got[2] > got[0] + 20, (place, got)
    assert max(seen.values()) > 200 and min(seen.values()) < 60
    assert complaints(browser) == []
    # other places correlate by 1 / sqrt(number of places), these by some 0.7 with noise and blur
    assert statistics.correlation(list(seen.values()), list(share.values())) > max(0.5, 4 / math.sqrt(len(seen)))


def test_wheel_keys_zoom_and_readout(scanned, browser):
    url, job = scanned
    n = volume(result(url, job, "density.vol"))[0]
    middle = n[2] // 2
    open_page(browser, url, job)
    wheel = """const c = document.querySelector('canvas.slice'), b = c.getBoundingClientRect();
        c.dispatchEvent(new WheelEvent('wheel', { deltaY: arguments[0], ctrlKey: arguments[1], cancelable: true,
          clientX: b.left + b.width / 2, clientY: b.top + b.height / 2 }))"""
    at = "Number(document.querySelector('#slice-at').value)"
    for _ in range(3):
        browser.execute_script(wheel, 120, False)
    wait_for(browser, f"{SHOWN}.startsWith('z {middle + 3} ')")  # 360 units, 100 a slice
    assert f"{middle + 4} of {n[2]}" in text_of(browser, "#slices output") and browser.execute_script(f"return {at}") == middle + 3
    press(browser, Keys.PAGE_DOWN, Keys.HOME)
    wait_for(browser, f"{SHOWN}.startsWith('z 0 ')")
    ActionChains(browser).key_down(Keys.SHIFT).send_keys(Keys.PAGE_UP).key_up(Keys.SHIFT).perform()
    wait_for(browser, f"{SHOWN}.startsWith('z 10 ')")
    press(browser, Keys.END)
    wait_for(browser, f"{SHOWN}.startsWith('z {n[2] - 1} ')")
    canvas = browser.find_element(By.CSS_SELECTOR, "canvas.slice")
    ActionChains(browser).move_to_element(canvas).perform()
    wait_for(browser, "document.querySelector('#slice-readout').textContent.includes('density')")
    said = text_of(browser, "#slice-readout")
    x, y, z = (int(w) for w in said.split("(")[1].split(")")[0].split(","))
    assert abs(x - n[0] // 2) <= 1 and abs(y - n[1] // 2) <= 1 and z == n[2] - 1, said
    browser.execute_script(wheel, -400, True)
    press(browser, "+", Keys.ARROW_RIGHT)
    ActionChains(browser).move_to_element(canvas).click_and_hold().move_by_offset(60, 0).release().perform()
    keep(browser, "slices-zoomed")
    assert browser.execute_script("return !document.querySelector('canvas.slice').classList.contains('whole')")
    press(browser, "0")
    assert browser.execute_script("return document.querySelector('canvas.slice').classList.contains('whole')")
    assert complaints(browser) == []


def test_centers_and_fibers(scanned, browser):
    """As many fibers cross the middle slices as were traced; both colours are explained, in the slices and in 3D."""
    url, job = scanned
    n = volume(result(url, job, "density.vol"))[0]
    lines = strands(result(url, job, "scan/fibers.hair"))
    contrast = result(url, job, "scan/contrast.u8")
    assert len(contrast) == sum(len(fiber) for fiber in lines) and max(contrast) > 50
    open_page(browser, url, job)
    for axis, a in zip("xyz", range(3)):
        press(browser, axis)
        wait_for(browser, f"{SHOWN}.startsWith('{axis} ')")
        plane = (n[a] // 2 + 0.5) * 2e-3
        crossing = sum((p[a] < plane) != (q[a] < plane) for fiber in lines for p, q in zip(fiber, fiber[1:]))
        wait_for(browser, f"document.querySelector('#slice-readout').textContent.startsWith('{crossing} fibers cross')", 10)
    press(browser, "f")
    wait_for(browser, "document.querySelector('#slice-fibers').checked")
    legend = text_of(browser, "#slices .legend")
    assert "traced fiber that the scan shows" in legend and "filled in" in legend
    keep(browser, "slices-fibers")
    red = """const c = document.querySelector('canvas.slice'), d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;
        let n = 0; for (let i = 0; i < d.length; i += 4) n += d[i] > 180 && d[i + 1] < 130; return n"""
    assert browser.execute_script(red) > 200
    press(browser, "f", "c")
    wait_for(browser, "!document.querySelector('#slice-centers').checked")
    browser.execute_async_script("requestAnimationFrame(() => requestAnimationFrame(() => requestAnimationFrame(arguments[0])))")
    assert browser.execute_script(red) == 0
    browser.execute_script("document.querySelector('.view3d button').click()")
    wait_for(browser, "document.querySelector('.view3d canvas') || document.querySelector('.view3d').textContent.includes('not available')")
    if browser.execute_script("return Boolean(document.querySelector('.view3d canvas'))"):
        browser.execute_script("""const s = document.querySelector('.fiber-colours select');
            s.value = 'found or filled in, as traced'; s.dispatchEvent(new Event('change'))""")
        pieces = [(contrast[i] + contrast[i + 1]) / 2 < 50 for i in starts(lines)]
        words = f"{100 * sum(pieces) / len(pieces):.1f} % of the pieces are filled in"
        wait_for(browser, f"document.querySelector('.fiber-colours .legend').textContent.includes('{words}')")
        keep(browser, "fibers-by-found")
    assert complaints(browser) == []


def strands(data):
    """The points of every strand of a .hair file."""
    n_strand, n_point = struct.unpack("<2I", data[4:12])
    n = struct.unpack(f"<{n_strand}H", data[128:128 + 2 * n_strand])
    xyz = struct.unpack(f"<{3 * n_point}f", data[128 + 2 * n_strand:128 + 2 * n_strand + 12 * n_point])
    points, at, found = [xyz[i:i + 3] for i in range(0, len(xyz), 3)], 0, []
    for segments in n:
        found.append(points[at:at + segments + 1])
        at += segments + 1
    return found


def starts(lines):
    """The first point of every piece of all fibers."""
    at = 0
    for fiber in lines:
        yield from range(at, at + len(fiber) - 1)
        at += len(fiber)


def test_fingers_on_a_phone(scanned, browser):
    url, job = scanned
    n = volume(result(url, job, "density.vol"))[0]
    with sized(browser, 375, 800):
        browser.execute_cdp_cmd("Emulation.setTouchEmulationEnabled", {"enabled": True, "maxTouchPoints": 2})
        open_page(browser, url, job)
        assert scrolls_sideways(browser) == []
        browser.execute_script("document.querySelector('canvas.slice').scrollIntoView({block: 'center'})")
        x, y = browser.execute_script("""const b = document.querySelector('canvas.slice').getBoundingClientRect();
            return [b.left + b.width / 2, b.top + b.height / 2]""")

        def touch(kind, *places):
            browser.execute_cdp_cmd("Input.dispatchTouchEvent", {"type": kind, "touchPoints": [{"x": p[0], "y": p[1], "id": i} for i, p in enumerate(places)]})
        touch("touchStart", (x, y))
        for step in range(1, 6):
            touch("touchMove", (x + 10 * step, y))
        touch("touchEnd")
        wait_for(browser, f"Number(document.querySelector('#slice-at').value) > {n[2] // 2 + 3}")
        touch("touchStart", (x - 20, y), (x + 20, y))
        for step in range(1, 6):
            touch("touchMove", (x - 20 - 12 * step, y), (x + 20 + 12 * step, y))
        touch("touchEnd")
        wait_for(browser, "!document.querySelector('canvas.slice').classList.contains('whole')", 5)
        keep(browser, "slices-375", 375, 800)
        browser.execute_cdp_cmd("Emulation.setTouchEmulationEnabled", {"enabled": False})
    assert complaints(browser) == []


def test_a_broken_file_says_so(scanned, browser):
    """A file that ends too early is named on the card; the rest of the page goes on."""
    url, job = scanned
    browser.execute_cdp_cmd("Network.enable", {})
    browser.execute_cdp_cmd("Network.setBlockedURLs", {"urls": ["*z.slices"]})
    browser.get(f"{url}/#{job.id}/geometry")
    wait_for(browser, "document.querySelector('canvas.slice')")
    browser.execute_script("document.querySelector('canvas.slice').scrollIntoView()")
    wait_for(browser, "document.querySelector('#slices .fault').textContent")
    browser.execute_cdp_cmd("Network.setBlockedURLs", {"urls": []})
    press(browser, "x")
    wait_for(browser, f"{SHOWN}?.startsWith('x ')")
    wait_for(browser, "!document.querySelector('#slices .fault').textContent")
