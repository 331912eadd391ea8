"""Calls between files go one way: no file calls a function (or reads a table) of a file that, directly or through others,
calls one of its own. Read from the object files of a build by nm, so calls through pointers do not count. Prints each
circle; exit status 1 when there is one that is not listed here.

    check_calls.py [--build build]
"""
import argparse
import collections
import os
import subprocess
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
# circles that are left, each the set of its files' names
LEFT = [
    {"contrast_blocks.c", "estimate_blocks.c"},  # contrasts are estimated by the blocks that they are made of
]


def objects_of(build):
    """Path of the source -> path of its object, for the product's sources that exist."""
    found = {}
    top = os.path.join(build, "obj")
    for folder, _, names in os.walk(top):
        for name in names:
            source = os.path.relpath(os.path.join(folder, name), top)[:-2]
            if name.endswith(".o") and not source.startswith("tests/") and os.path.exists(os.path.join(ROOT, source)):
                found[source] = os.path.join(folder, name)
    return found


def calls_of(objects):
    """Source -> {source that it needs: the symbols}."""
    home, wanted = {}, {source: set() for source in objects}
    source_of = {path: source for source, path in objects.items()}
    listed = subprocess.run(["nm", "-A", *sorted(source_of)], check=True, capture_output=True, text=True).stdout
    for line in listed.splitlines():
        path, _, symbols = line.partition(".o:")
        *_, kind, symbol = symbols.split()
        if kind == "U":
            wanted[source_of[path + ".o"]].add(symbol)
        elif kind in "TDBR":
            home[symbol] = source_of[path + ".o"]
    needs = {source: collections.defaultdict(list) for source in objects}
    for source, symbols in wanted.items():
        for symbol in sorted(symbols):
            if symbol in home and home[symbol] != source:
                needs[source][home[symbol]].append(symbol)
    return needs


def reachable(needs, start):
    seen, waiting = set(), [start]
    while waiting:
        for other in needs[waiting.pop()]:
            if other not in seen:
                seen.add(other)
                waiting.append(other)
    return seen


def circles_of(needs):
    """Sets of files of which each reaches all the others."""
    reach = {source: reachable(needs, source) for source in needs}
    circles = {frozenset(b for b in reach[a] if a in reach[b]) for a in needs if a in reach[a]}
    return sorted(circles, key=sorted)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--build", default=os.path.join(ROOT, "build"))
    objects = objects_of(parser.parse_args().build)
    if not objects:
        print("calls: nothing is built, nothing to check")
        return 0
    needs, breaches = calls_of(objects), []
    for circle in circles_of(needs):
        if {os.path.basename(source) for source in circle} in LEFT:
            continue
        breaches.append("calls go in a circle:")
        breaches += [f"    {a} -> {b}: {', '.join(needs[a][b])}" for a in sorted(circle) for b in sorted(needs[a])
                     if b in circle]
    print("\n".join(breaches) if breaches else "calls ok")
    return 1 if breaches else 0


if __name__ == "__main__":
    sys.exit(main())
