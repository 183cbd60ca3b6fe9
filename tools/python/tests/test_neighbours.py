"""Objects of other packages are drawn as the plain arrays are, where these packages say they are."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import ball, blob

import pysplatkit
from pysplatkit import ArgumentError, Scene, TransferFunction

# Other packages use what is deprecated. ITK does not survive an exception there.
pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning")

SIZE = (64, 48)
TRANSFER = TransferFunction([(0, "navy"), (100, "gold")], [(10, 0), (100, 0.8)], unit=5)
DIMS = (9, 10, 12)
SPACING = (0.5, 0.8, 1.25)
ORIGIN = (3.0, -2.0, 7.5)
#: A rotation about an oblique axis, and the same with x mirrored.
TURN = np.array([[2, -1, 2], [2, 2, -1], [-1, 2, 2]]) / 3
MIRRORED = TURN * [-1, 1, 1]
#: From ITK's frame of a patient, whose x leads to the left and y to the back, to splatkit's.
LPS = np.diag([-1, -1, 1])
#: The index i, j, k of the marked sample.
MARK = (9, 2, 5)


def phantom(kind="i2"):
    """Returns samples [z, y, x] of which none is like another, and one is marked."""
    volume = blob(DIMS)
    volume = np.round(100 * volume / volume.max()).astype(kind)
    volume[MARK[::-1]] = 120
    return volume


def marked():
    """Returns samples of which all are empty but the marked one."""
    volume = np.zeros(DIMS, "u1")
    volume[MARK[::-1]] = 100
    return volume


def picture(scene):
    return scene.render(SIZE).color


def drawn(source, **options):
    return picture(Scene().add(source, transfer=TRANSFER, **options))


def plain(array, **place):
    return picture(Scene().add_volume(array, transfer=TRANSFER, **place))


def place_of(source):
    """Returns where the marked sample of an object is drawn, by three views without perspective."""
    scene = Scene().add_volume(source, transfer=TRANSFER)
    lines, places = [], []
    for view in ("front", "right", "top"):
        camera = scene.camera(SIZE, view=view, orthographic=True)
        light = scene.render(SIZE, camera, background=None).color[..., 3].astype(float)
        row, column = (np.sum(at * light) / light.sum() for at in np.indices(light.shape))
        focus = np.array(camera.focal_point)
        forward = focus - camera.position
        right = np.cross(forward, camera.view_up)
        right /= np.linalg.norm(right)
        up = np.cross(right, forward) / np.linalg.norm(forward)
        unit = camera.height / SIZE[1]
        lines += [right, up]
        places.append(right @ focus + unit * (column + 0.5 - SIZE[0] / 2))
        places.append(up @ focus - unit * (row + 0.5 - SIZE[1] / 2))
    return np.linalg.lstsq(np.array(lines), np.array(places), rcond=None)[0]


def image_of_vtk(pyvista, array, direction):
    image = pyvista.ImageData(dimensions=array.shape[::-1], spacing=SPACING, origin=ORIGIN)
    image.direction_matrix = direction
    image["own"] = array.ravel()
    return image, np.array(image.points[np.ravel_multi_index(MARK[::-1], array.shape)])


def image_of_nibabel(nibabel, array, direction):
    affine = np.eye(4)
    affine[:3, :3] = direction * SPACING
    affine[:3, 3] = ORIGIN
    image = nibabel.Nifti1Image(np.asfortranarray(array.T), affine)
    return image, nibabel.affines.apply_affine(image.affine, MARK)


def image_of_itk(itk, array, direction):
    image = itk.image_from_array(array)
    image.SetSpacing(SPACING)
    image.SetOrigin(ORIGIN)
    image.SetDirection(itk.matrix_from_array(np.ascontiguousarray(direction)))
    return image, LPS @ image.TransformIndexToPhysicalPoint(MARK)


def image_of_simple_itk(sitk, array, direction):
    image = sitk.GetImageFromArray(array)
    image.SetSpacing(SPACING)
    image.SetOrigin(ORIGIN)
    image.SetDirection(direction.ravel().tolist())
    return image, LPS @ image.TransformIndexToPhysicalPoint(MARK)


IMAGES = {
    "pyvista": image_of_vtk,
    "nibabel": image_of_nibabel,
    "itk": image_of_itk,
    "SimpleITK": image_of_simple_itk,
}


@pytest.mark.parametrize(
    "direction", [np.eye(3), TURN, MIRRORED], ids=["even", "turned", "mirrored"]
)
@pytest.mark.parametrize("package", IMAGES)
def test_images_are_where_their_package_says(package, direction):
    module = pytest.importorskip(package)
    array = phantom()
    image, _ = IMAGES[package](module, array, direction)
    turn = LPS if package in ("itk", "SimpleITK") else np.eye(3)
    # The front of a patient differs between the frames, so that the cameras are the same here.
    wanted = Scene().add_volume(
        array,
        transfer=TRANSFER,
        spacing=SPACING,
        origin=turn @ ORIGIN,
        axes=turn @ direction,
    )
    camera = wanted.camera(SIZE)
    for scene in (
        Scene().add(image, transfer=TRANSFER),
        Scene().add_volume(image, transfer=TRANSFER),
    ):
        assert np.allclose(scene.bounds, wanted.bounds)
        # Rounding of the matrices moves the last bits of a float.
        away = np.abs(scene.render(SIZE, camera).color - wanted.render(SIZE, camera).color)
        assert away.max() < 1e-4
    # An image in line with the axes is the same to the byte.
    if direction is not TURN and direction is not MIRRORED:
        assert np.array_equal(scene.render(SIZE, camera).rgba, wanted.render(SIZE, camera).rgba)
    image, place = IMAGES[package](module, marked(), direction)
    step = min(SPACING)
    assert np.abs(place_of(image) - place).max() < 0.5 * step
    # The test can fail: the sample next to it is elsewhere.
    other, _ = IMAGES[package](module, np.roll(marked(), 1, axis=2), direction)
    assert np.abs(place_of(other) - place).max() > 0.5 * step


@pytest.mark.parametrize("package", IMAGES)
def test_images_are_not_copied(package):
    module = pytest.importorskip(package)
    image, _ = IMAGES[package](module, phantom(), np.eye(3))
    scene = Scene().add_volume(image, transfer=TRANSFER, copy=False)
    # The scene keeps their memory.
    before = picture(scene)
    del image
    _ = [phantom() for _ in range(20)]
    assert np.array_equal(picture(scene), before)


def test_arguments_replace_what_an_image_says():
    nibabel = pytest.importorskip("nibabel")
    image, _ = image_of_nibabel(nibabel, phantom(), TURN)
    scene = Scene().add_volume(image, spacing=1.0, origin=(0, 0, 0), axes=np.eye(3))
    assert scene.bounds == ((0.0, 0.0, 0.0), tuple(float(n - 1) for n in DIMS[::-1]))


def test_nibabel_scales_and_times(tmp_path):
    nibabel = pytest.importorskip("nibabel")
    header = nibabel.Nifti1Header()
    header.set_data_dtype("i2")
    header.set_slope_inter(0.5, -10)
    array = phantom("f4")
    image = nibabel.Nifti1Image(array.T, np.diag([2.0, 2, 2, 1]), header)
    image.header.set_xyzt_units("mm")
    nibabel.save(image, tmp_path / "scaled.nii")
    read = nibabel.load(tmp_path / "scaled.nii")
    scene = Scene().add(read, transfer=TRANSFER)
    # As the file itself, whose front is the same.
    file = Scene().add(tmp_path / "scaled.nii", transfer=TRANSFER)
    assert np.array_equal(picture(scene), picture(file))
    times = nibabel.Nifti1Image(np.zeros((3, 4, 5, 2)), np.eye(4))
    with pytest.raises(ArgumentError, match="slicer"):
        Scene().add(times)


def test_arrays_of_vtk_by_name():
    pyvista = pytest.importorskip("pyvista")
    array = phantom("f4")
    image, _ = image_of_vtk(pyvista, array, np.eye(3))
    image["other"] = np.stack([array.ravel(), 0 * array.ravel(), 0 * array.ravel()], 1)
    cells = array[1:, 1:, 1:]
    image.cell_data["cells"] = cells.ravel()
    image.set_active_scalars("own")
    place = {"spacing": SPACING, "origin": ORIGIN}
    wanted = plain(array, **place)
    for options in ({}, {"scalar": "own"}, {"scalar": "other"}, {"scalar": "other:0"}):
        assert np.array_equal(drawn(image, **options), wanted)
    center = np.array(ORIGIN) + 0.5 * np.array(SPACING)
    wanted = plain(cells, spacing=SPACING, origin=center)
    assert np.array_equal(drawn(image, scalar="cells"), wanted)
    with pytest.raises(ArgumentError, match="no array 'owm'; its arrays: 'own'"):
        drawn(image, scalar="owm")
    with pytest.raises(ArgumentError, match="no arrays"):
        drawn(pyvista.ImageData(dimensions=(3, 3, 3)))
    # A part of an image begins at another index.
    part = image.extract_subset((2, 11, 0, 9, 1, 8), rebase_coordinates=False)
    first = np.array(ORIGIN) + np.array([2, 0, 1]) * SPACING
    wanted = plain(array[1:, :, 2:], spacing=SPACING, origin=first)
    assert np.abs(drawn(part, scalar="own") - wanted).max() < 1e-4


def test_rectilinear_grids():
    pyvista = pytest.importorskip("pyvista")
    array = phantom("f4")
    lines = [np.arange(n) * s + o for n, s, o in zip(DIMS[::-1], SPACING, ORIGIN, strict=True)]
    grid = pyvista.RectilinearGrid(*lines)
    grid["own"] = array.ravel()
    assert np.array_equal(drawn(grid), plain(array, spacing=SPACING, origin=ORIGIN))
    lines[0] = np.cumsum(np.linspace(0.2, 1, DIMS[2]))
    grid = pyvista.RectilinearGrid(*lines)
    grid["own"] = array.ravel()
    scene = Scene().add(grid, transfer=TRANSFER)
    assert np.allclose(scene.bounds, [[line[0] for line in lines], [line[-1] for line in lines]])
    assert np.array_equal(picture(scene), plain(array, coordinates=lines))
    # Where a line is denser, the same samples are elsewhere.
    assert not np.array_equal(picture(scene), plain(array, spacing=SPACING))
    with pytest.raises(ArgumentError, match="do not fit"):
        plain(array, coordinates=lines[::-1])


def test_grids_of_cells(data, tmp_path):
    pyvista = pytest.importorskip("pyvista")
    file = picture(Scene().add(data / "cells.vtk"))
    grid = pyvista.read(data / "cells.vtk")
    for scene in (Scene().add(grid), Scene().add_cells(grid, scalar="heat")):
        assert scene.contents[0][0] == "cells"
        assert np.array_equal(picture(scene), file)
    points, heat = np.array(grid.points), np.array(grid["heat"])
    rows = grid.cells.reshape(-1, 9)
    for cells in (rows[:, 1:], grid.cells):
        assert np.array_equal(picture(Scene().add_cells(points, cells, heat)), file)
    axis = np.linspace(-1, 1, 4)
    x, y, z = np.meshgrid(axis, axis, axis, indexing="ij")
    curved = pyvista.StructuredGrid(x, y, z)
    at = {tuple(np.round(place, 6)): value for place, value in zip(points, heat, strict=True)}
    curved["heat"] = [at[tuple(np.round(place, 6))] for place in curved.points]
    camera = Scene().add(grid).camera(SIZE)
    range_ = (float(heat.min()), float(heat.max()))
    pictures = [
        Scene().add(source, colormap="turbo", range=range_).render(SIZE, camera).color
        for source in (grid, curved)
    ]
    assert np.abs(pictures[0] - pictures[1]).max() < 0.02
    for scene in (Scene().add(curved), Scene().add_points(curved), Scene().add_points(grid)):
        assert np.allclose(scene.bounds, [[-1] * 3, [1] * 3])
    curved.cell_data["own"] = np.arange(27.0)
    of_cells = picture(Scene().add_cells(curved, scalar="own"))
    assert not np.array_equal(of_cells, picture(Scene().add_cells(curved, scalar="heat")))
    # Values that are given need not be of the kind that the grid's are.
    numbers = np.arange(len(curved.points))
    assert np.array_equal(
        picture(Scene().add_cells(curved, values=numbers, scalar="own")),
        picture(Scene().add_cells(curved, values=numbers, scalar="heat")),
    )
    with pytest.raises(TypeError, match=r"add_volume\(\) takes a volume, but .* is a set of cells"):
        Scene().add_volume(grid)
    with pytest.raises(TypeError, match=r"add_mesh\(\) takes a mesh"):
        Scene().add_mesh(grid)
    with pytest.raises(TypeError, match="needs points and cells"):
        Scene().add_cells(points)
    with pytest.raises(ArgumentError, match="refers to point"):
        Scene().add_cells(points, rows[:, 1:] + 60, heat)
    with pytest.raises(ArgumentError, match="too few"):
        Scene().add_cells(points, grid.cells[:-1], heat)
    with pytest.raises(ArgumentError, match="need kinds"):
        Scene().add_cells(points, rows[:, :8][:, :7], heat)


def test_meshes_of_vtk():
    pyvista = pytest.importorskip("pyvista")
    vertices, faces = ball()
    heights = vertices[:, 2].astype("f4")
    wanted = picture(Scene().add_mesh(vertices.astype("f4"), faces))
    by_value = picture(Scene().add_mesh(vertices.astype("f4"), faces, values=heights))
    mesh = pyvista.PolyData.from_regular_faces(vertices.astype("f4"), faces)
    for scene in (Scene().add(mesh), Scene().add_mesh(mesh)):
        assert np.array_equal(picture(scene), wanted)
    mesh["height"] = heights
    assert np.array_equal(picture(Scene().add(mesh)), by_value)
    mesh["other"] = 0 * heights
    assert np.array_equal(picture(Scene().add_mesh(mesh, scalar="height")), by_value)
    mesh["paint"] = np.clip(255 * (0.5 + 0.5 * vertices), 0, 255).astype("u1")
    painted = picture(Scene().add_mesh(vertices.astype("f4"), faces, colors=mesh["paint"]))
    assert np.array_equal(picture(Scene().add(mesh, scalar="paint")), painted)
    cloud = pyvista.PolyData(vertices.astype("f4"))
    plain_cloud = picture(Scene().add_points(vertices.astype("f4")))
    for scene in (Scene().add(cloud), Scene().add_points(cloud), Scene().add_points(mesh.copy())):
        assert scene.contents[0][0] == "points"
    assert np.array_equal(picture(Scene().add(cloud)), plain_cloud)
    # Polygons of several lengths, strips, and flat cells of a grid.
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 0.5, 0]], "f4")
    mixed = pyvista.PolyData(square, [4, 0, 1, 2, 3, 3, 1, 4, 2])
    triangles = [[0, 1, 2], [0, 2, 3], [1, 4, 2]]
    flat = picture(Scene().add_mesh(square, triangles))
    assert np.array_equal(picture(Scene().add(mixed)), flat)
    assert np.array_equal(picture(Scene().add(mixed.cast_to_unstructured_grid())), flat)
    mixed.cell_data["own"] = [1.0, 2.0]
    corners = square[np.ravel(triangles)]
    by_cell = Scene().add_mesh(
        corners, np.arange(9).reshape(3, 3), values=np.repeat([1.0, 1.0, 2.0], 3)
    )
    assert np.array_equal(picture(Scene().add(mixed)), picture(by_cell))
    strip = pyvista.PolyData(square[[0, 1, 3, 2]], strips=[4, 0, 1, 2, 3])
    turned = picture(Scene().add_mesh(square[[0, 1, 3, 2]], [[0, 1, 2], [2, 1, 3]]))
    assert np.array_equal(picture(Scene().add(strip)), turned)
    with pytest.raises(TypeError, match="needs faces"):
        Scene().add_mesh(cloud)
    with pytest.raises(ArgumentError, match="no points"):
        Scene().add(pyvista.PolyData())
    with pytest.raises(ArgumentError, match="one by one"):
        Scene().add(pyvista.MultiBlock([mesh]))


def test_data_arrays():
    xarray = pytest.importorskip("xarray")
    array = phantom("f4")
    lines = {
        name: np.arange(n) * s + o
        for name, n, s, o in zip("xyz", DIMS[::-1], SPACING, ORIGIN, strict=True)
    }
    field = xarray.DataArray(array, dims=("z", "y", "x"), coords=lines, name="own")
    wanted = plain(array, spacing=SPACING, origin=ORIGIN)
    for same in (
        field,
        field.transpose("x", "z", "y"),
        field.expand_dims(time=1),
        field.rename(x="lon", y="lat", z="level"),
        field.chunk() if _has("dask") else field,
    ):
        assert np.array_equal(drawn(same), wanted)
    # Coordinates that descend, as latitudes do.
    turned = field.isel(y=slice(None, None, -1))
    camera = Scene().add(field).camera(SIZE)
    pictures = [
        Scene().add_volume(one, transfer=TRANSFER).render(SIZE, camera).color
        for one in (field, turned)
    ]
    assert np.abs(pictures[0] - pictures[1]).max() < 1e-4
    uneven = field.assign_coords(z=np.cumsum(np.arange(1.0, DIMS[0] + 1)))
    places = [lines["x"], lines["y"], uneven.z.values]
    assert np.array_equal(drawn(uneven), plain(array, coordinates=places))
    down = uneven.isel(z=slice(None, None, -1))
    assert np.array_equal(drawn(down), drawn(uneven))
    bare = xarray.DataArray(array)
    assert np.array_equal(drawn(bare), plain(array))
    several = xarray.Dataset({"own": field, "other": 2 * field})
    assert np.array_equal(drawn(several, scalar="own"), wanted)
    with pytest.raises(ArgumentError, match="'own', 'other'"):
        drawn(several)
    with pytest.raises(ArgumentError, match="isel"):
        drawn(field.expand_dims(time=2))
    with pytest.raises(ArgumentError, match="neither ascend nor descend"):
        drawn(field.assign_coords(x=np.zeros(DIMS[2])))


def test_arrays_in_chunks():
    array = phantom()
    wanted = plain(array)
    if _has("zarr"):
        import zarr

        group = zarr.create_group({})
        group.create_array("own", data=array, chunks=(4, 4, 4))
        for one in (zarr.array(array, chunks=(4, 4, 4)), group, group["own"]):
            assert np.array_equal(drawn(one), wanted)
        group.create_array("other", data=array)
        assert np.array_equal(drawn(group, scalar="own"), wanted)
        with pytest.raises(ArgumentError, match="choose one"):
            drawn(group)
    if _has("dask"):
        import dask.array

        assert np.array_equal(drawn(dask.array.from_array(array, chunks=4)), wanted)
    if not (_has("zarr") or _has("dask")):
        pytest.skip("neither zarr nor dask is installed")


def test_trimesh():
    trimesh = pytest.importorskip("trimesh")
    vertices, faces = ball()
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    assert np.array_equal(picture(Scene().add(mesh)), picture(Scene().add_mesh(vertices, faces)))
    colors = np.clip(255 * (0.5 + 0.5 * vertices), 0, 255).astype("u1")
    painted = picture(Scene().add_mesh(vertices, faces, colors=colors))
    mesh.visual.vertex_colors = colors
    assert np.array_equal(picture(Scene().add_mesh(mesh)), painted)
    by_face = trimesh.Trimesh(vertices, faces, process=False)
    by_face.visual.face_colors = np.where(np.arange(len(faces))[:, None] % 2, [255, 0, 0, 255], 255)
    assert not np.array_equal(picture(Scene().add(by_face)), painted)
    mesh.vertex_attributes["height"] = vertices[:, 2]
    by_value = picture(Scene().add_mesh(vertices, faces, values=vertices[:, 2]))
    assert np.array_equal(picture(Scene().add(mesh, scalar="height")), by_value)
    cloud = trimesh.PointCloud(vertices, colors=colors)
    for scene in (Scene().add(cloud), Scene().add_points(cloud), Scene().add_points(mesh)):
        assert np.array_equal(picture(scene), picture(Scene().add_points(vertices, colors=colors)))
    assert np.array_equal(picture(Scene().add_mesh(cloud, faces)), painted)
    moved = trimesh.Scene()
    shift = np.eye(4)
    shift[:3, 3] = [10, 0, 0]
    moved.add_geometry(mesh, transform=shift)
    low, high = vertices.min(axis=0) + [10, 0, 0], vertices.max(axis=0) + [10, 0, 0]
    assert np.allclose(Scene().add(moved).bounds, [low, high], atol=1e-5)
    with pytest.raises(ArgumentError, match="no array 'depth'; its arrays: 'height'"):
        Scene().add(mesh, scalar="depth")


@pytest.mark.parametrize("kind", ["tensor", "legacy"])
def test_open3d(kind):
    open3d = pytest.importorskip("open3d")
    vertices, faces = ball()
    colors = np.clip(0.5 + 0.5 * vertices, 0, 1)
    utility = open3d.utility
    if kind == "legacy":
        triangles = utility.Vector3iVector(faces)
        mesh = open3d.geometry.TriangleMesh(utility.Vector3dVector(vertices), triangles)
        mesh.vertex_colors = utility.Vector3dVector(colors)
        cloud = open3d.geometry.PointCloud(utility.Vector3dVector(vertices))
        cloud.colors = utility.Vector3dVector(colors)
    else:
        mesh = open3d.t.geometry.TriangleMesh()
        mesh.vertex.positions = open3d.core.Tensor(vertices)
        mesh.triangle.indices = open3d.core.Tensor(faces)
        mesh.vertex.colors = open3d.core.Tensor(colors)
        mesh.vertex.height = open3d.core.Tensor(vertices[:, 2:])
        cloud = open3d.t.geometry.PointCloud(open3d.core.Tensor(vertices))
        cloud.point.colors = open3d.core.Tensor(colors)
    wanted = picture(Scene().add_mesh(vertices, faces, colors=colors))
    for scene in (Scene().add(mesh), Scene().add_mesh(mesh)):
        assert np.array_equal(picture(scene), wanted)
    wanted = picture(Scene().add_points(vertices, colors=colors))
    for scene in (Scene().add(cloud), Scene().add_points(cloud), Scene().add_points(mesh)):
        assert np.array_equal(picture(scene), wanted)
    if kind == "tensor":
        by_value = picture(Scene().add_mesh(vertices, faces, values=vertices[:, 2], colors=colors))
        assert np.array_equal(picture(Scene().add(mesh, scalar="height")), by_value)
    with pytest.raises(ArgumentError, match="no array 'depth'"):
        Scene().add(mesh, scalar="depth")


def test_plyfile(data):
    plyfile = pytest.importorskip("plyfile")
    for name in ("mesh", "colors", "cloud"):
        cloud = plyfile.PlyData.read(data / f"{name}.ply")
        scene, file = Scene().add(cloud), Scene().add(data / f"{name}.ply")
        assert scene.contents[0][::2] == file.contents[0][::2]
        assert np.array_equal(picture(scene), picture(file))
    by_value = picture(Scene().add_points(cloud, scalar="red"))
    assert not np.array_equal(by_value, picture(Scene().add_points(cloud)))
    with pytest.raises(ArgumentError, match="no array 'gray'; its arrays: 'x'"):
        Scene().add(cloud, scalar="gray")


def test_dictionaries():
    vertices, faces = ball()
    heights = vertices[:, 2]
    for source, scene in [
        ({"vertices": vertices, "faces": faces}, Scene().add_mesh(vertices, faces)),
        ({"positions": vertices, "values": heights}, Scene().add_points(vertices, values=heights)),
        (
            {"positions": vertices, "values": heights, "radii": 0 * heights + 0.3},
            Scene().add_samples(vertices, heights, radii=0 * heights + 0.3),
        ),
        (
            {"array": phantom(), "spacing": SPACING},
            Scene().add_volume(phantom(), spacing=SPACING),
        ),
    ]:
        assert np.array_equal(picture(Scene().add(source)), picture(scene))
    red = picture(Scene().add({"vertices": vertices, "faces": faces}, color="red"))
    assert np.array_equal(red, picture(Scene().add_mesh(vertices, faces, color="red")))
    with pytest.raises(TypeError, match="dictionary of the arguments"):
        Scene().add({"corners": vertices})


def test_points_of_laspy():
    """Points as laspy has them: scaled coordinates, and dimensions by name."""

    class Format:
        dimension_names = ("X", "Y", "Z", "intensity", "red", "green", "blue")

    class LasData:
        point_format = Format()

        def __init__(self, places, most):
            self.x, self.y, self.z = places.T
            ramp = np.linspace(0, most, len(places)).astype(np.uint16)
            self._columns = {"red": ramp, "green": ramp, "blue": ramp, "intensity": ramp}

        def __getitem__(self, name):
            return self._columns[name]

    LasData.__module__ = "laspy.lasdata"
    places = np.random.default_rng(1).random((500, 3)) * (3, 3, 0.2)
    for most, kind in ((65535, np.uint16), (255, np.uint8)):
        ramp = np.linspace(0, most, len(places)).astype(kind)
        colors = np.stack([ramp] * 3, axis=1)
        wanted = Scene().add_points(places, colors=colors, up=(0, 0, 1))
        assert np.array_equal(picture(Scene().add(LasData(places, most))), picture(wanted))
    cloud = LasData(places, 65535)
    values = cloud["intensity"].astype(float)
    wanted = Scene().add_points(places, values=values, up="+Z")
    assert np.array_equal(picture(Scene().add(cloud, scalar="intensity")), picture(wanted))
    with pytest.raises(pysplatkit.ArgumentError, match="no 'height', but X, Y"):
        Scene().add(cloud, scalar="height")


def test_unknown_objects_are_refused():
    for call in (
        lambda: Scene().add(object()),
        lambda: Scene().add(None),
        lambda: Scene().add_volume(object()),
        lambda: Scene().add_points(object()),
        lambda: pysplatkit.render(object()),
    ):
        with pytest.raises(TypeError, match=r"PyVista, VTK, nibabel.*not (object|NoneType)"):
            call()
    vertices, faces = ball()
    with pytest.raises(TypeError, match=r"^the volume: an array of numbers"):
        Scene().add_volume(object())
    with pytest.raises(TypeError, match=r"^colors: an array of numbers"):
        Scene().add_mesh(vertices, faces, colors=object())
    with pytest.raises(TypeError, match=r"^Scene\.add: a path, a dictionary"):
        Scene().add(object())
    with pytest.raises(TypeError, match="scalar names an array of an object"):
        Scene().add_volume(phantom(), scalar="own")
    with pytest.raises(TypeError, match="needs faces"):
        Scene().add_mesh(ball()[0])


def _has(package):
    try:
        __import__(package)
    except ImportError:
        return False
    return True
