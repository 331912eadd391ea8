"""The faults that `make mutants` can put into a text, the places that it leaves alone, and the tests that it chooses."""
import os
import pathlib
import sys
import types

import pytest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.path.insert(0, os.path.join(ROOT, "tests", "mutants"))
from faults import Fault, faults_of  # noqa: E402
from line_coverage import Coverage  # noqa: E402
from parts import GATE, WHOLE, Explained, files_of  # noqa: E402
from run_mutants import change_of, functions_of  # noqa: E402


def changed(text, language="c"):
    """The texts with one fault each."""
    return {fault.apply(text) for fault in faults_of("x", text, language)}


@pytest.mark.parametrize("before, after", [
    ("void f(void)\n{\n    if (a < b) c = 2;\n}\n", "void f(void)\n{\n    if (a <= b) c = 2;\n}\n"),
    ("void f(void)\n{\n    if (a < b) c = 2;\n}\n", "void f(void)\n{\n    if (0) c = 2;\n}\n"),
    ("void f(void)\n{\n    if (a < b) c = 2;\n}\n", "void f(void)\n{\n    if (a < b) c = 3;\n}\n"),
    ("void f(void)\n{\n    if (a < b) c = 2;\n}\n", "void f(void)\n{\n    if (a < b) ;\n}\n"),
    ("int f(void)\n{\n    return g(a, b) * 0.5;\n}\n", "int f(void)\n{\n    return g(b, a) * 0.5;\n}\n"),
    ("int f(void)\n{\n    return g(a, b) * 0.5;\n}\n", "int f(void)\n{\n    return g(a, b) / 0.5;\n}\n"),
    ("int f(void)\n{\n    return g(a, b) * 0.5;\n}\n", "int f(void)\n{\n    return 0;\n}\n"),
    ("int f(void)\n{\n    if (n < 0) return 7;\n    n = h(a);\n}\n", "int f(void)\n{\n    if (n < 1) return 7;\n    n = h(a);\n}\n"),
])
def test_a_fault_is_possible(before, after):
    assert after in changed(before)


@pytest.mark.parametrize("name, possible", [("store_fill", True), ("store_release", False), ("thing_free", False)])
def test_a_body_that_releases_is_not_emptied(name, possible):
    before = f"void {name}(struct thing *t)\n{{\n    t->n = 0;\n}}\n"
    assert (before.replace("{\n", "{ return;\n", 1) in changed(before)) == possible


@pytest.mark.parametrize("text, kept", [
    ("int f(void)\n{\n    if (fd < 0) return 7;\n}\n", "fd < 0"),
    ("int f(void)\n{\n    if (job->lock_fd >= 0) close(job->lock_fd);\n}\n", "lock_fd >= 0"),
    ("int f(void)\n{\n    int n = snprintf(a, 9, \"x\");\n    if (n < 0) return 7;\n}\n", "n < 0"),
    ("int f(void)\n{\n    snprintf(a + n, sizeof a - n, \"x\");\n    b = 2;\n}\n", "sizeof a - n"),
    ("int f(void)\n{\n    struct error err = {0};\n    b = 2;\n}\n", "{0}"),
    ("int f(void)\n{\n    a = hypot(b, c);\n    b = 2;\n}\n", "(b, c)"),
    ("int f(void)\n{\n    char text[40];\n    b = 2;\n}\n", "[40]"),
    ("int f(void)\n{\n    a = malloc(8 * n);\n    b = 2;\n}\n", "8"),
    ("int f(void)\n{\n    log_info(log, \"%d\", 2 + a);\n    b = 2;\n}\n", "2 + a"),
])
def test_a_place_without_an_effect_is_left_alone(text, kept):
    """Whole statements may be dropped and whole conditions replaced, but no operator and no constant in it is changed."""
    start = text.index(kept)
    inside = [f for f in faults_of("x", text, "c") if start <= f.start and f.end <= start + len(kept)]
    assert not [f for f in inside if f.operator in ("compare", "arithmetic", "logic", "constant", "swapped arguments")]


SOURCE = """static int a[] = {1,
                  2};

int f(int x)
{
    int y = g(x,
              2);
    return y;
}

int h(void) { return 1; }
"""


def coverage():
    """Of SOURCE: the quick test runs f, the slow one f and h; line 7 belongs to the counter of line 6."""
    c = object.__new__(Coverage)
    c.known = {"counted": {"x.c": [5, 6, 8, 11]}}
    c.tests = [types.SimpleNamespace(name="slow", seconds=2.0, ran={"x.c": {5, 6, 8, 11}}),
               types.SimpleNamespace(name="quick", seconds=1.0, ran={"x.c": {5, 6}}),
               types.SimpleNamespace(name="other", seconds=0.1, ran={"y.c": {6}})]
    return c


@pytest.mark.parametrize("line, names", [(1, ["quick", "slow"]), (2, ["quick", "slow"]), (6, ["quick", "slow"]), (7, ["quick", "slow"]),
                                         (8, ["slow"]), (11, ["slow"])])
def test_the_tests_that_run_a_line_are_chosen(line, names):
    """Quickest first. What is outside of all functions, as a table, belongs to all tests of the file."""
    function = next((f for f in functions_of(SOURCE) if f[0] <= line <= f[1]), None)
    assert [t.name for t in coverage().tests_of("x.c", line, line, function)] == names


def test_explained_faults_are_known_by_their_lines():
    before, after = change_of(Fault("x.c", 6, "constant", SOURCE.index("2);"), SOURCE.index("2);") + 1, "3"), SOURCE)
    assert (before, after) == ("2);", "3);")
    explained = Explained(f"# a remark\nx.c: g ignores it.\n  - {before}\n  + {after}\n")
    assert explained.n_unread == 0 and explained.reason_of("x.c", before, after) == "g ignores it."
    assert explained.reason_of("x.c", before, "4);") is None and explained.reason_of("y.c", before, after) is None


def test_each_explanation_is_of_a_line_that_is_there():
    explained = Explained()
    assert explained.n_unread == 0
    for path, before, after in explained.reason:
        lines = " ".join(pathlib.Path(ROOT, path).read_text().split())
        assert before in lines and before != after, (path, before)


def test_each_part_has_files():
    for part in [*GATE.values(), *WHOLE.values()]:
        assert files_of(pathlib.Path(ROOT), part)
