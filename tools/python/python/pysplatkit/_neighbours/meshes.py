"""Meshes and point clouds of trimesh, Open3D, plyfile and laspy."""

from __future__ import annotations

from typing import Any

import numpy as np

from .._errors import ArgumentError
from .parts import Array, Surface, chosen, fans


def of_trimesh(source: Any, scalar: str | None) -> Surface | None:
    """Returns a mesh, a point cloud, or the meshes of a scene in one."""
    if hasattr(source, "geometry") and hasattr(source, "graph"):
        source = source.to_mesh() if hasattr(source, "to_mesh") else source.dump(concatenate=True)
    if not hasattr(source, "vertices"):
        return None
    positions = np.asarray(source.vertices)
    if not hasattr(source, "faces"):
        if hasattr(source, "entities"):
            return None
        colors = np.asarray(source.colors)
        _no_arrays(scalar, "a point cloud of trimesh")
        return Surface(positions, colors=colors if len(colors) == len(positions) else None)
    surface = Surface(positions, np.asarray(source.faces))
    if scalar is not None:
        of_faces, of_vertices = dict(source.face_attributes), dict(source.vertex_attributes)
        values = chosen({**of_faces, **of_vertices}, scalar, "the mesh")
        if scalar not in of_vertices:
            return surface.by_face(None, np.asarray(values))
        surface.values = np.asarray(values)
        return surface
    visual = source.visual
    if visual.kind == "face":
        return surface.by_face(np.asarray(visual.face_colors), None)
    if visual.kind == "texture":
        # The colours of the texture at the vertices.
        visual = visual.to_color()
    if visual.kind is not None:
        surface.colors = np.asarray(visual.vertex_colors)
    return surface


def of_open3d(source: Any, scalar: str | None) -> Surface | None:
    """Returns a mesh or a point cloud, of tensors or of the older kind."""
    if hasattr(source, "vertex") and hasattr(source, "triangle"):
        surface = _of_tensors(source.vertex, scalar)
        surface.faces = _numpy(source.triangle.indices)
        return surface
    if hasattr(source, "point") and not hasattr(source, "line"):
        return _of_tensors(source.point, scalar)
    if hasattr(source, "vertices") and hasattr(source, "triangles"):
        _no_arrays(scalar, "a mesh of Open3D")
        return Surface(
            np.asarray(source.vertices),
            np.asarray(source.triangles),
            np.asarray(source.vertex_normals) if source.has_vertex_normals() else None,
            np.asarray(source.vertex_colors) if source.has_vertex_colors() else None,
        )
    if hasattr(source, "points") and hasattr(source, "has_points") and hasattr(source, "normals"):
        _no_arrays(scalar, "a point cloud of Open3D")
        return Surface(
            np.asarray(source.points),
            None,
            np.asarray(source.normals) if source.has_normals() else None,
            np.asarray(source.colors) if source.has_colors() else None,
        )
    return None


def _of_tensors(attributes: Any, scalar: str | None) -> Surface:
    arrays = {name: attributes[name] for name in attributes}
    if "positions" not in arrays:
        raise ArgumentError("the object of Open3D has no positions")
    surface = Surface(_numpy(arrays["positions"]))
    if "normals" in arrays:
        surface.normals = _numpy(arrays["normals"])
    if "colors" in arrays:
        surface.colors = _numpy(arrays["colors"])
    if scalar is not None:
        surface.values = _numpy(chosen(arrays, scalar, "it"))
    return surface


def _numpy(tensor: Any) -> Array:
    numbers: Array = tensor.cpu().numpy()
    return numbers


def of_plyfile(source: Any, scalar: str | None) -> Surface | None:
    """Returns the vertices and the faces of a file that plyfile has read."""
    if not hasattr(source, "elements"):
        return None
    elements = {element.name: element.data for element in source.elements}
    vertices = elements.get("vertex")
    if vertices is None or not {"x", "y", "z"} <= set(vertices.dtype.names or ()):
        raise ArgumentError("the PLY data has no element “vertex” with x, y and z")
    arrays = {name: vertices[name] for name in vertices.dtype.names or ()}

    def joined(*names: str) -> Array | None:
        has_all = set(names) <= set(arrays)
        return np.stack([arrays[name] for name in names], axis=1) if has_all else None

    surface = Surface(np.stack([arrays[axis] for axis in "xyz"], axis=1), _faces_of_ply(elements))
    surface.normals = joined("nx", "ny", "nz")
    surface.colors = joined("red", "green", "blue", "alpha")
    if surface.colors is None:
        surface.colors = joined("red", "green", "blue")
    if scalar is not None:
        surface.values = np.asarray(chosen(arrays, scalar, "the PLY data"))
    return surface


def _faces_of_ply(elements: dict[str, Array]) -> Array | None:
    faces = elements.get("face")
    if faces is None or not len(faces):
        return None
    names = [
        name for name in ("vertex_indices", "vertex_index") if name in (faces.dtype.names or ())
    ]
    if not names:
        raise ArgumentError("the faces of the PLY data have no vertex_indices")
    lists = faces[names[0]]
    if lists.ndim == 2:
        return lists
    offsets = np.concatenate([[0], np.cumsum([len(row) for row in lists])])
    return fans(offsets, np.concatenate(list(lists)).astype(np.int64))[0]


def _no_arrays(scalar: str | None, what: str) -> None:
    if scalar is not None:
        raise ArgumentError(f"{what} has no array {scalar!r}: pass values instead")


def of_laspy(source: Any, scalar: str | None) -> Surface | None:
    """Returns the points of a LAS or LAZ file that laspy has read, z up as the format has it."""
    if not all(hasattr(source, name) for name in ("x", "y", "z", "point_format")):
        return None
    positions = np.stack([np.asarray(getattr(source, axis), float) for axis in "xyz"], axis=1)
    names = list(source.point_format.dimension_names)
    surface = Surface(positions, up="+Z")
    if scalar is not None:
        if scalar not in names:
            raise ArgumentError(f"the points have no {scalar!r}, but {', '.join(names)}")
        surface.values = np.asarray(source[scalar], float)
    elif {"red", "green", "blue"} <= set(names):
        colors = np.stack([np.asarray(source[name]) for name in ("red", "green", "blue")], axis=1)
        # Many programs write bytes into the fields of 16 bits.
        is_bytes = colors.size > 0 and colors.max() <= 255
        surface.colors = colors.astype(np.uint8 if is_bytes else np.uint16)
    return surface
