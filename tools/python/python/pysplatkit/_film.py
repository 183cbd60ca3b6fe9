"""Films: frames of a moving camera in one file, or as numbered pictures."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import _options, _pysplatkit
from ._camera import Camera
from ._errors import ArgumentError, OutputError
from ._options import PathLike

if TYPE_CHECKING:
    from ._scene import Scene

#: The extensions of numbered pictures.
_PICTURES = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".exr")


def along(keyframes: PathLike | Iterable[tuple[float, Camera]], fps: float) -> list[Camera]:
    """Returns the cameras of the frames of a way through keyframes."""
    if isinstance(keyframes, (str, os.PathLike)):
        text = Path(keyframes).read_text(encoding="utf-8")
    else:
        stops = [
            {"time": float(time), "camera": json.loads(camera.to_json())}
            for time, camera in keyframes
        ]
        text = json.dumps({"splatkit_path": 1, "keyframes": stops})
    return [Camera.from_json(camera) for camera in _pysplatkit.path_cameras(text, _rate(fps))]


def write(
    scene: Scene,
    path: PathLike,
    cameras: Sequence[Camera],
    fps: float,
    size: tuple[int, ...],
    options: Mapping[str, Any],
    overwrite: bool,
) -> Path:
    """Draws a frame for each camera, and writes them."""
    if not cameras:
        raise ArgumentError("a film has at least one frame")
    to = Path(path)
    if os.fspath(path).endswith(("/", os.sep)) or to.is_dir():
        to.mkdir(parents=True, exist_ok=True)
        to = to / "{frame:04}.png"
    given = {**options, "size": size}
    if to.suffix.lower() in _PICTURES:
        files = [_numbered(to, number) for number in range(len(cameras))]
        for file in files:
            _check(file, overwrite)
        for file, camera in zip(files, cameras, strict=True):
            scene._picture(camera, given).save(file)
        return Path(path)
    _check(to, overwrite)
    said = scene._described.get("picture", {}).get("background", "black")
    behind = _options.background(options.get("background", said))
    film = _pysplatkit.Film(os.fspath(to), size, len(cameras), _rate(fps), behind)
    for camera in cameras:
        film.add(scene._picture(camera, given)._native)
    film.finish()
    return to


def _rate(fps: float) -> float:
    if not 0.1 <= fps <= 1000:
        raise ArgumentError(f"fps is a number of frames per second from 0.1 to 1000, not {fps}")
    return float(fps)


def _check(file: Path, overwrite: bool) -> None:
    if not overwrite and (file.exists() or file.is_symlink()):
        raise OutputError(file, "cannot be written", None, "it exists already")


def _numbered(path: Path, frame: int) -> Path:
    """Returns the name of a numbered picture."""
    if "{frame" not in path.name:
        return path.with_name(f"{path.stem}_{frame:04}{path.suffix}")
    try:
        return path.with_name(path.name.format(frame=frame))
    except (KeyError, IndexError, ValueError) as error:
        raise ArgumentError(f"{path}: the placeholder must be {{frame}} or {{frame:04}}") from error
