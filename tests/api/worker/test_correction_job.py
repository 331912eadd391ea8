"""Jobs that correct the fibers of a file or a scan: a wrong radius and a wrong height are found, what corrections gain is
stated, given corrections are applied, and documents that cannot be are refused."""
import json
import os
import shutil
import subprocess

import pytest
from daemon_under_test import program
from small_cloth import TABLE, hair

pytestmark = pytest.mark.skipif(not os.access(program("selvedge-worker"), os.X_OK), reason="no selvedge-worker in the build folder")
TRUTH = {"C_R": [0.06, 0.05, 0.08], "C_TT": [0.7, 0.5, 0.3], "beta_R": 6, "beta_TT": 20, "gamma_TT": 20}
OUTPUT = {"render_px": 8, "render_samples": 1}
THIN, HIGH = 0.85, 1 / 0.75
# either is found by the same search; make test-long has both
WRONG = [("thin.txt", "radius", 1 / THIN), ("high.txt", "compression", 1 / HIGH)][:2 if os.environ.get("SELVEDGE_TEST_LONG") else 1]


@pytest.fixture(scope="module")
def sample(tmp_path_factory):
    """Photographs of a cloth, and its fibers with radii that are too small, or too high."""
    folder = tmp_path_factory.mktemp("sample")
    phantom = program("selvedge-phantom")
    subprocess.run([phantom, "cloth", "--weave", "twill", "--fibers-per-yarn", "7", "--cover", "0.7", "--out", str(folder)],
                   check=True, capture_output=True)
    values = {name: ",".join(map(str, v)) if isinstance(v, list) else v for name, v in TRUTH.items()}
    given = [word for name, value in values.items() for word in ("--param", f"{name}={value}")]
    subprocess.run([phantom, "photograph", "--fibers", str(folder / "truth.hair"), "--out", str(folder), "--px", "8",
                    "--paths", "20000", *given, "--quiet"], check=True)
    rows = [line.split() for line in (folder / "truth.txt").read_text().splitlines()]
    for name, factor in (("thin.txt", (1, THIN)), ("high.txt", (HIGH, 1))):
        changed = [[*r[:2], *(f"{k * float(v):.9g}" for k, v in zip(factor, r[2:]))] if r else [] for r in rows]
        (folder / name).write_text("\n".join(map(" ".join, changed)) + "\n")
    return folder


def run_job(job, document):
    (job / "job.json").write_text(json.dumps(document))
    return subprocess.run([program("selvedge-worker"), "--quiet", "--threads", "2", str(job)]).returncode


@pytest.fixture
def small(tmp_path):
    """Runs a job of the smallest cloth with corrections."""
    def run(correction):
        (tmp_path / "input").mkdir()
        (tmp_path / "input" / "cloth.hair").write_bytes(hair(radius_mm=0.007))
        (tmp_path / "input" / "rows.csv").write_text(TABLE)
        return run_job(tmp_path, {"sample": "small", "fibers": {"file": "cloth.hair"}, "measurements": {"file": "rows.csv"}, "correction": correction,
                                  "fit": {"model": "two_lobe.v1", "path_budget": 40000, "max_iterations": 1, **OUTPUT}})
    return run


def corrected(job, sample, fibers, correction, path_budget=1200000):
    """Result and summary of a job that corrects the fibers of a file, with all parameters known but C_TT."""
    known = {k: v for k, v in TRUTH.items() if k != "C_TT"}
    (job / "input").mkdir(parents=True)
    photographs = json.loads((sample / "photographs.json").read_text())
    for name in [fibers] + [p["file"] for p in photographs]:
        shutil.copy(sample / name, job / "input")
    tile = json.loads((sample / "phantom.json").read_text())["result"]["tile_mm"]
    fit = {"model": "two_lobe.v1", "path_budget": path_budget, "fixed": known, **OUTPUT}
    assert run_job(job, {"sample": fibers, "fibers": {"file": fibers, "tile_mm": tile}, "photographs": photographs,
                         "correction": correction, "fit": fit}) == 0
    result = json.loads((job / "results" / "result.json").read_text())
    print(result["cloth_numbers"], result["heldout_rel_rms"], result["without_corrections"])
    return result, (job / "results" / "summary.txt").read_text()


@pytest.mark.slow
@pytest.mark.parametrize("fibers, name, true", WRONG)
def test_wrong_fibers_are_corrected(tmp_path, sample, fibers, name, true):
    result, summary = corrected(tmp_path / "job", sample, fibers, {name: {"lower": 0.7, "upper": 1.4}})
    (number,) = result["cloth_numbers"]
    without = result["without_corrections"]
    assert number["name"] == name and number["determined"] and without["asked_for"] == [name]
    assert abs(number["value"] - true) < max(0.03, 3 * number["standard_error"])
    assert result["heldout_rel_rms"] < 0.5 * without["heldout_rel_rms"]
    assert abs(without["heldout_gain"] - (without["heldout_rel_rms"] - result["heldout_rel_rms"])) < 1e-12
    assert without["heldout_gain"] > 2 * without["heldout_gain_se"] > 0
    assert abs(result["geometry"]["mean_radius_um"] - 7 * (THIN * number["value"] if name == "radius" else 1)) < 0.02
    assert "without these corrections" in summary and f"the photographs ask for {name}\n" in summary
    assert "lower the held-out error" in summary and "not worth keeping" not in summary


@pytest.mark.slow
def test_hairs_that_the_cloth_has_not_are_not_asked_for(tmp_path, sample):
    result, summary = corrected(tmp_path / "job", sample, "truth.txt", {"hairs_per_mm2": {"lower": 0, "upper": 60}}, 300000)
    (hairs,) = result["cloth_numbers"]
    assert hairs["value"] < max(10, 2 * hairs["standard_error"])
    assert result["without_corrections"]["asked_for"] == [] and "the photographs ask for none" in summary


def test_given_corrections_are_applied(tmp_path, small):
    assert small({"radius": 1.1, "smoothing_um": {"value": 5, "fit": False}}) == 0
    result = json.loads((tmp_path / "results" / "result.json").read_text())
    assert abs(result["geometry"]["mean_radius_um"] - 7 * 1.1) < 0.01
    assert "cloth_numbers" not in result and "without_corrections" not in result


@pytest.mark.parametrize("correction, field, text", [
    ({"radius": 3}, "correction.radius", "'correction.radius' is 3: allowed are 0.7 to 1.4"),
    ({"compression": {"lower": 1.2, "upper": 0.8}}, "correction.compression", "bounds"),
    ({"hairs_per_mm2": {"prior": [1, 0]}}, "correction.hairs_per_mm2", "prior"),
    ({"flatness": 2}, "correction.flatness", "flatness"),
])
def test_refused(tmp_path, small, correction, field, text):
    code = small(correction)
    error = json.loads((tmp_path / "status.json").read_text())["error"]
    assert code != 0 and error["field"] == field and text in error["text"], error
