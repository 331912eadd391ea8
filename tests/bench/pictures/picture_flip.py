"""FLIP of pictures against a reference, by the published evaluator (package flip-evaluator of PyPI, for tests alone), in an
environment of its own: DIR/flip-venv."""
import json
import os
import subprocess
import sys

EVALUATE = """
import json, sys
import flip_evaluator, numpy
job = json.load(sys.stdin)
n = job["px"]
picture = lambda values: numpy.asarray(values, dtype=numpy.float32).reshape(n, n, 3)
reference = picture(job["reference"])
print(json.dumps([float(flip_evaluator.evaluate(reference, picture(p), "LDR", applyMagma=False)[1]) for p in job["pictures"]]))
"""


def python_with_flip(build):
    """The interpreter of that environment, which is made at the first call. Ends the program with the reason where it cannot be."""
    folder = os.path.join(build, "flip-venv")
    python = os.path.join(folder, "bin", "python")
    if subprocess.run([python, "-c", "import flip_evaluator"], check=False, capture_output=True).returncode == 0 if os.path.exists(python) else False:
        return python
    made = subprocess.run([sys.executable, "-m", "venv", folder], check=False, capture_output=True, text=True)
    if made.returncode == 0:
        made = subprocess.run([python, "-m", "pip", "-q", "install", "flip-evaluator==1.7", "numpy"], check=False, capture_output=True, text=True)
    if made.returncode != 0:
        sys.exit(f"skipped: FLIP cannot be measured, because its evaluator cannot be installed: {(made.stderr or made.stdout).strip()[-300:]}")
    return python


def exposure_of(picture):
    """Brings the 98th percentile of the brightest channels to 0.85."""
    peaks = sorted(max(pixel) for pixel in picture)
    return 0.85 / max(1e-9, peaks[int(0.98 * (len(peaks) - 1))])


def srgb(picture, exposure):
    out = []
    for pixel in picture:
        for v in pixel:
            v = min(1.0, max(0.0, v * exposure))
            out.append(12.92 * v if v <= 0.0031308 else 1.055 * v ** (1 / 2.4) - 0.055)
    return out


def flip(python, px, reference, pictures):
    """Mean FLIP of each picture against the reference, as sRGB at the reference's exposure; lists of linear (r, g, b), row by row."""
    exposure = exposure_of(reference)
    job = {"px": px, "reference": srgb(reference, exposure), "pictures": [srgb(p, exposure) for p in pictures]}
    answer = subprocess.run([python, "-c", EVALUATE], input=json.dumps(job), check=True, capture_output=True, text=True)
    return json.loads(answer.stdout)
