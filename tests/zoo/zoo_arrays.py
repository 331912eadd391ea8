"""Scans of the zoo as arrays of NumPy and NIfTI images, written and read back by numpy and nibabel."""
import itertools

import nibabel
import numpy
from specimen import Refused, Right, scan
from zoo_scans import KINDS, SHAPE, cloth


def npy(name, kind="u2", order="<", fortran=False, version=(1, 0), value=None, words=None):
    def make(path):
        array = cloth(kind) if value is None else value
        array = array.astype(array.dtype.newbyteorder(order)) if array.dtype.names is None and array.dtype != object else array
        with open(path, "wb") as file:
            numpy.lib.format.write_array(file, numpy.asfortranarray(array) if fortran else array, version=version, allow_pickle=True)
        if words is not None:
            return Refused(words)
        back = numpy.load(path)
        if fortran:
            return Right(back.T, {"directions of axes": "applied"}, {"axes": "zyx", "size": list(SHAPE)})
        return Right(back, {}, {"size": list(SHAPE[::-1])})
    return scan(name + ".npy", make)


def npys():
    for kind, order in itertools.product(KINDS, "<>"):
        yield npy(f"npy-{kind}-{'big' if order == '>' else 'little'}", kind, order)
    for kind in ("u1", "f4"):
        yield npy(f"npy-fortran-{kind}", kind, fortran=True)
    for version in ((2, 0), (3, 0)):
        yield npy(f"npy-version-{version[0]}", version=version)
    yield npy("npy-half", value=cloth("f4").astype("f2"), words=("float32",))
    yield npy("npy-complex", value=cloth("f4").astype("c8"), words=("complex",))
    yield npy("npy-objects", value=numpy.array([{"a": 1}] * 8, dtype=object).reshape(2, 2, 2), words=("object",))
    yield npy("npy-records", value=numpy.zeros((3, 4, 5), dtype=[("a", "u1"), ("b", "u2")]), words=())
    yield npy("npy-flat", value=cloth("u2")[0], words=("three edges", "(12, 17)"))
    yield npy("npy-four-axes", value=cloth("u2", (2,) + SHAPE), words=("channel",))


def nifti(name, kind="i2", suffix=".nii", kinds=nibabel.Nifti1Image, spacing=(0.0025, 0.0025, 0.003), unit="mm", affine=None, change=None, words=None,
          stated=None, fields=None, shape=SHAPE):
    def make(path):
        array = cloth(kind, shape).T.copy()
        image = kinds(array, numpy.diag([*spacing, 1.0]) if affine is None else affine)
        image.header.set_data_dtype(array.dtype)
        image.header.set_xyzt_units(unit, "sec")
        if change:
            change(image)
        nibabel.save(image, path)
        if words is not None:
            return Refused(words)
        return Right(numpy.asarray(nibabel.load(path).dataobj).T, stated or {}, fields or {}, 1e-6)
    return scan(name + suffix, make)


def scaled(image):
    image.header.set_slope_inter(0.5, -3)


def turned_affine(columns):
    affine = numpy.eye(4)
    affine[:3, :3] = numpy.array(columns).T
    return affine


def niftis():
    size = {"voxel_size_um": [2.5, 2.5, 3.0], "axes": "xyz"}
    for kind, suffix in itertools.product(KINDS, (".nii", ".nii.gz")):
        yield nifti(f"nifti-{kind}", kind, suffix, fields=size)
    for kind in ("u1", "f4"):
        yield nifti(f"nifti-pair-{kind}", kind, ".hdr", nibabel.Nifti1Pair, fields=size)
        yield nifti(f"nifti-2-{kind}", kind, ".nii", nibabel.Nifti2Image, fields=size)
    yield nifti("nifti-micrometres", spacing=(2.5, 2.5, 3.0), unit="micron", fields=size)
    yield nifti("nifti-metres", spacing=(2.5e-6, 2.5e-6, 3e-6), unit="meter", fields=size)
    yield nifti("nifti-no-unit", unit="unknown", stated={"voxel size": "not_used"}, fields={"voxel_size_um": [None, None, None]})
    yield nifti("nifti-scaled", change=scaled, stated={"scale of values": "applied"})
    a, b = 0.0025, 0.003
    for axes, columns in {"-xyz": ((-a, 0, 0), (0, a, 0), (0, 0, b)), "xy-z": ((a, 0, 0), (0, a, 0), (0, 0, -b)),
                          "yxz": ((0, a, 0), (a, 0, 0), (0, 0, b))}.items():
        yield nifti(f"nifti-directions-{axes}", affine=turned_affine(columns), stated={"directions of axes": "applied"}, fields={"axes": axes})
    oblique = turned_affine(((0.9 * a, 0.43 * a, 0), (-0.43 * a, 0.9 * a, 0), (0, 0, b)))
    yield nifti("nifti-oblique", affine=oblique, fields={"oblique": True})
    yield nifti("nifti-times", shape=(3,) + SHAPE, words=("time",))
    colors = numpy.zeros(SHAPE[::-1], dtype=[("R", "u1"), ("G", "u1"), ("B", "u1")])

    def of_colors(path):
        nibabel.save(nibabel.Nifti1Image(colors, numpy.eye(4)), path)
        return Refused(("color",))
    yield scan("nifti-colors.nii", of_colors)


def arrays():
    yield from npys()
    yield from niftis()
