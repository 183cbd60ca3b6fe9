"""Draws a scan of computed tomography: a folder of DICOM slices, or any file of a volume.

python ct.py FOLDER picture.png
python ct.py            # draws a made-up head
"""

import sys

import numpy as np

import pysplatkit


def made_up_head(side=96):
    """Returns Hounsfield units [z, y, x] of a skull with a brain, and the distances of slices."""
    z, y, x = np.mgrid[-1 : 1 : side * 1j, -1 : 1 : side * 1j, -1 : 1 : side * 1j]

    def inside(distance):
        # A scanner blurs edges over a few samples.
        return 1 / (1 + np.exp(distance * side / 2))

    radius = np.sqrt(x**2 + (y / 1.2) ** 2 + (z / 1.1) ** 2)
    head = np.full(radius.shape, -1000.0)
    for shape, units in [
        (radius - 0.76, 40.0),
        (radius - 0.70, 1100.0),
        (radius - 0.62, 30.0),
        (np.hypot(x - 0.3, z - 0.1) + 9 * np.maximum(y + 0.3, 0) - 0.16, -1000.0),
        (np.hypot(x + 0.3, z - 0.1) + 9 * np.maximum(y + 0.3, 0) - 0.16, -1000.0),
    ]:
        share = inside(shape)
        head = (1 - share) * head + share * units
    return head.astype(np.int16), (2.0, 2.0, 2.0)


def main(source=None, output="ct.png", size=(800, 600)):
    scene = pysplatkit.Scene()
    options = {"transfer": "ct-bone"}
    if source:
        scene.add(source, **options)
    else:
        volume, spacing = made_up_head()
        scene.add_volume(volume, spacing=spacing, modality="ct", unit="mm", **options)
    # The upper third is cut away.
    (_, _, low), (_, _, high) = scene.bounds
    below = pysplatkit.Clip.plane((0, 0, 1), low + 0.7 * (high - low))
    camera = scene.camera(size, clips=[below], elevation=35)
    picture = scene.render(size, camera, clips=[below], background="#20242c")
    print(picture.save(output))


if __name__ == "__main__":
    main(*sys.argv[1:])
