"""Values of options as the compiled half takes them."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from . import _pysplatkit
from ._errors import ArgumentError

#: A colour: a name or '#rrggbb', or red, green and blue from 0 to 1.
Color = str | Sequence[float]
#: Three numbers: x, y, z.
Vector = Sequence[float]


def text(options: Mapping[str, Any]) -> str:
    """Returns options as JSON, without those that are None."""
    given = {name: value for name, value in options.items() if value is not None}
    try:
        return json.dumps(given, default=_plain, allow_nan=False)
    except ValueError as error:
        raise ArgumentError(f"the options {given} are no finite numbers and texts") from error


def _plain(value: Any) -> Any:
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    raise ArgumentError(f"{value!r} is not a value for an option")


def color(value: Color) -> list[float]:
    """Returns red, green and blue from 0 to 1."""
    if isinstance(value, str):
        return list(_pysplatkit.color(value))
    try:
        parts = [float(part) for part in value]
    except (TypeError, ValueError):
        parts = []
    if len(parts) != 3 or not all(0.0 <= part <= 1.0 for part in parts):
        form = "a colour is a name, '#rrggbb' or three numbers from 0 to 1"
        raise ArgumentError(f"{form}, not {value}")
    return parts


def hex_color(value: Color) -> str:
    """Returns a colour as `#rrggbb`."""
    return "#" + "".join(f"{round(part * 255):02x}" for part in color(value))


def vector(value: float | Vector | Sequence[str]) -> list[float]:
    """Returns three numbers, or one number three times."""
    try:
        parts = np.asarray(value, dtype=float).ravel().tolist()
    except (TypeError, ValueError):
        parts = []
    if len(parts) == 1:
        parts *= 3
    if len(parts) != 3:
        raise ArgumentError(f"three numbers are needed: x, y, z; not {value!r}")
    return parts
