"""The PNG reader and composer of the benchmark of photo pairs."""
import os
import struct
import sys
import zlib

sys.path.insert(0, os.path.join(os.path.dirname(os.path.dirname(os.path.abspath(__file__))), "bench"))
import png_picture  # noqa: E402
from small_png import png  # noqa: E402

ROWS = [bytes((40 * x + 7 * y + 90 * c) % 256 for x in range(5) for c in range(3)) for y in range(5)]


def predictor(left, above, corner):
    """Paeth's: the neighbour nearest to left + above - corner; the first of the three where two are as near."""
    return min((left, above, corner), key=lambda v: abs(left + above - corner - v))


def filtered(rows, n=3):
    """The scan lines of rows, each row y under filter y of the PNG specification."""
    lines, above = b"", bytes(len(rows[0]))
    for kind, row in enumerate(rows):
        predicted = []
        for x, _ in enumerate(row):
            left, corner = (row[x - n], above[x - n]) if x >= n else (0, 0)
            predicted.append([0, left, above[x], (left + above[x]) // 2, predictor(left, above[x], corner)][kind])
        lines += bytes([kind]) + bytes((v - p) % 256 for v, p in zip(row, predicted))
        above = row
    return lines


def test_every_filter_is_read(tmp_path):
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    head = struct.pack(">IIBBBBB", 5, 5, 8, 2, 0, 0, 0)
    path = tmp_path / "a.png"
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(filtered(ROWS))) + chunk(b"IEND", b""))
    assert png_picture.read_png(path) == ROWS
    path.write_bytes(png(4, lambda x, y: 10 * x + y))  # grey
    assert png_picture.read_png(path)[1] == bytes(10 * x + 1 for x in range(4) for _ in range(3))


def test_pictures_are_put_side_by_side(tmp_path):
    black, white = [b"\0" * 6] * 2, [b"\xff" * 6] * 2
    rows = png_picture.compose([[black, white], [white, black]], 3, gap=1)
    png_picture.write_png(tmp_path / "b.png", rows)
    assert png_picture.read_png(tmp_path / "b.png") == rows
    assert len(rows) == 7 and all(len(r) == 21 for r in rows) and rows[0] == b"\0" * 9 + b"\xff" * 12 and rows[3] == b"\xff" * 21


def test_brightness_is_linear_radiance():
    rows = [bytes(range(0, 240, 5))]
    assert png_picture.brighten(rows, 1.0) == rows
    half = png_picture.brighten([b"\xff\xff\xff"], 0.5)[0][0]
    assert abs(half - 188) <= 1  # sRGB of 0.5
    assert png_picture.brighten([b"\xf0\x80\x00"], 100.0) == [b"\xff\xff\x00"]
