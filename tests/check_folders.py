"""The order of the folders. The README.md of each part has one table, from the ground up:

    | folder | purpose | may use |

A row names a folder below the part ("." for the part itself), and in its third column the folders of the part whose
headers it may include; "all folders above" stands for all of them. Prints each breach; exit status 1 when there is one:

- folders, or files (a header counts with the source of its name), that include each other in a circle;
- an include that goes up the table, or to a folder that the third column does not list;
- a folder with sources that has no row, a row whose folder has no sources, a third column that names a lower row;
- a part without a table.
"""
import collections
import os
import re
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from check_layers import ROOT, files_of_tree  # noqa: E402

PARTS = ("base", "geometry", "renderer", "optimizer", "server", "clients")
HEAD = re.compile(r"^\| *folder *\| *purpose *\| *may use *\|$")
ALL_ABOVE = "all folders above"


def read_sources(root, paths):
    """Returns {path: [paths that it includes]} of the sources of all parts."""
    found = {}
    for path in paths:
        if path.split("/")[0] in PARTS and path.endswith((".c", ".h", ".cpp")):
            with open(os.path.join(root, path), encoding="utf-8") as source:
                found[path] = re.findall(r'^\s*#\s*include\s+"([^"]+)"', source.read(), flags=re.M)
    return found


def find_circles(graph):
    """Returns the strongly connected components of {node: set of nodes} with more than one node, each sorted."""
    number, low, stack, found = {}, {}, [], []

    def visit(node):
        number[node] = low[node] = len(number)
        stack.append(node)
        for other in sorted(graph.get(node, ())):
            if other not in number:
                visit(other)
            if other in stack:
                low[node] = min(low[node], low[other])
        if low[node] == number[node]:
            at = stack.index(node)
            if len(stack) - at > 1:
                found.append(sorted(stack[at:]))
            del stack[at:]

    for node in sorted(graph):
        if node not in number:
            visit(node)
    return found


def check_circles(sources):
    for kind, node_of in (("folders", os.path.dirname), ("files", lambda path: os.path.splitext(path)[0])):
        graph = collections.defaultdict(set)
        for path, includes in sources.items():
            graph[node_of(path)] |= {node_of(include) for include in includes} - {node_of(path)}
        for ring in find_circles(graph):
            yield f"{kind} include each other in a circle: {', '.join(ring)}"


def read_table(text):
    """Returns {folder: folders that it may use} in the order of the table; None without a table."""
    lines = iter(text.split("\n"))
    if not any(HEAD.match(line) for line in lines):
        return None
    next(lines)
    table = {}
    for line in lines:
        if not line.startswith("|"):
            break
        name, *_, uses = [cell.strip() for cell in line.strip("|").split("|")]
        above = list(table)
        table[name.strip("`/")] = above if uses == ALL_ABOVE else [u.strip(" `/") for u in uses.split(",") if u.strip()]
    return table


def check_table(part, table, sources):
    """Compares the table of a part with its folders and their includes."""
    place = {name: i for i, name in enumerate(table)}
    folders = {os.path.relpath(os.path.dirname(path), part) for path in sources if path.startswith(part + "/")}
    for name in sorted(folders - set(table)):
        yield f"{part}/README.md: the table of folders has no row for {name}"
    for name, uses in table.items():
        if name not in folders:
            yield f"{part}/README.md: the table of folders names {name}, which has no sources"
        for use in uses:
            if place.get(use, len(table)) >= place[name]:
                yield f"{part}/README.md: {name} may use {use}, which is no row above it"
    for path, includes in sorted(sources.items()):
        user = os.path.relpath(os.path.dirname(path), part)
        for include in includes:
            used = os.path.relpath(os.path.dirname(include), part)
            if include.startswith(part + "/") and user in table and used != user and used not in table[user]:
                goes_up = place.get(used, -1) > place[user]
                reason = f"goes up: {used} is a lower row" if goes_up else f"the row of {user} does not list {used}"
                yield f"{path}: include of {include}: {reason} in the table of {part}/README.md"


def check_tree(root, paths):
    sources = read_sources(root, paths)
    yield from check_circles(sources)
    for part in PARTS:
        readme = os.path.join(root, part, "README.md")
        table = None
        if os.path.exists(readme):
            with open(readme, encoding="utf-8") as page:
                table = read_table(page.read())
        if table is None:
            yield f"{part}/README.md has no table of folders"
        else:
            yield from check_table(part, table, {p: i for p, i in sources.items() if p.startswith(part + "/")})


def main():
    breaches = list(check_tree(ROOT, files_of_tree()))
    print("\n".join(breaches) if breaches else "folders ok")
    return 1 if breaches else 0


if __name__ == "__main__":
    sys.exit(main())
