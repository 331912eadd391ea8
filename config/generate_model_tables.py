#!/usr/bin/python3
"""Writes the tables of parameters in docs/model.md and in the pages of the models, which follow from the catalogue of
models (base/catalogue/models.def).

    config/generate_model_tables.py [--check] SELVEDGE-WORKER

Between a line "<!-- parameters: ID ID ... -->" and the next "<!-- end -->" stands one table of these models. With --check
nothing is written and the exit status is 1 when a table is out of date."""
import argparse
import glob
import json
import os
import re
import subprocess
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
DOCUMENTS = [os.path.join(ROOT, "docs", "model.md")] + sorted(
    glob.glob(os.path.join(ROOT, "renderer", "scattering", "models", "*", "README.md")))
MARKS = re.compile(r"(<!-- parameters: ([^\n]*?) -->\n).*?(<!-- end -->)", flags=re.S)
HEAD = ["model", "parameter", "meaning", "unit in files", "range", "start", "fitted in"]
COORDINATE = {"linear": "p", "log": "ln p", "logit": "ln(p / (1 - p))"}


def read_catalogue(worker):
    """What selvedge-worker --catalogue prints."""
    return json.loads(subprocess.run([worker, "--catalogue"], check=True, capture_output=True, text=True).stdout)


def line(cells, several):
    """One line of a table; the first cell, the model, only where the table has several."""
    return "| " + " | ".join(cells if several else cells[1:]).replace("|  |", "| |") + " |\n"


def cells_of(model, parameter):
    name = f"`{parameter['symbol']}`" + (" r, g, b" if parameter["channel"] is not None else "")
    span = f"{parameter['lower']:g}..{parameter['upper']:.10g}"
    return [model, name, parameter["meaning"], parameter["unit"], span, f"{parameter['start']:g}",
            COORDINATE[parameter["coordinate"]]]


def table(catalogue, ids):
    """One row for each group of parameters; the density multiplier, which all volume models have, once at the end."""
    rows, shared = [], []
    for model in catalogue["models"]:
        for parameter in model["parameters"] if model["id"] in ids else []:
            if parameter["kind"] == "density":
                shared = [cells_of("each of them", parameter)]
            elif parameter["channel"] in (None, 0):
                rows.append(cells_of(model["id"], parameter))
    several = len(ids) > 1
    rule = "|" + "---|" * (len(HEAD) if several else len(HEAD) - 1) + "\n"
    return line(HEAD, several) + rule + "".join(line(cells, several) for cells in rows + shared)


def with_tables(text, catalogue):
    """The document with its tables as the catalogue has them."""
    return MARKS.sub(lambda match: match.group(1) + table(catalogue, match.group(2).split()) + match.group(3), text)


def models_of(text):
    return [model for match in MARKS.finditer(text) for model in match.group(2).split()]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true")
    parser.add_argument("worker", metavar="SELVEDGE-WORKER")
    arguments = parser.parse_args()
    catalogue, stale = read_catalogue(arguments.worker), False
    for document in DOCUMENTS:
        with open(document, encoding="utf-8") as file:
            before = file.read()
        after = with_tables(before, catalogue)
        stale = stale or before != after
        if not arguments.check and before != after:
            with open(document, "w", encoding="utf-8") as file:
                file.write(after)
    return 1 if arguments.check and stale else 0


if __name__ == "__main__":
    sys.exit(main())
