"""A described cloth whose weave is a file of a weavers' program (WIF): the same cloth as with the draft in the document."""
import json
import os
import subprocess

import pytest
from daemon_under_test import program
from small_cloth import TABLE

pytestmark = pytest.mark.skipif(not os.access(program("selvedge-worker"), os.X_OK), reason="no selvedge-worker in the build folder")
WIF = ("[WIF]\nVersion=1.1\nSource Program=Loom 3\n[WEAVING]\nShafts=4\nTreadles=4\nRising Shed=true\n[WARP]\nThreads=12\nColor=2\n[WEFT]\nThreads=8\n"
       "[THREADING]\n"
       + "".join(f"{i + 1}={i % 4 + 1}\n" for i in range(12)) + "[TIEUP]\n1=1,2\n2=2,3\n3=3,4\n4=4,1\n[TREADLING]\n"
       + "".join(f"{i + 1}={i % 4 + 1}\n" for i in range(8)) + "[WARP COLORS]\n1=2\n2=3\n")
TWILL = ["0011", "0110", "1100", "1001"]
FIT = {"models": ["two_lobe.v1"], "max_iterations": 1, "path_budget": 1000, "render_px": 8, "render_samples": 1}


def document(**cloth):
    return {"sample": "w", "cloth": {"yarns": [{"fibers": 7}], **cloth}, "measurements": {"file": "rows.csv"}, "fit": FIT}


def check(folder, wif, **cloth):
    (folder / "Köper 2_2.wif").write_bytes(wif.encode())
    (folder / "rows.csv").write_text(TABLE)
    (folder / "job.json").write_text(json.dumps(document(draft_file="Köper 2_2.wif", **cloth)))
    done = subprocess.run([program("selvedge"), "check", "--json", str(folder / "job.json")], capture_output=True, text=True, check=False)
    report = json.loads(done.stdout)
    return report, [f"{f['field']}: {f['detail']}" for f in report["faults"]]


def test_a_draft_is_read_and_its_statements_are_listed(tmp_path):
    report, faults = check(tmp_path, WIF)
    assert faults == []
    stated = {s["name"]: s for f in report["files"] if f["file"] == "Köper 2_2.wif" for s in f["statements"]}
    assert stated["threads"]["value"] == "12 warps and 8 wefts" and "after 4 warps and 4 wefts" in stated["weave"]["value"]
    assert stated["weave"]["use"] == "applied" and stated["warp colors"]["use"] == stated["warp color"]["use"] == "not_used"


@pytest.mark.parametrize("wif, cloth, words", [
    (WIF.replace("12=4\n", ""), {}, "cloth.draft_file: cannot use draft 'Köper 2_2.wif': warp thread 12 has no shaft"),
    (WIF.replace("1=1,2\n", "1=1,9\n"), {}, "names shaft 9, but there are 4"),
    ("RIFF\0\0WAVE", {}, "cloth.draft_file"),
    (WIF.replace("1=1,2\n2=2,3\n3=3,4\n4=4,1\n", "1=1\n2=1\n3=1\n4=1\n"), {}, "cloth.draft_file: "),
    (WIF, {"tile_warps": 6}, "cloth.tile_warps"),
    (WIF, {"weave": "plain"}, "cloth.weave"),
], ids=["thread", "shaft", "sound", "no-cloth", "tile", "two-weaves"])
def test_faults_of_drafts_are_named(tmp_path, wif, cloth, words):
    _, faults = check(tmp_path, wif, **cloth)
    assert len(faults) == 1 and words in faults[0], faults


@pytest.mark.slow
def test_the_cloth_is_that_of_the_same_draft_in_the_document(real):
    fibers = []
    for cloth in ({"draft": TWILL}, {"draft_file": "twill.wif"}):
        job = real.create(document(**cloth))
        real.upload(job, "rows.csv", TABLE.encode(), "measurements")
        if "draft_file" in cloth:
            real.upload(job, "twill.wif", WIF.encode(), "draft")
        assert real.post(f"/v1/jobs/{job}/start").status_code == 202
        result = real.wait_state(job, "succeeded", timeout_s=120)["result"]
        fibers.append(real.get(f"/v1/jobs/{job}/results/fibers.hair").content)
    assert fibers[0] == fibers[1]
    assert "twill.wif" in json.dumps(result["files"])
