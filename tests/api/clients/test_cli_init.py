"""selvedge init: the job document of a folder. The real worker checks what it writes."""
import json
import os
import shutil
import struct
import subprocess
import zlib

import pytest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__)))))
BUILD = os.environ.get("SELVEDGE_BUILD") or os.path.join(ROOT, "build")
CLI = os.path.join(BUILD, "bin", "selvedge")


def init(folder, *more, expect=0):
    done = subprocess.run([CLI, "init", str(folder), *more], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, timeout=600)
    assert done.returncode == expect, f"exit {done.returncode}\n{done.stdout}\n{done.stderr}"
    return done.stdout + done.stderr


def document(folder):
    return json.loads((folder / "job.json").read_text())


def picture(path, grey=120):
    """A PNG of one grey, declared as sRGB."""
    side = 16
    rows = b"".join(b"\0" + bytes([grey, grey, grey + k % 3]) * side for k in range(side))

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", side, side, 8, 2, 0, 0, 0)) + chunk(b"sRGB", b"\0")
                     + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))


def table(path):
    head = "set,light_theta_deg,light_phi_deg,camera_theta_deg,camera_phi_deg,r,g,b\n"
    path.write_text(head + "".join(f"fit,{8 * k},0,{5 * k},180,0.1,0.1,0.1\n" for k in range(8)))


@pytest.fixture
def folder(tmp_path):
    made = tmp_path / "gauze 7"
    made.mkdir()
    return made


def test_scan_and_table(folder):
    voxels = b"".join(struct.pack("<H", 1000 + 50 * (k % 7)) for k in range(32 ** 3))
    (folder / "scan.mhd").write_text("ObjectType = Image\nNDims = 3\nDimSize = 32 32 32\nElementSpacing = 0.002 0.002 0.002\n"
                                     "ElementType = MET_USHORT\nElementDataFile = scan.raw\n")
    (folder / "scan.raw").write_bytes(voxels)
    (folder / "notes.txt").write_text("bought in Lyon")
    table(folder / "rows.csv")
    said = init(folder)
    assert "selvedge submit" in said
    assert [line.split()[1:] for line in said.splitlines() if line.startswith("  notes.txt")] == [["not", "used"]]
    assert document(folder) == {"sample": "gauze 7", "volume": {"files": ["scan.mhd", "scan.raw"]}, "measurements": {"file": "rows.csv"}}


def test_photographs_by_name(folder):
    for name in ("t00_p0.png", "t20_p0.png", "t40_p90.png", "t60_p180.png"):
        picture(folder / name)
    picture(folder / "dark-1.png", 2)
    assert "say what the cloth is" in init(folder, expect=1) and not (folder / "job.json").exists()
    said = init(folder, "--weave", "plain")
    assert "t{light_theta}_p{light_phi}" in said
    made = document(folder)
    assert made["cloth"] == {"weave": "plain"} and made["camera"] == {"dark_frames": ["dark-1.png"]}
    assert made["photographs"][2] == {"file": "t40_p90.png", "light_theta_deg": 40, "light_phi_deg": 90, "camera_theta_deg": 0, "camera_phi_deg": 0}


def test_a_dark_cloth_and_files_without_use(folder):
    for name in ("dark-blue_t10_p0.png", "dark-blue_t50_p0.png"):
        picture(folder / name)
    for name in ("white.png", "chart.png", "flat-1.png"):
        picture(folder / name)
    said = init(folder, "--weave", "plain", expect=1)  # the chart shows no patches
    assert [p["file"] for p in document(folder)["photographs"]] == ["dark-blue_t10_p0.png", "dark-blue_t50_p0.png"]
    assert "not used: 'white.png'" in said and "calibrate-camera" in next(x for x in said.splitlines() if "flat-1" in x)
    for name in ("dark-blue_t10_p0.png", "dark-blue_t50_p0.png", "white.png", "job.json"):
        (folder / name).unlink()
    table(folder / "rows.csv")
    assert "not used: 'chart.png', because there are no photographs" in init(folder, "--weave", "plain")


def test_exposures_and_a_pattern_of_ones_own(folder):
    for name in ("a-10-0-short.png", "a-10-0-long.png", "a-50-0-short.png", "a-50-0-long.png"):
        picture(folder / name)
    said = init(folder, "--weave", "twill", expect=1)
    assert "--names" in said and "fault" in said
    init(folder, "--weave", "twill", "--names", "a_{light_theta}_{camera_theta}_*", expect=1)  # pictures that state no exposure
    views = document(folder)["photographs"]
    assert [v["light_theta_deg"] for v in views] == [10, 50] and views[0]["more_exposures"] == [{"file": "a-10-0-short.png"}]
    assert "unknown place" in init(folder, "--weave", "twill", "--names", "a_{theta}", expect=1)


def test_rig(folder):
    (folder / "my-rig.json").write_text(json.dumps({
        "selvedge_rig": 1, "lamps": {"a": {"theta_deg": 20, "phi_deg": 0}, "b": {"theta_deg": 60, "phi_deg": 0}},
        "cameras": {"top": {"theta_deg": 0, "phi_deg": 0}}, "views": {"v01": {"lamp": "a", "camera": "top"}, "v02": {"lamp": "b", "camera": "top"}}}))
    picture(folder / "v01.png")
    picture(folder / "v02.png")
    init(folder, "--weave", "plain")
    made = document(folder)
    assert made["rig"] == {"file": "my-rig.json"} and [p["view"] for p in made["photographs"]] == ["v01", "v02"]


def test_what_is_ambiguous_is_asked(folder):
    table(folder / "rows.csv")
    table(folder / "more.csv")
    assert "2 files that may be the table" in init(folder, "--weave", "plain", expect=1)
    (folder / "more.csv").unlink()
    picture(folder / "t10_p0.png")
    assert "one of both" in init(folder, "--weave", "plain", expect=1)
    (folder / "t10_p0.png").unlink()
    init(folder, "--weave", "plain")
    init(folder, "--weave", "plain")  # what it wrote itself is written anew
    (folder / "job.json").write_text('{"sample": "by hand"}')
    assert "changed by hand" in init(folder, "--weave", "plain", expect=1)
    assert document(folder) == {"sample": "by hand"}
    shutil.rmtree(folder)
    assert "cannot read the folder" in init(folder, expect=1)
