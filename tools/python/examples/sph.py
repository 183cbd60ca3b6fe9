"""Draws particles of smoothed particle hydrodynamics: the field between them, in space.

python sph.py particles.npy picture.png     # rows of x, y, z, value, smoothing length
python sph.py                               # draws made-up gas
"""

import sys

import numpy as np

import pysplatkit


def made_up_gas(count=30_000):
    """Returns positions, temperatures and smoothing lengths in a cube with hot filaments."""
    random = np.random.default_rng(7)
    positions = random.uniform(-1, 1, (count, 3))
    x, y, z = positions.T
    filament = np.hypot(y - 0.5 * np.sin(3 * x), z - 0.4 * np.cos(2 * x))
    other = np.hypot(x + 0.3 * np.sin(4 * z), y - 0.3)
    temperature = np.exp(-((filament / 0.22) ** 2)) + 0.7 * np.exp(-((other / 0.16) ** 2))
    # The reach of a particle: so many neighbours lie within it.
    length = np.full(count, 2 * 0.8 * (8 / count) ** (1 / 3))
    return positions, 1e4 * (0.1 + temperature), length


def main(source=None, output="sph.png", size=(800, 600)):
    if source:
        rows = np.load(source)
        positions, value, length = rows[:, :3], rows[:, 3], rows[:, 4]
    else:
        positions, value, length = made_up_gas()
    low, middle, high = np.percentile(value, [60, 85, 99.9])
    size_of_all = np.linalg.norm(np.ptp(positions, axis=0))
    transfer = pysplatkit.TransferFunction(
        colors=[(low, "midnightblue"), (middle, "tomato"), (high, "lightyellow")],
        opacities=[(low, 0.0), (middle, 0.1), (high, 0.6)],
        unit=size_of_all / 100,
    )
    scene = pysplatkit.Scene().add_samples(positions, value, radii=length, transfer=transfer)
    print(scene.render(size, scene.camera(size)).save(output))


if __name__ == "__main__":
    main(*sys.argv[1:])
