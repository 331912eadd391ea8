"""JSON work of the demo: writes its job document, and compares fitted with true parameters. Uses only the standard
library."""
import json
import os
import sys


def load(*path):
    with open(os.path.join(*path), encoding="utf-8") as f:
        return json.load(f)


def document(folder, title):
    """Write FOLDER/job.json for the scan and the photographs that selvedge-phantom has made there: renderings, or raw files
    with what its simulated camera says of them."""
    voxel_um = load(folder, "phantom.json")["cloth"]["voxel_size_um"]
    job = {"sample": title, "volume": {"files": ["scan.tif"], "voxel_size_um": voxel_um},
           "fit": {"model": "two_lobe.v1", "seed": 1, "render_px": 96}}
    if os.path.exists(os.path.join(folder, "camera-job.json")):
        job.update(load(folder, "camera-job.json"))
    else:
        job["photographs"] = load(folder, "photographs.json")
    path = os.path.join(folder, "job.json")
    with open(path + ".new", "w", encoding="utf-8") as f:
        json.dump(job, f, indent=1)
    os.replace(path + ".new", path)


def remark(p):
    if p.get("fixed"):
        return "fixed"
    words = []
    if p.get("at_bound"):
        words.append("at a bound")
    if p.get("determined") is False:
        words.append("not determined by these photographs")
    return ", ".join(words)


def summary(truth_path, result_path, out_path, wall_s):
    """Print the table, and write the machine-readable summary (without wall_s: keep the existing one)."""
    truth, result = load(truth_path)["parameter"], load(result_path)
    print(f"{'parameter':<12}{'true':>9}   {'fitted +- standard error':<26}{'off by':>8}   ")
    rows = []
    for p in result["parameters"]:
        true, value, se = truth[p["name"]], p["value"], p.get("standard_error") or 0.0
        off = f"{abs(value - true) / se:.1f} se" if se > 0 else ""
        unit = " deg" if p.get("unit") == "deg" else ""
        print(f"{p['name']:<12}{true:>9.3f}   {f'{value:.3f} +- {se:.3f}{unit}':<26}{off:>8}   {remark(p)}".rstrip())
        rows.append({"name": p["name"], "true": true, "fitted": value, "standard_error": se, "determined": p.get("determined")})
    if wall_s == "" and os.path.exists(out_path):
        wall_s = load(out_path)["wall_s"]
    c_tt = [abs(r["fitted"] - r["true"]) for r in rows if r["name"].startswith("C_TT")]
    data = {"wall_s": float(wall_s or 0), "heldout_rel_rms": result["heldout_rel_rms"], "fit_rel_rms": result["fit_rel_rms"],
            "c_tt_error": max(c_tt), "parameters": rows}
    with open(out_path, "w", encoding="utf-8") as f:
        json.dump(data, f, indent=1)
    print(f"\nrelative RMS error: {100 * data['fit_rel_rms']:.2f} % over the fitted photographs, "
          f"{100 * data['heldout_rel_rms']:.2f} % over the held-out ones")
    print("The fit used the fibers found in the noisy scan, not the true ones; the standard errors include what is known of that difference.")
    print(f"largest error of C_TT: {data['c_tt_error']:.3f};  wall time: {data['wall_s']:.0f} s")


def camera(truth_path, result_path, summary_path, demo_path):
    """Print how the radiances from raw files compare with the rendered ones, and the parameters with those of `make demo`."""
    true = {os.path.splitext(p["file"])[0]: p["mean_rgb"] for p in load(truth_path)["photographs"]}
    result, off, z = load(result_path), [], []
    for row in result["rows"]:
        name = os.path.splitext(row["name"])[0].rsplit("-", 1)[0]  # fit-03-0.dng is the first exposure of fit-03.exr
        for t, m, se in zip(true[name], row["measured"], row["measured_se"]):
            off.append(abs(m / t - 1))
            z.append(abs(m - t) / se)
    chart = result["color"]["delta_e_2000_after"]
    print(f"\nraw files: the {len(off)} mean radiances differ from the rendered ones by {100 * max(off):.2f} % and {max(z):.1f} standard errors at most; "
          f"the color chart by {chart['mean']:.2f} (CIEDE2000)")
    if not os.path.exists(demo_path):
        print("Run `make demo` to compare the parameters with those from the renderings themselves.")
        return
    print(f"{'parameter':<12}{'true':>9}   {'from raw files':<20}{'from the renderings':<20}")
    demo = {p["name"]: p for p in load(demo_path)["parameters"]}
    for p in load(summary_path)["parameters"]:
        values = [f"{q['fitted']:.3f} +- {q['standard_error']:.3f}" for q in (p, demo[p["name"]])]
        print(f"{p['name']:<12}{p['true']:>9.3f}   {values[0]:<20}{values[1]:<20}")


if __name__ == "__main__":
    {"document": document, "summary": summary, "camera": camera}[sys.argv[1]](*sys.argv[2:])
