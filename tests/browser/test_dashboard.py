"""The pages of jobs in a real browser with a real daemon: a small real job while it runs and at its end, and
comparisons."""
import json

import pytest

pytest.importorskip("selenium.webdriver", reason="python3-selenium is not installed")
import selvedge  # noqa: E402
import small_cloth  # noqa: E402
from browser_page import (  # noqa: E402
    click_on, complaints, error_words, keep, open_tab, scrolls_sideways, sized, small_weave, start_daemon, stop_daemon, text_of, texts, wait_for)
from selenium.webdriver.common.by import By  # noqa: E402


LEFT_OUT = 2  # the brightest photograph


@pytest.fixture(scope="module")
def sample(tmp_path_factory):
    """A folder with a small phantom: scan, fibers and photographs."""
    sample = tmp_path_factory.mktemp("sample")
    small_weave(sample, "--px", "32", "--paths", "4096", "--param", "C_TT=0.7,0.5,0.3")
    return sample


@pytest.fixture(scope="module")
def real(sample, tmp_path_factory):
    """A daemon with the real worker, and a small real job in it: volume, 9 + 4 photographs, two models, few paths."""
    photographs = json.loads((sample / "photographs.json").read_text())
    document = {"sample": "small plain weave", "volume": {"files": ["scan.tif"], "voxel_size_um": 2.0},
                "photographs": photographs[:9] + photographs[16:20],
                "fit": {"models": ["two_lobe.v1", "microflake.v1"], "path_budget": 300000, "render_px": 24, "render_samples": 4,
                        "texture": {"block_mm": 2.5, "weight": 0.01},
                        "candidates": [{"light_theta_deg": t, "light_phi_deg": 0, "camera_theta_deg": 60, "camera_phi_deg": 180}
                                       for t in (20, 65)]}}
    (sample / "job.json").write_text(json.dumps(document))
    process, url = start_daemon(tmp_path_factory.mktemp("data"))
    yield url, selvedge.Client(url).submit(str(sample / "job.json"))
    stop_daemon(process)


def test_real_job_live_and_finished(real, browser):
    url, job = real
    browser.get(url + "/")
    wait_for(browser, "document.querySelector('#jobs tbody tr')")
    assert "small plain weave" in text_of(browser, "#jobs")
    keep(browser, "list")
    click_on(browser, "#jobs tbody tr a")
    wait_for(browser, "document.querySelectorAll('.stage').length === 8")
    # while the job runs: curves appear during the fit
    browser.execute_script("location.hash += '/parameters'")
    wait_for(browser, "document.querySelectorAll('.chart canvas').length >= 8", 240)
    keep(browser, "running")
    open_tab(browser, "log")
    wait_for(browser, "document.querySelectorAll('.chart canvas').length === 2")
    assert [t.startswith("Objective") for t in texts(browser, ".chart-title")] == [True]
    open_tab(browser, "parameters")
    # finished
    wait_for(browser, "document.querySelector('.state.succeeded')", 400)
    wait_for(browser, "document.querySelector('#parameters')")
    browser.execute_script("document.querySelector('#course').open = true")
    # the curves of both models under their own names, and the table that compares them

    def titles():
        return texts(browser, ".chart-title")
    wait_for(browser, "document.querySelectorAll('#models-shown button').length === 2")
    # the curves of the best model, although the other was fitted last
    wait_for(browser, "document.querySelector('#models-shown button.main').textContent === 'two_lobe.v1'")
    wait_for(browser, "document.querySelectorAll('.chart canvas').length >= 12")
    assert any(t.startswith("beta_TT (°)") for t in titles()) and not any(t.startswith("alpha") for t in titles())
    click_on(browser, "#models-shown button", 1)
    wait_for(browser, "[...document.querySelectorAll('.chart-title')].some((e) => e.textContent.startsWith('alpha'))")
    assert not any(t.startswith("C_TT") for t in titles())
    keep(browser, "second-model")
    compared = texts(browser, "#models tbody tr")
    assert [c.split()[0] for c in compared] == ["two_lobe.v1", "microflake.v1"] and sum("best" in c for c in compared) == 1 and "best" in compared[0]
    result = job.result().raw
    rows = texts(browser, "#parameters tbody tr")
    assert len(rows) == 9 and rows[0].startswith("C_R.r") and "±" in rows[3] and "Reflectance of the surface lobe R" in rows[0] and "Reflectance" not in rows[1]
    open_tab(browser, "rows")
    n_positive = sum(m > 0 and r > 0 for row in result["rows"] for m, r in zip(row["measured"], row["rendered"]))
    assert len(browser.find_elements(By.CSS_SELECTOR, "svg.scatter circle")) == n_positive
    assert len(browser.find_elements(By.CSS_SELECTOR, "#next-photograph tbody tr")) == 2
    textures = texts(browser, "#textures tbody tr")
    assert len(textures) == 13 and all("%" in t for t in textures)
    open_tab(browser, "pictures")
    pairs = browser.execute_script("return [...document.querySelectorAll('.pair')].map((p) => p.className)")
    assert len(pairs) == 13 and sum("held" in p for p in pairs) == 4
    browser.execute_script("for (const i of document.images) i.loading = 'eager'")
    wait_for(browser, "[...document.images].every((i) => i.complete && i.naturalWidth > 0)")
    assert len(browser.find_elements(By.CSS_SELECTOR, ".pair canvas")) == 26
    assert all(len(m["rows"][0]["texture"]["rendered_se"]) == 3 for m in result["models"])
    open_tab(browser, "files")
    listed = []
    while True:  # page by page
        listed += texts(browser, "#files tr")
        if not browser.execute_script("const b = document.querySelector('[aria-label=\"next files\"]'); const on = !b.disabled; b.click(); return on"):
            break
    names = [line.split()[0] for line in listed]
    assert {"result.json", "fibers.hair", "density.vol"} <= set(names) and len(set(names)) == len(names) > 50
    open_tab(browser, "log")
    wait_for(browser, "document.querySelector('pre.log').textContent.includes('stage')")
    assert "passed" in text_of(browser, "#certificate")
    open_tab(browser, "geometry")
    assert len(browser.find_elements(By.CSS_SELECTOR, "canvas.slice")) == 1
    # fibers in 3D, or a sentence with the reason (a machine without WebGL)
    browser.execute_script("document.querySelector('.view3d button').click()")
    wait_for(browser, "document.querySelector('.view3d canvas') || document.querySelector('.view3d').textContent.includes('not available')")
    # the key figures of the geometry, and the page with all of them
    browser.execute_script("document.querySelector('#quality details').open = true")
    quality = text_of(browser, "#quality")
    assert "material explained" in quality and "direction noise" in quality and "continue" in quality
    keep(browser, "finished")
    assert complaints(browser) == []
    browser.get(browser.execute_script("return document.querySelector('#quality a').href"))
    assert job.state().sample in text_of(browser, "h1")
    # lengths and sections of the fibers, three slices, the cloth from above
    wait_for(browser, "[...document.images].length === 6 && [...document.images].every((i) => i.complete && i.naturalWidth > 0)")
    assert browser.execute_script("return getComputedStyle(document.querySelector('td.number')).textAlign") == "right"
    keep(browser, "quality")
    assert complaints(browser) == []


def test_correlations_and_record(real, browser):
    """The shaded table and its words are the matrix of result.json; inputs have the hashes of their bytes."""
    url, job = real
    job.wait()
    browser.get(f"{url}/#{job.id}")
    wait_for(browser, "document.querySelector('#correlation')")
    browser.execute_script("document.querySelector('#correlations').open = true")
    result, state = job.result().raw, job.state().raw
    free = [i for i, p in enumerate(result["parameters"]) if not p["fixed"]]
    shown = browser.execute_script("""return [...document.querySelectorAll('#correlation tbody tr')]
        .map((r) => [...r.querySelectorAll('td')].map((d) => Number(d.textContent.replace('−', '-'))))""")
    wanted = [[result["correlation"][i][j] for j in free] for i in free]
    assert all(abs(a - b) <= 0.005 + 1e-9 for x, y in zip(shown, wanted) for a, b in zip(x, y)) and [len(x) for x in shown] == [len(free)] * len(free)
    strong = max(((abs(wanted[i][j]), i, j) for i in range(len(free)) for j in range(i)))
    names = [result["parameters"][i]["name"] for i in free]
    assert strong[0] < 0.7 or f"Strongest: {names[strong[2]]} and {names[strong[1]]} (" in text_of(browser, "#correlation-words")
    with sized(browser, 375, 800):
        assert scrolls_sideways(browser) == []
        browser.execute_script("document.getElementById('correlation').scrollIntoView()")
        keep(browser, "correlation-375", 375, 800)
    open_tab(browser, "files")
    inputs = texts(browser, "#record-inputs tbody tr")
    assert len(inputs) == 14 and all(f["name"] in t and f["sha256"] in t for f, t in zip(state["files"], inputs))
    open_tab(browser, "settings")
    dates = text_of(browser, "#record-dates")
    assert job.id in dates and result["program"] in dates and len(browser.find_elements(By.CSS_SELECTOR, "#record-dates time[title$=UTC]")) == 4
    settings = text_of(browser, "#record-settings")
    click_on(browser, "[aria-label='next settings']")
    settings += text_of(browser, "#record-settings")
    assert "volume.voxel_size_um 2" in settings and f"photographs[{state['document']['photographs'][0]['file']}].light_theta_deg" in settings
    keep(browser, "record")
    with sized(browser, 375, 800):
        assert scrolls_sideways(browser) == []
        keep(browser, "record-375", 375, 800)
    assert complaints(browser) == []


@pytest.fixture(scope="module")
def other(real, sample):
    """A second job in the daemon of `real`: the true fibers, the photographs but one, another light budget, one model."""
    url, first = real
    first.wait()
    document = first.state().raw["document"]
    document["fit"]["path_budget"] = 100000
    del document["volume"], document["fit"]["models"], document["fit"]["candidates"]
    document.update(sample="true <i>fibers</i>", fibers={"file": "truth.hair"}, photographs=[p for i, p in enumerate(document["photographs"]) if i != LEFT_OUT])
    document["fit"].update(model="two_lobe.v1", fixed={"beta_R": 8})
    second = selvedge.Client(url).submit(document, str(sample))
    second.wait()
    return second


def test_compare_two_jobs(real, other, browser):
    """Numbers of the comparison are those of both results; marks are recomputed here."""
    url, first = real
    unknown = "00000000-0000-0000-0000-000000000000"
    draft = selvedge.Client(url).create({"sample": "a draft", "fibers": {"file": "cloth.hair"}, "measurements": {"file": "rows.csv"}})
    # from the list
    browser.get(url + "/")
    wait_for(browser, "document.querySelectorAll('#jobs tbody tr').length >= 3")
    for id in (first.id, other.id):
        browser.execute_script("document.querySelector(`#jobs a[href='#${arguments[0]}']`).closest('tr').querySelector('input').click()", id)
    click_on(browser, "#bulk button", texts(browser, "#bulk button").index("Compare"))
    wait_for(browser, "document.querySelector('#compare-errors')")
    assert browser.current_url.endswith(f"#compare/{first.id},{other.id}")
    assert browser.find_elements(By.CSS_SELECTOR, "main i") == [] and "true <i>fibers</i>" in text_of(browser, "#compare")
    a, b = first.result().raw, other.result().raw

    def cells(card, title):
        return browser.execute_script("""return [...document.querySelectorAll(`#${arguments[0]} tr`)]
            .filter((r) => r.querySelector('th[scope=row]')?.textContent.startsWith(arguments[1]))
            .map((r) => [...r.querySelectorAll('td')].map((d) => d.textContent.trim()))""", card, title)
    held = cells("compare-errors", "held out")[0]
    assert all(text.endswith(error_words(r, 'heldout_rel_rms')) for text, r in zip(held, (a, b)))
    assert cells("compare-errors", "plain BRDF, held")[0] == [f"{100 * r['skill']['plain_brdf']['heldout_rel_rms']:.2f} %" for r in (a, b)]
    assert cells("compare-errors", "rows, fitted")[0] == ["9 + 4", "8 + 4"]
    assert "fitted rows are not the same" in text_of(browser, "#compare-errors .note")
    # parameters of the model that both have; the other model has one column
    open_tab(browser, "parameters")
    mine = {p["name"]: p for p in next(m for m in a["models"] if m["id"] == "two_lobe.v1")["parameters"]}
    for p in b["parameters"]:
        pair, q = cells("compare-parameters", p["name"])[0], mine[p["name"]]
        known = p["determined"] and q["determined"]
        n = (p["value"] - q["value"]) / ((p["standard_error"] or 0) ** 2 + (q["standard_error"] or 0) ** 2) ** 0.5
        assert len(pair) == 2 and ("s.e." in pair[1]) == (known and abs(n) > 2) and "s.e." not in pair[0], (p, q, pair)
    assert len(cells("compare-parameters", "alpha")[0]) == 1 and "fixed" in cells("compare-parameters", "beta_R")[0][1]
    # every row, and every photograph once with both renderings
    open_tab(browser, "rows")
    rows = browser.find_elements(By.CSS_SELECTOR, "#compare-rows tbody tr")
    assert len(rows) == 13 and sum("–" in r.text for r in rows) == 1
    open_tab(browser, "pictures")
    n_picture = n_dimmed = 0
    for _ in range(2):  # pages of eight photographs
        browser.execute_script("for (const i of document.images) i.loading = 'eager'")
        wait_for(browser, "[...document.images].every((i) => i.complete && i.naturalWidth > 0)")
        n_picture += len(browser.find_elements(By.CSS_SELECTOR, "#compare-pictures img"))
        n_dimmed += len(browser.find_elements(By.CSS_SELECTOR, "#compare-pictures img[style*=dim-B]"))
        click_on(browser, "[aria-label='next photographs']")
    assert n_picture == 13 + 13 + 12
    # the job without the brightest photograph wrote brighter pictures, which are dimmed to those of the other
    assert b["png_exposure"] > a["png_exposure"]
    assert n_dimmed == 12
    slope = browser.execute_script("return Number(document.querySelector('#dim-B feFuncG').getAttribute('slope'))")
    assert abs(slope - a["png_exposure"] / b["png_exposure"]) < 1e-9
    # settings: those that differ, and no others
    open_tab(browser, "settings")
    settings = text_of(browser, "#compare-settings")
    assert cells("compare-settings", "fit.path_budget")[0] == ["300000", "100000"] and cells("compare-settings", "volume.voxel_size_um")[0] == ["2", "not set"]
    assert "fit.render_px" not in settings and "SHA-256 of truth.hair" in settings
    missing = first.state().raw["document"]["photographs"][LEFT_OUT]["file"]
    assert {t for t in browser.execute_script("return [...document.querySelectorAll('#compare-settings th[scope=row]')].map((t) => t.textContent)")
            if t.startswith("photographs[")} == {f"photographs[{missing}].{k}" for k in first.state().raw["document"]["photographs"][LEFT_OUT]}
    keep(browser, "compare")
    with sized(browser, 375, 800):
        assert scrolls_sideways(browser) == []
        keep(browser, "compare-375", 375, 6000)
    # what cannot be compared says so
    browser.get(f"{url}/#compare/{first.id},{draft.id},{unknown},{other.id}")
    wait_for(browser, "document.querySelectorAll('#compare .note').length === 2")
    said = text_of(browser, "#compare")
    assert f"{unknown}: There is no such job" in said and "B, a draft, has no result: it was not started" in said
    browser.execute_script("document.querySelector('#compare .compared .button:nth-child(3)').click()")
    wait_for(browser, f"location.hash === '#compare/{draft.id},{unknown},{other.id}'")
    many = ",".join([first.id, other.id, *(f"job-{i}" for i in range(7))])
    browser.get(f"{url}/#compare/{many}")
    wait_for(browser, "document.querySelector('#compare .note')?.textContent.includes('the first 8 of these 9 jobs')")
    browser.get(f"{url}/#compare/{first.id}")
    wait_for(browser, "document.querySelector('#compare .note')?.textContent.includes('not two jobs')")
    draft.delete()
    # an unknown job is a 404 that the browser writes into the console
    assert [c for c in complaints(browser) if "404" not in c] == []


def test_parameters_of_two_groups(real, browser, tmp_path):
    """The table and the curves show the parameters group by group, under their own names."""
    url, _ = real
    (tmp_path / "cloth.hair").write_bytes(small_cloth.hair(groups=True))
    (tmp_path / "rows.csv").write_text(small_cloth.TABLE)
    (tmp_path / "job.json").write_text(json.dumps({
        "sample": "two colours", "fibers": {"file": "cloth.hair", "groups": ["weft", "warp"]}, "measurements": {"file": "rows.csv"},
        "fit": {"model": "two_lobe.v1", "path_budget": 100000, "tied": [["beta_TT"], ["gamma_TT"]], "fixed": {"weft.beta_R": 5},
                "render_px": 16, "render_samples": 4}}))
    job = selvedge.Client(url).submit(str(tmp_path / "job.json"))
    job.wait()
    browser.get(f"{url}/#{job.id}")
    wait_for(browser, "document.querySelector('#parameters')")
    rows = texts(browser, "#parameters tbody tr")
    assert len(rows) == 20 and rows[0] == "weft" and rows[1].startswith("C_R.r") and rows[10] == "warp" and rows[11].startswith("C_R.r")
    assert "fixed" in rows[7] and "tied to weft.beta_TT" in rows[18]
    browser.execute_script("document.querySelector('#course').open = true")
    wait_for(browser, "document.querySelectorAll('.charts').length === 2")
    charts = [[e.text.split()[0] for e in c.find_elements(By.CSS_SELECTOR, ".chart-title")] for c in browser.find_elements(By.CSS_SELECTOR, ".charts")]
    assert charts == [["C_R", "C_TT", "beta_TT", "gamma_TT"], ["C_R", "C_TT", "beta_R", "beta_TT", "gamma_TT"]]
    keep(browser, "groups")
    assert complaints(browser) == []


def test_corrections(real, browser, tmp_path):
    """What the photographs ask to change about the fibers, and what that gains, as in result.json."""
    url, _ = real
    (tmp_path / "cloth.hair").write_bytes(small_cloth.hair())
    (tmp_path / "rows.csv").write_text(small_cloth.TABLE)
    (tmp_path / "job.json").write_text(json.dumps({
        "sample": "corrected", "fibers": {"file": "cloth.hair"}, "measurements": {"file": "rows.csv"},
        "correction": {"radius": {"lower": 0.8, "upper": 1.2}},
        "fit": {"model": "two_lobe.v1", "path_budget": 100000, "render_px": 8, "render_samples": 1}}))
    job = selvedge.Client(url).submit(str(tmp_path / "job.json"))
    job.wait()
    browser.get(f"{url}/#{job.id}")
    wait_for(browser, "document.querySelector('#corrections')")
    text = text_of(browser, "#corrections")
    result = job.result().raw
    without = result["without_corrections"]
    keeps = without["heldout_gain"] >= 2 * without["heldout_gain_se"]
    assert ("LOWER THE HELD-OUT ERROR" if keeps else "NOT WORTH KEEPING") in text.upper()
    assert ("ask for radius" if without["asked_for"] else "ask for none of these corrections") in text
    assert f"{error_words(without, 'heldout_rel_rms')} over the held-out rows; with them: {error_words(result, 'fit_rel_rms')}" in text
    assert f"{100 * abs(without['heldout_gain']):.2f} % ± {100 * without['heldout_gain_se']:.2f} %" in text
    assert text_of(browser, "#cloth-numbers tbody tr").startswith("radius")
    keep(browser, "corrections")
    assert complaints(browser) == []


def test_pictures_grow_on_the_page(real, browser, tmp_path):
    """A picture is shown while it is rendered, with its samples and its noise, which falls; in the end it is whole."""
    url, _ = real
    (tmp_path / "cloth.hair").write_bytes(small_cloth.hair(layers=3))
    view = {"light_theta_deg": 45, "light_phi_deg": 0, "camera_theta_deg": 45, "camera_phi_deg": 180, "width_mm": 3}
    (tmp_path / "job.json").write_text(json.dumps({
        "sample": "on surfaces", "fibers": {"file": "cloth.hair"},
        "pictures": [{"on": "cylinder", "radius_mm": 1, **view, "px": 32, "samples": 16, "method": "fast", "deep_light": "cells",
                      "reference": True, "filter": True},
                     {"on": "flat", **view, "px": 32, "samples": 1024}],
        "fit": {"fixed": {"C_R": [0.1] * 3, "C_TT": [0.6, 0.4, 0.3], "beta_R": 6, "beta_TT": 12, "gamma_TT": 30}, "model": "two_lobe.v1"}}))
    job = selvedge.Client(url).submit(str(tmp_path / "job.json"))
    browser.get(f"{url}/#{job.id}/pictures")
    wait_for(browser, "document.querySelector('#surfaces .tag') && / of 1024 samples/.test(document.querySelector('#surfaces').textContent)", 60)
    keep(browser, "pictures-growing")
    job.wait()
    wait_for(browser, "document.querySelectorAll('#surfaces figure').length === 2 && !document.querySelector('#surfaces .tag')", 60)
    noise = [p["noise"] for p in job.result().raw["pictures"]]
    shown = texts(browser, "#surfaces figcaption")
    assert [t.split()[0] for t in shown] == ["cylinder", "flat"] and all("θ 45°" in t for t in shown)
    assert all(abs(float(t.split("noise")[1].split()[0]) - 100 * n) < 0.06 * 100 * n + 0.06 for t, n in zip(shown, noise)), (shown, noise)
    wait_for(browser, "document.querySelectorAll('#surfaces .reference').length === 1")
    apart = job.result().raw["pictures"][0]["reference"]["field_difference_rms"]
    assert abs(float(text_of(browser, "#surfaces .reference").split("tracing")[1].split()[0]) - 100 * apart) < 0.06 * 100 * apart + 0.06
    assert browser.execute_script("return [...document.querySelectorAll('#surfaces img')].every(i => i.complete && i.naturalWidth === 32)")
    assert texts(browser, "#surfaces .filtered") == ["filtered preview\nas rendered"], "one of both asks for it"
    links = browser.execute_script("return [...document.querySelectorAll('#surfaces figure:first-child a')].map(a => a.getAttribute('href'))")
    assert [href.rsplit("/", 1)[1] for href in links] == ["on-1-filtered.png", "on-1.png"], links
    keep(browser, "pictures")
    assert complaints(browser) == []
