"""The items of a scene: their arguments in plain data, and how the compiled half takes them.

An item keeps its arguments, so that it can be made again: with other data, at another place, or in
another process.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import PurePath
from typing import Any

import numpy as np

from . import _arrays, _neighbours, _options, _pysplatkit, _values
from ._errors import ArgumentError, KindError

#: The arguments of an item by their names.
Arguments = dict[str, Any]


@dataclass(frozen=True)
class Item:
    """An item of a scene."""

    #: What it is called in its scene.
    name: str
    #: The method of `Scene` that adds it.
    method: str
    #: The arguments of that method, in plain data that nothing else changes.
    arguments: Arguments
    #: Where it is moved to, as JSON.
    transform: str = "{}"
    #: The transfer function that was set by hand, as JSON.
    transfer: str | None = None

    @classmethod
    def of(cls, name: str, method: str, arguments: Mapping[str, Any]) -> Item:
        """Returns an item of the arguments of a method."""
        return cls(name, method, _PLAIN[method](dict(arguments)))

    def changed(self, changes: Mapping[str, Any]) -> Item:
        """Returns the item with other arguments. None is what the method takes by default."""
        known = _KNOWN[self.method]
        _options.checked(changes, known, f"the item was added by {self.method}(), and update")
        arguments = {**self.arguments, **changes}
        if self.method == "add":
            # What a scene file says of an input.
            for part in ("_reading", "_appearance"):
                said = arguments.get(part) or {}
                arguments[part] = {name: said[name] for name in said if name not in changes}
        new = _PLAIN[self.method](arguments)
        transfer = None if _VALUES & changes.keys() else self.transfer
        return replace(self, arguments=new, transfer=transfer)

    def put(self, native: _pysplatkit.Scene) -> None:
        """Adds the item to a scene of the compiled half."""
        _PUT[self.method](native, self)
        if self.transfer is not None and native.contents:
            last = len(native.contents) - 1
            _pysplatkit.set_transfer(native, last, self.transfer)

    def facts(self, *names: str) -> str:
        """Returns these arguments as JSON, with the name and the place."""
        given = {name: self.arguments.get(name) for name in names}
        return _values.text({"name": self.name, "transform": json.loads(self.transform), **given})

    def portable(self) -> Item:
        """Returns the item for another process, whose folder may be another one."""
        path: Any = self.arguments.get("source")
        if self.method != "add" or "://" in path:
            return self
        paths = {"source": os.path.abspath(path)}
        if self.arguments.get("labels") is not None:
            paths["labels"] = os.path.abspath(self.arguments["labels"])
        return replace(self, arguments={**self.arguments, **paths})

    @property
    def input(self) -> tuple[str, str, str, str, str] | None:
        """The path, and as JSON how the file is read, shown, moved and edited; None for an array."""
        if self.method != "add":
            return None
        edits = json.dumps(self.arguments.get("edits") or [])
        return self.arguments["source"], *_file_options(self.arguments), self.transform, edits


#: Options that change which values are shown.
_VALUES = frozenset(
    {"transfer", "range", "colormap", "log_colors", "isosurfaces", "gradient_opacity"}
    | {"opacity_unit", "channels"}
)


def name_of(path: str) -> str:
    """Returns what the item of a file is called."""
    name = PurePath(path.split("?")[0].rstrip("/\\")).name
    packed = (".gz", ".bz2", ".xz", ".zst")
    stem = PurePath(name).stem if name.lower().endswith(packed) else name
    return PurePath(stem).stem or "file"


def unused(name: str, names: Sequence[str]) -> str:
    """Returns a name that no other item has."""
    number, free = 1, name
    while free in names:
        number += 1
        free = f"{name} {number}"
    return free


def _plain_file(given: Arguments) -> Arguments:
    source = os.fspath(given.pop("source"))
    hidden = {name: given.pop(name, None) for name in ("_reading", "_appearance", "_optics")}
    known = _options.VOLUME | _options.SURFACE | _options.CELLS | _options.READING | {"edits"}
    options = _options.checked(given, known, "add")
    options.update(_options.plain_appearance(options))
    if "edits" in options:
        options["edits"] = _options.edits(options["edits"])
    return {"source": source, **hidden, **options}


def _file_options(arguments: Mapping[str, Any]) -> tuple[str, str]:
    """Returns how a file is read and shown."""
    parts = []
    for part, text in (("_reading", _options.reading), ("_appearance", _options.appearance)):
        parts.append(_values.text({**(arguments[part] or {}), **json.loads(text(arguments))}))
    return parts[0], parts[1]


def _put_file(native: _pysplatkit.Scene, item: Item) -> None:
    facts = {"transform": json.loads(item.transform)}
    facts["optics"] = item.arguments.get("_optics")
    facts["edits"] = item.arguments.get("edits", [])
    path = item.arguments["source"]
    native.add_file(path, *_file_options(item.arguments), _values.text(facts))


def _plain_volume(given: Arguments) -> Arguments:
    array, scalar = given.pop("array"), given.pop("scalar", None)
    copy = given.pop("copy", None)
    volume = _neighbours.of_kind(_neighbours.Volume, array, scalar, "add_volume")
    volume = volume or _neighbours.Volume(array)
    facts = {name: given.pop(name, None) for name in _VOLUME}
    for name in ("spacing", "origin", "axes", "coordinates", "value_name", "value_unit", "unit"):
        facts[name] = getattr(volume, name) if facts[name] is None else facts[name]
    facts["frame"] = facts["frame"] or volume.frame
    samples = _samples(volume.samples, given, copy)
    facts["opacity_from"] = _opacity(array, given.pop("opacity_from", None), samples)
    facts["channel_names"] = _channel_names(given.pop("channel_names", None), samples)
    if facts["axes"] is not None:
        matrix = _arrays.rows(facts["axes"], 3, "axes", "f8")
        if matrix.shape != (3, 3):
            raise ArgumentError(f"axes is a matrix of 3 × 3, not {matrix.shape}")
        facts["axes"] = matrix.tolist()
    for name in ("spacing", "origin"):
        facts[name] = _values.vector(facts[name])
    facts["coordinates"] = _coordinates(facts["coordinates"], samples.shape[-3:])
    facts["up"] = _options.direction(facts["up"])
    facts["labels"] = _labels(facts["labels"])
    appearance = _options.checked(given, _options.VOLUME, "add_volume")
    axis = 0 if samples.ndim == 4 else None
    facts["channel_axis"] = axis
    return {"array": samples, **facts, **_options.plain_appearance(appearance)}


def _samples(array: Any, given: Arguments, copy: bool | None) -> Any:
    """Returns the samples of a volume, with its channels along the first of four axes."""
    axis = given.pop("channel_axis", None)
    if axis is None:
        return _arrays.samples(array, copy)
    whole = np.asarray(array)
    if not (isinstance(axis, int) and -whole.ndim <= axis < whole.ndim):
        raise ArgumentError(f"channel_axis={axis!r} is no axis of the shape {whole.shape}")
    return _arrays.samples(np.moveaxis(whole, axis, 0), copy, axes=4)


def _opacity(source: Any, opacity: Any, samples: Any) -> Any:
    """Returns the samples that say how opaque a volume is."""
    if opacity is None:
        return None
    if isinstance(opacity, str):
        volume = _neighbours.of_kind(_neighbours.Volume, source, opacity, "add_volume")
        opacity = volume.samples
    array = _arrays.samples(opacity)
    if array.shape != samples.shape:
        raise ArgumentError(
            f"opacity_from has the shape {array.shape}, and the values {samples.shape}"
        )
    return array


def _channel_names(names: Any, samples: Any) -> list[str] | None:
    if names is None:
        return None
    listed = [str(name) for name in names]
    if samples.ndim != 4 or len(listed) != len(samples):
        count = len(samples) if samples.ndim == 4 else 0
        raise ArgumentError(f"there are {len(listed)} channel_names for {count} channels")
    return listed


_VOLUME = (
    *("spacing", "origin", "axes", "coordinates", "missing", "modality", "value_name"),
    *("value_unit", "unit", "up", "labels", "frame"),
)


def _put_volume(native: _pysplatkit.Scene, item: Item) -> None:
    arguments = item.arguments
    facts = item.facts(*_VOLUME, "channel_names")
    appearance = _options.appearance(arguments)
    array = arguments["array"]
    channels = list(array) if array.ndim == 4 else [array]
    native.add_volume((channels, arguments["opacity_from"]), facts, "{}", appearance)


def _plain_mesh(given: Arguments) -> Arguments:
    vertices, scalar = given.pop("vertices"), given.pop("scalar", None)
    surface = _neighbours.of_kind(_neighbours.Surface, vertices, scalar, "add_mesh")
    surface = surface or _neighbours.Surface(vertices)
    faces = given.pop("faces", None)
    if faces is not None:
        surface.faces = faces
    if surface.faces is None:
        raise KindError("add_mesh() needs faces: add_points() adds points without")
    return _plain_surface(surface, given, "add_mesh")


def _plain_points(given: Arguments) -> Arguments:
    positions, scalar = given.pop("positions"), given.pop("scalar", None)
    surface = _neighbours.points(positions, scalar, "add_points")
    surface = surface or _neighbours.Surface(positions)
    radius = given.pop("radius", None)
    given.pop("faces", None)
    if given.get("up") is None:
        given["up"] = surface.up
    arguments = _plain_surface(surface, given, "add_points")
    arguments["radius"] = None if radius is None else _radii(radius, len(arguments["positions"]))
    return arguments


def _plain_surface(surface: _neighbours.Surface, given: Arguments, method: str) -> Arguments:
    """Returns the arrays of a surface, and how it looks."""
    replacements = (given.pop(name, None) for name in ("normals", "colors", "values"))
    surface = surface.with_given(*replacements)
    up = _options.direction(given.pop("up", None))
    appearance = _options.checked(given, _options.SURFACE, method)
    faces, normals, colors = surface.faces, surface.normals, surface.colors
    first = "positions" if faces is None else "vertices"
    positions = _kept(_arrays.positions(surface.positions, first), surface.positions)
    count = len(positions)
    values = None if surface.values is None else _arrays.column(surface.values, "values")
    normals = None if normals is None else _arrays.rows(normals, 3, "normals")
    return {
        first: positions,
        "faces": None if faces is None else _kept(_arrays.faces(faces, count), faces),
        "normals": _kept(normals, surface.normals),
        "colors": None if colors is None else _arrays.colors(colors, count),
        "values": _kept(values, surface.values),
        "up": up,
        **_options.plain_appearance(appearance),
    }


def _put_surface(native: _pysplatkit.Scene, item: Item) -> None:
    arguments = item.arguments
    arrays = {name: arguments.get(name) for name in ("faces", "normals", "colors", "values")}
    arrays["positions"] = arguments["vertices" if item.method == "add_mesh" else "positions"]
    arrays["radii"] = arguments.get("radius")
    # Values colour a surface even if it has colours.
    named = {"scalar": "values"} if arrays["values"] is not None else {}
    appearance = _options.appearance(arguments)
    native.add_mesh(arrays, item.facts("up"), _values.text(named), appearance)


def _plain_cells(given: Arguments) -> Arguments:
    points, cells, values = (given.pop(name, None) for name in ("points", "cells", "values"))
    kinds, scalar = given.pop("kinds", None), given.pop("scalar", None)
    style, raw, of_cells = (given.pop(name, None) for name in ("style", "_raw", "_of_cells"))
    facts = {"missing": given.pop("missing", None)}
    facts["up"] = _options.direction(given.pop("up", None))
    appearance = _options.checked(given, _options.CELLS - {"cells"}, "add_cells")
    if style is not None:
        appearance["cells"] = style
    grid = _neighbours.of_kind(_neighbours.Cells, points, scalar, "add_cells")
    if grid is not None:
        points, raw = grid.positions, _arrays.raw_cells(grid.kinds, grid.offsets, grid.nodes)
        if values is None:
            values, of_cells = grid.values, grid.of_cells
    elif cells is not None:
        raw = _arrays.cells(cells, kinds)
    elif raw is None:
        raise KindError("add_cells() needs points and cells, or a grid")
    positions = _kept(_arrays.positions(points, "points"), points)
    column = None if values is None else _kept(_arrays.column(values, "values"), values)
    count = len(raw["kinds"])
    if column is not None:
        if of_cells is None or len(column) != (count if of_cells else len(positions)):
            of_cells = len(column) == count != len(positions)
        if len(column) != (count if of_cells else len(positions)):
            raise ArgumentError(
                f"there are {len(column)} values for {len(positions)} points and {count} cells"
            )
    hidden = {"_raw": raw, "_of_cells": bool(of_cells)}
    plain = _options.plain_appearance(appearance)
    plain["style"] = plain.pop("cells", None)
    return {"points": positions, "values": column, **hidden, **facts, **plain}


def _put_cells(native: _pysplatkit.Scene, item: Item) -> None:
    arguments = item.arguments
    positions, values, of_cells = (arguments[name] for name in ("points", "values", "_of_cells"))
    raw = arguments["_raw"]
    points, nodes = _arrays.used(raw["nodes"], len(positions))
    arrays = {
        **raw,
        "nodes": nodes,
        "positions": positions[points],
        "values": values if of_cells or values is None else values[points],
        "of_cells": of_cells,
    }
    shown = {name: arguments[name] for name in arguments.keys() & _options.CELLS}
    appearance = _options.appearance({**shown, "cells": arguments["style"]})
    native.add_cells(arrays, item.facts("missing", "up"), appearance)


def _plain_samples(given: Arguments) -> Arguments:
    positions, values = given.pop("positions"), given.pop("values")
    radii, covariances = given.pop("radii", None), given.pop("covariances", None)
    facts = {name: given.pop(name, None) for name in _SAMPLES}
    facts["up"] = _options.direction(given.pop("up", None))
    appearance = _options.checked(given, _options.FIELD, "add_samples")
    plain = _arrays.positions(positions, "positions")
    rows = None if covariances is None else _arrays.rows(covariances, 6, "covariances")
    return {
        "positions": _kept(plain, positions),
        "values": _kept(_arrays.column(values, "values"), values),
        "radii": None if radii is None else _kept(_arrays.column(radii, "radii"), radii),
        "covariances": _kept(rows, covariances),
        **facts,
        **_options.plain_appearance(appearance),
    }


_SAMPLES = ("missing", "radius", "neighbours", "slopes")


def _put_samples(native: _pysplatkit.Scene, item: Item) -> None:
    arguments = item.arguments
    names = ("positions", "values", "radii", "covariances")
    arrays = {name: arguments[name] for name in names}
    load = _values.text({name: arguments[name] for name in _SAMPLES[1:]})
    appearance = _options.appearance(arguments)
    native.add_samples(arrays, item.facts("missing", "up"), load, appearance)


def _plain_gaussians(given: Arguments) -> Arguments:
    _options.checked(given, _KNOWN["add_gaussians"], "add_gaussians")
    centers = _arrays.positions(given["centers"], "centers")
    colors, harmonics = given.get("colors"), given.get("harmonics")
    if (colors is None) == (harmonics is None):
        raise ArgumentError("Gaussians have either colors or harmonics")
    if harmonics is not None:
        terms = _arrays.numbers(harmonics, "harmonics")
        if terms.ndim != 3 or terms.shape[0] != len(centers) or terms.shape[2] != 3:
            form = "(n, terms, 3) is needed"
            raise ArgumentError(f"harmonics has the shape {terms.shape}; {form}")
        harmonics = _kept(np.ascontiguousarray(terms, dtype=np.float32), harmonics)
    else:
        colors = _arrays.colors(colors, len(centers))
    widths = {"scales": 3, "rotations": 4}
    rows = {name: _arrays.rows(given[name], width, name) for name, width in widths.items()}
    opacities = _arrays.column(given["opacities"], "opacities")
    return {
        "centers": _kept(centers, given["centers"]),
        **{name: _kept(array, given[name]) for name, array in rows.items()},
        "opacities": _kept(opacities, given["opacities"]),
        "colors": colors,
        "harmonics": harmonics,
        "up": _options.direction(given.get("up")),
    }


def _put_gaussians(native: _pysplatkit.Scene, item: Item) -> None:
    arguments = item.arguments
    terms = arguments["harmonics"]
    if terms is None:
        # The constant term of the harmonics.
        rgb = arguments["colors"][:, :3]
        terms = (rgb.astype(np.float64) / 255.0 - 0.5) / 0.28209479177387814
    names = ("centers", "scales", "rotations", "opacities")
    arrays = {name: arguments[name] for name in names}
    arrays["harmonics"] = np.ascontiguousarray(terms.reshape(-1, 3), dtype=np.float32)
    native.add_gaussians(arrays, item.facts("up"))


def _kept(array: Any, given: Any) -> Any:
    """Returns an array that a caller cannot change: a copy, if it shares the caller's memory."""
    if array is None or not isinstance(given, np.ndarray) or not np.may_share_memory(array, given):
        return array
    array = array.copy()
    array.flags.writeable = False
    return array


def _radii(value: Any, count: int) -> Any:
    radii = _arrays.column(
        np.broadcast_to(value, (count,)) if np.ndim(value) == 0 else value, "radius"
    )
    if len(radii) != count:
        raise ArgumentError(f"there are {len(radii)} radii for {count} points")
    if not (np.isfinite(radii) & (radii > 0.0)).all():
        raise ArgumentError("radius: each radius is a length above 0")
    return np.ascontiguousarray(radii)


def _labels(given: Any) -> Any:
    if isinstance(given, Mapping):
        return [(int(value), str(name)) for value, name in given.items()]
    return given if given is None or isinstance(given, (bool, list)) else os.fspath(given)


def _coordinates(given: Sequence[Any] | None, shape: tuple[int, ...]) -> list[Any] | None:
    if given is None:
        return None
    lines = [_arrays.numbers(line, "coordinates").ravel().astype(float) for line in given]
    if tuple(map(len, reversed(lines))) != shape:
        raise ArgumentError(
            f"coordinates of {' × '.join(str(len(line)) for line in lines)} samples along x, y and z "
            f"do not fit an array of the shape {shape}"
        )
    return [line.tolist() for line in lines]


_PLAIN: dict[str, Callable[[Arguments], Arguments]] = {
    "add": _plain_file,
    "add_volume": _plain_volume,
    "add_mesh": _plain_mesh,
    "add_points": _plain_points,
    "add_cells": _plain_cells,
    "add_samples": _plain_samples,
    "add_gaussians": _plain_gaussians,
}
_PUT: dict[str, Callable[[_pysplatkit.Scene, Item], None]] = {
    "add": _put_file,
    "add_volume": _put_volume,
    "add_mesh": _put_surface,
    "add_points": _put_surface,
    "add_cells": _put_cells,
    "add_samples": _put_samples,
    "add_gaussians": _put_gaussians,
}
#: The first argument of each method.
FIRST = {
    "add": "source",
    "add_volume": "array",
    "add_mesh": "vertices",
    "add_points": "positions",
    "add_cells": "points",
    "add_samples": "positions",
    "add_gaussians": "centers",
}
#: What an object of another package says of itself.
SAID = {
    "add_volume": {*_VOLUME[:4], "value_name", "value_unit", "unit", "frame"},
    "add_mesh": {"faces", "normals", "colors", "values"},
    "add_points": {"normals", "colors", "values", "radius"},
    "add_cells": {"_raw", "_of_cells", "values"},
}
_SURFACE = _options.SURFACE | {"scalar", "normals", "colors", "values", "up"}
#: What an item of each method can be changed by.
_KNOWN: dict[str, frozenset[str]] = {
    "add": _options.VOLUME
    | _options.SURFACE
    | _options.CELLS
    | _options.READING
    | {"source", "edits"},
    "add_volume": _options.VOLUME
    | (frozenset(_VOLUME) - {"frame"})
    | {"array", "scalar", "copy", "channel_axis", "channel_names", "opacity_from"},
    "add_mesh": _SURFACE | {"vertices", "faces"},
    "add_points": _SURFACE | {"positions", "radius"},
    "add_cells": _options.CELLS | {"points", "kinds", "values", "scalar", "missing", "up", "style"},
    "add_samples": _options.FIELD
    | set(_SAMPLES)
    | {"positions", "values", "radii", "covariances"}
    | {"up"},
    "add_gaussians": frozenset(
        {"centers", "scales", "rotations", "opacities", "colors", "harmonics", "up"}
    ),
}
