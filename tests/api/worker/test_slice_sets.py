"""A scan that is a file for each slice: its files are taken in the order of their numbers by every client, and a set with a gap, a
double or a stranger is named before anything is traced."""
import json
import os
import subprocess

import pytest
from daemon_under_test import program
from small_tiff import grey_tiff

pytestmark = pytest.mark.skipif(not os.access(program("selvedge-worker"), os.X_OK), reason="no selvedge-worker in the build folder")


def slices(folder, names):
    for k, name in enumerate(names):
        (folder / name).write_bytes(grey_tiff(6, 5, lambda x, y, k=k: (7 * x + 11 * y + k) % 200))


def check(folder, names, **volume):
    slices(folder, names)
    (folder / "job.json").write_text(json.dumps({"sample": "s", "volume": {"files": names, "voxel_size_um": 2, **volume}}))
    done = subprocess.run([program("selvedge"), "check", "--json", str(folder / "job.json")], capture_output=True, text=True, check=False)
    report = json.loads(done.stdout)
    return report, [f"{f['field']}: {f['detail']}" for f in report["faults"]]


def order_of(report):
    return [s["value"] for f in report["files"] for s in f["statements"] if s["name"] == "the order"]


def test_slices_in_order_pass_and_their_order_is_shown(tmp_path):
    report, faults = check(tmp_path, [f"s{k}.tif" for k in range(12)])
    assert faults == [] and report["warnings"] == []
    assert order_of(report) == ["12 files: s0.tif, s1.tif ... s11.tif"]


@pytest.mark.parametrize("names, words", [
    (sorted(f"s{k}.tif" for k in range(12)), "not in the order of their numbers: 's11.tif' comes after 's10.tif' and before 's2.tif'"),
    ([f"s{k:03}.tif" for k in (0, 1, 2, 9, 10)], "6 in all are missing: 's003.tif' to 's008.tif' between 's002.tif' and 's009.tif'"),
    (["s1.tif", "s01.tif", "s2.tif"], "'s1.tif' and 's01.tif' have the same number"),
    (["s1.tif", "s2.tif", "preview.tif"], "'preview.tif' does not belong"),
    (["z1_c1.tif", "z1_c2.tif", "z2_c1.tif", "z2_c2.tif"], "one channel or time"),
], ids=["order", "gap", "double", "stranger", "channels"])
def test_a_set_that_is_no_stack_is_refused_unless_the_job_allows_it(tmp_path, names, words):
    _, faults = check(tmp_path, names)
    assert len(faults) == 1 and faults[0].startswith("volume.files: ") and words in faults[0] and "'volume.ignore_numbers' to true" in faults[0]
    report, faults = check(tmp_path, names, ignore_numbers=True)
    assert faults == [] and "(numbers ignored)" in order_of(report)[0]


def test_every_second_slice_is_asked_about(tmp_path):
    report, faults = check(tmp_path, ["s0.tif", "s2.tif", "s4.tif"])
    assert faults == [] and "the numbers of the slices go by 2" in report["warnings"][0]["detail"]


def test_a_page_of_another_size_or_type_is_named(tmp_path):
    for other, words in ((grey_tiff(6, 4, lambda x, y: x), "6 x 4 pixels"), (grey_tiff(6, 5, lambda x, y: x, bits=16), "16-bit")):
        slices(tmp_path, ["s0.tif", "s1.tif", "s2.tif"])
        (tmp_path / "s1.tif").write_bytes(other)
        document = {"sample": "s", "volume": {"files": ["s0.tif", "s1.tif", "s2.tif"], "voxel_size_um": 2}}
        (tmp_path / "job.json").write_text(json.dumps(document))
        done = subprocess.run([program("selvedge"), "check", str(tmp_path / "job.json")], capture_output=True, text=True, check=False)
        assert done.returncode == 1 and "'s1.tif'" in done.stdout and words in done.stdout


def test_reconstruct_takes_the_slices_of_a_folder_by_number(real, tmp_path):
    folder = tmp_path / "scan"
    folder.mkdir()
    slices(folder, [f"s{k}.tif" for k in range(12)])
    command = [program("selvedge"), "--server", real.url, "reconstruct", str(folder), "--voxel-um", "2", "--out", str(tmp_path / "out"),
               "--id-file", str(tmp_path / "id")]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=600)
    assert "scan of 12 files: s0.tif, s1.tif ... s11.tif" in done.stderr
    job = (tmp_path / "id").read_text().strip()
    assert real.job(job)["document"]["volume"]["files"] == [f"s{k}.tif" for k in range(12)]
    (folder / "s5.tif").unlink()
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=600)
    assert done.returncode == 1 and "'s5.tif' between 's4.tif' and 's6.tif'" in done.stderr
    assert real.job((tmp_path / "id").read_text().strip())["state"] == "draft", "it is judged before it is started"


def test_a_batch_and_a_watched_folder_take_them_by_number(real, tmp_path):
    template = tmp_path / "template.json"
    template.write_text(json.dumps({"sample": "s", "volume": {"files": ["s*.tif"], "voxel_size_um": 2}}))
    samples = tmp_path / "samples"
    (samples / "one").mkdir(parents=True)
    slices(samples / "one", [f"s{k}.tif" for k in range(12)])
    run = [program("selvedge"), "--server", real.url]
    subprocess.run([*run, "batch", "submit", str(template), str(samples), "--draft"], check=True, capture_output=True, timeout=600)
    (samples / "one" / "READY").touch()
    subprocess.run([*run, "watch-folder", str(samples), "--template", str(template), "--once"], check=False, capture_output=True, timeout=600)
    documents = [real.job(j["id"])["document"] for j in real.get("/v1/jobs?limit=100").json()["jobs"] if j["sample"] == "one"]
    assert len(documents) == 2 and all(d["volume"]["files"] == [f"s{k}.tif" for k in range(12)] for d in documents)
