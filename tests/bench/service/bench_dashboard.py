"""What does the dashboard cost in a browser? Prints figures dashboard.* (headless Chromium, the real daemon).

    bench_dashboard.py [--build DIR] [--scan-edge N] [page] [list] [job] [slices] [first_hour]

list_10k_ms: time from the navigation until the list shows its 50 rows, with 10,000 jobs in the store (median of 7 loads).
poll_bytes: bytes of a poll of that list when one row has changed (largest of 10). scripting_ms: time of scripts for each
poll of the page of a running job whose fit has 100,000 points and whose log has 50 MB, both growing; job_poll_bytes: bytes of
such a poll. Jobs and series are made up: these figures are about the page, not about fits.

slices.*: the viewer of a scan of the size of Fleece, which bench_scan_slices makes (its figures come first). From the
request to the drawn slice with its centers: first_ms the first slice of an axis (mean of x and y), jump_ms one anywhere in
the scan that was not looked at before, step_ms the next one; medians over all axes, and the slowest twentieth of jumps and
steps. main_thread_ms: processor time of the page's main thread for a slice. slice_bytes: bytes that a jump transfers, with
the slices read ahead, a slice.

first_hour.*: clicks and keys from the empty page to a submitted job (bench_first_hour.py).
"""
import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
import zlib

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(os.path.dirname(HERE)))
for folder in (HERE, os.path.join(ROOT, "tests", "support", "python"), os.path.join(ROOT, "clients", "python")):
    sys.path.insert(0, folder)
N_JOB, N_LOAD, N_POINT, LOG_BYTES, WATCH_S = 10000, 7, 100000, 50 << 20, 20.0
FLAGS = ["--headless=new", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-background-networking", "--window-size=1280,900"]
# notes when the table has its rows
OBSERVE = """new MutationObserver(() => {
    if (!window.rowsAt && document.querySelectorAll('#jobs tbody tr').length === 50) window.rowsAt = performance.now();
}).observe(document, { childList: true, subtree: true });"""


def figure(name, value, unit):
    print(json.dumps({"name": f"dashboard.{name}", "value": round(value, 2), "unit": unit, "better": "lower"}), flush=True)


def open_browser(folder):
    from selenium import webdriver
    from selenium.webdriver.chrome.service import Service
    options = webdriver.ChromeOptions()
    for flag in [*FLAGS, f"--user-data-dir={folder}/profile"]:
        options.add_argument(flag)
    return webdriver.Chrome(service=Service("/usr/bin/chromedriver"), options=options)


def wait(browser, condition, seconds=120):
    end = time.monotonic() + seconds
    while not browser.execute_script(f"return Boolean({condition})"):
        assert time.monotonic() < end, condition
        time.sleep(0.05)


def make_jobs(daemon):
    """One job that has succeeded, and copies of it with its status."""
    from bench_service import copy_jobs
    with daemon:
        first = daemon.start_job()
        daemon.wait_state(first, "succeeded")
    copy_jobs(daemon.data, N_JOB - 1)
    with daemon:  # makes the folders
        pass
    jobs = os.path.join(daemon.data, "jobs")
    for job in os.listdir(jobs):
        if job != first:
            os.link(os.path.join(jobs, first, "status.json"), os.path.join(jobs, job, "status.json"))
    return first


def bench_list(folder, browser, daemon_type):
    daemon = daemon_type(os.path.join(folder, "list"), options={"jobs.max_jobs": 2 * N_JOB})
    first = make_jobs(daemon)
    with daemon:
        script = browser.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": OBSERVE})["identifier"]
        times = []
        for _ in range(N_LOAD + 1):
            browser.get("about:blank")
            browser.get(daemon.url + "/")
            wait(browser, "window.rowsAt")
            times.append(browser.execute_script("return window.rowsAt"))
        figure("list_10k_ms", statistics.median(times[1:]), "ms")
        browser.execute_cdp_cmd("Page.removeScriptToEvaluateOnNewDocument", {"identifier": script})
        job = daemon.get("/v1/jobs?limit=1").json()["jobs"][0]["id"]
        assert job != first
        browser.execute_script("performance.clearResourceTimings()")
        for i in range(10):
            daemon.put(f"/v1/jobs/{job}/tags", json={"tags": [f"change-{i}"]})
            wait(browser, f"document.querySelector('#jobs .tag.link')?.textContent === 'change-{i}'", 10)
        figure("poll_bytes", max(browser.execute_script(
            "return performance.getEntriesByType('resource').filter((e) => e.name.includes('/v1/jobs?')).map((e) => e.transferSize)")), "bytes")


def records(steps):
    for step in steps:
        text = json.dumps({"step": step, "phase": "fit", "wall_s": step, "n_path": 10, "n_path_total": 10 * step, "objective": 1 / (step + 1),
                           "objective_se": 0.01 / (step + 1), "parameter": [0.1 + 1e-6 * step] * 9, "parameter_se": [0.01] * 9, "rel_rms": 0.1,
                           "rendered": [], "note": ""})
        yield f"{zlib.crc32(text.encode()):08x} {text}\n"


def script_s(profile):
    """Seconds in scripts by V8's sampling profiler, with what they call and with garbage collection. ScriptDuration of
    Performance.getMetrics lacks what runs behind an await."""
    idle = {node["id"] for node in profile["nodes"] if node["callFrame"]["functionName"] in ("(idle)", "(program)", "(root)")}
    return 1e-6 * sum(delta for node, delta in zip(profile["samples"], profile["timeDeltas"]) if node not in idle)


def bench_job(folder, browser, daemon_type):
    with daemon_type(os.path.join(folder, "job")) as daemon:
        job = daemon.start_job("climb")
        daemon.wait_state(job, "running")
        place = os.path.join(daemon.data, "jobs", job)
        line = "2026-01-01T00:00:00.000Z INFO a line of a very long log\n"
        with open(os.path.join(place, "series.rec"), "a", encoding="ascii") as series, open(os.path.join(place, "log.txt"), "a", encoding="ascii") as log:
            series.writelines(records(range(1, N_POINT + 1)))
            series.flush()
            log.write(line * (LOG_BYTES // len(line)))
            log.flush()
            browser.get(f"{daemon.url}/#{job}/parameters")
            wait(browser, "document.querySelectorAll('.chart canvas').length >= 8")
            time.sleep(3)
            browser.execute_cdp_cmd("Profiler.enable", {})
            browser.execute_cdp_cmd("Profiler.setSamplingInterval", {"interval": 500})
            browser.execute_script("performance.setResourceTimingBufferSize(10000); performance.clearResourceTimings()")
            browser.execute_cdp_cmd("Profiler.start", {})
            end, step = time.monotonic() + WATCH_S, N_POINT
            while time.monotonic() < end:
                step += 1
                series.writelines(records([step]))
                log.write(line * 10)
                series.flush()
                log.flush()
                time.sleep(1)
            profile = browser.execute_cdp_cmd("Profiler.stop", {})["profile"]
            entries = browser.execute_script(
                "return performance.getEntriesByType('resource').map((e) => [new URL(e.name).pathname, e.transferSize])")
        polls = sum(path == f"/v1/jobs/{job}" for path, _ in entries)
        assert polls >= WATCH_S / 3, entries
        figure("scripting_ms", 1e3 * script_s(profile) / polls, "ms")
        figure("job_poll_bytes", sum(size for _, size in entries) / polls, "bytes")
        daemon.post(f"/v1/jobs/{job}/cancel")


# turns to an axis, jumps to 20 places, and steps through 60 slices; answers with the milliseconds of each
WALK = """const [axis, done] = arguments, canvas = document.querySelector('canvas.slice'), slider = document.querySelector('#slice-at');
    const shown = (slice) => new Promise((ready) => {
      const start = performance.now(), is = `${axis} ${slice} `;
      const look = () => canvas.dataset.shown?.startsWith(is) && (watch.disconnect(), ready(performance.now() - start));
      const watch = new MutationObserver(look);
      watch.observe(canvas, { attributes: true });
    });
    const go = (slice) => { const ready = shown(slice); slider.value = slice; slider.dispatchEvent(new Event('input')); return ready; };
    (async () => {
      const times = { first: 0, jump: [], step: [] };
      if (axis !== 'z') {
        const start = performance.now(), turned = new Promise((ready) => {
          const watch = new MutationObserver(() => canvas.dataset.shown?.startsWith(`${axis} `) && (watch.disconnect(), ready(performance.now() - start)));
          watch.observe(canvas, { attributes: true });
        });
        document.querySelector(`[aria-label='slices across ${axis}']`).click();
        times.first = await turned;
      }
      const n = Number(slider.max) + 1, quiet = () => new Promise((next) => { setTimeout(next, 300); });
      await quiet();
      performance.clearResourceTimings();
      for (let i = 1; i <= 20; i++) { times.jump.push(await go((i * 37 * 7 + 11) % n)); await quiet(); }
      const seen = performance.getEntriesByType('resource').filter((e) => e.name.endsWith('.slices'));
      times.bytes = seen.reduce((sum, e) => sum + e.transferSize, 0) / Math.max(1, seen.length);
      await go(20);
      for (let i = 21; i <= 80; i++) times.step.push(await go(i));
      done(times);
    })().catch((error) => done(String(error)));"""


def task_s(browser):
    """Processor seconds of the page's main thread so far."""
    return next(m["value"] for m in browser.execute_cdp_cmd("Performance.getMetrics", {})["metrics"] if m["name"] == "TaskDuration")


def bench_slices(folder, browser, daemon_type, edge):
    with daemon_type(os.path.join(folder, "slices")) as daemon:
        job = daemon.start_job()
        daemon.wait_state(job, "succeeded")
        program = os.path.join(os.environ["SELVEDGE_BUILD"], "tests", "bench", "service", "bench_scan_slices")
        subprocess.run([program, os.path.join(daemon.data, "jobs", job, "results"), *([str(edge)] if edge else [])], check=True)
        browser.set_script_timeout(300)
        browser.get(f"{daemon.url}/#{job}/geometry")
        wait(browser, "document.querySelector('canvas.slice')")
        browser.execute_script("document.querySelector('canvas.slice').scrollIntoView()")
        wait(browser, "document.querySelector('canvas.slice').dataset.shown")
        browser.execute_cdp_cmd("Performance.enable", {"timeDomain": "threadTicks"})
        before = task_s(browser)
        walks = [browser.execute_async_script(WALK, axis) for axis in "zxy"]
        assert all(isinstance(w, dict) for w in walks), walks
        figure("slices.main_thread_ms", 1e3 * (task_s(browser) - before) / sum(len(w["jump"]) + len(w["step"]) for w in walks), "ms")
        figure("slices.first_ms", statistics.mean(w["first"] for w in walks[1:]), "ms")
        for kind in ("jump", "step"):
            times = sorted(t for w in walks for t in w[kind])
            figure(f"slices.{kind}_ms", statistics.median(times), "ms")
            figure(f"slices.{kind}_slow_ms", times[int(0.95 * len(times))], "ms")
        figure("slices.slice_bytes", statistics.mean(w["bytes"] for w in walks), "bytes")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", default="build")
    parser.add_argument("--scan-edge", type=int, help="edge of the scan in voxels instead of Fleece's")
    parser.add_argument("names", nargs="*", default=["first_hour", "page", "list", "job", "slices"])
    arguments = parser.parse_args()
    os.environ["SELVEDGE_BUILD"] = os.path.join(ROOT, arguments.build)
    from daemon_under_test import Daemon  # it reads SELVEDGE_BUILD
    with tempfile.TemporaryDirectory() as folder:
        browser = open_browser(folder)
        try:
            if "first_hour" in arguments.names:
                from bench_first_hour import bench_first_hour
                bench_first_hour(folder, browser, Daemon)
            if "page" in arguments.names:
                from bench_job_page import bench_job_page
                bench_job_page(folder, browser, Daemon)
            if "list" in arguments.names:
                bench_list(folder, browser, Daemon)
            if "job" in arguments.names:
                bench_job(folder, browser, Daemon)
            if "slices" in arguments.names:
                bench_slices(folder, browser, Daemon, arguments.scan_edge)
        finally:
            browser.quit()


if __name__ == "__main__":
    main()
