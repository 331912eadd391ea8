"""Fibers as Python lists, from and to .hair files (docs/file-formats.md), and cloths that are the same as another one or
nearly so. A fiber is a list of vertices (x, y, z, radius) in millimetres."""
import dataclasses
import math
import struct


@dataclasses.dataclass
class Fibers:
    tile: tuple
    fibers: list

    @staticmethod
    def read(path):
        """Strands of one group without sections."""
        with open(path, "rb") as f:
            data = f.read()
        n_strand, n_point = struct.unpack_from("<II", data, 4)
        tile = data[40:128].split(b"tile_mm=")[1].split(b"\0")[0].split()[0]
        counts = struct.unpack_from(f"<{n_strand}H", data, 128)
        at = 128 + 2 * n_strand
        xyz = struct.unpack_from(f"<{3 * n_point}f", data, at)
        thickness = struct.unpack_from(f"<{n_point}f", data, at + 12 * n_point)
        fibers, v = [], 0
        for count in counts:
            fibers.append([(*xyz[3 * i:3 * i + 3], thickness[i] / 2) for i in range(v, v + count + 1)])
            v += count + 1
        return Fibers(tuple(float(x) for x in tile.split(b",")), fibers)

    def write(self, path):
        n_point = sum(len(f) for f in self.fibers)
        text = f"selvedge tile_mm={self.tile[0]:.9g},{self.tile[1]:.9g}".encode()
        with open(path, "wb") as f:
            f.write(b"HAIR" + struct.pack("<IIIIfffff", len(self.fibers), n_point, 7, 0, 0, 0, 1, 1, 1) + text.ljust(88, b"\0"))
            f.write(struct.pack(f"<{len(self.fibers)}H", *(len(x) - 1 for x in self.fibers)))
            for fiber in self.fibers:
                f.write(b"".join(struct.pack("<3f", *v[:3]) for v in fiber))
            for fiber in self.fibers:
                f.write(struct.pack(f"<{len(fiber)}f", *(2 * v[3] for v in fiber)))
        return path

    def subdivided(self, n):
        """Every segment cut into n."""
        def cut(fiber):
            out = [fiber[0]]
            for p, q in zip(fiber, fiber[1:]):
                out += [between(p, q, k / n) for k in range(1, n + 1)]
            return out
        return Fibers(self.tile, [cut(f) for f in self.fibers])

    def coarse(self, n):
        """Every n-th vertex, and both ends."""
        return Fibers(self.tile, [f[:-1:n] + [f[-1]] for f in self.fibers])

    def reordered(self):
        """The last fiber first."""
        return Fibers(self.tile, self.fibers[::-1])

    def repeated(self, nx, ny):
        """A tile of nx x ny of the present ones."""
        fibers = [[(x + i * self.tile[0], y + j * self.tile[1], z, r) for x, y, z, r in f]
                  for i in range(nx) for j in range(ny) for f in self.fibers]
        return Fibers((nx * self.tile[0], ny * self.tile[1]), fibers)

    def beginning_at(self, x0, y0):
        """The same endless cloth in a tile that begins at x0, y0: fibers are cut at its faces, and the pieces move into it."""
        fibers = self.fibers
        for axis, start in ((0, x0), (1, y0)):
            fibers = [piece for f in fibers for piece in self._cut(f, axis, start)]
        return Fibers(self.tile, fibers)

    def _cut(self, fiber, axis, start):
        tile = self.tile[axis]
        number = lambda v: (v[axis] - start) / tile
        pieces, piece = [], [fiber[0]]
        for p, q in zip(fiber, fiber[1:]):
            low, high = sorted((number(p), number(q)))
            faces = [k for k in range(math.floor(low) + 1, math.ceil(high)) if low < k < high]
            for k in faces if number(p) < number(q) else faces[::-1]:
                middle = between(p, q, (k - number(p)) / (number(q) - number(p)))
                pieces.append(piece + [middle])
                piece = [middle]
            piece.append(q)
        pieces.append(piece)
        return [self._moved(piece, axis, -math.floor((number(piece[0]) + number(piece[-1])) / 2)) for piece in pieces]

    def _moved(self, fiber, axis, n):
        return [tuple(x + n * self.tile[axis] if k == axis else x for k, x in enumerate(v)) for v in fiber]


def between(p, q, t):
    return tuple(a + t * (b - a) for a, b in zip(p, q))


def straight_plies(length, n_layer=4, n_side=6, radius=0.008, gap=1.15):
    """Straight fibers along x in hexagonal layers; the tile is `length` long, which changes nothing of the endless cloth."""
    width = 2 * radius * gap
    fibers = [[(0.0, (i + 0.25 + 0.5 * (layer % 2)) * width, -layer * width * math.sqrt(0.75), radius) for x in (0, 1)]
              for layer in range(n_layer) for i in range(n_side)]
    fibers = [[f[0], (length,) + f[1][1:]] for f in fibers]
    return Fibers((length, n_side * width), fibers)


def write_half_cylinder(path, radius=6.0, length=14.0, n=24):
    """Mesh (.obj, millimetres) of a bent strip whose highest line runs through the origin along y."""
    half_angle = 1.2
    with open(path, "w", encoding="utf-8") as f:
        for i in range(n + 1):
            a = (2 * i / n - 1) * half_angle
            for y in (-length / 2, length / 2):
                f.write(f"v {radius * math.sin(a):.9g} {y:.9g} {radius * (math.cos(a) - 1):.9g}\nvt {radius * a:.9g} {y:.9g}\n")
        for i in range(n):
            p = 2 * i + 1
            f.write(f"f {p}/{p} {p + 2}/{p + 2} {p + 3}/{p + 3}\nf {p}/{p} {p + 3}/{p + 3} {p + 1}/{p + 1}\n")
    return path
