"""What the files of a scan state beside their samples: `selvedge check` applies it, names the contradiction, or says why it is not
used. A volume of one value is refused with the value, which tells here which part of a file was read."""
import json
import os
import subprocess

import pytest
from daemon_under_test import program
from scan_file import imagej, metaimage, nrrd, page16, tag, tiff

pytestmark = pytest.mark.skipif(not os.access(program("selvedge-worker"), os.X_OK), reason="no selvedge-worker in the build folder")

W, H, Z = 12, 10, 6


def check(folder, name, data, **volume):
    (folder / name).write_bytes(data)
    (folder / "job.json").write_text(json.dumps({"sample": "s", "volume": {"files": [name], **volume}}))
    done = subprocess.run([program("selvedge"), "check", "--json", str(folder / "job.json")], capture_output=True, text=True, check=False)
    return json.loads(done.stdout)


def fault(report):
    assert len(report["faults"]) == 1, report
    return report["faults"][0]["field"], report["faults"][0]["detail"]


def statement(report, name):
    return next(s for f in report["files"] for s in f["statements"] if s["name"] == name)


def value_read(report):
    field, detail = fault(report)
    assert field == "volume.files" and "all voxels of the scan have the value" in detail, detail
    return float(detail.split()[-1])


def some(x, y):
    return 1000 + 10 * x + y


def slope(order="<"):
    return page16(some, W, H, order)


# ---- channels and times ----

def numbered(order, n):
    """Pages of the value 100 channel + 10 time, in an order such as CZT, the first letter fastest."""
    pages = []
    for a in range(n[order[2]]):
        for b in range(n[order[1]]):
            for c in range(n[order[0]]):
                at = dict(zip(order, (c, b, a)))
                pages.append(page16(100 * (at["C"] + 1) + 10 * (at["T"] + 1), W, H))
    return pages


def ome(order, n, more="", blocks=""):
    return tag(270, 2, '<?xml version="1.0" encoding="UTF-8"?><OME xmlns="http://www.openmicroscopy.org/Schemas/OME/2016-06"><Image ID="Image:0">'
               f'<Pixels ID="Pixels:0" DimensionOrder="XY{order}" Type="uint16" SizeX="{W}" SizeY="{H}" SizeZ="{n["Z"]}" SizeC="{n["C"]}" '
               f'SizeT="{n["T"]}" {more}>{blocks}</Pixels></Image></OME>')


N = {"C": 2, "Z": Z, "T": 3}
SHAPED = tag(270, 2, json.dumps({"shape": [3, Z, 2, H, W], "axes": "TZCYX"}))


@pytest.mark.parametrize("order, described", [
    ("CZT", imagej(images=36, channels=2, slices=Z, frames=3, hyperstack="true")),
    ("TZC", imagej(images=36, channels=2, slices=Z, frames=3, order="tzc")),
    ("ZCT", ome("ZCT", N)), ("CTZ", ome("CTZ", N)), ("TCZ", ome("TCZ", N)), ("CZT", SHAPED)],
    ids=["imagej", "imagej-order", "ome-zct", "ome-ctz", "ome-tcz", "tifffile"])
def test_one_channel_and_one_time_of_a_stack_is_read(tmp_path, order, described):
    data = tiff(numbered(order, N), W, H, first=[described])
    field, detail = fault(check(tmp_path, "s.tif", data, voxel_size_um=2))
    assert field == "volume.channel" and "2 channels" in detail and "1 to 2" in detail
    field, detail = fault(check(tmp_path, "s.tif", data, voxel_size_um=2, channel=1))
    assert field == "volume.time" and "3 times" in detail
    for channel in (1, 2):
        for time in (1, 2, 3):
            assert value_read(check(tmp_path, "s.tif", data, voxel_size_um=2, channel=channel, time=time)) == 100 * channel + 10 * time
    field, detail = fault(check(tmp_path, "s.tif", data, voxel_size_um=2, channel=3, time=1))
    assert field == "volume.channel" and "channel 3 is not there, the file has 2" in detail


def test_pages_of_ome_are_those_that_its_blocks_name(tmp_path):
    n = {"C": 2, "Z": 3, "T": 1}
    pages = [page16(v, W, H) for v in (7, 8, 7, 8, 7, 8)]
    blocks = "".join(f'<TiffData IFD="{2 * z + c}" FirstZ="{z}" FirstC="{c}" FirstT="0" PlaneCount="1"/>' for c in (1, 0) for z in (2, 0, 1))
    data = tiff(pages, W, H, first=[ome("ZCT", n, blocks=blocks)])
    assert value_read(check(tmp_path, "s.ome.tif", data, voxel_size_um=2, channel=1)) == 7
    assert value_read(check(tmp_path, "s.ome.tif", data, voxel_size_um=2, channel=2)) == 8


def test_a_description_of_other_pages_is_named(tmp_path):
    cut = tiff([slope()] * 5, W, H, first=[imagej(images=12, channels=2, slices=6)])
    assert "2 channels x 6 slices x 1 time, but there are 5 pages" in fault(check(tmp_path, "s.tif", cut, voxel_size_um=2, channel=1))[1]
    short = tiff([slope()] * 5, W, H, first=[imagej(images=12, slices=12)])
    assert "12 slices" in fault(check(tmp_path, "s.tif", short, voxel_size_um=2))[1]
    longer = check(tmp_path, "s.tif", tiff([slope()] * 5, W, H, first=[imagej(images=2, slices=2)]), voxel_size_um=2)
    assert longer["faults"] == [] and statement(longer, "slices")["use"] == "not_used"


def test_samples_of_a_pixel_are_channels(tmp_path):
    pixels = page16(lambda x, y: 5 if x % 2 == 0 else 9, 2 * W, H)
    data = tiff([pixels] * Z, W, H, every=[tag(277, 3, 2), tag(258, 3, 16, 16), tag(338, 3, 0)])
    assert fault(check(tmp_path, "s.tif", data, voxel_size_um=2))[0] == "volume.channel"
    assert [value_read(check(tmp_path, "s.tif", data, voxel_size_um=2, channel=c)) for c in (1, 2)] == [5, 9]
    alpha = check(tmp_path, "s.tif", tiff([pixels] * Z, W, H, every=[tag(277, 3, 2), tag(258, 3, 16, 16), tag(338, 3, 2)]), voxel_size_um=2)
    assert value_read(alpha) == 5 and statement(alpha, "alpha")["use"] == "not_used"


HEAD = {"type": "uint16", "encoding": "raw", "endian": "little"}


@pytest.mark.parametrize("sizes, kinds, word", [
    (f"2 {W} {H} {Z}", "list domain domain domain", "channel"), (f"{W} {H} {Z} 2", "space space space time", "time"),
    (f"{W} {H} 2 {Z}", "space space list space", "channel"), (f"{W} {H} {Z} 2", None, "channel"), (f"2 {W} {H} {Z}", None, "channel")],
    ids=["first", "time", "between-slices", "last-unnamed", "first-unnamed"])
def test_one_volume_of_an_nrrd_is_read(tmp_path, sizes, kinds, word):
    fields = {**HEAD, "dimension": 4, "sizes": sizes, **({"kinds": kinds} if kinds else {})}
    n = [int(x) for x in sizes.split()]
    at = {"first": 1, "last": n[0] * n[1] * n[2], "middle": W * H}[{0: "first", 3: "last", 2: "middle"}[n.index(2)]]
    data = b"".join((7 + (i // at) % 2).to_bytes(2, "little") for i in range(2 * W * H * Z))
    field, detail = fault(check(tmp_path, "s.nrrd", nrrd(fields, data), voxel_size_um=2))
    assert field == f"volume.{word}" and f"2 {word}s" in detail
    assert [value_read(check(tmp_path, "s.nrrd", nrrd(fields, data), voxel_size_um=2, **{word: c})) for c in (1, 2)] == [7, 8]


def test_one_volume_of_a_metaimage_is_read(tmp_path):
    head = {"NDims": 3, "DimSize": f"{W} {H} {Z}", "ElementSpacing": "0.002 0.002 0.002", "ElementNumberOfChannels": 3, "ElementType": "MET_USHORT"}
    data = b"".join((5 + i % 3).to_bytes(2, "little") for i in range(3 * W * H * Z))
    assert fault(check(tmp_path, "s.mha", metaimage(head, data)))[0] == "volume.channel"
    assert [value_read(check(tmp_path, "s.mha", metaimage(head, data), channel=c)) for c in (1, 2, 3)] == [5, 6, 7]
    head = {"NDims": 4, "DimSize": f"{W} {H} {Z} 2", "ElementSpacing": "0.002 0.002 0.002 1", "ElementType": "MET_USHORT"}
    data = b"".join((5 + i // (W * H * Z)).to_bytes(2, "little") for i in range(2 * W * H * Z))
    assert fault(check(tmp_path, "s.mha", metaimage(head, data)))[0] == "volume.time"
    assert [value_read(check(tmp_path, "s.mha", metaimage(head, data), time=c)) for c in (1, 2)] == [5, 6]


@pytest.mark.parametrize("kinds", ["RGB-color domain domain", "RGB-color space space space", "space space space RGBA-color"])
def test_colors_are_refused(tmp_path, kinds):
    n = len(kinds.split())
    sizes = {"RGB-color": 3, "RGBA-color": 4, "domain": 8, "space": 8}
    size = [sizes[k] for k in kinds.split()]
    count = 1
    for s in size:
        count *= s
    data = nrrd({"type": "uint8", "encoding": "raw", "dimension": n, "sizes": " ".join(map(str, size)), "kinds": kinds}, bytes(i % 251 for i in range(count)))
    assert "colors" in fault(check(tmp_path, "s.nrrd", data, voxel_size_um=2, channel=1))[1]


# ---- one directory ----

@pytest.mark.parametrize("order", ["<", ">"])
def test_images_that_follow_the_only_page_are_read(tmp_path, order):
    follow = b"".join(page16(3, W, H, order) for _ in range(Z - 1))
    first = [imagej(images=Z, slices=Z, unit="micron", spacing=2.5)]
    report = check(tmp_path, "s.tif", tiff([page16(3, W, H, order)], W, H, order=order, first=first, bare=follow))
    assert value_read(report) == 3 and statement(report, "voxel size")["value"] == "2.5 um along z (else the same) (ImageJ)"
    two = [imagej(images=Z, channels=2, slices=Z // 2)]
    mixed = b"".join(page16(3 + i % 2, W, H, order) for i in range(1, Z))
    assert value_read(check(tmp_path, "s.tif", tiff([page16(3, W, H, order)], W, H, order=order, first=two, bare=mixed), voxel_size_um=2, channel=2)) == 4
    cut = tiff([page16(3, W, H, order)], W, H, order=order, first=first, bare=follow[: 2 * W * H])
    assert f"{Z} slices x 1 time, but there is 1 page" in fault(check(tmp_path, "s.tif", cut))[1]


def test_slices_of_a_page_with_a_depth_are_read(tmp_path):
    page = b"".join(page16(4, W, H) for _ in range(Z))
    data = tiff([page[:2 * W * H]], W, H, first=[tag(32997, 4, Z)], bare=page[2 * W * H:])
    report = check(tmp_path, "s.tif", data, voxel_size_um=2)
    assert value_read(report) == 4 and statement(report, "ImageDepth")["value"] == f"{Z} slices in a page"
    assert "too short" in fault(check(tmp_path, "s.tif", tiff([page[:2 * W * H]], W, H, first=[tag(32997, 4, Z)]), voxel_size_um=2))[1]


# ---- lengths ----

@pytest.mark.parametrize("tags, value", [
    ([imagej(slices=Z, images=Z, unit="um", spacing=2.5), tag(282, 5, (1, 2)), tag(283, 5, (1, 2))], "2 x 2 x 2.5 um (ImageJ)"),
    ([imagej(slices=Z, images=Z, unit="\\u00B5m", spacing=-2), tag(282, 5, (1, 2)), tag(283, 5, (1, 2))], "2 x 2 x 2 um (ImageJ)"),
    ([imagej(slices=Z, images=Z, unit="mm", spacing="0.003"), tag(282, 5, (1000, 3)), tag(283, 5, (1000, 3))], "3 x 3 x 3 um (ImageJ)"),
    ([ome("ZCT", {"C": 1, "Z": Z, "T": 1}, 'PhysicalSizeX="2.5"')], "2.5 um along x (else the same) (OME)"),
    ([ome("ZCT", {"C": 1, "Z": Z, "T": 1}, 'PhysicalSizeX="1500" PhysicalSizeXUnit="nm" PhysicalSizeY="1.5" PhysicalSizeZ="0.003" '
          'PhysicalSizeYUnit="&#181;m" PhysicalSizeZUnit="mm"')], "1.5 x 1.5 x 3 um (OME)"),
    ([tag(296, 3, 3), tag(282, 5, (4000, 1)), tag(283, 5, (4000, 1))], "2.5 um along x, 2.5 um along y (else the same) (resolution tags)"),
], ids=["imagej", "escaped-unit", "millimetres", "ome-x", "ome-units", "per-cm"])
def test_lengths_of_a_tiff_apply(tmp_path, tags, value):
    report = check(tmp_path, "s.tif", tiff([slope()] * Z, W, H, first=tags))
    assert report["faults"] == [] and statement(report, "voxel size") == {"name": "voxel size", "value": value, "use": "applied", "reason": ""}
    size = check(tmp_path, "s.tif", tiff([slope()] * Z, W, H, first=tags), voxel_size_um=4)
    if "resolution tags" in value:
        assert size["faults"] == [] and statement(size, "voxel size")["use"] == "not_used"
    else:
        assert fault(size)[0] == "volume.voxel_size_um" and "the job says 4 um" in fault(size)[1] and "the file says" in fault(size)[1]


@pytest.mark.parametrize("tags", [[tag(296, 3, 2), tag(282, 5, (72, 1)), tag(283, 5, (72, 1))], [imagej(slices=Z, unit="pixel", spacing=2)],
                                  [imagej(images=Z, slices=Z, unit="inch"), tag(296, 3, 2), tag(282, 5, (100, 1)), tag(283, 5, (100, 1))],
                                  [tag(296, 3, 1), tag(282, 5, (1, 1)), tag(283, 5, (1, 1))]], ids=["72-dpi", "pixel", "inches-of-imagej", "ratio"])
def test_a_resolution_that_is_no_length_is_not_used(tmp_path, tags):
    assert fault(check(tmp_path, "s.tif", tiff([slope()] * Z, W, H, first=tags)))[0] == "volume.voxel_size_um"
    assert check(tmp_path, "s.tif", tiff([slope()] * Z, W, H, first=tags), voxel_size_um=2)["faults"] == []


@pytest.mark.parametrize("um", [20, 900, 0.011])
def test_a_voxel_that_shows_no_fiber_is_asked_about(tmp_path, um):
    field, detail = fault(check(tmp_path, "s.tif", tiff([slope()] * Z, W, H), voxel_size_um=um))
    assert field == "volume.voxel_size_um" and f"a voxel of {um} um shows no textile fiber" in detail
    assert check(tmp_path, "s.tif", tiff([slope()] * Z, W, H), voxel_size_um=um, fiber_diameter_voxel=8)["faults"] == []


# ---- directions ----

LPS = {**HEAD, "dimension": 3, "sizes": f"{W} {H} {Z}", "space": "left-posterior-superior"}


def directions(text, **fields):
    data = b"".join(slope() for _ in range(Z))
    return nrrd({**LPS, **fields, "space directions": text}, data)


@pytest.mark.parametrize("text, space, axes", [
    ("(0.002,0,0) (0,0.002,0) (0,0,0.002)", "LPS", "xyz"), ("(0.002,0,0) (0,0.002,0) (0,0,-0.002)", "LPS", "xy-z"),
    ("(0,0,0.002) (0,0.002,0) (0.002,0,0)", "LPS", "zyx"), ("(0,0.002,0) (0,0,0.002) (0.002,0,0)", "RAS", "zxy"),
    ("(0.002,0,0) (0,0.002,0) (0,0,0.002)", "left-anterior-superior", "x-yz")])
def test_directions_that_are_turns_or_mirrors_apply(tmp_path, text, space, axes):
    data = directions(text, space=space)
    report = check(tmp_path, "s.nrrd", data)
    assert report["faults"] == [] and statement(report, "directions of axes") == {"name": "directions of axes", "value": axes, "use": "applied", "reason": ""}
    assert check(tmp_path, "s.nrrd", data, axes=axes)["faults"] == []


def test_axes_of_the_document_do_not_mirror_those_of_the_file(tmp_path):
    mirrored = directions("(0.002,0,0) (0,0.002,0) (0,0,-0.002)")
    for axes in ("xyz", "yzx", "xz-y"):
        field, detail = fault(check(tmp_path, "s.nrrd", mirrored, axes=axes))
        assert field == "volume.axes" and f"'{axes}'" in detail and "'xy-z'" in detail
    report = check(tmp_path, "s.nrrd", mirrored, axes="xzy")
    assert report["faults"] == [] and statement(report, "directions of axes")["use"] == "not_used"
    head = {"NDims": 3, "DimSize": f"{W} {H} {Z}", "ElementSpacing": "0.002 0.002 0.002", "TransformMatrix": "1 0 0 0 1 0 0 0 -1", "ElementType": "MET_USHORT"}
    assert fault(check(tmp_path, "s.mha", metaimage(head, slope() * Z), axes="xyz"))[0] == "volume.axes"


def test_oblique_axes_need_a_matrix(tmp_path):
    data = directions("(0.002,0,0) (0.001,0.002,0) (0,0,0.002)")
    field, detail = fault(check(tmp_path, "s.nrrd", data))
    assert field == "volume.matrix" and "[1, 0.447214, 0, 0, 0.894427, 0, 0, 0, 1]" in detail
    report = check(tmp_path, "s.nrrd", data, matrix=[1, 0.447214, 0, 0, 0.894427, 0, 0, 0, 1])
    assert report["faults"] == [] and statement(report, "directions of axes")["use"] == "not_used"


def test_other_statements_are_named_with_the_reason(tmp_path):
    report = check(tmp_path, "s.tif", tiff([slope()] * Z, W, H, first=[tag(274, 3, 4), tag(281, 3, 4095)]), voxel_size_um=2)
    assert statement(report, "orientation")["use"] == "applied" and statement(report, "largest value")["value"] == "4095"
    report = check(tmp_path, "s.nrrd", directions("(0.002,0,0) (0,0.002,0) (0,0,0.002)", **{"space origin": "(1,2,3)"}))
    assert statement(report, "origin") == {"name": "origin", "value": "(1,2,3)", "use": "not_used", "reason": "the cloth begins at the corner of the scan"}
