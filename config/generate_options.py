#!/usr/bin/python3
"""Writes the schema JobDocument of config/openapi.json, the page docs/options.md, the picture options of `selvedge render` and the
words of results that are words of job options (config/result.schema.json), from the table of job options.

    config/generate_options.py [--check] PRINT-OPTIONS

PRINT-OPTIONS is the program that prints the table as JSON (optimizer/job/options/option_json.h). With --check nothing is written and
the exit status is 1 when a file is out of date."""
import json
import os
import re
import subprocess
import sys
import textwrap

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
OPENAPI = os.path.join(ROOT, "config", "openapi.json")
PAGE = os.path.join(ROOT, "docs", "options.md")
RENDER = os.path.join(ROOT, "clients", "cli", "arguments", "picture_options.def")
# keys of a picture that `selvedge render` sets by --on, --lamp and --camera, or not at all
RENDER_OTHERS = {"on", "mesh_file", "light_theta_deg", "light_phi_deg", "camera_theta_deg", "camera_phi_deg", "cloth_rotation_deg"}
RENDER_HEAD = """/* The options of `selvedge render` that are options of a picture in a job document. Written by `make generate`; do not
 * edit.
 *
 * PICTURE_OPTION(key, name, value, kind, help): key of the picture; kind is number, whole, text, yes or flag. */
"""
RESULT = os.path.join(ROOT, "config", "result.schema.json")
HEAD = """# Options of a job document

This page lists every key of a job document with its unit, default and range. `make generate` writes it from the table of options
(`optimizer/job/options`); `GET /v1/options` answers the same as JSON. How to prepare a sample is in
[sample-preparation.md](sample-preparation.md), words of the field are in the [glossary](glossary.md).

Keys stand below their section: `raw.type` in the section `volume` is `{"volume": {"raw": {"type": ...}}}`, and `[]` stands for each entry
of a list. Unknown keys are errors. A range with a star takes an object, too, for a number that is searched: `{value, lower, upper,
prior: [mean, sd], fit}`.
"""
FILE_NAME = "^[^./\\\\\\x00-\\x1f\\x7f-\\x9f][^/\\\\\\x00-\\x1f\\x7f-\\x9f]{0,126}$"
WIDTH = 160


def members(options, path):
    """Key and row of the options that stand directly under a path."""
    start = path + "." if path else ""
    for row in options:
        key = row["path"][len(start):]
        if key and row["path"].startswith(start) and not re.search(r"[.\[]", key):
            yield key, row


# ---- config/openapi.json ----

def number_schema(row):
    schema = {"type": "integer" if row["kind"].startswith("integer") else "number", "minimum": row["lower"]}
    if "upper" in row:
        schema["maximum"] = row["upper"]
    return schema


def several(items, n):
    return {"type": "array", "items": items, "minItems": n, "maxItems": n}


def section_schema(options, path):
    properties = {key: option_schema(options, row) for key, row in members(options, path)}
    required = [key for key, row in members(options, path) if row["required"]]
    return {"type": "object", "properties": properties, "additionalProperties": False, **({"required": required} if required else {})}


def value_schema(options, row):
    kind = row["kind"]
    if kind == "section":
        return section_schema(options, row["path"])
    if kind == "list":
        return {"type": "array", "items": section_schema(options, row["path"] + "[]"), "minItems": 1, "maxItems": row["max_items"]}
    if kind == "file_names":
        return {"type": "array", "items": {"type": "string", "pattern": FILE_NAME}, "minItems": 1, "maxItems": row["max_items"]}
    if kind == "number_or_numbers":
        return {"anyOf": [number_schema(row), several(number_schema(row), row["n"])]}
    if kind in ("numbers", "integers"):
        return several(number_schema(row), row["n"])
    if kind in ("number", "integer"):
        return number_schema(row)
    return {"boolean": {"type": "boolean"}, "choice": {"enum": row.get("choices")}, "text": {"type": "string"},
            "file_name": {"type": "string", "pattern": FILE_NAME}, "other": {}}[kind]


def option_schema(options, row):
    schema = value_schema(options, row)
    if row.get("or_section"):
        schema = {"anyOf": [schema, section_schema(options, row["path"])]}
    if "or_word" in row:
        schema = {"anyOf": [schema, {"const": row["or_word"]}]}
    schema.update(row.get("schema", {}))
    if "default" in row:
        schema["default"] = row["default"]
    unit = f" Unit: {row['unit']}." if "unit" in row else ""
    otherwise = f" Default: {row['left_out']}." if "left_out" in row else ""
    schema["description"] = row["meaning"] + unit + otherwise
    return schema


def json_text(value, indent):
    """JSON with whatever fits on a line on one line."""
    line = json.dumps(value, ensure_ascii=False)
    if len(line) + indent <= WIDTH or not isinstance(value, (dict, list)) or not value:
        return line
    inner = " " * (indent + 2)
    if isinstance(value, dict):
        rows = [f"{inner}{json.dumps(key)}: {json_text(member, indent + 2)}" for key, member in value.items()]
    else:
        rows = [inner + json_text(member, indent + 2) for member in value]
    first, last = "{}" if isinstance(value, dict) else "[]"
    return first + "\n" + ",\n".join(rows) + "\n" + " " * indent + last


def with_schema(text, options):
    schema = json_text(option_schema(options, next(row for row in options if row["path"] == "")), 6)
    begin = re.search(r'^      "JobDocument": ', text, re.M).end()
    _, length = json.JSONDecoder().raw_decode(text[begin:])
    return text[:begin] + schema + text[begin + length:]


# ---- config/result.schema.json ----

def with_words(text, options):
    """The words of exports[].format and of pictures[].on, .method and .kind are those of the job's options."""
    schema, row_of = json.loads(text), {row["path"]: row for row in options}
    formats = [path.split(".")[1] for path in row_of if path.startswith("export.") and path not in ("export.pdf", "export.report_file")]
    schema["properties"]["exports"]["items"]["properties"]["format"]["enum"] = formats
    picture = schema["properties"]["pictures"]["items"]["properties"]
    for key in ("on", "method", "kind"):
        picture[key]["enum"] = list(row_of["pictures[]." + key]["choices"])
    picture["on"]["enum"] += ["roll", "fold"]  # of the studio alone
    picture["kind"]["enum"].remove("measurement")
    return json.dumps(schema, indent=1, ensure_ascii=False) + "\n"


# ---- docs/options.md ----

def plain(number):
    """1000, 0.05, 1e9"""
    return re.sub(r"e([+-])0*", lambda sign: "e" + sign[1].strip("+"), f"{number:g}") if abs(number) >= 1e8 or isinstance(number, float) else str(number)


def allowed_text(row):
    if "allowed" in row:
        return row["allowed"]
    if row["kind"] == "choice":
        return ", ".join(f"`{word}`" for word in row["choices"])
    if row["kind"] == "boolean":
        return "boolean"
    if "max_items" in row:
        return f"1..{row['max_items']}" + (" names" if row["kind"] == "file_names" else "")
    if "upper" not in row:
        return ""
    span = f"{plain(row['lower'])}..{plain(row['upper'])}"
    return f"{row['n']} numbers, {span}" if "n" in row else span


def cells_of(row):
    """Unit, default, allowed values and meaning of an option, as the page prints them."""
    default = f"`{json.dumps(row['default'])}`" if "default" in row else "required" if row["required"] else row.get("left_out", "")
    allowed = re.sub(r", or an object$", " \\*", allowed_text(row))
    return tuple(cell.replace("|", "\\|") for cell in (row.get("unit", ""), default, allowed, row["meaning"]))


def option_table(options, top, first):
    """The table of a section. Options that are alike in every cell to one of an earlier list, the angles of each list for example,
    share a line that names that list; `first` holds the earlier options by last key and cells."""
    lines, alike = ["| key | unit | default | allowed | meaning |", "|---|---|---|---|---|"], {}
    for row in options:
        if row["path"] != top and not row["path"].startswith(top + "."):
            continue
        parent, _, key = row["path"].rpartition(".")
        rest, cells = row["path"][len(top) + 1:], cells_of(row)
        if not rest:
            continue
        earlier = first.setdefault((key, cells), parent)
        if earlier == parent:
            lines.append("| " + " | ".join((f"`{rest}`",) + cells) + " |")
            continue
        if (parent, earlier) not in alike:
            alike[parent, earlier] = len(lines)
            lines.append(f"|  | | | as in `{earlier}` | ")
        at = alike[parent, earlier]
        name, end = lines[at][2:].split(" | ", 1)
        lines[at] = "| " + (f"{name}, `{key}`" if name.strip() else f"`{rest}`") + " | " + end
    return "\n".join(lines) + "\n"


def page(_, options):
    text, first = HEAD, {}
    plain_keys = [row for row in options if row["path"] and "." not in row["path"] and row["kind"] not in ("section", "list")]
    for row in plain_keys:
        _, default, allowed, meaning = cells_of(row)
        text += f"\n`{row['path']}` (default: {default}; allowed: {allowed}): {meaning}\n".replace("default: required", "required")
    for row in options:
        if row["path"] and "." not in row["path"] and row not in plain_keys:
            _, default, allowed, meaning = cells_of(row)
            notes = "; ".join(note for note in (default and f"without it: {default}", allowed) if note)
            text += f"\n## `{row['path']}{'[]' if row['kind'] == 'list' else ''}`\n{meaning}" + (f" ({notes})" if notes else "") + "\n\n"
            text += option_table(options, row["path"] + ("[]" if row["kind"] == "list" else ""), first)
    return text


# ---- the options of `selvedge render` ----

def render_kind(row):
    """Kind of the option of `selvedge render` (cli_render.c), and the name of its value in the help."""
    if row["kind"] == "boolean":
        return ("flag", None) if row.get("default") is False else ("yes", "yes|no")
    if row["kind"] == "choice":
        return "text", "HOW"
    return ("whole" if row["kind"] == "integer" else "number"), {"mm": "MM", "degrees": "ANGLE"}.get(row.get("unit"), "N")


def render_help(row):
    """The choices with their condition, or the first sentence of the meaning; and the default."""
    if row["kind"] == "choice":
        condition = re.match(r"Of (.*?): ", row["meaning"])
        text = (f"of {condition[1]}: " if condition else "") + ", ".join(row["choices"][:-1]) + " or " + row["choices"][-1]
    else:
        text = re.split(r"\. |\.$" if row["meaning"].startswith("Of ") else r"\. |\.$|: ", row["meaning"])[0]
        text = re.sub(r"^Whether ", "", text)
        text = text[0].lower() + text[1:]
    default = row.get("left_out") or (row.get("default") if row.get("default") is not False else None)
    text += f" (default: {plain(default) if isinstance(default, (int, float)) else default})" if default is not None else ""
    return textwrap.wrap(text.replace("`", "").replace('"', ""), 92, break_on_hyphens=False)


def render_options(_, options):
    text = RENDER_HEAD
    for row in options:
        key = row["path"][len("pictures[]."):]
        if not row["path"].startswith("pictures[].") or key in RENDER_OTHERS:
            continue
        kind, value = render_kind(row)
        value = f'"{value}"' if value else "NULL"
        lines = [f'"{line}"' for line in render_help(row)]
        text += f'PICTURE_OPTION({key}, "{key.replace("_", "-")}", {value}, {kind},\n               ' + ' CLI_NEXT_LINE\n               '.join(lines) + ")\n"
    return text


def main():
    check = "--check" in sys.argv[1:]
    program = [a for a in sys.argv[1:] if a != "--check"]
    if len(program) != 1:
        sys.exit(__doc__)
    options = json.loads(subprocess.run(program, check=True, capture_output=True, text=True).stdout)["options"]
    stale = []
    for path, renew in ((OPENAPI, with_schema), (PAGE, page), (RENDER, render_options), (RESULT, with_words)):
        old = ""
        if os.path.exists(path):
            with open(path, encoding="utf-8") as file:
                old = file.read()
        new = renew(old, options)
        if new != old:
            stale.append(os.path.relpath(path, ROOT))
            if not check:
                with open(path, "w", encoding="utf-8") as file:
                    file.write(new)
    if stale:
        print(("out of date, run `make generate`: " if check else "written: ") + ", ".join(stale))
    return 1 if check and stale else 0


if __name__ == "__main__":
    sys.exit(main())
