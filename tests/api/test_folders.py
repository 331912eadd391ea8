"""tests/check_folders.py finds what it promises to find, in a small tree with planted mistakes."""
import os
import sys

import pytest
from daemon_under_test import ROOT

sys.path.insert(0, os.path.join(ROOT, "tests"))
import check_folders  # noqa: E402

TABLE = ("# a part\n\nText.\n\n| folder | purpose | may use |\n|---|---|---|\n| low | values | |\n"
         "| `middle/` | steps | low |\n| high | the whole | all folders above |\n\nMore text.\n")
SOURCES = {
    "low/a.h": "", "low/a.c": "low/a.h", "middle/b.h": "low/a.h", "middle/b.c": "middle/b.h",
    "high/c.c": "middle/b.h", "high/d.h": "",
}


def breaches(tmp_path, changes=(), table=TABLE):
    """The breaches of a tree whose part base has the sources above with changes, and whose other parts are empty."""
    paths = []
    for name, include in {**SOURCES, **dict(changes)}.items():
        path = tmp_path / "base" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(f'#include "base/{include}"\n' if include else "")
        paths.append(f"base/{name}")
    (tmp_path / "base" / "README.md").write_text(table)
    empty = "| folder | purpose | may use |\n|---|---|---|\n"
    for part in check_folders.PARTS[1:]:
        (tmp_path / part).mkdir()
        (tmp_path / part / "README.md").write_text(empty)
    return list(check_folders.check_tree(str(tmp_path), paths))


def test_a_tree_in_order(tmp_path):
    assert breaches(tmp_path) == []


@pytest.mark.parametrize("changes, table, words", [
    ({"low/a.c": "high/d.h"}, TABLE, ["base/low/a.c", "goes up", "high"]),
    ({"middle/b.c": "low/a.h"}, TABLE.replace("steps | low", "steps | "), ["base/middle/b.c", "does not list low"]),
    ({"low/e.h": "low/f.h", "low/f.h": "low/e.h"}, TABLE, ["files", "circle", "base/low/e, base/low/f"]),
    ({"low/a.c": "low/e.h", "low/e.h": "low/a.h"}, TABLE, ["files", "circle", "base/low/a, base/low/e"]),
    ({"low/e.h": "high/d.h", "high/f.h": "low/a.h"}, TABLE, ["folders", "circle", "base/high, base/low"]),
    ({"new/e.h": ""}, TABLE, ["no row for new"]),
    ({}, TABLE.replace("| high |", "| gone | nothing | low |\n| high |"), ["gone", "no sources"]),
    ({}, TABLE.replace("values | |", "values | middle |"), ["low may use middle", "no row above"]),
    ({}, "# a part\n", ["base/README.md has no table"]),
])
def test_a_planted_mistake(tmp_path, changes, table, words):
    assert any(all(word in breach for word in words) for breach in breaches(tmp_path, changes, table))


def test_a_header_and_its_source_are_one_file(tmp_path):
    assert breaches(tmp_path, {"low/e.h": "low/a.h", "low/e.c": "low/e.h"}) == []
