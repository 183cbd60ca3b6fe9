"""Images of nibabel, ITK, SimpleITK, xarray and zarr."""

from __future__ import annotations

import sys
from typing import Any

import numpy as np

from .._errors import ArgumentError
from .parts import Volume, chosen, held, of_affine, of_coordinates

#: Names of dimensions in the order of the world's axes.
_NAMES = (
    ("x", "lon", "longitude", "easting", "col", "column", "columns"),
    ("y", "lat", "latitude", "northing", "row", "rows"),
    ("z", "lev", "level", "depth", "height", "altitude", "elevation", "plane", "slice", "slices"),
)


def of_nibabel(source: Any, scalar: str | None) -> Volume | None:
    """Returns the volume of an image, indexed [i, j, k], whose affine leads to right, front, up."""
    if not (hasattr(source, "dataobj") and hasattr(source, "affine")):
        return None
    _no_name(scalar, "an image of nibabel")
    # With the scaling that the file states.
    samples = np.asarray(source.dataobj)
    while samples.ndim > 3 and samples.shape[-1] == 1:
        samples = samples[..., 0]
    if samples.ndim != 3:
        raise ArgumentError(
            f"the image has the shape {samples.shape}; choose a volume, such as "
            "image.slicer[..., 0]"
        )
    affine = np.eye(4) if source.affine is None else source.affine
    unit = ""
    if hasattr(source.header, "get_xyzt_units"):
        unit = {"mm": "mm", "micron": "µm", "meter": "m"}.get(source.header.get_xyzt_units()[0], "")
    return of_affine(samples.T, affine, unit=unit, frame="ras")


def of_itk(source: Any, scalar: str | None) -> Volume | None:
    """Returns the volume of an image of ITK."""
    if not (hasattr(source, "GetBufferedRegion") and hasattr(source, "GetDirection")):
        return None
    _no_name(scalar, "an image of ITK")
    if source.GetImageDimension() != 3:
        return _flat(source.GetImageDimension())
    matrix = source.GetDirection().GetVnlMatrix()
    direction = np.array([[matrix.get(row, column) for column in range(3)] for row in range(3)])
    first = source.GetBufferedRegion().GetIndex()
    origin = source.TransformIndexToPhysicalPoint(first)
    return Volume(
        held(np.asarray(source), source),
        [float(length) for length in source.GetSpacing()],
        [float(place) for place in origin],
        direction,
        frame="lps",
    )


def of_simple_itk(source: Any, scalar: str | None) -> Volume | None:
    """Returns the volume of an image of SimpleITK."""
    if not (hasattr(source, "GetPixelID") and hasattr(source, "GetDirection")):
        return None
    _no_name(scalar, "an image of SimpleITK")
    if source.GetDimension() != 3:
        return _flat(source.GetDimension())
    # The module is there, because it has made the image.
    samples = sys.modules["SimpleITK"].GetArrayViewFromImage(source)
    direction = np.reshape(source.GetDirection(), (3, 3))
    kept = held(samples, source)
    return Volume(kept, source.GetSpacing(), source.GetOrigin(), direction, frame="lps")


def of_xarray(source: Any, scalar: str | None) -> Volume | None:
    """Returns the volume of a data array. Names of dimensions say which axis is x, y or z; others
    take the axes that are left, in the order z, y, x."""
    if hasattr(source, "data_vars"):
        deep = {
            name: array for name, array in source.data_vars.items() if array.squeeze().ndim == 3
        }
        if scalar is None and len(deep) != 1:
            listed = ", ".join(map(repr, deep)) or "none"
            raise ArgumentError(f"choose one of the data set's volumes as scalar: {listed}")
        source = source[next(iter(deep))] if scalar is None else chosen(deep, scalar, "it")
    elif hasattr(source, "dims") and hasattr(source, "coords"):
        _no_name(scalar, "a data array")
    else:
        return None
    if source.ndim > 3:
        source = source.squeeze()
    if source.ndim != 3:
        raise ArgumentError(
            f"the data array has the dimensions {dict(source.sizes)}; choose three, such as "
            f"array.isel({source.dims[0]}=0)"
        )
    names = _world(source)
    samples = np.asarray(source.transpose(*reversed(names)))
    places = [_line(source, name) for name in names]
    units = {
        str(source.coords[name].attrs.get("units", "")) for name in names if name in source.coords
    }
    return of_coordinates(
        samples,
        places,
        value_name=str(source.attrs.get("long_name", source.name or "")),
        value_unit=str(source.attrs.get("units", "")),
        unit=units.pop() if len(units) == 1 else "",
    )


def of_zarr(source: Any, scalar: str | None) -> Volume | None:
    """Returns the volume of an array, or of an array of a group."""
    if hasattr(source, "group_keys") or hasattr(source, "arrays"):
        arrays = dict(source.arrays())
        if scalar is None and len(arrays) != 1:
            names = ", ".join(map(repr, arrays)) or "none"
            raise ArgumentError(f"choose one of the group's arrays as scalar: {names}")
        source = next(iter(arrays.values())) if scalar is None else chosen(arrays, scalar, "it")
        return Volume(source[...])
    # Arrays are arrays of numbers, also those of points.
    _no_name(scalar, "an array of zarr")
    return None


def _world(source: Any) -> list[Any]:
    """Returns the dimensions along x, y and z of a data array."""

    def axis_of(name: Any) -> int | None:
        letter = source.coords[name].attrs.get("axis") if name in source.coords else None
        if letter in ("X", "Y", "Z"):
            return "XYZ".index(letter)
        low = str(name).lower()
        return next((axis for axis, names in enumerate(_NAMES) if low in names), None)

    known: dict[int, Any] = {}
    rest = []
    for name in source.dims:
        axis = axis_of(name)
        if axis is None or axis in known:
            rest.append(name)
        else:
            known[axis] = name
    for axis in (2, 1, 0):
        if axis not in known:
            known[axis] = rest.pop(0)
    return [known[axis] for axis in range(3)]


def _line(source: Any, name: Any) -> Any:
    """Returns where samples are along a dimension. Without numbers they are one unit apart."""
    count = source.sizes[name]
    if name in source.coords and source.coords[name].dtype.kind in "iuf":
        return np.asarray(source.coords[name], float)
    return np.arange(count, dtype=float)


def _no_name(scalar: str | None, what: str) -> None:
    if scalar is not None:
        raise ArgumentError(f"{what} has one array without a name, not {scalar!r}")


def _flat(dimension: int) -> Volume:
    raise ArgumentError(f"a volume has three axes, but the image has {dimension}")
