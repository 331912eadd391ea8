"""Pictures that state an automatic white balance are warned about: the camera may have given each other colors."""
import json
import os
import random
import subprocess

import pytest
from daemon_under_test import program
from scan_file import page16, tag, tiff

pytestmark = pytest.mark.skipif(not os.access(program("selvedge-worker"), os.X_OK), reason="no selvedge-worker in the build folder")
WHITE_BALANCE = 0xa403


def check(folder, balances, transfer="srgb"):
    """The warnings and statements about photographs of these white balances of Exif (0 automatic, 1 manual)."""
    noise = random.Random(3)
    photographs = []
    for i, balance in enumerate(balances):
        page = page16(lambda x, y: round(30000 + noise.gauss(0, 300)), 32, 32)
        (folder / f"v{i}.tif").write_bytes(tiff([page], 32, 32, first=[] if balance is None else [tag(WHITE_BALANCE, 3, balance)]))
        photographs.append({"file": f"v{i}.tif", "transfer": transfer, "set": "fit", "light_theta_deg": 10 * i, "light_phi_deg": 0,
                            "camera_theta_deg": 30, "camera_phi_deg": 180})
    (folder / "job.json").write_text(json.dumps({"sample": "s", "cloth": {"weave": "plain"}, "photographs": photographs, "fit": {"fixed": {"beta_R": 5}}}))
    done = subprocess.run([program("selvedge"), "check", str(folder / "job.json")], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout
    return done.stdout


def test_automatic_balance_is_warned_about(tmp_path):
    said = check(tmp_path, [1, 0, 0])
    assert "2 of 3 photographs ('v1.tif' and others) state an automatic white balance" in said
    assert "state white balance" in said


def test_other_pictures_are_not(tmp_path):
    assert "automatic" not in check(tmp_path, [1, None])


def test_linear_samples_are_not(tmp_path):
    """What a raw converter wrote without a curve is no picture of the camera's processing."""
    assert "state an automatic white balance" not in check(tmp_path, [0, 0], "linear")
