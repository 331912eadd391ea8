"""Pictures of the six fabrics as they look: bench_looks.py --build DIR [--px N] [--reference N] [--deep-paths N] [NAME ...]

The fabrics are those of six_fabrics.py, on a roll and draped; figures are means of both. A picture of 1,024 x 1,024 pixels with 4,096
samples takes some 24 hours of a processor, so that the middle N x N of its pixels (--px) are rendered, path by path with so many samples
(--reference), once, and kept in DIR/bench-looks. FLIP is taken at the evaluator's own viewing distance (67 pixels a degree). Its floor,
FLIP between two references of half of the samples, is printed to standard error: no picture can be told to be nearer than about half of it.
The factor on deep light is fitted to paths of the crop, as many as the picture's samples; a whole picture has 262,144.

  pictures.<fabric>.flip                  mean FLIP of the fast renderer's filtered view against the reference
  pictures.<fabric>.flip_unfiltered       the same before the filter
  pictures.<fabric>.flip_path_equal_time  the same of path tracing without a filter, in the time of the fast picture with its filter
  pictures.<fabric>.field_error           difference of the fast picture from the reference: root mean square over fields of 4 x 4 pixels and
                                          channels, over the mean of all channels; noise falls out by a second fast picture
  pictures.<fabric>.wall_s                seconds of a fast picture of 1,024 x 1,024 pixels that shows nothing but cloth, with its filter, on
                                          two cores: what does not grow with pixels is timed in a picture of 8 x 8
  pictures.<fabric>.precompute_s          processor seconds of the tables, over two cores
  pictures.filter.flip_ratio              FLIP of path tracing with 32 samples a pixel after the filter, over that before; mean of fabrics
"""
import argparse
import json
import os
import re
import subprocess
import sys

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, "..", "..", "support", "python"))
sys.path.insert(0, HERE)
from picture_flip import flip, python_with_flip  # noqa: E402
from six_fabrics import FABRIC, VIEW, document  # noqa: E402
from small_exr import read_exr  # noqa: E402

WHOLE_PX, CORES, FAST_SAMPLES, FILTERED_SAMPLES, TINY_PX = 1024, 2, 24, 32, 8
SHAPE = ["roll", "drape"]  # as in VIEW
# optimizer/report/surface/surface_tables.c: samples for a path of the fit, and the most paths
SAMPLES_OF_FIT, MOST_FIT = 1, 1 << 18


def crop_document(name, px, shapes, **picture):
    job = document(name, px, 1)
    views = [VIEW[SHAPE.index(s)] for s in shapes]
    job["pictures"] = [{**v, "width_mm": v["width_mm"] * px / WHOLE_PX, "px": px, **picture} for v in views]
    return job


def run(build, folder, job, seed):
    """Processor seconds of the job's pictures with their filter, of the tables for these, and of the fit. A finished folder is kept."""
    done = os.path.join(folder, "seconds.json")
    if not os.path.exists(done):
        os.makedirs(os.path.join(folder, "input"), exist_ok=True)
        job["fit"]["seed"] = seed
        with open(os.path.join(folder, "job.json"), "w", encoding="utf-8") as f:
            json.dump(job, f)
        subprocess.run([os.path.join(build, "bin", "selvedge-worker"), "--quiet", folder], check=True)
        with open(os.path.join(folder, "log.txt"), encoding="utf-8") as f:
            text = f.read()
        tables, fit = (sum(map(float, re.findall(rf"{what}: processor ([\d.]+) s", text))) for what in ("tables of light", "deep light fitted"))
        seconds = float(re.findall(r"report, pictures: [\d.]+ s, processor ([\d.]+) s", text)[-1]) - tables - fit
        with open(done, "w", encoding="utf-8") as f:
            json.dump([seconds, tables, fit], f)
    with open(done, encoding="utf-8") as f:
        return json.load(f)


def picture(folder, px, name="on-1"):
    with open(os.path.join(folder, "results", "pictures", f"{name}.exr"), "rb") as f:
        _, _, pixel = read_exr(f.read())
    return [pixel(x, y) for y in range(px) for x in range(px)]


def mean_of(picture_):
    return sum(map(sum, picture_)) / (3 * len(picture_))


def fields(values, px):
    """Means over 4 x 4 pixels."""
    return [[sum(values[(4 * j + v) * px + 4 * i + u][c] for v in range(4) for u in range(4)) / 16 for c in range(3)]
            for j in range(px // 4) for i in range(px // 4)]


def field_error(pictures, references, px):
    """By two pictures and two references, whose noise is independent, so that it falls out of the product of differences."""
    a, b, r, q = (fields(values, px) for values in (*pictures, *references))
    square = [(w - y) * (x - z) for f in zip(a, b, r, q) for w, x, y, z in zip(*f)]
    return max(0.0, sum(square) / len(square)) ** 0.5 / mean_of(references[0])


def print_figure(name, value, unit="", better="lower"):
    print(json.dumps({"name": f"pictures.{name}", "value": round(value, 4), "unit": unit, "better": better}), flush=True)


def bench(a, python, name):
    folder = os.path.join(a.build, "bench-looks", f"{name}-{a.px}")
    at = {shape: [os.path.join(folder, f"{shape}-reference-{a.reference}-{k}") for k in (1, 2)] for shape in SHAPE}
    sample_s = sum(run(a.build, half, crop_document(name, a.px, [shape], samples=a.reference // 2), seed=100 + k)[0]
                   for shape, halves in at.items() for k, half in enumerate(halves)) / a.reference
    traced = os.path.join(folder, "path")
    run(a.build, traced, crop_document(name, a.px, SHAPE, samples=FILTERED_SAMPLES, filter=True), seed=7)
    by_tables = {"samples": FAST_SAMPLES, "method": "fast", "deep_light_paths": a.deep_paths, "filter": True}
    fast = os.path.join(folder, f"fast-{a.deep_paths}")
    fast_s, precompute_s, fit_s = run(a.build, fast, crop_document(name, a.px, SHAPE + SHAPE, **by_tables), seed=9)
    tiny = {**by_tables, "deep_light_paths": 10000}
    fixed_s, _, _ = run(a.build, os.path.join(folder, "tiny"), crop_document(name, TINY_PX, SHAPE + SHAPE, **tiny), seed=9)
    fast_s, fit_s, fixed_s = fast_s / 2, fit_s / 2, fixed_s / 2
    whole_fit = max(1.0, MOST_FIT / (a.px ** 2 * FAST_SAMPLES // SAMPLES_OF_FIT))
    equal = max(1, round((fast_s - fixed_s + fit_s * whole_fit * (a.px / WHOLE_PX) ** 2) / sample_s))
    equal_time = os.path.join(folder, f"path-{equal}")
    run(a.build, equal_time, crop_document(name, a.px, SHAPE, samples=equal), seed=8)
    sums, of_fields = [0.0] * 5, 0.0
    for i, (shape, halves) in enumerate(at.items(), 1):
        parts = [picture(h, a.px) for h in halves]
        reference = [tuple((x + y) / 2 for x, y in zip(p, q)) for p, q in zip(*parts)]
        shown = [picture(fast, a.px, f"on-{i}-filtered"), picture(fast, a.px, f"on-{i}"), picture(equal_time, a.px, f"on-{i}"),
                 picture(traced, a.px, f"on-{i}-filtered"), picture(traced, a.px, f"on-{i}")]
        of = flip(python, a.px, reference, shown)
        sums = [x + y / len(at) for x, y in zip(sums, of)]
        of_field = field_error([shown[1], picture(fast, a.px, f"on-{i + len(at)}")], parts, a.px)
        of_fields += of_field / len(at)
        print(f"{name}, {shape}: {a.px} x {a.px} pixels ({(a.px / WHOLE_PX) ** 2:.2%} of the picture), reference of {a.reference} samples, FLIP of its "
              f"halves {flip(python, a.px, parts[0], [parts[1]])[0]:.4f}; fast {of[0]:.4f}, without filter {of[1]:.4f}, fields {of_field:.4f}; path "
              f"tracing with {equal} samples {of[2]:.4f}, with {FILTERED_SAMPLES} {of[4]:.4f}, filtered {of[3]:.4f}", file=sys.stderr)
    for what, value in zip(("flip", "flip_unfiltered", "flip_path_equal_time"), sums):
        print_figure(f"{name}.{what}", value)
    print_figure(f"{name}.field_error", of_fields)
    scaled_s = fixed_s + (fast_s - fixed_s) * (WHOLE_PX / a.px) ** 2 + fit_s * whole_fit
    print_figure(f"{name}.wall_s", scaled_s / len(SHAPE) / CORES, "s")
    print_figure(f"{name}.precompute_s", precompute_s / CORES, "s")
    return sums[3] / sums[4]


def main():
    p = argparse.ArgumentParser()
    p.add_argument("--build", required=True)
    p.add_argument("--px", type=int, default=64)
    p.add_argument("--reference", type=int, default=1024)
    p.add_argument("--deep-paths", type=int, default=8000000)
    p.add_argument("names", nargs="*")
    a = p.parse_args()
    python = python_with_flip(a.build)
    ratios = [bench(a, python, name) for name in a.names or FABRIC]
    print_figure("filter.flip_ratio", sum(ratios) / len(ratios))


main()
