"""Documents against the catalogue of models, methods and stop reasons that selvedge-worker --catalogue prints."""
import os
import sys

import pytest
from daemon_under_test import ROOT, program

sys.path.insert(0, os.path.join(ROOT, "config"))
import generate_model_tables as model_tables  # noqa: E402

CATALOGUE = model_tables.read_catalogue(program("selvedge-worker"))


def read(*path):
    with open(os.path.join(ROOT, *path), encoding="utf-8") as file:
        return file.read()


@pytest.mark.parametrize("document", model_tables.DOCUMENTS)
def test_tables_of_parameters(document):
    text = read(document)
    assert text == model_tables.with_tables(text, CATALOGUE), "run make generate"


def test_a_stale_table_is_noticed():
    stale = read("docs", "model.md").replace("0.001..0.999", "0.001..0.998", 1)
    assert stale != model_tables.with_tables(stale, CATALOGUE)


def test_every_model_is_in_a_table():
    """One table has each; two_lobe_balanced.v1 has the parameters of two_lobe.v1, as its page says."""
    parameters = {model["id"]: model["parameters"] for model in CATALOGUE["models"]}
    assert parameters["two_lobe_balanced.v1"] == parameters["two_lobe.v1"]
    listed = [model for document in model_tables.DOCUMENTS for model in model_tables.models_of(read(document))]
    assert sorted(listed + ["two_lobe_balanced.v1"]) == sorted(parameters)


@pytest.mark.parametrize("reason", [reason["id"] for reason in CATALOGUE["stop_reasons"]])
def test_stop_reasons_are_documented(reason):
    assert f"`{reason}`" in read("docs", "file-formats.md")


@pytest.mark.parametrize("kind", ["models", "methods"])
def test_ids_are_documented(kind):
    """The ids that a job document may name stand in the page of options."""
    guide = read("docs", "options.md")
    assert not [entry["id"] for entry in CATALOGUE[kind] if entry["id"] not in guide]
