"""Small PNG files for tests, without a library."""
import struct
import zlib


def png(edge, grey):
    """An 8-bit grey PNG of edge x edge pixels with the values grey(x, y)."""
    return encode(edge, 0, b"".join(b"\0" + bytes(int(grey(x, y)) for x in range(edge)) for y in range(edge)))


def png_rgb(edge, rgb):
    """An 8-bit color PNG of edge x edge pixels with the values rgb(x, y)."""
    return encode(edge, 2, b"".join(b"\0" + bytes(int(v) for x in range(edge) for v in rgb(x, y)) for y in range(edge)))


def encode(edge, color, rows):
    def chunk(name, data):
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
    header = struct.pack(">IIBBBBB", edge, edge, 8, color, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")


def weave(draft, width=8, height=10):
    """A function (x, y) that draws a weave: width x height pixels for a crossing, the warp (1) brighter."""
    def grey(x, y):
        warp = draft[y // height % len(draft)][x // width % len(draft[0])] == "1"
        middle_x, middle_y = (width - 1) / 2, (height - 1) / 2
        across = (x % width - middle_x) / (width / 2) if warp else (y % height - middle_y) / (height / 2)
        return (220 if warp else 130) * (1 - across * across)
    return grey
