"""Configurations, parameters, the error and the steps of make bench-thesis (tests/bench/thesis)."""
import json
import os
import random
import subprocess
import sys

import pytest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
BUILD = os.environ.get("SELVEDGE_BUILD", os.path.join(ROOT, "build"))
sys.path.insert(0, os.path.join(ROOT, "tests", "bench", "thesis"))
import thesis_fabrics  # noqa: E402
import thesis_fits  # noqa: E402
import thesis_jobs  # noqa: E402


def test_configurations_are_as_many_as_printed():
    assert len(set(thesis_fabrics.FITTED)) == 16 and len(set(thesis_fabrics.FURTHER)) == 492
    assert sum(row in thesis_fabrics.GRAZING for row in thesis_fabrics.FITTED) == 2
    elevations = [{light for light, *_ in thesis_fabrics.FITTED[4 * row:4 * row + 4]} for row in range(4)]
    assert 80 in elevations[0] and 80 not in elevations[3] and 64 in elevations[3]


def test_table_lies_in_the_ranges():
    """150 values of Table 5.3: colors count as three."""
    said = subprocess.run([os.path.join(BUILD, "bin", "selvedge-worker"), "--catalogue"], check=True, capture_output=True, text=True)
    models = {m["id"]: {p["name"]: p for p in m["parameters"]} for m in json.loads(said.stdout)["models"]}
    for model, model_id in thesis_fabrics.MODELS.items():
        known = models[model_id]
        for fabric in thesis_fabrics.NAMES:
            values = thesis_fits.flat(thesis_fabrics.truth(fabric, model))
            assert set(known) - set(values) <= {"density_multiplier"}
            for name, value in values.items():
                assert known[name]["lower"] - 1e-9 <= value <= known[name]["upper"] + 1e-9, (fabric, model, name)


def test_error_has_no_bias_by_noise():
    """Rows that are off by 10 %, with noise of 20 % in both: the mean of 200 draws lies within four standard errors."""
    draw = random.Random(5)
    squares = []
    for _ in range(200):
        rows = [{"set": "held-out", "measured": [0.5 + draw.gauss(0, 0.1) for _ in range(3)], "measured_se": [0.1] * 3,
                 "rendered": [0.55 + draw.gauss(0, 0.1) for _ in range(3)], "rendered_se": [0.1] * 3} for _ in range(40)]
        squares.append(sum(thesis_fits.row_square(row) * thesis_fits.brightness(row["measured"]) ** 2 / 0.25 for row in rows) / len(rows))
    mean = sum(squares) / len(squares)
    se = (sum((s - mean) ** 2 for s in squares) / len(squares) / (len(squares) - 1)) ** 0.5
    assert abs(mean - 0.01) < 4 * se and se < 0.005


def test_a_folder_that_moved_keeps_its_steps(tmp_path):
    """The key of a step with a file has the file's name in the folder; another file is another step."""
    worker = tmp_path / "bin/selvedge-worker"
    worker.parent.mkdir()
    worker.write_text('#!/bin/sh\ncd $2\nmkdir -p results; echo "{\\"bytes\\": $(wc -c < input/scan)}" > results/result.json\n')
    worker.chmod(0o755)

    def job(folder, file):
        steps = thesis_jobs.Steps(str(tmp_path), str(folder), [])
        (folder / file).write_text(file)
        return steps.job("chain.one", "d", {"scan": str(folder / file)}, lambda result, _: result["bytes"])
    assert job(tmp_path / "steps", "a") == 1
    os.rename(tmp_path / "steps", tmp_path / "moved")
    worker.write_text("#!/bin/sh\nexit 1\n")
    assert job(tmp_path / "moved", "a") == 1
    with pytest.raises((RuntimeError, FileNotFoundError)):
        job(tmp_path / "moved", "bb")


def test_a_stopped_step_goes_on_and_an_old_program_is_told(tmp_path, capsys):
    """A worker in its place that fails at first, leaves a mark, and then writes down whether it found the mark."""
    worker = tmp_path / "bin/selvedge-worker"
    worker.parent.mkdir()

    def install(version):
        worker.write_text(f"#!/bin/sh\ncd $2\nif [ -e mark ]; then found=true; else found=false; fi\n: > mark; echo log > log.txt\n"
                          f'[ -e ../stop ] && exit 1\nmkdir -p results; echo "{{\\"version\\": {version}, \\"found\\": $found}}" > results/result.json\n')
        worker.chmod(0o755)
        return thesis_jobs.Steps(str(tmp_path), str(tmp_path / "steps"), [])

    def job(steps, document="d"):
        return steps.job("fit.one", document, {}, lambda result, _: result)
    steps = install(1)
    (tmp_path / "steps/stop").touch()
    with pytest.raises(RuntimeError):
        job(steps)
    assert steps.kept("fit.one") is None
    (tmp_path / "steps/stop").unlink()
    assert job(steps) == {"version": 1, "found": True}
    assert steps.kept("fit.one")["cpu_s"] is None, "the time of the stopped run is not known"
    assert steps.standing()[1] == 0 and "another program" not in capsys.readouterr().err
    steps = install(2)
    assert job(steps)["version"] == 1
    assert steps.standing()[1] == 1 and "1 of 1 steps are of another program: fit.one" in capsys.readouterr().err
    (tmp_path / "steps/fit.one.json").unlink()
    assert job(steps) == {"version": 2, "found": False}, "what the old program left is not gone on with"
    assert job(steps, "another") == {"version": 2, "found": False} and steps.kept("fit.one")["cpu_s"] is not None
