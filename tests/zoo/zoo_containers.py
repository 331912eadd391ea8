"""Scans of the zoo in HDF5 and DICOM, written and read back by h5py and pydicom."""
import itertools
import os

import h5py
import numpy
import pydicom
from pydicom.dataset import FileDataset, FileMetaDataset
from pydicom.uid import CTImageStorage, ExplicitVRBigEndian, ExplicitVRLittleEndian, ImplicitVRLittleEndian, RLELossless, SecondaryCaptureImageStorage
from specimen import Refused, Right, beside, scan
from zoo_scans import KINDS, SHAPE, cloth


# ---- HDF5

def hdf5(name, fill, right=None, words=None, dataset="", channel=0, stated=None, fields=None):
    """fill(file): puts the data sets into it. right: name of the data set that is read."""
    def make(path):
        with h5py.File(path, "w") as file:
            fill(file)
        if words is not None:
            return Refused(words)
        with h5py.File(path) as file:
            return Right(file[right][()], {"data set": "applied", **(stated or {})}, fields or {})
    return scan(name + ".h5", make, channel=channel, dataset=dataset)


def one_set(kind="u2", where="volume", **how):
    def fill(file):
        file.create_dataset(where, data=cloth(kind), **how)
    return fill


def two_sets(file):
    file["raw"] = cloth("u2")
    file["a/b/mask"] = cloth("u1")


def with_size(file):
    file.create_dataset("volume", data=cloth("u2")).attrs["element_size_um"] = [3.0, 2.5, 2.5]


def with_uncertain_size(file):
    file.create_dataset("volume", data=cloth("u2")).attrs["spacing"] = [3.0, 2.5, 2.5]


def linked(file):
    file["volume"] = h5py.ExternalLink("/etc/passwd", "/x")


def external(file):
    file.create_dataset("volume", shape=SHAPE, dtype="u1", external=[("/etc/passwd", 0, h5py.h5f.UNLIMITED)])


def virtual(file):
    layout = h5py.VirtualLayout(shape=SHAPE, dtype="u2")
    layout[:] = h5py.VirtualSource("other.h5", "x", shape=SHAPE)
    file.create_virtual_dataset("volume", layout)


def half_written(file):
    file.create_dataset("volume", shape=SHAPE, dtype="u2", chunks=(1, 12, 17), compression="gzip")[:3] = cloth("u2")[:3]


def soft_link(file):
    file["real"] = cloth("u2")
    file["alias"] = h5py.SoftLink("/real")


def hdf5s():
    for kind, order in itertools.product(KINDS, "<>"):
        yield hdf5(f"hdf5-{kind}-{'big' if order == '>' else 'little'}", one_set(order + kind), "volume")
    for kind, packing in itertools.product(("u1", "u2", "f4"), ({"compression": "gzip"}, {"compression": "gzip", "shuffle": True}, {"compression": "lzf"},
                                                                {"fletcher32": True}, {"scaleoffset": 0})):
        if "scaleoffset" in packing and kind == "f4":
            continue
        words = ("filter",) if packing.get("compression") == "lzf" or "scaleoffset" in packing else None
        yield hdf5(f"hdf5-{kind}-{'-'.join(map(str, packing.values())).lower()}-{'-'.join(packing)}",
                   one_set(kind, chunks=(2, 6, 8), **packing), "volume", words)
    yield hdf5("hdf5-deep", one_set(where="entry/data/volume"), "entry/data/volume")
    yield hdf5("hdf5-void", lambda f: f.create_dataset("volume", data=numpy.zeros(SHAPE, "u2"), chunks=(5, 12, 17), compression="gzip"), "volume")
    yield hdf5("hdf5-two", two_sets, words=("dataset", "raw", "mask"))
    yield hdf5("hdf5-two-chosen", two_sets, "a/b/mask", dataset="a/b/mask")
    yield hdf5("hdf5-two-misspelt", two_sets, dataset="rwa", words=("rwa", "raw"))
    yield hdf5("hdf5-size", with_size, "volume", stated={"voxel size": None}, fields={"voxel_size_um": [2.5, 2.5, 3.0]})
    yield hdf5("hdf5-uncertain-size", with_uncertain_size, "volume", stated={"attribute spacing": "not_used"})
    yield hdf5("hdf5-half-written", half_written, "volume", stated={"missing chunks": "applied"})
    yield hdf5("hdf5-soft-link", soft_link, "real")
    for fill in (linked, external, virtual):
        yield hdf5("hdf5-" + fill.__name__, fill, words=())
    yield hdf5("hdf5-flat", lambda f: f.create_dataset("picture", data=cloth("u2")[0]), words=("three dimensions",))
    yield hdf5("hdf5-complex", lambda f: f.create_dataset("volume", data=cloth("f4").astype("c8")), words=())
    yield hdf5("hdf5-channels", lambda f: f.create_dataset("volume", data=cloth("u2", (2,) + SHAPE)), words=("channel",))


# ---- DICOM

def slice_of(k, pages, syntax=ExplicitVRLittleEndian, change=None):
    """A slice of a CT (PS3.3, A.3), 2.5 x 2.5 x 3 um."""
    meta = FileMetaDataset()
    meta.MediaStorageSOPClassUID, meta.TransferSyntaxUID = CTImageStorage, syntax
    meta.MediaStorageSOPInstanceUID = f"1.2.3.{k + 1}"
    data = FileDataset("", {}, file_meta=meta, preamble=b"\0" * 128)
    data.SOPClassUID, data.SOPInstanceUID, data.SeriesInstanceUID, data.Modality = CTImageStorage, f"1.2.3.{k + 1}", "1.2.9", "CT"
    data.Rows, data.Columns, data.SamplesPerPixel, data.PhotometricInterpretation = *pages.shape[1:], 1, "MONOCHROME2"
    data.BitsAllocated = data.BitsStored = 8 * pages.dtype.itemsize
    data.HighBit, data.PixelRepresentation = data.BitsStored - 1, int(pages.dtype.kind == "i")
    data.PixelSpacing, data.ImageOrientationPatient = [0.0025, 0.0025], [1, 0, 0, 0, 1, 0]
    data.ImagePositionPatient, data.InstanceNumber = [0, 0, 0.003 * k], k + 1
    big = syntax == ExplicitVRBigEndian
    data.PixelData = pages[k].astype(pages.dtype.newbyteorder(">" if big else "<")).tobytes()
    data["PixelData"].VR = "OW" if pages.dtype.itemsize == 2 else "OB"
    if change:
        change(data, k)
    return data


def dicom(name, kind="i2", order=None, syntax=ExplicitVRLittleEndian, change=None, right=None, words=None, stated=None, fields=None, parts=SHAPE[0]):
    """order: numbers of the slices in the order of the files. right(samples): values of the scan; default: as pydicom reads them."""
    def make(path):
        pages = cloth(kind)
        for i, k in enumerate(order or range(parts)):
            pydicom.dcmwrite(path if i == 0 else beside(path, i), slice_of(k, pages, syntax, change), enforce_file_format=True)
        if words is not None:
            return Refused(words)
        read = [pydicom.dcmread(path if i == 0 else beside(path, i)) for i in range(parts)]
        read.sort(key=lambda d: float(d.ImagePositionPatient[2]) if "ImagePositionPatient" in d else int(d.InstanceNumber))
        values = numpy.stack([d.pixel_array * float(d.get("RescaleSlope", 1)) + float(d.get("RescaleIntercept", 0)) for d in read])
        return Right(right(values) if right else values, stated or {}, {"size": [SHAPE[2], SHAPE[1], parts], **(fields or {})}, 1e-6)
    return scan(name + ".dcm", make, parts=parts)


def frames(path):
    """All slices as frames of one file (secondary capture, PS3.3 A.8.4)."""
    pages = cloth("u2")
    data = slice_of(0, pages)
    data.SOPClassUID = data.file_meta.MediaStorageSOPClassUID = SecondaryCaptureImageStorage
    data.NumberOfFrames, data.PixelData = SHAPE[0], pages.astype("<u2").tobytes()
    data.SpacingBetweenSlices = 0.003
    del data.ImagePositionPatient
    data.save_as(path, enforce_file_format=True)
    return Right(pydicom.dcmread(path).pixel_array)


def setting(**members):
    def change(data, _):
        for name, value in members.items():
            setattr(data, name, value)
    return change


def without_position(data, _):
    del data.ImagePositionPatient


def packed(data, _):
    data.compress(RLELossless)


def other_series(data, k):
    data.SeriesInstanceUID = "1.2.9" if k < 3 else "1.2.10"


def dicoms():
    size = {"voxel_size_um": [2.5, 2.5, 3.0]}
    for kind, (name, syntax) in itertools.product(("u1", "u2", "i2"), (("explicit", ExplicitVRLittleEndian), ("implicit", ImplicitVRLittleEndian),
                                                                       ("big", ExplicitVRBigEndian))):
        if name != "big" or kind != "u1":
            yield dicom(f"dicom-{kind}-{name}", kind, syntax=syntax, fields=size)
    yield dicom("dicom-shuffled", order=(3, 0, 4, 2, 1), stated={"order of slices": "applied"})
    yield dicom("dicom-by-number", order=(3, 0, 4, 2, 1), change=without_position, stated={"order of slices": "applied"})
    yield dicom("dicom-scaled", change=setting(RescaleSlope=0.5, RescaleIntercept=-100), stated={"scale of values": "applied"})
    yield dicom("dicom-inverted", "u2", change=setting(PhotometricInterpretation="MONOCHROME1"), right=lambda v: 65535 - v,
                stated={"photometric sense": "applied"})
    yield dicom("dicom-twelve-bits", "u2", change=setting(BitsStored=12, HighBit=11), stated={"significant bits": None})
    yield dicom("dicom-thickness", change=setting(SliceThickness=0.004), stated={"thickness of slices": "not_used"}, fields=size)
    yield dicom("dicom-padding", change=setting(PixelPaddingValue=5), fields={"padding": 5.0})
    yield dicom("dicom-gap", order=(0, 1, 3, 4), parts=4, words=("missing",))
    yield dicom("dicom-double", order=(0, 1, 1, 2), parts=4, words=("same place",))
    yield dicom("dicom-two-series", change=other_series, words=("series",))
    yield dicom("dicom-colors", "u1", change=setting(PhotometricInterpretation="RGB", SamplesPerPixel=3, PlanarConfiguration=0), words=("color",))
    yield dicom("dicom-packed", "u2", change=packed, words=("compress", "RLE"))
    yield scan("dicom-frames.dcm", frames)

    def cut(path):
        slice_of(0, cloth("u2")).save_as(path, enforce_file_format=True)
        os.truncate(path, os.path.getsize(path) - 50)
        return Refused(())
    yield scan("dicom-cut.dcm", cut)


def containers():
    yield from hdf5s()
    yield from dicoms()
