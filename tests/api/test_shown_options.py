"""Every option of a job is shown where a user looks for it: in an example, a client, or a document that somebody wrote."""
import collections
import glob
import json
import os
import re
import subprocess

import pytest
from daemon_under_test import BUILD, ROOT

GENERATED = {"docs/options.md", "docs/benchmarks.md", "docs/api.md"}
EXAMPLES = sorted(glob.glob(os.path.join(ROOT, "config", "examples", "*.json")))
TOKEN = re.compile(r'"((?:[^"\\]|\\.)*)"\s*(:?)|([{}\[\]])')


def keys_of(text):
    """Keys of JSON, which may be a part of a document, with the keys around them: fit.texture.weight."""
    found, around, key = set(), [], None
    for word, colon, bracket in TOKEN.findall(text):
        if bracket in ("{", "["):
            around.append(key)
            key = None
        elif bracket:
            del around[-1:]
            key = None
        elif colon:
            key = word
            found.add(".".join([*filter(None, around), key]))
    return found


def names_in(path, text):
    """Keys of its JSON, and names that it quotes."""
    if path.endswith(".json"):
        return keys_of(text)
    if not path.endswith(".md"):
        return set(re.findall(r"[\"']([\w.]+)[\"']", text))
    blocks = re.findall(r"```.*?\n(.*?)```", text, re.DOTALL) + re.findall(r"((?:^ {4}.*\n)+)", text, re.MULTILINE)
    spans = re.findall(r"`([^`]+)`", re.sub("```.*?```", "", text, flags=re.DOTALL))
    found = set().union(*map(keys_of, blocks + spans))
    for span in spans:
        found |= {name.replace("[]", "") for name in re.findall(r"[A-Za-z_][\w.\[\]]*", span)}
    return found


def texts():
    listed = subprocess.run(["git", "ls-files"], cwd=ROOT, check=True, capture_output=True, text=True).stdout.split()
    for path in listed:
        written = path.endswith(".md") and path not in GENERATED and not path.endswith(("NOTES.md", "CHANGELOG.md"))
        if written or path.startswith("config/examples/") or (path.startswith("clients/") and path.endswith((".c", ".js", ".py"))):
            with open(os.path.join(ROOT, path), encoding="utf-8") as file:
                yield path, file.read()


def is_shown(parts, only_one, names, is_document):
    """By its path, or by the end of it with two keys; by one key where no other option ends so, and in a document that names its section."""
    ends = {".".join(parts[i:]) for i in range(max(1, len(parts) - 1))}
    if ends & names or (only_one and parts[-1] in names) or any(name.endswith("." + end) for name in names for end in ends if "." in end):
        return True
    words = {word for name in names for word in name.split(".")} if is_document else set()
    return {*parts[-2:]} <= words


def not_shown(options, sources):
    """Options with the same key and the same meaning, such as an angle of a lamp, are shown once."""
    ends = collections.Counter(row["path"].rpartition(".")[2] for row in options)
    shown, names = set(), [(path.endswith((".md", ".json")), names_in(path, text)) for path, text in sources]
    for row in options:
        parts = row["path"].replace("[]", "").split(".")
        if any(is_shown(parts, ends[parts[-1]] == 1, found, is_document) for is_document, found in names):
            shown.add((parts[-1], row["meaning"]))
    return [row["path"] for row in options if (row["path"].rpartition(".")[2].replace("[]", ""), row["meaning"]) not in shown]


@pytest.fixture(scope="module")
def options():
    program = os.path.join(BUILD, "tools", "print-options")
    return json.loads(subprocess.run([program], check=True, capture_output=True, text=True).stdout)["options"][1:]


def test_every_option_is_shown(options):
    assert not not_shown(options, list(texts()))


def test_an_option_that_nothing_names_is_found():
    rows = [{"path": path, "meaning": path} for path in ("fit.hidden", "fit.plain", "fit.seed", "cloth.seed", "pictures[].px")]
    page = "Give `fit.seed`.\n\n    \"fit\": {\"plain\": 3}, \"pictures\": [{\"px\": 5}]\n\n"
    assert not_shown(rows, [("docs/a.md", page)]) == ["fit.hidden", "cloth.seed"]
    assert not_shown(rows, [("clients/a.c", "\"hidden\" \"seed\" 'px'")]) == ["fit.plain", "fit.seed", "cloth.seed"]


@pytest.mark.parametrize("path", EXAMPLES, ids=os.path.basename)
def test_examples_lack_their_files_alone(path, tmp_path):
    done = subprocess.run([os.path.join(BUILD, "bin", "selvedge-worker"), "--check", path, str(tmp_path)], capture_output=True, text=True)
    faults = json.loads(done.stdout)["faults"]
    assert [f for f in faults if "does not exist" not in f["detail"]] == [], done.stderr
    with open(os.path.join(os.path.dirname(path), "README.md"), encoding="utf-8") as page:
        assert os.path.basename(path) in page.read()
