"""How much does a newcomer do from the empty page to a submitted job? Prints figures first_hour.* (headless Chromium, the real daemon and worker).

first_hour.PRESET.actions: clicks and keys, a drop of files and a paste counting as one each, a typed value as its keys.
first_hour.PRESET.seconds: the same at human speed by the keystroke-level model (Card, Moran and Newell 1980): 0.28 s a key,
1.3 s to point and click, 1.35 s of thought before each field or button.

scan_photographs: a scan and 16 photographs whose names tell the angles. unnamed_photographs: the same with names that tell
nothing, the angles pasted from a spreadsheet. table: a scan and a table. no_scanner: the weave and 16 photographs. Every job
passes the daemon's check of its files, and starts. first_hour.example.seconds: from the empty list to the finished example, which must end good.
"""
import json
import os
import shutil
import time

KEY_S, CLICK_S, THOUGHT_S = 0.28, 1.3, 1.35
ANGLES = ("light_theta_deg", "light_phi_deg", "camera_theta_deg", "camera_phi_deg", "cloth_rotation_deg")


def figure(name, value, unit):
    print(json.dumps({"name": f"first_hour.{name}", "value": round(value, 1), "unit": unit, "better": "lower"}), flush=True)


class Newcomer:
    """Does with mouse and keys what a user does, and counts it."""

    def __init__(self, browser, url):
        from selenium.webdriver.common.action_chains import ActionChains
        self.browser, self.actions, self.seconds, self.chain = browser, 0, 0.0, ActionChains
        browser.get(f"{url}/#")
        self.wait("document.querySelector('#new-job')")

    def wait(self, condition):
        from bench_dashboard import wait
        wait(self.browser, condition)

    def click(self, selector):
        element = self.browser.find_element("css selector", selector)
        self.browser.execute_script("arguments[0].scrollIntoView({block: 'center'})", element)
        self.chain(self.browser).move_to_element(element).click().perform()
        self.actions += 1
        self.seconds += CLICK_S + THOUGHT_S

    def keys(self, text):
        for letter in text:
            self.chain(self.browser).send_keys(letter).perform()
        self.actions += len(text)
        self.seconds += KEY_S * len(text)

    def drop(self, paths):
        self.browser.find_element("css selector", ".drop input:not([webkitdirectory])").send_keys("\n".join(paths))
        self.wait(f"document.querySelectorAll('#new-files li').length >= {len(paths)}")
        self.actions += 1
        self.seconds += CLICK_S + THOUGHT_S

    def paste(self, text):
        self.browser.execute_script("""const data = new DataTransfer(); data.setData("text/plain", arguments[0]);
            document.activeElement.dispatchEvent(new ClipboardEvent("paste", {clipboardData: data, bubbles: true, cancelable: true}))""", text)
        self.actions += 2  # the control key and V
        self.seconds += 2 * KEY_S

    def fill(self, question, text):
        from selenium.webdriver.common.keys import Keys
        self.click(f"#ask-{question}")
        if not self.browser.execute_script("return document.activeElement.matches('select')"):
            self.browser.execute_script("document.activeElement.select()")
        self.keys(text)
        self.chain(self.browser).send_keys(Keys.TAB).perform()

    def submit(self):
        self.wait("!document.querySelector('#send').disabled")
        self.click("#send")
        self.wait("location.hash.length > 30 || document.querySelector('#send').textContent.startsWith('Start')")
        if self.browser.execute_script("return location.hash.length < 30"):  # there are warnings
            self.click("#send")
            self.wait("location.hash.length > 30")


def make_sample(folder):
    """A small weave with its scan, 16 photographs named by their angles and by nothing, and a table."""
    from browser_page import small_weave
    photographs = [p for p in small_weave(folder, "--px", "32", "--paths", "512") if p.get("set", "fit") == "fit"]
    named, unnamed = [], []
    for i, p in enumerate(photographs):
        at = [f"{p.get(key, 0):g}" for key in ANGLES]
        named.append(os.path.join(folder, "l{}_{}_c{}_{}_r{}.exr".format(*at)))
        unnamed.append(os.path.join(folder, f"IMG_{4100 + i}.exr"))
        shutil.copy(os.path.join(folder, p["file"]), named[-1])
        shutil.copy(os.path.join(folder, p["file"]), unnamed[-1])
    assert len(set(named)) == 16
    cells = "\n".join("\t".join(f"{p.get(key, 0):g}" for key in ANGLES) for p in photographs)
    with open(os.path.join(folder, "truth.json"), encoding="utf-8") as f:
        means = {row["file"]: row["mean_rgb"] for row in json.load(f)["photographs"]}
    with open(os.path.join(folder, "rows.csv"), "w", encoding="utf-8") as f:
        f.write(f"set,{','.join(ANGLES)},r,g,b\n")
        for p in photographs:
            f.write(",".join(["fit", *(f"{p.get(key, 0):g}" for key in ANGLES), *(f"{v:.6f}" for v in means[p["file"]])]) + "\n")
    return named, unnamed, cells


def answer_voxel(user):
    if user.browser.execute_script("return document.querySelector('#ask-voxel').closest('.missing') !== null"):
        user.fill("voxel", "2.0")


def bench_first_hour(folder, browser, daemon_type):
    folder = os.path.join(folder, "first_hour")
    sample = os.path.join(folder, "sample")
    os.makedirs(sample)
    named, unnamed, cells = make_sample(sample)
    scan, table = os.path.join(sample, "scan.tif"), os.path.join(sample, "rows.csv")
    worker = os.path.join(os.environ["SELVEDGE_BUILD"], "bin", "selvedge-worker")
    with daemon_type(os.path.join(folder, "data"), worker=worker) as daemon:
        def run(name, paths, rest):
            user = Newcomer(browser, daemon.url)
            user.click("#new-job")
            user.wait("document.querySelector('#send')")
            user.drop(paths)
            rest(user)
            user.fill("sample", "blue twill")
            user.submit()
            figure(f"{name}.actions", user.actions, "actions")
            figure(f"{name}.seconds", user.seconds, "s")

        def paste_angles(user):
            answer_voxel(user)
            user.click("#angles tbody input")
            user.paste(cells)

        run("scan_photographs", [scan, *named], answer_voxel)
        run("unnamed_photographs", [scan, *unnamed], paste_angles)
        run("table", [scan, table], answer_voxel)
        run("no_scanner", named, lambda user: user.fill("weave", "pl"))
    bench_example(os.path.join(folder, "example"), browser, daemon_type, worker)


def bench_example(folder, browser, daemon_type, worker):
    """The example behind the button of the empty list, to its end: wall time on this machine."""
    with daemon_type(folder, worker=worker) as daemon:
        user, begin = Newcomer(browser, daemon.url), time.monotonic()
        user.wait("document.querySelector('#example')?.offsetParent")
        user.click("#example")
        user.wait("location.hash.length > 30")
        state = daemon.wait_state(browser.execute_script("return location.hash.slice(1)"), "succeeded", timeout_s=1800)
        assert state["verdict"]["code"].startswith("good"), state["verdict"]
        figure("example.seconds", time.monotonic() - begin, "s")
