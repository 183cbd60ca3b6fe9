"""Pictures of NumPy arrays and of files, drawn as elliptic splats, without GPU or display.

>>> import pysplatkit
>>> pysplatkit.render("skull.nrrd").save("skull.png")

A `Scene` holds several items, and is drawn from any side:

>>> scene = pysplatkit.Scene().add_volume(array, spacing=(0.7, 0.7, 1.25)).add("implant.stl")
>>> picture = scene.render((800, 600), scene.camera((800, 600), view="left"))
>>> picture.rgba.shape
(600, 800, 4)
"""

from __future__ import annotations

import atexit
import os
from pathlib import Path
from typing import Any

from . import _pysplatkit
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
from ._picture import Picture
from ._scene import DRAWING, Scene
from ._transfer import TransferFunction

__version__: str = _pysplatkit.__version__

#: The names of transfer functions.
TRANSFER_FUNCTIONS: tuple[str, ...] = tuple(_pysplatkit.TRANSFER_FUNCTIONS)
#: The names of colour maps. Each may end with `_r`, which reverses it.
COLOR_MAPS: tuple[str, ...] = tuple(_pysplatkit.COLOR_MAPS)


def render(source: Any, **options: Any) -> Picture:
    """Draws a file or an array: a volume [z, y, x], or points (n, 3).

    The options are those of `Scene.add` and of `Scene.render`. A scene file is drawn as it says;
    then the options are those of `Scene.render`.
    """
    drawing = {name: options.pop(name) for name in list(options) if name in DRAWING}
    # The `meta.json` of trained Gaussians (SOG) is no scene.
    if isinstance(source, (str, os.PathLike)):
        path = Path(source)
        if path.suffix == ".json" and path.name != "meta.json" and not options:
            return Scene.open(path).render(**drawing)
    return Scene().add(source, **options).render(**drawing)


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
