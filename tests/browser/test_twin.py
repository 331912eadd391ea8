"""The twin under the mouse, from tables whose drawing is known in closed form: on the page of a job, in the file that is
saved from there, and where the browser has no WebGL 2."""
import base64
import io

import pytest

pytest.importorskip("selenium.webdriver", reason="python3-selenium is not installed")
import synthetic_twin  # noqa: E402
from browser_page import click_on, complaints, keep, sized, submit, wait_for  # noqa: E402
from selenium.webdriver.common.action_chains import ActionChains  # noqa: E402
from selenium.webdriver.common.by import By  # noqa: E402
from selenium.webdriver.common.keys import Keys  # noqa: E402

VIEW = {"shape": "flat", "theta": 0, "phi": 0, "lampTheta": 40, "lampPhi": 30, "width": 32, "exposure": 1.5, "environment": "lamp only"}
EDGE = 64


def pixels(browser, **change):
    """Rows of [r, g, b] of a drawing of 64 x 64."""
    script = "return Array.from(document.querySelector('canvas.twin-view').twin.pixels(arguments[0], arguments[1]))"
    flat = browser.execute_script(script, {**VIEW, **change}, EDGE)
    return [[flat[4 * (EDGE * y + x):4 * (EDGE * y + x) + 3] for x in range(EDGE)] for y in range(EDGE)]


def check_drawing(browser, lamp_theta=40):
    """From above, phi 0: to the right is +y, upwards is -x; stripes run along y."""
    seen = pixels(browser, lampTheta=lamp_theta)
    for x, y in ((5, 5), (-5, 5), (5, -9), (-15, 3)):
        column, row = int(EDGE * (0.5 + y / 32)), int(EDGE * (0.5 + x / 32))
        want = synthetic_twin.expected(32 * ((row + 0.5) / EDGE - 0.5), 32 * ((column + 0.5) / EDGE - 0.5), 0, 0, lamp_theta, 30, 1.5)
        assert all(abs(a - b) <= 3 for a, b in zip(seen[row][column], want)), (x, y, seen[row][column], want)


@pytest.fixture
def opened(stub, browser, request):
    url, folder = stub
    job = submit(url, folder, f"twin {getattr(request, 'param', 'above')} {len(list(folder.iterdir()))}")[0]
    browser.get(f"{url}/#{job.id}")
    wait_for(browser, "document.querySelector('#twin')", 60)
    return browser


def press(browser, name):
    """Presses a button. Small tables open by themselves, so that the button that opens them may be gone."""
    browser.execute_script(f"document.getElementById('{name}')?.click()")


def test_the_twin_is_drawn_as_its_tables_say(opened):
    press(opened, "twin-open")
    wait_for(opened, "document.querySelector('canvas.twin-view')?.twin && document.querySelector('#twin-save')")
    check_drawing(opened)
    middle = pixels(opened, shape="cylinder")
    assert sum(middle[32][32]) > 0 and sum(middle[0][32]) == 0, "the cylinder ends inside of the picture"
    assert sum(pixels(opened, lampTheta=130)[32][32]) == 0, "a cloth over a black sheet lets no light through"
    dark, sky = pixels(opened, lampPower=0)[32][32], pixels(opened, lampPower=0, environment="overcast sky")[32][32]
    assert sum(dark) == 0 and sum(sky) > 100
    # the mouse: drag turns, shift and drag moves the lamp
    canvas = opened.find_element(By.CSS_SELECTOR, "canvas.twin-view")
    value = "return document.querySelector('.twin-controls input').value"  # the lamp's angle from the vertical
    lamp = opened.execute_script(value)
    ActionChains(opened).key_down(Keys.SHIFT).move_to_element(canvas).click_and_hold().move_by_offset(0, 60).release().key_up(Keys.SHIFT).perform()
    assert float(opened.execute_script(value)) > float(lamp) + 10
    keep(opened, "twin")
    assert complaints(opened) == []


@pytest.mark.parametrize("opened", ["both"], indirect=True)
def test_light_comes_through_a_cloth_without_sheet(opened):
    press(opened, "twin-open")
    wait_for(opened, "document.querySelector('canvas.twin-view')?.twin")
    check_drawing(opened)
    check_drawing(opened, 140)
    assert complaints(opened) == []


def linear_mean(rows):
    values = [v / 255 for row in rows for rgb in row for v in rgb]
    return sum(v / 12.92 if v <= 0.04045 else ((v + 0.055) / 1.055) ** 2.4 for v in values) / len(values)


@pytest.mark.parametrize("opened", ["fibers"], indirect=True)
def test_fibers_are_drawn_close_up_with_the_mean_of_the_tables(opened):
    press(opened, "twin-open")
    wait_for(opened, "document.querySelector('canvas.twin-view')?.dataset.drawn === 'whole'")
    check_drawing(opened)
    near = {"width": 8, "center": [5, 5, 0], "exposure": 0.5}
    bare, seen = pixels(opened, **near, fibers=False), pixels(opened, **near)
    # from above, to the right is +y: fibers are upright stripes, each a millimetre of eight pixels
    columns = [sum(seen[row][x][0] for row in range(EDGE)) / EDGE for x in range(EDGE)]
    for k in range(1, 7):
        middle, gap = columns[8 * k + 4], columns[8 * k]
        assert middle > 30 and gap < 0.7 * middle, (k, columns)
    assert linear_mean(seen) == pytest.approx(linear_mean(bare), rel=0.04), "nothing jumps where they fade in"
    # far off, single fibers are not drawn: the drawing is that of the tables, to the byte
    assert pixels(opened, width=90) == pixels(opened, width=90, fibers=False)
    keep(opened, "twin-near")
    assert complaints(opened) == []


BESIDE = """const done = arguments[0];
import("/twin/twin_panel.js").then(async ({ TwinPanel }) => {
  const old = document.querySelector("canvas.twin-view").twin, box = document.createElement("div");
  document.body.append(box);
  const json = async (path) => (await fetch(path)).json(), job = location.hash.slice(1), base = `/v1/jobs/${job}/results/twin/`;
  const buffer = await (await fetch(base + "twin.bin")).arrayBuffer(), address = "/selvedge.svg";
  const photographs = [{ name: "one", address, exposure: 2, theta: 20, phi: 180, lampTheta: 33, lampPhi: 44, width: 10 }];
  const panel = new TwinPanel(box, { description: await json(base + "twin.json"), buffer, photographs, pictures: [], exposure: 1 });
  const selects = box.querySelectorAll("select"), choose = selects[selects.length - 1];
  choose.value = "one";
  choose.dispatchEvent(new Event("change"));
  done([box.querySelector("figure").hidden, box.querySelector("figure img").getAttribute("src"), selects[0].value, box.querySelectorAll("input")[0].value]);
  panel.close();
  old.draw();
}).catch((error) => done(String(error)));"""


def test_a_photograph_brings_its_lamp_and_camera(opened):
    press(opened, "twin-open")
    wait_for(opened, "document.querySelector('canvas.twin-view')?.twin")
    hidden, source, shape, lamp = opened.execute_async_script(BESIDE)
    assert (hidden, source, shape) == (False, "/selvedge.svg", "flat") and float(lamp) == 33
    assert complaints(opened) == []


def test_the_saved_file_shows_the_same_alone(opened, tmp_path):
    press(opened, "twin-open")
    wait_for(opened, "document.querySelector('#twin-save')")
    opened.set_script_timeout(200)
    page = opened.execute_async_script("""const done = arguments[0], make = URL.createObjectURL;
      URL.createObjectURL = (blob) => {
        const r = new FileReader();
        r.onload = () => done(r.result.split(",")[1]);
        r.readAsDataURL(blob);
        URL.createObjectURL = make;
        return "#";
      };
      document.getElementById("twin-save").click();""")
    saved = tmp_path / "twin.html"
    saved.write_bytes(base64.b64decode(page))
    assert saved.stat().st_size < 100000 and b"http://" not in saved.read_bytes() and b"https://" not in saved.read_bytes()
    opened.get(f"file://{saved}")
    wait_for(opened, "document.querySelector('canvas.twin-view')?.twin")
    check_drawing(opened)
    note = opened.find_element(By.ID, "note").text
    assert "shift and drag moves the lamp" in note and "differ from path tracing by" in note, "whoever gets the file has no other page"
    keep(opened, "twin-alone")
    assert complaints(opened) == []


def test_two_twins_have_one_camera_and_one_lamp(stub, browser):
    url, folder = stub
    jobs = [submit(url, folder, f"twin {kind} {len(list(folder.iterdir()))}")[0] for kind in ("above", "fibers")]
    browser.get(f"{url}/#compare/{jobs[0].id},{jobs[1].id}/twins")
    wait_for(browser, "document.querySelectorAll('#compare-twins canvas').length === 2", 60)
    wait_for(browser, "[...document.querySelectorAll('#compare-twins canvas')].every((c) => c.dataset.drawn === 'whole')")
    first, second = browser.find_elements(By.CSS_SELECTOR, "#compare-twins canvas")
    seen = "const t = arguments[0].twin; return [0, 1].map((i) => Array.from(t.pixels({ shape: 'flat', width: 90 }, 16, i)).join())"
    before = browser.execute_script(seen, first)
    assert before[0] == before[1], "the same tables under the same lamp"
    ActionChains(browser).key_down(Keys.SHIFT).move_to_element(second).click_and_hold().move_by_offset(0, 60).release().key_up(Keys.SHIFT).perform()
    after = browser.execute_script(seen, first)
    assert after[0] == after[1] != before[0], "the lamp of both was moved"
    names = browser.execute_script("return [...document.querySelectorAll('#compare-twins figcaption')].map((e) => e.textContent)")
    assert [n[0] for n in names[:2]] == ["A", "B"]
    keep(browser, "twins")
    click_on(browser, ".tab-bar a[data-tab=settings]")
    wait_for(browser, "!document.querySelector('#compare-twins')")
    assert complaints(browser) == []


TURN = """const done = arguments[0], twin = document.querySelector("canvas.twin-view").twin;
twin.show({ shape: "flat", environment: "studio", width: 60 });
twin.turn(96, 12).then((blob) => {
  const r = new FileReader();
  r.onload = () => done(r.result.split(",")[1]);
  r.readAsDataURL(blob);
}).catch((e) => done(`!${e}`));"""


def test_a_turn_is_saved_as_a_file_that_loops(opened):
    image = pytest.importorskip("PIL.Image", reason="python3-pil is not installed")
    press(opened, "twin-open")
    wait_for(opened, "document.querySelector('canvas.twin-view')?.twin")
    opened.set_script_timeout(120)
    said = opened.execute_async_script(TURN)
    assert said[0] != "!", said
    made = image.open(io.BytesIO(base64.b64decode(said)))
    assert (made.format, made.size, made.n_frames, made.info["loop"]) == ("WEBP", (96, 96), 12, 0)
    frames, took = [], []
    for i in range(12):
        made.seek(i)
        frames.append(made.convert("L").tobytes())
        took.append(made.info["duration"])
    assert took == [500] * 12
    steps = [sum(abs(a - b) for a, b in zip(frames[i - 1], frames[i])) for i in range(12)]  # step 0: from the last to the first
    assert min(steps) > 0 and steps[0] <= max(steps[1:]), "it goes on where it ends"
    assert complaints(opened) == []


def test_without_webgl_the_page_says_so(stub, browser):
    url, folder = stub
    job = submit(url, folder, f"twin above {len(list(folder.iterdir()))}")[0]
    script = browser.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": "HTMLCanvasElement.prototype.getContext = () => null"})
    browser.get(f"{url}/#{job.id}")
    wait_for(browser, "document.querySelector('#twin .hint')?.textContent.includes('no WebGL 2')", 60)
    browser.execute_cdp_cmd("Page.removeScriptToEvaluateOnNewDocument", script)
    assert complaints(browser) == []


def test_a_narrow_page_asks_before_it_loads_the_tables(stub, browser):
    url, folder = stub
    job = submit(url, folder, f"twin above {len(list(folder.iterdir()))}")[0]
    with sized(browser, 375, 800):
        browser.get(f"{url}/#{job.id}")
        wait_for(browser, "document.querySelector('#twin-open')", 60)
        asked = "return performance.getEntriesByType('resource').filter((e) => e.name.endsWith('twin.bin')).length"
        assert browser.execute_script(asked) == 0
        press(browser, "twin-open")
        wait_for(browser, "document.querySelector('canvas.twin-view')?.twin")
        assert browser.execute_script(asked) == 1
    assert complaints(browser) == []
