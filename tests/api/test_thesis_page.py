"""The page and the pictures of make bench-thesis (tests/bench/thesis): from made-up results, whole and with steps that are not there."""
import copy
import os
import re
import struct
import sys
import xml.etree.ElementTree as ElementTree

import pytest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.path.insert(0, os.path.join(ROOT, "tests", "bench", "thesis"))
import thesis_fits  # noqa: E402
import thesis_looks  # noqa: E402
import thesis_numbers  # noqa: E402
import thesis_page  # noqa: E402
import thesis_pictures  # noqa: E402
from thesis_fabrics import MODELS, NAMES, truth  # noqa: E402


def a_fit(model, fabric):
    flat = thesis_fits.flat(truth(fabric, model))
    return {"heldout": 0.05, "below_noise": False, "brdf": 0.5, "ratio": 0.1, "grazing": [0.5, 0.7], "cpu_s": 40.0, "truth": flat,
            "parameters": [[name, value, 0.01 * value, True] for name, value in flat.items()], "of_rows": [0.9], "of_fitted": 0.95}


def columns(level):
    """A lamp for each of five tables; the brightest column moves with it."""
    return [[[level * (2 if k == 3 + i else 1)] * 3 + [0.01] * 3 for k in range(thesis_pictures.BINS)] for i in range(5)]


@pytest.fixture
def found():
    f = {(fabric, model): a_fit(model, fabric) for fabric in NAMES for model in MODELS}
    f.update({(fabric, model, "cross"): a_fit(model, fabric) for fabric in NAMES for model in MODELS if model != "two_lobe"})
    f.update({(fabric, "bisected"): a_fit("microflake", fabric) for fabric in NAMES})
    f.update({("density", d): a_fit("volume", "fleece") for d in thesis_fits.DENSITIES})
    f.update({("shapes", fabric, model): {"columns": columns(level), "drapes": [level, level, 2 * level, 3 * level]}
              for fabric in NAMES for model, level in (("photograph", 1.0), ("volume", 0.8), ("microflake", 0.4))})
    names = [f"size-{e}" for e in thesis_pictures.CELL_PATHS] + [f"order-{o}" for o in thesis_pictures.ORDERS] + ["path", "directions", "dual"]
    f.update({("fast", name): {"mean": 1.0, "fields": [[1.0 + 0.1 * (name == "order-1")] * 3] * 4} for name in names})
    f.update({("chain", name): {"columns": columns(1.0)} for name in thesis_pictures.CHAIN})
    f.update({("stripes", name): {"contrast": c, "mean": 0.2} for name, c in (("fitted", 0.1), ("alternative", 0.3), ("microflake", 0.15))})
    f.update({("seconds", "path"): 6.0, ("seconds", "dual"): 4.0, "silk rows": {f"f{i}": [[0.6, 0.2, 0.2], [0, 0, 0]] for i in range(16)}})
    f.update({("thin", d): [d / 4000, d / 8000] for d in thesis_fits.DENSITIES})
    f.update({("tables", fabric): [100.0, 4000000, 1234] for fabric in thesis_looks.TABLE_FABRICS})
    f.update({("unseen", e): 0.5 for e in thesis_pictures.CELL_PATHS})
    f.update({("mesh", fabric, sheet): None for fabric in thesis_looks.MESH_FABRICS for sheet in (True, False)})
    return f


def page_of(found, tmp_path):
    thesis_page.write_page(found, (["2030-01-02"], 0), tmp_path / "page.md")
    return (tmp_path / "page.md").read_text(encoding="utf-8")


def row_of(page, place):
    return [line for line in page.split("\n") if line.startswith(f"| {place}")]


def test_a_whole_page_has_every_number(found, tmp_path):
    for key in [key for key in found if key[0] == "mesh"]:
        del found[key]  # for the eye only
    page = page_of(found, tmp_path)
    assert not re.search(r"\{[a-z_0-9]+\}", page) and "not run" not in page
    assert not [line for line in page.split("\n") if line.startswith("|") and re.search(r"(^|[|,;:] )-( [|,;]|, |$| s | of )", line)]
    assert "0.50, 0.25; 0.25, 0.12" not in page and "0.50, 0.50; 0.25, 0.25" in row_of(page, "figure 5.8")[0]
    assert "3.00 times" in row_of(page, "figure 5.17")[0] and "microflakes 1.50" in row_of(page, "figure 5.17")[0]
    assert "dual 1.50" in row_of(page, "table 6.2")[1] and "1,234, 1,234, 1,234" in row_of(page, "table 6.1")[0]
    assert "fibers 8, 3, 1; volume 8, 3, 1" in row_of(page, "figure 5.16")[0]


def test_a_page_without_results_is_written(found, tmp_path):
    page = page_of({key: None for key in found}, tmp_path)
    assert "not run" in page and "| Silk | - | - | - |" in page


def test_values_that_are_off_or_not_determined_are_marked(found, tmp_path):
    """Three of Silk's nine: one is 2.1 errors off, one 1.9, one is not determined and far off."""
    other = copy.deepcopy(found)
    rows = {row[0]: row for row in other["silk", "two_lobe"]["parameters"]}
    for name, errors, determined in (("C_TT.r", 2.1, True), ("gamma_TT", 1.9, True), ("beta_TT", 9, False)):
        rows[name][1] += errors * rows[name][2]
        rows[name][3] = determined
    before, after = thesis_page.recovered(found), thesis_page.recovered(other)
    assert before[0] == before[1] == 9 * 6 + 12 * 6 + 4 * 6 and after == (before[0] - 2, before[1] - 1)
    line = row_of(page_of(other, tmp_path), "Silk, fibers")[0]
    assert "0.620 0.553 0.562: 0.633* 0.553 0.562" in line and "10.00: (10.90)" in line and "19.82: 20.20 |" in line
    assert line.count("*") == 1


def test_noise_of_a_cylinder_is_stated(found):
    """One column of 16 has an error of 3 in each channel: 3 sqrt(3) over 3 x (15 + 2)."""
    assert thesis_page.ratio_text(thesis_page.over_true(found, "silk", "volume")[0]) == "0.80"
    noisy = copy.deepcopy(found)
    noisy["shapes", "silk", "volume"]["columns"][0][5][3:] = [3.0] * 3
    assert thesis_page.ratio_text(thesis_page.over_true(noisy, "silk", "volume")[0]) == "0.80 +- 0.10"
    assert thesis_page.ratio_text(None) == "-"


def test_fibers_in_cells_that_nobody_sees(tmp_path):
    """Two cells deep, of a tile of 2 x 1 mm in two columns: the lower one on the left has no row. A fiber of 0.8 mm lies in it, one of
    0.8 mm above it, and one of 0.4 mm, beyond the right face, below on the right."""
    head = struct.pack("<8s2IQ5d6I", b"SELVFAST", 6, 168, 0, 2.0, 1.0, -1.0, 0.1, 0.1, 4, 1, 1, 2, 1, 2)
    cells = struct.pack("<4I", 0, 1, 0xFFFFFFFF, 2)
    (tmp_path / "t").write_bytes(head + bytes(168 - len(head)) + cells)
    fibers = [[(0.1, 0.5, -0.7, 0.1), (0.9, 0.5, -0.7, 0.1)], [(0.1, 0.5, -0.1, 0.1), (0.9, 0.5, -0.1, 0.1)],
              [(-0.9, 0.5, -0.7, 0.1), (-0.5, 0.5, -0.7, 0.1)]]
    assert thesis_looks.unseen_share(tmp_path / "t", fibers) == pytest.approx(0.4)


def test_edges_and_tint():
    level = [[v] * 3 + [0] * 3 for v in [1, 3] + [2] * 12 + [4, 6]]
    assert thesis_numbers.edge_ratio(level) == 2.5
    assert thesis_numbers.tint([0.3, 0.1, 0.2]) == pytest.approx(2)


def test_columns_are_drawn(found, tmp_path):
    thesis_looks.draw_columns(found, tmp_path / "columns.svg")
    drawn = ElementTree.parse(tmp_path / "columns.svg").getroot()
    lines = drawn.findall("{http://www.w3.org/2000/svg}polyline")
    assert len(lines) == len(NAMES) * 5 * 3
    places = [[float(v) for v in point.split(",")] for line in lines for point in line.get("points").split()]
    assert all(0 < x < float(drawn.get("width")) and 0 < y < float(drawn.get("height")) for x, y in places)
    # as high as the radiance: microflakes have 0.4 of the fibers' columns
    fibers, _, flakes = [[float(p.split(",")[1]) for p in line.get("points").split()] for line in lines[:3]]
    foot = thesis_looks.TOP + thesis_looks.HEIGHT
    assert (foot - flakes[9]) / (foot - fibers[9]) == pytest.approx(0.4, abs=0.02)
