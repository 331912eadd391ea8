"""Pictures of the six fabrics as they look: bench_looks.py --build DIR [--px N] [--reference N] [--deep-paths N] [NAME ...]

The fabrics are those of six_fabrics.py, draped. A picture of 1,024 x 1,024 pixels with 4,096 samples takes some 24 hours of a
processor, so that the middle N x N of its pixels (--px) are rendered, path by path with so many samples (--reference), once, and kept in
DIR/bench-looks. Their own noise, and FLIP between the pictures of two references that are rendered apart, are printed to standard error.

  pictures.<fabric>.flip                  mean FLIP of the fast renderer's filtered view against the reference
  pictures.<fabric>.flip_path_equal_time  the same of path tracing without a filter, in the time of the fast picture with its filter
  pictures.<fabric>.field_error           difference of the fast picture from the reference: root mean square over fields of 4 x 4 pixels,
                                          over the mean, less the noise of both
  pictures.<fabric>.wall_s                seconds of the fast picture with its filter, times the pixels of 1,024 x 1,024 over those of
                                          the crop, over two cores
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

WHOLE_PX, CORES, FAST_SAMPLES, FILTERED_SAMPLES = 1024, 2, 32, 32


def crop_document(name, px, **picture):
    job = document(name, px, 1)
    view = VIEW[1]
    job["pictures"] = [{**view, "width_mm": view["width_mm"] * px / WHOLE_PX, "px": px, **picture}]
    return job


def run(build, folder, job, seed):
    """Processor seconds of the job's pictures with their filter, and of the tables for these. A finished folder is kept."""
    done = os.path.join(folder, "seconds.json")
    if os.path.exists(done):
        with open(done, encoding="utf-8") as f:
            return json.load(f)
    os.makedirs(os.path.join(folder, "input"), exist_ok=True)
    job["fit"]["seed"] = seed
    with open(os.path.join(folder, "job.json"), "w", encoding="utf-8") as f:
        json.dump(job, f)
    subprocess.run([os.path.join(build, "bin", "selvedge-worker"), "--quiet", folder], check=True)
    with open(os.path.join(folder, "log.txt"), encoding="utf-8") as f:
        text = f.read()
    tables = sum(map(float, re.findall(r"tables of light: processor ([\d.]+) s", text)))
    seconds = float(re.findall(r"report, pictures: [\d.]+ s, processor ([\d.]+) s", text)[-1]) - tables, tables
    with open(done, "w", encoding="utf-8") as f:
        json.dump(seconds, f)
    return seconds


def picture(folder, px, name="on-1", prefix=""):
    with open(os.path.join(folder, "results", "pictures", f"{name}.exr"), "rb") as f:
        _, _, pixel = read_exr(f.read(), prefix)
    return [pixel(x, y) for y in range(px) for x in range(px)]


def mean_of(picture_):
    return sum(map(sum, picture_)) / (3 * len(picture_))


def fields(values, px):
    """Means over 4 x 4 pixels and, of variances, their variances over 16."""
    return [[sum(values[(4 * j + v) * px + 4 * i + u][c] for v in range(4) for u in range(4)) / 16 for c in range(3)]
            for j in range(px // 4) for i in range(px // 4)]


def field_error(a, var_a, b, var_b, px):
    square = [(x - y) ** 2 for p, q in zip(fields(a, px), fields(b, px)) for x, y in zip(p, q)]
    noise = [(x + y) / 16 for p, q in zip(fields(var_a, px), fields(var_b, px)) for x, y in zip(p, q)]
    return max(0.0, sum(square) / len(square) - sum(noise) / len(noise)) ** 0.5 / mean_of(b)


def print_figure(name, value, unit="", better="lower"):
    print(json.dumps({"name": f"pictures.{name}", "value": round(value, 4), "unit": unit, "better": better}), flush=True)


def bench(a, python, name):
    folder = os.path.join(a.build, "bench-looks", f"{name}-{a.px}")
    halves = [os.path.join(folder, f"reference-{a.reference}-{k}") for k in (1, 2)]
    for k, half in enumerate(halves):
        run(a.build, half, crop_document(name, a.px, samples=a.reference // 2), seed=100 + k)
    parts, variances = [picture(h, a.px) for h in halves], [picture(h, a.px, prefix="var.") for h in halves]
    reference = [tuple((x + y) / 2 for x, y in zip(p, q)) for p, q in zip(*parts)]
    variance = [tuple((x + y) / 4 for x, y in zip(p, q)) for p, q in zip(*variances)]
    traced = os.path.join(folder, "path")
    traced_s, _ = run(a.build, traced, crop_document(name, a.px, samples=FILTERED_SAMPLES, filter=True), seed=7)
    fast = os.path.join(folder, f"fast-{a.deep_paths}")
    by_tables = {"samples": FAST_SAMPLES, "method": "fast", "deep_light_paths": a.deep_paths, "filter": True}
    fast_s, precompute_s = run(a.build, fast, crop_document(name, a.px, **by_tables), seed=9)
    equal = max(1, round(FILTERED_SAMPLES * fast_s / traced_s))
    equal_time = os.path.join(folder, f"path-{equal}")
    run(a.build, equal_time, crop_document(name, a.px, samples=equal), seed=8)
    shown = [picture(fast, a.px, "on-1-filtered"), picture(equal_time, a.px), picture(traced, a.px), picture(traced, a.px, "on-1-filtered"),
             picture(fast, a.px)]
    of = flip(python, a.px, reference, shown)
    floor = flip(python, a.px, parts[0], [parts[1]])[0]
    noise = (sum(map(sum, variance)) / (3 * len(variance))) ** 0.5 / mean_of(reference)
    print(f"{name}: reference {a.px} x {a.px} pixels ({(a.px / WHOLE_PX) ** 2:.2%} of the picture), {a.reference} samples, noise {noise:.3f}, "
          f"FLIP of its halves {floor:.4f}; fast without filter {of[4]:.4f}; path tracing with {FILTERED_SAMPLES} samples {of[2]:.4f}, filtered "
          f"{of[3]:.4f}; {equal} samples at equal time", file=sys.stderr)
    print_figure(f"{name}.flip", of[0])
    print_figure(f"{name}.flip_path_equal_time", of[1])
    print_figure(f"{name}.field_error", field_error(picture(fast, a.px), picture(fast, a.px, prefix="var."), reference, variance, a.px))
    print_figure(f"{name}.wall_s", fast_s * (WHOLE_PX / a.px) ** 2 / CORES, "s")
    print_figure(f"{name}.precompute_s", precompute_s / CORES, "s")
    return of[3] / of[2]


def main():
    p = argparse.ArgumentParser()
    p.add_argument("--build", required=True)
    p.add_argument("--px", type=int, default=64)
    p.add_argument("--reference", type=int, default=4096)
    p.add_argument("--deep-paths", type=int, default=8000000)
    p.add_argument("names", nargs="*")
    a = p.parse_args()
    python = python_with_flip(a.build)
    ratios = [bench(a, python, name) for name in a.names or FABRIC]
    print_figure("filter.flip_ratio", sum(ratios) / len(ratios))


main()
