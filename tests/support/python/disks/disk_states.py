"""What a disk may hold after a power cut, from a record of calls (disk_record.py).

A sync of a file makes its bytes and its size durable, and a sync of a folder its entries. Everything else may be there
or not: writes in any selection of sectors, changes of entries in their order. A rename is there as a whole or not at
all, as on every file system with a journal, until one of its two folders is synced: that makes the half in this folder
durable and nothing else, because POSIX promises no more. So the folder that receives an entry must be synced first.
"""
import os
import shutil

SECTOR_BYTES = 512


class File:
    def __init__(self):
        self.durable, self.pending = bytearray(), []  # pending: (end_s, offset, data or None for a new size)

    def apply(self, until_s):
        """Makes durable what ended before this time."""
        late = [p for p in self.pending if p[0] > until_s]
        for _, offset, data in (p for p in self.pending if p[0] <= until_s):
            put(self.durable, offset, data)
        self.pending = late

    def bytes(self, keep):
        content = bytearray(self.durable)
        for _, offset, data in self.pending:
            for start, part in sectors(offset, data):
                if keep():
                    put(content, start, part)
        return content


def sectors(offset, data):
    """Yields the pieces of a write that a disk writes as a whole."""
    if data is None:
        yield offset, None
        return
    end = offset + len(data)
    while offset < end:
        next_ = min(end, (offset // SECTOR_BYTES + 1) * SECTOR_BYTES)
        yield offset, data[len(data) - (end - offset):len(data) - (end - next_)]
        offset = next_


def put(content, offset, data):
    if data is None:
        del content[offset:]
    end = offset + len(data or b"")
    content.extend(bytes(max(0, end - len(content))))
    if data is not None:
        content[offset:end] = data


class Folder:
    def __init__(self):
        self.now, self.durable = {}, {}


class Disk:
    def __init__(self):
        self.root = Folder()
        self.files = []
        self.pending = []  # changes of entries that no sync covers: lists of (folder, name, node or None)

    def new_file(self):
        self.files.append(File())
        return self.files[-1]

    def load(self, path, folder=None):
        """Takes over what is in a folder, as durable. Returns path -> size of all files."""
        folder, size = folder or self.root, {}
        for entry in os.scandir(os.fsencode(path)):
            if entry.is_dir():
                node = Folder()
                size.update({entry.name + b"/" + below: n for below, n in self.load(entry.path, node).items()})
            else:
                node = self.new_file()
                with open(entry.path, "rb") as f:
                    node.durable[:] = f.read()
                size[entry.name] = len(node.durable)
            folder.now[entry.name] = folder.durable[entry.name] = node
        return size

    def find(self, path):
        node = self.root
        for name in filter(None, path.split(b"/")):
            node = node.now.get(name) if isinstance(node, Folder) else None
        return node

    def change(self, *edits):
        """Changes entries (path, node or None), all of them or none."""
        edits = [(self.find(os.path.dirname(path)), os.path.basename(path), node) for path, node in edits]
        for folder, name, node in edits:
            set_entry(folder.now, name, node)
        self.pending.append(edits)

    def apply(self, call):
        """Does what the call did."""
        node = self.find(call.path)
        if call.name == "open":
            if node is None:
                self.change((call.path, self.new_file()))
            elif "O_TRUNC" in call.flags and isinstance(node, File):
                node.pending.append((call.end_s, 0, None))
        elif call.name == "mkdir" and call.path:  # the root is there before
            self.change((call.path, Folder()))
        elif call.name in ("unlink", "rmdir"):
            self.change((call.path, None))
        elif call.name == "rename":
            self.change((call.path, None), (call.target, node))
        elif call.name == "link":
            self.change((call.target, node))
        elif call.name == "size":
            node.pending.append((call.end_s, call.offset, None))
        elif call.name == "write" and node is not None:
            node.pending.append((call.end_s, call.offset, call.data))
        elif call.name == "sync" and "all" in call.flags:
            self.sync_all(call.begin_s)
        elif call.name == "sync":
            self.sync(node, call.begin_s)

    def sync(self, node, begin_s):
        if isinstance(node, File):
            node.apply(begin_s)
        elif node is not None:
            for edits in self.pending:
                commit([e for e in edits if e[0] is node])
                edits[:] = [e for e in edits if e[0] is not node]
            self.pending = [edits for edits in self.pending if edits]

    def sync_all(self, begin_s):
        for file in self.files:
            file.apply(begin_s)
        for edits in self.pending:
            commit(edits)
        self.pending = []

    def save(self, path, kept_changes, keep):
        """Writes one state to a new folder: kept_changes are those of `pending` that have happened, and keep() decides
        for each sector of an unsynced write whether it has."""
        entries = {}  # id of a folder -> its entries in this state
        for edits in kept_changes:
            for folder, name, node in edits:
                set_entry(entries.setdefault(id(folder), dict(folder.durable)), name, node)
        shutil.rmtree(path, ignore_errors=True)
        save_folder(self.root, os.fsencode(path), entries, keep)


def set_entry(entries, name, node):
    if node is None:
        entries.pop(name, None)
    else:
        entries[name] = node


def commit(edits):
    for folder, name, node in edits:
        set_entry(folder.durable, name, node)


def save_folder(folder, path, entries, keep):
    os.mkdir(path, 0o700)
    for name, node in sorted(entries.get(id(folder), folder.durable).items()):
        below = os.path.join(path, name)
        if isinstance(node, Folder):
            save_folder(node, below, entries, keep)
        else:
            with open(below, "wb") as f:
                f.write(node.bytes(keep))
            os.chmod(below, 0o600)


def save_least(disk, path):
    """Only what was synced."""
    disk.save(path, [], lambda: False)


def save_all(disk, path):
    """Everything that was written."""
    disk.save(path, disk.pending, lambda: True)


def save_some(disk, path, rng):
    """A selection: changes of entries up to some moment, and a share of the sectors."""
    share = rng.choice([0.1, 0.5, 0.9])
    disk.save(path, disk.pending[:rng.randint(0, len(disk.pending))], lambda: rng.random() < share)
