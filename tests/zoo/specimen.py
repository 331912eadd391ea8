"""One file of the zoo: how it is made, how it is read, and what an independent program says of it."""
import dataclasses
import typing


@dataclasses.dataclass
class Right:
    """A file that is read. values: array of samples, [slice][row][column] of a scan and [row][column][channel] of a photograph (linear,
    Rec. 709, upright), compared within `tolerance`, relative to the largest. stated: names of statements that the ledger must have,
    each with its use ("applied", "not_used") or None for either. fields: further values of the answer, numbers within 1e-3."""
    values: typing.Any
    stated: dict = dataclasses.field(default_factory=dict)
    fields: dict = dataclasses.field(default_factory=dict)
    tolerance: float = 2e-6


@dataclasses.dataclass
class Refused:
    """A file that is refused: every word of `words` is part of the message, whatever its case."""
    words: tuple


@dataclasses.dataclass
class Specimen:
    """name: of the file, unique in the zoo. kind: "scan" or "photograph". how: fields of the line that read_files.c takes behind the
    path. make(path): writes the file and returns Right or Refused. parts: number of files of a scan; those after the first are at
    beside(path, 1), beside(path, 2), ..."""
    name: str
    kind: str
    how: tuple
    make: typing.Callable
    parts: int = 1


def beside(path, i):
    return f"{path}.{i}"


def scan(name, make, channel=0, time=0, dataset="", parts=1):
    return Specimen(name, "scan", (str(channel), str(time), dataset), make, parts)


def photograph(name, make, transfer="linear"):
    return Specimen(name, "photograph", (transfer,), make)
