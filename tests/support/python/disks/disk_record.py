"""Records what a program and its children do to the files of one folder, in order, with strace.

with strace_wrapper(path) as the wrapper of a program, read_record(path, folder) returns Call objects. -xx prints all
texts in hexadecimal, -T the time each call took, and -D keeps the program the child of who started it.
"""
import os
import re
import shutil
import subprocess
from dataclasses import dataclass, field

import pytest

CHANGES = ("open,openat,creat,write,pwrite64,writev,pwritev,pwritev2,ftruncate,truncate,fallocate,rename,renameat,renameat2,"
           "link,linkat,symlink,symlinkat,unlink,unlinkat,mkdir,mkdirat,rmdir")
OTHERS = "fsync,fdatasync,syncfs,lseek,sendfile,copy_file_range,splice,clone,clone3,fork,vfork"
LINE = re.compile(r"^(\d+) +(\d+\.\d+) (.*)$")
CALL = re.compile(r"^(\w+)\((.*)\) += (-?\d+|\?)(.*?)(?: <(\d+\.\d+)>)?$")
TEXT = re.compile(r'"((?:\\x[0-9a-f]{2})*)"(\.\.\.)?')
DESCRIPTOR = re.compile(r"(-?\d+|AT_FDCWD)<((?:\\x[0-9a-f]{2})*)>(\(deleted\))?")


def strace_wrapper(path):
    """Returns the words to put before a command, or skips the test where programs cannot be traced."""
    if shutil.which("strace") is None:
        pytest.skip("strace is not installed")
    if subprocess.run(["strace", "-o", os.devnull, "true"], capture_output=True).returncode != 0:
        pytest.skip("programs cannot be traced here (ptrace is not permitted)")
    return ["strace", "-D", "-f", "--seccomp-bpf", "-q", "-ttt", "-T", "-y", "-xx", "-s", "100000000", "-e", "signal=none",
            "-e", f"trace={CHANGES},{OTHERS}", "-o", str(path)]


def unhex(text):
    return bytes.fromhex(text.replace("\\x", ""))


@dataclass
class Call:
    """One call that succeeded: its times, its name, paths below the folder (b"" is the folder), offset and bytes."""
    begin_s: float
    end_s: float
    name: str
    path: bytes = b""
    target: bytes = b""
    offset: int = 0
    data: bytes = b""
    flags: frozenset = field(default_factory=frozenset)


def joined_lines(path):
    """Yields (process, begin_s, end_s, text) for each call, with the two parts of interrupted ones joined."""
    waiting = {}
    with open(path, encoding="ascii") as f:
        for line in f:
            m = LINE.match(line.rstrip("\n"))
            if m is None:
                continue
            process, time_s, text = int(m[1]), float(m[2]), m[3]
            if text.endswith("<unfinished ...>"):
                waiting[process] = time_s, text[:-len("<unfinished ...>")].rstrip()
            elif text.startswith("<... "):
                begin_s, head = waiting.pop(process)
                yield process, begin_s, time_s, head + text.split("resumed>", 1)[1]
            else:
                m = re.search(r"<(\d+\.\d+)>$", text)
                yield process, time_s, time_s + (float(m[1]) if m else 0.0), text


class Positions:
    """The position of each open file. Threads share descriptors, and a new process has a copy of them."""

    def __init__(self, lines):
        self.group = {}
        self.at = {}  # (group, descriptor) -> position, or None for O_APPEND
        for process, _, _, text in lines:
            if re.match(r"(clone|clone3|fork|vfork)\(", text):
                child = int(re.search(r"= (-?\d+)", text)[1])
                if child > 0:
                    self.group[child] = (process, "CLONE_THREAD" in text)

    def of(self, process):
        parent = self.group.get(process)
        return process if parent is None or not parent[1] else self.of(parent[0])

    def inherited(self, process, descriptor):
        """Returns the key under which the position is kept: that of the process, or of one that it was forked from."""
        while True:
            key = self.of(process), descriptor
            parent = self.group.get(key[0])
            if key in self.at or parent is None:
                return key
            process = parent[0]


class Reader:
    def __init__(self, path, folder, size):
        self.folder = os.path.realpath(folder).encode()
        lines = list(joined_lines(path))
        self.positions = Positions(lines)
        self.size = dict(size)  # path -> size, for the end of files
        self.calls = [c for c in (self.read(*line) for line in lines) if c is not None]

    def below(self, path):
        """Returns the path below the folder, or None."""
        path = os.path.normpath(path)
        if path == self.folder:
            return b""
        return path[len(self.folder) + 1:] if path.startswith(self.folder + b"/") else None

    def named(self, args):
        """Returns all paths that the arguments name, relative ones joined to the folder before them."""
        found, base = [], os.getcwd().encode()
        for m in re.finditer(f"{DESCRIPTOR.pattern}|{TEXT.pattern}", args):
            if m[1] is not None:
                base = unhex(m[2])
            else:
                found.append(self.below(os.path.join(base, unhex(m[4]))))
        return found

    def read(self, process, begin_s, end_s, text):
        m = CALL.match(text)
        if m is None or m[3] == "?" or int(m[3]) < 0:
            return None
        name, args, value, rest = m[1], m[2], int(m[3]), m[4]
        times = begin_s, end_s
        if name in ("open", "openat", "creat"):
            return self.opened(process, times, args, value, rest)
        if name.startswith(("rename", "link", "symlink", "unlink", "mkdir", "rmdir", "truncate")):
            return self.renamed(times, name, args)
        return self.written(process, times, name, args, value)

    def opened(self, process, times, args, value, rest):
        m = DESCRIPTOR.match(f"{value}{rest}")
        path = self.below(unhex(m[2])) if m else None
        if path is None:
            return None
        flags = frozenset(re.findall(r"O_\w+", args))
        key = self.positions.of(process), value
        self.positions.at[key] = None if "O_APPEND" in flags else 0
        if "O_TRUNC" in flags:
            self.size[path] = 0
        return Call(*times, "open", path, flags=flags) if flags & {"O_CREAT", "O_TRUNC"} else None

    def renamed(self, times, name, args):
        path = self.named(args)
        if all(p is None for p in path):
            return None
        if name == "truncate" or name.startswith("symlink") or None in path or "RENAME_EXCHANGE" in args:
            raise NotImplementedError(f"{name}({args[:200]})")
        plain = "rmdir" if "AT_REMOVEDIR" in args else re.sub("at2?$", "", name)
        if plain == "rename":
            for old in [old for old in self.size if old == path[0] or old.startswith(path[0] + b"/")]:
                self.size[path[1] + old[len(path[0]):]] = self.size.pop(old)
        elif plain == "link":
            self.size[path[1]] = self.size.get(path[0], 0)
        elif plain == "unlink":
            self.size.pop(path[0], None)
        return Call(*times, plain, path[0], path[1] if len(path) > 1 else b"")

    def written(self, process, times, name, args, value):
        m = DESCRIPTOR.match(args)
        path = self.below(unhex(m[2])) if m and not m[3] else None
        if path is None:
            return None
        key = self.positions.inherited(process, int(m[1]))
        if name in ("fsync", "fdatasync", "syncfs"):
            return Call(*times, "sync", path, flags=frozenset({"all"} if name == "syncfs" else ()))
        if name == "lseek":
            if self.positions.at.get(key, 0) is not None:
                self.positions.at[key] = value
            return None
        if name == "ftruncate":
            size = int(args.rsplit(",", 1)[1])
            self.size[path] = size
            return Call(*times, "size", path, offset=size)
        if name == "fallocate":
            size = sum(int(a) for a in args.rsplit(",", 2)[1:])
            if "FALLOC_FL_KEEP_SIZE" in args:
                return None
            if not re.search(r", 0, \d+, \d+$", args):
                raise NotImplementedError(f"fallocate({args[-100:]})")
            return Call(*times, "size", path, offset=size) if self.grown(path, size) else None
        if name not in ("write", "pwrite64", "writev", "pwritev", "pwritev2"):
            raise NotImplementedError(f"{name}({args[:200]})")
        texts = TEXT.findall(args)
        assert not any(t[1] for t in texts), "strace has cut off what was written"
        data = b"".join(unhex(t[0]) for t in texts)[:value]
        offset = self.place(key, path, name, args, len(data))
        self.grown(path, offset + len(data))
        return Call(*times, "write", path, offset=offset, data=data)

    def grown(self, path, size):
        """Whether the file becomes larger."""
        before = self.size.get(path, 0)
        self.size[path] = max(before, size)
        return size > before

    def place(self, key, path, name, args, n_bytes):
        if name.startswith("p"):
            return int(args.split(", ")[-2 if name == "pwritev2" else -1])
        at = self.positions.at.get(key)
        offset = self.size.get(path, 0) if at is None else at
        if at is not None:
            self.positions.at[key] = offset + n_bytes
        return offset


def read_record(path, folder, size=()):
    """Returns the calls that changed or synced something below the folder, in the order of their ends.

    size: path -> size of the files that were there before. NotImplementedError: a call that this module cannot replay."""
    return sorted(Reader(path, folder, size).calls, key=lambda c: c.end_s)
