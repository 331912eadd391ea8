"""Writes small scans with known fibers for bench_verdict. The generator shares no code with the product's phantoms: fibers
are drawn one by one into a grid of numbers. Each scan is NAME.mhd with NAME.raw (float, voxels of 2 um), and NAME.txt has
the true fibers as the product's text of fibers (absent where there is none).

    verdict_scans.py FOLDER [NAME ...]
"""
import math
import os
import sys
import zlib

import numpy as np

VOXEL_UM = 2.0
DEFAULT = {"kind": "gauze", "size": (112, 112, 72), "d": (7, 7), "rho": (1, 1), "n": 7, "snr": 5, "blur": 0.7, "corr": 0.5, "open": 1.5,
           "spread": 0.08, "balls": 0, "ball_radius": (3, 7), "hairs": 0, "fibers": 60, "cup": 0, "rim": 0, "pad": 0, "mixed": 0, "length": 0, "plate": 0,
           "lumen": 0, "solid": 0, "flat": 1, "plies": 1, "tilt": 0, "relax": 0,
           "blend": (), "ball_rho": (1, 1)}
TWILL = {"kind": "twill", "open": 1.05, "relax": 50}
SCANS = {
    "gauze": {}, "gauze-noisy": {"snr": 2.5}, "gauze-d10": {"d": (10, 10), "size": (128, 128, 96)},
    "gauze-35": {"rho": (1, 0.35)}, "gauze-50": {"rho": (1, 0.5)}, "gauze-70": {"rho": (0.7, 1)}, "gauze-20": {"rho": (0.2, 1)},
    "gauze-mixed": {"mixed": 0.4}, "gauze-few": {"rho": (1, 0.35), "open": 2.5},
    "gauze-diameters": {"d": (4.2, 11), "size": (128, 128, 88)}, "gauze-diameters2": {"d": (5, 9)}, "gauze-cup": {"cup": 0.4},
    "gauze-rim": {"cup": 0.3, "rim": 0.4},
    "gauze-pad": {"pad": 1}, "gauze-balls": {"balls": 120}, "gauze-particles": {"balls": 12, "ball_radius": (2, 4)}, "gauze-many": {"balls": 300},
    "gauze-hairs": {"hairs": 25}, "gauze-blur": {"blur": 1.5}, "gauze-plate": {"plate": 5},
    "twill": TWILL, "twill-noisy": {**TWILL, "snr": 2},
    "twill-d4": {**TWILL, "d": (4, 4), "size": (96, 96, 48)},
    "twill-d5": {**TWILL, "d": (5, 5), "size": (96, 96, 56)}, "twill-35": {**TWILL, "rho": (0.35, 1)},
    "twill-blur": {**TWILL, "blur": 1.6}, "twill-cup": {**TWILL, "cup": 0.5, "rim": 0.3},
    "twill-d3": {**TWILL, "d": (3, 3), "size": (80, 80, 40), "snr": 3},
    "twill-diameters": {**TWILL, "d": (5, 10), "size": (128, 128, 88)},
    "twill-slices": {**TWILL, "blur": (0.6, 0.6, 1.8)}, "twill-flat": {**TWILL, "flat": 1.8},
    "twill-plied": {**TWILL, "plies": 2, "n": 4, "snr": 2}, "twill-tilted": {**TWILL, "tilt": 30},
    "felt": {"kind": "felt"}, "felt-noisy": {"kind": "felt", "snr": 2}, "felt-dense": {"kind": "felt", "fibers": 130},
    "felt-mixed": {"kind": "felt", "mixed": 0.5},
    "felt-35": {"kind": "felt", "mixed": 0.8}, "felt-d4": {"kind": "felt", "d": (4, 4), "fibers": 100, "size": (96, 96, 64)},
    "felt-balls": {"kind": "felt", "balls": 150},
    "felt-spread": {"kind": "felt", "d": (5, 13), "fibers": 45}, "felt-short": {"kind": "felt", "length": 45, "fibers": 110},
    "felt-rim": {"kind": "felt", "cup": 0.4, "rim": 0.4},
    "felt-worst": {"kind": "felt", "snr": 1, "corr": 0.7}, "felt-pad": {"kind": "felt", "pad": 1},
    "felt-d12": {"kind": "felt", "d": (12, 12), "fibers": 28, "size": (128, 128, 96)},
    "balls": {"kind": "none", "balls": 350}, "balls-large": {"kind": "none", "balls": 120, "ball_radius": (6, 11)},
    "noise": {"kind": "none"}, "sponge": {"kind": "sponge"},
    "gauze-hollow": {"size": (96, 96, 64), "lumen": 0.4}, "gauze-hollow-noisy": {"size": (96, 96, 64), "lumen": 0.4, "snr": 3},
    "twill-hollow": {**TWILL, "size": (96, 96, 64), "lumen": 0.3},
    "twill-hollow-d6": {**TWILL, "size": (96, 96, 64), "d": (6, 6), "lumen": 0.4},
    "felt-hollow": {"kind": "felt", "size": (96, 96, 64), "lumen": 0.4},
    "felt-hollow-half": {"kind": "felt", "size": (96, 96, 64), "lumen": 0.4, "solid": 0.5},
}


def smooth(volume, sd):
    """A Gaussian by its Fourier transform, with the faces continued. sd: one, or those along x, y and z."""
    along = np.broadcast_to(sd, 3)[::-1]
    if not along.any():
        return volume
    edge = int(4 * max(along) + 2)
    padded = np.pad(volume, edge, mode="edge")
    transfer = [np.exp(-2 * (math.pi * w * np.fft.fftfreq(n)) ** 2) for w, n in zip(along, padded.shape[:2])]
    transfer.append(np.exp(-2 * (math.pi * along[2] * np.fft.rfftfreq(padded.shape[2])) ** 2))
    spectrum = np.fft.rfftn(padded) * transfer[0][:, None, None] * transfer[1][None, :, None] * transfer[2][None, None, :]
    result = np.fft.irfftn(spectrum, s=padded.shape, axes=(0, 1, 2))
    return result[edge:-edge, edge:-edge, edge:-edge]


def draw(volume, path, radius, rho):
    """Adds a fiber through the points of path (x, y, z, at most half a voxel apart) to a volume [z, y, x]."""
    size = np.array(volume.shape[::-1])
    cover = np.zeros_like(volume)
    for first in range(0, len(path), 8):
        part = path[first:first + 9]
        low = np.maximum(np.floor(part.min(0) - radius - 1.5), 0).astype(int)
        high = np.minimum(np.ceil(part.max(0) + radius + 1.5), size).astype(int)
        if np.any(high <= low):
            continue
        axes = [np.arange(a, b) + 0.5 for a, b in zip(low, high)]
        away = sum(np.square(axes[a][None] - part[:, a, None])[(slice(None),) + tuple(slice(None) if b == 2 - a else None for b in range(3))] for a in range(3))
        box = cover[low[2]:high[2], low[1]:high[1], low[0]:high[0]]
        np.maximum(box, np.clip(0.5 + radius - np.sqrt(away.min(0)), 0, 1), out=box)
    volume += rho * cover


def hexagon(n, pitch):
    """The n places of a hexagonal lattice that are nearest to the origin."""
    place = [(pitch * (i + 0.5 * j), pitch * math.sqrt(0.75) * j) for i in range(-6, 7) for j in range(-6, 7)]
    return np.array(sorted(place, key=lambda p: (round(math.hypot(*p), 6), math.atan2(p[1], p[0])))[:n])


def yarn(axis, twist, places, turn):
    """The fibers of a yarn along points of its axis, which lies in a plane upright to the cloth."""
    tangent = np.gradient(axis, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1)[:, None]
    across = np.cross(tangent, [0.0, 0.0, 1.0])
    across /= np.linalg.norm(across, axis=1)[:, None]
    up = np.cross(across, tangent)
    angle = turn + twist * np.arange(len(axis))
    c, s = np.cos(angle)[:, None], np.sin(angle)[:, None]
    return [axis + (p[0] * c - p[1] * s) * across + (p[0] * s + p[1] * c) * up for p in places]


def plied(o, axis, places, turn):
    """The fibers of a yarn whose plies, each like a yarn of its own, are twisted the other way round each other."""
    twist = 0.45 * 2 * math.pi / 150
    if o["plies"] == 1:
        return yarn(axis, twist, places, turn)
    width = np.linalg.norm(places, axis=1).max() + 0.5 * max(o["d"])
    center = [(width * math.cos(a), width * math.sin(a)) for a in 2 * math.pi * np.arange(o["plies"]) / o["plies"]]
    return [fiber for ply in yarn(axis, twist, center, turn) for fiber in yarn(ply, -2 * twist, places, turn)]


def tilted(path, o):
    """A path turned about the middle of the scan: about z, and then about x."""
    c, s = math.cos(math.radians(o["tilt"])), math.sin(math.radians(o["tilt"]))
    turn = np.array([[1, 0, 0], [0, c, -s], [0, s, c]]) @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    return (path - np.array(o["size"]) / 2) @ turn.T + np.array(o["size"]) / 2


def draw_flat(volume, path, radius, rho, flat, turn):
    """Adds a fiber whose section has the ratio of axes `flat` and the area of a disc of the radius: discs side by side."""
    thin = radius * math.sqrt(math.pi / (math.pi + 4 * (flat - 1)))
    tangent = np.gradient(path, axis=0)
    side = np.cross(tangent, [math.cos(turn), math.sin(turn), 0.5])
    side *= thin * (flat - 1) / np.linalg.norm(side, axis=1)[:, None]
    cover = np.zeros_like(volume)
    for at in np.linspace(-1, 1, 5):
        one = np.zeros_like(volume)
        draw(one, path + at * side, thin, rho)
        np.maximum(cover, one, out=cover)
    volume += cover


def pushes(place, radius, fiber):
    """Moves that take points of fibers that overlap most of the way apart: means over the points that each overlaps."""
    push, square = np.zeros_like(place), np.sum(np.square(place), 1)
    for first in range(0, len(place), 512):
        part = slice(first, first + 512)
        near = square[part, None] + square[None] - 2 * place[part] @ place.T
        i, j = np.nonzero(near < (2 * radius.max()) ** 2)
        i, j = (index[fiber[first + i] != fiber[j]] for index in (i, j))
        overlap = radius[first + i] + radius[j] - np.sqrt(np.maximum(near[i, j], 0.01))
        i, j, overlap = (x[overlap > 0] for x in (i, j, overlap))
        away = place[first + i] - place[j]
        away *= (0.7 * overlap / np.maximum(np.linalg.norm(away, axis=1), 0.1))[:, None]
        np.add.at(push, first + i, away)
        push[part] /= np.maximum(1, np.bincount(i, minlength=len(near)))[:, None]
    return push


def relaxed(fibers, o):
    """Fibers that pass through each other at crossings, pushed apart."""
    if o["relax"] == 0:
        return fibers
    stride, kernel = 8, np.hanning(7) / np.hanning(7).sum()
    sparse = [path[::stride] for path, _ in fibers]
    fiber = np.repeat(np.arange(len(sparse)), [len(p) for p in sparse])
    radius = np.array([0.51 * o["d"][kind] for _, kind in fibers])[fiber]
    start = place = np.concatenate(sparse)
    inside = np.all((place > -12) & (place < np.array(o["size"]) + 12), 1)
    for _ in range(o["relax"]):
        push = np.zeros_like(place)
        push[inside] = pushes(place[inside], radius[inside], fiber[inside])
        for f in range(len(sparse)):
            push[fiber == f] = np.stack([np.convolve(np.pad(x, 3, mode="edge"), kernel, "valid") for x in push[fiber == f].T], 1)
        place = place + push
    result = []
    for f, (path, kind) in enumerate(fibers):
        moved = (place - start)[fiber == f]
        path = path + np.stack([np.interp(np.arange(len(path)), stride * np.arange(len(moved)), x) for x in moved.T], 1)
        along = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])
        result.append([np.stack([np.interp(np.arange(0, along[-1], 0.45), along, x) for x in path.T], 1), kind])
    return result


def woven(o, rng):
    """Fibers of a weave: [path, kind], kind 0 along y and 1 along x."""
    nx, ny, nz = o["size"]
    fibers, places = [], [hexagon(o["n"], 1.1 * d) for d in o["d"]]
    width = [(np.linalg.norm(p, axis=1).max() + 0.5 * d) * (1 if o["plies"] == 1 else 2) for p, d in zip(places, o["d"])]
    reach = 0 if o["tilt"] == 0 else max(o["size"])
    spacing, height = 2 * o["open"] * max(width), 0.53 * (width[0] + width[1])
    for kind in (0, 1):
        length, n_across = (ny, nx) if kind == 0 else (nx, ny)
        step = np.arange(-reach - 8, length + reach + 8, 0.45)
        for i in range(-int(reach / spacing) - 1, int((n_across + reach) / spacing) + 2):
            phase = step / spacing
            if o["kind"] == "twill":
                wave = np.sin(0.5 * math.pi * (phase - i)) if kind == 0 else -np.sin(0.5 * math.pi * (i + 1 - phase))
                wave = smooth_wave(np.clip(1.6 * wave, -1, 1), spacing)
            else:
                wave = (1 if kind == 0 else -1) * (-1) ** i * np.sin(math.pi * phase)
            lateral = np.full_like(step, (i + 0.5) * spacing)
            axis = np.stack([lateral, step, nz / 2 + height * wave] if kind == 0 else [step, lateral, nz / 2 + height * wave], 1)
            fibers += [[path, kind] for path in plied(o, axis, places[kind], rng.uniform(0, 7))]
    return fibers


def smooth_wave(wave, spacing):
    width = max(3, int(0.8 * spacing))
    return np.convolve(np.pad(wave, width, mode="edge"), np.hanning(width) / np.hanning(width).sum(), "same")[width:-width]


def scattered(o, rng, n, taken):
    """Bent fibers in the plane that keep clear of each other and of the points `taken` (x, y, z, radius)."""
    nx, ny, nz = o["size"]
    fibers, points = [], list(taken)
    for _ in range(60 * n):
        if len(fibers) == n:
            break
        kind = int(rng.integers(2))
        radius, reach = 0.5 * o["d"][kind], o["length"] or 2 * (nx + ny)
        t = np.arange(-reach / 2, reach / 2, 0.45)
        angle = rng.uniform(0, math.pi) + 0.25 * np.sin(t / 40 + rng.uniform(0, 7))
        step = np.stack([np.cos(angle), np.sin(angle), 0.1 * np.sin(t / 30 + rng.uniform(0, 7))], 1)
        path = np.cumsum(0.45 * step, axis=0)
        path += rng.uniform(0, 1, 3) * [nx, ny, nz - 4 * radius] + [0, 0, 2 * radius] - path[len(path) // 2]
        path = path[np.all((path > -6) & (path < np.array([nx, ny, nz]) + 6), 1)]
        if len(path) < 40 or path[:, 2].min() < radius + 1 or path[:, 2].max() > nz - radius - 1:
            continue
        sparse = path[::4]
        if all(np.min(np.sum(np.square(q[:, None, :3] - sparse[None]), -1) - np.square(q[:, None, 3] + radius + 0.3)) > 0 for q in points):
            points.append(np.column_stack([sparse, np.full(len(sparse), radius)]))
            fibers.append([path, kind])
    return fibers, points


def add_balls(volume, o, rng, points):
    size = np.array(o["size"])
    for _ in range(o["balls"]):
        for _ in range(200):
            radius = rng.uniform(*o["ball_radius"])
            center = rng.uniform(radius + 1, size - radius - 1)
            if all(np.min(np.linalg.norm(q[:, :3] - center, axis=1) - q[:, 3]) > radius + 0.5 for q in points):
                points.append(np.array([[*center, radius]]))
                draw(volume, center[None], radius, 1.0 if o["ball_rho"] == (1, 1) else rng.uniform(*o["ball_rho"]))
                break


def light(o, shape):
    """What scanners add: a fall of the signal towards the middle, and a bright rim."""
    z, y, x = np.meshgrid(*[np.linspace(-1, 1, n) for n in shape], indexing="ij")
    return 1 - o["cup"] * np.exp(-1.5 * (x * x + y * y)), o["rim"] * np.clip(x * x + y * y, 0, 1) ** 2


def field_of_view(o):
    nx, ny, _ = o["size"]
    return lambda p: np.hypot(p[:, 0] - nx / 2, p[:, 1] - ny / 2) < 0.48 * min(nx, ny)


def truth_lines(fibers, o):
    """The parts of the fibers inside of the scan, in millimetres."""
    size, text = np.array(o["size"]), []
    for path, radius in fibers:
        inside = np.all((path >= 0) & (path <= size), 1)
        if o["pad"]:
            inside &= field_of_view(o)(path)
        for run in np.split(np.arange(len(path)), np.flatnonzero(np.diff(inside.astype(int))) + 1):
            if inside[run[0]] and len(run) > 12:
                text.append("\n".join("%.6f %.6f %.6f %.6f" % (*(1e-3 * VOXEL_UM * path[k]), 1e-3 * VOXEL_UM * radius) for k in run[::3]))
    return "\n\n".join(text)


def make(name, o, folder):
    rng = np.random.default_rng(zlib.crc32(name.encode()))
    volume = np.zeros(o["size"][::-1])
    fibers, points = [], []
    if o["kind"] in ("gauze", "twill"):
        fibers = relaxed([[tilted(path, o), kind] for path, kind in woven(o, rng)], o)
        points = [np.column_stack([p[::4], np.full(len(p[::4]), 0.5 * o["d"][kind])]) for p, kind in fibers]
    if o["kind"] == "felt" or o["hairs"]:
        more, points = scattered(o, rng, o["fibers"] if o["kind"] == "felt" else o["hairs"], points)
        fibers += more
    true = []
    for path, kind in fibers:
        radius = 0.5 * o["d"][kind] * (1 - o["spread"] * rng.uniform(0, 1))
        rho = 0.35 if rng.uniform() < o["mixed"] else o["rho"][kind]
        if o["blend"]:
            rho, part = o["blend"][rng.integers(len(o["blend"]))]
            radius *= part
        if o["flat"] > 1:
            draw_flat(volume, path, radius, rho, o["flat"], rng.uniform(0, 7))
        else:
            draw(volume, path, radius, rho)
        if o["lumen"] and rng.uniform() >= o["solid"]:
            draw(volume, path, o["lumen"] * radius, -rho)
        true.append((path, radius))
    add_balls(volume, o, rng, points)
    if o["kind"] == "sponge":
        field = smooth(rng.standard_normal(volume.shape), 4.0)
        volume = np.clip(0.5 + (field / field.std() - 0.6) * 2, 0, 1)
    if o["plate"]:
        volume[4:4 + o["plate"]] = 1
    gain, offset = light(o, volume.shape)
    volume = smooth(np.minimum(volume, 1), o["blur"]) * gain + offset
    noise = smooth(rng.standard_normal(volume.shape), o["corr"])
    volume = 1000 + 4000 * (volume + noise / noise.std() / o["snr"])
    if o["pad"]:
        z, y, x = np.meshgrid(*[np.arange(n) + 0.5 for n in volume.shape], indexing="ij")
        volume[~field_of_view(o)(np.stack([x.ravel(), y.ravel()], 1)).reshape(volume.shape)] = -32768
    write(folder, name, volume, truth_lines(true, o))


def write(folder, name, volume, truth):
    volume.astype("<f4").tofile(os.path.join(folder, name + ".raw"))
    with open(os.path.join(folder, name + ".mhd"), "w", encoding="utf-8") as f:
        f.write("ObjectType = Image\nNDims = 3\nDimSize = %d %d %d\nElementSpacing = %g %g %g\nElementType = MET_FLOAT\nElementDataFile = %s.raw\n"
                % (*volume.shape[::-1], *[1e-3 * VOXEL_UM] * 3, name))
    if truth:
        with open(os.path.join(folder, name + ".txt"), "w", encoding="utf-8") as f:
            f.write(truth + "\n")


def main():
    os.makedirs(sys.argv[1], exist_ok=True)
    for name in sys.argv[2:] or SCANS:
        make(name, {**DEFAULT, **SCANS[name]}, sys.argv[1])


if __name__ == "__main__":
    main()
