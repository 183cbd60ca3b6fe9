"""Pictures by several processes: of one scene in regions, or of the frames of a film."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any, Self, Unpack

import numpy as np
import ray

from .. import _options, _pysplatkit
from .._camera import Camera, Clip
from .._errors import ArgumentError, NothingToDrawError
from .._options import Method, SourceOptions, View
from .._picture import Picture
from .._scene import Scene
from .._values import Color
from . import _composite, _rank, _regions
from ._composite import Window
from ._rank import Region, Report
from ._regions import Split, Tree
from ._results import get

#: The options of pictures. Ranks draw no texts.
_DRAWING = _options.DRAWING - _options.OVERLAY - {"background", "engine"}
#: The ways of drawing whose regions can be composited.
_COMPOSED = {"mode": "sheets", "optics": "light"}
#: The most ranks that send strips to all others; more swap halves, if their number is a power of 2.
_DIRECT = 8
#: An opacity that rounds to 0 in a file of 8 bits counts as none.
_LEAST_OPACITY = 0.5 / 255.0


class Renderer:
    """Draws a scene with several ranks, which are actors of Ray and keep the scene between
    pictures.

    >>> with pysplatkit.ray.Renderer("large.splv", ranks=4, memory=512 << 20) as renderer:
    ...     renderer.render((1920, 1080)).save("large.png")
    """

    def __init__(
        self,
        scene: Any,
        *,
        ranks: int | None = None,
        memory: int | None = None,
        cpus: int = 1,
        precision: str = "float32",
        actor_options: Mapping[str, Any] | None = None,
        **options: Unpack[SourceOptions],
    ) -> None:
        """Starts the ranks. Without `ray.init`, a local cluster is started.

        Args:
            scene: A file that all ranks can read, an array, or a function without arguments that
                returns a `Scene`, which each rank calls; or a `Scene`.
            ranks: Their number. Default: one for each node of the cluster.
            memory: Bytes that each rank may take for bricks, and for the pages of each hierarchy.
                Default: 1 GiB.
            cpus: Processors, and threads, of each rank.
            precision: float32 or float16: of the colours that ranks exchange.
            actor_options: Further options of Ray's actors, such as resources or a runtime_env.
            options: Those of `Scene.add`, for a file or an array.
        """
        if not ray.is_initialized():
            ray.init(include_dashboard=False)
        nodes = sum(node["Alive"] for node in ray.nodes())
        self._count = nodes if ranks is None else ranks
        if self._count < 1 or cpus < 1:
            raise ArgumentError("a renderer needs at least one rank with one processor")
        if precision not in ("float16", "float32"):
            raise ArgumentError(f"the precision is float16 or float32, not {precision!r}")
        if memory is not None and memory < 1:
            raise ArgumentError(f"the memory of a rank is {memory} bytes; it must be above 0")
        there = ray.cluster_resources().get("CPU", 0)
        if self._count * cpus > there:
            raise ArgumentError(
                f"{self._count} ranks with {cpus} processors each are more than the cluster has: "
                f"{there:g}"
            )
        self._memory = memory
        self._source = [ray.put(_maker(scene, options))]
        actor = _rank.Actor.options(num_cpus=cpus, **(actor_options or {}))
        self._ranks = [actor.remote(precision, cpus) for _ in range(self._count)]
        self._surveyed: tuple[Tree, list[Region]] | None = None

    @property
    def ranks(self) -> list[Any]:
        """The actors."""
        return list(self._ranks)

    def close(self) -> None:
        """Ends the ranks."""
        for rank in self._ranks:
            ray.kill(rank)
        self._ranks = []

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def camera(
        self,
        size: tuple[int, int] = (1280, 720),
        *,
        clips: Sequence[Clip] = (),
        **view: Unpack[View],
    ) -> Camera:
        """Returns the camera that sees the whole scene, as `Scene.camera` does.

        Args:
            size: Width and height of the picture in pixels.
            clips: Shapes that cut the scene.
            view: The other options of `Scene.camera`.
        """
        _options.checked(view, _options.VIEW, "camera")
        fit = {**view, "clips": clips}
        camera: Camera = get(self._first.camera.remote(self._source, size, fit))
        return camera

    def render(
        self,
        size: tuple[int, int] = (1280, 720),
        camera: Camera | None = None,
        *,
        background: Color | None = "black",
        **options: Unpack[Method],
    ) -> Picture:
        """Draws a picture: each rank its region of the scene, which are then composited.

        The options are those of `Scene.render`, and so is the picture. Its `statistics` also have
        the list `ranks`. The modes “axis-sheets” and “splats”, the optics “maximum” and “x-ray”,
        and a `budget` need the whole scene: `render_path` draws them.

        Args:
            size: Width and height in pixels.
            camera: Default: one that sees the whole scene.
            background: A colour; None for transparent pixels.
            options: The other options of `Scene.render`.
        """
        given = self._drawing(options, "render")
        for name, only in _COMPOSED.items():
            if given.get(name, only) != only:
                raise ArgumentError(
                    f"regions are composited with {name}={only!r} only, not {given[name]!r}; "
                    "render_path draws whole pictures"
                )
        if "budget" in given:
            raise ArgumentError("regions share no budget of splats; give a cut, in pixels")
        back = _options.background(background)
        is_fitted = camera is None
        if camera is None:
            camera = self.camera(size, clips=given.get("clips", ()))
        given["size"] = size
        tree, regions = self._division()
        reports, strips = self._drawn(regions, camera, given)
        whole = reports[0].size
        color, depth, sent = self._composited(tree, Window(camera, whole, (0, whole[1])), strips)
        if is_fitted and not (color[..., 3] >= _LEAST_OPACITY).any():
            raise NothingToDrawError("the picture is empty: nothing has opacity")
        about = (_statistics(reports, sent), camera.to_json())
        factor = whole[0] // size[0]
        pixels = (color.reshape(-1, 4), depth.ravel(), whole, factor, about)
        return Picture(_pysplatkit.Picture(*pixels), back)

    def render_path(
        self,
        cameras: Iterable[Camera],
        size: tuple[int, int] = (1280, 720),
        *,
        background: Color | None = "black",
        **options: Unpack[Method],
    ) -> Iterator[Picture]:
        """Draws the frames of a film, each by one rank with the whole scene, in their order.

        A rank that is done takes the next frame. At the end, idle ranks also draw the frames that
        others still draw, and the first result counts, so that a slow rank delays nothing.

        Args:
            cameras: One camera for each frame.
            size: Width and height in pixels.
            background: A colour; None for transparent pixels.
            options: The other options of `Scene.render`.
        """
        given = {**self._drawing(options, "render_path"), "size": size}
        back = _options.background(background)
        path = list(cameras)
        for number, (color, depth, statistics) in self._frames(path, given):
            about = (statistics, path[number].to_json())
            native = _pysplatkit.Picture(color.reshape(-1, 4), depth.ravel(), size, 1, about)
            yield Picture(native, back)

    @property
    def _first(self) -> Any:
        if not self._ranks:
            raise ArgumentError("the renderer is closed")
        return self._ranks[0]

    def _drawing(self, options: Mapping[str, Any], where: str) -> dict[str, Any]:
        given = _options.checked(options, _DRAWING, where)
        if self._memory is not None:
            given.setdefault("memory", self._memory)
        return given

    def _division(self) -> tuple[Tree, list[Region]]:
        if self._surveyed is None:
            bounds, weights = get(self._first.survey.remote(self._source))
            if bounds is None:
                raise NothingToDrawError("the scene is empty")
            tree, boxes = _regions.split(bounds, weights, self._count)
            inner = [_regions.common(box, bounds) for box in boxes]
            self._surveyed = tree, [Region(*pair) for pair in zip(boxes, inner, strict=True)]
        return self._surveyed

    def _drawn(
        self, regions: list[Region], camera: Camera, given: Mapping[str, Any]
    ) -> tuple[list[Report], list[list[Any]]]:
        """Draws all regions at the same level. Returns reports and references to strips."""
        strips = 2 if self._swaps else self._count
        level = 0.0
        while True:
            drawn = []
            for rank, whole in zip(self._ranks, regions, strict=True):
                region = Region(whole.box, whole.inner, level)
                draw = rank.draw.options(num_returns=strips + 1)
                drawn.append(draw.remote(self._source, region, camera, given, strips))
            reports: list[Report] = get([refs[0] for refs in drawn])
            levels = [report.statistics["level"] for report in reports]
            # A rank whose bricks do not fit into its memory has drawn a coarser level.
            if max(levels) == min(levels):
                return reports, [list(refs[1:]) for refs in drawn]
            level = max(levels)

    @property
    def _swaps(self) -> bool:
        return self._count > _DIRECT and self._count & (self._count - 1) == 0

    def _composited(
        self, tree: Tree, window: Window, strips: list[list[Any]]
    ) -> tuple[Any, Any, int]:
        """Returns colours, depths, and the bytes that ranks send while they composite."""
        if self._swaps:
            return self._swapped(tree, window, strips)
        order = _regions.order(tree, window.camera)
        refs = []
        for at, rows in enumerate(_rank.rows_of(window.size[1], self._count)):
            strip = Window(window.camera, window.size, rows)
            parts = [strips[number][at] for number in order]
            refs.append(self._ranks[at].composite.remote(strip, *parts))
        done = get(refs)
        sent = sum(color.nbytes + depth.nbytes for color, depth in done)
        return *_stacked(done), sent

    def _swapped(self, tree: Tree, window: Window, strips: list[list[Any]]) -> tuple[Any, Any, int]:
        """Binary swap: in each round, pairs of ranks exchange halves of their strips."""

        def swapped(branch: Tree) -> list[tuple[int, Window, list[Any]]]:
            if not isinstance(branch, Split):
                return [(branch, window, strips[branch])]
            sides = [swapped(branch.low), swapped(branch.high)]
            is_low_first = _regions.sees_low_first(branch, window.camera)
            done = []
            for pair in zip(*sides, strict=True):
                for half, (rank, rows, _) in enumerate(pair):
                    parts = [side[2][half] for side in pair]
                    near, far = parts if is_low_first else reversed(parts)
                    part = rows.halves()[half]
                    merge = self._ranks[rank].merge.options(num_returns=2)
                    done.append((rank, part, merge.remote(part, near, far)))
            return done

        rounds = swapped(tree)
        parts = get([ref for _, _, halves in rounds for ref in halves])
        sent = sum(part.bytes for part in parts)
        return *_stacked([_composite.over([part], window) for part in parts]), sent

    def _frames(self, path: list[Camera], given: Mapping[str, Any]) -> Iterator[tuple[int, Any]]:
        """Yields the frames in order, each with its number."""
        idle, waiting = list(self._ranks), list(range(len(path)))
        drawing: dict[Any, tuple[int, Any]] = {}
        done: dict[int, Any] = {}
        following = 0
        while following < len(path):
            while idle and (number := self._next(waiting, drawing, done, following)) is not None:
                rank = idle.pop()
                drawing[rank.frame.remote(self._source, path[number], given)] = (number, rank)
            ready, _ = ray.wait(list(drawing), num_returns=1)
            for ref in ready:
                number, rank = drawing.pop(ref)
                idle.append(rank)
                if number >= following and number not in done:
                    done[number] = get(ref)
            while following in done:
                yield following, done.pop(following)
                following += 1

    def _next(
        self, waiting: list[int], drawing: Mapping[Any, Any], done: Any, following: int
    ) -> int | None:
        """Returns the frame that an idle rank draws: the next, unless finished frames pile up; at
        the end, one that only one rank draws."""
        if waiting:
            return waiting.pop(0) if waiting[0] < following + 4 * self._count else None
        numbers = [number for number, _ in drawing.values()]
        candidates = [
            n for n in numbers if n >= following and n not in done and numbers.count(n) == 1
        ]
        return min(candidates, default=None)


def _maker(scene: Any, options: Mapping[str, Any]) -> Callable[[], Scene]:
    """Returns what makes the scene on a rank."""
    if isinstance(scene, Scene):
        kept = ray.put(scene)
        scene = lambda: ray.get(kept)
    if callable(scene):
        if options:
            raise ArgumentError(f"the options {list(options)} belong into the function")
        made: Callable[[], Scene] = scene
        return made
    known = frozenset(SourceOptions.__annotations__)
    given: Any = _options.checked(options, known, "Renderer")
    if isinstance(scene, (str, os.PathLike)):
        path = os.path.abspath(os.fspath(scene))
        return lambda: Scene().add(path, **given)
    # Ray keeps one copy on each node. Objects of other packages are taken apart there.
    shared = ray.put(np.asarray(scene) if isinstance(scene, (list, tuple)) else scene)
    return lambda: Scene().add(ray.get(shared), **given)


def _statistics(reports: list[Report], composited: int) -> str:
    """Returns the statistics of a picture."""
    total: dict[str, Any] = {}
    for name in reports[0].statistics:
        combine = max if name in ("level", "cut_pixels", "passes") else sum
        total[name] = combine(report.statistics[name] for report in reports)
    total["moved_bytes"] = composited + sum(report.sent for report in reports)
    total["ranks"] = [
        {
            **report.statistics,
            "seconds": report.seconds,
            "peak_memory": report.peak,
            "sent_bytes": report.sent,
        }
        for report in reports
    ]
    return json.dumps(total)


def _stacked(strips: list[tuple[Any, Any]]) -> tuple[Any, Any]:
    """Returns the colours and the depths of a picture from those of its strips."""
    colors, depths = zip(*strips, strict=True)
    return np.concatenate(colors), np.concatenate(depths)
