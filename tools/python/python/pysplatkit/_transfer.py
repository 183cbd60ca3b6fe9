"""Transfer functions."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from . import _pysplatkit
from ._values import color

#: The light of surfaces inside a volume, unless another one is given.
_LIGHT = {"ambient": 0.2, "diffuse": 0.7, "specular": 0.3, "power": 10.0}


@dataclass
class TransferFunction:
    """The colour and the opacity that values are drawn with, linear between points.

    An opacity holds for a layer of that value that is `unit` of world length thick, so the picture
    does not depend on the sampling.

    >>> bone = TransferFunction([(0, "brown"), (1000, "ivory")], [(200, 0.0), (700, 0.5)], unit=2)
    """

    #: (value, colour), …: a colour is a name, '#rrggbb', or red, green and blue from 0 to 1.
    colors: Sequence[tuple[float, Any]]
    #: (value, opacity from 0 to 1), ….
    opacities: Sequence[tuple[float, float]]
    #: The world length that the opacities hold for.
    unit: float = 1.0
    #: The light: True, False, or a dict with ambient, diffuse, specular and power.
    shade: bool | dict[str, Any] = True
    #: (magnitude of the gradient, factor on the opacity), ….
    gradient: Sequence[tuple[float, float]] = ()
    #: Surfaces: dicts with value, color and opacity.
    isosurfaces: Sequence[dict[str, Any]] = field(default_factory=list)

    @classmethod
    def named(
        cls, name: str, range: tuple[float, float] = (0.0, 1.0), *, diagonal: float | None = None
    ) -> TransferFunction:
        """Returns a preset. Those of CT expect Hounsfield units.

        Args:
            name: A name of `pysplatkit.TRANSFER_FUNCTIONS`.
            range: The values that the presets of magnetic resonance and “generic” are spread over.
            diagonal: The diagonal of the box around the data. Opacities hold for 1/350 of it.
                Default: they hold for a length of 1.
        """
        low, high = range
        return cls.from_json(_pysplatkit.named_transfer(name, [float(low), float(high)], diagonal))

    @classmethod
    def from_json(cls, text: str) -> TransferFunction:
        """Reads the JSON form, which the command and the window write.

        Args:
            text: The JSON.
        """
        parts = json.loads(_pysplatkit.checked_transfer(text))
        return cls(
            colors=[(value, tuple(rgb)) for value, *rgb in parts["color"]],
            opacities=[(value, opacity) for value, opacity in parts["opacity"]],
            unit=parts["unit"],
            shade=parts["shade"] or False,
            gradient=[(magnitude, factor) for magnitude, factor in parts.get("gradient", ())],
            isosurfaces=parts.get("isosurfaces", []),
        )

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> TransferFunction:
        """Reads a JSON file.

        Args:
            path: The file.
        """
        return cls.from_json(_pysplatkit.read_transfer(os.fspath(path)))

    @classmethod
    def of(cls, value: Any) -> Any:
        """Returns what the compiled half takes: a name, or the parts of the JSON form.

        Args:
            value: A function, a name, a JSON file or its text.
        """
        if isinstance(value, TransferFunction):
            return value._parts()
        if isinstance(value, os.PathLike):
            return cls.read(value)._parts()
        if not isinstance(value, str) or value in _pysplatkit.TRANSFER_FUNCTIONS:
            return value
        if value.lstrip().startswith("{"):
            return cls.from_json(value)._parts()
        is_file = value.lower().endswith(".json") or Path(value).is_file()
        return cls.read(value)._parts() if is_file else value

    def to_json(self) -> str:
        """Returns the JSON form, which `from_json` and the command read."""
        return _pysplatkit.checked_transfer(json.dumps(self._parts()))

    def _parts(self) -> dict[str, Any]:
        shade = dict(_LIGHT) if self.shade is True else self.shade or None
        surfaces = [dict(surface, color=color(surface["color"])) for surface in self.isosurfaces]
        return {
            "color": [[float(value), *color(tone)] for value, tone in self.colors],
            "opacity": [[float(value), float(opacity)] for value, opacity in self.opacities],
            "unit": float(self.unit),
            "shade": shade,
            "gradient": [[float(value), float(factor)] for value, factor in self.gradient],
            "isosurfaces": surfaces,
        }
