"""Files as other programs write them, read by our readers and compared with those programs' values. Prints figures files.zoo.*, one JSON
object on a line.

    zoo.py --reader PROGRAM [--keep FOLDER] [NAME ...]

PROGRAM: tests/zoo/read_files.c, built with sanitizers by `make zoo-reader`. NAME: parts of names of files; default: all. Every file is
right (samples and statements agree), refused (with a message) or silent (read with other values, a statement is missing, or accepted where
it should be refused). Standard error lists faults: silent files, those refused that should be read, and refusals that do not name what they
should. Exit status 1 when there is a fault or the reader died, 2 when a package is missing.
"""
import argparse
import json
import os
import subprocess
import sys
import tempfile

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
try:
    import numpy
    from specimen import Refused, beside
    from zoo_arrays import arrays
    from zoo_containers import containers
    from zoo_photographs import photographs
    from zoo_scans import scans
    from zoo_variants import variants
except ImportError as missing:
    print(f"zoo: {missing.name or missing} is not installed", file=sys.stderr)
    sys.exit(2)


def differs(said, wanted):
    """Whether a field of the answer is another than the right one. None within a list: not compared."""
    if isinstance(wanted, list):
        return not isinstance(said, list) or len(said) != len(wanted) or any(w is not None and differs(s, w) for s, w in zip(said, wanted))
    if isinstance(wanted, float):
        return said is None or abs(said - wanted) > 1e-3 * abs(wanted)
    return said != wanted


def fault_of(said, right, path):
    """Returns "" or why the answer is not the right one."""
    wanted = numpy.asarray(right.values, dtype=float)
    values = numpy.fromfile(path + ".values", dtype="<f4").astype(float)
    if values.size != wanted.size:
        return f"{values.size} samples of {said['size']}, right are {wanted.shape}"
    most = numpy.abs(values - wanted.ravel()).max()
    if not most <= right.tolerance * max(numpy.abs(wanted).max(), 1e-30):
        at = int(numpy.abs(values - wanted.ravel()).argmax())
        return f"sample {at} is {values[at]:.6g}, right is {wanted.ravel()[at]:.6g}"
    for name, use in right.stated.items():
        found = [s for s in said["files"] if s["name"] == name]
        if not found or (use is not None and found[0]["use"] != use):
            return f"statement '{name}' {'is missing' if not found else 'is ' + found[0]['use']}, ledger: {said['files']}"
    for name, value in right.fields.items():
        if differs(said[name], value):
            return f"{name} is {said[name]}, right is {value}"
    return ""


def judge(specimen, said, wanted, path):
    """Returns ("right" | "refused" | "silent", fault or "")."""
    if isinstance(wanted, Refused):
        if "refused" not in said:
            return "silent", f"read, should be refused with {wanted.words}: {json.dumps(said)[:300]}"
        lost = [w for w in wanted.words if w.lower() not in said["refused"].lower()]
        return "refused", f"the message lacks {lost}: {said['refused']}" if lost else ""
    if "refused" in said:
        return "refused", said["refused"]
    why = fault_of(said, wanted, path)
    return ("silent", why) if why else ("right", "")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--reader", required=True)
    parser.add_argument("--keep")
    parser.add_argument("name", nargs="*")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        folder = arguments.keep or scratch
        os.makedirs(folder, exist_ok=True)
        zoo = [s for s in [*scans(), *arrays(), *containers(), *photographs(), *variants()] if not arguments.name or any(n in s.name for n in arguments.name)]
        paths = [os.path.join(folder, s.name) for s in zoo]
        assert len(set(paths)) == len(paths), "two files of one name"
        wanted = [s.make(p) for s, p in zip(zoo, paths)]
        lines = "".join("\t".join((s.kind, p, *s.how, *(beside(p, i) for i in range(1, s.parts)))) + "\n" for s, p in zip(zoo, paths))
        done = subprocess.run([arguments.reader], input=lines, capture_output=True, text=True, check=False)
        answers = [json.loads(line) for line in done.stdout.splitlines()]
        if done.returncode != 0 or len(answers) != len(zoo):
            died = zoo[len(answers)].name if len(answers) < len(zoo) else "the end"
            print(f"zoo: the reader ended with {done.returncode} at {died}:\n{done.stderr[-3000:]}", file=sys.stderr)
            return 1
        verdicts = [judge(*case) for case in zip(zoo, answers, wanted, paths)]
    for specimen, (verdict, why) in zip(zoo, verdicts):
        if why:
            print(f"{verdict} {specimen.name}: {why}", file=sys.stderr)
    for verdict, better in (("right", "higher"), ("refused", "lower"), ("silent", "lower")):
        print(json.dumps({"name": f"files.zoo.{verdict}", "value": sum(v == verdict for v, _ in verdicts), "unit": "files", "better": better}))
    return 1 if any(why for _, why in verdicts) else 0


if __name__ == "__main__":
    sys.exit(main())
