"""Small TIFF files for tests, without a library: 16-bit rgb, not compressed, with exposure time, ISO and f-number as Exif data."""
import struct


def tiff16(width, height, values, exposure_s, iso=100, f_number=8):
    """values: red, green, blue of every pixel, row by row; rounded, and cut to 0..65535."""
    data = struct.pack(f"<{len(values)}H", *(min(max(round(v), 0), 65535) for v in values))
    n_entry, first = 10, 8 + len(data)
    extra = first + 2 + 12 * n_entry + 4  # the bits of the samples, then the Exif directory

    def entry(tag, kind, count, value):
        return struct.pack("<HHII", tag, kind, count, value)
    exif = extra + 6
    tags = [(256, 4, 1, width), (257, 4, 1, height), (258, 3, 3, extra), (259, 3, 1, 1), (262, 3, 1, 2), (273, 4, 1, 8), (277, 3, 1, 3),
            (278, 4, 1, height), (279, 4, 1, len(data)), (34665, 4, 1, exif)]
    rationals = exif + 2 + 12 * 3 + 4
    exif_tags = [(33434, 5, 1, rationals), (33437, 5, 1, rationals + 8), (34855, 3, 1, iso)]

    def directory(entries):
        return struct.pack("<H", len(entries)) + b"".join(entry(*e) for e in entries) + struct.pack("<I", 0)
    return (b"II*\0" + struct.pack("<I", first) + data + directory(tags) + struct.pack("<3H", 16, 16, 16) + directory(exif_tags)
            + struct.pack("<4I", round(exposure_s * 1e6), 1000000, round(f_number * 10), 10))


def grey_tiff(width, height, value, bits=8):
    """One page of grey samples without a sign: value(x, y)."""
    data = b"".join(value(x, y).to_bytes(bits // 8, "little") for y in range(height) for x in range(width))
    tags = [(256, 4, width), (257, 4, height), (258, 3, bits), (259, 3, 1), (262, 3, 1), (273, 4, 8), (277, 3, 1), (278, 4, height), (279, 4, len(data))]
    directory = struct.pack("<H", len(tags)) + b"".join(struct.pack("<HHII", tag, kind, 1, of) for tag, kind, of in tags) + bytes(4)
    return b"II*\0" + struct.pack("<I", 8 + len(data)) + data + directory
