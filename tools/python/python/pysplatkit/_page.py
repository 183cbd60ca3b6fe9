"""Pages for browsers."""

from __future__ import annotations

import json
import os
from typing import TYPE_CHECKING, Any

from . import _pysplatkit
from ._errors import ArgumentError
from ._options import PathLike

if TYPE_CHECKING:
    from ._scene import Scene

#: Units of bytes.
_UNITS = {"kb": 1e3, "mb": 1e6, "gb": 1e9, "kib": 2**10, "mib": 2**20, "gib": 2**30, "b": 1}


def write(
    scene: Scene,
    path: PathLike,
    described: dict[str, Any],
    wanted: tuple[str | None, float | None, int | str | None, PathLike | None],
) -> dict[str, Any]:
    """Writes the page of a scene, and says what was written."""
    title, quality, limit, viewer = wanted
    if quality is not None and not 0 < quality <= 1:
        raise ArgumentError(f"quality is a share above 0 and up to 1, not {quality!r}")
    options = {
        "path": os.fspath(path),
        "title": title,
        "quality": quality,
        "limit": None if limit is None else _bytes(limit),
        "viewer": None if viewer is None else os.fspath(viewer),
    }
    # Texts over pictures are not shown in pages.
    described = {**described, "overlay": {}, "engine": None}
    written = _collected(scene).page(json.dumps(described), json.dumps(options))
    result: dict[str, Any] = json.loads(written)
    return result


def _collected(scene: Scene) -> _pysplatkit.Scene:
    """Returns the inputs of a scene, with arrays as files and the functions that fields have."""
    native = scene._native
    contents = native.contents
    functions: dict[int, list[str]] = {}
    for field in json.loads(_pysplatkit.fields(native)):
        number = contents[field["item"]][1]
        functions.setdefault(number, []).append(json.dumps(field["transfer"]))
    collected = _pysplatkit.Scene.collecting()
    for number, item in enumerate(scene._items):
        item.put(collected)
        # A file is shown as here by the options that it was added with.
        is_set = item.method != "add" or item.transfer is not None
        if is_set and number in functions:
            collected.show_last(functions[number])
    return collected


def _bytes(limit: int | str) -> int:
    """Returns a number of bytes, such as "20MB"."""
    text = str(limit).strip().lower()
    unit = next((unit for unit in _UNITS if text.endswith(unit)), "")
    try:
        count = int(float(text.removesuffix(unit)) * _UNITS.get(unit, 1))
    except (ValueError, OverflowError):
        count = 0
    if count <= 0:
        raise ArgumentError(f'limit is a number of bytes, such as "20MB", not {limit!r}')
    return count
