"""Writes docs/benchmarks.md from the figures of tests/bench/figures.jsonl and the words of tests/bench/readings.txt.

    write_page.py [--check] [--add FILE --date YYYY-MM-DD --machine TEXT]

figures.jsonl holds the last measured figures, one JSON object a line, as the benchmarks print them ("name", "value", "unit",
"better") with "date" and "machine", and optionally "se", a standard error, and "note". --add takes figures that a benchmark has printed
to FILE into it: they replace those of the same name. With --check nothing is written, and the exit status is 1 when page and
figures disagree.

readings.txt is the page with a line `@table NAME-PATTERN` in place of each table, for example `@table fit.{row}.{column}
column=paths,wall_s`. `{row}` and `{column}` become the rows and columns of the table, in the order of figures.jsonl; `column=`
and `row=` choose and order them, `like=` is a regular expression of the rows. A pattern without `{column}` gives a table of name and value."""
import argparse
import json
import os
import re
import sys

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))
FIGURES, READINGS = os.path.join(HERE, "figures.jsonl"), os.path.join(HERE, "readings.txt")
PAGE = os.path.join(ROOT, "docs", "benchmarks.md")
USUAL_MACHINE = "2 cores of an Intel Xeon beside other work"  # named at the head of the page


def read_figures(path=FIGURES):
    """Figures by name, in the order of the file; lines that are no figures (progress of a benchmark) are passed over."""
    with open(path, encoding="utf-8") as file:
        rows = [json.loads(line) for line in file if line.startswith("{")]
    return {row["name"]: row for row in rows}


def number(value):
    """Three digits, large numbers in scientific notation."""
    if value is None:
        return ""
    return f"{value:.3g}".replace("e+0", "e").replace("e-0", "e-").replace("e+", "e")


def cell(figure):
    if figure is None:
        return ""
    text = number(figure["value"]) + (f" +- {number(figure['se'])}" if "se" in figure else "")
    return text + ("*" if figure.get("note") == "not converged" else "")


def expression(pattern):
    """The pattern as a regular expression; a column is the last part of a name, without dots."""
    return re.compile(re.escape(pattern).replace(r"\{row\}", "(?P<row>.+?)").replace(r"\{column\}", r"(?P<column>[^.]+)"))


def order(found, wanted):
    return [name for name in wanted if name in found] if wanted else list(found)


def table(figures, pattern, row="", column="", like=".*"):
    """A Markdown table of the figures whose names match, with the date of each row, and the machines below where they are not the usual one."""
    match = {name: expression(pattern).fullmatch(name) for name in figures}
    match = {name: m for name, m in match.items() if m and re.fullmatch(like, m["row"])}
    if not match:
        raise ValueError(f"no figure of {FIGURES} has a name like '{pattern}'")
    has_column = "{column}" in pattern
    rows = order(dict.fromkeys(m["row"] for m in match.values()), row.split(",") if row else None)
    columns = order(dict.fromkeys(m["column"] for m in match.values()), column.split(",") if column else None) if has_column else ["value"]
    at = {(m["row"], m["column"] if has_column else "value"): figures[name] for name, m in match.items()}
    shown = [figure for key, figure in at.items() if key[0] in rows and key[1] in columns]
    lines = ["| | " + " | ".join(head(name, [at.get((r, name)) for r in rows]) for name in columns) + " | |",
             "|" + "---|" * (len(columns) + 2)]
    for name in rows:
        cells = [at.get((name, other)) for other in columns]
        unit = "" if has_column or cells[0]["unit"] in ("1", "") else " " + cells[0]["unit"]
        dates = [figure["date"] for figure in cells if figure]
        lines.append(f"| {name} | " + " | ".join(cell(figure) for figure in cells) + unit + f" | {max(dates)} |")
    machines = sorted({figure["machine"] for figure in shown})
    others = [name for name in machines if name != USUAL_MACHINE]
    return "\n".join(lines) + (f"\n\n{'Also' if len(others) < len(machines) else 'Machine'}: {'; '.join(others)}." if others else "")


def head(name, figures):
    """A column's name with its unit, where that is not a part of the name."""
    units = {figure["unit"] for figure in figures if figure} - {"1", ""}
    unit = units.pop() if len(units) == 1 else ""
    return f"{name} ({unit})" if unit and name != unit and not name.endswith("_" + unit) else name


def page(figures, readings):
    def expand(match):
        words = match.group(1).split()
        return table(figures, words[0], **dict(word.split("=", 1) for word in words[1:]))
    return re.sub(r"^@table (.+)$", expand, readings, flags=re.M)


def add(figures, path, date, machine):
    """Takes over what a benchmark printed."""
    for name, row in read_figures(path).items():
        figures[name] = {key: row[key] for key in ("name", "value", "unit", "better", "se", "note") if key in row}
        figures[name].update(date=date, machine=machine)


def write(path, text):
    with open(path, "w", encoding="utf-8") as file:
        file.write(text)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--add", metavar="FILE")
    parser.add_argument("--date")
    parser.add_argument("--machine")
    a = parser.parse_args()
    if a.add and not (a.date and a.machine):
        parser.error("--add needs --date and --machine")
    figures = read_figures()
    if a.add:
        add(figures, a.add, a.date, a.machine)
        write(FIGURES, "".join(json.dumps(row, ensure_ascii=False) + "\n" for row in figures.values()))
    with open(READINGS, encoding="utf-8") as file:
        text = page(figures, file.read())
    if a.check:
        with open(PAGE, encoding="utf-8") as file:
            return 0 if file.read() == text else 1
    write(PAGE, text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
