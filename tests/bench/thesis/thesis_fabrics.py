"""Table 5.3 of the fabric thesis, and the configurations of its sections 5.5.2 and 5.7.2.

The cloths are those of six_fabrics.py: described ones of the same weave, because the scans are not public. A value that Table 5.3 rounds
to the bound of a range is taken as it is printed.

Configurations: figure 5.6 prints four pairs of elevations in four rows, of which the odd and the even differ in the rotation of the cloth, the
first two have lamp and camera in one plane, and the last holds 64 degrees in place of 80. The text names 80 degrees only; the other
elevations are ours. The 492 further configurations of [39] are not printed: ours are six elevations of the lamp, two rotations of the
cloth, and 41 directions of the camera: the normal, and five elevations at eight azimuths.
"""
import os
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "pictures"))
from six_fabrics import FABRIC  # noqa: E402

NAMES = list(FABRIC)
MODELS = {"two_lobe": "two_lobe.v1", "volume": "phase_two_lobe.v1", "microflake": "microflake.v1"}

# C_R, C_TT, beta_R, beta_TT, gamma_TT, alpha
VOLUME = {
    "fleece": ([0.032, 0.049, 0.055], [0.759, 0.622, 0.999], 3.786, 10.0, 21.865, [0.631, 0.840, 0.972]),
    "gabardine": ([0.110, 0.035, 0.048], [0.868, 0.633, 0.592], 5.034, 10.0, 23.902, [0.993, 0.651, 0.698]),
    "silk": ([0.992, 0.001, 0.034], [0.002, 0.690, 0.570], 1.0, 10.0, 13.900, [0.940, 0.746, 0.773]),
    "velvet": ([0.969, 0.985, 0.986], [0.006, 0.003, 0.003], 10.0, 10.0, 45.0, [0.388, 0.310, 0.316]),
    "twill": ([0.001, 0.001, 0.016], [0.999, 0.999, 0.693], 1.0, 19.759, 21.156, [0.974, 0.969, 0.878]),
    "cotton": ([0.447, 0.486, 0.251], [0.171, 0.125, 0.279], 10.0, 10.0, 41.464, [0.999, 0.999, 0.999]),
}
MICROFLAKE = {
    "fleece": ([0.137, 0.416, 0.812], 0.013), "gabardine": ([0.967, 0.160, 0.230], 0.013), "silk": ([0.936, 0.051, 0.214], 0.013),
    "velvet": ([0.490, 0.381, 0.412], 0.005), "twill": ([0.843, 0.812, 0.463], 0.013), "cotton": ([0.999, 0.999, 0.999], 0.013),
}
WEAVE = {"fleece": "napped jersey", "gabardine": "twill 2/1", "silk": "satin", "velvet": "pile", "twill": "twill 3/1", "cotton": "plain"}


def truth(fabric, model):
    """Parameters of Table 5.3 as a job document takes them."""
    if model == "microflake":
        return dict(zip(("alpha", "gamma"), MICROFLAKE[fabric]))
    values = FABRIC[fabric][1:] if model == "two_lobe" else VOLUME[fabric]
    return dict(zip(("C_R", "C_TT", "beta_R", "beta_TT", "gamma_TT", "alpha"), values))


def cloth(fabric):
    return FABRIC[fabric][0]


# light theta, camera theta, camera phi, rotation
GRAZING = [(80, 80, 180, 0), (80, 80, 180, 90)]
FITTED = [(light, camera, phi, rotation)
          for phi, rotation in ((180, 0), (180, 90), (90, 0), (90, 90))
          for light, camera in ((64 if (phi, rotation) == (90, 90) else 80,) * 2, (20, 20), (45, 45), (60, 0))]
LAMP_THETA = (5, 20, 35, 50, 65, 80)
CAMERAS = [(0, 0)] + [(theta, phi) for theta in (16, 32, 48, 64, 80) for phi in range(0, 360, 45)]
FURTHER = [(light, theta, phi, rotation) for rotation in (0, 90) for light in LAMP_THETA for theta, phi in CAMERAS]
