"""The tables and the picture of docs/ranks.md: the simulated rows and the curve are those of the measured inputs."""
import os
import subprocess
import sys

TREE = os.path.dirname(os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__)))))
PAGE, PICTURE = (os.path.join(TREE, "docs", *name) for name in (("ranks.md",), ("images", "ranks-scaling.svg")))


def test_the_picture_and_the_simulated_rows_follow_from_the_measured_ones(tmp_path):
    script = os.path.join(TREE, "tests", "bench", "ranks", "plot_scaling.py")
    rows = subprocess.run([sys.executable, script, PAGE, tmp_path / "new.svg"], check=True, capture_output=True, text=True).stdout
    with open(PAGE) as page, open(PICTURE) as picture:
        assert rows in page.read()
        assert (tmp_path / "new.svg").read_text() == picture.read()
