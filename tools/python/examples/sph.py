"""Draws particles of smoothed particle hydrodynamics: the density between them, in space.

    python sph.py particles.npy picture.png     # rows of x, y, z, density, smoothing length
    python sph.py                               # draws a made-up disc of gas
"""

import sys

import numpy as np

import splatkit


def made_up_disc(count=20_000):
    """Returns positions, densities and smoothing lengths of a spiral galaxy."""
    random = np.random.default_rng(7)
    radius = random.exponential(0.35, count)
    arm = random.integers(0, 2, count) * np.pi
    angle = arm + 3.0 * np.log1p(4 * radius) + random.normal(0, 0.35, count)
    height = random.normal(0, 0.03, count)
    positions = np.stack([radius * np.cos(angle), radius * np.sin(angle), height], axis=1)
    density = np.exp(-radius / 0.35 - np.abs(height) / 0.05)
    return positions, density, 0.02 + 0.08 * radius


def main(source=None, output="sph.png"):
    if source:
        rows = np.load(source)
        positions, density, length = rows[:, :3], rows[:, 3], rows[:, 4]
    else:
        positions, density, length = made_up_disc()
    scene = splatkit.Scene().add_samples(
        positions,
        np.log10(density),
        radii=length,
        colormap="inferno",
    )
    size = (800, 600)
    picture = scene.render(size, scene.camera(size, elevation=40), shade=False)
    print(picture.save(output))


if __name__ == "__main__":
    main(*sys.argv[1:])
