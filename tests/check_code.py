"""The sizes that keep the code readable: no function has more than 60 lines, no function of the product more than 7
parameters besides the error record that comes last, no source file more than 400 lines. Exceptions stand here with
their reason. Prints each breach; exit status 1 when there is one. Folders have no limit: includes decide what belongs
together (tests/check_layers.py), 20 source files at one level are guidance."""
import os
import re
import subprocess
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
FOLDERS = ("base/", "geometry/", "renderer/", "optimizer/", "server/", "clients/", "tests/")
FUNCTION_LINES, FILE_LINES, PARAMETERS = 60, 400, 7
# longer files, and why they are one file
LONG_FILES = {}
# longer parameter lists, and why
LONG_LISTS = {
    "on_request": "the callback of libmicrohttpd has this signature",
    "reconstruct_read": "its files, options and results come with all that a computation works with: memory, threads, progress",
}


def sources():
    listed = subprocess.run(["git", "ls-files", "--cached", "--others", "--exclude-standard"], cwd=ROOT, check=True,
                            capture_output=True, text=True).stdout.split("\n")
    return [p for p in listed if p.startswith(FOLDERS) and p.endswith((".c", ".h", ".cpp", ".py", ".js"))
            and os.path.exists(os.path.join(ROOT, p))]


def head_start(lines, opening):
    """The first line of the function whose body opens at line `opening`: its head has neither blank lines nor comments."""
    first = opening
    while first > 0 and lines[first - 1].strip() and not lines[first - 1].startswith(("}", "#", "/*", " *")) \
            and not lines[first - 1].rstrip().endswith(("*/", ";")):
        first -= 1
    return first


def n_parameter(head):
    """The number of parameters in a function's head, commas inside of inner brackets left out."""
    inner = head[head.index("(") + 1:]
    depth, n = 0, 0 if "struct error *err)" in inner else 1
    for c in inner:
        depth += c in "(["
        depth -= c in ")]"
        if depth < 0:
            break
        n += c == "," and depth == 0
    return n


def check_functions(path, lines, breaches):
    """Functions of a C file: formatted by clang-format, their braces stand alone in the first column."""
    opening = None
    for i, line in enumerate(lines):
        if line == "{":
            opening = i
        elif line == "}" and opening is not None:
            first = head_start(lines, opening)
            head = " ".join(lines[first:opening])
            if "(" in head:
                name = re.search(r"(\w+)\(", head).group(1)
                if i - first + 1 > FUNCTION_LINES:
                    breaches.append(f"{path}:{first + 1}: {name} has {i - first + 1} lines, the limit is {FUNCTION_LINES}")
                if n_parameter(head) > PARAMETERS and name not in LONG_LISTS and not path.startswith("tests/"):
                    breaches.append(f"{path}:{first + 1}: {name} has {n_parameter(head)} parameters, the limit is {PARAMETERS}")
            opening = None


def main():
    breaches = []
    for path in sources():
        with open(os.path.join(ROOT, path), encoding="utf-8") as source:
            lines = source.read().split("\n")
        if len(lines) - 1 > FILE_LINES and path not in LONG_FILES:
            breaches.append(f"{path}: {len(lines) - 1} lines, the limit is {FILE_LINES}")
        if path.endswith((".c", ".cpp")):
            check_functions(path, lines, breaches)
    print("\n".join(breaches) if breaches else "code sizes ok")
    return 1 if breaches else 0


if __name__ == "__main__":
    sys.exit(main())
