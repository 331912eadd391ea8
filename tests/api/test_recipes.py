"""The recipes of CONTRIBUTING.md are carried out on a copy of the tree, which is then built. A comment "recipe" before an
example says where it goes:

    create FILE               the example is the file
    append FILE               it goes to the end of the file
    insert FILE before TEXT   or after TEXT: before or after the only line with that text
    copy FILE NEW a=b ...     NEW is FILE with each a replaced by b; the example is for readers only
"""
import os
import re
import shutil
import subprocess
import textwrap

import pytest
from daemon_under_test import BUILD

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
pytestmark = pytest.mark.slow
STEP = re.compile(r"^ *<!-- recipe (\w+) (.+?) -->\n\n((?:(?: {4,}.*)?\n)*)", re.MULTILINE)


def recipes():
    """{title: [(verb, words, example)]} of the sections "Add ..."."""
    with open(os.path.join(ROOT, "CONTRIBUTING.md"), encoding="utf-8") as page:
        sections = re.split(r"^### Add an? ", page.read(), flags=re.MULTILINE)[1:]
    return {section.split("\n", 1)[0]: [(verb, words, textwrap.dedent(example).strip("\n") + "\n")
                                        for verb, words, example in STEP.findall(section)] for section in sections}


def stated_counts():
    """{title: files} of the table of extensions."""
    with open(os.path.join(ROOT, "CONTRIBUTING.md"), encoding="utf-8") as page:
        return {re.sub("^an? ", "", title): int(count) for title, count in re.findall(r"^\| (an? [^|]+?) \| (\d+): ", page.read(), re.MULTILINE)}


def apply(tree, verb, words, example):
    """Carries out one step and returns the file that it changes."""
    path, _, rest = words.partition(" ")
    full = os.path.join(tree, path)
    if verb == "create":
        assert not os.path.exists(full), f"{path} exists"
        text = example
    elif verb == "append":
        text = open(full, encoding="utf-8").read() + "\n" + example
    elif verb == "insert":
        side, anchor = rest.split(" ", 1)
        lines = open(full, encoding="utf-8").read().splitlines(keepends=True)
        at = [i for i, line in enumerate(lines) if anchor in line]
        assert len(at) == 1, f"{path}: {len(at)} lines have {anchor!r}"
        lines.insert(at[0] + (side == "after"), example)
        text = "".join(lines)
    else:
        assert verb == "copy", verb
        path, *replacements = rest.split(" ")
        text = open(full, encoding="utf-8").read()
        for old, new in (r.split("=", 1) for r in replacements):
            assert old in text, f"{words}: no {old}"
            text = text.replace(old, new)
        full = os.path.join(tree, path)
    os.makedirs(os.path.dirname(full), exist_ok=True)
    with open(full, "w", encoding="utf-8") as out:
        out.write(text)
    return path


@pytest.fixture(scope="module")
def tree(tmp_path_factory):
    """A copy of the tree and of what is built, with all recipes carried out; (path, {title: files})."""
    copy = str(tmp_path_factory.mktemp("recipes") / "tree")
    for name in subprocess.run(["git", "ls-files"], cwd=ROOT, check=True, capture_output=True, text=True).stdout.split("\n"):
        if name and os.path.exists(os.path.join(ROOT, name)):
            os.makedirs(os.path.dirname(os.path.join(copy, name)), exist_ok=True)
            shutil.copy2(os.path.join(ROOT, name), os.path.join(copy, name), follow_symlinks=False)
    for part in ("obj", "lib", "bin", "tools", "generated"):
        source = os.path.join(BUILD, part)
        if os.path.isdir(source):
            shutil.copytree(source, os.path.join(copy, "build", part), symlinks=True, ignore=shutil.ignore_patterns("tests"))
    touched = {title: [apply(copy, *step) for step in steps] for title, steps in recipes().items()}
    return copy, touched


def make(copy, *targets):
    environment = {k: v for k, v in os.environ.items() if not k.startswith("MAKE")}
    # what the copied objects do not cover is only built and hardly run
    done = subprocess.run(["make", "-j2", "OPTIMIZE=-O0", "LDFLAGS=-fuse-ld=gold", *targets], cwd=copy, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-6000:]
    return done.stdout


def run(copy, *command):
    done = subprocess.run(command, cwd=copy, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
    return done.stdout


def test_every_extension_has_a_recipe():
    assert set(stated_counts()) == set(recipes())
    assert not [title for title, steps in recipes().items() if not steps]


def test_files_are_as_many_as_the_table_says(tree):
    for title, count in stated_counts().items():
        files = {f for f in tree[1][title] if not f.startswith(("tests/", "docs/"))}
        assert len(files) == count, (title, files)


def test_the_copy_is_built_and_has_what_was_added(tree):
    copy = tree[0]
    run(copy, "git", "init", "-q")
    run(copy, "git", "add", "-A")
    make(copy, "generate")
    make(copy, "all", "build/tests/unit/geometry/volume/test_volume_readers")
    assert "age ID" in run(copy, "build/bin/selvedge", "--help")
    run(copy, "build/tests/unit/geometry/volume/test_volume_readers")
    with open(os.path.join(copy, "docs", "options.md"), encoding="utf-8") as page:
        options = page.read()
    assert "smooth_alpha" in options
    assert "my_descent.v1" in options and "my_grey.v1" in options and "my_points" in options
    with open(os.path.join(copy, "docs", "api.md"), encoding="utf-8") as page:
        assert "/v1/jobs/{id}/state" in page.read()
