"""Pictures of arrays and files, and what they equal."""

from __future__ import annotations

import json
import pickle
import struct

import numpy as np
import pytest
from conftest import ball, blob, particles, read_png

import pysplatkit
from pysplatkit import Clip, Scene, TransferFunction

SIZE = (96, 72)


def test_two_lines_draw_a_picture(tmp_path):
    picture = pysplatkit.render(blob(), size=SIZE)
    assert picture.save(tmp_path / "a.png").is_file()
    assert picture.rgba.shape == (72, 96, 4) and picture.rgba.dtype == np.uint8
    assert picture.rgba[:, :, 3].min() == 255 and picture.rgba[:, :, :3].max() > 100
    assert np.array_equal(read_png(tmp_path / "a.png"), picture.rgba)
    assert picture.depth.shape == (72, 96) and np.isfinite(picture.depth).any()
    assert picture.color.shape == (72, 96, 4) and 0 < picture.color.max() <= 1
    assert picture.statistics["gathered"] > 0
    assert picture._repr_png_()[:4] == b"\x89PNG" and np.asarray(picture).shape == (72, 96, 4)


def test_pictures_are_drawn_alike_twice():
    scene = Scene().add_volume(blob()).add_mesh(*ball(), color="orange")
    first, second = (scene.render(SIZE) for _ in range(2))
    other = Scene().add_volume(blob()).add_mesh(*ball(), color="orange").render(SIZE)
    for picture in (second, other):
        assert np.array_equal(first.color, picture.color)
        assert np.array_equal(first.depth, picture.depth)


def test_backgrounds_and_files(tmp_path):
    clear = pysplatkit.render(blob(), size=SIZE, background=None)
    assert clear.rgba[:, :, 3].min() == 0
    assert tuple(clear.over("orange").rgba[0, 0]) == (255, 165, 0, 255)
    assert tuple(clear.over((0, 0.5, 1)).rgba[0, 0]) == (0, 128, 255, 255)
    assert clear.save(tmp_path / "a.jpg").read_bytes()[:2] == b"\xff\xd8"
    clear.save_depth(tmp_path / "depth.png")
    with pytest.raises(pysplatkit.OutputError, match="exists already"):
        clear.save(tmp_path / "a.jpg", overwrite=False)
    with pytest.raises(ValueError, match="read-only"):
        clear.rgba[0, 0] = 0


def test_figures_have_a_size_on_paper_and_several_views(tmp_path):
    picture = pysplatkit.render(
        blob(), views=["front", "left"], width="2in", dpi=100, panel_labels="none", background=None
    )
    assert picture.size == (200, 100)
    left, right = picture.depth[:, :100], picture.depth[:, 100:]
    assert np.isfinite(left).any() and np.isfinite(right).any()
    again = pickle.loads(pickle.dumps(picture))
    files = [one.save(tmp_path / f"{number}.png") for number, one in enumerate((picture, again))]
    assert files[0].read_bytes() == files[1].read_bytes()
    # Pixels a metre.
    assert b"pHYs" + struct.pack(">IIB", 3937, 3937, 1) in files[0].read_bytes()
    for wrong in (
        {"views": ["front"], "camera": picture.camera},
        {"views": ["front"], "view": "left"},
        {"width": "2in"},
        {"columns": 2},
    ):
        with pytest.raises(pysplatkit.ArgumentError, match=r"views|dpi"):
            pysplatkit.render(blob(), **wrong)


def test_pictures_have_many_formats(tmp_path):
    picture = pysplatkit.render(blob(), size=SIZE, background=None)
    starts = {"a.tiff": b"II", "a.webp": b"RIFF", "a.exr": b"\x76\x2f\x31\x01"}
    for name, start in starts.items():
        assert picture.save(tmp_path / name).read_bytes().startswith(start)
    deep = picture.save(tmp_path / "deep.png", bits=16).read_bytes()
    assert deep[24] == 16
    with pytest.raises(pysplatkit.ArgumentError, match="8 bits a channel"):
        picture.save(tmp_path / "a.jpg", bits=16)


#: Files, flags of the command, and the options that mean the same.
CASES = [
    ("volume.npy", [], {}),
    (
        "volume.npy",
        ["--views", "front,top", "--dpi", "150", "--scale-bar"],
        {"views": ["front", "top"], "dpi": 150, "scale_bar": True},
    ),
    ("bytes.npy", ["--mode", "splats"], {"mode": "splats"}),
    ("bytes.npy", ["--optics", "maximum"], {"optics": "maximum"}),
    ("bytes.npy", ["--transfer", "generic"], {"transfer": "generic"}),
    ("bytes.npy", ["--kernel", "catmull-rom"], {"kernel": "catmull-rom"}),
    (
        "bytes.npy",
        ["--sharp", "--kernel", "cubic-b-spline"],
        {"sharp": True, "kernel": "cubic-b-spline"},
    ),
    (
        "bytes.npy",
        ["--colormap", "plasma", "--range", "50,200"],
        {"colormap": "plasma", "range": (50, 200)},
    ),
    ("bytes.npy", ["--iso", "100,180:#ff8800:0.5"], {"isosurfaces": [100, (180, "#ff8800", 0.5)]}),
    (
        "bytes.npy",
        ["--spacing", "1,2,3", "--background", "none"],
        {"spacing": (1, 2, 3), "background": None},
    ),
    ("bytes.npy", ["--clip", "plane:1,0,0,12"], {"clips": [Clip.plane((1, 0, 0), 12)]}),
    (
        "bytes.npy",
        ["--cut-out", "box:0,0,0:10,10,30"],
        {"clips": [Clip.box((0, 0, 0), (10, 10, 30), inside=False)]},
    ),
    (
        "bytes.npy",
        ["--samples", "4", "--classify", "post", "--no-shade"],
        {"samples": 4, "classify": "post", "shade": False},
    ),
    ("mesh.ply", [], {}),
    (
        "mesh.ply",
        ["--color", "height", "--colormap", "turbo"],
        {"color": "height", "colormap": "turbo"},
    ),
    ("mesh.ply", ["--color", "normal", "--crease", "0"], {"color": "normal", "crease": 0}),
    ("mesh.ply", ["--color", "orange", "--opacity", "0.5"], {"color": "orange", "opacity": 0.5}),
    ("mesh.ply", ["--mode", "splats"], {"mode": "splats"}),
    ("colors.ply", ["--radius-scale", "0.5"], {"radius_scale": 0.5}),
    ("cloud.ply", ["--background", "white"], {"background": "white"}),
    ("samples.npy", [], {}),
    ("samples.npy", ["--radius", "0.4", "--no-slopes"], {"radius": 0.4, "slopes": False}),
    ("cells.vtk", [], {}),
    ("cells.vtk", ["--iso", "0.5"], {"isosurfaces": [0.5]}),
    ("tree.splk", [], {}),
    ("tree.splk", ["--cut", "8"], {"cut": 8}),
    ("bricks.splv", [], {}),
    ("trained.spz", [], {}),
]


@pytest.mark.parametrize(("name", "flags", "options"), CASES)
def test_files_are_drawn_as_by_the_command(command, data, tmp_path, name, flags, options):
    out = tmp_path / "command.png"
    size = f"{SIZE[0]}x{SIZE[1]}"
    command("render", data / name, "--engine", "cpu", "--size", size, *flags, "-o", out)
    picture = pysplatkit.render(data / name, size=SIZE, **options)
    assert np.array_equal(read_png(out), picture.rgba)


def test_cameras_are_those_of_the_command(command, data, tmp_path):
    scene = Scene().add(data / "bytes.npy").add(data / "colors.ply")
    files = [data / "bytes.npy", data / "colors.ply"]
    for flags, options in [
        ([], {}),
        (["--view", "iso", "--zoom", "1.5"], {"view": "iso", "zoom": 1.5}),
        (["--azimuth", "70", "--up", "0,1,0"], {"azimuth": 70, "up": (0, 1, 0)}),
        (["--orthographic", "--view", "left"], {"orthographic": True, "view": "left"}),
        (
            ["--focal-point", "1,2,3", "--view-angle", "50"],
            {"focal_point": (1, 2, 3), "view_angle": 50},
        ),
        (["--distance", "90"], {"distance": 90}),
    ]:
        out = tmp_path / "camera.png"
        printed = command(
            "render",
            *files,
            "--engine",
            "cpu",
            "--size",
            "640x480",
            *flags,
            "--json",
            "--overwrite",
            "-o",
            out,
        )
        camera = scene.camera((640, 480), **options)
        assert json.loads(camera.to_json()) == json.loads(printed)["camera"]
        assert np.array_equal(read_png(out), scene.render((640, 480), camera).rgba)


def test_a_turntable_keeps_its_distance():
    scene = Scene().add_mesh(*ball())
    cameras = scene.turntable(8, SIZE, elevation=10)
    distances = [np.linalg.norm(np.subtract(c.position, c.focal_point)) for c in cameras]
    assert len(cameras) == 8 and np.allclose(distances, distances[0])
    pictures = [scene.render(SIZE, camera).rgba for camera in cameras]
    assert not np.array_equal(pictures[0], pictures[2])


def test_arrays_are_drawn_as_their_files(data):
    def same(array, file, **options):
        picture = pysplatkit.render(array, size=SIZE, **options)
        assert np.array_equal(picture.rgba, pysplatkit.render(data / file, size=SIZE).rgba)

    same(np.load(data / "volume.npy"), "volume.npy")
    same(np.load(data / "bytes.npy"), "bytes.npy")
    rows = np.load(data / "samples.npy")
    picture = Scene().add_samples(rows[:, :3], rows[:, 3]).render(SIZE)
    assert np.array_equal(picture.rgba, pysplatkit.render(data / "samples.npy", size=SIZE).rgba)
    vertices, faces = ball()
    picture = Scene().add_mesh(vertices, faces).render(SIZE)
    assert np.array_equal(picture.rgba, pysplatkit.render(data / "mesh.ply", size=SIZE).rgba)
    colors = np.clip(255 * (0.5 + 0.5 * vertices), 0, 255).astype("u1")
    picture = Scene().add_points(vertices.astype("f4"), colors=colors).render(SIZE)
    assert np.array_equal(picture.rgba, pysplatkit.render(data / "cloud.ply", size=SIZE).rgba)


def test_lattices_lie_where_they_are_told():
    scene = Scene().add_volume(
        blob(), spacing=(1, 2, 3), origin=(10, 20, 30), axes=[[0, -1, 0], [1, 0, 0], [0, 0, 1]]
    )
    # x of the array points along the world's y, and y along −x.
    assert scene.bounds == ((10 - 2 * 19, 20, 30), (10, 20 + 23, 30 + 3 * 17))
    assert scene.contents == [("volume", "volume", blob().size)] and len(scene) == 1


def test_transfer_functions(tmp_path):
    function = TransferFunction([(0, "black"), (1, (1, 0.5, 0))], [(0.3, 0), (1, 0.5)], unit=2)
    again = TransferFunction.from_json(function.to_json())
    assert again.to_json() == function.to_json() and again.colors[1] == (1, (1, 0.5, 0))
    path = tmp_path / "own.json"
    path.write_text(function.to_json())
    pictures = [
        pysplatkit.render(blob(), size=SIZE, transfer=transfer).rgba
        for transfer in (function, path, str(path), function.to_json())
    ]
    assert all(np.array_equal(pictures[0], picture) for picture in pictures)
    assert set(pysplatkit.TRANSFER_FUNCTIONS) >= {"ct-bone", "mri"}
    assert TransferFunction.named("mri", (0, 10)).opacities[-1][0] == 10
    with pytest.raises(pysplatkit.TransferError, match="without opacity"):
        TransferFunction([(0, "red")], [(0, 0)]).to_json()
    with pytest.raises(pysplatkit.NothingToDrawError, match="shows values between"):
        pysplatkit.render(blob(), transfer=TransferFunction([(0, "red")], [(50, 0), (60, 1)]))


def test_particles_with_radii_and_gaussians():
    positions, values = particles()
    by_radius = Scene().add_samples(positions, values, radii=np.full(len(values), 0.4))
    terms = np.tile([0.04, 0, 0, 0.04, 0, 0.04], (len(values), 1))
    by_covariance = Scene().add_samples(positions, values, covariances=terms)
    wanted = by_radius.render(SIZE).rgba.astype(int)
    assert np.abs(wanted - by_covariance.render(SIZE).rgba).max() <= 1
    count = len(positions)
    turns = np.tile([2.0, 0, 0, 0], (count, 1))
    scene = Scene().add_gaussians(
        positions,
        np.full((count, 3), 0.05),
        turns,
        np.full(count, 0.9),
        colors=np.tile([0.0, 1.0, 0.0], (count, 1)),
    )
    red, green, _, opacity = scene.render(SIZE, background=None).color.reshape(-1, 4).T
    assert opacity.max() > 0.5 and green.max() > 0.4 and red.max() < 0.05


def test_an_own_camera_may_see_nothing():
    scene = Scene().add_volume(blob())
    camera = scene.camera(SIZE)
    away = pysplatkit.Camera(camera.position, np.multiply(camera.position, 2) - camera.focal_point)
    assert scene.render(SIZE, away, background=None).rgba.max() == 0
    assert scene.render(SIZE, camera).camera == camera
    turned = camera.copy().azimuth(20).elevation(5).zoom(2)
    assert turned.view_angle == camera.view_angle / 2 and turned != camera
    assert camera.copy().orthographic().height > 0


#: Scenes: inputs, and the other parts of a scene file.
SCENES = [
    (["bytes.npy"], {}),
    (["bytes.npy"], {"appearance": {"transfer": "generic", "range": [20, 200]}}),
    (["bytes.npy"], {"appearance": {"isosurfaces": [{"percent": 50, "color": "orange"}]}}),
    (["bytes.npy"], {"appearance": {"kernel": "linear", "colormap": "coolwarm_r"}}),
    (["bytes.npy"], {"appearance": {"kernel": [1, 0.5, 0], "extent": 2}}),
    (["bytes.npy"], {"picture": {"optics": "maximum"}}),
    (["bytes.npy"], {"picture": {"mode": "axis-sheets", "shade": False}}),
    (["bytes.npy"], {"picture": {"mode": "splats", "back_to_front": True, "samples": 4}}),
    (["bytes.npy"], {"picture": {"clips": [{"side": {"axis": "x", "below": True, "at": "50%"}}]}}),
    (["bytes.npy"], {"reading": {"spacing": [1, 1, 2]}, "framing": {"view": "left"}}),
    (["colors.ply"], {"appearance": {"color": "height", "colormap": "turbo"}}),
    (["colors.ply"], {"appearance": {"color": "#ff8800", "opacity": 0.5, "edges": True}}),
    (["colors.ply"], {"framing": {"azimuth": 70, "elevation": -10, "orthographic": True}}),
    (["cloud.ply"], {"picture": {"background": "white"}, "framing": {"zoom": 1.5}}),
    (["samples.npy"], {"reading": {"radius": 0.4, "slopes": False}}),
    (["cells.vtk"], {"appearance": {"range": [0.2, 0.8]}}),
    (["tree.splk"], {"picture": {"cut": 8, "background": "none"}}),
    (["bricks.splv"], {"picture": {"sheet_thickness": 1.5}}),
    (["trained.spz"], {"framing": {"distance": 9, "up": [0, 0, 1]}}),
    (
        ["bytes.npy", "colors.ply"],
        {
            "camera": {
                "position": [60, -40, 30],
                "focal_point": [7, 7, 7],
                "view_up": [0, 0, 1],
                "view_angle": 30,
            }
        },
    ),
]


@pytest.mark.parametrize("number", range(len(SCENES)))
def test_scene_files_are_drawn_as_by_the_command(command, data, tmp_path, number):
    names, parts = SCENES[number]
    picture = {"size": SIZE, **parts.get("picture", {})}
    scene = {"splatkit_scene": 2, "inputs": [{"file": name} for name in names], **parts}
    path = data / f"scene{number}.json"
    path.write_text(json.dumps({**scene, "picture": picture}))
    out = [tmp_path / name for name in ("command.png", "python.png")]
    command("render", path, "--engine", "cpu", "-o", out[0])
    pysplatkit.render(path).save(out[1])
    assert out[0].read_bytes() == out[1].read_bytes()


def test_scenes_are_saved_for_the_command(command, data, tmp_path):
    scene = Scene().add(data / "bytes.npy", isosurfaces=[(90, "red", 0.5)], spacing=(1, 1, 2))
    scene.add(data / "colors.ply", color="ivory", opacity=0.7)
    clip = pysplatkit.Clip.box((0, 0, 0), (9, 99, 99))
    camera = scene.camera(SIZE, view="iso")
    drawn = {"size": SIZE, "background": "white", "clips": [clip], "samples": 4}
    path = data / "saved.json"
    scene.save(path, camera, **drawn)
    out = tmp_path / "command.png"
    command("render", path, "--engine", "cpu", "-o", out)
    picture = scene.render(camera=camera, **drawn)
    assert np.array_equal(read_png(out), picture.rgba)
    opened = Scene.open(path)
    assert np.array_equal(opened.render().rgba, picture.rgba)
    assert opened.render((20, 10)).size == (20, 10)
    with pytest.raises(pysplatkit.ArgumentError, match="arrays"):
        Scene().add_points(np.eye(3)).save(path)
    with pytest.raises(pysplatkit.InputError, match="leads out"):
        (data / "other").mkdir(exist_ok=True)
        other = data / "other" / "s.json"
        other.write_text('{"splatkit_scene": 2, "inputs": [{"file": "../bytes.npy"}]}')
        Scene.open(other)
    assert len(Scene.open(other, trusted=True)) == 1
