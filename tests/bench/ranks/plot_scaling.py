"""Strong scaling over ranks as an SVG picture: plot_scaling.py PAGE.md PICTURE.svg

PAGE.md is docs/ranks.md. Its tables hold the measured efficiencies of two ranks and what was measured for the model, in the
rows that bench_ranks.py prints; the curve is computed from them by rank_model.py, and printed as a row of the page."""
import math
import os
import re
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import rank_model  # noqa: E402

WIDTH, HEIGHT, LEFT, RIGHT, TOP, BOTTOM = 720, 420, 72, 24, 24, 60
RANKS = [1, 2, 4, 8, 16, 32, 64]
LOW, HIGH = 0.5, 1.05
# the row's key, what the model calls it, and what one of the page's units is in the model's
INPUT = {"*t*": ("task_s", 1e-3), "*S*": ("serial_s", 1e-3), "*p*": ("prepare_s", 1e-3), "*L*": ("there_s", 1e-3), "*h*": ("handle_s", 1e-3),
         "*B*": ("bytes_per_s", 1e9), "*o*": ("order_bytes", 1e3), "*b*": ("result_bytes", 1)}
UNIT = {1e-3: "ms", 1e9: "GB/s", 1e3: "kB", 1: "bytes"}
MEANING = {"*t*": "processor time of a task", "*S*": "processor time of rank 0 in the whole fit besides shared work",
           "*p*": "preparation of an estimate in a helper", "*L*": "a short message, one way", "*h*": "processor time of rank 0 for a message",
           "*B*": "rate of long messages", "*o*": "an order, in the mean", "*b*": "the results of a task"}
MEASURED = {"two ranks, quiet cores": ("#c0501f", "circle"), "two ranks, cores at load 10 to 16": ("#c0501f", "ring"),
            "two threads of one process, quiet cores": ("#555", "square")}


def rows_of_inputs(measured):
    """What was measured for the model, as rows of the page."""
    yield f"| *n*: tasks of each step | {', '.join(str(n) for n in measured['tasks'])} |"
    for key, (name, unit) in INPUT.items():
        yield f"| {key}: {MEANING[key]} | {measured[name] / unit:.3g} {UNIT[unit]} |"


def read(path):
    """The inputs of the model, and the measured efficiencies by what they are of."""
    measured, efficiency = {}, {}
    with open(path) as f:
        rows = [[cell.strip() for cell in line.strip().strip("|").split("|")] for line in f if line.startswith("| ")]
    for name, value in (row for row in rows if len(row) == 2):
        key = name.split(":")[0]
        if key == "*n*":
            measured["tasks"] = [int(n) for n in value.split(", ")]
        elif key in INPUT:
            number, unit = value.split()
            assert unit == UNIT[INPUT[key][1]], f"{path}: the unit of {key} is not {UNIT[INPUT[key][1]]}"
            measured[INPUT[key][0]] = float(number) * INPUT[key][1]
        elif name in MEASURED:
            efficiency[name] = [float(v) for v in re.findall(r"\d\.\d+", value)]
    missing = [key for key, (name, _) in INPUT.items() if name not in measured] + [name for name in MEASURED if name not in efficiency]
    if missing or "tasks" not in measured:
        sys.exit(f"{path} lacks the rows {', '.join(missing or ['*n*'])}")
    return measured, efficiency


def x_of(ranks):
    return LEFT + math.log2(ranks) / math.log2(RANKS[-1]) * (WIDTH - LEFT - RIGHT - 30) + 10


def y_of(efficiency):
    return TOP + (HIGH - efficiency) / (HIGH - LOW) * (HEIGHT - TOP - BOTTOM)


def mark(kind, colour, x, y):
    if kind == "square":
        return f'<rect x="{x - 4:.1f}" y="{y - 4:.1f}" width="8" height="8" fill="{colour}"/>'
    return f'<circle cx="{x:.1f}" cy="{y:.1f}" r="4.5" stroke="{colour}" stroke-width="1.6" fill="{"white" if kind == "ring" else colour}"/>'


def axes():
    for ranks in RANKS:
        yield (f'<path d="M{x_of(ranks):.1f} {TOP}V{HEIGHT - BOTTOM}" stroke="#ddd"/>'
               f'<text x="{x_of(ranks):.1f}" y="{HEIGHT - BOTTOM + 18}" text-anchor="middle">{ranks}</text>')
    for tenth in range(round(10 * LOW), 11):
        yield (f'<path d="M{LEFT} {y_of(tenth / 10):.1f}H{WIDTH - RIGHT}" stroke="{"#888" if tenth == 10 else "#ddd"}"/>'
               f'<text x="{LEFT - 8}" y="{y_of(tenth / 10) + 4:.1f}" text-anchor="end">{tenth / 10:.1f}</text>')
    yield (f'<text x="{(LEFT + WIDTH - RIGHT) / 2}" y="{HEIGHT - 14}" text-anchor="middle">ranks of one thread</text>'
           f'<text transform="translate(20 {(TOP + HEIGHT - BOTTOM) / 2}) rotate(-90)" text-anchor="middle">efficiency T(1) / (N T(N))</text>')


def picture(measured, efficiency):
    out = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" font-family="sans-serif" font-size="13">',
           f'<rect width="{WIDTH}" height="{HEIGHT}" fill="white"/>', *axes()]
    line = " ".join(f"{x_of(n):.1f},{y_of(rank_model.efficiency(measured, n)):.1f}" for n in range(1, RANKS[-1] + 1))
    out.append(f'<polyline points="{line}" fill="none" stroke="#1f5fa8" stroke-width="1.6"/>')
    for n in RANKS[1:]:
        e = rank_model.efficiency(measured, n)
        out.append(f'<circle cx="{x_of(n):.1f}" cy="{y_of(e):.1f}" r="2.5" fill="#1f5fa8"/>'
                   f'<text x="{x_of(n) - 6:.1f}" y="{y_of(e) + 18:.1f}" fill="#1f5fa8" text-anchor="end">{e:.2f}</text>')
    legend = [("line", "#1f5fa8", "simulated from measured message sizes and times")] + [(kind, colour, name) for name, (colour, kind) in MEASURED.items()]
    out.append(mark("circle", "#c0501f", x_of(1), y_of(1)))  # by which the others are divided
    for name, (colour, kind) in MEASURED.items():
        for value in efficiency[name]:
            out.append(mark(kind, colour, x_of(2), y_of(value)))
    for i, (kind, colour, text) in enumerate(legend):
        x, y = LEFT + 24, HEIGHT - BOTTOM - 84 + 20 * i
        out.append(f'<path d="M{x - 10} {y}h20" stroke="{colour}" stroke-width="1.6"/>' if kind == "line" else mark(kind, colour, x, y))
        out.append(f'<text x="{x + 16}" y="{y + 4}" fill="{colour}">{text}</text>')
    return "\n".join(out + ["</svg>", ""])


def main():
    measured, efficiency = read(sys.argv[1])
    print("| seconds of the fit, simulated | " + " | ".join(f"{rank_model.fit_s(measured, n):.2f}" for n in RANKS) + " |")
    print("| efficiency, simulated | " + " | ".join(f"{rank_model.efficiency(measured, n):.2f}" for n in RANKS) + " |")
    with open(sys.argv[2], "w") as f:
        f.write(picture(measured, efficiency))


if __name__ == "__main__":
    main()
