"""Truths, fits and their errors for bench_thesis.py.

A truth is a table: mean radiances of the 16 + 492 configurations at the parameters of Table 5.3, with standard errors; the worker renders
each row with paths of its own. A fit takes the 16 rows and predicts the 492. Its error is

    heldout^2 = mean over rows and channels of ((rendered - true)^2 - se_rendered^2 - se_true^2) / max(brightness of the row, 0.02)^2,

or the standard error of that mean, by the scatter of its rows, where it is larger. The plain BRDF is the one that every job fits to the same
16 rows, with the noise of the truth taken off its error; `ratio` is heldout over that.
"""
import math

from thesis_fabrics import FITTED, FURTHER, GRAZING, MODELS, cloth, truth

HEAD = "set,name,light_theta_deg,light_phi_deg,camera_theta_deg,camera_phi_deg,cloth_rotation_deg,r,g,b,r_se,g_se,b_se,weight\n"
# rows with paths of their own for each configuration; microflakes have rare, bright paths, which are cheap
COPIES = {"f": {"two_lobe": 16, "volume": 16, "microflake": 32}, "h": {"two_lobe": 1, "volume": 1, "microflake": 1}}
BUDGET = 700000
OF_FITTED, OF_FURTHER, OTHER = 1001, 1002, 1  # seeds
SMALL = {"render_px": 8, "render_samples": 1, "discrepancy": False}
TAU = 0.02


def line(kind, name, angles, rgb=(0.1, 0.1, 0.1), se=(0, 0, 0), weight=1):
    light, camera, phi, rotation = angles
    values = [kind, name, light, 0, camera, phi, rotation, *(f"{v:.8g}" for v in (*rgb, *se)), weight]
    return ",".join(map(str, values)) + "\n"


def truth_table(kind, model):
    """Of the fitted ("f") or the further ("h") configurations."""
    lines = [HEAD]
    for i, angles in enumerate(FITTED if kind == "f" else FURTHER):
        lines += [line("held-out" if i + k > 0 else "fit", f"{kind}{i}-{k}", angles) for k in range(COPIES[kind][model])]
    return "".join(lines)


def narrow(parameters):
    """A job with measurements fits at least one number: this one is held within a ten-thousandth."""
    fixed = dict(parameters)
    key = "gamma_TT" if "gamma_TT" in fixed else "gamma"
    value = fixed.pop(key)
    low, high = {"gamma_TT": (1, 45), "gamma": (0.005, 1.5)}[key]
    return {"fixed": fixed, "bounds": {key: [max(low, value * 0.9999), min(high, value * 1.0001)]}, "start": {key: value}}


def mean_of(rows):
    n = len(rows)
    return ([sum(r["rendered"][c] for r in rows) / n for c in range(3)],
            [math.sqrt(sum(r["rendered_se"][c] ** 2 for r in rows)) / n for c in range(3)])


def take_truth(result, _):
    by_name = {}
    for row in result["rows"]:
        by_name.setdefault(row["name"].split("-")[0], []).append(row)
    return {name: mean_of(rows) for name, rows in by_name.items()}


def make_truth(steps, fabric, model):
    """{"f0": [mean, standard error], ...}, or None."""
    rows = {}
    for kind, seed in (("f", OF_FITTED), ("h", OF_FURTHER)):
        document = {"sample": f"{fabric}, Table 5.3, {model}", "cloth": cloth(fabric), "measurements": {"file": "rows.csv"},
                    "fit": {"model": MODELS[model], "seed": seed, "path_budget": 300000, **narrow(truth(fabric, model)), **SMALL}}
        part = steps.job(f"truth.{fabric}.{model}.{kind}", document, {"rows.csv": truth_table(kind, model)}, take_truth)
        if part is None:
            return None
        rows.update(part)
    return rows


def table_of(rows, without_grazing=False):
    lines = [HEAD] + [line("held-out", f"h{i}", angles, *rows[f"h{i}"]) for i, angles in enumerate(FURTHER)]
    for i, angles in enumerate(FITTED):
        lines.append(line("fit", f"f{i}", angles, *rows[f"f{i}"], 0 if without_grazing and angles in GRAZING else 1))
    return "".join(lines)


def brightness(rgb):
    return max(sum(rgb) / 3, TAU)


def noise_square(rows):
    """Mean over the further rows of the squared standard error of the truth, relative to its brightness."""
    of = [(rgb, se) for name, (rgb, se) in rows.items() if name[0] == "h"]
    return sum(sum(s * s for s in se) / 3 / brightness(rgb) ** 2 for rgb, se in of) / len(of)


def row_square(row):
    """Squared relative difference of the two means of a row, without the noise of both."""
    both = zip(row["rendered"], row["rendered_se"], row["measured"], row["measured_se"])
    return sum((r - m) ** 2 - r_se ** 2 - m_se ** 2 for r, r_se, m, m_se in both) / 3 / brightness(row["measured"]) ** 2


def own_square(result):
    """(mean of row_square over the further rows, its standard error)."""
    squares = [row_square(row) for row in result["rows"] if row["set"] == "held-out"]
    n, mean = len(squares), sum(squares) / len(squares)
    return mean, math.sqrt(sum((s - mean) ** 2 for s in squares) / (n * (n - 1)))


def root(square):
    return math.sqrt(max(0.0, square))


def take_fit(rows, parameters):
    """Errors, the mirrored grazing rows, and the parameters beside the true ones (None: those of another model)."""
    def take(result, _):
        square, square_se = own_square(result)
        error = root(max(square, square_se))
        plain = root(result["skill"]["plain_brdf"]["heldout_rel_rms"] ** 2 - noise_square(rows))
        grazing = [row for row in result["rows"] if row["set"] == "fit"
                   and (row["light_theta_deg"], row["camera_theta_deg"], row["camera_phi_deg"], row["cloth_rotation_deg"]) in GRAZING]
        ratio = [sum(row["rendered"]) / sum(row["measured"]) for row in grazing]
        pulls = [(p["name"], p["value"], p["standard_error"], p["determined"]) for p in result["parameters"] if not p["fixed"]]
        return {"heldout": error, "below_noise": square < 2 * square_se, "brdf": plain, "ratio": error / plain,
                "grazing": ratio, "converged": result["converged"], "paths": result["n_path_fit"],
                "parameters": pulls, "truth": flat(parameters) if parameters else None, "of_rows": [scatter(result, "held-out")]}
    return take


def correlation(xs, ys):
    mx, my = sum(xs) / len(xs), sum(ys) / len(ys)
    sxy = sum((x - mx) * (y - my) for x, y in zip(xs, ys))
    return sxy / math.sqrt(sum((x - mx) ** 2 for x in xs) * sum((y - my) ** 2 for y in ys))


def scatter(result, kind):
    """Correlation of rendered and measured mean radiances of the rows of a set (figures 5.20, 5.21)."""
    rows = [row for row in result["rows"] if row["set"] == kind]
    return correlation([v for row in rows for v in row["measured"]], [v for row in rows for v in row["rendered"]])


def flat(parameters):
    names = {}
    for key, value in parameters.items():
        names.update({f"{key}.{c}": v for c, v in zip("rgb", value)} if isinstance(value, list) else {key: value})
    return names


def fit(steps, fabric, model, of):
    """Fits `model` to the truth of the model `of`; without the two mirrored grazing rows where microflakes meet fibers, as printed."""
    rows = make_truth(steps, fabric, of)
    name = f"fit.{fabric}.{model}" if model == of else f"cross.{fabric}.{model}"
    if rows is None:
        return None
    document = {"sample": f"{fabric}, {model} fitted to {of}", "cloth": cloth(fabric), "measurements": {"file": "rows.csv"},
                "fit": {"model": MODELS[model], "seed": OTHER, "path_budget": BUDGET, **SMALL}}
    table = table_of(rows, without_grazing=model == "microflake" and of != "microflake")
    found = steps.job(name, document, {"rows.csv": table}, take_fit(rows, truth(fabric, model) if model == of else None))
    whole = steps.result(name)
    return found and {**found, "cpu_s": steps.kept(name)["cpu_s"], "of_fitted": whole and scatter(whole, "fit")}


DENSITIES = (4000, 2000, 1000)  # figure 5.8


def density(steps, per_cm):
    """Fleece as a volume of another density, fitted to that of 4000."""
    rows = make_truth(steps, "fleece", "volume")
    document = {"sample": f"fleece, density {per_cm}", "cloth": cloth("fleece"), "measurements": {"file": "rows.csv"},
                "fit": {"model": MODELS["volume"], "seed": OTHER, "path_budget": BUDGET, "density_multiplier_per_cm": per_cm, **SMALL}}
    return rows and steps.job(f"density.{per_cm}", document, {"rows.csv": table_of(rows)}, take_fit(rows, None))


def bisected(steps, fabric):
    """Microflakes fitted to the fibers as printed: by mean and variance, without the two grazing rows."""
    rows = make_truth(steps, fabric, "two_lobe")
    document = {"sample": f"{fabric}, microflakes by mean and variance", "cloth": cloth(fabric), "measurements": {"file": "rows.csv"},
                "fit": {"model": MODELS["microflake"], "method": "mean_variance.v1", "seed": OTHER, "path_budget": 4000000, **SMALL}}
    name = f"bisected.{fabric}"
    found = rows and steps.job(name, document, {"rows.csv": table_of(rows, without_grazing=True)}, take_fit(rows, None))
    return found and {**found, "cpu_s": steps.kept(name)["cpu_s"]}
