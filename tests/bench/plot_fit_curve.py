"""Error against paths of the fast and the published method as an SVG picture: plot_fit_curve.py FIGURES.json PICTURE.svg

FIGURES.json: what `bench_fit curve` prints, one JSON object a line.
"""
import json
import math
import sys

WIDTH, HEIGHT, LEFT, RIGHT, TOP, BOTTOM = 720, 440, 72, 24, 24, 60
COLOUR = {"gauss_newton.v1": "#1f5fa8", "published_sgd.v1": "#c0501f"}
TITLE = {"gauss_newton.v1": "Gauss-Newton (default)", "published_sgd.v1": "published method, reduced budget"}


def read(path):
    curve, truth = {}, None
    with open(path) as f:
        for row in map(json.loads, f):
            name = row["name"].removeprefix("fit.curve.")
            if "paths" in row:
                curve.setdefault(name, []).append((row["paths"], row["value"]))
            elif name == "truth_rel_rms":
                truth = row["value"]
    return curve, truth


def scale(values, pixel_low, pixel_high):
    low, high = math.log10(min(values)) - 0.05, math.log10(max(values)) + 0.05
    ticks = [d * 10.0**e for e in range(math.floor(low), math.ceil(high)) for d in (1, 2, 5) if low <= math.log10(d * 10.0**e) <= high]
    return lambda v: pixel_low + (math.log10(v) - low) / (high - low) * (pixel_high - pixel_low), ticks


def tick_text(value, percent):
    if percent:
        return f"{100 * value:g} %"
    return f"{value / 1e6:g} M" if value >= 1e6 else f"{value / 1e3:g} k"


def picture(curve, truth):
    points = [p for c in curve.values() for p in c]
    x, x_ticks = scale([p[0] for p in points], LEFT, WIDTH - RIGHT)
    y, y_ticks = scale([p[1] for p in points] + [truth], HEIGHT - BOTTOM, TOP)
    out = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" font-family="sans-serif" font-size="13">',
           f'<rect width="{WIDTH}" height="{HEIGHT}" fill="white"/>']
    for t in x_ticks:
        out.append(f'<path d="M{x(t):.1f} {TOP}V{HEIGHT - BOTTOM}" stroke="#ddd"/>'
                   f'<text x="{x(t):.1f}" y="{HEIGHT - BOTTOM + 18}" text-anchor="middle">{tick_text(t, False)}</text>')
    for t in y_ticks:
        out.append(f'<path d="M{LEFT} {y(t):.1f}H{WIDTH - RIGHT}" stroke="#ddd"/>'
                   f'<text x="{LEFT - 8}" y="{y(t) + 4:.1f}" text-anchor="end">{tick_text(t, True)}</text>')
    out.append(f'<path d="M{LEFT} {y(truth):.1f}H{WIDTH - RIGHT}" stroke="#444" stroke-dasharray="6 4"/>'
               f'<text x="{LEFT + 6}" y="{y(truth) - 6:.1f}" fill="#444">the true parameters</text>')
    for i, (name, c) in enumerate(curve.items()):
        line = " ".join(f"{x(px):.1f},{y(py):.1f}" for px, py in c)
        out.append(f'<polyline points="{line}" fill="none" stroke="{COLOUR[name]}" stroke-width="2"/>')
        out += [f'<circle cx="{x(px):.1f}" cy="{y(py):.1f}" r="3" fill="{COLOUR[name]}"/>' for px, py in c]
        out.append(f'<text x="{WIDTH - RIGHT - 8}" y="{TOP + 20 + 18 * i}" text-anchor="end" fill="{COLOUR[name]}">{TITLE[name]}</text>')
    out.append(f'<text x="{(LEFT + WIDTH - RIGHT) / 2}" y="{HEIGHT - 14}" text-anchor="middle">paths traced so far</text>'
               f'<text transform="translate(16 {(TOP + HEIGHT - BOTTOM) / 2}) rotate(-90)" text-anchor="middle">held-out relative RMS error</text>')
    return "\n".join(out + ["</svg>", ""])


def main():
    curve, truth = read(sys.argv[1])
    with open(sys.argv[2], "w") as f:
        f.write(picture(curve, truth))


if __name__ == "__main__":
    main()
