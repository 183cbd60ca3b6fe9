"""Pictures of NumPy arrays and of files, drawn as elliptic splats, without GPU or display.

>>> import pysplatkit
>>> pysplatkit.render("skull.nrrd", view="left").save("skull.png")

A `Scene` holds several items, and is drawn from any side:

>>> scene = pysplatkit.Scene().add_volume(array, spacing=(0.7, 0.7, 1.25)).add("implant.stl")
>>> picture = scene.render((800, 600), view="left")
>>> picture.rgba.shape
(600, 800, 4)
"""

from __future__ import annotations

import atexit
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Unpack

from . import _options, _pysplatkit
from ._camera import Camera, Clip
from ._errors import (
    ArgumentError,
    DataWarning,
    DeniedFileError,
    Error,
    FileError,
    InputError,
    KindError,
    LimitError,
    MissingFileError,
    NothingToDrawError,
    OutOfMemoryError,
    OutputError,
    TimeLimitError,
    TransferError,
)
from ._files import Finding, Format, Hierarchy, Leaves, Report, check, convert, formats, info
from ._options import RenderOptions
from ._picture import Picture
from ._scene import Scene
from ._transfer import TransferFunction
from ._values import Color

__version__: str = _pysplatkit.__version__

#: The names of transfer functions.
TRANSFER_FUNCTIONS: tuple[str, ...] = tuple(_pysplatkit.TRANSFER_FUNCTIONS)
#: The names of colour maps. Each may end with `_r`, which reverses it.
COLOR_MAPS: tuple[str, ...] = tuple(_pysplatkit.COLOR_MAPS)


def render(
    source: Any,
    *,
    size: tuple[int, int] | None = None,
    camera: Camera | None = None,
    view: str | None = None,
    azimuth: float | None = None,
    elevation: float | None = None,
    zoom: float | None = None,
    orthographic: bool | None = None,
    background: Color | None = "auto",
    samples: int | str | None = None,
    clips: Sequence[Clip] | None = None,
    scalar_bar: bool | None = None,
    axes: bool | None = None,
    scale_bar: bool | None = None,
    caption: str | None = None,
    engine: str | None = None,
    **options: Unpack[RenderOptions],
) -> Picture:
    """Draws a file, an array or an object of another package.

    >>> render("skull.nrrd", view="left", zoom=1.5, colormap="magma").save("skull.png")

    A scene file is drawn as it says, but for the arguments that are given.

    Args:
        source: What is drawn: all that `Scene.add` takes, or a scene file.
        size: Width and height in pixels. Default: 1280 × 720.
        camera: Where the picture is taken from. Default: one that sees everything.
        view: The side to look from: front, back, left, right, top, bottom or iso.
        azimuth: Degrees to the right about the up axis.
        elevation: Degrees upwards.
        zoom: A factor on the size of what is seen.
        orthographic: Whether to draw without perspective.
        background: A colour; None for transparent pixels. Default: black.
        samples: Pixels that are drawn for each pixel and averaged: 1, 4, 9, 16, 64 or auto.
        clips: Shapes that cut the scene (`Clip`).
        scalar_bar: Whether the colours of values are drawn, with their numbers.
        axes: Whether the directions of the axes are drawn.
        scale_bar: Whether a round length is drawn.
        caption: A text above the picture's content.
        engine: cpu, gpu or auto. Default: cpu.
        options: The options of `Scene.add`, such as transfer, range, colormap and color, and the
            other options of `Scene.render`.
    """
    given = {name: value for name, value in locals().items() if name not in ("source", "options")}
    if axes is not None and not isinstance(axes, bool):
        raise ArgumentError(
            "axes of render() draws the directions of the axes; Scene().add_volume(array, axes=…) "
            "takes those of an array"
        )
    rest: dict[str, Any] = dict(options)
    # `up` is the way up of an array, and otherwise that of the camera.
    is_file = isinstance(source, (str, os.PathLike))
    names = _options.DRAWING | _options.PAGE | _options.VIEW | {"layers"}
    names -= set() if is_file else {"up"}
    given |= {name: rest.pop(name) for name in names & rest.keys()}
    # The `meta.json` of trained Gaussians (SOG), and the index of streamed ones, is no scene.
    if is_file:
        path = Path(source)
        if path.suffix == ".json" and path.name not in ("meta.json", "lod-meta.json") and not rest:
            return Scene.open(path).render(**given)
        # Functions that are made for the values suit what the picture computes of them.
        rest["_optics"] = given.get("optics")
    return Scene().add(source, **rest).render(**given)


# Interrupted conversions may go on until the process ends. They leave no files.
atexit.register(_pysplatkit.abandon)

__all__ = [
    "COLOR_MAPS",
    "TRANSFER_FUNCTIONS",
    "ArgumentError",
    "Camera",
    "Clip",
    "DataWarning",
    "DeniedFileError",
    "Error",
    "FileError",
    "Finding",
    "Format",
    "Hierarchy",
    "InputError",
    "KindError",
    "Leaves",
    "LimitError",
    "MissingFileError",
    "NothingToDrawError",
    "OutOfMemoryError",
    "OutputError",
    "Picture",
    "Report",
    "Scene",
    "TimeLimitError",
    "TransferError",
    "TransferFunction",
    "check",
    "convert",
    "formats",
    "info",
    "render",
]
