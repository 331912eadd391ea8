"""Options of scans that are drawn at random, so that limits that were chosen on the named scans can be judged on others.

A scan drawn-N, hollow-N or broad-N is the same on every machine. Half of the scans lie in the domain that the product promises (fibers of 5 to 10
voxels that are alike, signal-to-noise 3 and more); the others have one or two things that scans suffer from.
"""
import numpy as np


def spoil(o, rng):
    """Changes the options by one thing that is hard."""
    what = rng.choice(["densities", "diameters", "balls", "blur", "noise", "light", "thin", "mixed", "hairs", "plate", "pad", "short"])
    low, high = sorted(o["d"])
    if what == "densities":
        o["rho"] = tuple(rng.permutation([1, float(rng.uniform(0.2, 0.7))]))
    elif what == "diameters":
        o["d"] = tuple(rng.permutation([low, min(12.0, low * float(rng.uniform(1.4, 2.6)))]))
    elif what == "balls":
        o.update(balls=int(rng.integers(10, 250)), ball_radius=(2, float(rng.uniform(3, 8))))
    elif what == "blur":
        o["blur"] = float(rng.uniform(1.2, 1.8))
    elif what == "noise":
        o.update(snr=float(rng.uniform(1.0, 2.5)), corr=float(rng.uniform(0, 0.8)))
    elif what == "light":
        o.update(cup=float(rng.uniform(0.2, 0.6)), rim=float(rng.uniform(0, 0.5)))
    elif what == "thin":
        o["d"] = (float(rng.uniform(2.8, 4.2)),) * 2
    elif what == "mixed":
        o["mixed"] = float(rng.uniform(0.1, 0.9))
    elif what == "hairs":
        o["hairs"] = int(rng.integers(5, 40))
    elif what == "plate":
        o["plate"] = int(rng.integers(2, 8))
    elif what == "pad":
        o["pad"] = 1
    elif what == "short":
        o["length"] = int(rng.integers(30, 70))


def drawn(number, default):
    """The options of scan drawn-`number`, from the options that scans have by default."""
    rng = np.random.default_rng([20261128, number])
    d = float(rng.uniform(5, 10))
    o = {**default, "kind": str(rng.choice(["gauze", "twill", "felt"])), "d": (d, d), "n": int(rng.choice([4, 7, 12])),
         "snr": float(rng.uniform(3, 8)), "blur": float(rng.uniform(0.4, 1.0)), "spread": float(rng.uniform(0, 0.15)),
         "fibers": int(rng.integers(25, 110))}
    o["open"] = float(rng.uniform(1.3, 2.2)) if o["kind"] == "gauze" else float(rng.uniform(1.02, 1.2))
    if rng.uniform() < 0.08:
        o.update(kind=str(rng.choice(["none", "sponge"])), balls=int(rng.integers(0, 300)))
    elif rng.uniform() < 0.5:
        for _ in range(int(rng.integers(1, 3))):
            spoil(o, rng)
    widest = max(o["d"])
    side = int(np.clip(12 * widest, 80, 128))
    o["size"] = (side, side, int(np.clip(8 * widest, 48, 96)))
    return o


def hollow(number, default):
    """The options of scan hollow-`number`: as scans within the domain, with lumens that a scan of their noise shows."""
    rng = np.random.default_rng([20261129, number])
    d = float(rng.uniform(6, 10))
    o = {**default, "kind": str(rng.choice(["gauze", "twill", "felt"])), "d": (d, d), "n": int(rng.choice([4, 7, 12])),
         "snr": float(rng.uniform(3, 8)), "blur": float(rng.uniform(0.4, 1.0)), "spread": float(rng.uniform(0, 0.15)),
         "fibers": int(rng.integers(25, 110)), "lumen": float(rng.uniform(0.3, 0.6))}
    o["open"] = float(rng.uniform(1.3, 2.2)) if o["kind"] == "gauze" else float(rng.uniform(1.02, 1.2))
    side = int(np.clip(12 * d, 80, 128))
    o["size"] = (side, side, int(np.clip(8 * d, 48, 96)))
    return o


def broad(number, default):
    """The options of scan broad-`number`: blends of fibers of two or three kinds, of densities of 0.2 to 1 and diameters of
    0.5 to 1 of the thickest, in the same yarns, and often balls, of any density; light fibers may be beneath the noise."""
    rng = np.random.default_rng([20261130, number])
    d = float(rng.uniform(6, 12))
    o = {**default, "kind": str(rng.choice(["gauze", "twill", "felt"])), "d": (d, d), "n": int(rng.choice([4, 7])),
         "snr": float(rng.uniform(2.5, 8)), "blur": float(rng.uniform(0.5, 1.2)), "fibers": int(rng.integers(25, 90)), "spread": float(rng.uniform(0, 0.15))}
    o["open"] = float(rng.uniform(1.2, 2.0)) if o["kind"] == "gauze" else float(rng.uniform(1.02, 1.2))
    kinds = [(1.0, 1.0)] + [(float(rng.uniform(0.2, 1)), float(rng.uniform(0.5, 1))) for _ in range(int(rng.integers(1, 3)))]
    o["blend"] = tuple(kinds[i] for i in rng.integers(0, len(kinds), 4)) + tuple(kinds)
    if rng.uniform() < 0.4:
        o.update(balls=int(rng.integers(8, 160)), ball_radius=(2, float(rng.uniform(3, 8))), ball_rho=(float(rng.uniform(0.3, 1)), 1.5))
    side = int(np.clip(12 * d, 88, 128))
    o["size"] = (side, side, int(np.clip(8 * d, 56, 96)))
    return o
