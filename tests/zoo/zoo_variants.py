"""Variants of what once went wrong: codes for saturation, colors of other primaries, unusual carriers of exposure, headers with options."""
import io
import itertools
import os
import struct
import zlib

import nrrd
import numpy
import OpenEXR
import tifffile
from PIL import Image, ImageCms
from specimen import Refused, Right, photograph, scan
from zoo_photographs import EXPOSURES, exif_bytes, exposed, picture, png, rgb, srgb, turned
from zoo_scans import cloth, metaimage_edited

REC709 = ((0.64, 0.33), (0.30, 0.60), (0.15, 0.06), (0.3127, 0.3290))
PRIMARIES = {"p3": ((0.68, 0.32), (0.265, 0.69), (0.15, 0.06), (0.3127, 0.3290)),
             "rec2020": ((0.708, 0.292), (0.17, 0.797), (0.131, 0.046), (0.3127, 0.3290)),
             "adobe": ((0.64, 0.33), (0.21, 0.71), (0.15, 0.06), (0.3127, 0.3290))}


def to_xyz(primaries):
    """Columns are the tristimulus values of the primaries, whose sum is the white point (SMPTE RP 177)."""
    columns = numpy.array([(x / y, 1, (1 - x - y) / y) for x, y in primaries]).T
    return columns[:, :3] * numpy.linalg.solve(columns[:, :3], columns[:, 3])


def to_rec709(primaries):
    return numpy.linalg.solve(to_xyz(REC709), to_xyz(primaries))


# ---- saturation

def piled(name, bits, shift, container=16):
    """A picture of `bits` bits in larger words, a tenth of whose pixels is clipped."""
    def make(path):
        value = (picture("f8") * ((1 << bits) - 1)).astype("u2")
        value[:4] = (1 << bits) - 1
        tifffile.imwrite(path, value << shift, photometric="rgb", metadata=None)
        full = (1 << container) - 1
        return Right(rgb(value << shift), {}, {"saturation": float(((1 << bits) - 1) << shift) / full}, 3e-5)
    return photograph(name + ".tif", make)


def saturations():
    for bits in (10, 12, 14):
        yield piled(f"piled-{bits}-low", bits, 0)
        yield piled(f"piled-{bits}-high", bits, 16 - bits)


# ---- colors

def exr_of_primaries(name, primaries):
    def make(path):
        planes = picture("f4")
        numbers = tuple(c for xy in primaries for c in xy)
        OpenEXR.File({"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage, "chromaticities": numbers},
                     {c: numpy.ascontiguousarray(planes[..., i]) for i, c in enumerate("RGB")}).write(path)
        return Right(planes.astype(float) @ to_rec709(primaries).T, {"chromaticities": "applied"}, {}, 2e-5)
    return photograph(name + ".exr", make)


def png_of_primaries(name, primaries):
    white, colors = primaries[3], primaries[:3]
    numbers = struct.pack(">8I", *(round(c * 1e5) for xy in (white, *colors) for c in xy))
    return png(name, "u2", before=[(b"gAMA", struct.pack(">I", 100000)), (b"cHRM", numbers)], transfer="file", curve=lambda v: v @ to_rec709(primaries).T,
               stated={"gAMA": "applied", "cHRM": "applied"})


def s15(x):
    return struct.pack(">i", round(x * 65536))


def icc_of_primaries(primaries, gamma):
    """A matrix profile of version 2 (ICC.1:2001-04), whose colorants are adapted to D50 by the Bradford transform."""
    bradford = numpy.array(((0.8951, 0.2664, -0.1614), (-0.7502, 1.7135, 0.0367), (0.0389, -0.0685, 1.0296)))
    d50, white = numpy.array((0.9642, 1.0, 0.8249)), to_xyz(primaries).sum(1)
    adapt = numpy.linalg.solve(bradford, numpy.diag((bradford @ d50) / (bradford @ white)) @ bradford)
    colorants = adapt @ to_xyz(primaries)
    tags = {b"wtpt": b"XYZ \0\0\0\0" + b"".join(map(s15, d50)), b"cprt": b"text\0\0\0\0none\0\0\0\0",
            b"desc": b"desc\0\0\0\0" + struct.pack(">I", 4) + b"zoo\0" + b"\0" * 79}
    for i, letter in enumerate(b"rgb"):
        tags[bytes((letter,)) + b"XYZ"] = b"XYZ \0\0\0\0" + b"".join(map(s15, colorants[:, i]))
        tags[bytes((letter,)) + b"TRC"] = b"curv\0\0\0\0" + struct.pack(">IH", 1, round(gamma * 256)) + b"\0\0"
    at, table, data = 132 + 12 * len(tags), struct.pack(">I", len(tags)), b""
    for name, value in tags.items():
        value += b"\0" * (-len(value) % 4)
        table += name + struct.pack(">II", at + len(data), len(value))
        data += value
    size = at + len(data)
    head = struct.pack(">I4sI4s4s4s12s4s", size, b"lcms", 0x02400000, b"mntr", b"RGB ", b"XYZ ", b"\x07\xea\0\x0b\0\x1c\0\0\0\0\0\0", b"acsp")
    head += b"\0" * (68 - len(head)) + b"".join(map(s15, d50))
    return head.ljust(128, b"\0") + table + data


def with_profile(name, suffix, kind, primaries, gamma):
    """Right values by littleCMS, which gives eight bits of sRGB."""
    def make(path):
        array = picture("u1") // 6 + 107  # within the triangle of Rec. 709
        profile = icc_of_primaries(primaries, gamma)
        Image.fromarray(array).save(path, kind, icc_profile=profile, **({"quality": 100, "subsampling": 0} if kind == "JPEG" else {}))
        back = Image.open(path).convert("RGB")
        out = ImageCms.profileToProfile(back, ImageCms.ImageCmsProfile(io.BytesIO(profile)), ImageCms.createProfile("sRGB"), renderingIntent=1)
        return Right(srgb(rgb(numpy.asarray(out))), {"color profile": "applied"}, {}, 0.012)
    return photograph(name + suffix, make, "file")


def colors():
    for name, primaries in PRIMARIES.items():
        yield exr_of_primaries("primaries-" + name, primaries)
        yield png_of_primaries("primaries-" + name, primaries)
        for suffix, kind in ((".jpg", "JPEG"), (".tif", "TIFF"), (".png", "PNG")):
            for gamma in (1.8, 2.19921875):
                yield with_profile(f"profile-{name}-{round(10 * gamma)}-{kind.lower()}", suffix, kind, primaries, gamma)


# ---- carriers of exposure

XMP = ('<x:xmpmeta xmlns:x="adobe:ns:meta/"><rdf:RDF xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#"><rdf:Description '
       'xmlns:exif="http://ns.adobe.com/exif/1.0/" {attributes}>{elements}</rdf:Description></rdf:RDF></x:xmpmeta>')
SEQUENCE = "<exif:ISOSpeedRatings><rdf:Seq><rdf:li>200</rdf:li></rdf:Seq></exif:ISOSpeedRatings>"
PACKETS = {
    "attributes": XMP.format(attributes='exif:ExposureTime="1/40" exif:FNumber="80/10"', elements=SEQUENCE),
    "elements": XMP.format(attributes="", elements="<exif:ExposureTime>1/40</exif:ExposureTime><exif:FNumber>8/1</exif:FNumber>" + SEQUENCE),
}
FROM_PACKET = exposed((1 / 40, 200.0, 8.0))


def saved(name, suffix, transfer="srgb", fields=None, after=None, words=None, stated=None, **how):
    """A picture that Pillow saves. after(bytes): the file with further parts."""
    def make(path):
        Image.fromarray(picture()).save(path, **how)
        with open(path, "rb") as file:
            data = file.read()
        if after:
            with open(path, "wb") as file:
                file.write(after(data))
        if words is not None:
            return Refused(words)
        back = rgb(numpy.asarray(Image.open(io.BytesIO(data))))
        return Right(srgb(back) if transfer == "srgb" else back, stated or {}, fields or {}, 0.02 if suffix == ".jpg" else 3e-5)
    return photograph(name + suffix, make, transfer)


def jpeg_packet(text):
    body = b"http://ns.adobe.com/xap/1.0/\0" + text.encode()
    return lambda data: data[:2] + b"\xff\xe1" + struct.pack(">H", len(body) + 2) + body + data[2:]


def png_text(chunk_name, data):
    def after(png_file):
        chunk = struct.pack(">I", len(data)) + chunk_name + data + struct.pack(">I", zlib.crc32(chunk_name + data))
        return png_file[:33] + chunk + png_file[33:]
    return after


def raw_profile(entries):
    """Exif as ImageMagick writes it: hexadecimal digits in a text chunk."""
    data = b"Exif\0\0" + exif_bytes(entries)
    digits = data.hex()
    lines = "\n".join(digits[i:i + 72] for i in range(0, len(digits), 72))
    return f"\nexif\n{len(data):8d}\n{lines}\n".encode()


def carriers():
    for name, packet in PACKETS.items():
        yield saved("xmp-" + name, ".jpg", fields=FROM_PACKET, after=jpeg_packet(packet), quality=98, subsampling=0)
        yield saved("xmp-" + name, ".png", fields=FROM_PACKET, after=png_text(b"iTXt", b"XML:com.adobe.xmp\0\0\0\0\0" + packet.encode()))
        yield saved("xmp-packed-" + name, ".png", fields=FROM_PACKET,
                    after=png_text(b"iTXt", b"XML:com.adobe.xmp\0\1\0\0\0" + zlib.compress(packet.encode())))
        yield saved("xmp-" + name, ".tif", fields=FROM_PACKET, tiffinfo={700: packet.encode()})
    for name, (entries, values) in EXPOSURES.items():
        text = raw_profile(entries)
        yield saved("raw-profile-" + name, ".png", fields=exposed(values), after=png_text(b"tEXt", b"Raw profile type exif\0" + text))
        yield saved("raw-profile-packed-" + name, ".png", fields=exposed(values),
                    after=png_text(b"zTXt", b"Raw profile type exif\0\0" + zlib.compress(text)))
        yield saved("raw-profile-app1-" + name, ".png", fields=exposed(values), after=png_text(b"zTXt", b"Raw profile type APP1\0\0" + zlib.compress(text)))
    for suffix, how in ((".jpg", {"quality": 98, "subsampling": 0}), (".png", {})):
        exif = Image.Exif()
        exif[0x0112] = 1  # Pillow leaves out what has no entry of its own
        exif.get_ifd(0x8769).update({0x829a: 0.025, 0x829d: 8.0, 0x8827: 200})
        yield saved("pillow-exif", suffix, fields=FROM_PACKET, exif=exif, **how)


# ---- formats that are no photographs here

def strangers():
    for suffix in (".webp", ".gif", ".bmp", ".tga", ".ppm", ".jp2"):
        yield saved("stranger", suffix, words=("OpenEXR",))
        yield saved("renamed-" + suffix[1:], ".png", words=(), format=Image.registered_extensions()[suffix])


# ---- scans

def tiff_of_codec(codec, right):
    def make(path):
        tifffile.imwrite(path, cloth("u1"), compression=codec, photometric="minisblack", metadata=None)
        return right if isinstance(right, Refused) else Right(tifffile.imread(path), tolerance=right)
    return scan(f"scan-{codec}.tif", make)


def turned_scan(turn):
    def make(path):
        tifffile.imwrite(path, cloth("u2"), metadata=None, photometric="minisblack", extratags=[(274, 3, 1, turn, False)])
        return Right(numpy.stack([turned(page, turn) for page in cloth("u2")]), {"orientation": "applied"})
    return scan(f"scan-orientation-{turn}.tif", make)


def pyramid(path):
    with tifffile.TiffWriter(path) as writer:
        for page in cloth("u2"):
            writer.write(page, metadata=None, photometric="minisblack", subifds=1)
            writer.write(page[::2, ::2].copy(), metadata=None, photometric="minisblack", subfiletype=1)
    return Right(cloth("u2"))


def one_directory(path):
    tifffile.imwrite(path, cloth("u2"), imagej=True, truncate=True, metadata={"axes": "ZYX"})
    return Right(cloth("u2"))


def ome_in_reverse(path):
    """The document says that the first page is the last slice."""
    n, rows, columns = cloth("u2").shape
    places = "".join(f'<TiffData FirstZ="{n - 1 - k}" IFD="{k}" PlaneCount="1"/>' for k in range(n))
    xml = ('<?xml version="1.0" encoding="UTF-8"?><OME xmlns="http://www.openmicroscopy.org/Schemas/OME/2016-06"><Image ID="Image:0"><Pixels ID="Pixels:0" '
           f'DimensionOrder="XYZCT" Type="uint16" SizeX="{columns}" SizeY="{rows}" SizeZ="{n}" SizeC="1" SizeT="1"><Channel ID="Channel:0:0" '
           f'SamplesPerPixel="1"/>{places}</Pixels></Image></OME>')
    with tifffile.TiffWriter(path) as writer:
        for k, page in enumerate(cloth("u2")[::-1]):
            writer.write(page, metadata=None, photometric="minisblack", description=xml if k == 0 else None)
    return Right(tifffile.imread(path))


def nrrd_with(name, change, suffix=".nrrd", words=None, stated=None, fields=None):
    """A header of pynrrd, changed as other programs write it. change(header, data, path): the bytes of the file."""
    def make(path):
        nrrd.write(path + ".nrrd", cloth("i2"), {"encoding": "raw"}, index_order="C")
        with open(path + ".nrrd", "rb") as file:
            header, data = file.read().split(b"\n\n", 1)
        with open(path, "wb") as file:
            file.write(change(header, data, path))
        return Refused(words) if words is not None else Right(cloth("i2"), stated or {}, fields or {})
    return scan(name + suffix, make)


def beside(parts):
    """The header names files beside it, the samples divided among `parts` of them."""
    def change(header, data, path):
        stem = os.path.basename(path).split(".")[0]
        n = len(data) // parts
        for k in range(parts):
            with open(os.path.join(os.path.dirname(path), f"{stem}-{k}.raw"), "wb") as file:
                file.write(data[k * n:(k + 1) * n])
        names = "".join(f"\n{stem}-{k}.raw" for k in range(parts))
        return header + (b"\ndata file: " + names.strip().encode() if parts == 1 else b"\ndata file: LIST" + names.encode()) + b"\n"
    return change


def nrrds():
    yield nrrd_with("nrrd-comments", lambda h, d, p: h + b"\n# a comment\n#another\nsample:=woven\n\n" + d)
    yield nrrd_with("nrrd-byte-skip", lambda h, d, p: h + b"\nbyte skip: 7\n\n" + b"header!" + d)
    yield nrrd_with("nrrd-byte-skip-from-the-end", lambda h, d, p: h + b"\nbyte skip: -1\n\n" + b"junk before" + d)
    yield nrrd_with("nrrd-line-skip", lambda h, d, p: h + b"\nline skip: 2\n\n" + b"one\ntwo\n" + d)
    yield nrrd_with("nrrd-carriage-returns", lambda h, d, p: h.replace(b"\n", b"\r\n") + b"\r\n\r\n" + d)
    yield nrrd_with("nrrd-data-file", beside(1), ".nhdr")
    yield nrrd_with("nrrd-list-of-slices", beside(5), ".nhdr", words=("list of files",))
    yield nrrd_with("nrrd-thickness", lambda h, d, p: h + b"\nthicknesses: nan nan 3\n\n" + d, stated={"thickness of slices": "not_used"})
    yield nrrd_with("nrrd-origin", lambda h, d, p: h + b"\nspace: RAS\nspace origin: (1,2,3)\n\n" + d, stated={"origin": "not_used"})
    yield nrrd_with("nrrd-labels", lambda h, d, p: h + b'\nlabels: "x" "y" "z"\n\n' + d, stated={"labels of axes": None})
    yield nrrd_with("nrrd-unknown-field", lambda h, d, p: h + b"\nviewer zoom: 3\n\n" + d)


def metaimages():
    yield metaimage_edited("metaimage-size-of-elements", [(b"ElementSpacing = 1 1 1", b"ElementSize = 2 2 3")], Right)
    yield metaimage_edited("metaimage-origin", [(b"Offset = 0 0 0", b"Position = 5 6 7")], lambda v: Right(v, {"origin": None}))
    yield metaimage_edited("metaimage-anatomy", [(b"AnatomicalOrientation = RAI", b"AnatomicalOrientation = LPS")], Right)
    yield metaimage_edited("metaimage-two-channels", [(b"ElementType", b"ElementNumberOfChannels = 2\nElementType")], words=("channel",))
    yield metaimage_edited("metaimage-four-axes", [(b"NDims = 3", b"NDims = 4")], words=())

    def slices(path):
        value = cloth("u2")
        stem = os.path.basename(path)[:-4]
        for k, page in enumerate(value):
            with open(os.path.join(os.path.dirname(path), f"{stem}-{k:03d}.raw"), "wb") as file:
                file.write(page.astype("<u2").tobytes())
        with open(path, "w", encoding="ascii") as file:
            file.write("ObjectType = Image\nNDims = 3\nDimSize = 17 12 5\nElementType = MET_USHORT\nElementSpacing = 0.002 0.002 0.003\n"
                       f"ElementByteOrderMSB = False\nElementDataFile = {stem}-%03d.raw 0 4 1\n")
        return Refused(("list of files",))
    yield scan("metaimage-pattern.mhd", slices)


def variants():
    yield from itertools.chain(saturations(), colors(), carriers(), strangers(), nrrds(), metaimages())
    for codec, right in (("jpeg", 0.02), ("jpeg2000", Refused(("compress",))), ("jpegxl", Refused(("compress",))), ("png", Refused(("compress",)))):
        yield tiff_of_codec(codec, right)
    for turn in range(2, 9):
        yield turned_scan(turn)
    for make in (pyramid, one_directory, ome_in_reverse):
        yield scan("scan-" + make.__name__.replace("_", "-") + ".tif", make)
