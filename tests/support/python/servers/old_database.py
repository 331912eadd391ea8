"""Databases of earlier versions, made from the migrations in the source."""
import contextlib
import os
import re
import sqlite3

from daemon_under_test import ROOT


def migrations():
    """The statements of each migration, from the source."""
    with open(os.path.join(ROOT, "server", "store", "drivers", "store_schema.c"), encoding="utf-8") as f:
        text = f.read().split("migration[] = {")[1].split("\n};")[0]
    entries = [""]
    for literal, comma in re.findall(r'"((?:[^"\\]|\\.)*)"|(,)', re.sub(r"/\*.*?\*/", "", text, flags=re.S)):
        if comma:
            entries.append("")
        else:
            entries[-1] += literal
    return [e for e in entries if e]


def columns(db, table):
    return [row[1] for row in db.execute(f"PRAGMA table_info({table})")]


def make_older(path, version):
    """Replaces the database of a stopped daemon by one of an earlier version with the same jobs, files and keys."""
    with contextlib.closing(sqlite3.connect(str(path) + ".older")) as db:
        for entry in migrations()[:version]:
            db.executescript(entry)
        db.execute("ATTACH ? AS newer", (str(path),))
        for table in ("job", "document", "file", "idempotency"):
            newer = [row[1] for row in db.execute(f"PRAGMA newer.table_info({table})")]
            both = ", ".join(c for c in columns(db, table) if c in newer)
            db.execute(f"INSERT INTO main.{table} ({both}) SELECT {both} FROM newer.{table}")
        db.commit()
        db.execute("DETACH newer")
        db.execute(f"PRAGMA user_version={version}")
        db.execute("PRAGMA journal_mode=WAL")
    for ending in ("-wal", "-shm"):
        if os.path.exists(str(path) + ending):
            os.remove(str(path) + ending)
    os.rename(str(path) + ".older", path)
