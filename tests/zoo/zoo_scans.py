"""Scans of the zoo: stacks of TIFF, ImageJ and OME, NRRD and MetaImage, written and read back by tifffile, pynrrd and SimpleITK."""
import itertools
import os
import struct

import nrrd
import numpy
import SimpleITK
import tifffile
from specimen import Refused, Right, scan

SHAPE = (5, 12, 17)  # slices, rows, columns
KINDS = ("u1", "i1", "u2", "i2", "u4", "i4", "f4", "f8")


def cloth(kind, shape=SHAPE):
    """Samples that no turn, mirror image or exchange of axes leaves as they are."""
    at = numpy.indices(shape)
    value = sum((7 * (i + 1) + i) * a for i, a in enumerate(reversed(at))) % 113 + (0.25 if kind[0] == "f" else 0)
    return value.astype(kind)


def tiff(name, kind="u2", stated=None, fields=None, shape=SHAPE, byteorder="<", bigtiff=False, **how):
    def make(path):
        with tifffile.TiffWriter(path, byteorder=byteorder, bigtiff=bigtiff) as writer:
            writer.write(cloth(kind, shape), metadata=None, **{"photometric": "minisblack", **how})
        return Right(tifffile.imread(path), stated or {}, {"size": [shape[2], shape[1], shape[0]], **(fields or {})})
    return scan(name + ".tif", make)


def tiff_stacks():
    for kind, order in itertools.product(KINDS, "<>"):
        yield tiff(f"stack-{kind}-{'big' if order == '>' else 'little'}", kind, byteorder=order)
    for kind, packing in itertools.product(("u1", "u2", "f4"), ("zlib", "lzw", "packbits", "zstd", "lzma")):
        yield tiff(f"stack-{kind}-{packing}", kind, compression=packing)
    for kind, packing, predictor in itertools.product(("u1", "u2", "f4"), ("zlib", "lzw"), (2, 3)):
        if predictor == (3 if kind[0] == "f" else 2):
            yield tiff(f"stack-{kind}-{packing}-predictor", kind, compression=packing, predictor=predictor)
    for kind, rows in itertools.product(("u1", "u2", "f4"), (1, 5, 12)):
        yield tiff(f"stack-{kind}-strips-of-{rows}", kind, rowsperstrip=rows)
    for kind, packing in itertools.product(("u1", "u2", "f4"), (None, "zlib")):
        yield tiff(f"stack-{kind}-tiles-{packing}", kind, tile=(16, 16), compression=packing)
    for order in "<>":
        yield tiff(f"stack-bigtiff-{'big' if order == '>' else 'little'}", bigtiff=True, byteorder=order)
    yield tiff("stack-volume-of-depth", tile=(2, 16, 16), volumetric=True, stated={"ImageDepth": "applied"})
    for unit, factor in ((2, 25400.0), (3, 10000.0)):
        yield tiff(f"stack-resolution-{unit}", resolution=(factor / 2.5, factor / 2.5), resolutionunit=unit,
                   stated={"voxel size": None}, fields={"voxel_size_um": [2.5, 2.5, None]})


def inverted(path):
    tifffile.imwrite(path, cloth("u1"), photometric="miniswhite", metadata=None)
    return Refused(("white is zero",))


def of_colors(path):
    tifffile.imwrite(path, numpy.stack([cloth("u1")] * 3, -1), photometric="rgb", metadata=None)
    return Refused(("color",))


def of_palette(path):
    tifffile.imwrite(path, cloth("u1"), photometric="palette", colormap=numpy.arange(768, dtype="u2").reshape(3, 256), metadata=None)
    return Refused(("palette",))


def pages_of_two_sizes(path):
    with tifffile.TiffWriter(path) as writer:
        for page in (cloth("u2")[0], cloth("u2")[1], cloth("u2", (3, 12, 16))[2]):
            writer.write(page, metadata=None, photometric="minisblack")
    return Refused(("17", "16"))


def pages_of_two_types(path):
    with tifffile.TiffWriter(path) as writer:
        for kind in ("u2", "u2", "u1"):
            writer.write(cloth(kind)[0], metadata=None, photometric="minisblack")
    return Refused(("16", "8"))


def of_complex_numbers(path):
    tifffile.imwrite(path, cloth("f4").astype("c8"), metadata=None)
    return Refused(("complex",))


def with_preview(path):
    """A small preview as a page of reduced resolution: no slice of the scan."""
    with tifffile.TiffWriter(path) as writer:
        for page in cloth("u2"):
            writer.write(page, metadata=None, photometric="minisblack")
        writer.write(cloth("u2", (1, 6, 8))[0], metadata=None, photometric="minisblack", subfiletype=1)
    return Right(cloth("u2"))


def truncated(path):
    tifffile.imwrite(path, cloth("u2"), metadata=None, photometric="minisblack")
    os.truncate(path, os.path.getsize(path) * 2 // 3)
    return Refused(())


def odd_tiffs():
    for make in (inverted, of_colors, of_palette, pages_of_two_sizes, pages_of_two_types, of_complex_numbers, with_preview, truncated):
        yield scan("tiff-" + make.__name__.replace("_", "-") + ".tif", make)


LENGTHS = {"micron": 1.0, "um": 1.0, "\\u00B5m": 1.0, "nm": 1e-3, "mm": 1e3, "cm": 1e4, "inch": 25400.0}


def imagej(name, unit):
    def make(path):
        pixel = 2.5 / LENGTHS[unit]
        tifffile.imwrite(path, cloth("u2"), imagej=True, resolution=(1 / pixel, 1 / pixel),
                         metadata={"axes": "ZYX", "unit": unit, "spacing": 3.0 / LENGTHS[unit]})
        return Right(tifffile.imread(path), {"voxel size": None}, {"voxel_size_um": [2.5, 2.5, 3.0]})
    return scan(name, make)


def hyperstack(name, axes, how, channel, time):
    """channel or time 0: the choice is left out, and the file is refused with the choice to write."""
    size = {"T": 3, "C": 2, "Z": 5, "Y": 12, "X": 17}

    def make(path):
        value = cloth("u2", tuple(size[a] for a in axes))
        tifffile.imwrite(path, value, photometric="minisblack", metadata={"axes": axes}, **how)
        part = tifffile.imread(path)
        missing = [word for word, letter, given in (("channel", "C", channel), ("time", "T", time)) if letter in axes and given == 0]
        if missing:
            return Refused((missing[0],))
        for letter, given in (("C", channel), ("T", time)):
            if letter in axes:
                part = numpy.take(part, given - 1, axis=axes.index(letter))
                axes_left = axes.replace(letter, "")
                if letter == "C" and "T" in axes_left:
                    part = numpy.take(part, time - 1, axis=axes_left.index("T"))
                    break
        return Right(part, {word: None for word, letter in (("channels", "C"),) if letter in axes})
    return scan(name, make, channel, time)


def microscopes():
    for i, unit in enumerate(LENGTHS):
        yield imagej(f"imagej-unit-{i}.tif", unit)
    for axes, channel, time in itertools.product(("ZCYX", "TZYX", "TZCYX"), (0, 2), (0, 3)):
        if (channel == 0 or "C" in axes) and (time == 0 or "T" in axes):
            yield hyperstack(f"imagej-{axes}-{channel}-{time}.tif", axes, {"imagej": True}, channel, time)
    for axes, channel, time in itertools.product(("CZYX", "ZCYX", "TZYX", "CTZYX", "TCZYX", "ZTCYX"), (0, 2), (0, 3)):
        if (channel == 0 or "C" in axes) and (time == 0 or "T" in axes):
            yield hyperstack(f"ome-{axes}-{channel}-{time}.ome.tif", axes, {"ome": True}, channel, time)
            yield hyperstack(f"shaped-{axes}-{channel}-{time}.tif", axes, {}, channel, time)
    for unit, factor in (("µm", 1.0), ("nm", 1e-3), ("mm", 1e3), ("Å", 1e-4)):
        def make(path, unit=unit, factor=factor):
            sizes = {f"PhysicalSize{a}": v / factor for a, v in (("X", 2.5), ("Y", 2.5), ("Z", 3.0))}
            tifffile.imwrite(path, cloth("u2"), ome=True, photometric="minisblack",
                             metadata={"axes": "ZYX", **sizes, **{f"PhysicalSize{a}Unit": unit for a in "XYZ"}})
            return Right(tifffile.imread(path), {"voxel size": None}, {"voxel_size_um": [2.5, 2.5, 3.0]})
        yield scan(f"ome-unit-{'um nm mm A'.split()[('µm', 'nm', 'mm', 'Å').index(unit)]}.ome.tif", make)


def nrrd_file(name, kind="i2", header=None, suffix=".nrrd", stated=None, fields=None, words=None, shape=SHAPE, **how):
    def make(path):
        nrrd.write(path, cloth(kind, shape), {**(header or {})}, index_order="C", **how)
        if words is not None:
            return Refused(words)
        return Right(nrrd.read(path, index_order="C")[0], stated or {}, fields or {})
    return scan(name + suffix, make)


def nrrd_files():
    for kind, encoding in itertools.product(KINDS, ("raw", "gzip")):
        yield nrrd_file(f"nrrd-{kind}-{encoding}", kind, {"encoding": encoding})
    for encoding in ("bzip2", "ascii"):
        yield nrrd_file("nrrd-" + encoding, "i2", {"encoding": encoding}, words=(encoding, "raw"))
    for kind, encoding in itertools.product(("u2", "f4"), ("raw", "gzip")):
        yield nrrd_file(f"nrrd-detached-{kind}-{encoding}", kind, {"encoding": encoding}, ".nhdr")
    for kind in ("u2", "i4", "f4"):
        yield nrrd_file(f"nrrd-big-{kind}", kind, {"endian": "big", "encoding": "raw"})
    size = {"voxel_size_um": [2.5, 2.5, 3.0]}
    for unit, factor in (("um", 1.0), ("mm", 1e3), ("nm", 1e-3), ("micron", 1.0), ("microns", 1.0)):
        spacing = {"spacings": [2.5 / factor, 2.5 / factor, 3 / factor], "units": [unit] * 3}
        yield nrrd_file(f"nrrd-spacings-{unit}", header=spacing, stated={"voxel size": None}, fields=size)
    a, b = 2.5e-3, 3e-3
    turns = {"xyz": ((a, 0, 0), (0, a, 0), (0, 0, b)), "-xyz": ((-a, 0, 0), (0, a, 0), (0, 0, b)), "x-yz": ((a, 0, 0), (0, -a, 0), (0, 0, b)),
             "xy-z": ((a, 0, 0), (0, a, 0), (0, 0, -b)), "yxz": ((0, a, 0), (a, 0, 0), (0, 0, b)), "zxy": ((0, a, 0), (0, 0, a), (b, 0, 0))}
    for axes, directions in turns.items():
        header = {"space": "right-anterior-superior", "space directions": numpy.array(directions), "space units": ["mm"] * 3}
        yield nrrd_file(f"nrrd-directions-{axes}", header=header, stated={"directions of axes": None}, fields={"axes": axes})
    oblique = numpy.array(((0.9 * a, 0.43 * a, 0), (-0.43 * a, 0.9 * a, 0), (0, 0, b)))
    yield nrrd_file("nrrd-oblique", header={"space": "right-anterior-superior", "space directions": oblique, "space units": ["mm"] * 3},
                    stated={"directions of axes": None}, fields={"oblique": True})
    yield nrrd_file("nrrd-four-axes", header={"kinds": ["domain", "domain", "domain", "list"]}, shape=(2,) + SHAPE, words=("channel",))
    yield nrrd_file("nrrd-times", header={"kinds": ["domain", "domain", "domain", "time"]}, shape=(2,) + SHAPE, words=("time",))
    yield nrrd_file("nrrd-colors", header={"kinds": ["RGB-color", "domain", "domain", "domain"]}, kind="u1", shape=SHAPE + (3,), words=("color",))
    yield nrrd_file("nrrd-limits", header={"old min": 0.0, "old max": 5.0}, stated={"smallest value": "not_used", "largest value": "not_used"})


PIXELS = {"u1": SimpleITK.sitkUInt8, "i1": SimpleITK.sitkInt8, "u2": SimpleITK.sitkUInt16, "i2": SimpleITK.sitkInt16,
          "u4": SimpleITK.sitkUInt32, "i4": SimpleITK.sitkInt32, "f4": SimpleITK.sitkFloat32, "f8": SimpleITK.sitkFloat64}


def metaimage(name, kind="i2", suffix=".mha", compressed=False, direction=None, fields=None, stated=None):
    def make(path):
        image = SimpleITK.GetImageFromArray(cloth(kind))
        image.SetSpacing((0.0025, 0.0025, 0.003))
        if direction is not None:
            image.SetDirection(direction)
        SimpleITK.WriteImage(image, path, compressed)
        return Right(SimpleITK.GetArrayFromImage(SimpleITK.ReadImage(path)), stated or {}, fields or {})
    return scan(name + suffix, make)


def metaimage_of_vectors(path):
    SimpleITK.WriteImage(SimpleITK.GetImageFromArray(numpy.stack([cloth("u1")] * 3, -1), isVector=True), path)
    return Refused(("channel",))


def metaimage_edited(name, change, right=None, words=None, kind="i2"):
    """A header of SimpleITK with lines that other programs write. right(samples): what they then mean."""
    def make(path):
        SimpleITK.WriteImage(SimpleITK.GetImageFromArray(cloth(kind)), path)
        with open(path, "rb") as file:
            data = file.read()
        for old, new in change:
            assert old in data, (name, old)
            data = data.replace(old, new, 1)
        with open(path, "wb") as file:
            file.write(data)
        return Refused(words) if words is not None else right(cloth(kind))
    return scan(name + ".mha", make)


def metaimages():
    for kind, suffix, compressed in itertools.product(KINDS, (".mha", ".mhd"), (False, True)):
        yield metaimage(f"metaimage-{kind}-{'packed' if compressed else 'plain'}", kind, suffix, compressed)
    for axes, direction in {"-xyz": (-1, 0, 0, 0, 1, 0, 0, 0, 1), "xy-z": (1, 0, 0, 0, 1, 0, 0, 0, -1), "yxz": (0, 1, 0, 1, 0, 0, 0, 0, 1),
                            "zxy": (0, 0, 1, 1, 0, 0, 0, 1, 0)}.items():
        yield metaimage(f"metaimage-directions-{axes}", direction=direction, stated={"directions of axes": None})
    yield scan("metaimage-vectors.mha", metaimage_of_vectors)
    yield metaimage_edited("metaimage-big", [(b"BinaryDataByteOrderMSB = False", b"BinaryDataByteOrderMSB = True")], lambda v: Right(v.byteswap()))
    yield metaimage_edited("metaimage-ascii", [(b"BinaryData = True", b"BinaryData = False")], words=("binary",))
    yield metaimage_edited("metaimage-header-size", [(b"CompressedData = False", b"HeaderSize = -1\nCompressedData = False")], Right)
    yield metaimage_edited("metaimage-comment", [(b"NDims = 3", b"NDims = 3\nComment = woven\nModality = MET_MOD_CT")], Right)


def named_as_another(path):
    """A JPEG that is called a scan."""
    with open(path, "wb") as file:
        file.write(b"\xff\xd8\xff\xe0" + struct.pack(">H", 16) + b"JFIF\0")
    return Refused(())


def scans():
    yield from tiff_stacks()
    yield from odd_tiffs()
    yield from microscopes()
    yield from nrrd_files()
    yield from metaimages()
    yield scan("no-scan.tif", named_as_another)
