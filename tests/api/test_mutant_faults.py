"""The faults that `make mutants` can put into a text, and the places that it leaves alone."""
import os
import sys

import pytest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.path.insert(0, os.path.join(ROOT, "tests", "mutants"))
from faults import faults_of  # noqa: E402


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
