"""Writes the page of bench_thesis.py: page.txt with a value in place of each {name}."""
import datetime
import json
import math
import os
import re

from thesis_fabrics import MODELS, NAMES
from thesis_fits import correlation
from thesis_numbers import MISSING, is_off, listed, own_numbers
from thesis_pictures import ANGLES, CELL_PATHS, CHAIN, ORDERS, SIDE

HERE = os.path.dirname(os.path.abspath(__file__))

SHOWN = ("fleece", "gabardine", "silk")


def digits(value):
    return f"{value:.3f}" if value < 0.0995 else f"{value:.2f}"


def span(values, form="{:.2f}"):
    values = list(values)
    return MISSING if not values else f"{form.format(min(values))} to {form.format(max(values))}" if len(values) > 1 else form.format(values[0])


def with_ratio(fit):
    """Smaller than the noise of tracing: with <."""
    return MISSING if fit is None else f"{'< ' if fit['below_noise'] else ''}{digits(fit['heldout'])} ({digits(fit['ratio'])})"


def fits(found):
    lines = ["| | fibers | volume | microflakes | volume on fibers | microflakes on fibers | plain BRDF |", "|---|---|---|---|---|---|---|"]
    for fabric in NAMES:
        own = [with_ratio(found[fabric, model]) for model in MODELS]
        cross = [with_ratio(found[fabric, model, "cross"]) for model in ("volume", "microflake")]
        fibers = found[fabric, "two_lobe"]
        lines.append(f"| {fabric.capitalize()} | {' | '.join(own + cross)} | {digits(fibers['brdf']) if fibers else MISSING} |")
    return "\n".join(lines)


def brightness(columns):
    return sum(sum(bin_[:3]) for bin_ in columns)


def brightness_error(columns):
    return math.sqrt(sum(se * se for bin_ in columns for se in bin_[3:]))


def over_true(found, fabric, model):
    """Mean radiances over the true ones with their errors by tracing: five cylinders, then the two drapes with the black mesh (no error known)."""
    shown, true = found["shapes", fabric, model], found["shapes", fabric, "photograph"]
    if shown is None or true is None:
        return [None] * (len(ANGLES) + len(SIDE))

    def over(a, b):
        value = brightness(a) / brightness(b)
        return value, value * math.hypot(*(brightness_error(of) / brightness(of) for of in (a, b)))
    return [over(a, b) for a, b in zip(shown["columns"], true["columns"])] + [(a / b, 0) for a, b in zip(shown["drapes"][:2], true["drapes"][:2])]


def ratio_text(value):
    """With its error where that is 5 % and 0.015 or more."""
    return MISSING if value is None else f"{value[0]:.2f}" + (f" +- {value[1]:.2f}" if value[1] >= max(0.05 * value[0], 0.015) else "")


def grazing(found):
    """A cell has volumes, then microflakes."""
    head = [f"{a}°" for a in ANGLES] + ["drape, same side", "opposite"]
    lines = [f"| | grazing | {' | '.join(head)} |", "|---|" + "---|" * (len(head) + 1)]
    for fabric in NAMES:
        rows = []
        for model in ("volume", "microflake"):
            cross = found[fabric, model, "cross"]
            rows.append([(sum(cross["grazing"]) / 2, 0) if cross else None] + over_true(found, fabric, model))
        lines.append(f"| {fabric.capitalize()} | " + " | ".join(f"{ratio_text(a)}; {ratio_text(b)}" for a, b in zip(*rows)) + " |")
    return "\n".join(lines)


def column_correlations(found, model):
    for fabric in NAMES:
        shown, true = found["shapes", fabric, model], found["shapes", fabric, "photograph"]
        if shown and true:
            both = [[sum(bin_[:3]) for table in of["columns"] for bin_ in table] for of in (shown, true)]
            yield correlation(*both)


def recovered(found):
    """(determined parameters within two standard errors of the truth, determined parameters)."""
    rows = [(found[fabric, model], row) for model in MODELS for fabric in NAMES if found[fabric, model] for row in found[fabric, model]["parameters"] if row[3]]
    return sum(not is_off(fit, *row) for fit, row in rows), len(rows)


def meshes(found):
    parts = []
    for fabric in ("gabardine", "twill"):
        drapes = (found["shapes", fabric, "photograph"] or {}).get("drapes")
        text = listed([a / b for a, b in zip(drapes[2:], drapes[:2])]) if drapes else MISSING
        parts.append(f"{fabric.capitalize()} {text}")
    return "; ".join(parts) + " times (same side, opposite)"


def highlight(found, name):
    """Brightest part of the columns under the lamp at 126 degrees over their mean under the lamp at 10, over the default's; error by tracing."""
    def of(step):
        brightest = max(step["columns"][3], key=lambda b: sum(b[:3]))
        level = sum(brightest[:3])
        return level / (brightness(step["columns"][0]) / len(step["columns"][0])), math.hypot(*brightest[3:]) / level
    step, default = found["chain", name], found["chain", "default"]
    if not step or not default:
        return MISSING
    (value, se), (of_default, default_se) = of(step), of(default)
    return f"{value / of_default:.2f} +- {value / of_default * math.hypot(se, default_se):.2f}"


def difference(step, other):
    """Root mean square over fields, over the mean."""
    pairs = [(a, b) for f, g in zip(step["fields"], other["fields"]) for a, b in zip(f, g)]
    return math.sqrt(sum((a - b) ** 2 for a, b in pairs) / len(pairs)) / (sum(b for _, b in pairs) / len(pairs))


def fast(found):
    path, last = found["fast", "path"], found["fast", f"order-{ORDERS[-1]}"]

    def over_path(name):
        step = found["fast", name]
        return step["mean"] / path["mean"] if step and path else None
    orders = [found["fast", f"order-{o}"] for o in ORDERS[:-1]]
    return {"sizes": ", ".join(f"{e:g}" for e in CELL_PATHS), "size_means": listed([over_path(f"size-{e}") for e in CELL_PATHS], "{:.3f}"),
            "orders": f"{ORDERS[0]} to {ORDERS[-2]}", "order_differences": listed([difference(s, last) if s and last else None for s in orders], "{:.3f}"),
            "dual": listed([over_path("dual")]), "directions": listed([over_path("directions")])}


def kept_figures():
    with open(os.path.join(HERE, "..", "figures.jsonl"), encoding="utf-8") as f:
        rows = {row["name"]: row["value"] for row in map(json.loads, f)}

    def of(what, form):
        return ", ".join(form.format(rows[f"pictures.{fabric}.{what}"]) if f"pictures.{fabric}.{what}" in rows else MISSING for fabric in SHOWN)
    mb = ", ".join(f"{rows[name] / 1e6:.1f}" if name in rows else MISSING for name in (f"pictures.{fabric}.precompute_bytes" for fabric in SHOWN))
    return {"flat": of("flat492_rel_rms", "{:.3f}"), "speeds": of("speedup_at_equal_noise", "{:.1f}"), "table_mb": mb}


def stripe(found, what, name="alternative"):
    new, old = found["stripes", name], found["stripes", "fitted"]
    return f"{new[what] / old[what]:.2f}" if new and old else MISSING


def machine(days, n_other):
    """days, n_other: as Steps.standing."""
    with open("/proc/cpuinfo", encoding="utf-8") as f:
        name = re.search(r"model name\s*: (.*)", f.read())
    programs = f", {n_other + 1} versions of the program" if n_other else ""
    return (f"{' to '.join(days) or datetime.date.today().isoformat()}{programs}, {os.cpu_count()} cores of "
            f"{'an ' + name[1].split('(')[0] if name else 'a processor'} beside other work.")


def values(found, standing):
    inside, counted = recovered(found)
    own = [found[fabric, model] for fabric in NAMES for model in MODELS if found[fabric, model]]
    timed = [f["cpu_s"] for f in own if f["cpu_s"] is not None]
    microflakes = [found[f, "microflake", "cross"] for f in NAMES if found[f, "microflake", "cross"]]
    by_moments = [found[fabric, "bisected"] for fabric in NAMES if found[fabric, "bisected"]]
    bisected = [f["cpu_s"] for f in by_moments if f["cpu_s"] is not None]
    text = {"fits": fits(found), "grazing": grazing(found), "within": inside, "counted": counted, "mesh": meshes(found),
            "fit_cpu": f"{sum(timed) / len(timed):.0f}" if timed else MISSING,
            "bisected_cpu": f"{sum(bisected) / len(bisected):.0f}" if bisected else MISSING,
            "density": listed([d and d["heldout"] for d in (found["density", d] for d in (4000, 2000, 1000))], "{:.3f}"),
            "contrast": stripe(found, "contrast"), "stripes_mean": stripe(found, "mean"), "machine": machine(*standing),
            "contrast_microflake": stripe(found, "contrast", "microflake"),
            "grazing_range": span([v for fit in microflakes for v in fit["grazing"]])}
    for model in ("volume", "microflake"):
        text[f"columns_{model}"] = span(column_correlations(found, model))
    text["bisected"] = span([fit["heldout"] for fit in by_moments])
    text["bisected_gamma"] = span([p[1] for fit in by_moments for p in fit["parameters"] if p[0] == "gamma"], "{:.3f}")
    text["missing"] = f" {MISSING}: not run." if any(v is None for v in found.values()) else ""
    text.update({name: highlight(found, name) for name in CHAIN})
    return {**text, **fast(found), **kept_figures(), **own_numbers(found)}


def write_page(found, standing, path):
    with open(os.path.join(HERE, "page.txt"), encoding="utf-8") as f:
        page = f.read()
    of = values(found, standing)
    page = re.sub(r"\{([a-z_]+)\}", lambda m: str(of[m[1]]), page)
    with open(path, "w", encoding="utf-8") as f:
        f.write(page)
