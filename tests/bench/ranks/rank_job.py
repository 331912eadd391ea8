"""The job by which ranks are measured: a plain weave that is described, and 16 rows of itself with known parameters."""
import json
import os
import subprocess

VIEWS = [(20, 20, 180, 0), (45, 45, 180, 0), (60, 0, 180, 0), (60, 60, 180, 90), (30, 0, 180, 90), (70, 30, 180, 90), (70, 70, 180, 0),
         (50, 50, 90, 0), (40, 60, 30, 45), (75, 40, 150, 90), (30, 60, 180, 0), (60, 30, 90, 90), (45, 0, 180, 90), (15, 50, 120, 0),
         (65, 65, 150, 0), (35, 20, 60, 90)]
CLOTH = {"weave": "plain", "tile_warps": 4, "tile_wefts": 4, "yarns": [{"fibers": 20}]}
TRUTH = {"C_R": [0.06, 0.05, 0.08], "C_TT": [0.7, 0.5, 0.3], "beta_R": 6, "beta_TT": 20}


def write_job(folder, rows, fit):
    os.makedirs(os.path.join(folder, "input"))
    document = {"sample": "ranks", "cloth": CLOTH, "measurements": {"file": "rows.csv"},
                "fit": {"model": "two_lobe.v1", "render_px": 8, "render_samples": 1, **fit}}
    with open(os.path.join(folder, "job.json"), "w") as f:
        json.dump(document, f)
    with open(os.path.join(folder, "input", "rows.csv"), "w") as f:
        f.write("set,light_theta_deg,light_phi_deg,camera_theta_deg,camera_phi_deg,cloth_rotation_deg,r,g,b\n")
        for i, ((light, camera, phi, turn), rgb) in enumerate(zip(VIEWS, rows)):
            f.write(f"{'fit' if i < 14 else 'held-out'},{light},0,{camera},{phi},{turn}," + ",".join(f"{v:.6g}" for v in rgb) + "\n")
    return folder


def true_rows(worker, folder):
    """Mean radiances of the cloth with the known parameters: the rows that a job renders whose parameters are as good as
    fixed."""
    write_job(folder, [(0.1, 0.1, 0.1)] * len(VIEWS), {"fixed": TRUTH, "bounds": {"gamma_TT": [19, 21]}, "max_iterations": 1, "path_budget": 100000})
    subprocess.run([worker, "--quiet", folder], check=True, stdin=subprocess.DEVNULL)
    with open(os.path.join(folder, "results", "result.json")) as f:
        return [row["rendered"] for row in json.load(f)["rows"]]
