"""Jobs with photographs of a bowl into which a single fiber scatters: a fiber that scatters evenly, albedo / pi^2 times cos theta_i,
seen by a camera straight above. Its photographs are 16-bit PNGs with noise, of a bowl that throws light onto itself."""
import json
import math
import os
import random
import struct
import subprocess
import sys
import zlib

import jsonschema
import pytest
from daemon_under_test import ROOT, problem, program

pytestmark = [pytest.mark.slow, pytest.mark.skipif(not os.access(program("selvedge-worker"), os.X_OK), reason="no selvedge-worker in the build folder")]
ALBEDO, SCALE, PAINT, THETA_I = 0.6, 30, 0.2, 25
RADIUS, HEIGHT, PX, FOCAL, EYE = 75, 73, 160, 480, 500


def png(path, rows):
    raw = b"".join(b"\0" + struct.pack(f">{len(row)}H", *(min(max(round(65535 * v), 0), 65535) for v in row)) for row in rows)

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    head = struct.pack(">IIBBBBB", PX, PX, 16, 0, 0, 0, 0)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(raw)) + chunk(b"IEND", b""))


def seen(x, y):
    """The place on the bowl that a pixel sees, or None."""
    d = [(x + 0.5 - PX / 2) / FOCAL, -(y + 0.5 - PX / 2) / FOCAL, -1]
    a, b, c = sum(v * v for v in d), EYE * d[2], EYE**2 - RADIUS**2
    root = b * b - a * c
    if root < 0:
        return None
    t = (-b + math.sqrt(root)) / a
    p = [t * d[0], t * d[1], EYE + t * d[2]]
    return p if p[2] <= HEIGHT - RADIUS else None


def write_photographs(folder):
    rng = random.Random(5)
    one = SCALE * ALBEDO / math.pi**2  # a fiber's light per cos theta_o; the lit length takes away cos theta_i
    share = HEIGHT / (2 * RADIUS)
    n, total = 400, 0
    for i in range(n):  # mean over the bowl of cos theta_o, by bands of equal area
        z = -1 + (HEIGHT / RADIUS) * (i + 0.5) / n
        total += sum(math.sqrt(1 - (1 - z * z) * math.cos(math.pi * (k + 0.5) / 64)**2) for k in range(64)) / (64 * n)
    again = PAINT * share * total / (1 - PAINT * share)
    lit = lambda p: 0 if p is None else PAINT * one * (math.sqrt(1 - (p[0] / RADIUS)**2) + again) * (1 + 0.02 * rng.gauss(0, 1))
    background = lambda p: 0 if p is None else 0.02 + 0.0002 * rng.gauss(0, 1)
    places = [[seen(x, y) for x in range(PX)] for y in range(PX)]
    png(folder / "fiber.png", [[lit(p) + background(p) for p in row] for row in places])
    png(folder / "dark.png", [[background(p) for p in row] for row in places])


def mark(turn, z):
    r = math.sqrt(RADIUS**2 - z**2)
    x, y = r * math.cos(turn), r * math.sin(turn)
    return {"at_mm": [x, y, z], "px": [PX / 2 + FOCAL * x / (EYE - z), PX / 2 - FOCAL * y / (EYE - z)]}


DOCUMENT = {
    "sample": "even fiber",
    "profile": {
        "scale": SCALE,
        "bowl": {"radius_mm": RADIUS, "height_mm": HEIGHT, "reflectance": PAINT, "focal_px": FOCAL, "cell_deg": 10,
                 "marks": [mark(k * math.pi / 4, -2 if k % 2 else -50) for k in range(8)],
                 "photographs": [{"file": "fiber.png", "background": "dark.png", "transfer": "linear", "theta_i_deg": THETA_I}]}},
    "fit": {"models": ["kajiya_kay.v1", "isotropic.v1"]}}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("bowl")
    write_photographs(path)
    (path / "job.json").write_text(json.dumps(DOCUMENT))
    return path


def test_a_job(real, folder):
    environment = dict(os.environ, SELVEDGE_SERVER=real.url, SELVEDGE_TOKEN="", PYTHONPATH=os.path.join(ROOT, "clients", "python"))
    script = f"""import selvedge
job = selvedge.Client({real.url!r}).submit({str(folder / 'job.json')!r})
assert job.wait(timeout_s=60).state == "succeeded"
print(job.id)"""
    done = subprocess.run([sys.executable, "-c", script], env=environment, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stderr
    result = real.get(f"/v1/jobs/{done.stdout.strip()}/results/result.json").json()
    with open(os.path.join(ROOT, "config", "result.schema.json"), encoding="utf-8") as f:
        jsonschema.validate(result, json.load(f))
    best = next(m for m in result["profile"]["models"] if m["best"])
    red, n = result["parameters"][0], result["profile"]["table"]["n_row"]
    assert best["id"] == "isotropic.v1" and n > 150
    assert abs(red["value"] - ALBEDO) < 4 * red["standard_error"] < 0.02 * ALBEDO, red
    assert 1 - 4 * math.sqrt(2 / n) < best["chi_square"] < 18 / 16 + 4 * math.sqrt(2 / n)
    bowl = result["profile"]["bowl"]
    assert math.dist(bowl["camera_mm"], [0, 0, EYE]) < 0.1 and bowl["focal_px"] == pytest.approx(FOCAL, rel=1e-3)
    shot = bowl["photographs"][0]
    assert shot["n_saturated"] == 0 and shot["n_cell"] == n and 0.05 < shot["reflected_share"] < 0.15


def test_the_table_alone(folder):
    run = lambda *words: subprocess.run([program("selvedge"), "bowl", *map(str, words)], capture_output=True, text=True, timeout=300)
    done = run(folder / "job.json", "--out", folder / "p.csv", "--picture", folder / "p.png")
    assert done.returncode == 0 and "camera at" in done.stdout, done.stderr
    lines = (folder / "p.csv").read_text().splitlines()
    assert lines[0] == "theta_i_deg,phi_i_deg,theta_o_deg,phi_deg,radiance,radiance_se" and len(lines) > 150
    true, values = SCALE * ALBEDO / math.pi**2 * math.cos(math.radians(THETA_I)), [list(map(float, line.split(","))) for line in lines[1:]]
    squares = sum(((v[4] - true) / v[5])**2 for v in values) / len(values)
    assert 1 - 4 * math.sqrt(2 / len(values)) < squares < 18 / 16 + 4 * math.sqrt(2 / len(values))
    assert all(v[0] == THETA_I and 0 < v[3] < 180 for v in values)
    assert (folder / "p.png").read_bytes()[:4] == b"\x89PNG"
    (folder / "other.json").write_text(json.dumps({"sample": "s", "profile": {"file": "p.csv"}, "fit": {"model": "isotropic.v1"}}))
    assert run(folder / "other.json", "--out", folder / "q.csv").returncode == 1
    assert run(folder / "job.json").returncode == 2


def without(key):
    bowl = {k: v for k, v in DOCUMENT["profile"]["bowl"].items() if k != key}
    return {**DOCUMENT, "profile": {"bowl": bowl}}


@pytest.mark.parametrize("document,field", [
    (without("radius_mm"), "profile.bowl.radius_mm"), (without("reflectance"), "profile.bowl"), (without("marks"), "profile.bowl"),
    ({**DOCUMENT, "profile": {**DOCUMENT["profile"], "file": "p.csv"}}, "profile"),
    ({**DOCUMENT, "profile": {**DOCUMENT["profile"], "theta_i_deg": 3}}, "profile.theta_i_deg"),
    ({**DOCUMENT, "camera": {"distance_cm": 60}}, "camera.distance_cm"),
])
def test_documents_that_are_refused(real, document, field):
    assert problem(real.post("/v1/jobs", json=document), 422, "invalid", field)


def test_faults_before_the_start(real, folder):
    swapped = json.loads(json.dumps(DOCUMENT))
    swapped["profile"]["bowl"]["photographs"][0].update(file="dark.png", background="fiber.png")
    job = real.create(swapped)
    for name in ("fiber.png", "dark.png"):
        real.upload(job, name, (folder / name).read_bytes(), "photograph")
    faults = real.post(f"/v1/jobs/{job}/check").json()["errors"]
    assert any(f["field"] == "profile.bowl.photographs[0].file" and "exchanged" in f["detail"] for f in faults), faults
