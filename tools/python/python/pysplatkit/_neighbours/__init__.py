"""Objects of other packages, by what they look like: none of the packages is imported here.

Each module knows a family of packages. It has the names of their modules, and a function that
returns the parts of an object, or None if the object is of another kind.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from .._errors import KindError
from . import images, meshes, vtk
from .parts import Cells, Parts, Surface, Volume

__all__ = ["Cells", "Parts", "Surface", "Volume", "found", "of_kind", "points", "unknown"]

#: The families, by the packages in which their classes, or the bases of these, are defined.
_FAMILIES = {
    "vtkmodules": vtk.parts,
    "nibabel": images.of_nibabel,
    "itk": images.of_itk,
    "SimpleITK": images.of_simple_itk,
    "xarray": images.of_xarray,
    "zarr": images.of_zarr,
    "trimesh": meshes.of_trimesh,
    "open3d": meshes.of_open3d,
    "plyfile": meshes.of_plyfile,
    "laspy": meshes.of_laspy,
}


def parts_of(source: Any, scalar: str | None) -> Parts | None:
    """Returns the parts of an object of another package, None for arrays and anything else.

    `scalar` names the array of the object that has the values.
    """
    if isinstance(source, Parts):
        return source
    if isinstance(source, (np.ndarray, list, tuple, str)):
        return None
    for base in type(source).__mro__:
        family = _FAMILIES.get(base.__module__.partition(".")[0])
        parts = None if family is None else family(source, scalar)
        if parts is not None:
            return parts
    return None


def of_kind(kind: type[Parts], source: Any, scalar: str | None, method: str) -> Any:
    """Returns the parts of an object that must be of this kind, None for arrays."""
    parts = parts_of(source, scalar)
    if parts is None:
        if scalar is not None:
            raise KindError(
                f"{method}(): scalar names an array of an object, not of {_kind(source)}"
            )
        return None
    if isinstance(parts, kind):
        return parts
    raise KindError(
        f"{method}() takes {kind.ARTICLE}, but {_kind(source)} is {parts.ARTICLE}: call "
        f"{parts.method}() or add()"
    )


def points(source: Any, scalar: str | None, method: str) -> Surface | None:
    """Returns the points of an object, also those of a mesh or of cells; None for arrays."""
    cloud = vtk.points(source, scalar)
    if cloud is None:
        cloud = of_kind(Surface, source, scalar, method)
    if cloud is not None:
        cloud.faces = None
    return cloud


def unknown(source: Any, what: str, also: str = "") -> KindError:
    """Returns the error for an object that nothing here knows.

    Args:
        source: The object.
        what: The argument that it was given for.
        also: What else the argument may be, with a comma behind each.
    """
    return KindError(
        f"{what}: {also}an array of numbers, or a volume, mesh or point cloud of PyVista, VTK, "
        "nibabel, ITK, SimpleITK, xarray, zarr, trimesh, Open3D, plyfile or laspy is needed, not "
        f"{_kind(source)}"
    )


def _kind(source: Any) -> str:
    kind = type(source)
    return (
        kind.__qualname__
        if kind.__module__ == "builtins"
        else f"{kind.__module__}.{kind.__qualname__}"
    )
