"""Photographs of a color chart that are not as they should be, read by `selvedge photo --job`: a lamp that falls over the chart, and a chart of
another maker."""
import json
import os
import random
import subprocess

import pytest
from daemon_under_test import program
from small_png import encode
from test_camera_job import LAB, reflectance

pytestmark = pytest.mark.skipif(not os.access(program("selvedge-camera"), os.X_OK), reason="no selvedge-camera in the build folder")
PATCH, GAP, MARGIN, EDGE = 34, 4, 40, 310
CLOTH = (0.05, 0.10, 0.40)
CORNERS = [MARGIN, MARGIN, MARGIN + 6 * PATCH + 5 * GAP, MARGIN, MARGIN + 6 * PATCH + 5 * GAP, MARGIN + 4 * PATCH + 3 * GAP, MARGIN,
           MARGIN + 4 * PATCH + 3 * GAP]


def xyz(lab):
    fy = (lab[0] + 16) / 116
    return [100 * w * (f**3 if f > 6 / 29 else (116 * f - 16) * 27 / 24389)
            for w, f in zip((0.96422, 1, 0.82521), (fy + lab[1] / 500, fy, fy - lab[2] / 200))]


def code(rng, linear):
    """8 bits of the sRGB curve, dithered by the noise of a camera."""
    linear = min(max(linear * (1 + 0.01 * rng.gauss(0, 1)), 0), 1)
    value = 12.92 * linear if linear <= 0.0031308 else 1.055 * linear ** (1 / 2.4) - 0.055
    return min(255, max(0, round(255 * value)))


def picture(rng, radiance):
    rows = bytearray()
    for y in range(EDGE):
        rows.append(0)
        for x in range(EDGE):
            rows.extend(code(rng, v) for v in radiance(x, y))
    return encode(EDGE, 2, bytes(rows))


def chart(patches, fall, bright=0.9):
    def radiance(x, y):
        u, v = (x - MARGIN) // (PATCH + GAP), (y - MARGIN) // (PATCH + GAP)
        light = bright * (1 - fall * (x - MARGIN) / (6 * PATCH + 5 * GAP)) / (1 - fall / 2)
        on_patch = 0 <= u < 6 and 0 <= v < 4 and (x - MARGIN) % (PATCH + GAP) < PATCH and (y - MARGIN) % (PATCH + GAP) < PATCH
        return [light * r for r in (patches[v * 6 + u] if on_patch else (0.03, 0.03, 0.03))]
    return radiance


def photo(tmp_path, patches, fall, **keys):
    rng = random.Random(4)
    (tmp_path / "chart.png").write_bytes(picture(rng, chart(patches, fall)))
    (tmp_path / "cloth.png").write_bytes(picture(rng, lambda x, y: [0.9 * v for v in CLOTH]))
    angles = {"light_theta_deg": 20, "light_phi_deg": 0, "camera_theta_deg": 20, "camera_phi_deg": 180}
    color = {"file": "chart.png", "transfer": "srgb", "edition": "from_2014", "corners_px": CORNERS, **keys}
    (tmp_path / "job.json").write_text(json.dumps({
        "sample": "chart", "cloth": {"weave": "plain"}, "color": {"chart": color}, "fit": {"fixed": {"beta_R": 5}},
        "photographs": [{"file": "cloth.png", "transfer": "srgb", "set": "fit", **angles}]}))
    command = [program("selvedge"), "photo", "--job", str(tmp_path / "job.json"), "--json", str(tmp_path / "rows.json")]
    return subprocess.run(command, capture_output=True, text=True, check=False)


@pytest.mark.parametrize("fall", [0.0, 0.1, 0.2, -0.3])
def test_the_lamp_falls_over_the_chart(tmp_path, fall):
    """A blue cloth has its color within two errors, and the fall is told. At the dark end of the chart it would be darker."""
    done = photo(tmp_path, [reflectance(lab) for lab in LAB], fall)
    assert done.returncode == 0, done.stderr
    row = json.loads((tmp_path / "rows.json").read_text())[0]
    for mean, error, true in zip(row["mean_rgb"], row["standard_error"], CLOTH):
        assert abs(mean - true) < 2 * error and abs(mean / true - 1) < 0.05, row
    assert ("falls by" in done.stdout) == (abs(fall) > 0.12 or fall == 0.2)
    assert "the scale holds in its middle" in done.stdout


def test_the_scale_holds_where_the_cloth_lies(tmp_path):
    done = photo(tmp_path, [reflectance(lab) for lab in LAB], 0.2, cloth_px=[MARGIN, 120])
    row = json.loads((tmp_path / "rows.json").read_text())[0]
    assert "at 'cloth_px'" in done.stdout
    assert row["mean_rgb"][2] == pytest.approx(CLOTH[2] * 0.9, rel=0.02)  # the bright end has 1 / 0.9 of the light of the middle
    done = photo(tmp_path, [reflectance(lab) for lab in LAB], 0.2, cloth_px=[3000, 120])
    assert done.returncode == 1 and "away from the chart" in done.stderr


def test_a_chart_of_another_maker(tmp_path):
    patches = [reflectance(lab) for lab in LAB[:18]]
    random.Random(2).shuffle(patches)
    done = photo(tmp_path, patches + [reflectance(lab) for lab in LAB[18:]], 0.0)
    assert done.returncode == 1 and "its colors are not those of a ColorChecker" in done.stderr and "CIEDE2000" in done.stderr, done.stdout


@pytest.mark.parametrize("head", ["Name,L,a,b", "Name;X;Y;Z"])
def test_a_chart_of_another_maker_with_its_colors(tmp_path, head):
    order = list(range(18))
    random.Random(2).shuffle(order)
    labs = [LAB[i] for i in order + list(range(18, 24))]
    rows = labs if "L" in head else [xyz(lab) for lab in labs]
    sign = head[4]
    table = "# colors\n" + "\n".join([head] + [sign.join([f"p{i}", *(f"{v:.4f}" for v in row)]) for i, row in enumerate(rows)]) + "\n"
    (tmp_path / "colors.csv").write_text(table)
    done = photo(tmp_path, [reflectance(lab) for lab in labs], 0.0, reference="colors.csv")
    assert done.returncode == 0, done.stderr
    row = json.loads((tmp_path / "rows.json").read_text())[0]
    assert row["mean_rgb"] == pytest.approx(CLOTH, rel=0.05)
    (tmp_path / "colors.csv").write_text("\n".join(table.splitlines()[:-1]))
    done = photo(tmp_path, [reflectance(lab) for lab in labs], 0.0, reference="colors.csv")
    assert done.returncode == 1 and "'colors.csv': it has 23 rows, a chart has 24" in done.stderr
