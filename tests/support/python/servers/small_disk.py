"""A small file system for tests of full disks."""
import contextlib
import ctypes
import os
import threading
import time

import pytest


@pytest.fixture
def small_disk(tmp_path):
    """A file system of 16 MiB (needs root)."""
    folder = tmp_path / "disk"
    folder.mkdir()
    libc = ctypes.CDLL(None, use_errno=True)
    if os.geteuid() != 0 or libc.mount(b"selvedge-test", str(folder).encode(), b"tmpfs", 0, b"size=16m") != 0:
        pytest.skip("a small file system cannot be mounted here (not root)")
    yield folder
    libc.umount2(str(folder).encode(), 2)


def fill(folder, free_bytes=0, name="filler"):
    """Fills the file system but for some bytes, a multiple of 4096."""
    path = os.path.join(folder, name)
    with open(path, "wb", buffering=0) as f, pytest.raises(OSError):
        while f.write(b"x" * 4096) == 4096:
            pass
        raise OSError
    if free_bytes > 0:
        os.truncate(path, os.path.getsize(path) - free_bytes)


@contextlib.contextmanager
def kept_full(folder):
    """Fills the file system, and takes at once whatever becomes free."""
    stop = threading.Event()

    def take(f):
        while not stop.is_set():
            try:
                f.write(b"x" * 4096)
            except OSError:
                time.sleep(0.0005)

    fill(folder)
    with open(os.path.join(folder, "taken"), "wb", buffering=0) as f:
        thread = threading.Thread(target=take, args=(f,))
        thread.start()
        try:
            yield
        finally:
            stop.set()
            thread.join()
