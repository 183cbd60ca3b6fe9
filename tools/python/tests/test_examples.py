"""The examples run, on data that they make up and on files."""

from __future__ import annotations

import runpy
from pathlib import Path

import numpy as np
import pytest
from conftest import particles, read_png

EXAMPLES = Path(__file__).parent.parent / "examples"
SIZE = (320, 240)


def run(name, *arguments, **options):
    runpy.run_path(str(EXAMPLES / f"{name}.py"))["main"](*arguments, **options)


@pytest.fixture(autouse=True)
def inside(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def covered(path):
    """Returns the share of pixels that differ from the corner."""
    pixels = read_png(path)
    return (pixels != pixels[0, 0]).any(axis=-1).mean()


@pytest.mark.parametrize("name", ["ct", "sph", "scan"])
def test_made_up_data(name):
    run(name, size=SIZE)
    assert covered(f"{name}.png") > 0.1


def test_files(data):
    positions, values = particles()
    density = 2 + values
    np.save("own.npy", np.column_stack([positions, density, np.full(len(values), 0.4)]))
    run("sph", "own.npy", "own.png", SIZE)
    assert covered("own.png") > 0.1
    run("scan", data / "cloud.ply", "scanned.png", SIZE)
    assert covered("scanned.png") > 0.05


def test_a_turntable(data):
    run("turntable", data / "mesh.ply", "frames/", 3)
    assert [path.name for path in sorted(Path("frames").iterdir())] == [
        "0000.png",
        "0001.png",
        "0002.png",
    ]
    run("turntable", None, "knot/", 2)
    assert covered("knot/0001.png") > 0.1
