"""How tall is the page of a finished job? Prints dashboard.job_page_px: pixels of the tallest of its tabs, 1280 pixels wide
(headless Chromium, the real daemon and worker): a scan with 46 photographs, two models, a picture and a twin, few paths."""
import json
import os
import shutil
import subprocess

VIEW = {"light_theta_deg": 45, "light_phi_deg": 0, "camera_theta_deg": 45, "camera_phi_deg": 180}


def sample(folder, binaries):
    os.makedirs(folder)
    make = [os.path.join(binaries, "selvedge-phantom")]
    for words in (["cloth", "--weave", "plain", "--fibers-per-yarn", "7", "--diameter-voxel", "6"],
                  ["photograph", "--fibers", f"{folder}/truth.hair", "--px", "24", "--paths", "512"]):
        subprocess.run([*make, *words, "--out", folder], check=True, stdout=subprocess.DEVNULL)
    with open(os.path.join(folder, "photographs.json"), encoding="utf-8") as f:
        first = json.load(f)[:18]
    again = [dict(p, file=f"again-{k}-{p['file']}") for k in range(2) for p in first[:14]]
    for p in again:
        shutil.copyfile(os.path.join(folder, p["file"].split("-", 2)[2]), os.path.join(folder, p["file"]))
    return {"sample": "plain weave", "volume": {"files": ["scan.tif"], "voxel_size_um": 2.0}, "photographs": first + again,
            "pictures": [{"on": "cylinder", "radius_mm": 1, "width_mm": 3, "px": 32, "samples": 2, **VIEW}],
            "twin": {"make": True, "paths": 20000, "texels": 64},
            "fit": {"models": ["two_lobe.v1", "microflake.v1"], "path_budget": 60000, "render_px": 16, "render_samples": 2, "texture": {"block_mm": 2.5}}}


def bench_job_page(folder, browser, daemon_type):
    import selvedge
    from bench_dashboard import figure, wait
    place = os.path.join(folder, "page-sample")
    document = sample(place, os.path.join(os.environ["SELVEDGE_BUILD"], "bin"))
    with daemon_type(os.path.join(folder, "page"), worker=None) as daemon:
        job = selvedge.Client(daemon.url).submit(document, place)
        assert job.wait().state == "succeeded"
        browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", {"width": 1280, "height": 900, "deviceScaleFactor": 1, "mobile": False})
        browser.get(f"{daemon.url}/#{job.id}")
        wait(browser, "document.querySelector('.tab-bar a.active')")
        heights = []
        for name in browser.execute_script("return [...document.querySelectorAll('.tab-bar a')].map((a) => a.dataset.tab)"):
            browser.execute_script("document.querySelector(`.tab-bar a[data-tab=${arguments[0]}]`).click()", name)
            wait(browser, f"document.querySelector('.tab-bar a.active').dataset.tab === '{name}'")
            browser.execute_async_script("setTimeout(arguments[0], 1500)")
            heights.append(browser.execute_script("return document.documentElement.scrollHeight"))
        browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})
    figure("job_page_px", max(heights), "px")
