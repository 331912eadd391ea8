"""Figures of the source tree. Prints house.*, one JSON object on a line.

    bench_house.py [--build DIR] [--times]

house.folder_circles, .file_circles   folders, and files (a header with the source of its name), that include each other
house.upward_includes                 includes that a table of folders (README.md of a part) does not permit
house.option_objects                  most objects of the programs that a change of one header of optimizer/job/document compiles anew
house.document_files                  C files of the parts that name struct job_document, the whole of a job
house.model_objects                   objects that a new scattering model compiles: its own source, and the readers of the list of rows
house.that_of, .what                  pronouns in place of nouns in 1,000 words of comments (tests/check_words.py)
house.docs_words                      words of docs/
house.build_s, .check_s, .test_s      with --times: seconds of a clean build in a folder of its own, of `make check` and `make test`

Objects are counted from the dependency files of the build, which must be complete.
"""
import argparse
import collections
import glob
import json
import os
import re
import shutil
import subprocess
import sys
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.dirname(os.path.abspath(__file__)))))
import check_folders  # noqa: E402
import check_words  # noqa: E402
from check_layers import ROOT, files_of_tree  # noqa: E402


def figure(name, value, unit="1"):
    print(json.dumps({"name": f"house.{name}", "value": round(value, 3), "unit": unit, "better": "lower"}), flush=True)


def circles(sources, node_of):
    """Number of nodes that are part of a circle."""
    graph = collections.defaultdict(set)
    for path, includes in sources.items():
        graph[node_of(path)] |= {node_of(include) for include in includes} - {node_of(path)}
    return sum(map(len, check_folders.find_circles(graph)))


def users(build):
    """{header: objects of the programs that were compiled with it}."""
    found = collections.defaultdict(set)
    for path in glob.glob(os.path.join(build, "obj", "**", "*.d"), recursive=True):
        name = os.path.relpath(path, os.path.join(build, "obj"))
        if name.split("/")[0] in check_folders.PARTS:
            with open(path, encoding="utf-8") as rule:
                for header in rule.read().replace("\\\n", " ").split(":", 1)[1].split():
                    found[header].add(name)
    return found


def seconds(*command):
    start = time.monotonic()
    subprocess.run(command, cwd=ROOT, check=True, stdout=sys.stderr)
    return time.monotonic() - start


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", default=os.path.join(ROOT, "build"))
    parser.add_argument("--times", action="store_true")
    arguments = parser.parse_args()
    paths = files_of_tree()
    sources = check_folders.read_sources(ROOT, paths)
    figure("folder_circles", circles(sources, os.path.dirname))
    figure("file_circles", circles(sources, lambda path: os.path.splitext(path)[0]))
    figure("upward_includes", sum("table of" in breach and "include of" in breach for breach in check_folders.check_tree(ROOT, paths)))
    found = users(arguments.build)
    figure("option_objects", max(len(o) for h, o in found.items() if re.fullmatch(r"optimizer/job/document/job_\w+\.h", h)
                                 and h.split("/")[-1] not in ("job_limits.h", "job_sections.h", "job_file_name.h")))
    figure("model_objects", 1 + len(found["base/catalogue/models.def"]))
    texts = {}
    for path in sources:
        with open(os.path.join(ROOT, path), encoding="utf-8") as source:
            texts[path] = source.read()
    figure("document_files", sum(bool(re.search(r"struct job_document\b", text)) for text in texts.values()))
    n_word, counters = check_words.count(texts)
    for name, counter in zip(("that_of", "what"), counters):
        figure(name, 1000 * counter.total() / n_word)
    pages = [open(os.path.join(ROOT, p), encoding="utf-8").read() for p in paths if p.startswith("docs/") and p.endswith(".md")]
    figure("docs_words", sum(len(re.findall(r"[A-Za-z']+", page)) for page in pages))
    if arguments.times:
        clean = os.path.join(ROOT, "build", "house")
        shutil.rmtree(clean, ignore_errors=True)
        figure("build_s", seconds("make", f"-j{os.cpu_count()}", f"BUILD={clean}", "all"), "s")
        figure("check_s", seconds("make", "check"), "s")
        figure("test_s", seconds("make", "test"), "s")


if __name__ == "__main__":
    main()
