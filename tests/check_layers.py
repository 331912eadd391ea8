"""The rules of the layout. Prints each breach; exit status 1 when there is one.

- Includes go one way: base <- geometry <- renderer <- optimizer. optimizer/job sees base alone, so that the daemon can
  link it; `server` sees base and optimizer/job; `clients` see base. Includes are paths from the root of the tree.
- The daemon, when it is built, holds no symbol of the renderer or of geometry.
- File names are unique in the tree.
- Every header begins with a comment that says what it is for.
- Outside of optimizer/job no string of the computing parts names a key of the job document (base/option_id.h).
"""
import argparse
import collections
import json
import os
import re
import subprocess
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
# folder: the folders whose headers its files may include; the longest folder that a path begins with counts
SEES = {
    "base": ("base",),
    "geometry": ("base", "geometry"),
    "renderer": ("base", "geometry", "renderer"),
    "optimizer": ("base", "geometry", "renderer", "optimizer"),
    "optimizer/job": ("base", "optimizer/job"),
    "server": ("base", "server", "optimizer/job"),
    "clients": ("base", "clients"),
}
# the list of scattering models may include their rows, which are data
MODEL_LIST, MODEL_ROWS = "base/catalogue/models.def", re.compile(r"renderer/scattering/models/\w+/\w+\.def")
COMPUTING = ("base", "geometry", "renderer", "optimizer")
SHARED_NAMES = {"README.md", "NOTES.md", "conftest.py", ".gitignore", "index.html"}


def files_of_tree():
    """Paths of all files that are, or could be, under version control."""
    listed = subprocess.run(["git", "ls-files", "--cached", "--others", "--exclude-standard"], cwd=ROOT, check=True,
                            capture_output=True, text=True).stdout.split("\n")
    return [path for path in listed if path and os.path.exists(os.path.join(ROOT, path))]


def is_below(path, folder):
    return path.startswith(folder + "/")


def layer_of(path):
    """The folder of SEES that a file belongs to; None for files outside of all layers."""
    return max((folder for folder in SEES if is_below(path, folder)), key=len, default=None)


def check_includes(path, text):
    layer = layer_of(path)
    for number, line in enumerate(text.split("\n"), 1):
        match = re.match(r'\s*#\s*include\s+"([^"]+)"', line)
        if not match:
            continue
        include = match.group(1)
        if include.startswith("generated/"):
            continue  # rows that the Makefile gathers
        if "/" not in include:
            yield f"{path}:{number}: include \"{include}\" by its path from the tree's root"
        elif path == MODEL_LIST and MODEL_ROWS.fullmatch(include):
            continue
        elif not any(is_below(include, folder) for folder in SEES[layer]):
            yield f"{path}:{number}: {layer} must not include \"{include}\""
        elif layer == "renderer" and is_below(include, "geometry/phantom"):
            yield f"{path}:{number}: the renderer must not know phantoms"


def check_purpose(path, text):
    """A header begins with a comment of at least one sentence."""
    comment = re.match(r"/\*(.*?)\*/", text, flags=re.S)
    words = re.findall(r"\w+", comment.group(1)) if comment else []
    if len(words) < 4 or not re.search(r"\w[.;:)]", comment.group(1)):
        yield f"{path}:1: the header does not begin with a sentence that says what it is for"


def check_names(paths):
    places = collections.defaultdict(list)
    for path in paths:
        places[os.path.basename(path)].append(path)
    for name, found in places.items():
        if len(found) > 1 and name not in SHARED_NAMES:
            yield f"file name '{name}' is not unique: {', '.join(found)}"


def key_pattern():
    """Finds keys of the job document, such as volume.filter.eps_d and photographs[3].file."""
    with open(os.path.join(ROOT, "config", "openapi.json"), encoding="utf-8") as description:
        sections = json.load(description)["components"]["schemas"]["JobDocument"]["properties"]
    keys = []
    for name, section in sections.items():
        members = section.get("items", section).get("properties", {})
        if members:
            keys.append(rf"{name}(\[[^\]]*\])?\.({'|'.join(members)})")
    return re.compile(rf"\b({'|'.join(keys)})\b")


def keys_in_strings(path, text, pattern):
    code = re.sub(r"/\*.*?\*/", lambda comment: re.sub(r"[^\n]", " ", comment.group()), text, flags=re.S)
    for number, line in enumerate(code.split("\n"), 1):
        if line.lstrip().startswith("#include"):
            continue
        for string in re.findall(r'"((?:[^"\\]|\\.)*)"', line):
            for match in pattern.finditer(string):
                yield f"{path}:{number}: \"{match.group()}\" is a key of the job document: use an id of base/option_id.h"


def symbols(file):
    """Names that a library or program defines for others."""
    lines = subprocess.run(["nm", "--extern-only", "--defined-only", "--format=posix", file], check=True,
                           capture_output=True, text=True).stdout.split("\n")
    return {line.split()[0] for line in lines if len(line.split()) >= 2}


def check_symbols(build):
    """The daemon holds nothing of the libraries that compute. Says nothing where it is not built."""
    daemon = os.path.join(build, "bin", "selvedged")
    if not os.path.exists(daemon):
        return
    held = symbols(daemon)
    for name in ("renderer", "geometry"):
        library = os.path.join(build, "lib", f"lib{name}.a")
        common = sorted(held & symbols(library)) if os.path.exists(library) else []
        if common:
            yield f"selvedged holds symbols of {name}: {', '.join(common[:5])}{', ...' if len(common) > 5 else ''}"


def check_source(path, pattern):
    with open(os.path.join(ROOT, path), encoding="utf-8") as source:
        text = source.read()
    if layer_of(path) is not None:
        yield from check_includes(path, text)
    if path.endswith(".h"):
        yield from check_purpose(path, text)
    if path.split("/")[0] in COMPUTING and not is_below(path, "optimizer/job"):
        yield from keys_in_strings(path, text, pattern)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", default=os.path.join(ROOT, "build"), help="where programs and libraries are built")
    build = parser.parse_args().build
    paths, pattern = files_of_tree(), key_pattern()
    breaches = list(check_names(paths))
    for path in paths:
        if path.endswith((".c", ".h", ".cpp", ".def")):
            breaches += check_source(path, pattern)
    breaches += check_symbols(build)
    print("\n".join(breaches) if breaches else "layers ok")
    return 1 if breaches else 0


if __name__ == "__main__":
    sys.exit(main())
