"""Tables of places of the sources: each row names a test or a command that exists, and docs/source-table.md leads to each table. test_documents.py
tests that the fabric thesis is there with all its places."""
import os
import re

import pytest
from test_documents import ROOT, make_targets, tracked

INDEX = "docs/source-table.md"
# the fabric thesis, the dissertation on glints, fur and filters, its paper on fur, papers of fiber models
LEAST = {"docs/source-table.md": 1, "docs/thesis.md": 2, "renderer/glint/README.md": 1, "renderer/glint/wave-glints.md": 1, "renderer/preview/README.md": 1,
         "renderer/scattering/models/README.md": 1, "renderer/scattering/models/fur/README.md": 1, "renderer/quick/README.md": 1}


def cells(line):
    return [cell.strip() for cell in line.strip().strip("|").split("|")]


def rows_of(text):
    """(number of tables whose last column is "shown by", their rows). A page may name a command once, as (†: `make it`)."""
    n_table, rows, inside = 0, [], False
    mark = re.search(r"\(†: (`make [a-z0-9-]+`)\)", text)
    text = text.replace("†", mark[1]) if mark else text
    for line in text.split("\n"):
        if not line.startswith("|"):
            inside = False
        elif cells(line)[-1] == "shown by":
            n_table, inside = n_table + 1, True
        elif inside and not re.fullmatch(r"[|:\- ]+", line):
            rows.append(cells(line))
    return n_table, rows


def sources():
    """Text of every test and bench program by its name without ending."""
    found = {}
    for path in tracked("tests/*"):
        name, ending = os.path.splitext(os.path.basename(path))
        if ending in (".c", ".py", ".cpp", ".js"):
            with open(os.path.join(ROOT, path), encoding="utf-8", errors="replace") as f:
                found[name] = f.read()
    return found


def faults(rows, known, targets):
    """Rows that name nothing that shows them, or something that does not exist. `test_x` (`part`): a function of the test."""
    found = []
    for row in rows:
        shown, n_good, program = row[-1], 0, None
        for name in re.findall(r"`([^`]+)`", shown):
            if name.startswith("make "):
                good = name.split()[1] in targets
            elif re.match(r"(test|bench)_\w+( |$)", name) and name.split()[0] in known:
                program, good = name.split()[0], True
            else:
                good = program is not None and re.search(rf"\b{re.escape(name)}\(", known[program]) is not None
            n_good += good
            if not good:
                found.append((row[0], name))
        if n_good == 0:
            found.append((row[0], "nothing"))
    return found


@pytest.fixture(scope="module")
def pages():
    return {path: open(os.path.join(ROOT, path), encoding="utf-8").read() for path in tracked("*.md")}


def test_every_row_is_shown(pages):
    known, targets = sources(), make_targets()
    tables = {path: rows_of(text) for path, text in pages.items()}
    assert {path: tables[path][0] for path in LEAST} == {path: max(n, tables[path][0]) for path, n in LEAST.items()}
    assert sum(len(rows) for _, rows in tables.values()) > 100
    assert not {path: faults(rows, known, targets) for path, (_, rows) in tables.items() if faults(rows, known, targets)}


def test_the_index_leads_to_every_table(pages):
    linked = {os.path.normpath(os.path.join(os.path.dirname(INDEX), link)) for link in re.findall(r"\]\(([^)#]+)", pages[INDEX])}
    assert {path for path, text in pages.items() if rows_of(text)[0]} - {INDEX} <= linked
    assert "(source-table.md)" in pages["docs/model.md"]


def test_faults_are_found():
    text = "| place | ours | shown by |\n|---|---|---|\n| 1 | a | `test_one` |\n| 2 | b | by eye |\n| 3 | c | |\n| 4 | d | `test_gone` |\n" \
           "| 5 | e | `test_one` (`part`), `make all` |\n| 6 | f | `make nothing` |\n| 7 | g | `test_one` (`no_part`) |\n\n| 8 | no table | |\n"
    n_table, rows = rows_of(text)
    assert n_table == 1 and len(rows) == 7
    found = faults(rows, {"test_one": "static void part(void **state)"}, {"all"})
    assert {place for place, _ in found} == {"2", "3", "4", "6", "7"}
    marked = "| place | shown by |\n|---|---|\n| 1 | † |\n"
    assert faults(rows_of(marked)[1], {}, {"all"}) and not faults(rows_of("(†: `make all`)\n" + marked)[1], {}, {"all"})
