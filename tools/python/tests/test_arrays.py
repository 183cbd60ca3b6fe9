"""Arrays of every type, order and layout; wrong ones are exceptions."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import ball, blob, particles

import pysplatkit
from pysplatkit import ArgumentError, Scene, TransferFunction

SIZE = (48, 36)
TRANSFER = TransferFunction([(0, "navy"), (100, "gold")], [(10, 0), (100, 0.8)], unit=5)


def drawn(array, **options):
    return Scene().add_volume(array, transfer=TRANSFER, **options).render(SIZE).color


@pytest.fixture(scope="module")
def whole():
    volume = blob((9, 10, 12))
    return np.round(100 * volume / volume.max())


@pytest.mark.parametrize("order", "<>")
@pytest.mark.parametrize("kind", ["i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8", "f2", "f4", "f8"])
def test_every_type_gives_the_same_picture(whole, kind, order):
    array = whole.astype(np.dtype(kind).newbyteorder(order))
    # Values of other types differ in the last digits. By these, eight pixels may divide a sheet
    # otherwise: then they differ by less than half a level of 8 bits.
    assert np.abs(drawn(array) - drawn(whole.astype("f4"))).max() < 0.5 / 255


def test_more_types(whole):
    wanted = drawn(whole.astype("f4"))
    assert np.array_equal(drawn(whole.astype(np.longdouble)), wanted)
    assert np.array_equal(drawn(whole.astype("c8") * (0.6 + 0.8j)).round(3), wanted.round(3))
    assert np.array_equal(drawn(whole.tolist()), wanted)
    step = TransferFunction([(0, "red")], [(0.5, 0), (1, 0.5)])
    assert Scene().add_volume(whole > 50, transfer=step).render(SIZE).color.max() > 0
    large = whole.astype("u8") * 10**12
    Scene().add_volume(large).render(SIZE)


def test_every_layout_gives_the_same_picture(whole):
    array = whole.astype("u1")
    wanted = drawn(array)
    wide = np.zeros(tuple(2 * n for n in array.shape), "u1")
    wide[::2, ::2, ::2] = array
    backwards = np.ascontiguousarray(array[::-1, :, ::-1])[::-1, :, ::-1]
    frozen = array.copy()
    frozen.flags.writeable = False
    for same in (np.asfortranarray(array), wide[::2, ::2, ::2], backwards, frozen):
        assert np.array_equal(drawn(same), wanted)
    mapped = np.frombuffer(array.tobytes(), "u1").reshape(array.shape)
    assert np.array_equal(drawn(mapped), wanted)
    crooked = np.frombuffer(b"0" + array.astype("i2").tobytes(), "i2", offset=1)
    assert np.abs(drawn(crooked.reshape(array.shape)) - wanted).max() < 1e-4


@pytest.mark.parametrize("kind", ["u1", "u2", "i2", "i4", "f4", "?"])
def test_arrays_are_shared(whole, kind):
    array = whole.astype(kind) if kind != "?" else whole > 50
    turned = np.ascontiguousarray(array[:, :, ::-1])
    step = TransferFunction([(0, "red")], [(0.5, 0), (1, 0.5)])
    transfer = step if kind == "?" else TRANSFER

    def drawn(volume):
        return Scene().add_volume(volume, transfer=transfer).render(SIZE).color

    before, after = drawn(array), drawn(turned)
    assert not np.array_equal(before, after)
    shared = Scene().add_volume(array, transfer=transfer, copy=False)
    usual = Scene().add_volume(array, transfer=transfer)
    copied = Scene().add_volume(array, transfer=transfer, copy=True)
    # A scene keeps the memory of its arrays, which cannot be resized meanwhile.
    with pytest.raises(ValueError, match="resize"):
        array.resize((2, 2, 2))
    array[:] = turned
    assert np.array_equal(shared.render(SIZE).color, after)
    assert np.array_equal(usual.render(SIZE).color, after)
    assert np.array_equal(copied.render(SIZE).color, before)
    del array, turned
    assert np.array_equal(shared.render(SIZE).color, after)


def test_arrays_that_need_a_copy(whole):
    array = whole.astype("i2")
    for other in (
        whole,
        array.astype(">i2"),
        np.asfortranarray(array),
        array[:, :, ::2],
        array.astype("i8"),
        array.tolist(),
    ):
        with pytest.raises(ArgumentError, match="without a copy"):
            Scene().add_volume(other, copy=False)
        Scene().add_volume(other, copy=True)
    with pytest.raises(ArgumentError, match="without a copy"):
        Scene().add_volume(np.ma.masked_array(array, array > 90), copy=False)
    # Missing values are replaced in a copy.
    holes = whole.astype("f4")
    holes[2, 3, 4] = np.nan
    with pytest.warns(pysplatkit.DataWarning, match="missing"):
        Scene().add_volume(holes)
    assert np.isnan(holes[2, 3, 4])


def test_missing_values(whole):
    holes = whole.astype("f4")
    holes[2, 3, 4], holes[5, 5, 5], holes[1, 1, 1] = np.nan, np.inf, -np.inf
    filled = np.where(np.isfinite(holes), holes, holes[np.isfinite(holes)].min())
    with pytest.warns(pysplatkit.DataWarning, match="3 of 1,080 values missing"):
        assert np.array_equal(drawn(holes), drawn(filled))
    masked = np.ma.masked_array(whole.astype("i2"), whole > 90)
    with pytest.warns(pysplatkit.DataWarning, match="missing"):
        drawn(masked)
    with pytest.warns(pysplatkit.DataWarning, match="missing"):
        drawn(whole.astype("i2"), missing=100)
    with pytest.raises(ArgumentError, match="none of the 1080 samples"):
        drawn(np.full(whole.shape, np.nan))
    positions, values = particles(100)
    values[7] = np.nan
    with pytest.warns(pysplatkit.DataWarning, match="1 of 100 values missing: left out"):
        scene = Scene().add_samples(positions, values)
    assert scene.contents[0][2] == 99


@pytest.mark.parametrize(
    ("array", "message"),
    [
        (np.zeros((0, 3, 4)), "three axes"),
        (np.zeros((3, 4)), "three axes"),
        (np.zeros((2, 3, 4, 5)), "channel_axis=0 draws all channels"),
        (np.array(5.0), "three axes"),
        (np.full((2, 2, 2), "x"), "has the type <U1"),
        (np.full((2, 2, 2), None), "has the type object"),
        (np.zeros((2, 2, 2), "M8[s]"), "has the type datetime64"),
        (np.zeros((2, 2, 2), [("a", "f4")]), "has the type"),
        ([[[1, 2], [3]]], "cannot be made an array"),
    ],
)
def test_wrong_volumes_are_refused(array, message):
    with pytest.raises(ArgumentError, match=message):
        Scene().add_volume(array)


def test_wrong_options_are_refused(whole):
    for options, message in [
        ({"spacing": 0}, "spacing"),
        ({"spacing": (1, 2)}, "three numbers"),
        ({"spacing": float("nan")}, "finite"),
        ({"axes": np.zeros((3, 3))}, "spacing"),
        ({"axes": np.eye(2)}, "axes"),
        ({"modality": "photo"}, "modality"),
        ({"kernel": "box"}, "kernel"),
        ({"sigma": 2, "kernel": "hann"}, "sigma"),
        ({"range": (2, 1)}, "range"),
        ({"colormap": "virids"}, "colour map"),
        ({"up": (0, 0, 0)}, "up"),
        ({"isosurfaces": ["x"]}, "isosurface"),
        ({"opacity_unit": -1}, "opacity_unit"),
    ]:
        with pytest.raises(ArgumentError, match=message):
            Scene().add_volume(whole, **options)
    with pytest.raises(TypeError, match="did you mean 'colormap'"):
        Scene().add_volume(whole, colourmap="viridis")
    scene = Scene().add_volume(whole)
    for options, message in [
        ({"size": (0, 5)}, "above 0"),
        ({"size": (5, -1)}, "size"),
        ({"size": (10**6, 10**6)}, "larger than"),
        ({"samples": 5}, "samples"),
        ({"mode": "rays"}, "mode"),
        ({"back_to_front": True}, "back_to_front"),
        ({"background": "blak"}, "no colour"),
        ({"background": (0, 0, 2)}, "colour"),
        ({"sheet_thickness": -1}, "sheet"),
        ({"clips": [pysplatkit.Clip.box((1, 1, 1), (0, 0, 0))]}, "box"),
        ({"camera": pysplatkit.Camera((0, 0, 0), (0, 0, 0))}, "focal point"),
    ]:
        with pytest.raises(ArgumentError, match=message):
            scene.render(**{"size": SIZE, **options})
    with pytest.raises(pysplatkit.NothingToDrawError):
        Scene().render(SIZE)
    assert Scene().bounds is None and "empty" in repr(Scene())


def test_meshes_from_arrays():
    vertices, faces = ball()
    wanted = Scene().add_mesh(vertices, faces).render(SIZE).color
    for kind in ("i4", "i8", "u2", "u4"):
        scene = Scene().add_mesh(vertices, faces.astype(kind))
        assert np.array_equal(scene.render(SIZE).color, wanted)
    quads = [[0, 1, 2, 3]]
    square = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    halves = Scene().add_mesh(square, [[0, 1, 2], [0, 2, 3]]).render(SIZE).color
    assert np.array_equal(Scene().add_mesh(square, quads).render(SIZE).color, halves)
    real = np.clip(0.5 + 0.5 * vertices, 0, 1)
    pictures = [
        Scene().add_mesh(vertices, faces, colors=colors).render(SIZE).color
        for colors in (np.round(255 * real).astype("u1"), np.round(65535 * real).astype("u2"), real)
    ]
    assert np.abs(pictures[0] - pictures[1]).max() < 0.01
    assert np.array_equal(pictures[0], pictures[2])
    up = (0, 0, 1)
    by_value = Scene().add_mesh(vertices, faces, values=vertices[:, 2], colormap="turbo", up=up)
    by_height = Scene().add_mesh(vertices, faces, color="height", colormap="turbo", up=up)
    assert np.abs(by_value.render(SIZE).color - by_height.render(SIZE).color).max() < 0.02
    far = Scene().add_mesh(vertices + [4e6, 5e6, 0], faces)
    assert np.abs(far.render(SIZE).color - wanted).max() < 0.05


def test_wrong_meshes_are_refused():
    vertices, faces = ball()
    heights = vertices[:, 2]
    for call, message in [
        (lambda: Scene().add_mesh(vertices, faces + 10**6), "names the vertices"),
        (lambda: Scene().add_mesh(vertices, faces - 10), "names the vertices"),
        (lambda: Scene().add_mesh(vertices, faces.astype(float)), "whole numbers"),
        (lambda: Scene().add_mesh(vertices[:, :2], faces), r"\(n, 3\)"),
        (lambda: Scene().add_mesh(np.full((3, 3), np.nan), [[0, 1, 2]]), "not finite"),
        (lambda: Scene().add_mesh(vertices, faces, colors=faces), "uint8"),
        (lambda: Scene().add_mesh(vertices, faces, colors=vertices * 300), "between 0 and 1"),
        (lambda: Scene().add_mesh(vertices, faces, values=[1, 2]), "2 values for"),
        (lambda: Scene().add_mesh(vertices, faces, normals=vertices[1:]), "normals for"),
        (lambda: Scene().add_points(np.zeros((0, 3))), "no positions"),
        (lambda: Scene().add_points(vertices, color="values"), "no values"),
        (lambda: Scene().add_points(vertices, opacity=0), "opacity"),
        (lambda: Scene().add_samples(vertices, vertices), r"\(n,\)"),
        (lambda: Scene().add_samples(vertices, vertices[:5, 0]), "values for"),
        (lambda: Scene().add_samples(vertices, heights, radii=0 * heights - 1), "radius"),
        (lambda: Scene().add_samples(vertices, heights, neighbours=1), "neighbours"),
        (lambda: Scene().add_gaussians(vertices, vertices, vertices, vertices[:, 0]), "colors"),
        (lambda: Scene().add(np.zeros((5, 7))), "neither a volume"),
    ]:
        with pytest.raises(ArgumentError, match=message):
            call()


def test_labels(tmp_path):
    labels = np.zeros((20, 20, 20), np.uint16)
    labels[4:16, 4:16, 4:10], labels[4:16, 4:16, 10:16] = 3, 1003
    table = tmp_path / "table.txt"
    table.write_text("3 left 255 0 0 255\n1003 right 0 0 255 255\n")

    def drawn(**options):
        return Scene().add_volume(labels, **options).render(SIZE, shade=False).color

    # Names change nothing.
    assert np.array_equal(drawn(labels=True), drawn(labels={3: "left", 1003: "right"}))
    assert not np.array_equal(drawn(labels=True), drawn(labels=False))
    # The colours of a table.
    red, green, blue = (drawn(labels=table)[..., channel] for channel in range(3))
    assert red.max() > 0.9
    assert blue.max() > 0.9
    assert green.max() < 0.05
    with pytest.raises(pysplatkit.Error, match="missing"):
        Scene().add_volume(labels, labels=tmp_path / "missing.txt")


def test_directions_are_taken_as_the_command_takes_them():
    from pysplatkit import _options

    for text, wanted in [
        ("+Y", [0, 1, 0]),
        ("-x", [-1, 0, 0]),
        ("Z", [0, 0, 1]),
        ("1,2,3", [1, 2, 3]),
        ((1, 2, 3), [1, 2, 3]),
    ]:
        assert _options.direction(text) == wanted
    scene = Scene().add_points(np.random.default_rng(1).random((50, 3)))
    assert tuple(scene.camera(up="+Y", view="front").view_up) == (0, 1, 0)
    volume = Scene().add_volume(np.arange(64.0).reshape(4, 4, 4), isosurfaces=30)
    assert volume.contents[0][0] == "volume"


def test_all_errors_are_ours():
    scene = Scene().add_points(np.random.default_rng(1).random((50, 3)))
    for call in (
        lambda: scene.camera(up="up"),
        lambda: scene.camera(up="a,b,c"),
        lambda: scene.camera(focal_point="middle"),
        lambda: scene.camera(focal_point=object()),
        lambda: scene.render((8, 8), background=5),
        lambda: scene.render((8, 8), background="nocolour"),
        lambda: Scene().add_volume(np.zeros((2, 2, 2)), spacing="wide"),
        lambda: Scene().add_volume(np.zeros((2, 2, 2)), isosurfaces=["one"]),
        lambda: Scene().add_volume(np.zeros((2, 2, 2)), shine=3),
        lambda: Scene().add(object()),
    ):
        with pytest.raises(pysplatkit.Error):
            call()


def test_warnings_name_the_line_of_the_program():
    holes = np.arange(64.0).reshape(4, 4, 4)
    holes[0, 0, 0] = np.nan
    for call in (lambda: Scene().add(holes), lambda: pysplatkit.render(holes, size=(8, 8))):
        with pytest.warns(pysplatkit.DataWarning, match="missing") as caught:
            call()
        assert {warning.filename for warning in caught} == {__file__}
