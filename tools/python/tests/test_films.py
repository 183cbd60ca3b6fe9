"""Views, texts over pictures, films, radii, colour maps and engines."""

from __future__ import annotations

import shutil
import sys

import numpy as np
import pytest
from conftest import ball, blob, particles, read_png

import pysplatkit
from pysplatkit import Scene

SIZE = (160, 120)


def test_the_one_liner_has_a_camera(data):
    scene = Scene().add(data / "colors.ply")
    for view in ({"view": "left"}, {"azimuth": 200, "zoom": 2, "orthographic": True}):
        picture = pysplatkit.render(data / "colors.ply", size=SIZE, **view)
        wanted = scene.render(SIZE, scene.camera(SIZE, **view))
        assert np.array_equal(picture.rgba, wanted.rgba) and picture.camera == wanted.camera
    volume = pysplatkit.render(blob(), size=SIZE, view="top", origin=(1, 2, 3), distance=50)
    other = Scene().add_volume(blob(), origin=(1, 2, 3))
    assert np.array_equal(volume.rgba, other.render(SIZE, view="top", distance=50).rgba)
    with pytest.raises(pysplatkit.ArgumentError, match="leave view out"):
        scene.render(SIZE, scene.camera(SIZE), view="left")
    with pytest.raises(pysplatkit.ArgumentError, match="add_volume"):
        pysplatkit.render(blob(), axes=np.eye(3))


def test_texts_are_those_of_the_command(command, data, tmp_path):
    flags = ["--scalar-bar", "--axes", "--scale-bar", "--caption", "A blob", "--view", "left"]
    out = tmp_path / "command.png"
    size = "x".join(map(str, SIZE))
    file = data / "volume.npy"
    command("render", file, "--engine", "cpu", "--size", size, *flags, "-o", out)
    texts = {"scalar_bar": True, "axes": True, "scale_bar": True, "caption": "A blob"}
    picture = pysplatkit.render(file, size=SIZE, view="left", **texts)
    assert np.array_equal(read_png(out), picture.rgba)
    plain = pysplatkit.render(file, size=SIZE, view="left")
    assert (picture.rgba != plain.rgba).any(axis=-1).mean() > 0.05
    with pytest.raises(pysplatkit.ArgumentError, match="nothing to show"):
        pysplatkit.render(data / "mesh.ply", scalar_bar=True)
    with pytest.raises(pysplatkit.ArgumentError, match="caption: has 1001 letters"):
        pysplatkit.render(data / "mesh.ply", caption="a" * 1001)
    light = pysplatkit.render(file, size=SIZE, caption="Dark letters", background="white").rgba
    assert light[:20].min() < 40


def test_the_bar_has_the_colours_of_a_function_that_is_set():
    scene = Scene().add_volume(blob())
    function = pysplatkit.TransferFunction([(0, "lime"), (1, "lime")], [(0.2, 0.0), (0.9, 1.0)])
    scene._set_transfer(0, function.to_json())
    picture = scene.render(SIZE, scalar_bar=True).rgba[:, -40:]
    green = (picture[..., 1] > 200) & (picture[..., :3:2].max(axis=-1) < 60)
    assert green.sum() > 100


def frames_of(path):
    """Returns the frames of an animated PNG, by their order."""
    import struct

    data, at, count = path.read_bytes(), 8, 0
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at : at + 8])
        count += kind == b"fcTL"
        at += 12 + length
    return count


def test_films(data, tmp_path):
    scene = Scene().add(data / "colors.ply")
    out = scene.film(tmp_path / "turn.apng", 5, size=(64, 48), view="left")
    assert out == tmp_path / "turn.apng" and frames_of(out) == 5
    for name, head in (("turn.gif", b"GIF89a"), ("turn.webp", b"RIFF")):
        scene.film(tmp_path / name, 3, size=(64, 48), background=None)
        assert (tmp_path / name).read_bytes().startswith(head)
    # A folder of frames, which are those of a turntable.
    scene.film(f"{tmp_path}/folder/", 3, size=(64, 48), elevation=40)
    files = sorted((tmp_path / "folder").iterdir())
    assert [file.name for file in files] == ["0000.png", "0001.png", "0002.png"]
    cameras = scene.turntable(3, (64, 48), elevation=40)
    for file, camera in zip(files, cameras, strict=True):
        assert np.array_equal(read_png(file), scene.render((64, 48), camera).rgba)
    scene.film(tmp_path / "shot{frame:02}.png", cameras=cameras[:2], size=(64, 48))
    scene.film(tmp_path / "shot.jpg", cameras=cameras[:2], size=(64, 48))
    for name in ("shot00.png", "shot01.png", "shot_0000.jpg", "shot_0001.jpg"):
        assert (tmp_path / name).exists()


def test_films_are_those_of_the_command(command, data, tmp_path):
    flags = ["--engine", "cpu", "--size", "64x48", "--fps", "20"]
    turn = ["--turntable", "4", "--scalar-bar", "--azimuth", "10"]
    command("render", data / "volume.npy", *flags, *turn, "-o", tmp_path / "command.apng")
    scene = Scene().add(data / "volume.npy")
    scene.film(tmp_path / "turn.apng", 4, fps=20, size=(64, 48), scalar_bar=True, azimuth=10)
    assert (tmp_path / "turn.apng").read_bytes() == (tmp_path / "command.apng").read_bytes()
    start = scene.camera((64, 48), view="left")
    keyframes = [(0, start), (0.2, start.copy().azimuth(40).zoom(2))]
    scene.film(tmp_path / "way.apng", keyframes=keyframes, fps=20, size=(64, 48))
    import json

    stops = [{"time": time, "camera": json.loads(camera.to_json())} for time, camera in keyframes]
    path = tmp_path / "path.json"
    path.write_text(json.dumps({"splatkit_path": 1, "keyframes": stops}))
    way = ["--path", path, "-o", tmp_path / "command-way.apng"]
    command("render", data / "volume.npy", *flags, *way)
    assert (tmp_path / "way.apng").read_bytes() == (tmp_path / "command-way.apng").read_bytes()
    assert frames_of(tmp_path / "way.apng") == 5
    scene.film(tmp_path / "file.apng", keyframes=path, fps=20, size=(64, 48))
    assert (tmp_path / "file.apng").read_bytes() == (tmp_path / "way.apng").read_bytes()


def test_films_that_cannot_be(data, tmp_path, monkeypatch):
    scene = Scene().add(data / "colors.ply")
    camera = scene.camera((64, 48))
    for options, message in (
        ({"frames": 0}, "at least one frame"),
        ({"frames": 3, "cameras": [camera]}, "either frames"),
        ({"cameras": []}, "at least one frame"),
        ({"cameras": [camera], "view": "left"}, "leave view out"),
        ({"frames": 3, "fps": 0}, "frames per second"),
        ({"keyframes": [(0, camera), (1e6, camera)]}, "too many frames"),
        ({"keyframes": [(1, camera), (0, camera)]}, "time"),
    ):
        with pytest.raises(pysplatkit.ArgumentError, match=message):
            scene.film(tmp_path / "out.gif", size=(64, 48), **options)
    with pytest.raises(pysplatkit.ArgumentError, match="unknown format of a film"):
        scene.film(tmp_path / "out.avi", 2)
    with pytest.raises(pysplatkit.KindError, match="azimut"):
        scene.film(tmp_path / "out.gif", 2, azimut=3)
    (tmp_path / "there.gif").touch()
    with pytest.raises(pysplatkit.OutputError, match="exists already"):
        scene.film(tmp_path / "there.gif", 2, overwrite=False)
    with pytest.warns(pysplatkit.DataWarning, match="50 frames a second"):
        scene.film(tmp_path / "fast.gif", 2, fps=100, size=(64, 48))
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(pysplatkit.OutputError, match="needs the program ffmpeg"):
        scene.film(tmp_path / "out.mp4", 2)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["fast.gif", "there.gif"]


@pytest.mark.skipif(not shutil.which("ffmpeg"), reason="there is no ffmpeg")
def test_films_that_ffmpeg_encodes(data, tmp_path):
    out = Scene().add(data / "colors.ply").film(tmp_path / "out.mp4", 5, size=(64, 48))
    assert b"ftyp" in out.read_bytes()[:16]


def test_points_have_radii():
    positions, _ = particles(200)
    half = np.arange(200) % 2 == 0
    radii = np.where(half, 0.02, 0.1)
    scene = Scene().add_points(positions, radius=radii, color="white")
    shown = scene.render(SIZE, background=None).color[..., 3].mean()
    small, large = (
        Scene().add_points(positions, radius=radius, color="white").render(SIZE, scene.camera(SIZE))
        for radius in (0.02, 0.1)
    )
    assert small.color[..., 3].mean() < shown < large.color[..., 3].mean()
    # One for all is a diameter of twice that.
    sized = Scene().add_points(positions, point_size=0.2, color="white")
    assert np.array_equal(sized.render(SIZE, scene.camera(SIZE)).rgba, large.rgba)
    for wrong in (0, [0.1, 0.2], np.full(200, np.nan), -radii, "wide"):
        with pytest.raises(pysplatkit.ArgumentError, match="radi"):
            Scene().add_points(positions, radius=wrong)


class Map:
    """A colour map that does what those of matplotlib do."""

    N = 256
    name = "own"

    def __call__(self, values):
        values = np.asarray(values)[..., None]
        return np.concatenate([values, 1 - values, 0 * values, 1 + 0 * values], axis=-1)


def maps():
    yield Map()
    try:
        import matplotlib
    except ImportError:
        return
    yield matplotlib.colormaps["Spectral"]


def test_colour_maps_are_objects_too(data, tmp_path):
    vertices, faces = ball()
    for map_ in maps():
        scene = Scene().add_mesh(vertices, faces, values=vertices[:, 2], colormap=map_)
        picture = scene.render(SIZE, optics="light", shade=False, background="black", view="front")
        pixels = picture.rgba[..., :3].reshape(-1, 3)
        pixels = pixels[pixels.max(axis=1) > 0]
        wanted = 255 * np.asarray(map_(np.linspace(0, 1, 512)))[:, :3]
        # Its outline is blurred.
        far = [np.abs(wanted - color).max(axis=1).min() for color in pixels]
        assert len(far) > 1000 and np.percentile(far, 80) < 2, (map_.name, np.percentile(far, 80))
    by_list = Scene().add_volume(blob(), colormap=["black", (1.0, 0.5, 0.0), "#ffffff"])
    by_text = Scene().add_volume(blob(), colormap="black,#ff8000,white")
    assert np.array_equal(by_list.render(SIZE).rgba, by_text.render(SIZE).rgba)
    reverse = Scene().add_volume(blob(), colormap="white,#ff8000,black_r")
    assert np.array_equal(reverse.render(SIZE).rgba, by_text.render(SIZE).rgba)
    out = pysplatkit.convert(data / "mesh.ply", tmp_path / "a.splk", color="height", colormap=Map())
    assert len(np.unique(pysplatkit.Hierarchy(out).leaves().colors[:, 0])) > 10
    for wrong in (3, ["black"], ["black", "no colour"]):
        with pytest.raises((pysplatkit.ArgumentError, pysplatkit.KindError), match="colour"):
            Scene().add_volume(blob(), colormap=wrong)
    assert "matplotlib" not in sys.modules or any(map_.name == "Spectral" for map_ in maps())


def test_engines():
    scene = Scene().add_volume(blob())
    wanted = scene.render(SIZE).rgba
    assert np.array_equal(scene.render(SIZE, engine="cpu").rgba, wanted)
    assert scene.render(SIZE, engine="auto").rgba.shape == wanted.shape
    with pytest.raises(pysplatkit.ArgumentError, match=r"GPU"):
        scene.render(SIZE, engine="gpu")
    with pytest.raises(pysplatkit.ArgumentError, match="engine"):
        scene.render(SIZE, engine="fast")
    assert np.array_equal(scene.render(SIZE).rgba, wanted)
