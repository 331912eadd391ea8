"""Photographs of the zoo: PNG, JPEG, TIFF, OpenEXR and DNG. Right values come from imagecodecs, Pillow, tifffile, OpenEXR and rawpy."""
import io
import itertools
import struct
import zlib

import imagecodecs
import numpy
import OpenEXR
import rawpy
import tifffile
from PIL import Image, ImageCms, ImageOps
from specimen import Refused, Right, photograph

ROWS, COLUMNS = 24, 37
ONE_EIGHTH_LEVEL = 0.02  # JPEG: two levels of 255 of a dark color, after the curve


def picture(kind="u1", channels=3):
    """Smooth colors between .2 and .8 of full scale that no turn or mirror image leaves as they are."""
    y, x = numpy.indices((ROWS, COLUMNS))
    parts = [0.25 + 0.5 * x / COLUMNS, 0.22 + 0.5 * y / ROWS, 0.3 + 0.2 * x / COLUMNS + 0.3 * y / ROWS, 0.6 + 0 * x][:channels]
    value = numpy.stack(parts, -1) if channels > 1 else parts[0]
    return value.astype(kind) if kind[0] == "f" else numpy.round(value * numpy.iinfo(kind).max).astype(kind)


def srgb(v):
    return numpy.where(v <= 0.04045, v / 12.92, ((v + 0.055) / 1.055) ** 2.4)


def rgb(array, bits=None):
    """Shares of full scale, grey copied to three channels, alpha left out."""
    full = 1.0 if array.dtype.kind == "f" else float((1 << bits) - 1 if bits else numpy.iinfo(array.dtype).max)
    value = array.astype(float) / full
    if value.ndim == 2:
        value = value[..., None]
    return numpy.repeat(value[..., :1], 3, -1) if value.shape[-1] < 3 else value[..., :3]


# ---- PNG

def chunk(name, data=b""):
    return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))


def packed_rows(array, depth):
    """Rows of PNG with filter 0. array: [row][column][channel] of integers."""
    out = b""
    for row in array:
        if depth == 16:
            data = row.astype(">u2").tobytes()
        elif depth == 8:
            data = row.astype("u1").tobytes()
        else:
            bits = ((row.reshape(-1, 1) >> numpy.arange(depth - 1, -1, -1)) & 1).astype("u1")
            data = numpy.packbits(bits.ravel()).tobytes()
        out += b"\0" + data
    return out


ADAM7 = ((0, 0, 8, 8), (4, 0, 8, 8), (0, 4, 4, 8), (2, 0, 4, 4), (0, 2, 2, 4), (1, 0, 2, 2), (0, 1, 1, 2))


def png_bytes(array, depth, color, before=(), after=(), interlaced=False):
    value = array.reshape(array.shape[0], array.shape[1], -1)
    passes = [value[y::dy, x::dx] for x, y, dx, dy in ADAM7] if interlaced else [value]
    data = b"".join(packed_rows(p, depth) for p in passes if p.size)
    head = struct.pack(">IIBBBBB", array.shape[1], array.shape[0], depth, color, 0, 0, int(interlaced))
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + b"".join(chunk(*c) for c in before) + chunk(b"IDAT", zlib.compress(data))
            + b"".join(chunk(*c) for c in after) + chunk(b"IEND"))


def png(name, kind="u1", channels=3, before=(), after=(), transfer="linear", curve=None, words=None, interlaced=False, stated=None, fields=None,
        depth=None):
    """curve: from shares of full scale to light; None: as `transfer`."""
    def make(path):
        depth_now = depth or 8 * numpy.dtype(kind).itemsize
        array = picture(kind, channels)
        if channels in (2, 4):
            array[..., -1] = numpy.iinfo(kind).max
        if depth:
            array = array >> (8 - depth)
        with open(path, "wb") as file:
            file.write(png_bytes(array, depth_now, {1: 0, 2: 4, 3: 2, 4: 6}[channels], before, after, interlaced))
        if words is not None:
            return Refused(words)
        back = array
        if kind == "u1" and not depth:
            back = numpy.asarray(Image.open(path))
        elif not interlaced and not depth:
            with open(path, "rb") as file:
                back = imagecodecs.png_decode(file.read())
        to_light = curve or (srgb if transfer == "srgb" else lambda v: v)
        return Right(to_light(rgb(back, depth)), stated or {}, fields or {}, 3e-5)
    return photograph(name + ".png", make, transfer)


def exif_bytes(entries, order="<"):
    """A TIFF of one directory of main entries and one of Exif. entries: code -> (kind, values); kinds 3, 4, 5, 10, 12 as in TIFF."""
    letter = {3: "H", 4: "I", 5: "II", 10: "ii", 12: "d"}

    def directory(items, at):
        body, data, far = struct.pack(order + "H", len(items)), b"", at + 2 + 12 * len(items) + 4
        for code, (kind, values) in sorted(items.items()):
            value = struct.pack(order + letter[kind] * (len(values) // len(letter[kind])), *values)
            body += struct.pack(order + "HHI", code, kind, len(values) // len(letter[kind]))
            body += value.ljust(4, b"\0") if len(value) <= 4 else struct.pack(order + "I", far + len(data))
            data += value if len(value) > 4 else b""
        return body + struct.pack(order + "I", 0) + data
    main = {c: e for c, e in entries.items() if c < 0x8000}
    exif = {c: e for c, e in entries.items() if c >= 0x8000}
    first = directory({**main, 0x8769: (4, (0,))}, 8)
    return (b"II" if order == "<" else b"MM") + struct.pack(order + "HI", 42, 8) + directory({**main, 0x8769: (4, (8 + len(first),))}, 8) \
        + directory(exif, 8 + len(first))


EXPOSURES = {
    "ratios": ({0x829a: (5, (1, 40)), 0x829d: (5, (8, 1)), 0x8827: (3, (200,))}, (1 / 40, 200.0, 8.0)),
    "apex": ({0x9201: (10, (5, 1)), 0x9202: (5, (4, 1)), 0x8827: (3, (100,))}, (2.0 ** -5, 100.0, 4.0)),
    "doubles": ({0x829a: (12, (0.02,)), 0x829d: (12, (5.6,)), 0x8827: (4, (400,))}, (0.02, 400.0, 5.6)),
}


def exposed(values):
    return dict(zip(("exposure_s", "iso", "aperture"), values))


def pngs():
    for kind, channels, interlaced in itertools.product(("u1", "u2"), (1, 2, 3, 4), (False, True)):
        yield png(f"{kind}-{channels}{'-interlaced' if interlaced else ''}", kind, channels, interlaced=interlaced)
    for depth, interlaced in itertools.product((1, 2, 4), (False, True)):
        yield png(f"grey-of-{depth}{'-interlaced' if interlaced else ''}", channels=1, depth=depth, interlaced=interlaced)
    for channels in (1, 3):
        yield png(f"srgb-{channels}", channels=channels, transfer="srgb")
        yield png(f"srgb-chunk-{channels}", channels=channels, before=[(b"sRGB", b"\0")], transfer="file", curve=srgb, stated={"sRGB chunk": None})
    for name, gamma in (("1", 1.0), ("22", 1 / 2.2), ("18", 1 / 1.8)):
        yield png(f"gama-{name}", before=[(b"gAMA", struct.pack(">I", round(gamma * 1e5)))], transfer="file",
                  curve=lambda v, g=round(gamma * 1e5) / 1e5: v ** (1 / g), stated={"gAMA": None})
    yield png("gama-against-document", before=[(b"gAMA", struct.pack(">I", 45455))], transfer="linear", words=("gAMA", "linear"))
    for name, code, word in (("pq", 16, "PQ"), ("hlg", 18, "HLG")):
        yield png("cicp-" + name, before=[(b"cICP", bytes((9, code, 0, 1)))], transfer="file", words=("cICP", word))
    yield png("cicp-srgb", before=[(b"cICP", bytes((1, 13, 0, 1)))], transfer="file", curve=srgb, stated={"cICP": "applied"})
    yield png("phys", before=[(b"pHYs", struct.pack(">IIB", 3779, 3779, 1))], stated={"pHYs": "not_used"})
    of_rec709 = struct.pack(">8I", 31270, 32900, 64000, 33000, 30000, 60000, 15000, 6000)
    yield png("chrm-rec709", before=[(b"gAMA", struct.pack(">I", 100000)), (b"cHRM", of_rec709)], transfer="file", stated={"cHRM": None})
    yield png("sbit-all", before=[(b"sBIT", bytes((8, 8, 8)))])
    for name, (entries, values) in EXPOSURES.items():
        for order, where in itertools.product("<>", ("before", "after")):
            yield png(f"exif-{name}-{'big' if order == '>' else 'little'}-{where}", fields=exposed(values),
                      **{where: [(b"eXIf", exif_bytes(entries, order))]})
    yield png("transparent-grey", channels=1, before=[(b"tRNS", struct.pack(">H", 7))], stated={"transparency": "not_used"})
    yield png("transparent-color", before=[(b"tRNS", struct.pack(">3H", 1, 2, 3))], stated={"transparency": "not_used"})
    yield png("transparent-pixels", channels=1, before=[(b"tRNS", struct.pack(">H", int(picture("u1", 1)[3, 5])))], words=("transparent",))


# ---- JPEG

def jpeg(name, mode="RGB", change=None, words=None, fields=None, stated=None, transpose=False, **how):
    """change(bytes): the file with further segments."""
    def make(path):
        array = picture("u1", {"L": 1, "RGB": 3, "CMYK": 4}[mode])
        made = io.BytesIO()
        Image.fromarray(array, mode).save(made, "JPEG", **{"quality": 98, "subsampling": 0, **how})
        data = made.getvalue()
        with open(path, "wb") as file:
            file.write(change(data) if change else data)
        if words is not None:
            return Refused(words)
        back = Image.open(io.BytesIO(data))
        back = ImageOps.exif_transpose(back) if transpose else back
        return Right(srgb(rgb(numpy.asarray(back))), stated or {}, fields or {}, ONE_EIGHTH_LEVEL)
    return photograph(name + ".jpg", make, "srgb")


def orientation_exif(turn):
    return exif_bytes({0x0112: (3, (turn,)), 0x829a: (5, (1, 50))})


def app1(exif):
    def change(data):
        body = b"Exif\0\0" + exif
        return data[:2] + b"\xff\xe1" + struct.pack(">H", len(body) + 2) + body + data[2:]
    return change


def jpegs():
    for mode, progressive, quality in itertools.product(("L", "RGB"), (False, True), (75, 98)):
        yield jpeg(f"{mode}-{'progressive' if progressive else 'baseline'}-{quality}", mode, progressive=progressive, quality=quality)
    for sampling in (1, 2):
        yield jpeg(f"sampling-{sampling}", subsampling=sampling)
    yield jpeg("restarts", restart_marker_blocks=2)
    yield jpeg("comment", comment="a comment")
    yield jpeg("cmyk", "CMYK", words=("channel",))
    yield jpeg("stray-bytes", change=lambda d: d[:20] + b"\0\0\0" + d[20:])
    yield jpeg("fill-bytes", change=lambda d: d[:20] + b"\xff\xff" + d[20:])
    yield jpeg("bytes-behind-the-end", change=lambda d: d + b"MP4 of a phone" * 50)
    for turn in range(1, 9):
        yield jpeg(f"orientation-{turn}", exif=b"Exif\0\0" + orientation_exif(turn), transpose=True, stated={"orientation": "applied"} if turn > 1 else {},
                   fields={"orientation": turn})
    for name, (entries, values) in EXPOSURES.items():
        for order in "<>":
            yield jpeg(f"exif-{name}-{'big' if order == '>' else 'little'}", change=app1(exif_bytes(entries, order)), fields=exposed(values))
    yield jpeg("icc-srgb", icc_profile=ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes(), stated={"color profile": None})


# ---- TIFF

def tiff(name, kind="u1", channels=3, transfer="linear", words=None, stated=None, fields=None, curve=None, bits=None, byteorder="<", bigtiff=False, turn=None,
         opaque=True, **how):
    def make(path):
        array = picture(kind, channels)
        if channels == 4 and opaque:
            array[..., 3] = numpy.iinfo(kind).max if array.dtype.kind != "f" else 1
        separate = how.get("planarconfig") == "separate"
        tags = [(274, 3, 1, turn, False)] if turn else []
        with tifffile.TiffWriter(path, byteorder=byteorder, bigtiff=bigtiff) as writer:
            writer.write(numpy.moveaxis(array, -1, 0).copy() if separate else array, metadata=None, extratags=tags + how.get("tags", []),
                         **{"photometric": "rgb" if channels > 2 else "minisblack", **{k: v for k, v in how.items() if k != "tags"}})
        if words is not None:
            return Refused(words)
        back = tifffile.imread(path)
        back = numpy.moveaxis(back, 0, -1) if separate else back
        if turn:
            back = turned(back, turn)
        return Right((curve or (srgb if transfer == "srgb" else lambda v: v))(rgb(back, bits)), stated or {}, fields or {}, 3e-5)
    return photograph(name + ".tif", make, transfer)


def turned(array, turn):
    """The upright picture of a TIFF orientation (TIFF 6.0, tag 274)."""
    if turn >= 5:
        array = numpy.swapaxes(array, 0, 1)
    return array[::-1 if turn in (3, 4, 7, 8) else 1, ::-1 if turn in (2, 3, 6, 7) else 1]


def tiffs():
    for kind, channels, order in itertools.product(("u1", "u2", "f4"), (1, 3, 4), "<>"):
        alpha = {"extrasamples": ["unassalpha"]} if channels == 4 else {}
        yield tiff(f"{kind}-{channels}-{'big' if order == '>' else 'little'}", kind, channels, byteorder=order, **alpha)
    for kind, packing, planar in itertools.product(("u1", "u2", "f4"), ("zlib", "lzw", "packbits"), ("contig", "separate")):
        yield tiff(f"{kind}-{packing}-{planar}", kind, compression=packing, planarconfig=planar)
    for kind, packing in itertools.product(("u1", "u2", "f4"), (None, "zlib")):
        yield tiff(f"{kind}-tiles-{packing}", kind, tile=(16, 16), compression=packing, predictor=packing is not None)
    yield tiff("bigtiff", "u2", bigtiff=True)
    yield tiff("half-floats", "f2", words=("16-bit",))
    yield tiff("signed", "i2", words=("16-bit",))
    yield tiff("see-through", "u1", 4, opaque=False, extrasamples=["unassalpha"], words=("alpha",))
    yield tiff("separated", "u1", 4, photometric="separated", words=("PhotometricInterpretation",))
    yield tiff("lab", "u1", photometric="cielab", words=("PhotometricInterpretation",))
    yield tiff("white-is-zero", "u1", 1, photometric="miniswhite", curve=lambda v: 1 - v, stated={"photometric sense": None})
    for turn in range(2, 9):
        yield tiff(f"orientation-{turn}", "u1", turn=turn, stated={"orientation": "applied"}, fields={"orientation": turn})
    yield tiff("resolution", "u1", resolution=(300, 300), resolutionunit=2, stated={"resolution": "not_used"})
    yield tiff("srgb", "u1", transfer="srgb")


# ---- OpenEXR

def exr(name, channels, kind="f4", words=None, stated=None, fields=None, header=None, grey=False):
    def make(path):
        value = {"R": 0, "G": 1, "B": 2, "Y": 0}
        planes = picture(kind)
        made = {c: numpy.ascontiguousarray(planes[..., value.get(c[-1], 1)]) if kind[0] == "f" else
                (100 * planes[..., 0]).astype("u4") for c in channels}
        if "A" in made:
            made["A"] = numpy.ones_like(made["A"])
        head = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage, **(header or {})}
        OpenEXR.File(head, made).write(path)
        if words is not None:
            return Refused(words)
        with OpenEXR.File(path, separate_channels=True) as back:
            read = {k: numpy.asarray(c.pixels, dtype=float) for k, c in back.channels().items()}
        parts = [read["Y"]] * 3 if grey else [read[c] for c in "RGB"]
        lossy = (header or {}).get("compression") in LOSSY
        return Right(numpy.stack(parts, -1), stated or {}, fields or {}, 2e-3 if lossy else 2e-6)
    return photograph(name + ".exr", make)


LOSSY = [OpenEXR.PXR24_COMPRESSION, OpenEXR.B44_COMPRESSION, OpenEXR.B44A_COMPRESSION, OpenEXR.DWAA_COMPRESSION, OpenEXR.DWAB_COMPRESSION]
PACKINGS = {"none": OpenEXR.NO_COMPRESSION, "rle": OpenEXR.RLE_COMPRESSION, "zips": OpenEXR.ZIPS_COMPRESSION, "zip": OpenEXR.ZIP_COMPRESSION,
            "piz": OpenEXR.PIZ_COMPRESSION, "pxr24": OpenEXR.PXR24_COMPRESSION, "b44": OpenEXR.B44_COMPRESSION, "b44a": OpenEXR.B44A_COMPRESSION,
            "dwaa": OpenEXR.DWAA_COMPRESSION, "dwab": OpenEXR.DWAB_COMPRESSION}


def exrs():
    for (name, packing), kind in itertools.product(PACKINGS.items(), ("f2", "f4")):
        words = ("DWA",) if name[:3] == "dwa" else ("B44", "float") if name[:3] == "b44" and kind == "f4" else None
        yield exr(f"{kind}-{name}", "RGB", kind, words, header={"compression": packing})
    for kind, channels in itertools.product(("f2", "f4"), ("Y", "YA")):
        yield exr(f"{kind}-{channels}", channels, kind, grey=True, stated={"channels": None} if len(channels) > 2 else {})
    for channels in ("RGBA", "RGBAZ", "RGBZ"):
        yield exr(channels, channels, stated={"channels": None} if "Z" in channels else {})
    yield exr("no-colors", "Z", words=("channel",))
    yield exr("two-colors", "RG", words=("channel",))
    yield exr("whole-numbers", "RGB", "u4", words=("half or float",))
    yield exr("tristimulus", "XYZ", words=("tristimulus",))
    yield exr("luminance-chroma", ["Y", "RY", "BY"], words=("chroma",))
    yield exr("exposure", "RGB", header={"expTime": 0.25, "aperture": 4.0, "isoSpeed": 200.0}, fields=exposed((0.25, 200.0, 4.0)))
    yield exr("views", ["left.R", "left.G", "left.B"], words=("channel",))


# ---- camera raw

def dng(name, pattern, black, white, kind="u2", change=None, words=None):
    """A flat field of three colors: whatever the interpolation, every pixel has the same light."""
    def make(path):
        colors = {0: 0.25, 1: 0.5, 2: 0.4}
        raw = numpy.zeros((32, 48), kind)
        for y, x in itertools.product((0, 1), (0, 1)):
            raw[y::2, x::2] = round(black + colors[pattern[2 * y + x]] * (white - black))
        tags = [(33421, 3, 2, (2, 2), False), (33422, 1, 4, bytes(pattern), False), (50706, 1, 4, b"\1\4\0\0", False),
                (50708, 2, 0, "Zoo", False), (50714, 5, 1, (black, 1), False), (50717, 4, 1, white, False),
                (50721, 10, 9, (1, 1, 0, 1, 0, 1, 0, 1, 1, 1, 0, 1, 0, 1, 0, 1, 1, 1), False), (50728, 5, 3, (1, 1, 1, 1, 1, 1), False),
                (50778, 3, 1, 21, False)]
        tifffile.imwrite(path, raw, photometric=32803, metadata=None, extratags=tags + (change or []))
        if words is not None:
            return Refused(words)
        with rawpy.imread(path) as back:
            seen = {c: float(numpy.median(back.raw_image_visible[back.raw_colors_visible % 4 == c])) for c in (0, 1, 2)}
        right = numpy.array([(seen[c] - black) / (white - black) for c in (0, 1, 2)])
        return Right(numpy.broadcast_to(right, (16, 24, 3)), {"black level": None, "white level": None}, {}, 1e-3)
    return photograph(name + ".dng", make)


def dngs():
    for layout, pattern in (("rggb", (0, 1, 1, 2)), ("bggr", (2, 1, 1, 0)), ("grbg", (1, 0, 2, 1)), ("gbrg", (1, 2, 0, 1))):
        for black, white in ((0, 65535), (512, 16383), (64, 1023)):
            yield dng(f"{layout}-{white}", pattern, black, white)


def photographs():
    for family in (pngs, jpegs, tiffs, exrs, dngs):
        yield from family()
