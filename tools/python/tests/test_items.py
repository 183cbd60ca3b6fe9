"""Items of scenes: their names, and what becomes of scenes whose items change."""

from __future__ import annotations

import pickle
import subprocess
import sys
import threading

import numpy as np
import pytest
from conftest import ball, blob, particles

import pysplatkit
from pysplatkit import Scene, TransferFunction

SIZE = (96, 72)


def drawn(scene, **options):
    """Returns the pixels of a scene, whose items all show."""
    return scene.render(SIZE, **options).rgba


def same(scene, other):
    return np.array_equal(drawn(scene), drawn(other))


def moved_ball():
    vertices, faces = ball()
    return 3 * vertices + [24, 10, 8], faces


def pair():
    """Returns a scene of a volume and a mesh."""
    return Scene().add_volume(blob()).add_mesh(*moved_ball(), color="gold", name="egg")


def test_items_are_named(data):
    scene = Scene().add(data / "bytes.npy").add(data / "bytes.npy").add_volume(blob())
    scene.add_volume(blob(), name="head").add(data / "colors.ply", name="skin")
    assert scene.names == ["bytes", "bytes 2", "volume", "head", "skin"]
    assert "head" in scene and "hat" not in scene and len(scene) == 5
    assert scene.contents[-1][:2] == ("mesh", "skin")
    with pytest.raises(pysplatkit.ArgumentError, match="an item 'head' already"):
        scene.add_volume(blob(), name="head")
    for change in (scene.remove, scene.update, scene.transform):
        with pytest.raises(pysplatkit.ArgumentError, match="no item 'hat'; its items are 'bytes'"):
            change("hat")
    assert pysplatkit._items.name_of("a/scan.nii.gz") == "scan"
    assert pysplatkit._items.name_of("https://a.b/c/d.laz?x=1/2") == "d"


def test_a_scene_is_as_if_a_removed_item_had_never_been_added():
    volume = Scene().add_volume(blob())
    assert same(pair().remove("egg"), volume)
    mesh = Scene().add_mesh(*moved_ball(), color="gold")
    assert same(pair().remove("volume"), mesh)
    empty = pair().remove("egg").remove("volume")
    assert len(empty) == 0 and empty.bounds is None
    assert same(empty.add_volume(blob()), volume)


def test_options_are_updated():
    scene = pair()
    before = drawn(scene)
    scene.update("egg", color="red", opacity=0.5)
    wanted = Scene().add_volume(blob()).add_mesh(*moved_ball(), color="red", opacity=0.5)
    assert same(scene, wanted)
    scene.update("volume", colormap="magma", spacing=2)
    wanted = Scene().add_volume(blob(), colormap="magma", spacing=2)
    wanted.add_mesh(*moved_ball(), color="red", opacity=0.5)
    assert same(scene, wanted)
    scene.update("volume", colormap=None, spacing=None).update("egg", color="gold", opacity=None)
    assert np.array_equal(drawn(scene), before)


def test_data_are_updated(data):
    vertices, faces = moved_ball()
    scene = pair()
    scene.update("volume", 1 - blob(), spacing=(1, 2, 1)).update("egg", vertices * [1, 1, 2])
    wanted = Scene().add_volume(1 - blob(), spacing=(1, 2, 1))
    assert same(scene, wanted.add_mesh(vertices * [1, 1, 2], faces, color="gold"))
    values = vertices[:, 2]
    scene.update("egg", values=values, color=None, colormap="turbo")
    wanted = Scene().add_volume(1 - blob(), spacing=(1, 2, 1))
    wanted.add_mesh(vertices * [1, 1, 2], faces, values=values, colormap="turbo")
    assert same(scene, wanted)
    # Data of another kind begins with no options.
    scene.update("egg", data / "cloud.ply", point_size=3.0)
    wanted.remove("mesh").add(data / "cloud.ply", point_size=3.0)
    assert same(scene, wanted) and scene.names == ["volume", "egg"]
    scene.update("egg", data / "colors.ply")
    assert scene.contents[-1][0] == "mesh"


def test_every_kind_is_updated():
    positions, values = particles()
    radii = np.full(len(values), 0.4)
    scene = Scene().add_samples(positions, values, radii=radii)
    scene.update("samples", values=1 - values)
    assert same(scene, Scene().add_samples(positions, 1 - values, radii=radii))
    scene.update("samples", positions * 2)
    assert same(scene, Scene().add_samples(positions * 2, 1 - values, radii=radii))
    scene = Scene().add_points(positions, radius=0.1)
    scene.update("points", positions[:50], radius=np.linspace(0.1, 0.3, 50))
    assert same(scene, Scene().add_points(positions[:50], radius=np.linspace(0.1, 0.3, 50)))
    # The last point belongs to no cell.
    corners = np.vstack([np.indices((2, 2, 2)).reshape(3, -1).T, [[9, 9, 9]]]).astype(float)
    cells = [[0, 4, 6, 2, 1, 5, 7, 3]]
    scene = Scene().add_cells(corners, cells, corners[:, 0])
    scene.update("cells", values=corners[:, 1], style="volume")
    assert same(scene, Scene().add_cells(corners, cells, corners[:, 1], style="volume"))
    gaussians = {
        "centers": positions,
        "scales": np.full((len(positions), 3), 0.05),
        "rotations": np.tile([1.0, 0, 0, 0], (len(positions), 1)),
        "opacities": np.full(len(positions), 0.9),
    }
    green, red = (np.tile(rgb, (len(positions), 1)) for rgb in ([0.0, 1, 0], [1.0, 0, 0]))
    scene = Scene().add({**gaussians, "colors": green}).update("gaussians", colors=red)
    assert same(scene, Scene().add_gaussians(**gaussians, colors=red))


def test_a_change_that_fails_changes_nothing():
    scene = pair()
    before = drawn(scene)
    for error, change in (
        (pysplatkit.KindError, lambda: scene.update("egg", colour="red")),
        (pysplatkit.ArgumentError, lambda: scene.update("volume", spacing=(1, 2))),
        (pysplatkit.MissingFileError, lambda: scene.update("egg", "missing.ply")),
        (pysplatkit.NothingToDrawError, lambda: scene.update("volume", np.zeros((2, 2, 2)))),
        (pysplatkit.ArgumentError, lambda: scene.transform("egg", scale=-1)),
        (pysplatkit.ArgumentError, lambda: scene.transform("egg", rotate=("q", 1))),
        (pysplatkit.ArgumentError, lambda: scene.transform("egg", rotate=90)),
        (pysplatkit.ArgumentError, lambda: scene.transform("egg", matrix=np.diag([1, 2, 1, 1]))),
        (pysplatkit.ArgumentError, lambda: scene.transform("egg", matrix=np.diag([-1, 1, 1, 1]))),
        (pysplatkit.ArgumentError, lambda: scene.transform("egg", matrix=np.eye(3))),
    ):
        with pytest.raises(error):
            change()
    assert np.array_equal(drawn(scene), before) and scene.names == ["volume", "egg"]


def test_arrays_are_those_of_the_time_when_they_were_added():
    """What a caller does to an array of a mesh afterwards changes no picture."""
    vertices, faces = moved_ball()
    vertices, faces = vertices.astype("f4"), faces.astype("u4")
    scene = Scene().add_volume(blob()).add_mesh(vertices, faces, name="egg")
    before = drawn(scene)
    vertices[:] = 0
    faces[:] = 0
    assert np.array_equal(drawn(scene.update("egg", color="red").update("egg", color=None)), before)


def test_moves_are_those_of_moved_data():
    vertices, faces = moved_ball()
    angle = np.radians(40)
    turn = np.array(
        [[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]]
    )
    scene = Scene().add_mesh(vertices, faces, up="z")
    scene.transform("mesh", scale=2, rotate=("z", 40), translate=(1, 2, 3))
    places = 2 * vertices @ turn.T + [1, 2, 3]
    low, high = scene.bounds
    assert np.allclose([low, high], [places.min(axis=0), places.max(axis=0)], atol=1e-4)
    # A second move is one of where the item is.
    scene.transform("mesh", scale=0.5, translate=(-1, 0, 0))
    places = 0.5 * places + [-1, 0, 0]
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = turn, [-0.5, 1, 1.5]
    other = Scene().add_mesh(vertices, faces, up="z").transform("mesh", matrix=matrix)
    for moved in (scene, other):
        assert np.allclose(moved.bounds, [places.min(axis=0), places.max(axis=0)], atol=1e-4)
    scene.transform("mesh", reset=True)
    assert same(scene, Scene().add_mesh(vertices, faces, up="z"))
    volume = Scene().add_volume(blob()).transform("volume", translate=(10, 0, -5))
    assert volume.bounds == ((10, 0, -5), (33, 19, 12))
    assert same(volume, Scene().add_volume(blob(), origin=(10, 0, -5)))


def test_files_that_are_read_in_pages_stay(data):
    scene = Scene().add(data / "tree.splk")
    with pytest.raises(pysplatkit.InputError, match="cannot be moved"):
        scene.transform("tree", scale=2)


def everything(data):
    """Returns a scene with an item of each kind, moved and changed."""
    positions, values = particles()
    scene = pair().add(data / "colors.ply", color="height")
    scene.add_samples(positions, values, radii=np.full(len(values), 0.4), name="gas")
    scene.transform("gas", translate=(-4, 2, 2)).transform("egg", rotate=((1, 1, 0), 30))
    scene.update("volume", transfer=TransferFunction([(0, "red")], [(0.2, 0.0), (0.5, 0.9)]))
    return scene


PROGRAM = """
import pickle, sys
scene = pickle.load(sys.stdin.buffer)
picture = scene.render((96, 72), view="left", azimuth=20)
pickle.dump(picture, sys.stdout.buffer)
"""


def test_scenes_and_pictures_go_to_other_processes(data, tmp_path, monkeypatch):
    monkeypatch.chdir(data)
    scene = everything(data).add("cloud.ply", name="cloud")
    wanted = scene.render(SIZE, view="left", azimuth=20)
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM],
        input=pickle.dumps(scene),
        capture_output=True,
        check=True,
        cwd=tmp_path,
    )
    picture = pickle.loads(done.stdout)
    assert picture.rgba.tobytes() == wanted.rgba.tobytes()
    assert picture.color.tobytes() == wanted.color.tobytes()
    assert picture.depth.tobytes() == wanted.depth.tobytes()
    assert (picture.camera, picture.statistics) == (wanted.camera, wanted.statistics)


def test_copies_and_opened_scenes(data, tmp_path):
    import copy

    scene = everything(data)
    for other in (copy.copy(scene), copy.deepcopy(scene)):
        assert same(other, scene)
        other.remove("egg")
        assert len(scene) == 4 and not same(other, scene)
    files = Scene().add(data / "bytes.npy", name="a").add(data / "colors.ply", color="ivory")
    files.transform("colors", scale=5, translate=(3, 3, 3))
    path = data / "moved.json"
    files.save(path, view="left", size=SIZE, scale_bar=True)
    opened = Scene.open(path)
    assert opened.names == ["bytes", "colors"]
    wanted = files.render(SIZE, view="left", scale_bar=True).rgba
    assert np.array_equal(opened.render().rgba, wanted)
    opened.update("colors", color="red").transform("colors", translate=(0, 0, 1))
    files.update("colors", color="red").transform("colors", translate=(0, 0, 1))
    wanted = files.render(SIZE, view="left", scale_bar=True).rgba
    assert np.array_equal(opened.render().rgba, wanted)
    again = pickle.loads(pickle.dumps(opened))
    assert np.array_equal(again.render().rgba, wanted)


def test_items_change_while_others_draw():
    scene = pair()
    stop, errors = threading.Event(), []

    def draw():
        while not stop.is_set():
            try:
                picture = scene.render(SIZE)
                # One of the states between changes, none of which is empty.
                assert (picture.color[..., 3] > 0.1).any()
            except (pysplatkit.Error, AssertionError) as error:
                errors.append(error)

    threads = [threading.Thread(target=draw) for _ in range(3)]
    for thread in threads:
        thread.start()
    try:
        for number in range(6):
            scene.transform("egg", rotate=("z", 10 * number))
            scene.update("volume", opacity_unit=1 + number)
            scene.add_mesh(*moved_ball(), name="other").remove("other")
    finally:
        stop.set()
        for thread in threads:
            thread.join()
    assert not errors
    assert scene.names == ["volume", "egg"]
