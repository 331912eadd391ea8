"""Draws the drafts that `selvedge-phantom detect` found, as an SVG: plot_weave.py OUT.svg NAME=ANSWER.json ...

Each column is one cloth: its draft over two repeats, dark where the warp lies on top, to the scale of its yarns, and the
numbers of every photograph.
"""
import json
import sys

COLUMN, SQUARE, TOP = 215, 150, 34


def draft_rectangles(draft, spacing, x0, y0):
    rows, columns = 2 * len(draft), 2 * len(draft[0])
    scale = SQUARE / max(rows * spacing[1], columns * spacing[0])
    width, height = scale * spacing[0], scale * spacing[1]
    for j in range(rows):
        for i in range(columns):
            up = draft[j % len(draft)][i % len(draft[0])] == "1"
            yield (f'<rect x="{x0 + i * width:.2f}" y="{y0 + j * height:.2f}" width="{width:.2f}" height="{height:.2f}" '
                   f'fill="{"#4a4a55" if up else "#f3efe2"}" stroke="#999" stroke-width="0.5"/>')


def column(name, answer, x0):
    best = max(answer["photographs"], key=lambda p: p.get("confidence", {}).get("draft", 0))
    yield f'<text x="{x0}" y="22" font-weight="bold">{name}: {best["weave"]}</text>'
    yield from draft_rectangles(best["draft"], (best["warp"]["spacing_px"], best["weft"]["spacing_px"]), x0, TOP)
    y = TOP + SQUARE + 20
    for found, light in zip(answer["photographs"], ("reflected", "transmitted")):
        if "error" in found:
            continue
        for line in (f'{light}: every {found["warp"]["spacing_px"]:.2f} x {found["weft"]["spacing_px"]:.2f} px',
                     f'warp {found["warp"]["direction_deg"]:.1f}, weft {found["weft"]["direction_deg"]:.1f} degrees',
                     f'confidence: yarns {found["confidence"]["yarns"]:.2f}, draft {found["confidence"]["draft"]:.2f}'):
            yield f'<text x="{x0}" y="{y}">{line}</text>'
            y += 15
        y += 5


def main():
    out, cloths = sys.argv[1], [argument.split("=", 1) for argument in sys.argv[2:]]
    width, height = COLUMN * len(cloths) + 10, TOP + SQUARE + 125
    parts = [f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" font-family="sans-serif" '
             'font-size="11">', '<rect width="100%" height="100%" fill="white"/>']
    for k, (name, path) in enumerate(cloths):
        with open(path, encoding="utf-8") as answer:
            parts += column(name, json.load(answer), 10 + k * COLUMN)
    with open(out, "w", encoding="utf-8") as svg:
        svg.write("\n".join(parts + ["</svg>"]) + "\n")


main()
