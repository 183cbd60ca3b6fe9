"""What a rank does: an actor that keeps its scene between pictures."""

from __future__ import annotations

import os
import resource
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import ray

from .._camera import Camera
from .._picture import Picture
from .._scene import Scene
from . import _composite
from ._composite import Part, Window
from ._regions import Box

#: The reference to a function that returns the scene, in a list, so that Ray does not resolve it.
Source = list[Any]


@dataclass(frozen=True)
class Region:
    """The region of a rank in a picture."""

    #: The box in which it is drawn.
    box: Box
    #: Its part that holds something.
    inner: Box
    #: The finest level of volumes in bricks.
    level: float = 0.0


@dataclass
class Report:
    """What a rank says of a picture."""

    statistics: dict[str, Any]
    #: The size of the picture that was drawn; more than one pixel may become one.
    size: tuple[int, int]
    seconds: float
    #: The most memory that the process has taken so far, in bytes.
    peak: int
    #: The bytes of colours and depths that leave the rank.
    sent: int


class Rank:
    """A process that draws. Its scene is made when it is first needed, so that errors of reading
    are those of a call."""

    def __init__(self, precision: str, threads: int) -> None:
        os.environ["RAYON_NUM_THREADS"] = str(threads)
        self._made: Scene | None = None
        self._precision = precision

    def _scene(self, source: Source) -> Scene:
        if self._made is None:
            make: Callable[[], Scene] = ray.get(source[0])
            self._made = make()
        return self._made

    def pid(self) -> int:
        """Returns the number of the process."""
        return os.getpid()

    def memory(self) -> int:
        """Returns the most memory that the process has taken so far, in bytes."""
        return peak_memory()

    def survey(self, source: Source) -> tuple[Any, Any]:
        """Returns the scene's bounds, and where work lies: rows of x, y, z and a weight."""
        scene = self._scene(source)
        return scene.bounds, scene._native.weights().reshape(-1, 4)

    def camera(self, source: Source, size: tuple[int, int], view: Mapping[str, Any]) -> Camera:
        """Returns the camera that sees the whole scene."""
        return self._scene(source).camera(size, **view)

    def draw(
        self,
        source: Source,
        region: Region,
        camera: Camera,
        options: Mapping[str, Any],
        strips: int,
    ) -> tuple[Any, ...]:
        """Draws a region. Returns a report and strips of rows, from the top."""
        scene = self._scene(source)
        start = time.perf_counter()
        part = {"box": region.box, "level": region.level}
        drawn = scene._pixels(camera, {**options, "region": part, "keep_samples": True})
        picture = Picture(drawn, None)
        color, depth = picture.color, picture.depth
        parts = [
            _composite.cropped(color[first:end], depth[first:end], region.inner, self._precision)
            for first, end in rows_of(len(color), strips)
        ]
        report = Report(
            statistics=picture.statistics,
            size=picture.size,
            seconds=time.perf_counter() - start,
            peak=peak_memory(),
            sent=sum(part.bytes for part in parts),
        )
        return (report, *parts)

    def composite(self, window: Window, *parts: Part) -> tuple[Any, Any]:
        """Composites a strip of several regions, the nearest first."""
        return _composite.over(parts, window)

    def merge(self, window: Window, near: Part, far: Part) -> tuple[Part, ...]:
        """Composites a strip of two regions, and returns its halves."""
        color, depth = _composite.over([near, far], window)
        low, high = (np.array([near.box[at], far.box[at]]) for at in (0, 1))
        box = (tuple(low.min(axis=0).tolist()), tuple(high.max(axis=0).tolist()))
        middle = len(color) // 2
        halves = ((color[:middle], depth[:middle]), (color[middle:], depth[middle:]))
        return tuple(_composite.cropped(*half, box, self._precision) for half in halves)

    def frame(
        self, source: Source, camera: Camera, options: Mapping[str, Any]
    ) -> tuple[Any, Any, str]:
        """Draws a whole picture. Returns colours, depths and statistics."""
        native = self._scene(source)._pixels(camera, options)
        picture = Picture(native, None)
        return picture.color, picture.depth, native.statistics


def rows_of(height: int, strips: int) -> list[tuple[int, int]]:
    """Divides rows into strips: the first row of each, and the row after its last."""
    ends = [height * at // strips for at in range(strips + 1)]
    return list(pairwise(ends))


def peak_memory() -> int:
    """Returns the most memory that this process has taken, in bytes."""
    most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return most if sys.platform == "darwin" else most * 1024


#: Restarted if it dies, a few times; what it was doing is done again.
Actor: Any = ray.remote(max_restarts=3, max_task_retries=3)(Rank)
