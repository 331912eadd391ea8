"""Small OpenEXR files for tests, without a library: 32-bit float, scan lines, not compressed."""
import struct


def exr(width, height, rgb):
    """An OpenEXR file of width x height pixels with the values rgb(x, y); row 0 is at the top."""
    def attribute(name, kind, data):
        return name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<I", len(data)) + data
    names = "BGR"  # in the order of the alphabet
    channels = b"".join(n.encode() + b"\0" + struct.pack("<IBBBBII", 2, 0, 0, 0, 0, 1, 1) for n in names) + b"\0"
    box = struct.pack("<iiii", 0, 0, width - 1, height - 1)
    head = b"\x76\x2f\x31\x01" + struct.pack("<I", 2) + b"".join([
        attribute("channels", "chlist", channels), attribute("compression", "compression", b"\0"), attribute("dataWindow", "box2i", box),
        attribute("displayWindow", "box2i", box), attribute("lineOrder", "lineOrder", b"\0"), attribute("pixelAspectRatio", "float", struct.pack("<f", 1)),
        attribute("screenWindowCenter", "v2f", struct.pack("<ff", 0, 0)), attribute("screenWindowWidth", "float", struct.pack("<f", 1))]) + b"\0"
    line_bytes = 4 * width * len(names)
    first = len(head) + 8 * height
    table = b"".join(struct.pack("<Q", first + y * (8 + line_bytes)) for y in range(height))
    lines = b""
    for y in range(height):
        row = [rgb(x, y) for x in range(width)]
        lines += struct.pack("<iI", y, line_bytes) + b"".join(struct.pack(f"<{width}f", *(p["RGB".index(n)] for p in row)) for n in names)
    return head + table + lines


def read_exr(data, layer=""):
    """Reads what `exr` and the worker write: (width, height, pixel), where pixel(x, y) is (r, g, b) of the layer."""
    assert data[:8] == b"\x76\x2f\x31\x01\x02\0\0\0"
    at, found = 8, {}
    while data[at]:
        name, kind, rest = data[at:].split(b"\0", 2)
        at += len(name) + len(kind) + 2
        length = struct.unpack_from("<I", data, at)[0]
        found[name.decode()] = data[at + 4:at + 4 + length]
        at += 4 + length
    assert found["compression"] == b"\0"
    left, top, right, bottom = struct.unpack("<iiii", found["dataWindow"])
    width, height, names, channels = right - left + 1, bottom - top + 1, [], found["channels"]
    while channels[0]:
        names.append(channels.split(b"\0", 1)[0].decode())
        channels = channels[len(names[-1]) + 17:]
    first = at + 1 + 8 * height + 8
    stride = 8 + 4 * width * len(names)

    def pixel(x, y):
        return tuple(struct.unpack_from("<f", data, first + y * stride + 4 * (names.index(layer + c) * width + x))[0] for c in "RGB")
    return width, height, pixel
