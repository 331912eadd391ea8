"""The table of job options, what is generated from it, and that errors name its keys."""
import json
import os
import re
import subprocess

import jsonschema
import pytest
from daemon_under_test import BUILD, ROOT
from openapi_check import load, names_a_key

PRINT_OPTIONS = os.path.join(BUILD, "tools", "print-options")
SCHEMA = load()["components"]["schemas"]["JobDocument"]


@pytest.fixture(scope="module")
def options():
    return json.loads(subprocess.run([PRINT_OPTIONS], check=True, capture_output=True, text=True).stdout)["options"]


def test_the_generated_files_are_up_to_date():
    done = subprocess.run([os.path.join(ROOT, "config", "generate_options.py"), "--check", PRINT_OPTIONS], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


def test_every_option_is_on_the_page(options):
    """Below the heading of its section, or in a line that names an earlier list with the same options."""
    with open(os.path.join(ROOT, "docs", "options.md"), encoding="utf-8") as file:
        parts = {name: part for name, part in re.findall(r"^## `([\w\[\]]+)`\n(.*?)(?=^## |\Z)", file.read(), re.M | re.S)}
    for row in options:
        top, _, rest = row["path"].partition(".")
        if rest:
            keys = set(re.findall(r"`([\w.\[\]]+)`", "\n".join(line.split(" | ")[0] for line in parts[top].split("\n"))))
            assert rest in keys or rest.rpartition(".")[2] in keys, row["path"]


def test_the_daemon_serves_the_table(daemon, options):
    assert daemon.get("/v1/options").json()["options"] == options


def schema_of(path):
    """The part of the schema that describes a path of the table."""
    schema = SCHEMA
    for key in filter(None, re.split(r"\.|(?=\[\])", path)):
        parts = [schema, *schema.get("anyOf", [])]
        if key == "[]":
            schema = next(part["items"] for part in parts if "items" in part)
        else:
            schema = next(part["properties"][key] for part in parts if key in part.get("properties", {}))
    return schema


def test_every_option_is_described_and_its_default_allowed(options):
    assert len(options) > 80 and len({row["path"] for row in options}) == len(options)
    for row in options:
        schema = schema_of(row["path"])
        assert row["meaning"].endswith("."), row["path"]
        assert sum((row["required"], "default" in row, "left_out" in row)) <= 1 or row["path"] == "", row["path"]
        if "default" in row:
            jsonschema.Draft202012Validator(schema).validate(row["default"])


def test_a_row_says_what_holds_without_it(options):
    sections = {"", "lamp", "camera", "fit"}  # their members have defaults
    assert {row["path"] for row in options if not row["required"] and "default" not in row and "left_out" not in row} == sections


def c_files(*folders):
    for folder in folders:
        for place, _, names in os.walk(os.path.join(ROOT, folder)):
            for name in names:
                if name.endswith((".c", ".h", ".cpp")):
                    with open(os.path.join(place, name), encoding="utf-8") as f:
                        yield os.path.relpath(os.path.join(place, name), ROOT), f.read()


def test_every_id_has_one_row():
    """What geometry, renderer, fit and worker call an option is a key of the document."""
    ids = re.findall(r"#define (OPTION_\w+) \"\w+\"", dict(c_files("base"))["base/option_id.h"])
    rows = " ".join(text for _, text in c_files("optimizer/job/options"))
    assert len(ids) > 30
    for name in ids:
        assert len(re.findall(rf"\.id = {name}\b", rows)) == 1, name


FIELD = re.compile(r"error_set(?:_errno)?(?:_field|_at)\(\s*err,\s*(?:STATUS_\w+,\s*|__func__,\s*)*(\"[^\"]*\"|\w+)")


def test_computing_parts_name_options_by_ids():
    """Fields of geometry and of optimizer but its job are ids or variables. (The renderer knows no options: its fields name arguments.)"""
    seen = 0
    for path, text in c_files("geometry", "optimizer/photographs", "optimizer/fit", "optimizer/stages", "optimizer/report", "optimizer/worker"):
        if path.startswith("geometry/phantom/"):
            continue  # options of selvedge-phantom
        fields = FIELD.findall(text) + re.findall(r"snprintf\(err->field, sizeof err->field, (\"[^\"]*\"|\w+)", text)
        seen += len(fields)
        assert not [field for field in fields if field.startswith('"')], path
    assert seen > 50


def test_fields_of_the_parser_are_keys():
    """Literal fields of the parser, and those that the tests of bad documents expect."""
    fields = []
    for path, text in c_files("optimizer/job"):
        fields += [field for field in FIELD.findall(text) if field.startswith('"')]
    expected = []
    for path, text in c_files("tests/unit/optimizer"):
        if path.endswith(("test_job_document.c", "test_job_document_fit.c", "test_pipeline.c")):
            expected += re.findall(r"check_(?:input_)?error\([^;]*?,\s*\"([\w.\[\]]*)\"(?:,\s*(?:METHOD_\w+|\"[^;]*?\"))?\);", text)
    assert len(fields) > 25 and len(expected) > 100
    unknown = {field for field in expected if not names_a_key(field)}
    assert unknown == {"sampel", "volume.filter.epsd", "fit.candidates.gird", "volume.raw.order", "fit.texture.block_um", "fit.priors.beta_R.sd"}
    for field in fields:
        assert names_a_key(field.strip('"')), field
