"""Plain words in comments. A pronoun in place of a noun ("that of", "those of", "of which", "of that", "of those") makes a
sentence that is read twice, and so does "what" in place of the thing that a function returns. Counts both in the comments of
the C sources and fails above a bar for 1,000 words; then it lists the files that have most.
"""
import collections
import os
import re
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from check_layers import ROOT, files_of_tree  # noqa: E402

PARTS = ("base", "geometry", "renderer", "optimizer", "server", "clients")
BARS = (("that of, those of, of which", re.compile(r"\b(?:that|those) of\b|\bof (?:which|that|those)\b"), 0.3),
        ("what", re.compile(r"\bwhat\b", re.IGNORECASE), 0.6))


def comments(text):
    """The comments of a C source as one line."""
    return " ".join(re.sub(r"[/*\n]+", " ", c) for c in re.findall(r"/\*.*?\*/|//[^\n]*", text, re.DOTALL))


def count(sources):
    """sources: {path: text}. Returns the number of words, and for each bar a Counter of matches by path."""
    n_word, found = 0, [collections.Counter() for _ in BARS]
    for path, text in sources.items():
        words = re.sub(r" +", " ", comments(text))
        n_word += len(re.findall(r"[A-Za-z']+", words))
        for (_, pattern, _), counter in zip(BARS, found):
            counter[path] += len(pattern.findall(words))
    return n_word, found


def main():
    sources = {}
    for path in files_of_tree():
        if path.split("/")[0] in PARTS and path.endswith((".c", ".h", ".cpp")):
            with open(os.path.join(ROOT, path), encoding="utf-8") as source:
                sources[path] = source.read()
    n_word, found = count(sources)
    bad = False
    for (name, _, bar), counter in zip(BARS, found):
        share = 1000 * counter.total() / n_word
        if share > bar:
            bad = True
            print(f"{name}: {share:.2f} in 1,000 words of comments, more than {bar}. Most in:")
            for path, n in counter.most_common(8):
                print(f"  {path}: {n}")
    if bad:
        sys.exit(1)
    print("words ok")


if __name__ == "__main__":
    main()
