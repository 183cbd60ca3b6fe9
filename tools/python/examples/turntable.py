"""Draws a film that turns once around a scene.

python turntable.py FILE FILM   # .gif, .webp, .apng, .mp4, .webm, or FOLDER/ for pictures
python turntable.py             # draws a made-up knot
"""

import sys

import numpy as np

import pysplatkit


def made_up_knot(around=240, across=24):
    """Returns the vertices and the faces of a trefoil knot."""
    t = np.linspace(0, 2 * np.pi, around, endpoint=False)
    curve = np.stack(
        [np.sin(t) + 2 * np.sin(2 * t), np.cos(t) - 2 * np.cos(2 * t), -np.sin(3 * t)], axis=1
    )
    tangent = np.roll(curve, -1, axis=0) - np.roll(curve, 1, axis=0)
    side = np.cross(tangent, [0, 0, 1])
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    up = np.cross(side, tangent)
    up /= np.linalg.norm(up, axis=1, keepdims=True)
    angle = np.linspace(0, 2 * np.pi, across, endpoint=False)[None, :, None]
    ring = np.cos(angle) * side[:, None] + np.sin(angle) * up[:, None]
    vertices = (curve[:, None] + 0.45 * ring).reshape(-1, 3)
    at = np.arange(around * across).reshape(around, across)
    ahead, right = np.roll(at, -1, axis=0), np.roll(at, -1, axis=1)
    quads = np.stack([at, ahead, np.roll(ahead, -1, axis=1), right], axis=-1)
    return vertices, quads.reshape(-1, 4)


def main(source=None, film="turntable.gif", frames=24):
    scene = pysplatkit.Scene()
    if source:
        scene.add(source)
    else:
        scene.add_mesh(*made_up_knot(), color="tomato")
    print(scene.film(film, int(frames), size=(640, 480), elevation=25))


if __name__ == "__main__":
    main(*sys.argv[1:])
