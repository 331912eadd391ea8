"""Pictures that are not rendered path by path: by tables, by dual scattering, and beside their reference."""
import json
import math
import os
import struct
import subprocess

import jsonschema
import pytest
from daemon_under_test import ROOT, problem, program
from small_cloth import hair
from test_surface_pictures import VIEW, document, render, run, run_worker


def test_methods_show_the_same_cloth(tmp_path):
    """By tables the means are near those of path tracing; the tables are kept."""
    folder = tmp_path / "job"
    (folder / "input").mkdir(parents=True)
    view = {"on": "flat", "width_mm": 3, **VIEW, "samples": 64}
    given = {"sample": "s", "fibers": {"file": "cloth.hair"},
             "pictures": [{**view, "method": "path"}, {**view, "method": "fast", "deep_light_paths": 100000}],
             "fit": {"model": "isotropic.v1", "fixed": {"C": [0.8, 0.5, 0.3]}}}
    (folder / "job.json").write_text(json.dumps(given))
    (folder / "input/cloth.hair").write_bytes(hair(layers=3))
    run_worker(folder)
    path, fast = (json.loads((folder / f"results/pictures/on-{i}.json").read_text()) for i in (1, 2))
    assert [p["method"] for p in (path, fast)] == ["path", "fast"]
    assert (folder / "work/report/fast.tables").read_bytes().startswith(b"SELVFAST")
    mean = sum(path["mean"]) / 3
    assert abs(sum(fast["mean"]) / 3 - mean) < 0.1 * mean
    assert fast["noise"] < path["noise"]


@pytest.mark.slow
def test_a_gaussian_lamp_lights_every_method(tmp_path):
    """Sharp, it is the parallel light of the job. By tables of what segments see, the picture is near the traced one."""
    folder = tmp_path / "job"
    (folder / "input").mkdir(parents=True)
    view = {"on": "flat", "width_mm": 3, **VIEW, "samples": 64}
    soft = {**view, "lamp_sharpness": 40}
    given = {"sample": "s", "fibers": {"file": "cloth.hair"}, "lamp": {"kind": "directional"},
             "pictures": [view, {**view, "lamp_sharpness": 50000}, soft, {**soft, "method": "fast", "deep_light_paths": 100000},
                          {**soft, "method": "fast", "visibility": "tables"}],
             "fit": {"model": "two_lobe.v1", "fixed": {"C_R": [0.1] * 3, "C_TT": [0.6, 0.4, 0.2], "beta_R": 10, "beta_TT": 30, "gamma_TT": 40}}}
    (folder / "job.json").write_text(json.dumps(given))
    (folder / "input/cloth.hair").write_bytes(hair(layers=3))
    run_worker(folder)
    shown = json.loads((folder / "results/result.json").read_text())["pictures"]
    mean = [sum(p["mean"]) / 3 for p in shown]
    se = [p["noise"] * m / VIEW["px"] for p, m in zip(shown, mean)]
    assert abs(mean[1] - mean[0]) < 5 * math.hypot(se[0], se[1]) < 0.1 * mean[0]
    assert abs(mean[2] - mean[0]) > 5 * math.hypot(se[0], se[2]), "a soft lamp is seen to be soft"
    assert abs(mean[3] - mean[2]) < 0.1 * mean[2] and abs(mean[4] - mean[2]) < 0.2 * mean[2]
    given["pictures"] = [{**view, "lamp_sharpness": 0.5}]
    (folder / "job.json").write_text(json.dumps(given))
    p = subprocess.run([program("selvedge-worker"), "--quiet", str(folder)], capture_output=True, timeout=300)
    assert p.returncode == 1 and "pictures[0].lamp_sharpness" in (folder / "status.json").read_text()


def test_dual_scattering_is_a_method_like_the_others(tmp_path):
    """On a cylinder with a sheet of its own and compared with path tracing: darker than that, and with less noise."""
    folder = tmp_path / "job"
    (folder / "input").mkdir(parents=True)
    view = {"on": "cylinder", "radius_mm": 1, "width_mm": 3, **VIEW, "samples": 64, "method": "dual"}
    given = {"sample": "s", "fibers": {"file": "cloth.hair"}, "pictures": [{**view, "reference": True}, {**view, "black_sheet": False}],
             "fit": {"model": "two_lobe.v1", "fixed": {"C_R": [0.1] * 3, "C_TT": [0.6, 0.4, 0.2], "beta_R": 6, "beta_TT": 12, "gamma_TT": 30}}}
    (folder / "job.json").write_text(json.dumps(given))
    (folder / "input/cloth.hair").write_bytes(hair(layers=3))
    run_worker(folder)
    first, second = (json.loads((folder / f"results/pictures/on-{i}.json").read_text()) for i in (1, 2))
    assert first["method"] == second["method"] == "dual" and not (folder / "work/report/fast.tables").exists()
    assert "reference" not in second and first["reference"]["noise"] > first["noise"]
    for dual, path in zip(first["mean"], first["reference"]["mean"]):
        assert 0.5 * path < dual < 1.1 * path, first
    assert (folder / "results/pictures/on-1-reference.png").exists() and (folder / "results/pictures/on-2.exr").exists()
    with open(os.path.join(ROOT, "config", "result.schema.json"), encoding="utf-8") as text:
        jsonschema.Draft202012Validator(json.load(text)).validate(json.loads((folder / "results/result.json").read_text()))


VELVET = {"weave": "velvet", "pile_height_um": 200, "tile_warps": 2, "tile_wefts": 2, "yarns": [{"fibers": 8, "fiber_radius_um": 8}] * 2}


def test_a_pile_by_diffusion(tmp_path):
    """A velvet on a cylinder: near path tracing in its mean, with less noise. A cloth without a pile is refused by name."""
    folder = tmp_path / "job"
    (folder / "input").mkdir(parents=True)
    view = {"on": "cylinder", "radius_mm": 2, "width_mm": 3, **VIEW, "samples": 64, "method": "diffusion", "reference": True}
    given = {"sample": "s", "cloth": VELVET, "pictures": [view],
             "fit": {"model": "two_lobe.v1", "fixed": {"C_R": [0.1] * 3, "C_TT": [0.8, 0.6, 0.4], "beta_R": 8, "beta_TT": 20, "gamma_TT": 40}}}
    (folder / "job.json").write_text(json.dumps(given))
    run_worker(folder)
    picture = json.loads((folder / "results/pictures/on-1.json").read_text())
    reference = picture["reference"]
    assert picture["method"] == "diffusion" and picture["noise"] < reference["noise"]
    for shown, path in zip(picture["mean"], reference["mean"]):
        assert 0.75 * path < shown < 1.25 * path, picture
    for change, text in (({"cloth": {"weave": "plain"}}, "picture 1: the method diffusion is for a cloth with a pile, and this one has none"),
                         ({"pictures": [{**view, "black_sheet": True}], "black_sheet": False}, "black sheet of the job")):
        other = tmp_path / text[:7]
        (other / "input").mkdir(parents=True)
        (other / "job.json").write_text(json.dumps({**given, **change}))
        p = subprocess.run([program("selvedge-worker"), "--quiet", str(other)], capture_output=True, timeout=300)
        assert p.returncode == 1 and text in json.loads((other / "status.json").read_text())["error"]["text"]


def test_a_filtered_view_stands_beside_the_picture(tmp_path):
    """The same picture with and without it: only the file and its mark differ. What is lost of it is made again."""
    made, view = {}, {"on": "cylinder", "radius_mm": 1, "width_mm": 3, **VIEW}
    for name, filtered in (("with", True), ("without", False)):
        folder = tmp_path / name
        (folder / "input").mkdir(parents=True)
        given = {"sample": "s", "fibers": {"file": "cloth.hair"}, "pictures": [{**view, "filter": filtered}],
                 "fit": {"model": "two_lobe.v1", "fixed": {"C_R": [0.1] * 3, "C_TT": [0.6] * 3, "beta_R": 6, "beta_TT": 12, "gamma_TT": 30}}}
        (folder / "job.json").write_text(json.dumps(given))
        (folder / "input/cloth.hair").write_bytes(hair(layers=3))
        run_worker(folder)
        made[name] = folder / "results/pictures"
    a, b = (json.loads((made[name] / "on-1.json").read_text()) for name in ("with", "without"))
    view = a.pop("filtered")
    assert view.pop("error") > 0 and view == {"file": "pictures/on-1-filtered.png", "filter": "joint.v3"} and a == b
    for file in ("on-1.exr", "on-1.png", "on-1-columns.csv"):
        assert (made["with"] / file).read_bytes() == (made["without"] / file).read_bytes()
    png = (made["with"] / "on-1-filtered.png").read_bytes()
    assert png.startswith(b"\x89PNG") and png != (made["with"] / "on-1.png").read_bytes()
    assert not (made["without"] / "on-1-filtered.png").exists()
    (made["with"] / "on-1-filtered.png").unlink()
    (made["with"] / "on-1.json").write_text(json.dumps(a))
    (tmp_path / "with/work/report.done").unlink()
    run_worker(tmp_path / "with")
    assert (made["with"] / "on-1-filtered.png").read_bytes() == png and "filtered" in json.loads((made["with"] / "on-1.json").read_text())


def test_fibers_without_tables_are_path_traced(tmp_path):
    folder = tmp_path / "job"
    (folder / "input").mkdir(parents=True)
    given = {"sample": "s", "fibers": {"file": "cloth.hair"}, "pictures": [{"on": "flat", **VIEW, "method": "dual", "filter": True}],
             "fit": {"model": "microflake.v1", "density_multiplier_per_cm": 3000, "fixed": {"alpha": [0.9, 0.8, 0.7], "gamma": 0.3}}}
    (folder / "job.json").write_text(json.dumps(given))
    (folder / "input/cloth.hair").write_bytes(hair(layers=3))
    run_worker(folder)
    result = json.loads((folder / "results/result.json").read_text())
    assert result["pictures"][0]["method"] == "path" and any("no tables" in w for w in result["warnings"]), result["warnings"]
    assert "filtered" not in result["pictures"][0] and any("picture 1 is not filtered" in w for w in result["warnings"])


def test_a_sheet_of_its_own_has_no_tables(tmp_path):
    folder = tmp_path / "job"
    (folder / "input").mkdir(parents=True)
    given = {"sample": "s", "fibers": {"file": "cloth.hair"}, "black_sheet": True,
             "pictures": [{"on": "flat", **VIEW, "method": "fast", "deep_light": "cells", "black_sheet": False}],
             "fit": {"model": "isotropic.v1", "fixed": {"C": [0.8, 0.5, 0.3]}}}
    (folder / "job.json").write_text(json.dumps(given))
    (folder / "input/cloth.hair").write_bytes(hair(layers=3))
    p = subprocess.run([program("selvedge-worker"), "--quiet", str(folder)], capture_output=True, timeout=600)
    assert p.returncode == 1
    assert "black sheet of the job" in json.loads((folder / "status.json").read_text())["error"]["text"]


CELLS = {"on": "flat", **VIEW, "method": "fast", "deep_light": "cells"}


def test_cells_have_an_order_and_an_edge(tmp_path):
    """The table of cells is made as the document says; its head states order and cells (renderer/fast/fast_tables_file.c)."""
    made = {}
    for name, more in (("standard", {}), ("order", {"cell_order": 2}), ("edge", {"cell_paths": 4})):
        folder = tmp_path / name
        (folder / "input").mkdir(parents=True)
        (folder / "job.json").write_text(json.dumps({"sample": "s", "fibers": {"file": "cloth.hair"}, "pictures": [{**CELLS, **more}],
                                                     "fit": {"model": "isotropic.v1", "fixed": {"C": [0.8, 0.5, 0.3]}}}))
        (folder / "input/cloth.hair").write_bytes(hair(layers=3))
        run_worker(folder)
        head = (folder / "work/report/fast.tables").read_bytes()[64:88]
        made[name] = struct.unpack("<6I", head)
        assert json.loads((folder / "results/result.json").read_text())["pictures"][0]["method"] == "fast"
    order = {name: m[0] for name, m in made.items()}
    cells = {name: m[3:] for name, m in made.items()}
    assert order == {"standard": 4, "order": 2, "edge": 4}
    assert cells["order"] == cells["standard"] and math.prod(cells["edge"]) < 0.6 * math.prod(cells["standard"]), cells


@pytest.mark.parametrize("pictures, field, words", [
    ([{**CELLS, "deep_light": "directions", "cell_order": 3}], "pictures[0].cell_order", "no light from cells"),
    ([CELLS, {**CELLS, "cell_paths": 3}], "pictures[1].cell_paths", "another than"),
    ([{**CELLS, "cell_order": 7}], "pictures[0].cell_order", "6")])
def test_cells_are_shared(real, pictures, field, words):
    document = {"sample": "s", "fibers": {"file": "cloth.hair"}, "pictures": pictures,
                "fit": {"model": "isotropic.v1", "fixed": {"C": [0.8, 0.5, 0.3]}}}
    assert words in problem(real.post("/v1/jobs", json=document), 422, "invalid", field)["detail"]


@pytest.mark.slow
def test_a_picture_beside_its_reference(tmp_path):
    """The comparison follows from the two pictures; a run that has lost it makes it again, with the same bits."""
    folder = tmp_path / "job"
    (folder / "input").mkdir(parents=True)
    view = {"on": "flat", "width_mm": 3, **VIEW, "samples": 64, "reference": True}
    given = {"sample": "s", "fibers": {"file": "cloth.hair"},
             "pictures": [{**view, "method": "fast", "deep_light_paths": 100000}, {**view, "method": "dual"}],
             "fit": {"model": "isotropic.v1", "fixed": {"C": [0.8, 0.5, 0.3]}}}
    (folder / "job.json").write_text(json.dumps(given))
    (folder / "input/cloth.hair").write_bytes(hair(layers=3))
    run_worker(folder)
    pictures = folder / "results/pictures"
    for i in (1, 2):
        p = json.loads((pictures / f"on-{i}.json").read_text())
        r = p["reference"]
        assert r["file"] == f"pictures/on-{i}-reference.exr" and r["samples"] == 64
        assert (pictures / f"on-{i}-reference.png").read_bytes().startswith(b"\x89PNG")
        brightness = sum(r["mean"]) / 3
        assert r["mean_difference"] == pytest.approx([(a - b) / brightness for a, b in zip(p["mean"], r["mean"])], abs=1e-5)
        both = math.hypot(p["noise"] * sum(p["mean"]) / 3, r["noise"] * brightness) / brightness
        assert math.sqrt(sum(s * s for s in r["mean_difference_se"]) / 3) == pytest.approx(both / 16, rel=1e-3)
        assert r["field_noise"] == pytest.approx(both / 4, rel=1e-3), "all fields are lit: 16 pixels each"
    with open(os.path.join(ROOT, "config", "result.schema.json"), encoding="utf-8") as text:
        jsonschema.Draft202012Validator(json.load(text)).validate(json.loads((folder / "results/result.json").read_text()))
    whole = (pictures / "on-1.json").read_bytes()
    lost = json.loads(whole)
    del lost["reference"]
    (pictures / "on-1.json").write_text(json.dumps(lost))
    (folder / "work/report.done").unlink()
    os.utime(pictures / "on-1.exr", (1, 1))
    run_worker(folder)
    assert (pictures / "on-1.json").read_bytes() == whole


def test_a_path_traced_picture_is_its_own_reference(real):
    doc = {"sample": "s", "fibers": {"file": "a.hair"}, "pictures": [{"on": "flat", **VIEW, "reference": True}], "fit": {"model": "two_lobe.v1"}}
    assert "method" in problem(real.post("/v1/jobs", json=doc), 422, "invalid", "pictures[0].reference")["detail"]


@pytest.mark.slow
def test_the_command_prints_the_comparison(real, tmp_path):
    job, _ = run(real, {k: v for k, v in document().items() if k != "pictures"})
    shown = render(real, job, "--on", "flat", "--px", 16, "--samples", 16, "--width-mm", 3, "--reference", "--deep-light", "cells", "--out", tmp_path / "out")
    assert shown.returncode == 0, shown.stderr
    picture = json.loads((tmp_path / "out/pictures/on-1.json").read_text())
    assert picture["method"] == "fast"
    assert f"{100 * picture['reference']['field_difference_rms']:.2f} % root mean square" in shown.stdout, shown.stdout
    assert f"mean radiance in blue: {100 * picture['reference']['mean_difference'][2]:+.2f} %" in shown.stdout
