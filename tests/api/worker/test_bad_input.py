"""Bad input, and the message that each gets: `selvedge check` finds all faults at once, the API those of the document. None of
these cases is accepted silently."""
import copy
import json
import math
import os
import subprocess

import pytest
from daemon_under_test import program
from small_cloth import TABLE, hair
from small_exr import exr
from small_png import png_rgb

pytestmark = pytest.mark.skipif(not os.access(program("selvedge-worker"), os.X_OK), reason="no selvedge-worker in the build folder")

VIEWS = [(20, 20, 180, 0), (45, 45, 180, 0), (60, 0, 180, 0), (45, 45, 90, 90)]
FIT = {"model": "two_lobe.v1", "path_budget": 20000}


def table_job():
    return {"sample": "bad", "fibers": {"file": "cloth.hair", "voxel_um": 5}, "measurements": {"file": "rows.csv"}, "fit": dict(FIT)}


def photo_job():
    views = [{"file": f"p{i}.exr", "set": "fit", "light_theta_deg": a, "light_phi_deg": 0, "camera_theta_deg": b, "camera_phi_deg": c,
              "cloth_rotation_deg": d} for i, (a, b, c, d) in enumerate(VIEWS)]
    return {"sample": "bad", "fibers": {"file": "cloth.hair", "voxel_um": 5}, "photographs": views, "fit": dict(FIT)}


def weave_job():
    cloth = {"weave": "plain", "texture": "w.png", "yarns": [{"fibers": 7}]}
    return {"sample": "bad", "cloth": cloth, "measurements": {"file": "rows.csv"}, "fit": dict(FIT)}


def files_of(document):
    files = {"cloth.hair": hair()}
    if "measurements" in document:
        files["rows.csv"] = TABLE.encode()
    for i in range(len(document.get("photographs", []))):
        files[f"p{i}.exr"] = exr(16, 16, lambda x, y: (0.1 + 0.001 * x, 0.08, 0.05 + 0.001 * y))
    return files


def put(path, value):
    """Sets document[path] (dots and numbers) to value; None removes it."""
    def change(document, files):
        del files
        at, keys = document, path.split(".")
        for key in keys[:-1]:
            at = at[int(key)] if key.isdigit() else at.setdefault(key, {})
        key = int(keys[-1]) if keys[-1].isdigit() else keys[-1]
        if value is None:
            del at[key]
        else:
            at[key] = value
    return change


def file(name, data):
    def change(document, files):
        del document
        if data is None:
            del files[name]
        else:
            files[name] = data
    return change


def rows(change):
    """The table with every row changed: change(list of numbers after the set) -> list."""
    lines = TABLE.strip().split("\n")
    out = lines[:2]
    for line in lines[2:]:
        name, *cells = line.split(",")
        out.append(",".join([name, *(f"{v:.9g}" for v in change([float(c) for c in cells]))]))
    return file("rows.csv", ("\n".join(out) + "\n").encode())


def many_rows(value, n=12):
    """A table of n rows with lamps at up to 80 degrees; value(lamp cosine) is the radiance."""
    lines = ["set,light_theta_deg,light_phi_deg,camera_theta_deg,camera_phi_deg,r,g,b"]
    for i in range(n):
        lamp, camera = 5 + 75 * i / (n - 1), (i * 25) % 70
        v = value(math.cos(math.radians(lamp)))
        lines.append(f"fit,{lamp},0,{camera},{40 * i % 360},{v:.6f},{0.8 * v:.6f},{0.6 * v:.6f}")
    return file("rows.csv", ("\n".join(lines) + "\n").encode())


def grid(radiance, rotation=0, lamp_phi=(0,)):
    """A table of 36 rows: lamps and cameras at 10 to 70 degrees, cameras at azimuths of 180 and 75; radiance(lamp, camera cosine)."""
    lines = ["set,light_theta_deg,light_phi_deg,camera_theta_deg,camera_phi_deg,cloth_rotation_deg,r,g,b"]
    for i, lamp in enumerate((10, 20, 35, 50, 60, 70)):
        for k, camera in enumerate((15, 40, 70)):
            for azimuth in (180, 75):
                v = radiance(*(math.cos(math.radians(a)) for a in (lamp, camera)))
                at = lamp_phi[(i + k) % len(lamp_phi)]
                lines.append(f"fit,{lamp},{at},{camera},{(at + azimuth) % 360},{rotation},{v:.6f},{0.8 * v:.6f},{0.6 * v:.6f}")
    return file("rows.csv", ("\n".join(lines) + "\n").encode())


def both(*changes):
    def change(document, files):
        for c in changes:
            c(document, files)
    return change


def line(i, text):
    lines = TABLE.split("\n")
    lines[i] = text
    return file("rows.csv", "\n".join(lines).encode())


def radians(document, files):
    del files
    for p in document["photographs"]:
        for key in p:
            if key.endswith("_deg"):
                p[key] = round(math.radians(p[key]), 4)


SHEET = b"v 0 0 0\nv 1 0 0\nv 1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\n"
VIEW = {"light_theta_deg": 20, "light_phi_deg": 0, "camera_theta_deg": 0, "camera_phi_deg": 0}


def on_mesh(obj):
    """Two pictures of the fitted cloth, of which the second lies on a mesh."""
    return both(put("pictures", [{"on": "flat", **VIEW}, {"on": "mesh", "mesh_file": "sheet.obj", **VIEW}]), file("sheet.obj", obj))


TAB, PHO, WEAVE = table_job, photo_job, weave_job
# (case, document, change, "fault" or "warning", part of the message)
CASES = [
    ("no sample", TAB, put("sample", None), "fault", "sample"),
    ("empty sample", TAB, put("sample", ""), "fault", "sample"),
    ("unknown key", TAB, put("colour", 1), "fault", "unknown field 'colour': did you mean 'color'?"),
    ("unknown key in a section", TAB, put("fibers.radius", 1), "fault", "unknown field 'fibers.radius'"),
    ("key in a wrong section", TAB, put("fit.voxel_size_um", 2), "fault", "unknown field 'fit.voxel_size_um': it belongs in 'volume'"),
    ("empty section", TAB, put("twin", {}), "fault", "'twin' is empty and would do nothing"),
    ("empty lamp", TAB, put("lamp", {}), "fault", "'lamp' is empty and would do nothing"),
    ("empty nuisance", TAB, put("fit.nuisance", {}), "fault", "'fit.nuisance' is empty and would do nothing"),
    ("empty candidates", TAB, put("fit.candidates", {}), "fault", "'fit.candidates' has no configurations and no grid"),
    ("text for a number", TAB, put("fibers.voxel_um", "5 um"), "fault", "'fibers.voxel_um' must be a number"),
    ("negative voxel", TAB, put("fibers.voxel_um", -5), "fault", "fibers.voxel_um"),
    ("no cloth", TAB, put("fibers", None), "fault", "volume"),
    ("two cloths", TAB, put("cloth", {"weave": "plain", "yarns": [{"fibers": 7}]}), "fault", "cloth"),
    ("unknown model", TAB, put("fit.model", "three_lobe.v1"), "fault", "three_lobe.v1"),
    ("mistyped model", TAB, put("fit.model", "two_lob.v1"), "fault", "'fit.model' is 'two_lob.v1': did you mean 'two_lobe.v1'?"),
    ("mistyped weave", WEAVE, put("cloth.weave", "pliain"), "fault", "did you mean 'plain'?"),
    ("unknown method", TAB, put("fit.method", "newton"), "fault", "newton"),
    ("unknown parameter", TAB, put("fit.fixed", {"beta_X": 5}), "fault", "beta_X"),
    ("parameter outside of its range", TAB, put("fit.start", {"beta_TT": 900}), "fault", "beta_TT"),
    ("path in a file name", TAB, put("measurements.file", "../rows.csv"), "fault", "file name"),
    ("backslash in a file name", TAB, put("measurements.file", "my\\rows.csv"), "fault", "file name"),
    ("table and photographs", PHO, put("measurements", {"file": "rows.csv"}), "fault", "measurements"),
    ("photograph without angles", PHO, put("photographs.1.light_theta_deg", None), "fault", "photographs[1].light_theta_deg"),
    ("lamp below the horizon", PHO, put("photographs.1.light_theta_deg", 120), "fault", "photographs[1].light_theta_deg"),
    ("camera behind the cloth", PHO, put("photographs.2.camera_theta_deg", 95), "fault", "photographs[2].camera_theta_deg"),
    ("unknown set", PHO, put("photographs.0.set", "train"), "fault", "photographs[0].set"),
    ("radians in photographs", PHO, radians, "fault", "look like radians"),
    ("radians in a table", TAB, rows(lambda v: [math.radians(a) for a in v[:5]] + v[5:]), "fault", "look like radians"),
    ("missing fibers", TAB, file("cloth.hair", None), "fault", "'cloth.hair' (fibers) does not exist"),
    ("missing table", TAB, file("rows.csv", None), "fault", "'rows.csv' (measurements) does not exist"),
    ("missing photograph", PHO, file("p2.exr", None), "fault", "'p2.exr' (photograph) does not exist"),
    ("empty table", TAB, file("rows.csv", b""), "fault", "'rows.csv' (measurements) is empty"),
    ("table of Excel", TAB, both(put("measurements.file", "rows.xlsx"), file("rows.xlsx", b"PK\3\4")), "fault",
     "'rows.xlsx', which by its ending is not a table"),
    ("photograph in the place of fibers", TAB, both(put("fibers.file", "p0.exr"), file("p0.exr", exr(8, 8, lambda x, y: (0.1, 0.1, 0.1)))),
     "fault", "fibers.file: 'fibers.file' is 'p0.exr', which by its ending is not fibers"),
    ("a document in the place of a photograph", PHO, both(put("photographs.1.file", "p1.pdf"), file("p1.pdf", b"%PDF-1.4")),
     "fault", "photographs[1].file: 'photographs[1].file' is 'p1.pdf', which by its ending is not a photograph"),
    ("a chart of another kind", PHO, both(put("color", {"chart": {"file": "chart.pdf"}}), file("chart.pdf", b"%PDF-1.4")),
     "fault", "'color.chart.file' is 'chart.pdf', which by its ending is not a photograph"),
    ("a white reference of another kind", PHO, both(put("color", {"white": {"file": "white.csv", "reflectance": 0.9}}), file("white.csv", b"a")),
     "fault", "'color.white.file' is 'white.csv', which by its ending is not a photograph"),
    ("a dark frame of another kind", PHO, both(put("camera", {"dark_frames": ["dark.json"]}), file("dark.json", b"{}")),
     "fault", "'camera.dark_frames[0]' is 'dark.json', which by its ending is not a photograph"),
    ("a record of noise of another kind", PHO, both(put("camera", {"noise_file": "noise.png"}), file("noise.png", b"x")),
     "fault", "'camera.noise_file' is 'noise.png', which by its ending is not a record"),
    ("a weave on a table", WEAVE, both(put("cloth.texture", "weave.csv"), file("weave.csv", b"a")),
     "fault", "'cloth.texture' is 'weave.csv', which by its ending is not a photograph"),
    ("a photograph without a weave", WEAVE, both(put("cloth.texture", "w.png"), file("w.png", png_rgb(128, lambda x, y: (90, 80, 70)))),
     "warning", "no texture that repeats"),
    ("a photograph of the weave that is none", WEAVE, both(put("cloth.texture", "w.png"), file("w.png", b"not a picture, but longer than sixteen bytes")),
     "fault", "w.png"),
    ("a goniometer's file without columns", TAB, both(put("measurements.file", "g.astm"), file("g.astm", b"NUM_POINTS 3\n1,2,3\n")),
     "fault", 'no line "VARS'),
    ("a BSDF of another program", TAB, both(put("measurements.file", "g.bsdf"), file("g.bsdf", b"Source  Measured\nSymmetry  PlaneSymmetrical\n")),
     "fault", "does not begin as an RGL file"),
    ("fibers that are none", TAB, file("cloth.hair", b"HARE" + bytes(124)), "fault", "cloth.hair"),
    ("truncated fibers", TAB, file("cloth.hair", hair()[:400]), "fault", "cloth.hair"),
    ("fibers in metres", TAB, file("cloth.hair", hair(tile_mm=2e-4, radius_mm=8e-6)), "warning", "wrong unit"),
    ("fibers in micrometres", TAB, file("cloth.hair", hair(tile_mm=200, radius_mm=8)), "warning", "a mean diameter of 1.6e+04 um"),
    ("fibers without a radius", TAB, both(put("fibers", {"file": "m.txt", "tile_mm": [0.2, 0.2]}), file("m.txt", b"0 0 0\n0.2 0 0\n")), "fault",
     "fibers.radius_um: cannot use fibers 'm.txt': the file states no radius"),
    ("two radii", TAB, put("fibers.radius_um", 8), "fault", "fibers.radius_um: cannot use fibers 'cloth.hair': the file states the radius"),
    ("a tile far larger than the fibers", TAB, put("fibers.tile_mm", [2, 2]), "warning", "the fibers extend over"),
    ("photograph that is text", PHO, file("p1.exr", b"not a picture at all, but longer than sixteen bytes"), "fault", "p1.exr"),
    ("truncated photograph", PHO, file("p1.exr", exr(16, 16, lambda x, y: (0.1, 0.1, 0.1))[:300]), "fault", "p1.exr"),
    ("black photograph", PHO, file("p1.exr", exr(16, 16, lambda x, y: (0, 0, 0))), "fault", "black"),
    ("photograph with NaN", PHO, file("p1.exr", exr(16, 16, lambda x, y: (math.nan, 0.1, 0.1))), "fault", "p1.exr"),
    ("crop outside of the picture", PHO, put("photographs.0.crop_px", [0, 0, 400, 400]), "fault", "crop"),
    ("PNG without a curve", PHO, both(put("photographs.0.file", "p0.png"), file("p0.png", png_rgb(16, lambda x, y: (90 + x, 80, 70)))), "fault", "transfer"),
    ("NaN in the table", TAB, line(3, "fit,45,0,45,180,0,nan,0.10,0.06"), "fault", "line 4"),
    ("negative radiance", TAB, line(3, "fit,45,0,45,180,0,-0.1,0.10,0.06"), "fault", "line 4"),
    ("too few cells", TAB, line(3, "fit,45,0,45,180"), "fault", "line 4"),
    ("unknown column", TAB, line(1, "set,light_theta_deg,light_phi_deg,camera_theta_deg,camera_phi_deg,turn,r,g,b"), "fault", "turn"),
    ("column in capitals", TAB, file("rows.csv", TABLE.replace(",r,g,b", ",R,G,B").encode()), "fault", "unknown column 'R': did you mean 'r'?"),
    ("mistyped column", TAB, file("rows.csv", TABLE.replace("light_theta_deg", "light_theta").encode()), "fault", "did you mean 'light_theta_deg'?"),
    ("fewer values than parameters", TAB, file("rows.csv", "\n".join(TABLE.split("\n")[:4]).encode()), "warning",
     "2 fitted rows have 6 values, and two_lobe.v1 has 9 parameters to fit"),
    ("no fitted row", TAB, file("rows.csv", TABLE.replace("fit,", "held-out,").encode()), "fault", "fit"),
    ("all rows dark", TAB, rows(lambda v: v[:5] + [x * 1e-3 for x in v[5:]]), "warning", "all rows are dark"),
    ("all rows above white", TAB, rows(lambda v: v[:5] + [x * 40 for x in v[5:]]), "warning", "all rows are above white"),
    ("values of a BRDF", TAB, many_rows(lambda cos: 0.2), "warning", "look like those of a BRDF"),
    ("values of a BRDF in six rows", TAB, many_rows(lambda cos: 0.2, 6), "warning", "look like those of a BRDF"),
    ("lamp and camera exchanged", TAB, grid(lambda lamp, camera: 0.3 * camera, lamp_phi=(0, 90)), "warning", "lamp and camera look exchanged"),
    ("lamp and camera exchanged, with a sheen", TAB, grid(lambda lamp, camera: 0.3 * camera * (1 + 0.5 * (1 - lamp) ** 3), lamp_phi=(0, 90)), "warning",
     "lamp and camera look exchanged"),
    ("isotropic data at rotation 0", TAB, grid(lambda lamp, camera: 0.3 * lamp), "warning", "write 'all' as cloth_rotation_deg"),
    ("one dark row", TAB, line(3, "fit,45,0,45,180,0,0.0001,0.0001,0.0001"), "warning", "is dark"),
    ("a mesh without texture", TAB, on_mesh(SHEET + b"f 1 2 3\n"), "fault", "pictures[1].mesh_file: "),
    ("a mesh that turns over", TAB, on_mesh(SHEET + b"f 1/1 2/3 3/2\n"), "fault", "pictures[1].mesh_file: "),
    ("a mesh of text", TAB, on_mesh(b"v zero 0 0\n"), "fault", "'sheet.obj', line 1"),
    ("a missing mesh", TAB, both(on_mesh(b""), file("sheet.obj", None)), "fault", "'sheet.obj' (mesh) does not exist"),
    ("rows that contradict each other", TAB, line(3, "fit,20,0,20,180,0,0.5,0.4,0.2"), "warning", "same angles"),
]


def write(folder, document, files):
    (folder / "job.json").write_text(json.dumps(document))
    for name, data in files.items():
        (folder / name).write_bytes(data)


def check(folder):
    done = subprocess.run([program("selvedge-worker"), "--check", str(folder / "job.json"), str(folder)], capture_output=True, text=True, check=False)
    assert done.returncode in (0, 1), done.stderr
    report = json.loads(done.stdout)
    assert (done.returncode == 1) == bool(report["faults"])
    return report


def test_the_table_is_long_enough():
    assert len(CASES) >= 40 and len({name for name, *_ in CASES}) == len(CASES)


@pytest.mark.parametrize("document", [TAB, PHO])
def test_good_input_has_no_fault_and_no_warning(tmp_path, document):
    write(tmp_path, document(), files_of(document()))
    report = check(tmp_path)
    assert report["faults"] == [] and report["warnings"] == [] and report["n_file"] >= 2
    write(tmp_path, document(), {**files_of(document()), "rows.csv": many_rows(lambda cos: 0.2 * cos) and files_of(document()).get("rows.csv", b"")})
    assert check(tmp_path)["warnings"] == []


# Grey radiances of a knitted cloth, rendered by selvedge-phantom with the start values of two_lobe.v1, in six rows each. The plain BRDF of
# twelve numbers describes them better, by chance, when they are taken for values of a BRDF.
KNIT = """70,0,70,150,0,0.2182 20,0,20,90,90,0.0425 45,0,45,180,90,0.0619 60,0,60,135,0,0.1066 75,0,75,180,0,0.7803 0,0,60,0,0,0.0608
40,0,40,45,90,0.0389 60,0,60,135,90,0.0677 45,0,20,90,0,0.0413 75,0,75,180,90,0.9892 40,0,40,45,90,0.0389 45,0,45,180,0,0.0677
60,0,0,180,0,0.0391 50,0,70,180,90,0.1571 60,0,0,90,0,0.0348 20,0,20,180,90,0.0414 40,0,40,45,90,0.0389 50,0,70,180,0,0.1676
30,0,30,135,0,0.0455 30,0,50,180,90,0.0682 40,0,40,45,90,0.0389 60,0,0,180,0,0.0391 50,0,70,180,0,0.1676 45,0,45,90,0,0.0430"""


@pytest.mark.parametrize("table", KNIT.split("\n"))
def test_six_correct_rows_are_not_taken_for_a_brdf(tmp_path, table):
    lines = ["set,light_theta_deg,light_phi_deg,camera_theta_deg,camera_phi_deg,cloth_rotation_deg,r,g,b"]
    for row in table.split():
        value = row.split(",")[-1]
        lines.append(f"fit,{row},{value},{value}")
    write(tmp_path, TAB(), {**files_of(TAB()), "rows.csv": ("\n".join(lines) + "\n").encode()})
    report = check(tmp_path)
    assert report["faults"] == [] and not any("BRDF" in w["detail"] for w in report["warnings"])


@pytest.mark.parametrize("name,document,change,kind,message", CASES, ids=[c[0] for c in CASES])
def test_bad_input_gets_a_message(tmp_path, name, document, change, kind, message):
    del name
    job = document()
    files = files_of(job)
    change(job, files)
    write(tmp_path, job, files)
    report = check(tmp_path)
    found = [f"{item['field']}: {item['detail']}" for item in report["faults" if kind == "fault" else "warnings"]]
    assert any(message in text for text in found), report
    assert all(len(text) < 900 for text in found)


@pytest.mark.parametrize("old,new,hint", [
    ('"sample": "bad",', '"sample": "bad" // mine\n,', "JSON has no comments"), ('"rows.csv"}', '"rows.csv",}', "the comma before it is one too many"),
    ('"sample": "bad",', '"sample": "bad"', "is a comma missing before it?"), ('"bad"', "'bad'", "JSON has double quotes only"),
    ('20000', 'None', "JSON has true, false and null")])
def test_a_slip_of_json_gets_a_hint(tmp_path, old, new, hint):
    write(tmp_path, table_job(), files_of(table_job()))
    text = (tmp_path / "job.json").read_text()
    assert old in text
    (tmp_path / "job.json").write_text(text.replace(old, new))
    (fault,) = check(tmp_path)["faults"]
    assert "not valid JSON: line 1" in fault["detail"] or "not valid JSON: line 2" in fault["detail"]
    assert hint in fault["detail"]


def test_a_byte_order_mark_is_no_fault(tmp_path):
    write(tmp_path, table_job(), files_of(table_job()))
    text = (tmp_path / "job.json").read_bytes()
    (tmp_path / "job.json").write_bytes(b"\xef\xbb\xbf" + text)
    assert check(tmp_path)["faults"] == []


def test_all_faults_come_at_once(tmp_path):
    job = table_job()
    files = files_of(job)
    for change in (put("sample", None), put("colour", 1), put("fibers.voxel_um", -5), put("fit.path_budget", "many"), file("rows.csv", None)):
        change(job, files)
    write(tmp_path, job, files)
    text = json.dumps(check(tmp_path)["faults"])
    assert all(word in text for word in ("sample", "colour", "fibers.voxel_um", "fit.path_budget", "rows.csv"))
    table = TABLE.replace("0.12,0.09,0.05", "nan,0.09,0.05")
    write(tmp_path, table_job(), {**files_of(table_job()), "rows.csv": table.encode()})
    faults = check(tmp_path)["faults"]
    assert {"line 3", "line 7"} <= {f"line {n}" for n in range(1, 9) for f in faults if f"line {n}" in f["detail"]}


def test_the_api_lists_all_faults_of_a_document(daemon):
    job = copy.deepcopy(photo_job())
    radians(job, {})
    job["sample"], job["colour"] = "", 1
    job["photographs"][1]["set"] = "train"
    reply = daemon.post("/v1/jobs", json=job)
    assert reply.status_code == 422
    errors = reply.json()["errors"]
    assert {e["field"] for e in errors} >= {"sample", "colour", "photographs[1].set", "photographs"}
    assert reply.json()["detail"] == errors[0]["detail"] or reply.json()["field"] in {e["field"] for e in errors}
    assert all(e["code"] == "invalid" and e["detail"] for e in errors)


def test_the_client_prints_all_faults(tmp_path):
    job = table_job()
    job["colour"] = 1
    write(tmp_path, job, {"cloth.hair": hair()})
    done = subprocess.run([program("selvedge"), "check", str(tmp_path / "job.json")], capture_output=True, text=True, check=False)
    assert done.returncode == 1 and "fault: unknown field 'colour'" in done.stdout and "'rows.csv' (measurements) does not exist" in done.stdout
    write(tmp_path, table_job(), files_of(table_job()))
    done = subprocess.run([program("selvedge"), "check", str(tmp_path / "job.json")], capture_output=True, text=True, check=False)
    assert done.returncode == 0 and "the job can be submitted" in done.stdout


def test_a_job_that_fails_names_all_faults_of_its_files(tmp_path):
    """Files are opened by the worker alone: a job that was submitted without `selvedge check` ends with the first fault and warns of the others."""
    job = photo_job()
    files = files_of(job)
    put("photographs.2.file", "p2.png")(job, files)
    files.update({"p0.exr": b"not a picture, but longer than sixteen bytes", "p2.png": png_rgb(16, lambda x, y: (90 + x, 80, 70))})
    (tmp_path / "input").mkdir()
    write(tmp_path / "input", job, files)
    (tmp_path / "input" / "job.json").rename(tmp_path / "job.json")
    done = subprocess.run([program("selvedge-worker"), "--quiet", str(tmp_path)], capture_output=True, text=True, check=False)
    status = json.loads((tmp_path / "status.json").read_text())
    assert done.returncode != 0 and status["error"]["field"] == "photographs[0].file"
    assert "'p0.exr'" in status["error"]["text"] and str(tmp_path) not in json.dumps(status)
    (other,) = [w for w in status["warnings"] if "wrong, too" in w]
    assert "photographs[2].file" in other and "transfer" in other
