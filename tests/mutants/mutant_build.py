"""The copy of the tree in build/mutants/tree, and its builds: `covered` counts the lines that run, `clean` is without a fault,
`faulty` has the present one."""
import os
import pathlib
import re
import shutil
import subprocess

ROOT = pathlib.Path(__file__).resolve().parents[2]
WORK = ROOT / "build" / "mutants"
TREE = WORK / "tree"
SANDBOX = TREE / "tests" / "mutants" / "sandbox.sh"  # the copy, so that the tree may change while faults are tried
PROGRAMS = ["selvedge", "selvedged", "selvedge-worker", "selvedge-phantom", "selvedge-camera"]
PLUGIN = "selvedge-postgresql.so"
FAULTY = ["-Werror=incompatible-pointer-types", "-Werror=int-conversion", "-Werror=array-bounds"]  # a fault may leave a variable unused


def copy_tree():
    """The files that git knows, as they are now; only what changed is written, so that objects stay valid."""
    listed = subprocess.run(["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"], cwd=ROOT, check=True,
                            stdout=subprocess.PIPE, text=True).stdout
    names = {n for n in listed.split("\0") if n and (ROOT / n).is_file()}
    for old in [p for p in TREE.rglob("*") if p.is_file() and p.relative_to(TREE).parts[0] not in ("build", ".git")]:
        if str(old.relative_to(TREE)) not in names:
            old.unlink()
    for name in names:
        source, target = ROOT / name, TREE / name
        if target.is_file() and target.read_bytes() == source.read_bytes():
            continue
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(source, target)
    subprocess.run(["git", "init", "-q"], cwd=TREE, check=True)  # checks of the documents ask git for the names of files


def clean_scratch(build):
    """Empties the folder that tests of this build have on /tmp."""
    shutil.rmtree(build.scratch, ignore_errors=True)
    build.scratch.mkdir(parents=True, exist_ok=True)


class Build:
    """One folder build/NAME of the copy."""

    def __init__(self, name, *variables):
        self.name, self.variables = name, variables
        self.path = TREE / "build" / name
        self.scratch = WORK / ("tmp-" + name)

    def make(self, *targets, options=()):
        command = ["make", "--no-print-directory", f"BUILD=build/{self.name}", *self.variables, *options, *targets]
        return subprocess.run(command, cwd=TREE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)

    def target(self, thing):
        """What make calls a test ("unit/base/test_rng") or a program ("selvedged")."""
        kind = "lib" if thing == PLUGIN else "bin" if thing in PROGRAMS else "tests"
        return f"build/{self.name}/{kind}/{thing}"

    def has(self, things, options=()):
        return self.make(*(self.target(t) for t in things), options=options)

    def objects_in(self, thing):
        """The sources ("upload.c") whose objects the linker took; only of a build with link maps."""
        text = (TREE / (self.target(thing) + ".map")).read_text(errors="replace")
        return {name[:-2] for name in re.findall(r"([\w.]+\.(?:c|cpp)\.o)\b", text)}


class Compiler:
    """Compiles faulty sources, and tells faults that do not compile or leave the object as it is."""

    def __init__(self, clean, name):
        self.clean = clean
        self.object = str(WORK / f"{name}.o")
        self.known = {}  # path -> (words of the command, object without a fault)

    def command(self, path):
        """As make compiles it, but at -O2 and without debugging information, which lines alone would change."""
        target = f"build/{self.clean.name}/obj/{'shared/' if path.endswith('_plugin.c') else ''}{path}.o"
        line = line_of(self.clean.make(target, options=["-n", "-W", path]).stdout, f"-c {path} ")
        words = [w for w in line.split() if w not in ("-g", "-O3", "-MMD", "-MP", "-Werror", "-c", path)]
        return words[:words.index("-o")] + FAULTY + ["-O2", "-o", self.object, "-c", "-x", "c", "-"]

    def run(self, path, words, text):
        """The object of a text in place of the file; None when it does not compile."""
        done = subprocess.run(words, cwd=TREE, input=f'# 1 "{path}"\n{text}', text=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                              check=False)
        return pathlib.Path(self.object).read_bytes() if done.returncode == 0 else None

    def verdict(self, path, original, mutated):
        """"invalid", "equivalent" or None; then `object` has the fault."""
        if path not in self.known:
            words = self.command(path)
            self.known[path] = (words, self.run(path, words, original))
        words, before = self.known[path]
        if before is None:
            raise RuntimeError(f"'{path}' does not compile without a fault")
        after = self.run(path, words, mutated)
        return "invalid" if after is None else "equivalent" if after == before else None


class Linker:
    """Links what is in the build `clean` with a faulty object in place of the sound one, into the build `faulty`."""

    def __init__(self, clean, faulty):
        self.clean, self.faulty = clean, faulty
        self.known = {}  # thing -> words of the command

    def command(self, thing):
        if thing not in self.known:
            target = self.clean.target(thing)
            plan = self.clean.make(target, options=["-n", "-W", f"build/{self.clean.name}/lib/libbase.a", "-W", "base/utf8.c"])
            self.known[thing] = line_of(plan.stdout, f"-o {target} ").split()
        return self.known[thing]

    def link(self, thing, path, made):
        """Returns whether it could be linked. An object that stands before the archives keeps them from giving theirs."""
        target = self.faulty.target(thing)
        words = [target if w == self.clean.target(thing) else w for w in self.command(thing)]
        named = [i for i, w in enumerate(words) if w.endswith(f"/{path}.o")]
        place = words.index(target) + 1
        words = [made if i in named else w for i, w in enumerate(words)] if named else words[:place] + [made] + words[place:]
        (TREE / target).parent.mkdir(parents=True, exist_ok=True)
        return subprocess.run(words, cwd=TREE, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=False).returncode == 0

    def restore(self, things):
        """The sound programs again."""
        for thing in things:
            source, target = TREE / self.clean.target(thing), TREE / self.faulty.target(thing)
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(source, target)


def line_of(plan, wanted):
    line = next((x for x in plan.splitlines() if wanted in x), None)
    if line is None:
        raise RuntimeError(f"make says no command with '{wanted}':\n{plan}")
    return line


def check_script(path, mutated):
    """The same for a file that is not compiled."""
    if path.endswith(".py"):
        try:
            compile(mutated, path, "exec")
        except SyntaxError:
            return "invalid"
        return None
    if shutil.which("node") is None:
        return None
    probe = WORK / "probe.mjs"
    probe.write_text(mutated)
    return None if subprocess.run(["node", "--check", probe], stderr=subprocess.DEVNULL, check=False).returncode == 0 else "invalid"


def data_folder():
    return os.path.realpath(os.environ.get("SELVEDGE_DATA") or ROOT / ".." / "shared" / "data")
