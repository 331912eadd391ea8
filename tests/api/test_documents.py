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
    return {name for names in re.findall(r"^([a-z][a-z -]*):(?!=)", makefiles(), re.MULTILINE) for name in names.split()}


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
               for name in re.findall(r"(?<![\w.-])[a-z][\w.-]*\.(?:c|h|cpp|py|sh|js|css)\b", text)
               if "my_" not in name and name not in known]
    assert not missing


def test_make_targets_exist():
    targets = make_targets()
    assert "all" in targets and "test" in targets
    missing = [f"{path}: make {name}" for path, text in texts()
               for name in re.findall(r"(?:`|^    )make ([a-z][a-z-]*)", text, re.MULTILINE) if name not in targets]
    assert not missing


def test_programs_exist():
    makefile = makefiles()
    missing = [f"{path}: {name}" for path, text in texts()
               for name in re.findall(r"build/(bin/[\w-]+|tests/bench/bench_\w+)", text)
               if f"$(BUILD)/{name}" not in makefile and not exists(name)]
    assert not missing
