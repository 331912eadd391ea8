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
