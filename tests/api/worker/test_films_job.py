"""Jobs with films say where their metal is not shown: to volume models, and in exported textures, where it is part of the mean."""
import json
import os
import subprocess

import pytest
from daemon_under_test import program
from small_cloth import TABLE

pytestmark = [pytest.mark.slow, pytest.mark.skipif(not os.access(program("selvedge-worker"), os.X_OK), reason="no selvedge-worker in the build folder")]
FIBERS, FILM = {"fibers": 9}, {"film_width_um": 200}


@pytest.mark.parametrize("yarn, model, export, said", [
    (FILM, "microflake.v1", None, "not as metal"), (FIBERS, "microflake.v1", None, None),
    (FILM, "isotropic.v1", {"textures": True, "texture_px": 64}, "films and sequins of the cloth in their means")])
def test_what_is_not_shown(tmp_path, yarn, model, export, said):
    (tmp_path / "input").mkdir()
    (tmp_path / "input" / "rows.csv").write_text(TABLE)
    cloth = {"weave": "plain", "tile_warps": 2, "tile_wefts": 2, "weft": [0, 1], "yarns": [FIBERS, yarn]}
    fit = {"path_budget": 4000, "max_iterations": 1, "render_px": 8, "render_samples": 1, "model": model}
    (tmp_path / "job.json").write_text(json.dumps({"sample": "lame", "cloth": cloth, "measurements": {"file": "rows.csv"}, "fit": fit}
                                                  | ({"export": export} if export else {})))
    subprocess.run([program("selvedge-worker"), "--quiet", "--threads", "2", str(tmp_path)], check=True)
    warnings = json.loads((tmp_path / "status.json").read_text())["warnings"]
    assert sum("films and sequins" in text for text in warnings) == (said is not None), warnings
    assert said is None or any(said in text for text in warnings)
