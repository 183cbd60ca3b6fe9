"""Data sets of VTK, and of PyVista, whose classes are VTK's with more methods."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np

from .._errors import ArgumentError
from .parts import Array, Cells, Parts, Surface, Volume, fans, of_coordinates

#: The numbers of VTK's cells that fill space and have a list of nodes.
_SOLID = (10, 11, 12, 13, 14, 15, 16, 24, 25, 26, 27, 29, 31, 32, 33, 37, 71, 72, 73, 78, 79, 80)
_POLYHEDRON = 42
#: The corners of VTK's flat cells.
_FLAT = {5: 3, 22: 3, 34: 3, 8: 4, 9: 4, 23: 4, 28: 4, 30: 4}
_POLYGON, _PIXEL = 7, 8


def parts(source: Any, scalar: str | None) -> Parts | None:
    """Returns the parts of a data set."""
    if not hasattr(source, "IsA"):
        return None
    if source.IsA("vtkImageData"):
        return _image(source, scalar)
    if source.IsA("vtkRectilinearGrid"):
        return _rectilinear(source, scalar)
    if source.IsA("vtkStructuredGrid"):
        return _structured(source, scalar)
    if source.IsA("vtkUnstructuredGrid"):
        return _unstructured(source, scalar)
    if source.IsA("vtkPolyData"):
        return _polygons(source, scalar)
    if source.IsA("vtkCompositeDataSet"):
        raise ArgumentError("add the blocks of a composite data set one by one")
    return None


def points(source: Any, scalar: str | None) -> Surface | None:
    """Returns the points of any data set that has a list of them, as a cloud."""
    if not (hasattr(source, "IsA") and source.IsA("vtkPointSet")):
        return None
    values, of_cells = _values(source, scalar, is_needed=False)
    if of_cells:
        if scalar is not None:
            raise ArgumentError(f"the array {scalar!r} is one of cells, not of points")
        values = None
    colors, values = _colors(values)
    return Surface(_positions(source), None, _normals(source), colors, _scalars(values))


def _image(source: Any, scalar: str | None) -> Volume:
    values, of_cells = _values(source, scalar)
    dims = np.array(source.GetDimensions())
    matrix = source.GetDirectionMatrix()
    direction = np.array(
        [[matrix.GetElement(row, column) for column in range(3)] for row in range(3)]
    )
    spacing = np.array(source.GetSpacing())
    origin = np.array(source.GetPoint(0))
    if of_cells:
        origin = origin + direction @ (np.where(dims > 1, 0.5, 0.0) * spacing)
        dims = np.maximum(dims - 1, 1)
    samples = _scalars(values).reshape(dims[::-1])
    return Volume(samples, spacing.tolist(), origin.tolist(), direction)


def _rectilinear(source: Any, scalar: str | None) -> Volume:
    values, of_cells = _values(source, scalar)
    lines = [
        _array(line).ravel()
        for line in (source.GetXCoordinates(), source.GetYCoordinates(), source.GetZCoordinates())
    ]
    if of_cells:
        lines = [line if len(line) == 1 else 0.5 * (line[1:] + line[:-1]) for line in lines]
    samples = _scalars(values).reshape([len(line) for line in reversed(lines)])
    return of_coordinates(samples, lines)


def _structured(source: Any, scalar: str | None) -> Parts:
    ends = np.reshape(source.GetExtent(), (3, 2))
    dims = ends[:, 1] - ends[:, 0] + 1
    if dims.min() <= 0:
        raise ArgumentError("the grid is empty")
    at = np.arange(np.prod(dims)).reshape(dims[::-1])
    wide = [axis for axis, count in enumerate(dims[::-1]) if count > 1]
    if len(wide) < 2:
        cloud = points(source, scalar)
        assert cloud is not None
        return cloud
    if len(wide) == 2:
        at = at.squeeze()
        corners = [at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]]
        quads = np.stack([corner.ravel() for corner in corners], axis=1)
        return _surface(source, scalar, quads, np.arange(len(quads)))
    flat = [at[:, :-1, :-1], at[:, :-1, 1:], at[:, 1:, 1:], at[:, 1:, :-1]]
    corners = [*(layer[:-1] for layer in flat), *(layer[1:] for layer in flat)]
    nodes = np.stack([corner.ravel() for corner in corners], axis=1)
    values, of_cells = _values(source, scalar)
    kinds = np.full(len(nodes), 12, np.uint8)
    offsets = np.arange(len(nodes) + 1) * 8
    return Cells(_positions(source), kinds, offsets, nodes.ravel(), _scalars(values), of_cells)


def _unstructured(source: Any, scalar: str | None) -> Parts:
    offsets, nodes = _lists(source.GetCells())
    kinds = _kinds(source)
    if (kinds == _POLYHEDRON).any():
        raise ArgumentError(
            "polyhedra are read from files only: save the grid as .vtu and add that"
        )
    is_solid = np.isin(kinds, _SOLID)
    if not is_solid.any():
        return _flat(source, scalar, kinds, offsets, nodes)
    has_arrays = any(
        data.GetNumberOfArrays() for data in (source.GetPointData(), source.GetCellData())
    )
    values, of_cells = _values(source, scalar) if has_arrays or scalar else (None, False)
    numbers = None if values is None else _scalars(values)
    # Solids, and the surfaces beside them.
    is_kept = is_solid | np.isin(kinds, (5, _POLYGON, _PIXEL, 9))
    if not is_kept.all():
        counts = np.diff(offsets)
        nodes = nodes[np.repeat(is_kept, counts)]
        offsets = np.concatenate([[0], np.cumsum(counts[is_kept])])
        kinds = kinds[is_kept]
        numbers = numbers[is_kept] if of_cells and numbers is not None else numbers
    return Cells(_positions(source), kinds, offsets, nodes, numbers, of_cells)


def _kinds(source: Any) -> Array:
    try:
        types = source.GetCellTypes()
    except TypeError:
        # Before VTK 9.6 that was another method.
        types = source.GetCellTypesArray()
    return _array(types).ravel().astype(np.uint8)


def _flat(source: Any, scalar: str | None, kinds: Array, offsets: Array, nodes: Array) -> Surface:
    """Returns the flat cells of a grid as a mesh, or its points."""
    counts = np.array([_FLAT.get(int(kind), 0) for kind in range(256)])[kinds]
    lengths = np.diff(offsets)
    counts = np.where(kinds == _POLYGON, lengths, counts)
    if not counts.any():
        cloud = points(source, scalar)
        assert cloud is not None
        return cloud
    nodes = nodes.copy()
    pixels = offsets[:-1][kinds == _PIXEL]
    nodes[pixels + 2], nodes[pixels + 3] = nodes[pixels + 3], nodes[pixels + 2]
    ordinal = np.arange(len(nodes)) - np.repeat(offsets[:-1], lengths)
    corners = nodes[ordinal < np.repeat(counts, lengths)]
    triangles, owners = fans(np.concatenate([[0], np.cumsum(counts)]), corners)
    return _surface(source, scalar, triangles, owners)


def _polygons(source: Any, scalar: str | None) -> Surface:
    offsets, nodes = _lists(source.GetPolys())
    triangles, owners = fans(offsets, nodes)
    # Values of cells are in the order points, lines, polygons, strips.
    before = source.GetNumberOfVerts() + source.GetNumberOfLines()
    strip_cells = source.GetStrips()
    if strip_cells.GetNumberOfCells():
        starts, more = _lists(strip_cells)
        strips = [_strip(more[a:b]) for a, b in pairwise(starts)]
        numbers = np.repeat(np.arange(len(strips)), [len(strip) for strip in strips])
        triangles = np.concatenate([triangles, *strips])
        owners = np.concatenate([owners, source.GetNumberOfPolys() + numbers])
    if not len(triangles):
        cloud = points(source, scalar)
        assert cloud is not None
        return cloud
    return _surface(source, scalar, triangles, before + owners)


def _lists(cells: Any) -> tuple[Array, Array]:
    """Returns where the nodes of each cell of an array of cells begin and end, and all nodes."""
    count, width = cells.GetNumberOfCells(), cells.IsHomogeneous()
    nodes = _array(cells.GetConnectivityArray()).ravel().astype(np.int64)
    if count and width > 0:
        # VTK may keep no list of offsets then.
        return np.arange(count + 1) * width, nodes
    return _array(cells.GetOffsetsArray()).ravel().astype(np.int64), nodes


def _strip(nodes: Array) -> Array:
    """Returns the triangles of a strip, of which every other one is turned around."""
    rows = np.stack([nodes[:-2], nodes[1:-1], nodes[2:]], axis=1)
    rows[1::2] = rows[1::2, [1, 0, 2]]
    return rows


def _surface(source: Any, scalar: str | None, faces: Array, owners: Array) -> Surface:
    """Returns a mesh. `owners` are the cells of the faces."""
    values, of_cells = _values(source, scalar, is_needed=False)
    surface = Surface(_positions(source), faces, _normals(source))
    colors, values = _colors(values)
    numbers = None if values is None else _scalars(values)
    if of_cells:
        return surface.by_face(
            None if colors is None else colors[owners], None if numbers is None else numbers[owners]
        )
    surface.colors, surface.values = colors, numbers
    return surface


def _positions(source: Any) -> Array:
    points = source.GetPoints()
    if points is None or points.GetNumberOfPoints() == 0:
        raise ArgumentError("the data set has no points")
    return _array(points.GetData())


def _normals(source: Any) -> Array | None:
    normals = source.GetPointData().GetNormals()
    return None if normals is None else _array(normals)


def _values(source: Any, scalar: str | None, is_needed: bool = True) -> tuple[Any, bool]:
    """Returns an array of a data set, and whether it is one of cells: the named one, or the active
    one, or where values are needed the first."""
    data = [source.GetPointData(), source.GetCellData()]
    if scalar is None:
        for of_cells, attributes in enumerate(data):
            if attributes.GetScalars() is not None:
                return _array(attributes.GetScalars()), bool(of_cells)
        if not is_needed:
            return None, False
        for of_cells, attributes in enumerate(data):
            if attributes.GetNumberOfArrays() and attributes.GetArray(0) is not None:
                return _array(attributes.GetArray(0)), bool(of_cells)
        raise ArgumentError("the data set has no arrays of points or cells")
    # As for files, “velocity:0” is the first component.
    name, _, part = scalar.rpartition(":")
    for of_cells, attributes in enumerate(data):
        if attributes.GetArray(scalar) is not None:
            return _array(attributes.GetArray(scalar)), bool(of_cells)
        if part.isdigit() and attributes.GetArray(name) is not None:
            values = _array(attributes.GetArray(name))
            if values.ndim == 2 and int(part) < values.shape[1]:
                return values[:, int(part)], bool(of_cells)
    names = [
        attributes.GetArrayName(at)
        for attributes in data
        for at in range(attributes.GetNumberOfArrays())
    ]
    listed = ", ".join(map(repr, names)) or "none"
    raise ArgumentError(f"the data set has no array {scalar!r}; its arrays: {listed}")


def _colors(values: Any) -> tuple[Array | None, Any]:
    """Returns an array as colours if it is one of bytes for red, green and blue; else as values."""
    if values is None or values.dtype != np.uint8 or values.shape[1:] not in ((3,), (4,)):
        return None, values
    return values, None


def _scalars(values: Any) -> Any:
    """Returns one number for each element: of vectors their length."""
    if values is None or values.ndim == 1:
        return values
    if values.shape[1] == 1:
        return values[:, 0]
    return np.linalg.norm(values.astype(np.float64), axis=1)


def _array(array: Any) -> Array:
    """Returns the numbers of an array of VTK, where they are if they have memory."""
    try:
        return np.asarray(memoryview(array))
    except (TypeError, ValueError, BufferError):
        count, width = array.GetNumberOfTuples(), array.GetNumberOfComponents()
        rows = np.array([array.GetTuple(row) for row in range(count)]).reshape(count, width)
        return rows[:, 0] if width == 1 else rows
