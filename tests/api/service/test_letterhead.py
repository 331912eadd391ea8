"""The head of reports: laboratory, logo and paper of the settings, and the PDF of a report or the reason why there is none."""
import base64
import json
import os
import re
import shutil
import subprocess

import pytest
from daemon_under_test import Daemon, program, settings_arguments, wait_until
from small_cloth import start_small_job
from small_png import png

SVG = b'<?xml version="1.0"?>\n<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 40 20"><rect width="40" height="20" fill="teal"/></svg>\n'
FIT = {"path_budget": 20000, "render_px": 16, "render_samples": 1}
DOCUMENT = {"sample": "a cloth", "fibers": {"file": "cloth.hair", "voxel_um": 5}, "measurements": {"file": "rows.csv"}, "fit": FIT}


def report_of(d, **more):
    job = start_small_job(d, {**DOCUMENT, **more})
    d.wait_state(job, "succeeded", timeout_s=120)
    return job, d.get(f"/v1/jobs/{job}/results/report.html").text


def page_text(pdf, page):
    return subprocess.run(["pdftotext", "-f", str(page), "-l", str(page), pdf, "-"], capture_output=True, text=True, check=True).stdout


@pytest.mark.parametrize("kind, logo", [("png", png(24, lambda x, y: 10 * x)), ("svg+xml", SVG)])
def test_reports_have_the_head_of_the_settings(tmp_path, kind, logo):
    (tmp_path / "logo").write_bytes(logo)
    options = {"report.laboratory": "Fäden & <Tücher>", "report.logo": tmp_path / "logo", "report.paper": "letter"}
    with Daemon(tmp_path / "data", worker=None, options=options) as d:
        job, page = report_of(d, export={"pdf": True}, sample="A cotton cloth with a rather long name, of which there are more, " * 2)
        head = page.split("</header>")[0]
        assert '<span class="name">Fäden &amp; &lt;Tücher&gt;</span>' in head
        assert f'src="data:image/{kind};base64,{base64.b64encode(logo).decode()}"' in head
        assert "@page { size: letter;" in page
        if shutil.which("weasyprint") and shutil.which("pdftotext"):
            (tmp_path / "report.pdf").write_bytes(d.get(f"/v1/jobs/{job}/results/report.pdf").content)
            assert re.search(rb"/MediaBox \[ ?0 0 612 792 ?\]", (tmp_path / "report.pdf").read_bytes())
            # the pages for a customer are two, also with a long name and many reservations
            assert len(d.get(f"/v1/jobs/{job}/results/result.json").json()["verdict"]["reservations"]) > 3
            assert page_text(tmp_path / "report.pdf", 2).strip().startswith("Parameters, with their standard errors")
            assert page_text(tmp_path / "report.pdf", 3).strip().startswith("Appendix: details")


def test_a_report_without_such_settings(tmp_path):
    with Daemon(tmp_path / "data", worker=None) as d:
        _, page = report_of(d)
        assert '<span class="name"></span>' in page and "<img" not in page.split("</header>")[0] and "@page { size: A4;" in page


LOGO_FAULTS = {"text": (b"a text", "neither a PNG nor an SVG file"), "cut": (png(24, lambda x, y: 0)[:-9], "neither a PNG nor an SVG file"),
               "large": (b"<svg>" + b" " * (256 << 10) + b"</svg>", "262144"), "missing": (None, "No such file")}


@pytest.mark.parametrize("content, words", LOGO_FAULTS.values(), ids=LOGO_FAULTS)
def test_a_logo_that_cannot_be_used_is_refused_at_the_start(tmp_path, content, words):
    if content is not None:
        (tmp_path / "logo").write_bytes(content)
    command = [program("selvedged"), "--data", tmp_path / "data", "--port", "0", *settings_arguments({"report.logo": tmp_path / "logo"})]
    for more in ([], ["--doctor"]):
        done = subprocess.run([*command, *more], capture_output=True, text=True, check=False, timeout=150)
        said = done.stdout + done.stderr
        assert done.returncode == 1 and "report.logo" in said and words in said and str(tmp_path / "logo") in said, said


def test_a_pdf_that_cannot_be_made_is_said_at_once(tmp_path):
    """At the start, by the doctor, and at the check of a job that asks for it."""
    (tmp_path / "bin").mkdir()
    with Daemon(tmp_path / "data", worker=None, environment={"PATH": str(tmp_path / "bin")}) as d:
        wait_until(lambda: "jobs get no report.pdf: there is no program 'weasyprint'" in d.log_text(), what="the words about report.pdf")
        for pdf in (False, True):
            job = d.create({**DOCUMENT, "export": {"pdf": pdf}})
            warnings = d.post(f"/v1/jobs/{job}/check").json()["warnings"]
            assert [w["field"] for w in warnings if "Debian package weasyprint" in w["detail"]] == ["export.pdf"] * pdf, json.dumps(warnings)
    for found in (False, True):
        if found:
            (tmp_path / "bin" / "weasyprint").write_text("#!/bin/sh\n")
            (tmp_path / "bin" / "weasyprint").chmod(0o755)
        done = subprocess.run([program("selvedged"), "--data", tmp_path / "data", "--port", "0", "--doctor"], capture_output=True, text=True,
                              check=False, timeout=150, env={**os.environ, "PATH": str(tmp_path / "bin")})
        line = next(line for line in done.stdout.splitlines() if line.split()[1] == "pdf")
        assert line.startswith("ok" if found else "note") and "weasyprint" in line
