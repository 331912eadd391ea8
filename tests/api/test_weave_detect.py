"""selvedge-phantom detect: the real photo pairs of SELVEDGE_DATA, and photographs without a weave."""
import json
import os
import random
import subprocess
import sys

import pytest
from daemon_under_test import program
from small_png import png, weave

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.path.insert(0, os.path.join(ROOT, "tests", "bench"))
from png_picture import read_png  # noqa: E402

PLAIN = weave(["10", "01"])
PAIRS = os.path.join(os.environ.get("SELVEDGE_DATA") or os.path.join(ROOT, "..", "shared", "data"), "reflection-transmission-photos")
pytestmark = pytest.mark.skipif(not os.access(program("selvedge-phantom"), os.X_OK), reason="no selvedge-phantom in the build folder")
# By eye in enlarged photographs: where the weft lies on top (a hole in transmission, dark in reflection) one weft down is
# one warp to the right; in the satin two warps. Distances: horizontal rows counted; the warps from the columns of
# those places over the repeat.
TRUTH = {
    "satin1": ("satin 5", ["01111", "11011", "11110", "10111", "11101"], {"R": (1.57, 2.37), "T": (1.57, 2.37)}),
    "twill1": ("twill 3/1", ["0111", "1011", "1101", "1110"], {"R": (1.19, 2.48), "T": (1.36, 2.86)}),
    "twill2": ("twill 3/1", ["0111", "1011", "1101", "1110"], {"R": (1.25, 2.88), "T": (1.28, 2.97)}),
    "twill3": ("twill 2/1", ["011", "101", "110"], {"R": (1.28, 2.73), "T": (1.28, 2.73)}),
}


def detect(*arguments):
    p = subprocess.run([program("selvedge-phantom"), "detect", *arguments], capture_output=True, timeout=600)
    return p.returncode, json.loads(p.stdout) if p.stdout else None, p.stderr.decode()


def turns(draft):
    """All drafts that are the same but for where they begin."""
    return [[row[i:] + row[:i] for row in draft[j:] + draft[:j]] for i in range(len(draft[0])) for j in range(len(draft))]


def write_png(path, edge, grey):
    path.write_bytes(png(edge, grey))
    return str(path)


@pytest.mark.skipif(not os.path.isdir(PAIRS), reason=f"real data absent: {PAIRS} (set SELVEDGE_DATA)")
@pytest.mark.parametrize("name", sorted(TRUTH))
def test_real_pairs(name, tmp_path):
    name_of_weave, draft, spacing = TRUTH[name]
    overlay = tmp_path / "overlay.png"
    code, answer, text = detect(*(f"--photograph={PAIRS}/{name}_{kind}.png" for kind in "RT"), "--overlay", str(overlay))
    assert code == 0, text
    assert answer["agree"] and answer["cloth"]["draft"] in turns(draft)
    assert overlay.read_bytes().startswith(b"\x89PNG")
    for kind, found in zip("RT", answer["photographs"]):
        assert found["weave"] == name_of_weave and found["draft"] in turns(draft)
        assert found["middle_px"] == pytest.approx([256, 256], abs=8)  # a repeat is no larger; the overlay shows this place
        assert found["warp"]["direction_deg"] == pytest.approx(90, abs=4)
        assert found["weft"]["direction_deg"] == pytest.approx(0, abs=4)
        assert (found["warp"]["spacing_px"], found["weft"]["spacing_px"]) == pytest.approx(spacing[kind], rel=0.03)
        assert 0.2 < found["confidence"]["draft"] <= found["confidence"]["yarns"] <= 1
        # yarns of one or two pixels show neither their width nor their color
        assert found["confidence"]["width_over_spacing"] == 0 and found["confidence"]["color"] == 0


def test_scale_and_cloth_section(tmp_path):
    code, answer, text = detect("--photograph", write_png(tmp_path / "plain.png", 192, PLAIN), "--px-per-mm", "16", "--linear")
    assert code == 0, text
    assert answer["cloth"]["draft"] in (["10", "01"], ["01", "10"])
    assert answer["cloth"]["warp_per_cm"] == pytest.approx(20, rel=0.02)
    assert answer["cloth"]["weft_per_cm"] == pytest.approx(16, rel=0.02)
    assert answer["photographs"][0]["warp"]["yarns_per_cm"] == answer["cloth"]["warp_per_cm"]


def test_photographs_without_texture_are_named(tmp_path):
    noise = random.Random(1)
    bare = write_png(tmp_path / "bare.png", 128, lambda x, y: 100 + noise.random() * 50)
    code, answer, text = detect("--photograph", bare)
    assert code == 1 and "no texture that repeats in two directions" in text
    assert "cloth" not in answer and "no texture" in answer["photographs"][0]["error"]
    # beside one with a weave it is a part of the answer
    code, answer, text = detect("--photograph", bare, "--photograph", write_png(tmp_path / "plain.png", 128, PLAIN))
    assert code == 0 and "error" in answer["photographs"][0] and answer["best"].endswith("plain.png")


def test_wrong_arguments():
    assert detect()[0] == 2
    assert detect("--photograph", "a.png", "--px-per-mm", "-1")[0] == 2
    code, _, text = detect("--photograph", "/nonexistent.png")
    assert code == 1 and "nonexistent.png" in text


@pytest.mark.parametrize("draft, rarer", [(["100", "010", "001"], "warp"), (["011", "101", "110"], "weft")])
def test_rings_lie_around_the_rarer_crossings(tmp_path, draft, rarer):
    """Orange ones where the warp is on top, blue ones where the weft is; the left half of the picture has none."""
    photograph, overlay = write_png(tmp_path / "weave.png", 160, weave(draft)), tmp_path / "overlay.png"
    code, answer, text = detect("--photograph", photograph, "--overlay", str(overlay))
    assert code == 0 and answer["photographs"][0]["draft"] in turns(draft), text
    colors = {"warp": 0, "weft": 0}
    for row in read_png(overlay):
        for x in range(0, len(row), 3):
            difference = row[x] - row[x + 2]
            if abs(difference) > 60:
                assert x > len(row) // 2
                colors["warp" if difference > 0 else "weft"] += 1
    # a third of the crossings; around the other two thirds there would be twice as many pixels
    assert colors[rarer] == pytest.approx(24000, rel=0.2) and sum(colors.values()) == colors[rarer]
