"""Error against paths of the fast and the published method as an SVG picture: plot_fit_curve.py FIGURES.json PICTURE.svg

FIGURES.json is the output of `bench_fit curve` or `bench_fit analytic` (of the latter, three seeds are drawn).
A large point at the end of a line is the result: the published method returns the best of its six runs.
"""
import json
import math
import sys

WIDTH, HEIGHT, LEFT, RIGHT, TOP, BOTTOM = 720, 440, 72, 24, 24, 60
COLOUR = {"gauss_newton.v1": "#1f5fa8", "published_sgd.v1": "#c0501f"}
TITLE = {"gauss_newton.v1": "gauss_newton.v1 (default)", "published_sgd.v1": "published_sgd.v1"}
LABEL = {True: "relative RMS error of the fitted means", False: "held-out relative RMS error"}


def read(path):
    """Lines of points by (method, seed), the score of the truth or None, and whether this is the analytic cloth."""
    curve, truth, analytic = {}, None, False
    with open(path) as f:
        for row in map(json.loads, f):
            if row["name"] == "fit.curve.truth_rel_rms":
                truth = row["value"]
            elif "paths" in row and row.get("seed", 1) <= 3:
                analytic = row["name"].startswith("fit.analytic.")
                name = row["name"].split(".", 2)[2]
                curve.setdefault((name, row.get("seed", 1)), []).append((row["paths"], row["value"]))
    return curve, truth, analytic


def scale(values, pixel_low, pixel_high):
    low, high = math.log10(min(values)) - 0.05, math.log10(max(values)) + 0.05
    digits = (1, 2, 5) if high - low < 3 else (1,)
    ticks = [d * 10.0**e for e in range(math.floor(low), math.ceil(high)) for d in digits if low <= math.log10(d * 10.0**e) <= high]
    return lambda v: pixel_low + (math.log10(v) - low) / (high - low) * (pixel_high - pixel_low), ticks


def tick_text(value, percent):
    if percent:
        return f"{100 * value:g} %"
    return next(f"{value / unit:g} {name}" for unit, name in ((1e9, "G"), (1e6, "M"), (1e3, "k"), (1, "")) if value >= unit)


def picture(curve, truth, analytic):
    points = [p for c in curve.values() for p in c]
    x, x_ticks = scale([p[0] for p in points], LEFT, WIDTH - RIGHT)
    y, y_ticks = scale([p[1] for p in points] + ([truth] if truth else []), HEIGHT - BOTTOM, TOP)
    out = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" font-family="sans-serif" font-size="13">',
           f'<rect width="{WIDTH}" height="{HEIGHT}" fill="white"/>']
    for t in x_ticks:
        out.append(f'<path d="M{x(t):.1f} {TOP}V{HEIGHT - BOTTOM}" stroke="#ddd"/>'
                   f'<text x="{x(t):.1f}" y="{HEIGHT - BOTTOM + 18}" text-anchor="middle">{tick_text(t, False)}</text>')
    for t in y_ticks:
        out.append(f'<path d="M{LEFT} {y(t):.1f}H{WIDTH - RIGHT}" stroke="#ddd"/>'
                   f'<text x="{LEFT - 8}" y="{y(t) + 4:.1f}" text-anchor="end">{tick_text(t, True)}</text>')
    if truth:
        out.append(f'<path d="M{LEFT} {y(truth):.1f}H{WIDTH - RIGHT}" stroke="#444" stroke-dasharray="6 4"/>'
                   f'<text x="{LEFT + 6}" y="{y(truth) - 6:.1f}" fill="#444">the true parameters</text>')
    for (name, _), c in curve.items():
        line = " ".join(f"{x(px):.1f},{y(py):.1f}" for px, py in c[:-1])
        out.append(f'<polyline points="{line}" fill="none" stroke="{COLOUR[name]}" stroke-width="1.3"/>'
                   f'<circle cx="{x(c[-1][0]):.1f}" cy="{y(c[-1][1]):.1f}" r="4" fill="{COLOUR[name]}"/>')
    for i, name in enumerate(COLOUR):
        out.append(f'<text x="{WIDTH - RIGHT - 8}" y="{HEIGHT - BOTTOM - 30 + 18 * i}" text-anchor="end" fill="{COLOUR[name]}">{TITLE[name]}</text>')
    out.append(f'<text x="{(LEFT + WIDTH - RIGHT) / 2}" y="{HEIGHT - 14}" text-anchor="middle">paths traced so far</text>'
               f'<text transform="translate(16 {(TOP + HEIGHT - BOTTOM) / 2}) rotate(-90)" text-anchor="middle">{LABEL[analytic]}</text>')
    return "\n".join(out + ["</svg>", ""])


def main():
    with open(sys.argv[2], "w") as f:
        f.write(picture(*read(sys.argv[1])))


if __name__ == "__main__":
    main()
