"""Scans of programs for arrays and for medicine give the fibers of the same voxels as raw samples, bit by bit: NumPy's own .npy,
NIfTI by nibabel or by bytes, HDF5 by h5py. Each is judged by `selvedge check`, too."""
import gzip
import os
import struct
import subprocess

import pytest
from daemon_under_test import program
from test_scan_statements import check, fault, statement, value_read

pytestmark = [pytest.mark.slow, pytest.mark.skipif(not os.access(program("selvedge-worker"), os.X_OK), reason="no selvedge-worker in the build folder")]


@pytest.fixture(scope="module")
def cloth(tmp_path_factory):
    """Voxels of a small cloth, uint16, with the shape [z, y, x], as MetaImage has them."""
    numpy = pytest.importorskip("numpy")
    folder = tmp_path_factory.mktemp("phantom")
    subprocess.run([program("selvedge-phantom"), "cloth", "--weave", "plain", "--fibers-per-yarn", "7", "--metaimage", "--out", str(folder)],
                   check=True, capture_output=True)
    field = dict(line.split(" = ") for line in (folder / "scan.mhd").read_text().splitlines() if " = " in line)
    kind = {"MET_USHORT": "<u2", "MET_UCHAR": "u1", "MET_FLOAT": "<f4"}[field["ElementType"]]
    shape = [int(n) for n in field["DimSize"].split()][::-1]
    return numpy.fromfile(folder / field["ElementDataFile"], dtype=kind).reshape(shape)


def fibers(d, folder, scan):
    done = subprocess.run([program("selvedge"), "reconstruct", str(scan), "--voxel-um", "2", "--out", str(folder)],
                          env=dict(os.environ, SELVEDGE_SERVER=d.url, SELVEDGE_TOKEN=""), capture_output=True, text=True, timeout=1500)
    assert done.returncode == 0, done.stderr
    return (folder / "fibers.hair").read_bytes()


@pytest.fixture(scope="module")
def truth(real, cloth, tmp_path_factory):
    folder = tmp_path_factory.mktemp("truth")
    header = (f"ObjectType = Image\nNDims = 3\nDimSize = {' '.join(map(str, cloth.shape[::-1]))}\nElementType = "
              f"{'MET_USHORT' if cloth.dtype.itemsize == 2 else 'MET_UCHAR' if cloth.dtype.itemsize == 1 else 'MET_FLOAT'}\nElementDataFile = LOCAL\n")
    (folder / "scan.mha").write_bytes(header.encode() + cloth.tobytes())
    made = fibers(real, folder / "out", folder / "scan.mha")
    assert len(made) > 1000
    return made


def nifti_bytes(array, *, datatype, pixdim=(1, 2, 2, 2), units=3, times=1, srow=None):
    header = bytearray(352)
    struct.pack_into("<i", header, 0, 348)
    struct.pack_into("<8h", header, 40, 4, *array.shape[::-1], times, 1, 1, 1)
    struct.pack_into("<hh", header, 70, datatype, 8 * array.dtype.itemsize)
    struct.pack_into("<4f", header, 76, *pixdim)
    struct.pack_into("<f", header, 108, 352)
    header[123] = units
    if srow:
        struct.pack_into("<h", header, 254, 1)
        struct.pack_into("<12f", header, 280, *srow)
    header[344:348] = b"n+1\0"
    return bytes(header) + array.tobytes() * times


CODE = {1: 2, 2: 512, 4: 16}


@pytest.mark.parametrize("order", ["C", "F", "big"])
def test_numpy_arrays_give_the_fibers_of_raw_samples(real, cloth, truth, tmp_path, order):
    numpy = pytest.importorskip("numpy")
    array = cloth.astype(cloth.dtype.newbyteorder(">")) if order == "big" else numpy.asarray(cloth, order=order)
    numpy.save(tmp_path / "scan.npy", array)
    assert fibers(real, tmp_path / "out", tmp_path / "scan.npy") == truth


@pytest.mark.parametrize("name", ["scan.nii", "scan.nii.gz", "scan.hdr"])
def test_nifti_gives_the_fibers_of_raw_samples(real, cloth, truth, tmp_path, name):
    data = nifti_bytes(cloth, datatype=CODE[cloth.dtype.itemsize])
    if name == "scan.hdr":
        (tmp_path / "scan.img").write_bytes(data[352:])
        data = data[:108] + bytes(4) + data[112:344] + b"ni1\0"
    (tmp_path / name).write_bytes(gzip.compress(data) if name.endswith("gz") else data)
    assert fibers(real, tmp_path / "out", tmp_path / name) == truth


@pytest.mark.parametrize("kind", ["Nifti1Image", "Nifti2Image"])
def test_nibabel_writes_files_that_are_read(real, cloth, truth, tmp_path, kind):
    nibabel = pytest.importorskip("nibabel")
    numpy = pytest.importorskip("numpy")
    image = getattr(nibabel, kind)(cloth.transpose(2, 1, 0), numpy.diag([2, 2, 2, 1]))
    image.header.set_xyzt_units("micron")
    nibabel.save(image, str(tmp_path / "scan.nii.gz"))
    assert fibers(real, tmp_path / "out", tmp_path / "scan.nii.gz") == truth


@pytest.mark.parametrize("kept", [{}, {"compression": "gzip", "shuffle": True, "chunks": (16, 32, 32)}], ids=["plain", "gzip"])
def test_h5py_writes_files_that_are_read(real, cloth, truth, tmp_path, kept):
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "scan.h5", "w") as file:
        file.create_dataset("entry/volume", data=cloth, **kept)
    assert fibers(real, tmp_path / "out", tmp_path / "scan.h5") == truth


def dicom(path, pydicom, samples, **stated):
    """Writes a file of one or several frames; stated: further attributes."""
    meta = pydicom.dataset.FileMetaDataset()
    meta.TransferSyntaxUID = pydicom.uid.ExplicitVRLittleEndian
    meta.MediaStorageSOPClassUID = "1.2.840.10008.5.1.4.1.1.2"
    meta.MediaStorageSOPInstanceUID = pydicom.uid.generate_uid()
    d = pydicom.dataset.FileDataset(str(path), {}, file_meta=meta, preamble=bytes(128))
    d.is_little_endian, d.is_implicit_VR = True, False
    d.SeriesInstanceUID = "1.2.3"
    d.Rows, d.Columns = samples.shape[-2:]
    d.SamplesPerPixel, d.PhotometricInterpretation, d.PixelRepresentation = 1, "MONOCHROME2", 0
    d.BitsAllocated = d.BitsStored = 8 * samples.dtype.itemsize
    d.HighBit = d.BitsStored - 1
    for key, value in stated.items():
        setattr(d, key, value)
    d.PixelData = samples.tobytes()
    d["PixelData"].VR = "OW"
    d.save_as(str(path), write_like_original=False)


def test_a_folder_of_slices_that_pydicom_writes_is_read_by_positions(real, cloth, truth, tmp_path):
    pydicom = pytest.importorskip("pydicom")
    (tmp_path / "slices").mkdir()
    for z, page in enumerate(cloth):
        dicom(tmp_path / "slices" / f"I{7919 * (z + 3) % 1009:05}.dcm", pydicom, page, ImageOrientationPatient=[1, 0, 0, 0, 1, 0],
              ImagePositionPatient=[0, 0, 0.002 * z], PixelSpacing=[0.002, 0.002], SliceThickness=0.005)
    assert fibers(real, tmp_path / "out", tmp_path / "slices") == truth


def test_frames_of_one_file_are_read_by_positions(real, cloth, truth, tmp_path):
    pydicom = pytest.importorskip("pydicom")

    def group(**sequences):
        d = pydicom.dataset.Dataset()
        for name, members in sequences.items():
            inner = pydicom.dataset.Dataset()
            for key, value in members.items():
                setattr(inner, key, value)
            setattr(d, name, [inner])
        return d
    n = len(cloth)
    shared = group(PixelMeasuresSequence={"PixelSpacing": [0.002, 0.002]}, PlaneOrientationSequence={"ImageOrientationPatient": [1, 0, 0, 0, 1, 0]})
    frames = [group(PlanePositionSequence={"ImagePositionPatient": [0, 0, 0.002 * (n - z)]}) for z in range(n)]
    dicom(tmp_path / "all.dcm", pydicom, cloth[::-1].copy(), NumberOfFrames=n, SharedFunctionalGroupsSequence=[shared],
          PerFrameFunctionalGroupsSequence=frames)
    assert fibers(real, tmp_path / "out", tmp_path / "all.dcm") == truth


# ---- statements ----

def sample(numpy, value=1000):
    return numpy.full((6, 10, 12), value, dtype="<u2")


def test_statements_of_nifti(tmp_path):
    numpy = pytest.importorskip("numpy")
    report = check(tmp_path, "s.nii", nifti_bytes(sample(numpy), datatype=512))
    assert statement(report, "voxel size")["use"] == "applied" and statement(report, "voxel size")["value"] == "2 x 2 x 2 um"
    report = check(tmp_path, "s.nii", nifti_bytes(sample(numpy), datatype=512, units=0), voxel_size_um=2)
    assert statement(report, "voxel size")["use"] == "not_used"
    field, detail = fault(check(tmp_path, "s.nii", nifti_bytes(sample(numpy), datatype=512), voxel_size_um=5))
    assert field == "volume.voxel_size_um" and "2" in detail and "5" in detail
    field, detail = fault(check(tmp_path, "s.nii", nifti_bytes(sample(numpy), datatype=512, times=3)))
    assert field == "volume.time" and "3 times" in detail
    turned = nifti_bytes(sample(numpy), datatype=512, srow=(-2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0))
    assert statement(check(tmp_path, "s.nii", turned), "directions of axes")["value"] == "-xyz"
    sheared = nifti_bytes(sample(numpy), datatype=512, srow=(2, 1, 0, 0, 0, 3 ** .5, 0, 0, 0, 0, 2, 0))
    _, detail = fault(check(tmp_path, "s.nii", sheared))
    assert "matrix" in detail


def test_arrays_that_are_no_scan(tmp_path):
    numpy = pytest.importorskip("numpy")

    def saved(array):
        numpy.save(tmp_path / "a.npy", array)
        return (tmp_path / "a.npy").read_bytes()
    for array, field, text in [(numpy.zeros((4, 5)), "volume.files", "'shape'"), (numpy.zeros((4, 5, 6), dtype=complex), "volume.files", "complex"),
                               (numpy.zeros((4, 5, 6), dtype="i8"), "volume.files", "astype"),
                               (numpy.zeros((7, 4, 5, 6), dtype="u2"), "volume.channel", "7 channels")]:
        got, detail = fault(check(tmp_path, "s.npy", saved(array), voxel_size_um=2))
        assert got == field and text in detail, detail


def test_data_sets_of_hdf5(tmp_path):
    h5py = pytest.importorskip("h5py")
    numpy = pytest.importorskip("numpy")
    with h5py.File(tmp_path / "two.h5", "w") as file:
        for name, value in (("a/raw", 7), ("b", 9)):
            file[name] = sample(numpy, value)
            file[name].attrs["element_size_um"] = [2.5, 2, 2]
    data = (tmp_path / "two.h5").read_bytes()
    field, detail = fault(check(tmp_path, "s.h5", data))
    assert field == "volume.dataset" and "'a/raw', 'b'" in detail
    report = check(tmp_path, "s.h5", data, dataset="b")
    assert value_read(report) == 9 and statement(report, "voxel size")["value"] == "2 x 2 x 2.5 um (element_size_um)"
    field, detail = fault(check(tmp_path, "s.nii", nifti_bytes(sample(numpy), datatype=512), dataset="b"))
    assert field == "volume.dataset" and "no data sets" in detail


def test_hdf5_reaches_no_other_file(tmp_path):
    h5py = pytest.importorskip("h5py")
    numpy = pytest.importorskip("numpy")
    with h5py.File(tmp_path / "other.h5", "w") as file:
        file["d"] = sample(numpy)
    with h5py.File(tmp_path / "link.h5", "w") as file:
        file["d"] = h5py.ExternalLink(str(tmp_path / "other.h5"), "d")
    assert "no data set" in fault(check(tmp_path, "s.h5", (tmp_path / "link.h5").read_bytes(), voxel_size_um=2))[1]
    with h5py.File(tmp_path / "lzf.h5", "w") as file:
        file.create_dataset("d", data=sample(numpy), compression="lzf")
    assert "gzip" in fault(check(tmp_path, "s.h5", (tmp_path / "lzf.h5").read_bytes(), voxel_size_um=2))[1]
