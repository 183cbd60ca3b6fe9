"""Conversion in parts: a plan, its parts as tasks, and their join."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Unpack

import ray

from .. import _options, _pysplatkit, _values
from .._errors import ArgumentError, Error, OutputError
from .._options import ColorMap, PathLike, Reading
from .._values import Color, Vector
from ._results import get

#: How often a part is made again if its worker dies.
_RETRIES = 5


def convert(
    inputs: PathLike | Sequence[PathLike],
    out: PathLike,
    *,
    parts: int | None = None,
    folder: PathLike | None = None,
    cpus: float = 1.0,
    overwrite: bool = False,
    preset: str = "balanced",
    lossless: bool = False,
    up: str | Vector | None = None,
    unit: str | None = None,
    radius_scale: float | None = None,
    memory: int | None = None,
    color: Color | None = None,
    colormap: ColorMap | None = None,
    range: tuple[float, float] | None = None,
    task_options: dict[str, Any] | None = None,
    **reading: Unpack[Reading],
) -> Path:
    """Converts files to one hierarchy, part by part on the whole cluster. Returns its path.

    The work is planned here, each part is a task of Ray, and the parts are joined here. All nodes
    need this package, and nothing beside it. If a worker dies, its part alone is made again. The
    file is that of one machine, byte for byte.

    Args:
        inputs: The files, which all nodes can read.
        out: The hierarchy, a .splk file.
        parts: The number of parts. Default: one for each region that fits in `memory`.
        folder: Where the plan and the parts are kept, on a file system that all nodes share. If it
            holds finished parts of the same plan, they are not made again. Default: a new folder
            beside `out`, which is removed at the end.
        cpus: Processors of each part.
        overwrite: Whether `out` is replaced if it exists.
        preset: Trade the time of building for quality: fastest, fast, balanced, slow or best.
        lossless: Keep every bit of the splats, at about eight times the size.
        up: Record this direction as up.
        unit: Record this unit of lengths.
        radius_scale: A factor on all radii.
        memory: Most bytes of memory of a part.
        color: What colours surfaces, as for `Scene.add`.
        colormap: The colours of values, as for `Scene.add`.
        range: The values that the colours are spread over.
        task_options: Further options of Ray's tasks, such as memory or resources.
        reading: How files are read: the options of reading of `Scene.add`.
    """
    several = [inputs] if isinstance(inputs, (str, os.PathLike)) else list(inputs)
    if not several:
        raise ArgumentError("a conversion needs at least one input")
    if parts is not None and parts < 1:
        raise ArgumentError(f"a conversion has at least one part, not {parts}")
    files = [os.path.abspath(os.fspath(file)) for file in several]
    to = Path(os.path.abspath(os.fspath(out)))
    if to.suffix.lower() != ".splk":
        raise ArgumentError(f"{to}: only hierarchies, .splk files, are made in parts")
    if to.exists() and not overwrite:
        raise OutputError(to, "cannot be written", None, "it exists already")
    conversion = {
        "preset": preset,
        "lossless": lossless,
        "up": _options.direction(up),
        "unit": unit,
        "radius_scale": radius_scale,
        "memory": memory,
        "parts": parts,
    }
    load = _options.reading(_options.checked(reading, _options.READING, "convert"))
    appearance = {"color": color, "colormap": colormap, "range": range}
    texts = (_values.text(conversion), load, _options.appearance(appearance))
    if not ray.is_initialized():
        ray.init(include_dashboard=False)
    given_folder = None if folder is None else Path(os.path.abspath(os.fspath(folder)))
    try:
        at = given_folder or Path(tempfile.mkdtemp(prefix=f".{to.name}-parts-", dir=to.parent))
    except OSError as error:
        raise OutputError(to, "cannot be written", error.errno, error.strerror or "") from error
    try:
        plan = at / "plan.json"
        count = _pysplatkit.plan_parts(files, os.fspath(at), *texts)
        # A plan may have fewer parts than were asked for: a part has at least one point.
        if parts is not None and count > parts:
            raise ArgumentError(f"{plan} has {count} parts, not {parts}; choose another folder")
        _make(plan, count, load, {"num_cpus": cpus, **(task_options or {})})
        _pysplatkit.join_parts(os.fspath(plan), os.fspath(to), overwrite)
        return to
    finally:
        if given_folder is None:
            shutil.rmtree(at, ignore_errors=True)


def _make(plan: Path, count: int, load: str, options: Mapping[str, Any]) -> None:
    """Makes the parts of a plan, each as a task."""
    make = ray.remote(max_retries=_RETRIES, **options)(_part)
    waiting = [make.remote(os.fspath(plan), index, load) for index in range(count)]
    while waiting:
        ready, waiting = ray.wait(waiting)
        try:
            get(ready)
        except Error:
            for ref in waiting:
                ray.cancel(ref)
            raise


def _part(plan: str, index: int, load: str) -> None:
    _pysplatkit.make_part(plan, index, load)
