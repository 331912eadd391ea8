"""Fibers in 3D: what is read from a .hair file, and the colours by direction, class, radius and material."""
import base64
import json
import struct

import pytest

pytest.importorskip("selenium.webdriver", reason="python3-selenium is not installed")
import selvedge  # noqa: E402
from browser_page import complaints, keep, start_daemon, stop_daemon, text_of, wait_for  # noqa: E402

AXES = ((1, 0, 0), (0, 1, 0), (0, 0, 1))
FLAT = {"on": "flat", "light_theta_deg": 30, "light_phi_deg": 0, "camera_theta_deg": 30, "camera_phi_deg": 180, "px": 8, "samples": 2, "width_mm": 0.2}


def hair(groups):
    """Three straight fibers of two segments along x, y and z, 0.1 mm long, of radius 5, 10 and 20 um, of groups 0, 1, 2."""
    points = [[0.05 * k * a for a in axis] for axis in AXES for k in range(3)]
    thickness = [2e-3 * r for r in (5, 10, 20) for _ in range(3)]
    rgb = [(7 - g) >> c & 1 for g in (0, 1, 2) for _ in range(3) for c in range(3)]
    words = b"selvedge tile_mm=0.2,0.2" + (b" groups=rgb" if groups else b"")
    head = struct.pack("<4sIIII5f88s", b"HAIR", 3, 9, 1 | 2 | 4 | (16 if groups else 0), 0, 0.01, 0, 1, 1, 1, words)
    floats = [x for p in points for x in p] + thickness + (rgb if groups else [])
    return head + struct.pack("<3H", 2, 2, 2) + struct.pack(f"<{len(floats)}f", *floats)


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    process, url = start_daemon(tmp_path_factory.mktemp("data"))
    yield url
    stop_daemon(process)


@pytest.mark.parametrize("groups", [False, True])
def test_what_is_read_and_how_it_is_coloured(page, browser, groups):
    browser.get(page + "/")
    got = browser.execute_async_script("""
        const done = arguments[arguments.length - 1], bytes = Uint8Array.from(atob(arguments[0]), (c) => c.charCodeAt(0));
        Promise.all([import("/fiber_view.js"), import("/fibers/fiber_colors.js")]).then(([view, colors]) => {
          const h = view.readHair(bytes.buffer), painted = {};
          for (const [name, way] of colors.waysToColour(h)) {
            const made = colors.coloursOf(h, way);
            painted[name] = [Array.from(made.colours), made.legend.filter(Boolean).map((p) => p.textContent ?? p).join("")];
          }
          done({n: h.n, radius: Array.from(h.radius), kind: Array.from(h.kind), group: h.group && Array.from(h.group), painted});
        }, (e) => done(String(e)));""", base64.b64encode(hair(groups)).decode())
    assert got["n"] == 6 and got["kind"] == [0, 0, 1, 1, 2, 2]
    assert got["radius"] == pytest.approx([0.005, 0.005, 0.01, 0.01, 0.02, 0.02], rel=1e-6)
    assert got["group"] == ([0, 0, 1, 1, 2, 2] if groups else None)
    assert set(got["painted"]) == {"direction", "class", "radius"} | ({"material"} if groups else set())
    # the lowest points are shaded by 0.35: red is most for x, blue for y, green for z
    colours, _ = got["painted"]["direction"]
    assert colours[0:3] == pytest.approx([0.35 * v for v in (0.98, 0.76, 0.40)], abs=1e-6)
    assert colours[12:15] == pytest.approx([0.35 * v for v in (0.38, 0.66, 0.93)], abs=1e-6)
    colours, legend = got["painted"]["radius"]
    ends = [sum(colours[6 * s:6 * s + 3]) for s in (0, 2)]
    assert ends[1] > ends[0] and colours[0:3] == pytest.approx([0.35 * v for v in (0.27, 0.06, 0.46)], abs=1e-6), "thicker is brighter"
    assert "5 µm" in legend and "20 µm" in legend
    assert all(name in got["painted"]["class"][1] for name in ("weft", "warp", "through"))


def test_a_broken_file_says_so(page, browser):
    browser.get(page + "/")
    said = browser.execute_async_script("""
        const done = arguments[arguments.length - 1], bytes = Uint8Array.from(atob(arguments[0]), (c) => c.charCodeAt(0));
        import("/fiber_view.js").then((view) => { try { view.readHair(bytes.buffer); done("read"); } catch (e) { done(e.message); } });""",
                                        base64.b64encode(hair(True)[:-4]).decode())
    assert "incomplete" in said


def test_the_reader_chooses_the_colours(page, browser, tmp_path):
    (tmp_path / "cloth.hair").write_bytes(hair(True))
    (tmp_path / "job.json").write_text(json.dumps({
        "sample": "three fibers", "fibers": {"file": "cloth.hair"}, "pictures": [FLAT],
        "fit": {"model": "isotropic.v1", "fixed": {"C": [0.8, 0.5, 0.3]}}}))
    job = selvedge.Client(page).submit(str(tmp_path / "job.json"))
    assert job.wait().state == "succeeded"
    browser.get(f"{page}/#{job.id}/geometry")
    wait_for(browser, "document.querySelector('.view3d button')", 60)
    browser.execute_script("document.querySelector('.view3d button').click()")
    wait_for(browser, "document.querySelector('.view3d canvas') || document.querySelector('.view3d').textContent.includes('not available')")
    if not browser.execute_script("return Boolean(document.querySelector('.view3d canvas'))"):
        pytest.skip("this browser has no WebGL")
    for way, said in (("direction", "y, warp"), ("class", "weft (along x)"), ("radius", "µm")):
        browser.execute_script("""const s = document.querySelector('.fiber-colours select');
            s.value = arguments[0]; s.dispatchEvent(new Event('change'));""", way)
        assert said in text_of(browser, ".fiber-colours .legend")
        keep(browser, f"fibers-by-{way}")
    assert complaints(browser) == []
