"""Finished pictures."""

from __future__ import annotations

import json
import os
from functools import cached_property
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from . import _options, _pysplatkit, _values
from ._camera import Camera
from ._errors import OutputError

_T = TypeVar("_T", bound=np.generic)


def _restored(
    color: npt.NDArray[np.float32],
    depth: npt.NDArray[np.float32],
    about: tuple[str, str],
    background: list[float] | None,
    dpi: float | None = None,
    layers: dict[str, npt.NDArray[Any]] | None = None,
) -> Picture:
    """Returns a picture that was pickled."""
    height, width = depth.shape
    pixels = (color.reshape(-1, 4), depth.ravel(), (width, height), 1, about)
    known = None
    if layers:
        normals, albedo, numbers = map(layers.get, ("normals", "albedo", "identifiers"))
        known = _pysplatkit.Layers(
            None if normals is None else normals.reshape(-1, 3),
            None if albedo is None else albedo.reshape(-1, 4),
            None if numbers is None else numbers.ravel(),
        )
    return Picture(_pysplatkit.Picture(*pixels), background, dpi, known)


class Picture:
    """A finished picture, with rows from the top. `Scene.render` returns it.

    Its arrays are read-only; `picture.rgba.copy()` can be changed.
    """

    def __init__(
        self,
        native: _pysplatkit.Picture,
        background: list[float] | None,
        dpi: float | None = None,
        layers: _pysplatkit.Layers | None = None,
    ) -> None:
        self._native = native
        self._background = background
        self._dpi = dpi
        self._layers = layers

    @property
    def size(self) -> tuple[int, int]:
        """The width and the height in pixels."""
        return self._native.size

    @cached_property
    def rgba(self) -> npt.NDArray[np.uint8]:
        """Red, green, blue and opacity of each pixel, (height, width, 4) bytes: what `save` writes.

        Over a background the opacity is 255. Without one, colours are not multiplied by it.
        """
        return self._shaped(self._native.rgba(self._background), 4)

    @cached_property
    def color(self) -> npt.NDArray[np.float32]:
        """Red, green and blue, multiplied by opacity, and opacity: (height, width, 4), 0 to 1,
        without the background, before they are rounded to bytes."""
        return self._shaped(self._native.color(), 4)

    @cached_property
    def depth(self) -> npt.NDArray[np.float32]:
        """How far in front of the eye half of the light is absorbed, in world units along the view
        direction: (height, width). Infinite where less than half is absorbed."""
        return self._shaped(self._native.depth())

    @cached_property
    def layers(self) -> dict[str, npt.NDArray[Any]]:
        """The layers that `render` was asked for, by their names: normals (height, width, 3) in the
        world; albedo (height, width, 4), as `color` without light; identifiers (height, width), the
        numbers of the inputs from 1 on."""
        if self._layers is None:
            return {}
        flat = {
            "normals": (self._layers.normals(), 3),
            "albedo": (self._layers.albedo(), 4),
            "identifiers": (self._layers.identifiers(), None),
        }
        return {
            name: self._shaped(values, *([] if width is None else [width]))
            for name, (values, width) in flat.items()
            if values is not None
        }

    @property
    def camera(self) -> Camera:
        """The camera that the picture was taken with; of several views, that of the first."""
        return Camera.from_json(self._native.camera)

    @cached_property
    def statistics(self) -> dict[str, Any]:
        """What was drawn: splats, bricks, bytes of memory, …."""
        return dict(json.loads(self._native.statistics))

    def over(self, background: _values.Color | None) -> Picture:
        """Returns the same picture over another background.

        Args:
            background: A colour; None for transparency.
        """
        return Picture(self._native, _options.background(background), self._dpi, self._layers)

    def save(
        self,
        path: _options.PathLike,
        *,
        bits: int | None = None,
        dpi: float | None = None,
        overwrite: bool = True,
    ) -> Path:
        """Writes a .png, .jpg, .tiff, .webp or .exr file, which appears whole or not at all.
        Returns its path.

        OpenEXR files hold colours in linear light, multiplied by opacity, depths, and layers.

        Args:
            path: The file.
            bits: Bits a channel: 8 or 16 for .png and .tiff, 16 or 32 for .exr. Default: the first.
            dpi: Pixels an inch, which files store. Default: what `render` was given.
            overwrite: Whether a file that is there already is replaced.
        """
        density = self._dpi if dpi is None else float(dpi)

        def write(to: Path) -> None:
            self._native.save(to, self._background, (bits, density), self._layers)

        return self._written(path, overwrite, write)

    def save_depth(self, path: _options.PathLike, *, overwrite: bool = True) -> Path:
        """Writes the depths as a grey PNG of 16 bits: white for the nearest, black for nothing.
        Returns its path.

        Args:
            path: The file.
            overwrite: Whether a file that is there already is replaced.
        """
        return self._written(path, overwrite, self._native.save_depth)

    def _written(self, path: _options.PathLike, overwrite: bool, write: Any) -> Path:
        to = Path(os.fspath(path))
        if not overwrite and (to.exists() or to.is_symlink()):
            raise OutputError(to, "cannot be written", None, "it exists already")
        write(to)
        return to

    def _shaped(self, flat: npt.NDArray[_T], *channels: int) -> npt.NDArray[_T]:
        width, height = self.size
        array = flat.reshape((height, width, *channels))
        array.flags.writeable = False
        return array

    def __reduce__(self) -> tuple[Any, ...]:
        about = (self._native.statistics, self._native.camera)
        return _restored, (self.color, self.depth, about, self._background, self._dpi, self.layers)

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> npt.NDArray[Any]:
        array = self.rgba if dtype is None else self.rgba.astype(dtype, copy=False)
        return array.copy() if copy else array

    def _repr_png_(self) -> bytes:
        return self._native.png(self._background)

    def __repr__(self) -> str:
        width, height = self.size
        return f"<pysplatkit.Picture of {width}x{height} pixels>"
