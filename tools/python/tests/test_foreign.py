"""Files of other formats are drawn through the packages that read them."""

from __future__ import annotations

import gzip
import struct
import subprocess
import sys

import numpy as np
import pytest
from conftest import blob

from pysplatkit import InputError, Scene, _foreign
from pysplatkit.__main__ import main

SIZE = "64x48"

#: A cube of two by two by two cells, with what its points are worth.
PLACES = np.stack(np.meshgrid(*[np.arange(3.0)] * 3, indexing="ij"), -1).reshape(-1, 3)
CORNERS = np.array([0, 9, 12, 3, 1, 10, 13, 4])
FIRST = np.array([9 * x + 3 * y + z for x in (0, 1) for y in (0, 1) for z in (0, 1)])
CELLS = FIRST[:, None] + CORNERS
VALUES = PLACES.sum(axis=1)


def drawn(path, capsys, *options):
    """Draws a file, and returns what was said."""
    out = path.with_name("out.png")
    assert main(["render", str(path), "-o", str(out), "--size", SIZE, *options]) == 0
    assert out.stat().st_size > 500
    return capsys.readouterr().err


def ball():
    """Returns the vertices and faces of an octahedron."""
    vertices = np.vstack([np.eye(3), -np.eye(3)]).astype("f4")
    faces = [[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]]
    return vertices, np.array(faces, "i4")


def test_files_that_splatkit_reads(tmp_path, capsys):
    path = tmp_path / "a.npy"
    np.save(path, blob((8, 9, 10)))
    assert "read by" not in drawn(path, capsys, "--view", "top", "--colormap", "turbo")


def test_the_module_is_a_command(tmp_path):
    path = tmp_path / "a.npy"
    np.save(path, blob((8, 9, 10)))
    out = tmp_path / "a.png"
    arguments = ["render", str(path), "-o", str(out), "--size", SIZE]
    subprocess.run([sys.executable, "-m", "pysplatkit", *arguments], check=True)
    assert out.exists()


@pytest.mark.parametrize("extension", ["xyz", "pdb"])
def test_molecules(tmp_path, capsys, extension):
    path = tmp_path / f"water.{extension}"
    atoms = [("O", 0.0, 0.0, 0.12), ("H", 0.0, 0.76, -0.47), ("H", 0.0, -0.76, -0.47)]
    if extension == "xyz":
        lines = "".join("{} {} {} {}\n".format(*atom) for atom in atoms)
        path.write_text(f"3\nwater\n{lines}" * 2)
    else:
        form = (
            "HETATM    1  {:<3s} HOH A   1    {:8.3f}{:8.3f}{:8.3f}  1.00  0.00          {:>2s}\n"
        )
        path.write_text("".join(form.format(*atom, atom[0]) for atom in atoms) + "END\n")
    said = drawn(path, capsys)
    assert ("shows the first of 2 times" in said) == (extension == "xyz")
    _, (balls,), _ = _foreign.read(path, None)
    radii = np.linalg.norm(balls["vertices"][: len(balls["vertices"]) // 3] - [0, 0, 0.12], axis=1)
    assert np.allclose(radii, 1.52)
    assert balls["colors"][0].tolist() == [255, 13, 13]


def test_surfaces_of_surfice(tmp_path, capsys):
    vertices, faces = ball()
    head = struct.pack("<2sHIII", b"MZ", 3, len(faces), len(vertices), 0)
    path = tmp_path / "a.mz3"
    path.write_bytes(gzip.compress(head + faces.tobytes() + vertices.tobytes()))
    drawn(path, capsys)


@pytest.mark.parametrize("extension", ["msh", "inp", "bdf", "med", "mesh", "su2", "avs", "xdmf"])
def test_meshes_of_solvers(tmp_path, capsys, extension):
    meshio = pytest.importorskip("meshio")
    if extension in ("med", "xdmf"):
        pytest.importorskip("h5py")
    path = tmp_path / f"a.{extension}"
    meshio.Mesh(PLACES, [("hexahedron", CELLS)], point_data={"T": VALUES}).write(path)
    capsys.readouterr()
    assert "read by" in drawn(path, capsys)


def test_the_boundary_of_cells_without_values():
    quads = np.concatenate(_foreign._boundary([(12, CELLS)]))
    # Each side of the cube has four.
    assert len(quads) == 24
    centre = PLACES[quads].mean(axis=1)
    assert (np.isclose(centre, 0) | np.isclose(centre, 2)).any(axis=1).all()


def test_exodus(tmp_path, capsys):
    meshio = pytest.importorskip("meshio")
    pytest.importorskip("netCDF4")
    path = tmp_path / "a.e"
    meshio.Mesh(PLACES, [("hexahedron", CELLS)], point_data={"T": VALUES}).write(path)
    capsys.readouterr()
    assert "read by" in drawn(path, capsys)


def test_scans_of_freesurfer(tmp_path, capsys):
    nibabel = pytest.importorskip("nibabel")
    path = tmp_path / "a.mgz"
    volume = blob((8, 9, 10)).astype("f4")
    several = np.stack([volume.T, 2 * volume.T], -1)
    nibabel.save(nibabel.MGHImage(several, np.diag([1, 1, 2, 1])), path)
    assert "shows the first of 2 times" in drawn(path, capsys)
    assert "first of" not in drawn(path, capsys, "--time", "1")
    _, (image,), _ = _foreign.read(path, 1)
    assert np.allclose(image.get_fdata().max(), 2 * volume.max())
    assert main(["render", str(path), "-o", str(tmp_path / "b.png"), "--time", "2"]) == 3
    assert "has 2 times, but number 2" in capsys.readouterr().err


def test_surfaces_of_freesurfer_and_gifti(tmp_path, capsys):
    nibabel = pytest.importorskip("nibabel")
    vertices, faces = ball()
    path = tmp_path / "lh.pial"
    nibabel.freesurfer.write_geometry(path, vertices, faces)
    drawn(path, capsys)
    arrays = [
        nibabel.gifti.GiftiDataArray(vertices, "NIFTI_INTENT_POINTSET"),
        nibabel.gifti.GiftiDataArray(faces, "NIFTI_INTENT_TRIANGLE"),
    ]
    path = tmp_path / "a.surf.gii"
    nibabel.save(nibabel.gifti.GiftiImage(darrays=arrays), path)
    drawn(path, capsys)


def test_netcdf_of_version_3(tmp_path, capsys):
    xarray = pytest.importorskip("xarray")
    pytest.importorskip("scipy")
    path = tmp_path / "a.nc"
    data = np.stack([blob((8, 9, 10)), 2 * blob((8, 9, 10))]).astype("f4")
    array = xarray.DataArray(data, dims=("time", "z", "y", "x"), name="T")
    array.to_netcdf(path, engine="scipy", format="NETCDF3_64BIT")
    assert "shows the first of 2 times" in drawn(path, capsys)


@pytest.mark.parametrize("extension", ["dat", "slc"])
def test_grids_of_vtk(tmp_path, capsys, extension):
    pytest.importorskip("pyvista")
    path = tmp_path / f"a.{extension}"
    if extension == "dat":
        rows = "".join("{} {} {} {}\n".format(*p, sum(p)) for p in PLACES[:, ::-1])
        path.write_text(
            f'TITLE="a"\nVARIABLES="X" "Y" "Z" "T"\nZONE I=3, J=3, K=3, F=POINT\n{rows}'
        )
    else:
        slices = b"".join(b"100 X " + bytes(50) + bytes([200]) * 50 for _ in range(10))
        head = b"11111\n10 10 10 8\n1.0 1.0 1.0\n1 1 0 0\n1 1 X \0"
        path.write_bytes(head + slices)
    assert "read by pyvista" in drawn(path, capsys)


def test_scenes_of_collada(tmp_path, capsys):
    trimesh = pytest.importorskip("trimesh")
    pytest.importorskip("collada")
    path = tmp_path / "a.dae"
    trimesh.creation.icosphere().export(path)
    drawn(path, capsys)


def test_a_package_that_is_missing_is_named(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(_foreign.importlib.util, "find_spec", lambda _: None)
    path = tmp_path / "a.e"
    path.write_bytes(b"CDF\x01")
    assert main(["render", str(path), "-o", str(tmp_path / "a.png")]) == 3
    said = capsys.readouterr().err
    assert "is read by pyvista or meshio, which is not installed (pip install pyvista)" in said


def test_the_command_names_what_is_read_here(tmp_path):
    """The table of the library has the same files as the one here."""
    # These are formats that splatkit reads too, or extensions that others have as well.
    others = {"xyz", "dat", "vol", "post", "xaml", "orig"}
    for reader in _foreign.READERS:
        for extension in reader.extensions - others:
            path = tmp_path / f"a.{extension}"
            path.write_bytes(b"?")
            with pytest.raises(InputError) as error:
                Scene().add(path)
            assert f"python -m pysplatkit render {path}" in error.value.hint, extension
            assert reader.package in error.value.hint
