"""Files that splatkit does not read itself: which package reads which, and what it makes of them.

No package is needed. Of those that read a kind of file, the first that is installed does.
"""

from __future__ import annotations

import gzip
import importlib
import importlib.util
import struct
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ._errors import InputError


class Reader(NamedTuple):
    """How a package reads some kinds of files."""

    #: The package, or an empty text for what needs none.
    package: str
    #: Extensions in lower case, without the dot.
    extensions: frozenset[str]
    #: Returns what `Scene.add` takes, and what is to be said.
    read: Callable[[Path, int | None], tuple[list[Any], list[str]]]


def _of(package: str) -> Any:
    return importlib.import_module(package)


def _only(time: int | None) -> None:
    if time:
        raise ValueError(f"has 1 time, but number {time} was asked for")


def _chosen(count: int, time: int | None) -> tuple[int, list[str]]:
    """Returns the number of the time to read, by the rule of the files that splatkit reads."""
    number = time or 0
    if not 0 <= number < count:
        raise ValueError(f"has {count} times, but number {number} was asked for")
    many = count > 1 and time is None
    words = [f"shows the first of {count} times; time=1 shows the second"] if many else []
    return number, words


_EXODUS = frozenset(("e", "exo", "ex2", "g", "gen"))


def _pyvista(path: Path, time: int | None) -> tuple[list[Any], list[str]]:
    pyvista = _of("pyvista")
    # PyVista knows these kinds of files by some of their extensions only.
    suffix = path.suffix[1:].lower()
    if suffix in ("tec", "dat"):
        reader = pyvista.TecplotReader(path)
    elif suffix in _EXODUS:
        reader = pyvista.ExodusIIReader(path)
    else:
        reader = pyvista.get_reader(path)
    words: list[str] = []
    if hasattr(reader, "number_time_points") and reader.number_time_points:
        number, words = _chosen(reader.number_time_points, time)
        reader.set_active_time_point(number)
    else:
        _only(time)
    read = reader.read()
    if not isinstance(read, pyvista.MultiBlock):
        return [read], words
    parts = [part for part in read.recursive_iterator() if part is not None and part.n_points]
    if not parts:
        raise ValueError("holds no points")
    return [parts[0] if len(parts) == 1 else pyvista.MultiBlock(parts).combine()], words


#: VTK's number of the type and the number of corners of cells, by the first letters of meshio's
#: name. Points in the middles of edges are left out.
_CELLS = {"tetra": (10, 4), "pyramid": (14, 5), "wedge": (13, 6), "hexahedron": (12, 8)}
_FACES = {"triangle": 3, "quad": 4}
#: The faces of cells by their corners.
_SIDES = {
    10: ((0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)),
    14: ((0, 3, 2, 1), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)),
    13: ((0, 1, 2), (3, 5, 4), (0, 3, 4, 1), (1, 4, 5, 2), (2, 5, 3, 0)),
    12: ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)),
}


def _meshio(path: Path, time: int | None) -> tuple[list[Any], list[str]]:
    _only(time)
    mesh = _of("meshio").read(path)
    points = np.zeros((len(mesh.points), 3))
    points[:, : mesh.points.shape[1]] = mesh.points
    solids: list[tuple[int, Any, int]] = []
    faces: list[Any] = []
    for number, block in enumerate(mesh.cells):
        name = block.type.rstrip("0123456789")
        if name in _CELLS:
            kind, corners = _CELLS[name]
            solids.append((kind, np.asarray(block.data)[:, :corners], number))
        elif name in _FACES:
            faces.append(np.asarray(block.data)[:, : _FACES[name]])
    values, of_cells = _values(mesh, [number for _, _, number in solids])
    if solids and values is not None:
        lines = [np.insert(cells, 0, cells.shape[1], axis=1).ravel() for _, cells, _ in solids]
        kinds = [np.full(len(cells), kind) for kind, cells, _ in solids]
        source = {"cells": np.concatenate(lines), "kinds": np.concatenate(kinds)}
        return [{"points": points, **source, "values": values}], []
    if solids:
        faces = _boundary([(kind, cells) for kind, cells, _ in solids])
    if not faces:
        return [points], []
    triangles = [
        polygons[:, [0, i, i + 1]] for polygons in faces for i in range(1, polygons.shape[1] - 1)
    ]
    surface = {"vertices": points, "faces": np.concatenate(triangles)}
    if values is not None and not of_cells:
        surface["values"] = values
    return [surface], []


def _values(mesh: Any, blocks: list[int]) -> tuple[Any, bool]:
    """Returns the first values of points, else of these blocks of cells, and whether it is those.

    Values that are all the same are left out: many formats number the parts of a mesh.
    """
    of_points = [(_length(data), False) for data in mesh.point_data.values()]
    of_cells = [
        (_length(np.concatenate([data[block] for block in blocks])), True)
        for data in mesh.cell_data.values()
        if blocks
    ]
    for values, are_of_cells in of_points + of_cells:
        if np.ptp(values) > 0:
            return values, are_of_cells
    return None, False


def _length(data: Any) -> Any:
    values = np.asarray(data, float)
    return values if values.ndim == 1 else np.linalg.norm(values.reshape(len(values), -1), axis=1)


def _boundary(solids: list[tuple[int, Any]]) -> list[Any]:
    """Returns the faces that only one cell has."""
    faces = []
    for size in (3, 4):
        sides = [
            cells[:, side] for kind, cells in solids for side in _SIDES[kind] if len(side) == size
        ]
        if sides:
            every = np.concatenate(sides)
            _, first, count = np.unique(
                np.sort(every, axis=1), axis=0, return_index=True, return_counts=True
            )
            faces.append(every[first[count == 1]])
    return faces


def _trimesh(path: Path, time: int | None) -> tuple[list[Any], list[str]]:
    _only(time)
    return [_of("trimesh").load(path)], []


def _nibabel(path: Path, time: int | None) -> tuple[list[Any], list[str]]:
    nibabel = _of("nibabel")
    with path.open("rb") as file:
        is_geometry = file.read(3) == b"\xff\xff\xfe"
    if is_geometry:
        _only(time)
        # A surface of FreeSurfer has a name without an extension (lh.pial).
        vertices, faces = _of("nibabel.freesurfer").read_geometry(path)
        return [{"vertices": vertices, "faces": faces}], []
    image = nibabel.load(path)
    if hasattr(image, "darrays"):
        _only(time)
        vertices = image.agg_data("NIFTI_INTENT_POINTSET")
        faces = image.agg_data("NIFTI_INTENT_TRIANGLE")
        if len(np.shape(vertices)) != 2:
            raise ValueError("holds values for a surface, but no surface")
        return [{"vertices": vertices, "faces": faces}], []
    words: list[str] = []
    if len(image.shape) == 4:
        number, words = _chosen(image.shape[3], time)
        image = image.slicer[..., number]
    else:
        _only(time)
    # Of another class, whose affine is that of NIfTI.
    data = np.asanyarray(image.dataobj)
    if data.dtype.kind == "f":
        data = data.astype("f4")
    return [nibabel.Nifti1Image(data.astype(data.dtype.newbyteorder("=")), image.affine)], words


def _xarray(path: Path, time: int | None) -> tuple[list[Any], list[str]]:
    data = _of("xarray").open_dataset(path, engine="scipy")
    array = max(data.data_vars.values(), key=lambda values: (values.ndim >= 3, values.size))
    words: list[str] = []
    if array.ndim == 4:
        number, words = _chosen(array.shape[0], time)
        array = array[number]
    else:
        _only(time)
    return [array.load()], words


def _mz3(path: Path, time: int | None) -> tuple[list[Any], list[str]]:
    """Reads a surface of Surfice."""
    _only(time)
    data = path.read_bytes()
    data = gzip.decompress(data) if data[:2] == b"\x1f\x8b" else data
    mark, has, faces, vertices, skip = struct.unpack_from("<2sHIII", data)
    if mark != b"MZ" or has & 3 != 3:
        raise ValueError("is no surface in the format mz3")
    at = 16 + skip
    triangles = np.frombuffer(data, "<i4", 3 * faces, at).reshape(-1, 3)
    at += 12 * faces
    places = np.frombuffer(data, "<f4", 3 * vertices, at).reshape(-1, 3)
    at += 12 * vertices
    surface = {"vertices": places, "faces": triangles}
    if has & 4:
        surface["colors"] = np.frombuffer(data, "u1", 4 * vertices, at).reshape(-1, 4)
    elif has & 8:
        surface["values"] = np.frombuffer(data, "<f4", vertices, at)
    return [surface], []


#: Colours and radii (van der Waals, in ångström) of the usual elements. Others are pink.
_ELEMENTS = {
    "H": ("ffffff", 1.1), "C": ("909090", 1.7), "N": ("3050f8", 1.55), "O": ("ff0d0d", 1.52),
    "F": ("90e050", 1.47), "NA": ("ab5cf2", 2.27), "MG": ("8aff00", 1.73), "P": ("ff8000", 1.8),
    "S": ("ffff30", 1.8), "CL": ("1ff01f", 1.75), "K": ("8f40d4", 2.75), "CA": ("3dff00", 2.31),
    "FE": ("e06633", 2.04), "ZN": ("7d80b0", 2.01), "BR": ("a62929", 1.85), "I": ("940094", 1.98),
}  # fmt: skip


def _molecule(path: Path, time: int | None) -> tuple[list[Any], list[str]]:
    """Reads the atoms of a molecule, each as a ball."""
    lines = path.read_text(errors="replace").splitlines()
    models: list[list[tuple[str, list[float]]]] = [[]]
    if path.suffix.lower() == ".xyz":
        models = []
        while lines and lines[0].strip():
            count = int(lines[0])
            rows = [line.split() for line in lines[2 : 2 + count]]
            models.append([(row[0], [float(part) for part in row[1:4]]) for row in rows])
            lines = lines[2 + count :]
    else:
        for line in lines:
            if line.startswith(("ATOM  ", "HETATM")):
                name = line[76:78].strip() or line[12:14].strip(" 0123456789")
                models[-1].append((name, [float(line[i : i + 8]) for i in (30, 38, 46)]))
            elif line.startswith("ENDMDL"):
                models.append([])
    models = [model for model in models if model]
    if not models:
        raise ValueError("holds no atoms")
    number, words = _chosen(len(models), time)
    return [_balls(models[number])], words


def _balls(atoms: list[tuple[str, list[float]]]) -> Mapping[str, Any]:
    """Returns a mesh of balls: octahedra whose faces are divided."""
    corners = np.vstack([np.eye(3), -np.eye(3)])
    faces = np.array([[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2]])
    faces = np.vstack([faces, np.array([[1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]])])
    for _ in range(3 if len(atoms) <= 2000 else 2):
        a, b, c = (corners[faces[:, i]] for i in range(3))
        ab, bc, ca = a + b, b + c, c + a
        thirds = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        corners = np.vstack([np.stack(third, 1).reshape(-1, 3) for third in thirds])
        corners /= np.linalg.norm(corners, axis=1, keepdims=True)
        faces = np.arange(len(corners)).reshape(-1, 3)
    styles = [_ELEMENTS.get(name.upper(), ("ff1493", 1.7)) for name, _ in atoms]
    radii = np.array([radius for _, radius in styles])
    tones = np.array([list(bytes.fromhex(color)) for color, _ in styles], "u1")
    places = np.array([place for _, place in atoms])
    vertices = places[:, None] + radii[:, None, None] * corners
    shifts = len(corners) * np.arange(len(atoms))
    return {
        "vertices": vertices.reshape(-1, 3),
        "faces": (faces + shifts[:, None, None]).reshape(-1, 3),
        "normals": np.tile(corners, (len(atoms), 1)),
        "colors": np.repeat(tones, len(corners), axis=0),
    }


def _set(extensions: str) -> frozenset[str]:
    return frozenset(extensions.split())


#: What reads which files, the best first.
READERS = (
    Reader("", _set("pdb ent xyz"), _molecule),
    Reader("", _set("mz3"), _mz3),
    Reader("pyvista", _EXODUS | _set("case encas foam cgns xdmf xmf slc tec dat"), _pyvista),
    Reader(
        "meshio", _EXODUS | _set("cgns xdmf xmf msh med inp avs bdf fem nas su2 f3grid"), _meshio
    ),
    Reader("meshio", _set("mesh meshb vol mdpa dat tec"), _meshio),
    Reader("nibabel", _set("mgh mgz mnc gii pial white inflated orig sphere smoothwm"), _nibabel),
    Reader("xarray", _set("nc cdf nc3"), _xarray),
    Reader("trimesh", _set("3mf dae zae xaml step stp"), _trimesh),
)


#: The first bytes of some kinds of files, and an extension that such files have.
_MARKS = (
    (b"\xff\xff\xfe", "pial"),
    (b"CDF", "nc"),
    (b"$MeshFormat", "msh"),
    (b"MeshVersionFormatted", "mesh"),
    (b"FORMAT\ntype:", "case"),
    (b"TITLE", "tec"),
    (b"VARIABLES", "tec"),
)


def suited(path: Path) -> list[Reader]:
    """Returns the readers of a file, by its extension or its first bytes."""
    extension = path.suffix[1:].lower()
    if not any(extension in reader.extensions for reader in READERS) and path.is_file():
        with path.open("rb") as file:
            first = file.read(64)
        extension = next((name for mark, name in _MARKS if first.startswith(mark)), extension)
    return [reader for reader in READERS if extension in reader.extensions]


def read(path: Path, time: int | None) -> tuple[str, list[Any], list[str]]:
    """Reads a file by the first package that is installed and can.

    Returns what read it, what `Scene.add` takes, and what is to be said.
    """
    readers = suited(path)
    failed: list[str] = []
    for reader in readers:
        if reader.package and importlib.util.find_spec(reader.package) is None:
            continue
        try:
            objects, words = reader.read(path, time)
        except (Exception, SystemExit) as error:  # noqa: BLE001
            # Packages raise whatever they like, and meshio ends the process.
            name = reader.package or "splatkit"
            failed.append(f"{name}: {str(error) or type(error).__name__}")
            continue
        return reader.package or "splatkit", objects, words
    names = _names(reader.package for reader in readers if reader.package)
    if failed:
        raise InputError(path, "file", "cannot be read: " + "; ".join(failed))
    first = next((reader.package for reader in readers if reader.package), "")
    hint = f"pip install {first}"
    raise InputError(path, "file", f"is read by {names}, which is not installed", hint)


def _names(packages: Iterable[str]) -> str:
    return " or ".join(dict.fromkeys(packages))
