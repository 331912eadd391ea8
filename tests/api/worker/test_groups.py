"""Cloths of several groups of fibers, each with scattering parameters of its own: from the fiber file or the described
yarns to the result, and both groups recovered from photographs in reflection and transmission."""
import json
import os
import struct
import subprocess

import pytest
from daemon_under_test import program
from small_cloth import TABLE, start_small_job

pytestmark = [pytest.mark.slow, pytest.mark.skipif(not os.access(program("selvedge-worker"), os.X_OK), reason="no selvedge-worker in the build folder")]
OWN = ["C_R.r", "C_R.g", "C_R.b", "C_TT.r", "C_TT.g", "C_TT.b", "beta_R", "beta_TT", "gamma_TT"]
FIT = {"model": "two_lobe.v1", "max_iterations": 2, "path_budget": 20000, "render_px": 8, "render_samples": 1}


def document(groups, **fit):
    return {"sample": "two colours", "fibers": {"file": "cloth.hair", **groups}, "measurements": {"file": "rows.csv"}, "fit": {**FIT, **fit}}


@pytest.fixture(scope="module")
def finished(real):
    job = start_small_job(real, document({"groups": ["weft", "warp"]}, fixed={"beta_R": 5}, start={"warp.C_TT": [0.3, 0.4, 0.5]},
                                         tied=[["beta_TT"]]), groups=True)
    return job, real.wait_state(job, "succeeded", timeout_s=120)


def test_the_result_names_parameters_by_group(finished):
    _, state = finished
    parameters = state["parameters"]
    assert [p["name"] for p in parameters] == [f"{group}.{name}" for group in ("weft", "warp") for name in OWN]
    assert [p["set"] for p in parameters] == ["weft"] * 9 + ["warp"] * 9
    of = {p["name"]: p for p in parameters}
    assert of["warp.C_TT.b"]["start"] == 0.5 and of["weft.C_TT.b"]["start"] != 0.5
    assert of["warp.beta_R"]["fixed"] and of["weft.beta_R"]["fixed"]
    assert of["warp.beta_TT"]["tied_to"] == "weft.beta_TT" and of["warp.beta_TT"]["value"] == of["weft.beta_TT"]["value"]
    assert of["warp.C_R.r"]["value"] != of["weft.C_R.r"]["value"]
    result = state["result"]
    assert len(result["correlation"]) == 18
    assert result["geometry"]["groups"] == [{"name": "weft", "n_fiber": 16}, {"name": "warp", "n_fiber": 8}]
    checked = [p["name"] for p in result["certificate"]["parameters"]]
    assert "warp.C_R.r" in checked and "weft.C_R.r" in checked and "warp.beta_R" not in checked
    assert result["certificate"]["worst_rel_error"] < 0.01


def test_files_and_curves_show_the_groups(real, finished):
    job, _ = finished
    summary = real.get(f"/v1/jobs/{job}/results/summary.txt").text
    weft, warp = summary.index("\nweft\n"), summary.index("\nwarp\n")
    assert weft < summary.index("C_TT.r", weft) < warp < summary.index("C_TT.r", warp)
    fibers = real.get(f"/v1/jobs/{job}/results/fibers.hair").content
    assert struct.unpack_from("<I", fibers, 12)[0] & 16 and b" groups=rgb" in fibers[40:128]
    series = real.get(f"/v1/jobs/{job}/series?after_step=-1").json()
    assert [p["set"] for p in series["models"][0]["parameters"]] == ["weft"] * 9 + ["warp"] * 9
    assert all(len(p["parameter"]) == 18 for p in series["points"])
    out = subprocess.run([program("selvedge"), "--server", real.url, "status", job], capture_output=True, text=True, check=True).stdout
    lines = out.splitlines()
    assert " weft" in lines and lines.index(" weft") + 10 == lines.index(" warp")


def test_groups_that_do_not_fit_the_cloth(real):
    error = real.wait_state(start_small_job(real, document({"groups": ["a", "b", "c"]}), groups=True), "failed", timeout_s=60)["error"]
    assert error["field"] == "fibers.groups" and "no fiber belongs" in error["text"]
    state = real.wait_state(start_small_job(real, document({}), groups=True), "succeeded", timeout_s=60)
    assert len(state["parameters"]) == 9 and all(p["set"] is None for p in state["parameters"])
    assert any("belong to 2 groups" in w and "fibers.groups" in w for w in state["warnings"])


def test_yarns_of_a_described_cloth(real):
    cloth = {"weave": "plain", "tile_warps": 2, "tile_wefts": 2, "weft": [1], "yarns": [{"fibers": 9, "name": "red"}, {"fibers": 9, "name": "blue"}]}
    job = real.create({"sample": "described", "cloth": cloth, "measurements": {"file": "rows.csv"}, "fit": FIT})
    real.upload(job, "rows.csv", TABLE.encode(), "measurements")
    assert real.post(f"/v1/jobs/{job}/start").status_code == 202
    state = real.wait_state(job, "succeeded", timeout_s=120)
    assert {p["set"] for p in state["parameters"]} == {"red", "blue"}
    assert not any("groups" in w for w in state["warnings"])


def with_groups(data):
    """Returns the .hair file with the fibers that run along y as group 1."""
    strands, points, flags = struct.unpack_from("<III", data, 4)
    assert flags == 7
    segments = struct.unpack_from(f"<{strands}H", data, 128)
    xyz = struct.unpack_from(f"<{3 * points}f", data, 128 + 2 * strands)
    colours, at = [], 0
    for n in segments:
        part = [xyz[3 * k:3 * k + 3] for k in range(at, at + n + 1)]
        along = [sum(abs(b[a] - c[a]) for b, c in zip(part, part[1:])) for a in range(2)]
        colours += [0.0 if along[1] > along[0] else 1.0, 1.0, 1.0] * (n + 1)
        at += n + 1
    text = data[40:128].rstrip(b"\0") + b" groups=rgb"
    return data[:12] + struct.pack("<I", flags | 16) + data[16:40] + text.ljust(88, b"\0") + data[128:] + struct.pack(f"<{len(colours)}f", *colours)


VIEWS = [(f"fit,{light},{37 * i % 180},{17 * i % 66},180,{30 * (i % 4)}" if i % 8 else f"held-out,{light},{37 * i % 180},{17 * i % 66},180,{30 * (i % 4)}")
         for i, light in enumerate([20, 0, 20, 35, 50, 65, 20, 35, 50, 65, 0, 20, 35, 50, 65, 20, 120, 160, 140, 120, 150, 130, 165, 145, 135, 155])]
TRUTH = ["weft.C_R=0.06,0.08,0.12", "weft.C_TT=0.3,0.45,0.8", "warp.C_R=0.12,0.07,0.06", "warp.C_TT=0.85,0.4,0.3", "beta_R=5", "beta_TT=18", "gamma_TT=20"]


def test_both_groups_are_recovered(real, tmp_path):
    """A blue weft in a red warp, photographed from both sides of the light: every parameter within 2.5 standard errors."""
    phantom = program("selvedge-phantom")
    subprocess.run([phantom, "cloth", "--weave", "plain", "--fibers-per-yarn", "7", "--out", str(tmp_path)], check=True, capture_output=True)
    (tmp_path / "two.hair").write_bytes(with_groups((tmp_path / "truth.hair").read_bytes()))
    (tmp_path / "views.csv").write_text("set,light_theta_deg,light_phi_deg,camera_theta_deg,camera_phi_deg,cloth_rotation_deg\n" + "\n".join(VIEWS) + "\n")
    photographs = tmp_path / "photographs"
    subprocess.run([phantom, "photograph", "--fibers", str(tmp_path / "two.hair"), "--groups", "weft,warp", *[a for p in TRUTH for a in ("--param", p)],
                    "--table", str(tmp_path / "views.csv"), "--paths", "80000", "--px", "16", "--noise", "0.003", "--no-black-sheet", "--seed", "77",
                    "--out", str(photographs)], check=True, capture_output=True)
    truth = json.loads((photographs / "truth.json").read_text())["parameter"]
    assert truth["warp.C_TT.r"] == 0.85 and truth["weft.C_TT.r"] == 0.3 and len(truth) == 18
    rows = json.loads((photographs / "photographs.json").read_text())
    job = real.create({"sample": "two colours", "fibers": {"file": "two.hair", "groups": ["weft", "warp"]}, "photographs": rows, "black_sheet": False,
                       "fit": {"model": "two_lobe.v1", "seed": 3, "path_budget": 500000, "fixed": {"beta_R": 5},
                               "tied": [["beta_TT"], ["gamma_TT"]], "render_px": 16,
                               "render_samples": 4}})
    real.upload(job, "two.hair", (tmp_path / "two.hair").read_bytes(), "fibers")
    for row in rows:
        real.upload(job, row["file"], (photographs / row["file"]).read_bytes(), "photograph")
    assert real.post(f"/v1/jobs/{job}/start").status_code == 202
    state = real.wait_state(job, "succeeded", timeout_s=600)
    free = [p for p in state["parameters"] if not p["fixed"]]
    assert len(free) == 16
    off = {p["name"]: (p["value"] - truth[p["name"]]) / p["standard_error"] for p in free}
    shown = "\n".join(f"{p['name']:<16} {truth[p['name']]:8.4f} {p['value']:8.4f} +- {p['standard_error']:.4f} {off[p['name']]:+.1f}" for p in free)
    print(shown)
    assert all(p["determined"] for p in free), shown
    assert max(abs(x) for x in off.values()) < 2.5, shown
