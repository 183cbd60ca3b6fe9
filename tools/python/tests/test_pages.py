"""Pages for browsers. tools/web/test opens pages in one."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import ball, blob, particles

import pysplatkit
from pysplatkit import Scene

SIZE = (160, 120)


def likeness(first, second):
    """Returns how alike two pictures are, in dB."""
    error = np.mean((first.rgba.astype(float) - second.rgba.astype(float)) ** 2)
    return np.inf if error == 0 else 10 * np.log10(255**2 / error)


def scenes(data):
    """Returns scenes of arrays and of files, with their names."""
    vertices, faces = ball()
    shift = np.array([500_000.0, 4_000_000.0, 7.0])
    height = vertices[:, 2].astype(np.float32)
    yield "mesh", Scene().add_mesh(vertices + shift, faces, values=height, colormap="magma")
    points = particles()[0]
    yield "points", Scene().add_points(points, radius=np.full(len(points), 0.05))
    moved = Scene().add_volume(blob(), spacing=(1, 2, 1), value_name="heat")
    yield "volume", moved.transform("volume", rotate=("z", 30), translate=(5, 0, 0))
    channels = np.stack([blob(), blob()[::-1]])
    yield "channels", Scene().add_volume(channels, channel_axis=0, channel_names=["a", "b"])
    count = 30
    yield (
        "gaussians",
        Scene().add_gaussians(
            np.random.default_rng(1).normal(size=(count, 3)),
            np.full((count, 3), 0.3),
            np.tile([1.0, 0, 0, 0], (count, 1)),
            np.full(count, 0.9),
            colors=np.random.default_rng(2).uniform(size=(count, 3)),
        ),
    )
    yield "files", Scene().add(data / "colors.ply").add(data / "volume.npy")


def test_a_page_shows_what_the_scene_does(data, tmp_path, viewer):
    for name, scene in scenes(data):
        folder = tmp_path / name
        written = scene.save_html(folder, viewer=viewer, background="white", title="a <b>")
        assert written["share"] == 1 and (folder / "splatkit.wasm").read_bytes() == b"engine"
        assert "<title>a &lt;b&gt;</title>" in (folder / "index.html").read_text()
        page = Scene.open(folder / "scene.json")
        camera = scene.camera(SIZE)
        alike = likeness(page.render(SIZE, camera), scene.render(SIZE, camera, background="white"))
        assert alike > 45, (name, alike)


def test_functions_that_were_set_count(tmp_path, viewer):
    scene = Scene().add_volume(blob())
    before = scene.render(SIZE, scene.camera(SIZE))
    function = pysplatkit.TransferFunction.from_json(
        '{"color": [[0, 1, 0, 0]], "opacity": [[0.3, 0], [1, 0.5]]}'
    )
    scene.update("volume", transfer=function)
    scene.save_html(tmp_path / "page", viewer=viewer)
    page = Scene.open(tmp_path / "page" / "scene.json").render(SIZE, scene.camera(SIZE))
    assert likeness(page, scene.render(SIZE, scene.camera(SIZE))) > 45 > likeness(page, before)


def test_one_file_keeps_a_limit(tmp_path, viewer):
    vertices, faces = ball(60, 120)
    scene = Scene().add_mesh(vertices, faces)
    whole = scene.save_html(tmp_path / "a.html", viewer=viewer)
    assert whole["bytes"] == (tmp_path / "a.html").stat().st_size
    half = scene.save_html(tmp_path / "b.html", viewer=viewer, quality=0.5)
    assert half["share"] == 0.5 and half["psnr"] > 20 and half["bytes"] < whole["bytes"]
    limit = (half["bytes"] + whole["bytes"]) // 2
    limited = scene.save_html(tmp_path / "c.html", viewer=viewer, limit=f"{limit / 1e3} kB")
    assert limited["bytes"] <= limit and limited["share"] < 1


def test_what_no_page_shows_is_told(tmp_path, viewer):
    scene = Scene().add_mesh(*ball())
    wrong = [
        ({"quality": 0}, "quality is a share"),
        ({"limit": "some"}, "limit is a number of bytes"),
        ({"limit": 10}, "the viewer alone"),
        ({"views": ["front"]}, "views"),
        ({"viewer": tmp_path / "none"}, "cannot be read"),
    ]
    for options, message in wrong:
        with pytest.raises((pysplatkit.Error, TypeError), match=message):
            scene.save_html(tmp_path / "a.html", **{"viewer": viewer, **options})
    with pytest.raises(pysplatkit.ArgumentError, match="empty"):
        Scene().save_html(tmp_path / "a.html", viewer=viewer)
    with pytest.raises(pysplatkit.ArgumentError, match="a page is an"):
        scene.save_html(tmp_path / "a.txt", viewer=viewer)
    samples = Scene().add_samples(*particles())
    with pytest.raises(pysplatkit.ArgumentError, match="scattered samples"):
        samples.save_html(tmp_path / "a.html", viewer=viewer)
    assert not (tmp_path / "a.html").exists()
