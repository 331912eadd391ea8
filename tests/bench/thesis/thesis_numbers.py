"""Numbers of the page of bench_thesis.py beside those of section 5.7: Table 5.3, scatter of rows, colors and edges, and Table 6.1."""
from thesis_fabrics import MODELS, NAMES, cloth
from thesis_fits import DENSITIES
from thesis_looks import TABLE_FABRICS
from thesis_pictures import ANGLES, BINS, CELL_PATHS, SEEN_MM

MISSING = "-"
NAME = {"two_lobe": "fibers", "volume": "volume", "microflake": "microflakes"}
COLORS, ANGLE_KEYS = ("C_R", "C_TT", "alpha"), ("beta_R", "beta_TT", "gamma_TT", "gamma")


def listed(values, form="{:.2f}"):
    return ", ".join(MISSING if v is None else form.format(v) for v in values)


def is_off(fit, name, value, se, determined):
    """Whether a determined value is not within two standard errors of the truth."""
    return determined and abs(value - fit["truth"][name]) > 2 * se


def found_value(fit, name, form):
    """As found: in brackets where it is not determined, with a star where it is off."""
    rows = [row for row in fit["parameters"] if row[0] == name]
    if not rows:
        return MISSING
    text = form.format(rows[0][1])
    return f"({text})" if not rows[0][3] else f"{text}*" if is_off(fit, *rows[0]) else text


def cell53(fit, key):
    """A parameter of Table 5.3, printed and found; empty where the model has none."""
    names = [f"{key}.{c}" for c in "rgb"] if key in COLORS else [key]
    if names[0] not in fit["truth"]:
        return ""
    form = "{:.3f}" if key in COLORS + ("gamma",) else "{:.2f}"
    return f"{' '.join(form.format(fit['truth'][n]) for n in names)}: {' '.join(found_value(fit, n, form) for n in names)}"


def table53(found):
    keys = COLORS + ANGLE_KEYS
    lines = [f"| | {' | '.join(keys)} |", "|---|" + "---|" * len(keys)]
    for model in MODELS:
        for fabric in NAMES:
            fit = found[fabric, model]
            if fit:
                lines.append(f"| {fabric.capitalize()}, {NAME[model]} | {' | '.join(cell53(fit, key) for key in keys)} |")
    return "\n".join(lines)


def to_fibers(found, fabric, model):
    """The fit of a model to the rows of the fibers."""
    return found[fabric, model] if model == "two_lobe" else found[fabric, model, "cross"]


def scatter_table(found):
    lines = [f"| | {' | '.join(NAME.values())} |", "|---|---|---|---|"]
    for fabric in NAMES:
        cells = []
        for model in MODELS:
            fit = to_fibers(found, fabric, model)
            cells.append(MISSING if not fit else listed([fit["of_fitted"], fit["of_rows"][0]], "{:.3f}"))
        lines.append(f"| {fabric.capitalize()} | {' | '.join(cells)} |")
    return "\n".join(lines)


def brightest_mm(columns):
    """Distance of the brightest of a cylinder's columns from the axis."""
    level = [sum(bin_[:3]) for bin_ in columns]
    return abs((level.index(max(level)) + 0.5) / BINS * 2 - 1) * SEEN_MM


def velvet_peak(found):
    """At 10, 126 and 162 degrees, by each model that is there."""
    parts = []
    for model, name in (("photograph", "fibers"), ("volume", "volume"), ("microflake", "microflakes")):
        shown = found["shapes", "velvet", model]
        if shown:
            parts.append(f"{name} {listed([brightest_mm(shown['columns'][ANGLES.index(a)]) for a in (10, 126, 162)], '{:.0f}')}")
    return "; ".join(parts) or MISSING


def edge_ratio(columns):
    """The outer two columns of the brighter side over the middle four."""
    level = [sum(bin_[:3]) for bin_ in columns]
    return max(sum(level[:2]), sum(level[-2:])) / 2 / (sum(level[BINS // 2 - 2:BINS // 2 + 2]) / 4)


def twill_edges(found):
    """At 10 and 50 degrees, by each model that is there."""
    parts = []
    for model, name in (("photograph", "fibers"), ("volume", "volume"), ("microflake", "microflakes")):
        shown = found["shapes", "twill", model]
        if shown:
            parts.append(f"{name} {listed([edge_ratio(shown['columns'][ANGLES.index(a)]) for a in (10, 50)])}")
    return "; ".join(parts) or MISSING


def tint(rgb):
    return 2 * rgb[0] / (rgb[1] + rgb[2])


def silk_cyan(found):
    """Red over the mean of green and blue at (20, 20) and (80, 80), lamp and camera in one plane, both rotations."""
    rows = found["silk rows"]
    return MISSING if not rows else "; ".join(listed([tint(rows[f"f{4 * r + k}"][0]) for r in (0, 1)]) for k in (1, 0))


def radii():
    """Of the fibers of each yarn of the described cloths, um."""
    return ", ".join("/".join(f"{y['fiber_radius_um']:g}" for y in cloth(fabric)["yarns"]) for fabric in NAMES)


def chapter6(found):
    heads = [found["tables", fabric] for fabric in TABLE_FABRICS]
    seconds = [found["seconds", name] for name in ("path", "dual")]
    return {"free_paths": listed([h and h[0] for h in heads], "{:.0f}"), "n_fibers": listed([h and h[2] for h in heads], "{:,}"),
            "unseen": listed([found["unseen", e] and 100 * found["unseen", e] for e in CELL_PATHS], "{:.0f}"),
            "dual_speed": f"{seconds[0] / seconds[1]:.2f}" if all(seconds) else MISSING}


def thin(found):
    """Drapes over the black mesh, lamp on the camera's side and opposite, of each density over the first."""
    drapes = [found["thin", d] for d in DENSITIES]
    if not all(drapes):
        return MISSING
    return "; ".join(listed([a / b for a, b in zip(d, drapes[0])]) for d in drapes[1:])


def own_numbers(found):
    return {"parameters": table53(found), "scatter": scatter_table(found), "velvet_peak": velvet_peak(found), "edges": twill_edges(found),
            "cyan": silk_cyan(found), "radii": radii(), "thin": thin(found), **chapter6(found)}
