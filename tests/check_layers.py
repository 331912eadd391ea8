"""The rules of the layout: includes go one way (base <- geometry <- renderer <- optimizer), `server` sees base and the
optimizer's job-folder, job-document and pipeline headers only, `clients` see base only, no folder includes backwards, file names are
unique in the tree, and outside of optimizer/job no string of the computing parts names a key of the job document (base/option_id.h).
Prints each breach; exit status 1 when there is one."""
import collections
import json
import os
import re
import subprocess
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
SEES = {
    "base": {"base"},
    "geometry": {"base", "geometry"},
    "renderer": {"base", "geometry", "renderer"},
    "optimizer": {"base", "geometry", "renderer", "optimizer"},
    "server": {"base", "server"},
    "clients": {"base", "clients"},
}
SERVER_MAY = {"optimizer/job/job_folder.h", "optimizer/job/job_document.h", "optimizer/job/stage_table.h"}
COMPUTING = {"base", "geometry", "renderer", "optimizer"}
SHARED_NAMES = {"README.md", "NOTES.md", "conftest.py", ".gitignore", "index.html"}


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


def keys_in_strings(path, pattern):
    with open(os.path.join(ROOT, path), encoding="utf-8") as source:
        code = re.sub(r"/\*.*?\*/", lambda comment: re.sub(r"[^\n]", " ", comment.group()), source.read(), flags=re.S)
    for number, line in enumerate(code.split("\n"), 1):
        if line.lstrip().startswith("#include"):
            continue
        for string in re.findall(r'"((?:[^"\\]|\\.)*)"', line):
            for match in pattern.finditer(string):
                yield f"{path}:{number}: \"{match.group()}\" is a key of the job document: use an id of base/option_id.h"


def main():
    pattern = key_pattern()
    files = subprocess.run(["git", "ls-files", "--cached", "--others", "--exclude-standard"], cwd=ROOT, check=True,
                           capture_output=True, text=True).stdout.split("\n")
    breaches = []
    names = collections.defaultdict(list)
    for path in filter(None, files):
        if not os.path.exists(os.path.join(ROOT, path)):
            continue
        names[os.path.basename(path)].append(path)
        part = path.split("/")[0]
        if part not in SEES or not path.endswith((".c", ".h", ".cpp")):
            continue
        if part in COMPUTING and not path.startswith("optimizer/job/"):
            breaches += keys_in_strings(path, pattern)
        with open(os.path.join(ROOT, path), encoding="utf-8") as source:
            for number, line in enumerate(source, 1):
                match = re.match(r'\s*#\s*include\s+"([^"]+)"', line)
                if not match:
                    continue
                include = match.group(1)
                if "/" not in include:
                    breaches.append(f"{path}:{number}: include \"{include}\" by its path from the tree's root")
                elif include.split("/")[0] not in SEES[part] and not (part == "server" and include in SERVER_MAY):
                    breaches.append(f"{path}:{number}: {part} must not include \"{include}\"")
                if part == "renderer" and include.startswith("geometry/phantom"):
                    breaches.append(f"{path}:{number}: the renderer must not know phantoms")
    for name, paths in names.items():
        if len(paths) > 1 and name not in SHARED_NAMES:
            breaches.append(f"file name '{name}' is not unique: {', '.join(paths)}")
    print("\n".join(breaches) if breaches else "layers ok")
    return 1 if breaches else 0


if __name__ == "__main__":
    sys.exit(main())
