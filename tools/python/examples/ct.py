"""Draws a scan of computed tomography: a folder of DICOM slices, or any file of a volume.

    python ct.py FOLDER picture.png
    python ct.py            # draws a made-up head
"""

import sys

import numpy as np

import splatkit


def made_up_head(side=96):
    """Returns Hounsfield units [z, y, x] of a skull with a brain, and the distances of slices."""
    z, y, x = np.mgrid[-1 : 1 : side * 1j, -1 : 1 : side * 1j, -1 : 1 : side * 1j]
    radius = np.sqrt(x**2 + (y / 1.2) ** 2 + (z / 1.1) ** 2)
    head = np.full(radius.shape, -1000.0)
    head[radius < 0.75] = 40.0
    head[radius < 0.70] = 1100.0
    head[radius < 0.62] = 30.0
    head[(radius < 0.75) & (y < -0.2) & (np.hypot(x - 0.3, z) < 0.15)] = -1000.0
    return head.astype(np.int16), (2.0, 2.0, 2.0)


def main(source=None, output="ct.png"):
    scene = splatkit.Scene()
    look = {"transfer": "ct-bone", "kernel": "catmull-rom"}
    if source:
        scene.add(source, **look)
    else:
        volume, spacing = made_up_head()
        scene.add_volume(volume, spacing=spacing, modality="ct", unit="mm", **look)
    size = (800, 600)
    # The front half is cut away.
    (_, low, _), (_, high, _) = scene.bounds
    half = splatkit.Clip.plane((0, -1, 0), -(low + high) / 2)
    camera = scene.camera(size, clips=[half])
    picture = scene.render(size, camera, clips=[half], background="#20242c")
    print(picture.save(output))


if __name__ == "__main__":
    main(*sys.argv[1:])
