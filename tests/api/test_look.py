"""selvedge-phantom look: color and contrast of a rendering beside those of a photograph; options of `photograph`."""
import json
import os
import subprocess

import pytest
from daemon_under_test import program
from small_cloth import hair
from small_exr import exr
from small_png import png, weave

pytestmark = pytest.mark.skipif(not os.access(program("selvedge-phantom"), os.X_OK), reason="no selvedge-phantom in the build folder")
EDGE, PERIOD = 96, 8
PLAIN = weave(["10", "01"], 4, 4)


def run(command, *arguments):
    p = subprocess.run([program("selvedge-phantom"), command, *map(str, arguments)], capture_output=True, timeout=600)
    return p.returncode, p.stdout.decode(), p.stderr.decode()


def look(*arguments):
    code, out, text = run("look", *arguments)
    assert code == 0, text
    return json.loads(out)


@pytest.fixture
def pictures(tmp_path):
    (tmp_path / "photograph.png").write_bytes(png(EDGE, PLAIN))
    # the same weave with a red that is 20 % too bright
    (tmp_path / "rendering.exr").write_bytes(exr(EDGE, EDGE, lambda x, y: [int(PLAIN(x, y)) / 255 * v for v in (1.2, 1, 1)]))
    return ["--photograph", tmp_path / "photograph.png", "--rendering", tmp_path / "rendering.exr", "--period-px", PERIOD]


def test_errors_of_color_and_contrast(pictures):
    answer = look(*pictures, "--linear")
    assert answer["color_error"] == pytest.approx(0.2 / 3 ** 0.5, rel=0.01) and answer["contrast_error"] < 1e-4
    blurred = look(*pictures, "--linear", "--blur-px", 1)
    assert blurred["photograph"] == answer["photograph"] and blurred["contrast_error"] > 0.2
    assert all(a < b for a, b in zip(blurred["rendering"]["contrast"], answer["rendering"]["contrast"]))
    scaled = look(*pictures, "--linear", "--scale", 2, "--crop-px", f"0,0,{EDGE},{EDGE}")
    assert scaled["photograph"]["mean_rgb"] == pytest.approx([2 * v for v in answer["photograph"]["mean_rgb"]], rel=1e-4)


def test_wrong_arguments(pictures):
    assert run("look")[0] == 2
    assert run("look", *pictures, "--blur-px", -1)[0] == 2
    assert run("look", *pictures, "--crop-px", "0,0,-1,5")[0] == 2
    code, _, text = run("look", *pictures[:-1], 40)
    assert code == 1 and "8 periods" in text


def test_lights_and_cameras_of_photographs(tmp_path):
    """Each option changes what is rendered, and is stated with the truth."""
    (tmp_path / "cloth.hair").write_bytes(hair())
    (tmp_path / "views.csv").write_text("set,light_theta_deg,light_phi_deg,camera_theta_deg,camera_phi_deg,cloth_rotation_deg,r,g,b\nfit,45,0,0,0,0,0,0,0\n")
    near = ["--crop-cm", 0.02, "--lamp-side-cm", 60, "--camera-distance-cm", 0.05, "--px", 16, "--paths", 8192]

    def picture(name, *options):
        files = ["--fibers", tmp_path / "cloth.hair", "--table", tmp_path / "views.csv", "--out", tmp_path / name]
        code, _, text = run("photograph", *files, "--quiet", *near, *options)
        assert code == 0, text
        truth = json.loads((tmp_path / name / "truth.json").read_text())
        return truth, truth["photographs"][0]["mean_rgb"]
    plain, mean = picture("plain")
    assert plain["lamp"]["kind"] == "square" and plain["camera"]["blur_mm"] == 0 and not plain["camera"]["far_field"]
    parallel, changed = picture("parallel", "--lamp-directional")
    assert parallel["lamp"]["kind"] == "directional" and changed != mean
    far, changed = picture("far", "--far-field")
    assert far["camera"]["far_field"] and changed != mean
    sky, changed = picture("sky", "--environment", "0.5,0.5,0.5")
    assert sky["environment"]["radiance"] == [0.5, 0.5, 0.5] and all(a > b for a, b in zip(changed, mean))
    soft, _ = picture("soft", "--blur-mm", 0.02)
    file = soft["photographs"][0]["file"]  # its mean hardly changes
    assert soft["camera"]["blur_mm"] == 0.02 and (tmp_path / "soft" / file).read_bytes() != (tmp_path / "plain" / file).read_bytes()
