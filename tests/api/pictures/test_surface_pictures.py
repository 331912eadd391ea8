"""Pictures of the fitted cloth on surfaces: what a job writes, and what is refused before the fit begins."""
import json
import math
import os
import signal
import struct
import subprocess
import time

import pytest
from daemon_under_test import problem, program
from small_cloth import TABLE, hair
from small_exr import exr

VIEW = {"light_theta_deg": 45, "light_phi_deg": 0, "camera_theta_deg": 45, "camera_phi_deg": 180, "px": 16, "samples": 16}
SHEET = "v -5 -5 0\nv 5 -5 0\nv 5 5 0\nv -5 5 0\nvt -5 -5\nvt 5 -5\nvt 5 5\nvt -5 5\n"


def document(*pictures):
    return {"sample": "pictures", "fibers": {"file": "cloth.hair"}, "measurements": {"file": "rows.csv"}, "pictures": list(pictures),
            "fit": {"model": "two_lobe.v1", "path_budget": 20000, "max_iterations": 1, "render_px": 16, "render_samples": 16}}


def run(real, doc, obj=None, layers=3):
    job = real.create(doc)
    real.upload(job, "cloth.hair", hair(layers=layers), "fibers")
    real.upload(job, "rows.csv", TABLE.encode(), "measurements")
    if obj is not None:
        real.upload(job, "sheet.obj", obj.encode(), "mesh")
    assert real.post(f"/v1/jobs/{job}/start").status_code == 202
    return job, real.wait_state(job, "succeeded", "failed", timeout_s=60)


def run_worker(folder):
    p = subprocess.run([program("selvedge-worker"), "--quiet", str(folder)], capture_output=True, timeout=600)
    assert p.returncode == 0, (folder / "log.txt").read_text()


def test_pictures_of_a_finished_fit(real):
    """The flat piece and a flat mesh show what the row of the same angles shows; the cylinder shows less light."""
    width = {"width_mm": 3, **VIEW}
    flat, mesh = {"on": "flat", **width}, {"on": "mesh", "mesh_file": "sheet.obj", **width}
    job, done = run(real, document(flat, mesh, {"on": "cylinder", "radius_mm": 1, **width}), SHEET + "f 1/1 2/2 3/3 4/4\n")
    assert done["state"] == "succeeded", done["error"]
    pictures = done["result"]["pictures"]
    assert [p["on"] for p in pictures] == ["flat", "mesh", "cylinder"]
    for i, p in enumerate(pictures, 1):
        assert p["file"] == f"pictures/on-{i}.exr" and p["noise"] > 0 and p["png_exposure"] > 0
        for ending, magic in (("exr", b"\x76\x2f\x31\x01"), ("png", b"\x89PNG")):
            assert real.get(f"/v1/jobs/{job}/results/pictures/on-{i}.{ending}").content.startswith(magic)
        assert json.loads(real.get(f"/v1/jobs/{job}/results/pictures/on-{i}.json").content) == p
    row = next(r for r in done["result"]["rows"] if (r["light_theta_deg"], r["camera_theta_deg"], r["camera_phi_deg"]) == (45, 45, 180))
    for p in pictures[:2]:
        se = p["noise"] * sum(p["mean"]) / 3 / 16  # of the mean of 16 x 16 pixels
        for mean, rendered, rendered_se in zip(p["mean"], row["rendered"], row["rendered_se"]):
            assert abs(mean - rendered) < 5 * math.hypot(se, rendered_se), (p, row)
    assert sum(pictures[2]["mean"]) < 0.9 * sum(pictures[0]["mean"]), "the cylinder fills only a part of the picture"


def test_a_finished_picture_is_not_rendered_again(tmp_path):
    """The worker by hand: a second run, which has lost the first picture's entry, renders that one alone."""
    folder = tmp_path / "job"
    (folder / "input").mkdir(parents=True)
    (folder / "job.json").write_text(json.dumps(document({"on": "flat", **VIEW}, {"on": "cylinder", "radius_mm": 1, **VIEW})))
    (folder / "input/cloth.hair").write_bytes(hair(layers=3))
    (folder / "input/rows.csv").write_text(TABLE)
    run_worker(folder)
    pictures = folder / "results/pictures"
    entry = json.loads((pictures / "on-1.json").read_text())
    (pictures / "on-1.json").unlink()
    for i in (1, 2):
        os.utime(pictures / f"on-{i}.exr", (1, 1))
    (folder / "work/report.done").unlink()
    run_worker(folder)
    assert (pictures / "on-1.exr").stat().st_mtime > 1, "its entry was lost"
    assert (pictures / "on-2.exr").stat().st_mtime == 1, "it was finished"
    assert json.loads((pictures / "on-1.json").read_text()) == entry, "the same seed makes the same picture"


@pytest.mark.slow
def test_a_picture_grows_in_passes_and_goes_on_where_it_was(tmp_path):
    """A run that is ended between two passes and one that is not make the same bits; what there was could be looked at."""
    given = {"sample": "s", "fibers": {"file": "cloth.hair"}, "pictures": [{"on": "flat", **VIEW, "samples": 4096}],
             "fit": {"model": "two_lobe.v1", "fixed": {"C_R": [0.1] * 3, "C_TT": [0.6] * 3, "beta_R": 6, "beta_TT": 12, "gamma_TT": 30}}}
    made = {}
    for name in ("whole", "ended"):
        folder = tmp_path / name
        (folder / "input").mkdir(parents=True)
        (folder / "job.json").write_text(json.dumps(given))
        (folder / "input/cloth.hair").write_bytes(hair(layers=3))
        entry = folder / "results/pictures/on-1.json"
        if name == "ended":
            worker = subprocess.Popen([program("selvedge-worker"), "--quiet", str(folder)])
            until = time.monotonic() + 60
            while not (entry.exists() and 16 <= json.loads(entry.read_text())["samples"]) and time.monotonic() < until:
                time.sleep(0.01)
            worker.send_signal(signal.SIGTERM)
            assert worker.wait(timeout=300) == 3, "it was cancelled"
            so_far = json.loads(entry.read_text())
            assert 16 <= so_far["samples"] < 4096 and so_far["noise"] > 0
            assert (folder / "results/pictures/on-1.png").read_bytes().startswith(b"\x89PNG")
            assert not (folder / "results/pictures/on-1.exr").exists(), "the picture with its variances is that of all samples"
        run_worker(folder)
        made[name] = [(folder / f"results/pictures/on-1{e}").read_bytes() for e in (".exr", ".json", "-columns.csv")]
        if name == "ended":
            assert json.loads(made[name][1])["noise"] < 0.5 * so_far["noise"] or so_far["samples"] >= 1024
    assert made["whole"] == made["ended"]
    entry, rows = json.loads(made["whole"][1]), made["whole"][2].decode().splitlines()
    assert entry["samples"] == 4096 and rows[0] == "x_mm,r,g,b,r_se,g_se,b_se" and len(rows) == 17
    columns = [[float(x) for x in row.split(",")] for row in rows[1:]]
    assert [c[0] for c in columns] == pytest.approx([40 * ((i + 0.5) / 16 - 0.5) for i in range(16)], rel=1e-5)
    assert [sum(c[k] for c in columns) / 16 for k in (1, 2, 3)] == pytest.approx(entry["mean"], rel=1e-4)


@pytest.mark.slow
def test_a_drape_with_and_without_the_black_sheet(real):
    """Lit from below, light comes through a drape without the sheet and none, but at its edges, with it."""
    below = {"on": "drape", "size_mm": 4, "radius_mm": 1, "width_mm": 4, **VIEW, "light_theta_deg": 150}
    job, done = run(real, document({**below, "black_sheet": False}, {**below, "black_sheet": True}, {**below, "light_theta_deg": 30}))
    assert done["state"] == "succeeded", done["error"]
    through, none, above = [sum(p["mean"]) for p in done["result"]["pictures"]]
    assert through > 5 * none, done["result"]["pictures"]
    assert above > 0
    files = {f["path"] for f in real.get(f"/v1/jobs/{job}/results").json()["files"]}
    assert "pictures/on-1.obj" in files and "pictures/on-2.obj" not in files, "one mesh for the same drape"
    mesh = real.get(f"/v1/jobs/{job}/results/pictures/on-1.obj").content
    assert mesh.count(b"\nv ") == mesh.count(b"\nvt ") == 257**2 and mesh.count(b"\nf ") == 256**2


@pytest.mark.slow
def test_a_cylinder_may_be_wrapped_all_around(real):
    """The lamp below: only a cloth that goes on around the cylinder shows light at its sides, the black sheet inside."""
    view = {"on": "cylinder", "radius_mm": 1, "width_mm": 3, **VIEW, "light_theta_deg": 100, "camera_theta_deg": 0, "samples": 64}
    _, done = run(real, document(view, {**view, "wrap_deg": 300}))
    assert done["state"] == "succeeded", done["error"]
    half, around = [sum(p["mean"]) for p in done["result"]["pictures"]]
    assert half > 0 and around > 0 and abs(half - around) < 0.5 * max(half, around)


@pytest.mark.parametrize("obj, words", [
    ("v 0 0 0\nf 1 1 1\n", ["picture 2", "sheet.obj", "line 2", "texture coordinates"]),
    (SHEET + "f 1/1 2/4 3/3\n", ["picture 2", "triangle 1", "mirrored"])])
def test_a_mesh_that_cannot_be_used_is_found_before_the_fit(real, obj, words):
    mesh = {"on": "mesh", "mesh_file": "sheet.obj", **VIEW}
    _, done = run(real, document({"on": "flat", **VIEW}, mesh), obj)
    assert done["state"] == "failed" and done["stage"] == "volume" and done["error"]["field"] == "pictures[1].mesh_file"
    assert all(w in done["error"]["text"] for w in words), done["error"]


@pytest.mark.parametrize("picture, option, words", [
    pytest.param({"on": "drape", "radius_mm": 1}, "radius_mm", "touch each other", marks=pytest.mark.slow),
    ({"on": "flat", "method": "diffusion"}, "method", "a pile")])
def test_a_surface_that_this_cloth_cannot_have_names_its_option(real, picture, option, words):
    _, done = run(real, document({"on": "flat", **VIEW}, {**VIEW, **picture}))
    assert done["state"] == "failed" and done["stage"] == "scene" and done["error"]["field"] == f"pictures[1].{option}", done["error"]
    assert words in done["error"]["text"]


@pytest.mark.parametrize("method", ["fast", "diffusion"])
def test_tables_have_the_sheet_of_the_job(real, method):
    doc = document({"on": "cylinder", **VIEW, "method": method, "black_sheet": False})
    assert "of the job" in problem(real.post("/v1/jobs", json=doc), 422, "invalid", "pictures[0].black_sheet")["detail"]
    assert real.post("/v1/jobs", json={**doc, "black_sheet": False}).status_code == 201


def test_a_black_picture_is_a_warning(real):
    """A camera 1 m above the orbit center does not see a cloth that lies 1.1 m above it."""
    mesh = {"on": "mesh", "mesh_file": "sheet.obj", **VIEW, "samples": 1}
    _, done = run(real, document(mesh, {"on": "flat", **VIEW, "width_mm": 3}), sheet_at(1100))
    assert done["state"] == "succeeded", done["error"]
    assert [w[:10] for w in done["warnings"] if "is black" in w] == ["picture 1 "], done["warnings"]


def sheet_at(z):
    return SHEET.replace(" 0\n", f" {z}\n") + "f 1/1 2/2 3/3 4/4\n"


def test_a_camera_inside_of_the_cloth_is_refused(real):
    """The mesh is the upper side of the cloth, which is 0.1 mm thick: the camera stands 0.03 mm below it, then 2 mm."""
    above = {"on": "mesh", "mesh_file": "sheet.obj", **VIEW, "camera_theta_deg": 0, "width_mm": 3}
    for z, word in ((1000.03, "camera"), (610.03, "lamp"), (1002, None)):
        _, done = run(real, document({**above, "light_theta_deg": 0}), sheet_at(z))
        if word is None:
            assert done["state"] == "succeeded", done["error"]
            continue
        assert done["state"] == "failed" and done["stage"] == "scene" and done["error"]["field"] == "pictures[0].mesh_file"
        assert f"the {word}, " in done["error"]["text"] and "inside the cloth" in done["error"]["text"], done["error"]


def test_a_mesh_that_runs_through_itself_gives_a_warning(real):
    upright = "v 0.5 -5 -5\nv 0.5 5 -5\nv 0.5 5 5\nv 0.5 -5 5\n"
    both = SHEET + upright + "f 1/1 2/2 3/3 4/4\nf 5/1 6/2 7/3 8/4\n"
    _, done = run(real, document({"on": "mesh", "mesh_file": "sheet.obj", **VIEW}), both)
    assert done["state"] == "succeeded" and any("picture 1: parts of the mesh run through each other" in w for w in done["warnings"]), done


def test_a_cylinder_thinner_than_the_cloth_is_refused(real):
    _, done = run(real, document({"on": "cylinder", "radius_mm": 0.1, **VIEW}))  # the cloth is that thick, nearly
    assert done["state"] == "succeeded", done["error"]
    _, done = run(real, document({"on": "cylinder", "radius_mm": 0.1, **VIEW}), layers=6)
    assert done["state"] == "failed" and "folds over itself" in done["error"]["text"] and done["error"]["field"] == "pictures[0].radius_mm", done["error"]


@pytest.mark.parametrize("picture, field, word", [
    ({"on": "mesh", **VIEW}, "pictures[0].mesh_file", "missing"),
    ({"on": "flat", "mesh_file": "a.obj", **VIEW}, "pictures[0].mesh_file", "not \"mesh\""),
    ({"on": "sphere", **VIEW}, "pictures[0].on", "cylinder"),
    ({"on": "flat", **VIEW, "width_mm": 5000}, "pictures[0].width_mm", "camera.distance_cm"),
    ({"on": "flat", **VIEW, "light_theta_deg": 120}, "pictures[0].light_theta_deg", "black_sheet"),
    ({"on": "flat", **VIEW, "light_theta_deg": 90, "black_sheet": False}, "pictures[0].light_theta_deg", "below 90"),
    ({"on": "drape", **VIEW, "size_mm": 40, "radius_mm": 0.5}, "pictures[0].radius_mm", "0.8 to 400 mm"),
    ({"on": "mesh", "mesh_file": "a.png", **VIEW}, "pictures[0].mesh_file", "a mesh: .obj")])
def test_bad_pictures_are_refused_at_submission(real, picture, field, word):
    assert word in problem(real.post("/v1/jobs", json=document(picture)), 422, "invalid", field)["detail"]


@pytest.mark.slow
def test_pictures_of_given_parameters(real):
    """What a fit has found, given as fixed parameters, makes the same picture, but for the noise; nothing is fitted."""
    flat = {"on": "flat", "width_mm": 3, **VIEW, "samples": 64}
    job, done = run(real, document(flat))
    fitted = done["result"]
    values = {p["name"]: p["value"] for p in fitted["parameters"]}
    given = {"sample": "given", "fibers": {"file": "cloth.hair"}, "pictures": [flat], "fit": {"model": "two_lobe.v1", "fixed": values}}
    second = real.create(given)
    real.upload(second, "cloth.hair", real.get(f"/v1/jobs/{job}/results/fibers.hair").content, "fibers")
    assert real.post(f"/v1/jobs/{second}/start").status_code == 202
    shown = real.wait_state(second, "succeeded", timeout_s=60)["result"]
    assert shown["model"] == "two_lobe.v1" and shown["method"] is None and shown["rows"] == shown["models"] == []
    assert {p["name"]: p["value"] for p in shown["parameters"]} == pytest.approx(values, rel=1e-12)
    assert all(p["fixed"] and p["standard_error"] is None for p in shown["parameters"])
    wall_s = {s["name"]: s["wall_s"] for s in shown["stages"]}
    assert wall_s["fit"] is None and wall_s["validation"] is None and wall_s["scene"] is not None
    a, b = fitted["pictures"][0], shown["pictures"][0]
    for x, y in zip(a["mean"], b["mean"]):  # 16 x 16 pixels, and the file's rounding of the axes
        assert abs(x - y) < 5 * math.hypot(a["noise"], b["noise"]) * sum(a["mean"]) / 3 / 16 + 1e-3 * x
    page = real.get(f"/v1/jobs/{second}/results/report.html").text
    assert "Given parameters" in page and "The cloth on surfaces" in page and page.count("data:image/png") == 3  # on the first page, its geometry, in the list
    assert "with given parameters" in real.get(f"/v1/jobs/{second}/results/summary.txt").text


def test_a_volume_model_on_a_cylinder(real):
    """Fixed parameters of microflakes; the flat piece has the mean of a flat mesh."""
    view = {"width_mm": 3, **VIEW}
    pictures = [{"on": "flat", **view}, {"on": "mesh", "mesh_file": "sheet.obj", **view}, {"on": "cylinder", "radius_mm": 1, **view}]
    doc = {"sample": "volume", "fibers": {"file": "cloth.hair"}, "pictures": pictures,
           "fit": {"model": "microflake.v1", "density_multiplier_per_cm": 3000, "fixed": {"alpha": [0.9, 0.8, 0.7], "gamma": 0.3}}}
    job = real.create(doc)
    real.upload(job, "cloth.hair", hair(layers=3), "fibers")
    real.upload(job, "sheet.obj", (SHEET + "f 1/1 2/2 3/3 4/4\n").encode(), "mesh")
    assert real.post(f"/v1/jobs/{job}/start").status_code == 202
    done = real.wait_state(job, "succeeded", "failed", timeout_s=60)
    assert done["state"] == "succeeded", done["error"]
    flat, mesh, cylinder = done["result"]["pictures"]
    se = math.hypot(flat["noise"] * sum(flat["mean"]), mesh["noise"] * sum(mesh["mean"])) / 3 / 16
    assert flat["mean"][0] > flat["mean"][2] > 0 and sum(cylinder["mean"]) < 0.9 * sum(flat["mean"])
    assert all(abs(a - b) < 5 * se for a, b in zip(flat["mean"], mesh["mean"])), done["result"]["pictures"]


@pytest.mark.slow
def test_a_twin_is_written_as_its_description_says(real):
    """The only test of the worker's tables as a file; their numbers are those of tests/unit/renderer/preview."""
    flat = {"on": "flat", "width_mm": 3, **VIEW, "samples": 2}
    job, done = run(real, {**document(flat), "twin": {"make": True, "paths": 4000, "texels": 16}})
    assert done["state"] == "succeeded", done["error"]
    twin = json.loads(real.get(f"/v1/jobs/{job}/results/twin/twin.json").content)
    data = real.get(f"/v1/jobs/{job}/results/twin/twin.bin").content
    textures, table, drape = (twin["parts"][k] for k in ("textures", "table", "drape"))
    lobes, fibers = twin["parts"]["lobes"], twin["parts"]["fibers"]
    assert twin["format"] == "selvedge-twin.v2" and len(data) == twin["bytes"] == fibers["offset"] + 32 * fibers["points"]
    assert drape["offset"] == 0 and 6 * drape["points"]**2 <= textures["offset"] < 6 * drape["points"]**2 + 8
    n_texel = textures["width"] * textures["height"]
    weights = struct.unpack_from(f"<{textures['n'] * n_texel}e", data, textures["offset"])
    assert textures["n"] == 16 and n_texel == 16 and all(weights[4 * i] == 1 for i in range(n_texel)), "W_0 is 1"
    assert abs(sum(weights[4 * i + 1] for i in range(n_texel))) < 0.1 and abs(sum(weights[4 * i + 1]**2 for i in range(n_texel)) - n_texel) < 0.1
    n = (table["view_edge"] * table["light_edge"])**2
    assert table["sides"] == 1 and lobes["offset"] - table["offset"] == 2 * 3 * textures["n"] * n
    means = struct.unpack_from(f"<{4 * n}e", data, table["offset"])[::4]
    assert min(means) >= 0 and sum(means) > 0, "T_0 of red"
    words = struct.unpack_from(f"<{8 * fibers['points']}I", data, fibers["offset"])
    assert words[8 * fibers["points"] - 6] >> 31 and any(words[4::8]) and not any(words[6::8]), "the last line ends; a black sheet lies below"
    row = next(r for r in done["result"]["rows"] if (r["light_theta_deg"], r["camera_theta_deg"]) == (45, 45))
    assert 0.1 * row["rendered"][0] < 0.5 * sum(means) / n < 10 * row["rendered"][0]


def test_a_twin_needs_a_model(real):
    doc = {"sample": "s", "volume": {"files": ["a.tif"], "voxel_size_um": 2}, "twin": {"make": True}}
    assert "photographs" in problem(real.post("/v1/jobs", json=doc), 422, "invalid", "twin.make")["detail"]


def render(real, *words):
    return subprocess.run([program("selvedge"), "render", *map(str, words)], env=dict(os.environ, SELVEDGE_SERVER=real.url),
                          capture_output=True, text=True, timeout=600)


def test_the_command_renders_a_finished_job(real, tmp_path):
    job, done = run(real, {k: v for k, v in document().items() if k != "pictures"})
    (tmp_path / "sheet.obj").write_text(SHEET + "f 1/1 2/2 3/3 4/4\n")
    shown = render(real, job, "--on", tmp_path / "sheet.obj", "--lamp", "45,0", "--camera", "45,180", "--px", 16, "--samples", 64,
                   "--width-mm", 3, "--out", tmp_path / "out")
    assert shown.returncode == 0, shown.stderr
    picture = json.loads((tmp_path / "out/pictures/on-1.json").read_text())
    row = next(r for r in done["result"]["rows"] if (r["light_theta_deg"], r["camera_theta_deg"], r["camera_phi_deg"]) == (45, 45, 180))
    se = picture["noise"] * sum(picture["mean"]) / 3 / 16
    for mean, rendered, rendered_se in zip(picture["mean"], row["rendered"], row["rendered_se"]):
        assert abs(mean - rendered) < 5 * math.hypot(se, rendered_se)
    assert sorted(f for f in os.listdir(tmp_path)) == ["out", "sheet.obj"]
    assert f"mean radiance {picture['mean'][0]:.4g} " in shown.stdout and f"noise of a pixel {100 * picture['noise']:.0f} %" in shown.stdout


def test_the_command_takes_the_light_of_the_job(real, tmp_path):
    """Lamp and environment, also that of an image, so that the picture is the one that the job itself would make."""
    around = {"radiance": [0.2, 0.1, 0.3], "file": "sky.exr"}
    view = {"on": "flat", "width_mm": 3, **VIEW}
    doc = {**document(view), "environment": around, "lamp": {"kind": "directional"}}
    sky = exr(4, 2, lambda x, y: (0.5, 0.25, 0.0))
    job = real.create(doc)
    for name, data, role in (("cloth.hair", hair(layers=3), "fibers"), ("rows.csv", TABLE.encode(), "measurements"), ("sky.exr", sky, "environment")):
        real.upload(job, name, data, role)
    assert real.post(f"/v1/jobs/{job}/start").status_code == 202
    own = real.wait_state(job, "succeeded", "failed", timeout_s=60)["result"]["pictures"][0]
    shown = render(real, job, "--on", "flat", "--lamp", "45,0", "--camera", "45,180", "--px", 16, "--samples", 16, "--width-mm", 3, "--out", tmp_path / "out")
    assert shown.returncode == 0, shown.stderr
    made = json.loads((tmp_path / "out/result.json").read_text())["pictures"][0]
    assert made["mean"] == pytest.approx(own["mean"], abs=5 * own["noise"] * sum(own["mean"]) / 3 / 16)
    dark = render(real, job, "--on", "flat", "--lamp", "45,0", "--visibility", "tables", "--out", tmp_path / "none")
    assert dark.returncode != 0 and "visibility" in dark.stderr


def test_what_the_command_refuses(real, tmp_path):
    draft = real.create(document({"on": "flat", **VIEW}))
    cases = [([draft], "no fitted model"), ([draft, "--on", "sphere"], "NAME.obj"), ([draft, "--lamp", "45"], "such as 45,180"),
             ([draft, "--px", "1.5"], "whole number"), ([draft, "--black-sheet", "maybe"], "yes or no"),
             ([draft, "--twin", "perhaps"], "yes or no"), ([draft, "--lamp-sharpness", "soft"], "takes a number"),
             ([draft, "--json"], "has no option '--json'"), (["nonsense"], "nonsense")]
    for words, said in cases:
        refused = render(real, *words)
        assert refused.returncode != 0 and said in refused.stderr, refused.stderr


@pytest.mark.parametrize("change, field, word", [
    ({"fit": None}, "pictures", "fit.fixed"), ({"fit": {"fixed": {"C_R": 0.2}}}, "fit.fixed", "lacks"),
    ({"fit": {"models": ["two_lobe.v1", "textile.v3"]}}, "fit.models", "show one"),
    ({"fit": {"model": "microflake.v1"}}, "fit.fixed", "lacks"), ({"correction": {"radius": {"fit": True}}}, "photographs", "missing"),
    ({"export": {"mitsuba": True}}, "export.mitsuba", "fitted model")])
def test_what_pictures_without_photographs_need(real, change, field, word):
    doc = {"sample": "s", "fibers": {"file": "a.hair"}, "pictures": [{"on": "flat", **VIEW}], "fit": {"model": "two_lobe.v1"}, **change}
    doc = {k: v for k, v in doc.items() if v is not None}
    assert word in problem(real.post("/v1/jobs", json=doc), 422, "invalid", field)["detail"]


def test_the_command_makes_a_turntable(real, tmp_path):
    job, _ = run(real, {k: v for k, v in document().items() if k != "pictures"})
    words = ["--turntable", "--kind", "swatch", "--px", 16, "--samples", 2, "--deep-light-paths", 2000, "--out", tmp_path / "out"]
    refused = render(real, job, "--turntable", "--lamp", "45,0")
    assert refused.returncode != 0 and "not for '--turntable'" in refused.stderr
    shown = render(real, job, *words)
    assert shown.returncode == 0, shown.stderr
    assert "turntable.webp: 24 pictures of a turn in 6 s" in shown.stdout
    data = (tmp_path / "out/turntable.webp").read_bytes()
    assert data[:4] == b"RIFF" and data[8:16] == b"WEBPVP8X" and int.from_bytes(data[4:8], "little") == len(data) - 8
    at = data.index(b"ANIM")
    assert data[at + 12:at + 14] == b"\0\0", "it loops for ever"
    image = pytest.importorskip("PIL.Image", reason="python3-pil is not installed")
    made = image.open(tmp_path / "out/turntable.webp")
    assert made.size == (16, 16) and made.n_frames > 12, "equal frames are joined"
