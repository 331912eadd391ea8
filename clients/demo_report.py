"""JSON work of the demo: writes its job document, and compares fitted with true parameters. Uses only the standard
library."""
import json
import os
import sys


def document(folder, title):
    """Write FOLDER/job.json for the scan and the photographs that selvedge-phantom has made there."""
    with open(os.path.join(folder, "photographs.json"), encoding="utf-8") as f:
        photographs = json.load(f)
    with open(os.path.join(folder, "phantom.json"), encoding="utf-8") as f:
        voxel_um = json.load(f)["cloth"]["voxel_size_um"]
    job = {"sample": title, "volume": {"files": ["scan.tif"], "voxel_size_um": voxel_um}, "photographs": photographs,
           "fit": {"model": "two_lobe.v1", "seed": 1, "render_px": 96}}
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
    with open(truth_path, encoding="utf-8") as f:
        truth = json.load(f)["parameter"]
    with open(result_path, encoding="utf-8") as f:
        result = json.load(f)
    print(f"{'parameter':<12}{'true':>9}   {'fitted +- standard error':<26}{'off by':>8}   ")
    rows = []
    for p in result["parameters"]:
        true, value, se = truth[p["name"]], p["value"], p.get("standard_error") or 0.0
        off = f"{abs(value - true) / se:.1f} se" if se > 0 else ""
        unit = " deg" if p.get("unit") == "deg" else ""
        print(f"{p['name']:<12}{true:>9.3f}   {f'{value:.3f} +- {se:.3f}{unit}':<26}{off:>8}   {remark(p)}".rstrip())
        rows.append({"name": p["name"], "true": true, "fitted": value, "standard_error": se, "determined": p.get("determined")})
    if wall_s == "" and os.path.exists(out_path):
        with open(out_path, encoding="utf-8") as f:
            wall_s = json.load(f)["wall_s"]
    c_tt = [abs(r["fitted"] - r["true"]) for r in rows if r["name"].startswith("C_TT")]
    data = {"wall_s": float(wall_s or 0), "heldout_rel_rms": result["heldout_rel_rms"], "fit_rel_rms": result["fit_rel_rms"],
            "c_tt_error": max(c_tt), "parameters": rows}
    with open(out_path, "w", encoding="utf-8") as f:
        json.dump(data, f, indent=1)
    print(f"\nrelative RMS error: {100 * data['fit_rel_rms']:.2f} % over the fitted photographs, "
          f"{100 * data['heldout_rel_rms']:.2f} % over the held-out ones")
    print("The fit used the fibers found in the noisy scan, not the true ones; the standard errors include what is known of that difference.")
    print(f"largest error of C_TT: {data['c_tt_error']:.3f};  wall time: {data['wall_s']:.0f} s")


if __name__ == "__main__":
    {"document": document, "summary": summary}[sys.argv[1]](*sys.argv[2:])
