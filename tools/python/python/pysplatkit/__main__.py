"""Draws a file from the shell: `python -m pysplatkit render FILE -o out.png`.

It takes the files that splatkit reads, and those that PyVista, meshio, nibabel, xarray or trimesh
read, whichever is installed.
"""

from __future__ import annotations

import argparse
import sys
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from . import COLOR_MAPS, TRANSFER_FUNCTIONS, Error, InputError, Scene, _foreign


def _size(text: str) -> tuple[int, int]:
    width, height = text.lower().split("x")
    return int(width), int(height)


def _background(text: str) -> str | None:
    return None if text == "none" else text


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser("python -m pysplatkit", description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)
    render = commands.add_parser("render", help="draw files as one picture")
    add = render.add_argument
    add("files", nargs="+", type=Path, metavar="FILE", help="what to draw")
    add("-o", "--output", type=Path, required=True, help="the picture: a PNG file")
    add("--size", type=_size, default=(1280, 720), metavar="WxH", help="in pixels [1280x720]")
    add("--scalar", metavar="NAME", help="the array that has the values")
    add("--time", type=int, metavar="NUMBER", help="which of several times, from 0 [0]")
    add("--view", help="front, back, left, right, top, bottom or iso")
    add("--azimuth", type=float, metavar="DEGREES", help="turn the camera around the scene")
    add("--elevation", type=float, metavar="DEGREES", help="raise the camera")
    add("--zoom", type=float, metavar="FACTOR", help="how much larger the scene is drawn")
    add("--background", type=_background, default="black", help="a colour, or none [black]")
    names = ", ".join(TRANSFER_FUNCTIONS)
    add("--transfer", help=f"how values are shown: a JSON file, or {names}")
    add("--colormap", help="the colours of values: " + ", ".join(COLOR_MAPS))
    add("--color", help="the colour of surfaces")
    return parser


def _add(scene: Scene, path: Path, given: argparse.Namespace) -> None:
    """Adds a file to a scene, read by splatkit or by another package."""
    appearance = {name: getattr(given, name) for name in ("transfer", "colormap", "color")}
    appearance = {name: value for name, value in appearance.items() if value is not None}
    reading = {name: getattr(given, name) for name in ("scalar", "time")}
    reading = {name: value for name, value in reading.items() if value is not None}
    try:
        scene.add(path, **reading, **appearance)
        return
    except InputError:
        # Files that are not there have another error.
        if not _foreign.suited(path):
            raise
    package, objects, words = _foreign.read(path, given.time)
    for word in words:
        _say(f"{path}: {word}")
    _say(f"{path}: read by {package}")
    for item in objects:
        options: dict[str, Any] = dict(appearance)
        if given.scalar is not None:
            options["scalar"] = given.scalar
        scene.add(item, **options)


def _say(text: object) -> None:
    print(text, file=sys.stderr)


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command. Returns its exit status.

    Args:
        arguments: Its words. Default: those of the process.
    """
    given = _parser().parse_args(arguments)
    warnings.showwarning = lambda message, *_, **__: _say(f"warning: {message}")
    try:
        scene = Scene()
        for path in given.files:
            _add(scene, path, given)
        names = ("view", "azimuth", "elevation", "zoom")
        view = {name: getattr(given, name) for name in names}
        view = {name: value for name, value in view.items() if value is not None}
        picture = scene.render(given.size, background=given.background, **view)
        picture.save(given.output)
    except (Error, TypeError) as error:
        _say(f"error: {error}")
        return 3
    return 0


if __name__ == "__main__":
    sys.exit(main())
