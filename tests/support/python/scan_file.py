"""Scans as other programs write them: TIFF stacks with any tags, NRRD and MetaImage headers."""
import struct


def tag(code, kind, *values):
    """A tag of TIFF: kind 2 text, 3 and 4 numbers of 16 and 32 bits, 5 a ratio, 11 and 12 real numbers."""
    return code, kind, values


def entry_data(order, kind, values):
    if kind == 2:
        return values[0].encode("latin-1") + b"\0", len(values[0]) + 1
    letter = {3: "H", 4: "I", 5: "II", 11: "f", 12: "d"}[kind]
    flat = [x for v in values for x in (v if kind == 5 else [v])]
    return struct.pack(order + (letter * len(values)), *flat), len(values)


def directory(order, at, entries, following):
    """One directory at `at`, with its long values behind it."""
    entries = sorted(entries)
    far = at + 2 + 12 * len(entries) + 4
    body, data = struct.pack(order + "H", len(entries)), b""
    for code, kind, values in entries:
        value, count = entry_data(order, kind, values)
        body += struct.pack(order + "HHI", code, kind, count)
        if len(value) <= 4:
            body += value.ljust(4, b"\0")
        else:
            body += struct.pack(order + "I", far + len(data))
            data += value + b"\0" * (len(value) % 2)
    next_at = far + len(data) if following else 0
    return body + struct.pack(order + "I", next_at) + data


def tiff(pages, width, height, bits=16, order="<", first=(), every=(), bare=b""):
    """A TIFF of pages (bytes each), one strip a page; `first` and `every`: further tags. bare: bytes behind the last directory's
    samples. The samples lie before the directories."""
    samples = b"".join(pages) + bare
    out = (b"II" if order == "<" else b"MM") + struct.pack(order + "HI", 42, 8 + len(samples)) + samples
    at, begin = 8 + len(samples), 8
    for i, page in enumerate(pages):
        own = {256: tag(256, 3, width), 257: tag(257, 3, height), 258: tag(258, 3, bits), 259: tag(259, 3, 1), 262: tag(262, 3, 1),
               273: tag(273, 4, begin), 277: tag(277, 3, 1), 278: tag(278, 3, height), 279: tag(279, 4, len(page))}
        own.update({t[0]: t for t in every})
        own.update({t[0]: t for t in first} if i == 0 else {})
        made = directory(order, at, own.values(), i + 1 < len(pages))
        out, at, begin = out + made, at + len(made), begin + len(page)
    return out


def page16(value, width, height, order="<"):
    """A page of one value, or of the values that value(x, y) gives."""
    at = value if callable(value) else lambda x, y: value
    return struct.pack(f"{order}{width * height}H", *(at(x, y) for y in range(height) for x in range(width)))


def imagej(**lines):
    return tag(270, 2, "ImageJ=1.53t\n" + "".join(f"{k}={v}\n" for k, v in lines.items()))


def nrrd(fields, data):
    return ("NRRD0005\n" + "".join(f"{k}: {v}\n" for k, v in fields.items()) + "\n").encode() + data


def metaimage(fields, data):
    return ("".join(f"{k} = {v}\n" for k, v in fields.items()) + "ElementDataFile = LOCAL\n").encode() + data
