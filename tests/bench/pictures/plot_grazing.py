"""Radiance of each fitted model in mirrored directions against their angle from the normal, as an SVG picture:
plot_grazing.py FIGURES.json PICTURE.svg

FIGURES.json is the output of `bench_fit grazing`.
"""
import json
import math
import sys

WIDTH, HEIGHT, LEFT, RIGHT, TOP, BOTTOM = 720, 440, 72, 24, 24, 60
COLOUR = {"two_lobe": "#1f5fa8", "two_lobe_balanced": "#4a9c8e", "two_lobe_volume": "#7a4fa3", "microflake": "#c0501f", "truth": "#222"}
TITLE = {"truth": "true cloth (two_lobe fibers)", "two_lobe": "two_lobe, fitted", "two_lobe_balanced": "two_lobe_balanced, fitted",
         "two_lobe_volume": "two_lobe_volume, fitted", "microflake": "microflake, fitted", "photograph": "photographs of the fit",
         "microflake_brightest": "brightest white microflakes of any gamma and density"}
SIGN = {"photograph": "○ ", "microflake_brightest": "+ "}


def read(path):
    """(angle, radiance, standard error) by curve."""
    curve = {}
    with open(path) as f:
        for row in map(json.loads, f):
            if row["name"].startswith("fit.grazing."):
                curve.setdefault(row["name"].split(".", 2)[2], []).append((row["angle_deg"], row["value"], row["se"]))
    return curve


def picture(curve):
    values = [v for c in curve.values() for _, v, _ in c if v > 0]
    low, high = math.log10(min(values)) - 0.05, math.log10(max(values)) + 0.1
    x_end = max(a for c in curve.values() for a, _, _ in c)
    ticks = [d * 10.0**e for e in range(math.floor(low), math.ceil(high)) for d in (1, 2, 5) if low <= math.log10(d * 10.0**e) <= high]

    def x(angle):
        return LEFT + angle / x_end * (WIDTH - LEFT - RIGHT)

    def y(value):
        return HEIGHT - BOTTOM - (math.log10(max(value, 10**low)) - low) / (high - low) * (HEIGHT - TOP - BOTTOM)

    out = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" font-family="sans-serif" font-size="13">',
           f'<rect width="{WIDTH}" height="{HEIGHT}" fill="white"/>']
    for t in range(0, int(x_end) + 1, 10):
        out.append(f'<path d="M{x(t):.1f} {TOP}V{HEIGHT - BOTTOM}" stroke="#ddd"/>'
                   f'<text x="{x(t):.1f}" y="{HEIGHT - BOTTOM + 18}" text-anchor="middle">{t}°</text>')
    for t in ticks:
        out.append(f'<path d="M{LEFT} {y(t):.1f}H{WIDTH - RIGHT}" stroke="#ddd"/>'
                   f'<text x="{LEFT - 8}" y="{y(t) + 4:.1f}" text-anchor="end">{t:g}</text>')
    names = [n for n in COLOUR if n in curve]
    for name in names:
        line = " ".join(f"{x(a):.1f},{y(v):.1f}" for a, v, _ in curve[name])
        dash = ' stroke-dasharray="6 4"' if name == "truth" else ""
        out.append(f'<polyline points="{line}" fill="none" stroke="{COLOUR[name]}" stroke-width="1.6"{dash}/>')
        out += [f'<path d="M{x(a):.1f} {y(v - e):.1f}V{y(v + e):.1f}" stroke="{COLOUR[name]}"/>' for a, v, e in curve[name]]
    for a, v, _ in curve.get("photograph", []):
        out.append(f'<circle cx="{x(a):.1f}" cy="{y(v):.1f}" r="5" fill="none" stroke="#222"/>')
    for a, v, _ in curve.get("microflake_brightest", []):
        out.append(f'<path d="M{x(a) - 6:.1f} {y(v):.1f}h12m-6 -6v12" stroke="{COLOUR["microflake"]}" stroke-width="2"/>')
    for i, name in enumerate(names + [n for n in SIGN if n in curve]):
        colour = COLOUR[name.split("_brightest")[0]] if name != "photograph" else "#222"
        text = SIGN.get(name, "") + TITLE[name]
        out.append(f'<text x="{LEFT + 12}" y="{TOP + 20 + 18 * i}" fill="{colour}">{text}</text>')
    out.append(f'<text x="{(LEFT + WIDTH - RIGHT) / 2}" y="{HEIGHT - 14}" text-anchor="middle">'
               f'angle of lamp and camera from the normal, on opposite sides</text>'
               f'<text transform="translate(16 {(TOP + HEIGHT - BOTTOM) / 2}) rotate(-90)" text-anchor="middle">radiance (white facing the lamp: 1)</text>')
    return "\n".join(out + ["</svg>", ""])


def main():
    with open(sys.argv[2], "w") as f:
        f.write(picture(read(sys.argv[1])))


if __name__ == "__main__":
    main()
