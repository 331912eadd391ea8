"""The count of words in comments that need a second reading (tests/check_words.py)."""
import os
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.dirname(os.path.abspath(__file__)))))
from check_words import BARS, comments, count  # noqa: E402


def test_comments_are_seen_and_code_is_not():
    n_word, (pronouns, what) = count({"a.c": "/* The radius, or that\n * of a neighbour. */ int what; // What it is\n", "b.c": "int those_of;"})
    assert n_word == len("The radius or that of a neighbour What it is".split())
    assert pronouns == {"a.c": 1, "b.c": 0}
    assert what == {"a.c": 1, "b.c": 0}


def test_nouns_are_no_breach():
    assert comments("x = 1; /* The radius of a neighbour. */").strip() == "The radius of a neighbour."
    assert not any(pattern.search("the radius of a neighbour, of each") for _, pattern, _ in BARS)
