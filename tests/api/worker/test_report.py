"""The report on a job: one page that needs nothing else, its data, and the schema of result.json."""
import hashlib
import html
import json
import os
import re
import shutil
import subprocess
import time

import jsonschema
import pytest
from daemon_under_test import ROOT, program
from small_cloth import TABLE, hair
from small_exr import exr, read_exr

pytestmark = pytest.mark.skipif(not os.access(program("selvedge-worker"), os.X_OK), reason="no selvedge-worker in the build folder")
FIT = {"path_budget": 20000, "render_px": 16, "render_samples": 1}
VIEWS = [(20, 20, 180, 0), (45, 45, 180, 0), (60, 0, 180, 0), (45, 45, 90, 90)]


def run(folder, document, path=os.environ["PATH"], **files):
    (folder / "input").mkdir(parents=True)
    for name, data in {"cloth.hair": hair(), **files}.items():
        (folder / "input" / name).write_bytes(data)
    (folder / "job.json").write_text(json.dumps({"sample": "report <&> \"x\"", "fibers": {"file": "cloth.hair", "voxel_um": 5}, **document}))
    subprocess.run([program("selvedge-worker"), "--quiet", "--threads", "2", str(folder)], check=True, env={**os.environ, "PATH": path})
    return folder / "results"


@pytest.fixture(scope="module")
def of_table(tmp_path_factory):
    return run(tmp_path_factory.mktemp("report") / "table", {"measurements": {"file": "rows.csv"}, "fit": FIT}, **{"rows.csv": TABLE.encode()})


@pytest.fixture(scope="module")
def of_photographs(tmp_path_factory):
    photographs = [{"file": f"p{i}.exr", "set": "fit" if i < 3 else "held-out", "light_theta_deg": a, "light_phi_deg": 0, "camera_theta_deg": b,
                    "camera_phi_deg": c, "cloth_rotation_deg": d} for i, (a, b, c, d) in enumerate(VIEWS)]
    files = {f"p{i}.exr": exr(24, 24, lambda x, y, i=i: (0.1 + 0.002 * x, 0.08, 0.04 + 0.01 * i)) for i in range(4)}
    return run(tmp_path_factory.mktemp("report") / "photographs", {"photographs": photographs, "fit": FIT}, **files)


def schema():
    with open(os.path.join(ROOT, "config", "result.schema.json"), encoding="utf-8") as f:
        return json.load(f)


@pytest.mark.parametrize("which", ["of_table", "of_photographs"])
def test_results_follow_their_schema(which, request):
    result = json.loads((request.getfixturevalue(which) / "result.json").read_text())
    jsonschema.Draft202012Validator.check_schema(schema())
    jsonschema.Draft202012Validator(schema()).validate(result)
    for key in ("rows", "parameters", "verdict"):
        with pytest.raises(jsonschema.ValidationError):
            jsonschema.Draft202012Validator(schema()).validate({k: v for k, v in result.items() if k != key})
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.Draft202012Validator(schema()).validate({**result, "something": 1})


@pytest.mark.parametrize("which", ["of_table", "of_photographs"])
def test_the_page_needs_nothing_else(which, request):
    folder = request.getfixturevalue(which)
    page = (folder / "report.html").read_text()
    assert not re.search(r"<script|<link rel=\"stylesheet|src=\"(?!data:)|href=\"(?!data:)|url\(", page)
    assert "report &lt;&amp;&gt; &quot;x&quot;" in page and "<&>" not in page
    result = json.loads((folder / "result.json").read_text())
    for text in (result["verdict"]["text"], result["reason"], *(p["name"] for p in result["parameters"]), *(r["name"] for r in result["rows"])):
        assert text.replace("<", "&lt;").replace(">", "&gt;") in page
    meanings = {p["meaning"] for p in result["parameters"]}
    assert None not in meanings and "fresh paths" not in page and "left out in turn" not in page
    for meaning in meanings:
        assert meaning in html.unescape(page) and meaning in (folder / "summary.txt").read_text()
    shown = "Lobes" if which == "of_table" else "Pictures"
    for title in ("Errors", "Fitted parameters", "Measured and rendered", shown, "Course of the fit", "Correlation of the parameters",
                  "Gradient certificate", "Geometry", "Settings: the job document", "Settings that have their defaults", "Inputs", "Program and dates"):
        assert f"<h2>{title}</h2>" in page
    pictures = page.count("data:image/png;base64,")
    lamps = {(row["light_theta_deg"], row["light_phi_deg"]) for row in result["rows"]}
    assert pictures == (3 * len(result["rows"]) if which == "of_photographs" else len(lamps)) + 2  # the cloth and its geometry


def test_lobes_and_spheres_of_a_table(of_table):
    """Every lamp has a sphere, lit from the left and dark beyond its terminator; every lobe is rendered over its angles; the page draws both."""
    result = json.loads((of_table / "result.json").read_text())
    rows, lobes = {r["name"]: r for r in result["rows"]}, {lobe["row"]: lobe for lobe in result["lobes"]}
    assert {r["rendering_shows"] for r in rows.values()} == {"sphere"} and len({r["rendering_png"] for r in rows.values()}) == 4
    assert rows["fit-01"]["rendering_exr"] == rows["fit-03"]["rendering_exr"]
    assert len(lobes) == 6  # 45 degrees twice: by the plane and by the turn of the cloth; 60 degrees twice as well
    for lobe in lobes.values():
        angles = lobe["camera_theta_deg"]
        assert len(angles) == len(lobe["rendered"]) == len(lobe["rendered_se"]) >= 17 and angles == sorted(angles) and angles[0] == -angles[-1] == -80
    # at the angle of a row the lobe passes through the row's own rendering
    row, lobe = rows["fit-00"], lobes["fit-00"]
    near = sorted(range(len(lobe["rendered"])), key=lambda k: abs(lobe["camera_theta_deg"][k] - row["camera_theta_deg"]))[:2]
    mean, se = (sum(lobe[key][k][1] for k in near) / 2 for key in ("rendered", "rendered_se"))
    assert abs(mean - row["rendered"][1]) < 5 * (se + row["rendered_se"][1]) + 0.1 * row["rendered"][1]
    size, _, pixel = read_exr((of_table / rows["fit-02"]["rendering_exr"]).read_bytes())
    left, right = (sum(pixel(int(size * x), y)[0] for y in range(size)) for x in (0.25, 0.95))
    assert left > 0 and right == 0 and pixel(0, 0) == (0, 0, 0)  # lamp at 60 degrees
    page = (of_table / "report.html").read_text()
    assert page.count("<title>radiance over the angle of the camera</title>") == 4 and page.count("<polyline") >= 6
    for name, r in rows.items():
        assert f"{name}: measured {sum(r['measured']) / 3:.4g}, rendered" in page


def fronts(folder):
    """The two sections of the page for a customer, and the rest."""
    first, second, rest = (folder / "report.html").read_text().split("</section>")
    return first, second, rest


@pytest.mark.parametrize("which", ["of_table", "of_photographs"])
def test_the_first_two_pages_are_for_a_customer(which, request):
    folder = request.getfixturevalue(which)
    result = json.loads((folder / "result.json").read_text())
    first, second, rest = fronts(folder)
    written = time.strftime("%Y-%m-%d", time.gmtime(json.loads((folder / "report.json").read_text())["written_unix_s"]))
    assert first.count("<img") == 1 and result["verdict"]["text"] in first and f">{written}<" in first
    assert first.count("<dt>") == 4 and f"<dd>{result['geometry']['n_fiber']}</dd>" in first
    known = [p for p in result["parameters"] if p["determined"] and not p["fixed"]]
    assert f"<dd>{len(known)} of {len(result['parameters'])}</dd>" in first
    assert "Reflectance of the surface lobe R" in second and "Azimuthal width of the transmitted lobe TT." in second
    symbols = {re.sub(r"\.[rgb]$", "", p["name"]) for p in result["parameters"]}
    assert second.count("<tr>") == 1 + len(symbols) < len(result["parameters"]) and second.count("<svg") == 1 and second.count("<img") == 1
    assert "<h2>Measured and rendered</h2>" in rest and "Measured and rendered</h2>" not in first + second
    for reservation in result["verdict"]["reservations"]:
        assert reservation["text"] in rest


def test_the_data_beside_it(of_table):
    data = json.loads((of_table / "report.json").read_text())
    assert data["result"] == json.loads((of_table / "result.json").read_text())
    assert data["document"]["fit"] == FIT and data["program"].startswith("selvedge-worker ")
    defaults = data["defaults"]
    assert defaults["lamp.distance_cm"] == 61 and defaults["fit.method"] == "gauss_newton.v1" and defaults["black_sheet"] is True
    assert not set(FIT) & {key.removeprefix("fit.") for key in defaults} and not any(key.startswith(("volume", "cloth", "twin")) for key in defaults)
    inputs = {i["name"]: i for i in data["inputs"]}
    assert inputs["rows.csv"]["sha256"] == hashlib.sha256(TABLE.encode()).hexdigest() and inputs["rows.csv"]["role"] == "measurements"
    assert inputs["cloth.hair"]["size"] == len(hair())
    assert len(data["curve"]) == data["result"]["n_step"] and data["curve"][0]["objective"] > 0
    assert 0 < data["started_unix_s"] <= data["written_unix_s"]


FAKE = """#!/bin/sh
[ "$1" = --quiet ] && [ -s "$2" ] || exit 3
echo "%PDF-1.7 of $(basename "$2")" > "$3"
exit {code}
"""


@pytest.mark.slow
@pytest.mark.parametrize("code", [None, 0, 1])
def test_the_report_as_pdf(tmp_path, code):
    """Without the program that makes it, with one that does, and with one that fails: the job is whole in every case."""
    (tmp_path / "bin").mkdir()
    if code is not None:
        (tmp_path / "bin" / "weasyprint").write_text(FAKE.format(code=code))
        (tmp_path / "bin" / "weasyprint").chmod(0o755)
    for tool in ("sh", "basename"):
        (tmp_path / "bin" / tool).symlink_to(shutil.which(tool))
    folder = run(tmp_path / "job", {"measurements": {"file": "rows.csv"}, "fit": FIT, "export": {"pdf": True}}, path=str(tmp_path / "bin"),
                 **{"rows.csv": TABLE.encode()})
    warnings = json.loads((folder.parent / "status.json").read_text())["warnings"]
    about = [w for w in map(str, warnings) if "report.pdf" in w]
    assert (folder / "report.pdf").exists() == (code == 0) and not list(folder.glob(".part*"))
    assert len(about) == (code != 0) and (code != 1 or "failed" in about[0])
    if code is None:
        assert "Debian package weasyprint" in about[0]
        assert [w for w in json.loads((folder / "result.json").read_text())["warnings"] if "report.pdf" in str(w)]


def text_of(pdf, page):
    return subprocess.run(["pdftotext", "-layout", "-f", str(page), "-l", str(page), pdf, "-"], capture_output=True, text=True, check=True).stdout


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("weasyprint") is None or shutil.which("pdftotext") is None, reason="no WeasyPrint or no pdftotext on this machine")
def test_the_pdf_of_photographs(tmp_path, of_photographs):
    """What the real program makes of the page: two pages for a customer, with their pictures, and the appendix from the third on."""
    pdf = tmp_path / "report.pdf"
    subprocess.run(["weasyprint", "--quiet", of_photographs / "report.html", pdf], check=True)
    data = pdf.read_bytes()
    assert data.startswith(b"%PDF-") and data.rstrip().endswith(b"%%EOF")
    assert len(re.findall(rb"/Subtype ?/Image", data)) >= 6
    assert re.search(rb"/MediaBox \[ ?0 0 595\.\d+ 841\.\d+ ?\]", data)
    first, second, third = (text_of(pdf, i + 1) for i in range(3))
    assert 'report <&> "x"' in first and "Verdict:" in first and "parameters determined" in first
    assert "Parameters, with their standard errors" in second and "measured mean radiance" in second and "mean radius" in second
    assert third.strip().startswith("Appendix: details") and "page 3 of" in third
