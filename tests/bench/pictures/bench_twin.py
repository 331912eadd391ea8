"""How near the twin in the browser comes to the path-traced picture of the same view, and how long a frame takes in software.

    bench_twin.py --build DIR [--keep FOLDER]

A Gabardine cloth (parameters of Table 5.3 of the fabric thesis, a described weave) is rendered by the worker, draped and flat from
close up, and drawn by headless Chromium from the job's own tables, without a graphics card (SwiftShader). Figures, of sRGB bytes of
8 bits:

pictures.browser.ssim: structural similarity (Wang et al. 2004) of the luma of both pictures, windows of 7 x 7 fields; a field is a
mean over 2 x 2 pixels, which takes away a part of the reference's noise.
near_ssim: the same of a view of 1 mm; near_ssim_tables: without the fibers that are drawn close up.
near_mean_rel: difference of the mean radiances with and without these fibers, relative, at a quarter of the exposure, which clips none.
first_ms: from the tap that opens the twin to its first picture, on a page of 390 x 844 pixels with three pixels each and a
processor four times as slow (Chromium's emulation; drawing itself is not slowed), the median of three.
pictures.browser.mean_rel: difference of the mean radiances over the cloth, relative.
pictures.browser.frame_ms: a frame of 512 x 512 pixels. table_rel_rms: error of the table's means up to 70 degrees, without noise.
"""
import argparse
import base64
import http.server
import json
import math
import os
import subprocess
import sys
import tempfile
import threading

ROOT = os.path.abspath(os.path.join(os.path.dirname(__file__), "..", "..", ".."))
sys.path.insert(0, os.path.join(ROOT, "tests", "bench"))
from png_picture import compose, read_png, write_png  # noqa: E402

EDGE, SAMPLES, PATHS, FRAME_EDGE = 96, 128, 600000, 512
FIT = {"model": "two_lobe.v1",
       "fixed": {"C_R": [0.185, 0.047, 0.069], "C_TT": [0.999, 0.330, 0.354], "beta_R": 2.141, "beta_TT": 10, "gamma_TT": 23.548}}
CLOTH = {"draft": ["110", "101", "011"], "tile_warps": 6, "tile_wefts": 6, "cover_warp": 1.1,
         "yarns": [{"fibers": 30, "fiber_radius_um": 16.1, "twist_per_m": 600}]}
VIEW = {"on": "drape", "radius_mm": 10, "size_mm": 40, "width_mm": 36, "light_theta_deg": 50, "light_phi_deg": 200, "camera_theta_deg": 55,
        "camera_phi_deg": 250}
NEAR = {**VIEW, "on": "flat", "width_mm": 1, "camera_theta_deg": 20}
FLAGS = ["--headless=new", "--no-sandbox", "--disable-gpu", "--no-first-run", "--window-size=900,700", "--enable-unsafe-swiftshader"]


def figure(name, value, unit, better):
    print(json.dumps({"name": f"pictures.browser.{name}", "value": value, "unit": unit, "better": better}), flush=True)


def make_job(build, folder):
    os.makedirs(os.path.join(folder, "input"), exist_ok=True)
    document = {"sample": "gabardine, Table 5.3", "cloth": CLOTH, "fit": FIT, "pictures": [{**v, "px": EDGE, "samples": SAMPLES} for v in (VIEW, NEAR)],
                "twin": {"make": True, "paths": PATHS}}
    with open(os.path.join(folder, "job.json"), "w", encoding="utf-8") as f:
        json.dump(document, f)
    subprocess.run([os.path.join(build, "bin", "selvedge-worker"), "--quiet", folder], check=True, stdout=sys.stderr)


def serve(results):
    """The dashboard's folder, and the results under /results/. Returns the address."""
    class Handler(http.server.SimpleHTTPRequestHandler):
        def translate_path(self, path):
            return results + path[8:] if path.startswith("/results/") else os.path.join(ROOT, "clients", "dashboard") + path

        def log_message(self, *_):
            pass
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    return f"http://127.0.0.1:{server.server_port}"


OPEN = """const done = arguments[0];
(async () => {
  document.body.innerHTML = '<div id="t" class="twin"></div>';
  const { TwinPanel } = await import("/twin/twin_panel.js"), json = await (await fetch("/results/twin/twin.json")).json();
  const buffer = await (await fetch("/results/twin/twin.bin")).arrayBuffer();
  window.panel = new TwinPanel(document.getElementById("t"), { description: json, buffer, photographs: [], pictures: [] });
  done(window.panel.works ? "" : document.body.innerText);
})().catch((error) => done(String(error)));"""
DRAW = """const p = window.panel.pixels(arguments[0], arguments[1]); let text = "";
for (let i = 0; i < p.length; i += 4096) text += String.fromCharCode(...p.subarray(i, i + 4096));
return btoa(text);"""
FIRST = """const done = arguments[0];
(async () => {
  document.body.innerHTML = '<div id="t" class="twin"></div>';
  const { loadCloth } = await import("/twin/twin_card.js"), { TwinPanel } = await import("/twin/twin_panel.js"), from = performance.now();
  const panel = new TwinPanel(document.getElementById("t"), { ...await loadCloth((path) => "/results/" + path), photographs: [], pictures: [] });
  const look = () => (document.querySelector("canvas").dataset.drawn ? (done(performance.now() - from), panel.close()) : requestAnimationFrame(look));
  look();
})().catch((error) => done(String(error)));"""
TIME = """const list = [];
for (let i = 0; i < 4; i++) {
  const t = performance.now();
  window.panel.pixels({ ...arguments[0], phi: arguments[0].phi + i }, arguments[1]);
  list.push(performance.now() - t);
}
return list.slice(1).sort((a, b) => a - b)[1];"""


PHONE = {"width": 390, "height": 844, "deviceScaleFactor": 3, "mobile": True}


def first_ms(browser, address):
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", PHONE)
    browser.execute_cdp_cmd("Emulation.setCPUThrottlingRate", {"rate": 4})
    took = []
    for _ in range(3):
        browser.get(address + "/twin/twin.css")
        took.append(browser.execute_async_script(FIRST))
        if isinstance(took[-1], str):
            sys.exit(f"the twin does not open: {took[-1]}")
    return sorted(took)[1]


def draw(address, states, profile):
    """Rows of rgb bytes of each state, the milliseconds of a frame of the first one, and of the first picture on a phone."""
    from selenium import webdriver
    from selenium.webdriver.chrome.service import Service
    options = webdriver.ChromeOptions()
    for flag in [*FLAGS, f"--user-data-dir={profile}"]:
        options.add_argument(flag)
    browser = webdriver.Chrome(service=Service("/usr/bin/chromedriver"), options=options)
    try:
        browser.set_script_timeout(300)
        browser.get(address + "/twin/twin.css")
        fault = browser.execute_async_script(OPEN)
        if fault:
            sys.exit(f"the twin does not open: {fault}")
        drawn = []
        for state in states:
            rgba = base64.b64decode(browser.execute_script(DRAW, state, EDGE))
            drawn.append([bytes(v for x in range(EDGE) for v in rgba[4 * (EDGE * y + x):][:3]) for y in range(EDGE)])
        return drawn, browser.execute_script(TIME, states[0], FRAME_EDGE), first_ms(browser, address)
    finally:
        browser.quit()


def luma_fields(rows):
    """Means over 2 x 2 pixels of 0.299 R + 0.587 G + 0.114 B."""
    luma = [[0.299 * r[3 * x] + 0.587 * r[3 * x + 1] + 0.114 * r[3 * x + 2] for x in range(EDGE)] for r in rows]
    return [[(luma[y][x] + luma[y][x + 1] + luma[y + 1][x] + luma[y + 1][x + 1]) / 4 for x in range(0, EDGE, 2)] for y in range(0, EDGE, 2)]


def ssim(a, b, window=7):
    values, n = [], window * window
    for y in range(len(a) - window + 1):
        for x in range(len(a) - window + 1):
            p = [v for row in a[y:y + window] for v in row[x:x + window]]
            q = [v for row in b[y:y + window] for v in row[x:x + window]]
            mp, mq = sum(p) / n, sum(q) / n
            vp, vq = sum((v - mp) ** 2 for v in p) / (n - 1), sum((v - mq) ** 2 for v in q) / (n - 1)
            cov = sum((v - mp) * (w - mq) for v, w in zip(p, q)) / (n - 1)
            values.append((2 * mp * mq + 6.5025) * (2 * cov + 58.5225) / ((mp * mp + mq * mq + 6.5025) * (vp + vq + 58.5225)))
    return sum(values) / len(values)


def linear(byte):
    v = byte / 255
    return v / 12.92 if v <= 0.04045 else ((v + 0.055) / 1.055) ** 2.4


def mean(rows):
    return sum(linear(b) for r in rows for b in r)


def state_of(view, exposure):
    return {"shape": view["on"], "theta": view["camera_theta_deg"], "phi": view["camera_phi_deg"], "lampTheta": view["light_theta_deg"],
            "lampPhi": view["light_phi_deg"], "width": view["width_mm"], "exposure": exposure, "environment": "lamp only"}


def compare(references, drawn):
    """references: draped, near; drawn: the same, near without fibers, and both darker."""
    far, near, tables, dark_near, dark_tables = drawn
    figure("ssim", round(ssim(luma_fields(references[0]), luma_fields(far)), 4), "1", "higher")
    figure("mean_rel", round(mean(far) / mean(references[0]) - 1, 4), "1", "lower")
    figure("near_ssim", round(ssim(luma_fields(references[1]), luma_fields(near)), 4), "1", "higher")
    figure("near_ssim_tables", round(ssim(luma_fields(references[1]), luma_fields(tables)), 4), "1", "higher")
    figure("near_mean_rel", round(mean(dark_near) / mean(dark_tables) - 1, 4), "1", "lower")


def main():
    p = argparse.ArgumentParser()
    p.add_argument("--build", default=os.path.join(ROOT, "build"))
    p.add_argument("--keep", help="folder of the job, which is kept, with compare.png")
    a = p.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        folder = a.keep or os.path.join(temporary, "job")
        make_job(a.build, folder)
        results = os.path.join(folder, "results")
        states, references = [], []
        for i, view in enumerate((VIEW, NEAR), 1):
            with open(os.path.join(results, "pictures", f"on-{i}.json"), encoding="utf-8") as f:
                states.append(state_of(view, json.load(f)["png_exposure"]))
            references.append(read_png(os.path.join(results, "pictures", f"on-{i}.png")))
        with open(os.path.join(results, "twin", "twin.json"), encoding="utf-8") as f:
            twin = json.load(f)
        bare, dark = {**states[1], "fibers": False}, {"exposure": states[1]["exposure"] / 4}
        states += [bare, {**states[1], **dark}, {**bare, **dark}]
        drawn, frame_ms, first = draw(serve(results), states, os.path.join(temporary, "profile"))
        write_png(os.path.join(folder, "compare.png"), compose([[references[0], drawn[0], drawn[0]], [references[1], *drawn[1:3]]], 3 * EDGE))
        compare(references, drawn)
        figure("first_ms", round(first), "ms", "lower")
        figure("frame_ms", round(frame_ms, 1), "ms", "lower")
        figure("table_rel_rms", round(math.sqrt(max(0, twin["mean_rel_rms"] ** 2 - twin["mean_rel_noise"] ** 2)), 4), "1", "lower")
        figure("table_bytes", twin["bytes"], "bytes", "lower")


main()
