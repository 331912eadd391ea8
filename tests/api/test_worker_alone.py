"""The worker without a daemon, on job folders made by hand: what it says about tables, warnings and budgets."""
import json
import os
import subprocess

import pytest
from daemon_under_test import program
from small_cloth import TABLE, hair

pytestmark = [pytest.mark.slow, pytest.mark.skipif(not os.access(program("selvedge-worker"), os.X_OK), reason="no selvedge-worker in the build folder")]


def run(folder, table=TABLE, expect=0, **fit):
    """Runs a job of the small cloth; gives status.json."""
    document = {"sample": "alone", "fibers": {"file": "cloth.hair"}, "measurements": {"file": "rows.csv"},
                "fit": {"path_budget": 100000, "render_px": 8, "render_samples": 1, **fit}}
    (folder / "input").mkdir()
    (folder / "job.json").write_text(json.dumps(document))
    (folder / "input" / "cloth.hair").write_bytes(hair())
    (folder / "input" / "rows.csv").write_bytes(table if isinstance(table, bytes) else table.encode())
    p = subprocess.run([program("selvedge-worker"), "--quiet", str(folder)], capture_output=True, timeout=120)
    log = (folder / "log.txt").read_text()
    assert p.returncode == expect, log
    return json.loads((folder / "status.json").read_text())


@pytest.mark.parametrize("table", [TABLE.replace("set,", "größe,", 1).encode("latin-1"), TABLE.replace("set,", "s" + "é" * 60 + ",", 1).encode()],
                         ids=["latin-1", "cut"])
def test_a_table_of_strange_bytes_fails_with_its_message(tmp_path, table):
    state = run(tmp_path, table, expect=1)
    assert state["state"] == "failed"
    assert state["error"]["field"] == "measurements.file" and "rows.csv" in state["error"]["text"]
