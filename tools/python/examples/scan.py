"""Converts a scan to a hierarchy with levels of detail, and draws as much as a picture can show.

python scan.py scan.laz picture.png
python scan.py                          # makes up a scan
"""

import sys
import tempfile
from pathlib import Path

import numpy as np

import pysplatkit


def write_made_up_scan(path, side=500):
    """Writes a hilly landscape as an array of points."""
    random = np.random.default_rng(3)
    x, y = random.uniform(0, 100, (2, side * side))
    z = 4 * np.sin(x / 9) * np.cos(y / 13) + 0.5 * np.sin(x * y / 40)
    np.save(path, np.stack([x, y, z], axis=1))


def main(source=None, output="scan.png", size=(800, 600)):
    with tempfile.TemporaryDirectory() as folder:
        if not source:
            source = Path(folder) / "scan.npy"
            write_made_up_scan(source)
        tree = Path(output).with_suffix(".splk")
        pysplatkit.convert(source, tree, color="height", up=(0, 0, 1), overwrite=True)
    hierarchy = pysplatkit.Hierarchy(tree)
    print(f"{hierarchy.splats} splats in {hierarchy.nodes} nodes, {tree.stat().st_size} bytes")
    scene = pysplatkit.Scene().add(tree)
    # The widest splat, in pixels: as many levels are drawn as the picture can show.
    for cut in (16, 8, 4, 2):
        picture = scene.render(size, cut=cut)
        print(f"cut {cut}: {picture.statistics['splats']} splats")
    print(picture.save(output))


if __name__ == "__main__":
    main(*sys.argv[1:])
