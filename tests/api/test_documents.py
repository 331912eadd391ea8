"""Every Markdown file of the tree names only files, folders, programs and make targets that exist."""
import glob
import os
import re
import subprocess

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
TOP = "base|geometry|renderer|optimizer|server|clients|config|docs|tests"
# names that are no source files: libraries that the daemon serves, a style that it generates, a key of job documents
FOREIGN_NAMES = {"cloth.py", "dygraph.min.js", "dygraph.min.css", "three.js", "three.module.js", "quality.css", "filter.h"}


def tracked(*pattern):
    answer = subprocess.run(["git", "ls-files", "--cached", "--others", "--exclude-standard", *pattern], cwd=ROOT,
                            check=True, capture_output=True, text=True)
    return [path for path in answer.stdout.split("\n") if path and os.path.exists(os.path.join(ROOT, path))]


def texts():
    for path in tracked("*.md"):
        with open(os.path.join(ROOT, path), encoding="utf-8") as f:
            yield path, f.read()


def without_braces(path):
    """`a/{b,c}.h` as `a/b.h`, `a/c.h`."""
    found = re.search(r"\{([^}]*)\}", path)
    if not found:
        return [path]
    return [one for part in found.group(1).split(",")
            for one in without_braces(path[:found.start()] + part + path[found.end():])]


def exists(path):
    """As written, or a source file without its ending (`geometry/fibers/shape/radius`)."""
    return any(glob.glob(os.path.join(ROOT, path + ending)) for ending in ("", ".c", ".h"))


def makefiles():
    """The text of the Makefile and of what it includes."""
    text = ""
    for path in tracked("Makefile", "*.mk"):
        with open(os.path.join(ROOT, path), encoding="utf-8") as f:
            text += f.read()
    return text


def make_targets():
    return {name for names in re.findall(r"^([a-z][a-z0-9 -]*):(?!=)", makefiles(), re.MULTILINE) for name in names.split()}


def test_links_lead_somewhere():
    missing = [f"{path}: {target}" for path, text in texts()
               for target in re.findall(r"\]\(([^)#]+)[^)]*\)", text)
               if "://" not in target and not os.path.exists(os.path.join(ROOT, os.path.dirname(path), target))]
    assert not missing


def test_paths_exist():
    missing = [f"{path}: {name}" for path, text in texts()
               for name in re.findall(rf"(?<![\w/.:-])(?:{TOP})/[\w./*{{}},-]*", text)
               for one in without_braces(name.rstrip(".,")) if "my_" not in one and not exists(one)]
    assert not missing


def test_source_files_exist():
    known = {os.path.basename(path) for path in tracked()} | FOREIGN_NAMES
    missing = [f"{path}: {name}" for path, text in texts()
               for name in re.findall(r"(?<![\w.<-])[a-z][\w.-]*\.(?:c|h|cpp|py|sh|js|css)\b", text)
               if "my_" not in name and name not in known]
    assert not missing


def test_make_targets_exist():
    targets = make_targets()
    assert "all" in targets and "test" in targets
    missing = [f"{path}: make {name}" for path, text in texts()
               for name in re.findall(r"(?:`|^    )make ([a-z][a-z0-9-]*)", text, re.MULTILINE) if name not in targets]
    assert not missing


def test_programs_exist():
    makefile = makefiles()
    missing = [f"{path}: {name}" for path, text in texts()
               for name in re.findall(r"build/(bin/[\w-]+|tests/bench/bench_\w+)", text)
               if f"$(BUILD)/{name}" not in makefile and not exists(name)]
    assert not missing


def test_tests_exist():
    known = {os.path.splitext(os.path.basename(path))[0] for path in tracked() if path.startswith("tests/")}
    missing = [f"{path}: {name}" for path, text in texts() if path.startswith("docs/")
               for name in re.findall(r"`(test_\w+)`", text) if name not in known]
    assert not missing


# sections, equations, figures and tables of chapters 4 to 6 of the fabric thesis: the largest number of each series
SOURCE_SECTIONS = {"4": 9, "4.3": 2, "4.4": 4, "4.6": 4, "4.7": 3, "4.8": 2, "4.9": 1, "5": 8, "5.2": 3, "5.4": 3, "5.5": 5,
                   "5.6": 7, "5.7": 4, "6": 7, "6.4": 4, "6.5": 3, "7": 1}
SOURCE_NUMBERS = {"equation": {4: 6, 5: 14, 6: 2}, "figure": {4: 17, 5: 26, 6: 11}, "table": {4: 3, 5: 3, 6: 2}}


def places_of(cell):
    """("", "5.5.1") for sections and ("figure", "5.3") and the like, of the first cell of a row. Ranges are written out."""
    kind = ""
    for word, first, last in re.findall(r"(equation|figure|table)s? |(\d+(?:\.\d+)+)(?: to (\d+(?:\.\d+)+))?", cell):
        if word:
            kind = word
            continue
        series, start = first.rsplit(".", 1)
        for number in range(int(start), int(last.rsplit(".", 1)[1] if last else start) + 1):
            yield kind, f"{series}.{number}"


def source_rows():
    """Rows of the tables with a place of the source, as lists of cells."""
    for name in ("source-table.md", "thesis.md"):
        with open(os.path.join(ROOT, "docs", name)) as page:
            for table in re.findall(r"^\| place \|.*\n\|[-|]+\n((?:\|.*\n)+)", page.read(), re.MULTILINE):
                yield from ([cell.strip() for cell in row.strip("|").split("|")] for row in table.splitlines())


def test_source_table_has_every_place():
    found = {place for row in source_rows() for place in places_of(row[0])}
    wanted = {("", f"{series}.{number}") for series, most in SOURCE_SECTIONS.items() for number in range(1, most + 1)}
    for kind, chapters in SOURCE_NUMBERS.items():
        wanted |= {(kind, f"{chapter}.{number}") for chapter, most in chapters.items() for number in range(1, most + 1)}
    assert not wanted - found, sorted(wanted - found)
    assert not found - wanted, sorted(found - wanted)
