"""Names of files as people give them, with spaces, umlauts and signs, through every client; messages keep them."""
import json
import os
import subprocess
import sys
import unicodedata

import pytest
from daemon_under_test import program
from small_cloth import TABLE, hair
from small_tiff import grey_tiff

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "..", "clients", "python"))
import selvedge  # noqa: E402

pytestmark = pytest.mark.skipif(not os.access(program("selvedge-worker"), os.X_OK), reason="no selvedge-worker in the build folder")
NAMES = [f"Probe 3 Größe_{k:02}.tif" for k in range(12)]


def slices(folder, names=NAMES):
    folder.mkdir(exist_ok=True)
    for k, name in enumerate(names):
        (folder / name).write_bytes(grey_tiff(6, 5, lambda x, y, k=k: (7 * x + 11 * y + k) % 200))
    return folder


def run(d, *arguments):
    return subprocess.run([program("selvedge"), "--server", d.url, *map(str, arguments)], capture_output=True, text=True, check=False, timeout=600)


def test_a_folder_of_slices_is_reconstructed(real, tmp_path):
    folder = slices(tmp_path / "Probe 3")
    done = run(real, "reconstruct", folder, "--voxel-um", "2", "--id-file", tmp_path / "id", "--out", tmp_path / "out")
    assert "scan of 12 files: Probe 3 Größe_00.tif, Probe 3 Größe_01.tif ... Probe 3 Größe_11.tif" in done.stderr
    job = real.job((tmp_path / "id").read_text().strip())
    assert job["document"]["volume"]["files"] == NAMES and {f["state"] for f in job["files"]} == {"complete"}
    (folder / NAMES[3]).write_bytes(b"II*\0damaged")
    done = run(real, "reconstruct", folder, "--voxel-um", "2", "--id-file", tmp_path / "id", "--out", tmp_path / "out")
    assert done.returncode == 1 and f"'{NAMES[3]}'" in done.stderr
    slices(folder)
    document = tmp_path / "job.json"
    document.write_text(json.dumps(real.job((tmp_path / "id").read_text().strip())["document"]))
    done = run(real, "submit", "--resume", (tmp_path / "id").read_text().strip(), document, "--input-dir", folder, "--draft")
    assert done.returncode == 0, done.stderr + "the repaired file takes the place of the damaged one"


def test_check_names_files_as_their_user_does(tmp_path):
    (tmp_path / "job.json").write_text(json.dumps({"sample": "s", "volume": {"files": ["größe & \'a\'.tif"], "voxel_size_um": 2}}))
    (tmp_path / "größe & 'a'.tif").write_bytes(b"II*\0damaged")
    done = subprocess.run([program("selvedge"), "check", str(tmp_path / "job.json")], capture_output=True, text=True, check=False)
    assert done.returncode == 1 and "'größe & 'a'.tif'" in done.stdout


def test_a_name_in_decomposed_letters_is_named(real, tmp_path):
    """macOS writes an umlaut as a letter and a mark."""
    composed, decomposed = (unicodedata.normalize(form, "Größe.tif") for form in ("NFC", "NFD"))
    (tmp_path / decomposed).write_bytes(grey_tiff(6, 5, lambda x, y: x))
    (tmp_path / "Grüße.tif").write_bytes(b"another")
    (tmp_path / "job.json").write_text(json.dumps({"sample": "s", "volume": {"files": [composed], "voxel_size_um": 2}}))
    done = subprocess.run([program("selvedge"), "check", str(tmp_path / "job.json")], capture_output=True, text=True, check=False)
    assert done.returncode == 1 and f"the folder has '{decomposed}', which looks the same and has other bytes" in done.stdout
    done = run(real, "submit", tmp_path / "job.json")
    assert done.returncode == 1 and f"the folder has '{decomposed}', which looks the same" in done.stderr
    (tmp_path / decomposed).unlink()
    done = run(real, "submit", tmp_path / "job.json")
    assert done.returncode == 1 and "does not exist" in done.stderr and "looks the same" not in done.stderr


@pytest.mark.parametrize("name", ["a\\\\b.tif", ".a.tif", "a/b.tif", "a\\u0007.tif", "\\u0085.tif", "ä" * 64 + ".tif"])
def test_harmful_names_are_refused(real, name):
    document = json.loads('{"sample": "s", "volume": {"files": ["' + name + '"], "voxel_size_um": 2}}')
    answer = real.post("/v1/jobs", json=document)
    assert answer.status_code == 422 and answer.json()["code"] == "invalid"


def test_a_name_that_is_no_utf8_is_named(real, tmp_path):
    folder = slices(tmp_path / "s", NAMES[:2])
    with open(os.path.join(os.fsencode(folder), "Gr\xf6\xdfe 2.tif".encode("latin-1")), "wb") as f:
        f.write(b"II*")
    done = subprocess.run([program("selvedge"), "--server", real.url, "reconstruct", str(folder), "--voxel-um", "2"], capture_output=True, check=False)
    assert done.returncode == 1 and b"is not UTF-8" in done.stderr


def test_the_python_client_sends_them(real, tmp_path):
    fibers, table = "Fasern 1 äöü.hair", "Meßwerte #2 100%.csv"
    (tmp_path / fibers).write_bytes(hair())
    (tmp_path / table).write_text(TABLE)
    (tmp_path / "job.json").write_text(json.dumps({"sample": "s", "fibers": {"file": fibers, "voxel_um": 5}, "measurements": {"file": table},
                                                   "fit": {"path_budget": 20000}}))
    client = selvedge.Client(real.url)
    job = client.submit(tmp_path / "job.json", start=False)
    assert job.check()["errors"] == []
    assert real.get(f"/v1/jobs/{job.id}/files/Me%C3%9Fwerte%20%232%20100%25.csv").text == TABLE
