"""How well do progress and remaining time hold? Prints figures progress.* of real jobs, from their status.json while they run.

    bench_progress.py [--build DIR] [--data DIR] [--threads N] [--keep DIR] [--cpu-clock] [demo] [fiber_ct] [weave_ct] [fleece]

Of each job: worst_eta_ratio_after_10pct, the largest factor by which the true remaining time lies outside of what users read, from a tenth of the
wall time on, while at least a twentieth of it and 3 s remain. Users read a range where the time is not known within a quarter, and the time
otherwise. worst_point_ratio_after_10pct is the same of the single time that stands in the middle of each range; largest_jump that of the stated
fraction between two looks. On a machine that others use, too, the remaining wall time depends on what they do: cpu_worst_eta_ratio_after_10pct and
cpu_worst_point_ratio_after_10pct are the same factors in processor time, of the stated time at the share of the processors that the job has had so
far, and of the processor time that it took from there on. cpu_inside_range_share, cpu_median_range and cpu_widest_range say how wide ranges are: the
share of looks where the truth lies in them (25 % either way where none is stated), and the median and largest factor between their ends.

Wall and processor time of every stage go to standard error. Each job runs twice on the same folder of remembered speeds, as it would on a machine
that has run jobs before; the figures with "first" in their name are of the first run, on a machine that knows nothing. --keep keeps the jobs with
their records.
"""
import argparse
import contextlib
import json
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.path.insert(0, os.path.join(ROOT, "tests", "real"))
import real_jobs  # noqa: E402  pylint: disable=wrong-import-position

LOOK_S = 0.4
NAMES = ["demo", "fiber_ct", "weave_ct", "fleece"]
FROM, REST_SHARE, REST_S = 0.1, 0.05, 3.0


def program(arguments, name):
    return os.path.join(ROOT, arguments.build, "bin", name)


def phantom(arguments, *command):
    subprocess.run([program(arguments, "selvedge-phantom"), *map(str, command)], check=True, stdout=subprocess.DEVNULL)


def demo_sample(arguments, folder):
    """The sample of `make demo`, with fewer paths in its photographs."""
    phantom(arguments, "cloth", "--weave", "twill", "--seed", 7, "--out", folder)
    phantom(arguments, "photograph", "--fibers", f"{folder}/truth.hair", "--out", folder, "--seed", 11, "--noise", 0.005, "--paths", 32768,
            "--px", 64, "--param", "C_R=0.06,0.05,0.08", "--param", "C_TT=0.72,0.55,0.35", "--param", "beta_R=4", "--param", "beta_TT=20",
            "--param", "gamma_TT=18")
    subprocess.run([sys.executable, "-c", "import sys; sys.path.insert(0, 'clients'); import demo_report; demo_report.document(*sys.argv[1:])",
                    folder, "twill phantom"], check=True, cwd=ROOT)


def fleece_sample(arguments, folder):
    """A scan of the size of the published Fleece (520 x 520 x 590 voxels), of which only the fibers are traced."""
    phantom(arguments, "cloth", "--weave", "felt", "--fibers-per-yarn", 1600, "--diameter-voxel", 5, "--felt-tile-um", 1040,
            "--felt-thickness-um", 1100, "--seed", 3, "--out", folder)
    with open(os.path.join(folder, "phantom.json"), encoding="utf-8") as f:
        voxel_um = json.load(f)["cloth"]["voxel_size_um"]
    with open(os.path.join(folder, "job.json"), "w", encoding="utf-8") as f:
        json.dump({"sample": "fleece phantom", "volume": {"files": ["scan.tif"], "voxel_size_um": voxel_um}}, f)


def sample_of(arguments, name, folder):
    """Makes FOLDER/job.json and its input files."""
    os.makedirs(folder)
    if name == "demo":
        demo_sample(arguments, folder)
    elif name == "fleece":
        fleece_sample(arguments, folder)
    else:
        document, files = real_jobs.JOBS[name]
        shutil.copy(os.path.join(ROOT, "config", "examples", document), os.path.join(folder, "job.json"))
        for file in files:
            shutil.copy(os.path.join(arguments.data, file), folder)


def make_job(sample, job):
    os.makedirs(os.path.join(job, "input"))
    shutil.copy(os.path.join(sample, "job.json"), job)
    for name in os.listdir(sample):
        if name != "job.json":
            os.link(os.path.join(sample, name), os.path.join(job, "input", name))


def cpu_of(pid):
    """Processor seconds that a process has taken with all its threads; None when it is gone."""
    try:
        with open(f"/proc/{pid}/stat", encoding="utf-8") as f:
            word = f.read().rsplit(")", 1)[1].split()
    except OSError:
        return None
    return (int(word[11]) + int(word[12])) / os.sysconf("SC_CLK_TCK")


def show_stages(looks):
    """Prints how long each stage took, to the resolution of the looks."""
    first = {}
    for t, cpu_s, look in looks:
        first.setdefault(look["stage"], (t, cpu_s))
    ends = [*list(first.values())[1:], (looks[-1][0], looks[-1][1])]
    for (stage, begin), end in zip(first.items(), ends):
        print(f"stage {stage}: {end[0] - begin[0]:.1f} s, processor {end[1] - begin[1]:.1f} s", file=sys.stderr)


def cpu_clock(arguments):
    """Environment in which a program's clock is its processor time."""
    library = os.path.join(ROOT, arguments.build, "cpu_clock.so")
    source = os.path.join(os.path.dirname(os.path.abspath(__file__)), "clock", "cpu_clock.c")
    subprocess.run(["cc", "-O2", "-shared", "-fPIC", "-o", library, source], check=True)
    return dict(os.environ, LD_PRELOAD=library, CPU_CLOCK_THREADS=str(arguments.threads))


def record(arguments, job, speeds):
    """Runs the job; [(seconds since the start, processor seconds, status.json)] at every look, and its wall time."""
    looks, start = [], time.monotonic()
    command = [program(arguments, "selvedge-worker"), "--quiet", "--speeds", speeds, "--threads", str(arguments.threads), job]
    if arguments.cpu_clock:
        command[1:1] = ["--sandbox", "off"]  # a worker in its sandbox starts without the library
    with subprocess.Popen(command, env=cpu_clock(arguments) if arguments.cpu_clock else None) as worker:
        while worker.poll() is None:
            time.sleep(LOOK_S)
            with contextlib.suppress(OSError, ValueError), open(os.path.join(job, "status.json"), encoding="utf-8") as f:
                look, cpu_s = json.load(f), cpu_of(worker.pid)
                if cpu_s is not None:
                    looks.append((cpu_s / arguments.threads if arguments.cpu_clock else time.monotonic() - start, cpu_s, look))
    wall_s = looks[-1][0] if arguments.cpu_clock else time.monotonic() - start
    if worker.returncode != 0:
        sys.exit(f"bench_progress: the worker ended with {worker.returncode} on {job}")
    with open(os.path.join(job, "looks.json"), "w", encoding="utf-8") as f:
        json.dump([(t, cpu_s, *(look.get(key) for key in ("stage", "stage_fraction", "fraction", "eta_s", "eta_low_s", "eta_high_s")))
                   for t, cpu_s, look in looks], f)
    show_stages(looks)
    return looks, wall_s


def judged(looks, i_clock):
    """(true remaining time, look, stated seconds to those of the clock) of the looks that count; the clock is 0: wall time, 1: processor time."""
    total = looks[-1][i_clock]
    for look in looks:
        rest = total - look[i_clock]
        if look[i_clock] >= FROM * total and rest >= max(REST_SHARE * total, REST_S) and look[2]["state"] == "running":
            yield rest, look[2], look[i_clock] / look[0]


def off(rest, low, high):
    """Factor by which the truth lies outside of what is stated."""
    return max(1.0, rest / max(high, 1e-3), low / rest)


def worst_printed(looks, i_clock):
    """Largest factor of what users read: the range where one is stated, the time otherwise."""
    worst = 1.0
    for rest, look, scale in judged(looks, i_clock):
        if look["eta_s"] is None:
            return float("inf")
        low, high = (look["eta_low_s"], look["eta_high_s"]) if look["eta_low_s"] is not None else (look["eta_s"],) * 2
        worst = max(worst, off(rest, low * scale, high * scale))
    return worst


def worst_point(looks, i_clock):
    """Largest factor of the single time, also where users read a range."""
    return max((off(rest, look["eta_s"] * scale, look["eta_s"] * scale) if look["eta_s"] is not None else float("inf")
                for rest, look, scale in judged(looks, i_clock)), default=1.0)


def ranges(looks):
    """Share of the looks whose range has the true remaining processor time, median and largest factor between the ends of a range."""
    inside, widths = [], []
    for rest, look, scale in judged(looks, 1):
        if look["eta_s"] is None:
            continue
        low, high = (look["eta_low_s"], look["eta_high_s"]) if look["eta_low_s"] is not None else (look["eta_s"] / 1.25, look["eta_s"] * 1.25)
        inside.append(low * scale <= rest <= high * scale)
        widths.append(high / max(low, 1e-3))
    return sum(inside) / max(len(inside), 1), statistics.median(widths or [1.0]), max(widths, default=1.0)


def largest_jump(looks):
    """Largest change between two looks while the job runs; a step backwards counts as an infinite one."""
    fractions = [look["fraction"] for _, _, look in looks if look["state"] == "running"]
    steps = [b - a for a, b in zip([0.0] + fractions, fractions)]
    return float("inf") if min(steps, default=0.0) < 0.0 else max(steps, default=0.0)


def figure(name, value, unit, better="lower"):
    print(json.dumps({"name": f"progress.{name}", "value": round(value, 4), "unit": unit, "better": better}), flush=True)


def bench(arguments, name, folder, speeds):
    sample = os.path.join(folder, f"{name}-sample")
    if not os.path.exists(sample):
        sample_of(arguments, name, sample)
    for run in ("first.", ""):
        job = os.path.join(folder, f"{name}-{run}job")
        shutil.rmtree(job, ignore_errors=True)
        make_job(sample, job)
        looks, wall_s = record(arguments, job, speeds)
        for i_clock, clock in enumerate(("", "cpu_")):
            figure(f"{name}.{run}{clock}worst_eta_ratio_after_10pct", worst_printed(looks, i_clock), "1")
            figure(f"{name}.{run}{clock}worst_point_ratio_after_10pct", worst_point(looks, i_clock), "1")
        inside, median, widest = ranges(looks)
        figure(f"{name}.{run}cpu_inside_range_share", inside, "1", "higher")
        figure(f"{name}.{run}cpu_median_range", median, "1")
        figure(f"{name}.{run}cpu_widest_range", widest, "1")
        figure(f"{name}.{run}largest_jump", largest_jump(looks), "1")
        figure(f"{name}.{run}wall_s", wall_s, "s")
        figure(f"{name}.{run}cpu_s", looks[-1][1], "s")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", default="build")
    parser.add_argument("--data", default=real_jobs.DATA)
    parser.add_argument("--threads", type=int, default=os.cpu_count())
    parser.add_argument("--keep")
    parser.add_argument("--cpu-clock", action="store_true")
    parser.add_argument("name", nargs="*", choices=NAMES + [[]])
    arguments = parser.parse_args()
    with contextlib.ExitStack() as stack:
        folder = arguments.keep or stack.enter_context(tempfile.TemporaryDirectory())
        os.makedirs(folder, exist_ok=True)
        for name in arguments.name or NAMES:
            bench(arguments, name, folder, os.path.join(folder, f"{name}-speeds.json"))


if __name__ == "__main__":
    main()
