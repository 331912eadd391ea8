"""Results in Python as words and as flat tables, with pandas and without."""
import os
import sys

import pytest
from daemon_under_test import ROOT

sys.path.insert(0, os.path.join(ROOT, "clients", "python"))
import selvedge  # noqa: E402
from selvedge.tables import percent  # noqa: E402

PARAMETERS = [{"name": "C_R.r", "unit": "", "set": None, "value": 0.047, "standard_error": 0.0149, "meaning": "Share of R.", "correlated": [1, 2]},
              {"name": "beta_R", "unit": "deg", "set": None, "value": 30.0, "standard_error": 8.4, "determined": False, "at_bound": "upper"},
              {"name": "w", "unit": "", "set": None, "value": 0.3, "standard_error": None, "fixed": True}]
RAW = {"verdict": {"code": "good_but_undetermined", "words": "good, but 1 parameter is undetermined", "text": ".", "reservations": []},
       "fit_rel_rms": 0.001, "fit_rel_rms_se": 0.005, "heldout_rel_rms": 0.0471, "heldout_rel_rms_se": 0.001, "parameters": PARAMETERS,
       "rows": [{"name": "p1", "set": "fit", "measured": [0.1, 0.2, 0.3], "rel_error": 0.02, "all_rotations": False, "texture": {"x": 1}}]}
SAMPLE = {"sample": "a", "job": "1", "state": "succeeded", "verdict": "good", "flags": ["x", "y"], "heldout_rel_rms": 0.03, "error": None,
          "parameters": [{"name": "w", "unit": "", "value": 0.3, "standard_error": 0.1, "determined": True, "fixed": False}]}


class Client:
    """Answers any request about a batch's table, and keeps its path."""
    def request(self, method, path):
        self.path = path
        return self

    def json(self):
        return {"samples": [SAMPLE, dict(SAMPLE, sample="b", parameters=[], error={"code": "io", "field": "", "text": "why"})]}


def test_a_result_is_readable():
    result = selvedge.Result.of(RAW)
    assert repr(result) == ("Result: good, but 1 parameter is undetermined\n"
                            "  relative error 4.71 +- 0.10 % held out, below 1.1 % fitted\n"
                            "  C_R.r = 0.047 +- 0.015\n"
                            "  beta_R = 30.0 +- 8.4 deg (at its upper bound, not determined)\n"
                            "  w = 0.3 (fixed)")
    assert repr(selvedge.Result.of({})) == "Result: without a verdict"
    assert result.parameter("C_R.r").meaning == "Share of R." and result.parameter("w").meaning == ""
    assert repr(selvedge.Batch(Client(), "b-1")) == "Batch('b-1')" and repr(selvedge.Job(Client(), "j-1")) == "Job('j-1')"


@pytest.mark.parametrize("share, se, words", [
    (0.0471, 0.00098, "4.71 +- 0.10 %"), (0.119, 0.0031, "11.9 +- 0.3 %"), (0.2, 0.099, "20 +- 10 %"), (0.0, 0.0055, "below 1.1 %"),
    (0.00101, 0.005, "below 1.2 %"), (0.0, 0.000995, "below 0.20 %"), (0.1, 0.3, "below 70 %"), (0.0471, None, "4.71 %"), (None, 0.1, "-")])
def test_errors_read_as_in_the_report(share, se, words):
    """The same cases as in test_percent_words.c."""
    assert percent(share, se) == words


def test_tables_without_pandas(monkeypatch):
    result, client = selvedge.Result.of(RAW), Client()
    assert [row["name"] for row in result.table()] == ["C_R.r", "beta_R", "w"] and "correlated" not in result.table()[0]
    assert result.table("rows") == [{"name": "p1", "set": "fit", "measured_r": 0.1, "measured_g": 0.2, "measured_b": 0.3, "rel_error": 0.02,
                                     "all_rotations": False}]
    with pytest.raises(KeyError, match="'parameters' and 'rows'"):
        result.table("files")
    one, other = selvedge.Batch(client, "b").table("good,pictures_only")
    assert client.path == "/v1/batches/b/results.json?verdict=good,pictures_only"
    assert one["flags"] == "x y" and (one["w"], one["w_se"], one["w_determined"], one["error"]) == (0.3, 0.1, True, None)
    assert "w" not in other and other["error"] == "why"
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(ImportError, match="needs pandas: pip install pandas"):
        result.to_pandas()


def test_tables_with_pandas():
    pandas = pytest.importorskip("pandas", reason="pandas is not installed")
    result = selvedge.Result.of(RAW)
    frame, rows, batch = result.to_pandas(), result.to_pandas("rows"), selvedge.Batch(Client(), "b").to_pandas()
    assert all(isinstance(f, pandas.DataFrame) for f in (frame, rows, batch))
    assert list(frame.columns[:5]) == ["name", "set", "value", "standard_error", "unit"] and frame.set_index("name").loc["beta_R", "value"] == 30.0
    assert rows["measured_g"].sum() == 0.2 and len(selvedge.Result.of({}).to_pandas()) == 0
    assert list(batch["sample"]) == ["a", "b"] and batch["w"].count() == 1
