"""docs/benchmarks.md is the page that tests/bench/write_page.py writes from the figures of tests/bench/figures.jsonl."""
import json
import os
import re
import sys

from daemon_under_test import ROOT

sys.path.insert(0, os.path.join(ROOT, "tests", "bench"))
import write_page  # noqa: E402


def read(path):
    with open(path, encoding="utf-8") as file:
        return file.read()


def test_page_and_figures_agree():
    assert read(write_page.PAGE) == write_page.page(write_page.read_figures(), read(write_page.READINGS)), "run make docs-benchmarks"


def test_a_changed_figure_changes_the_page():
    figures = write_page.read_figures()
    figures["demo.heldout_rel_rms"]["value"] = 0.777
    assert write_page.page(figures, read(write_page.READINGS)) != read(write_page.PAGE)


def test_every_figure_says_when_and_where_it_was_measured():
    lines = [json.loads(line) for line in read(write_page.FIGURES).splitlines()]
    assert len({line["name"] for line in lines}) == len(lines) > 500
    for line in lines:
        assert {"name", "value", "unit", "better", "date", "machine"} <= line.keys() <= {
            "name", "value", "unit", "better", "date", "machine", "se", "note"}, line
        assert re.fullmatch(r"20\d\d-\d\d-\d\d", line["date"]) and line["machine"], line


def test_figures_of_a_run_replace_those_of_the_same_name(tmp_path):
    (tmp_path / "run.jsonl").write_text('progress\n{"name": "demo.wall_s", "value": 1.5, "unit": "s", "better": "lower"}\n')
    figures = write_page.read_figures()
    n = len(figures)
    write_page.add(figures, tmp_path / "run.jsonl", "2030-01-02", "a quick machine")
    assert len(figures) == n
    assert figures["demo.wall_s"] == {"name": "demo.wall_s", "value": 1.5, "unit": "s", "better": "lower", "date": "2030-01-02",
                                      "machine": "a quick machine"}


def test_every_figure_is_on_the_page():
    patterns = re.findall(r"^@table (\S+)", read(write_page.READINGS), re.M)
    missing = [name for name in write_page.read_figures() if not any(write_page.expression(p).fullmatch(name) for p in patterns)]
    assert not missing


def test_unusual_machines_are_named():
    def page_of(*machines):
        return write_page.table({f"a.{i}": {"name": f"a.{i}", "value": 1, "unit": "1", "date": "2030-01-02", "machine": name}
                                 for i, name in enumerate(machines)}, "a.{row}")
    usual = write_page.USUAL_MACHINE
    assert usual in read(write_page.READINGS).replace("\n", " ")
    assert "achine" not in page_of(usual) and "Also" not in page_of(usual)
    assert page_of("a fast one").endswith("Machine: a fast one.") and page_of(usual, "a fast one").endswith("Also: a fast one.")
