"""Scene files: those of the package have the bytes of the command's and the window's."""

import json
from pathlib import Path

import pytest

import pysplatkit
from pysplatkit import ArgumentError, Camera, Clip, Scene

#: Flags, and the scene files that they describe. Tests of the command write the file.
CASES = json.loads((Path(__file__).parents[2] / "tests" / "scenes.json").read_text())

CAMERA = Camera((60, -40, 30.5), (7, 7, 7), (0, 0, 1), 30)
CLIPS = [
    Clip.plane((1, 0, 0), 2.5),
    Clip.box((0, 0, 0), (1, 2, 50), inside=False),
]

#: What the flags of each case say, in Python: files with their options, and options of the picture.
SAVED = [
    ({"bytes.npy": {}}, {}),
    ({"bytes.npy": {"transfer": "generic", "range": (20, 200)}}, {"size": (64, 48)}),
    ({"bytes.npy": {"isosurfaces": [(90, "red", 0.5), 120]}}, {}),
    ({"bytes.npy": {"kernel": "hann", "extent": 2, "colormap": "coolwarm_r"}}, {}),
    (
        {"bytes.npy": {"gradient_opacity": [(0, 0), (50, 0.2), (200, 1)], "opacity_unit": 2}},
        {},
    ),
    ({"bytes.npy": {}}, {"optics": "maximum", "background": "white"}),
    ({"bytes.npy": {}}, {"mode": "axis-sheets", "shade": False, "sheet_thickness": 0.5}),
    (
        {"bytes.npy": {}},
        {"mode": "splats", "back_to_front": True, "classify": "pre", "samples": 4},
    ),
    ({"bytes.npy": {}}, {"clips": CLIPS}),
    ({"bytes.npy": {"spacing": (1, 1, 2.5)}}, {"view": "left", "zoom": 1.5, "orthographic": True}),
    ({"colors.ply": {"color": "height", "colormap": "turbo"}}, {}),
    ({"colors.ply": {"color": "#ff8800", "opacity": 0.7, "edges": True, "crease": 30}}, {}),
    ({"cloud.ply": {"points": "dots", "point_size": "3px"}}, {}),
    (
        {"cloud.ply": {}},
        {"azimuth": 70, "elevation": -10.5, "view_angle": 40, "up": "+Z"},
    ),
    ({"samples.npy": {"radius": 0.4, "slopes": False}}, {}),
    ({"cells.vtk": {"cells": "volume", "range": (0.2, 0.8), "scalar": "heat"}}, {}),
    ({"tree.splk": {}}, {"cut": 8, "background": None, "cull_backfaces": False}),
    ({"bricks.splv": {}}, {"budget": 1000, "engine": "cpu"}),
    ({"trained.spz": {}}, {"distance": 9, "focal_point": (0, 0, 0.5), "view_up": (0, 1, 0)}),
    (
        {"bytes.npy": {}, "colors.ply": {"color": "ivory", "opacity": 0.25}},
        {"axes": True, "scale_bar": True, "scalar_bar": True, "caption": "bone"},
    ),
    (
        {"bytes.npy": {"colormap": "hot"}, "colors.ply": {"colormap": "hot"}},
        {"camera": CAMERA},
    ),
    ({"cloud.ply": {"edits": [("where", "x>-9"), ("thin", "50%")]}}, {}),
]


def test_every_case_is_saved():
    assert len(SAVED) == len(CASES) >= 20


@pytest.mark.parametrize("number", range(len(SAVED)))
def test_scene_files_have_the_bytes_of_the_command(data, number):
    files, drawing = SAVED[number]
    scene = Scene()
    for file, options in files.items():
        scene.add(data / file, **options)
    path = data / f"same{number}.json"
    scene.save(path, **drawing)
    assert path.read_text() == CASES[number]["scene"], CASES[number]["flags"]
    # What is opened is saved as it was.
    again = data / f"again{number}.json"
    Scene.open(path).save(again)
    assert again.read_text() == path.read_text()


def test_the_engine_of_a_scene_file_draws(data):
    path = data / "engine.json"
    scene = {"splatkit_scene": 2, "inputs": [{"file": "mesh.ply"}], "engine": "gpu"}
    path.write_text(json.dumps(scene))
    opened = Scene.open(path)
    with pytest.raises(ArgumentError, match="GPU"):
        opened.render((8, 8))
    with pytest.raises(ArgumentError, match="GPU"):
        pysplatkit.render(path, size=(8, 8))
    # An argument counts more than the file.
    assert opened.render((8, 8), engine="cpu").size == (8, 8)
    opened.save(data / "kept.json")
    assert json.loads((data / "kept.json").read_text())["engine"] == "gpu"
    opened.save(data / "other.json", engine="cpu")
    assert json.loads((data / "other.json").read_text())["engine"] == "cpu"
