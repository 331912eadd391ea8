"""Tables of a twin (optimizer/report/export/twin_result.h) whose drawing is known in closed form: two stripes along
x, every 10 mm, one three times as bright as the other, without change by direction but for the factor of a layer. "both" in the
sample's name: tables of both sides, where light from the other side is half as bright. "fibers" in it: twenty fibers
along x, a millimetre apart, that scatter evenly and see all of the sky."""
import json
import math
import os
import struct

TILE_MM, MEAN, CONTRAST, THROUGH = 20.0, (0.8, 0.5, 0.3), 0.5, 0.5
LAMP_MM, CAMERA_MM = 610.0, 1000.0
FIBER_MM, LOBE = 0.2, 0.02  # radius; S


def halves(values):
    return struct.pack(f"<{len(values)}e", *values)


def fiber_parts(at):
    """The parts "lobes" and "fibers" of twin.json, from the offset `at`, and their bytes."""
    half, difference, azimuth = 8, 2, 16
    lobes = halves([LOBE, LOBE, LOBE, 0] * (half * difference * azimuth))
    points = b""
    for i in range(20):
        for end in (0, 1):
            y = round(65535 * i / 19)
            points += struct.pack("<8I", 65535 * end | y << 16, 65535 << 16, end << 31, 0, 0xffffffff, 0xffffffff, 0, 0)
    bounds = {"radius_mm": FIBER_MM, "low": [0, 0.5, -FIBER_MM], "high": [TILE_MM, 19.5, -FIBER_MM]}
    parts = {"lobes": {"sets": 1, "azimuth": azimuth, "difference": difference, "half": half, "offset": at},
             "fibers": {"points": 40, **bounds, "offset": at + len(lobes)}}
    return parts, lobes + points


def write(folder, sample):
    texture = halves([x for i in range(4) for x in (1, 1 if i % 2 == 0 else -1, 0, 0)])  # 2 x 2 texels
    view, light = 2, 3
    sides = 2 if "both" in sample else 1
    through = [[1 if view_side == light_side else THROUGH for _ in range(view) for light_side in range(sides) for _ in range(light)]
               for view_side in range(sides) for _ in range(view * light)]
    table = halves([x for c in range(3) for row in through for t in row for x in (t * MEAN[c], t * CONTRAST * MEAN[c], 0, 0)])
    drape = struct.pack("<28H", *[x for j in range(3) for i in range(3) for x in (32767 * i, 32767 * j, 0)], 0)
    parts = {"textures": {"n": 4, "width": 2, "height": 2, "offset": 0},
             "table": {"view_edge": view, "light_edge": light, "sides": sides, "offset": len(texture)},
             "drape": {"points": 3, "size_mm": 40.0, "radius_mm": 10.0, "low": [-20, -20, 0], "high": [20, 20, 1], "offset": len(texture) + len(table)}}
    data = texture + table + drape
    if "fibers" in sample:
        more, block = fiber_parts(len(data))
        parts.update(more)
        data += block
    os.makedirs(os.path.join(folder, "twin"), exist_ok=True)
    with open(os.path.join(folder, "twin", "twin.bin"), "wb") as f:
        f.write(data)
    setup = {"lamp_distance_mm": LAMP_MM, "lamp_side_mm": 100.0, "camera_distance_mm": CAMERA_MM, "far_field": False}
    with open(os.path.join(folder, "twin", "twin.json"), "w", encoding="utf-8") as f:
        version = 2 if "fibers" in sample else 1
        json.dump({"format": f"selvedge-twin.v{version}", "sample": sample, "tile_mm": [TILE_MM, TILE_MM], "bytes": len(data), "mean_rel_rms": 0.05,
                   "mean_rel_noise": 0.03, "setup": setup, "parts": parts}, f)


def direction(theta, phi):
    t, p = math.radians(theta), math.radians(phi)
    return math.sin(t) * math.cos(p), math.sin(t) * math.sin(p), math.cos(t)


def expected(x, y, theta, phi, lamp_theta, lamp_phi, exposure):
    """sRGB bytes of the flat piece at (x, y) mm, in the middle of a stripe, under the lamp."""
    lamp = direction(lamp_theta, lamp_phi)
    to_lamp = [LAMP_MM * d - p for d, p in zip(lamp, (x, y, 0))]
    to_eye = [CAMERA_MM * d - p for d, p in zip(direction(theta, phi), (x, y, 0))]
    far = math.hypot(*to_lamp)
    cos_i, cos_o = abs(to_lamp[2]) / far, to_eye[2] / math.hypot(*to_eye)
    faces = sum(a * b for a, b in zip(lamp, to_lamp)) / far
    stripe = 1 + (CONTRAST if x % TILE_MM < TILE_MM / 2 else -CONTRAST)
    light = exposure * (1 if to_lamp[2] > 0 else THROUGH) * faces * (LAMP_MM / far) ** 2 * cos_i / (cos_i + cos_o) * stripe
    return [round(255 * min(1.0, 1.055 * v ** (1 / 2.4) - 0.055 if v > 0.0031308 else 12.92 * v)) for v in (light * m for m in MEAN)]
