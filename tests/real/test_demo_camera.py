"""`make demo-camera` against `make demo`, small: a fit of photographs as they were rendered and one of raw files of a simulated camera agree."""
import json
import os
import subprocess

import real_jobs

VIEWS = [(20, 0, 20, 180, 0), (45, 0, 45, 180, 0), (64, 0, 64, 180, 90), (60, 0, 10, 180, 0), (45, 0, 45, 90, 90), (0, 0, 60, 0, 90)]
TRUTH = ["C_R=0.06,0.05,0.08", "C_TT=0.72,0.55,0.35", "beta_R=4", "beta_TT=20", "gamma_TT=18"]


def run(name, *command):
    subprocess.run([os.path.join(real_jobs.BUILD, "bin", name), *map(str, command)], check=True, stdout=subprocess.DEVNULL)


def load(path):
    with open(path, encoding="utf-8") as f:
        return json.load(f)


def render(folder):
    run("selvedge-phantom", "cloth", "--weave", "twill", "--seed", 7, "--out", folder)
    table = folder / "views.csv"
    table.write_text("set,light_theta_deg,light_phi_deg,camera_theta_deg,camera_phi_deg,cloth_rotation_deg\n"
                     + "".join("fit," + ",".join(map(str, view)) + "\n" for view in VIEWS))
    run("selvedge-phantom", "photograph", "--fibers", folder / "truth.hair", "--table", table, "--out", folder, "--seed", 11, "--paths", 8192, "--px", 64,
        "--crop-cm", 1.25, "--blur-mm", 0.12, *(word for t in TRUTH for word in ("--param", t)))


def photograph(rendered, folder):
    run("selvedge-phantom", "camera", "--photographs", rendered, "--out", folder, "--seed", 5)
    dark, flat = (sorted(folder.glob(f"{kind}-*.dng")) for kind in ("dark", "flat"))
    run("selvedge-camera", "calibrate-camera", "--dark", *dark, "--flat", *flat, "--out", folder / "noise.json")


def fit(job, sample, photographs, fibers):
    """result.json of a job of these photographs, whose files are in the folder of the sample."""
    (job / "input").mkdir(parents=True)
    for file in [*sample.iterdir(), fibers]:
        if file.is_file() and not (job / "input" / file.name).exists():
            os.link(file, job / "input" / file.name)
    (job / "job.json").write_text(json.dumps({
        "sample": "camera", "fibers": {"file": "truth.hair"}, **photographs,
        "fit": {"model": "two_lobe.v1", "seed": 1, "path_budget": 300000, "render_px": 16, "render_samples": 1}}))
    run("selvedge-worker", "--quiet", job)
    return load(job / "results" / "result.json")


def test_raw_files_give_the_parameters_of_the_renderings(tmp_path):
    rendered, raw = tmp_path / "rendered", tmp_path / "raw"
    render(rendered)
    photograph(rendered, raw)
    truth = load(rendered / "truth.json")
    fibers = rendered / "truth.hair"
    exact = fit(tmp_path / "exact", rendered, {"photographs": load(rendered / "photographs.json"), "lamp": truth["lamp"],
                                               "camera": {"crop_cm": truth["camera"]["crop_cm"], "distance_cm": truth["camera"]["distance_cm"]}}, fibers)
    camera = fit(tmp_path / "camera", raw, load(raw / "camera-job.json"), fibers)
    for a, b in zip(exact["rows"], camera["rows"]):
        for x, y, se in zip(a["measured"], b["measured"], b["measured_se"]):
            assert abs(x - y) <= 0.01 * x + 2 * se, (a["name"], x, y, se)
    for a, b in zip(exact["parameters"], camera["parameters"]):
        far = abs(a["value"] - b["value"]) / max((a["standard_error"] ** 2 + b["standard_error"] ** 2) ** 0.5, 1e-12)
        print(f"{a['name']}: {a['value']:.4g}, from raw files {b['value']:.4g}, {far:.2f} standard errors apart")
        assert far < 3
