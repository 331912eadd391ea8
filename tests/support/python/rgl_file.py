"""Writes measured BRDFs in the format of RGL's database (Dupuy and Jakob 2018) from a function: the warp is sampled here, and inverted by the
reader. Written from the paper, without a line of the reader."""
import math
import struct


def direction(theta, phi):
    return (math.sin(theta) * math.cos(phi), math.sin(theta) * math.sin(phi), math.cos(theta))


def mix(a, b, share):
    return a + share * (b - a)


def bilinear(grid, u, v):
    """Value of grid[row][column] at u (along a row) and v in [0, 1]."""
    x, y = u * (len(grid[0]) - 1), v * (len(grid) - 1)
    i, j = min(int(x), len(grid[0]) - 2), min(int(y), len(grid) - 2)
    return mix(mix(grid[j][i], grid[j][i + 1], x - i), mix(grid[j + 1][i], grid[j + 1][i + 1], x - i), y - j)


def draw(density, share):
    """The place in [0, 1] below which a piecewise linear density has that share of its integral."""
    n = len(density) - 1
    left = share * sum(0.5 * (density[i] + density[i + 1]) for i in range(n))
    for i in range(n):
        a, b = density[i], density[i + 1]
        if left <= 0.5 * (a + b) or i == n - 1:
            t = left / a if abs(a - b) < 1e-9 * (a + b) else (math.sqrt(max(a * a + 2 * (b - a) * left, 0)) - a) / (b - a)
            return (i + min(max(t, 0), 1)) / n
        left -= 0.5 * (a + b)


def warp(density, s):
    """Place in the square of directions of the sample s: the row from the marginal, then the place in it."""
    v = draw([sum(row) - 0.5 * (row[0] + row[-1]) for row in density], s[1])
    y = v * (len(density) - 1)
    j = min(int(y), len(density) - 2)
    return draw([mix(a, b, y - j) for a, b in zip(density[j], density[j + 1])], s[0]), v


def slope_distribution(m):
    """A broad distribution of normals that is not the same along and across."""
    return 1 / (math.pi * 0.7 * 0.9 * ((m[0] / 0.7) ** 2 + (m[1] / 0.9) ** 2 + m[2] ** 2) ** 2)


class RglWriter:
    """brdf(light, camera) gives a list of values, one for each channel or wavelength. phi_i: azimuths of the light; one: isotropic."""

    def __init__(self, brdf, phi_i=(0.0,), theta_i=(0.0, 0.12, 0.25, 0.45, 0.7, 1.0, 1.25, 1.5), wavelengths=None, n_vndf=24, n_sample=24):
        self.brdf, self.phi_i, self.theta_i, self.wavelengths = brdf, phi_i, theta_i, wavelengths
        self.n_vndf, self.n_sample, self.isotropic = n_vndf, n_sample, len(phi_i) <= 2
        self.ndf = [[slope_distribution(self.normal((x / 15, y / 15), 0)) for x in range(16)] for y in range(16)]
        self.sigma = [[0.3 + 0.7 * math.cos((x / 15) ** 2 * math.pi / 2) for x in range(16)] for _ in range(2)]

    def normal(self, u, phi_light):
        return direction(u[0] ** 2 * math.pi / 2, (2 * u[1] - 1) * math.pi + phi_light)

    def density(self, theta, phi):
        """Density of visible normals over the square."""
        light, n = direction(theta, phi), self.n_vndf

        def one(u):
            m = self.normal(u, phi if self.isotropic else 0)
            facing = max(sum(a * b for a, b in zip(light, m)), 0)
            return facing * slope_distribution(m) * u[0] * math.sin(u[0] ** 2 * math.pi / 2) + 1e-3

        return [[one((x / (n - 1), y / (n - 1))) for x in range(n)] for y in range(n)]

    def value(self, u, theta, phi):
        """What the file holds for normal u: f cos theta_o 4 sigma / ndf."""
        light, m = direction(theta, phi), self.normal(u, phi if self.isotropic else 0)
        along = sum(a * b for a, b in zip(light, m))
        camera = [2 * along * b - a for a, b in zip(light, m)]
        sigma = bilinear(self.sigma, math.sqrt(theta * 2 / math.pi), (phi + math.pi) / (2 * math.pi))
        scale = 4 * sigma / bilinear(self.ndf, *u) * max(camera[2], 0)
        return [f * scale for f in self.brdf(light, camera)]

    def write(self, path):
        n, vndf, rows, luminance = self.n_sample, [], [], []
        for phi in self.phi_i:
            for theta in self.theta_i:
                density = self.density(theta, phi)
                vndf += [x for row in density for x in row]
                values = [self.value(warp(density, (x / (n - 1), y / (n - 1))), theta, phi) for y in range(n) for x in range(n)]
                rows += [v[c] for c in range(len(values[0])) for v in values]
                luminance += [sum(v) for v in values]
        light = [len(self.phi_i), len(self.theta_i)]
        n_level = len(rows) // len(luminance)
        fields = [("description", "B", [4], b"test"), ("phi_i", "f", light[:1], self.phi_i), ("theta_i", "f", light[1:], self.theta_i),
                  ("ndf", "f", [16, 16], sum(self.ndf, [])), ("sigma", "f", [2, 16], sum(self.sigma, [])),
                  ("vndf", "f", light + [self.n_vndf] * 2, vndf), ("luminance", "f", light + [n, n], luminance), ("jacobian", "B", [1], [1]),
                  ("spectra" if self.wavelengths else "rgb", "f", light + [n_level, n, n], rows)]
        if self.wavelengths:
            fields.append(("wavelengths", "f", [len(self.wavelengths)], self.wavelengths))
        write_tensors(path, fields)


def write_tensors(path, fields):
    head, data = b"tensor_file\0" + struct.pack("<BBI", 1, 0, len(fields)), b""
    start = len(head) + sum(2 + len(name) + 2 + 1 + 8 + 8 * len(shape) for name, _, shape, _ in fields)
    for name, kind, shape, values in fields:
        head += struct.pack("<H", len(name)) + name.encode() + struct.pack("<HBQ", len(shape), 1 if kind == "B" else 10, start + len(data))
        head += struct.pack(f"<{len(shape)}Q", *shape)
        data += struct.pack(f"<{len(values)}{kind}", *values)
    path.write_bytes(head + data)
