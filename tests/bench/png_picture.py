"""8-bit PNG files as lists of rows of rgb bytes, without a library: reading, enlarging, putting side by side, writing."""
import struct
import zlib

CHANNELS = {0: 1, 2: 3, 6: 4}


def read_png(path):
    """Rows of a PNG of 8 bits, grey or rgb, not interlaced; each row is the bytes r g b r g b ..."""
    with open(path, "rb") as f:
        data = f.read()
    at, packed = 8, b""
    while at < len(data):
        length, kind = struct.unpack_from(">I4s", data, at)
        body = data[at + 8:at + 8 + length]
        if kind == b"IHDR":
            width, height, bits, color, _, _, interlaced = struct.unpack(">IIBBBBB", body)
            if bits != 8 or color not in CHANNELS or interlaced:
                raise ValueError(f"{path}: only plain PNG of 8 bits")
        packed += body if kind == b"IDAT" else b""
        at += 12 + length
    n = CHANNELS[color]
    rows = unfilter(zlib.decompress(packed), width * n, height, n)
    return [bytes(row[n * x + (c if n >= 3 else 0)] for x in range(width) for c in range(3)) for row in rows]


def paeth(a, b, c):
    pa, pb, pc = abs(b - c), abs(a - c), abs(a + b - 2 * c)
    return a if pa <= pb and pa <= pc else b if pb <= pc else c


def unfilter(data, row_bytes, height, n):
    """Undoes the filters of the PNG specification, section 9."""
    rows, above = [], bytearray(row_bytes)
    for y in range(height):
        kind, *row = data[y * (row_bytes + 1):(y + 1) * (row_bytes + 1)]
        for x in range(row_bytes):
            left, corner = (row[x - n], above[x - n]) if x >= n else (0, 0)
            row[x] = (row[x] + (0, left, above[x], (left + above[x]) // 2, paeth(left, above[x], corner))[kind]) & 255
        rows.append(row)
        above = row
    return rows


def brighten(rows, factor):
    """The picture at `factor` times the linear radiance of its sRGB values."""
    def encoded(v):
        linear = factor * (v / 12.92 if v <= 0.04045 else ((v + 0.055) / 1.055) ** 2.4)
        return round(255 * min(1.0, 12.92 * linear if linear <= 0.0031308 else 1.055 * linear ** (1 / 2.4) - 0.055))
    table = bytes(encoded(v / 255) for v in range(256))
    return [row.translate(table) for row in rows]


def enlarge(rows, edge):
    """A square picture at edge x edge pixels, each pixel the nearest one."""
    n = len(rows)
    return [b"".join(rows[y * n // edge][3 * (x * n // edge):3 * (x * n // edge) + 3] for x in range(edge)) for y in range(edge)]


def compose(grid, edge, gap=4):
    """Square pictures, rows of a grid, enlarged to one size with white between them."""
    white = b"\xff\xff\xff" * gap
    out = []
    for line in grid:
        parts = [enlarge(rows, edge) for rows in line]
        out += [white.join(part[y] for part in parts) for y in range(edge)]
        out += [b"\xff" * len(out[-1])] * gap
    return out[:-gap]


def write_png(path, rows):
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    head = struct.pack(">IIBBBBB", len(rows[0]) // 3, len(rows), 8, 2, 0, 0, 0)
    with open(path, "wb") as f:
        f.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(b"".join(b"\0" + r for r in rows), 9)) + chunk(b"IEND", b""))
