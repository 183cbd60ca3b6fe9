"""Files: what they hold, whether they are sound, and conversions."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple, Unpack

import numpy as np
import numpy.typing as npt

from . import _options, _pysplatkit, _values
from ._options import ColorMap, PathLike, Reading
from ._values import Color, Vector


def info(path: PathLike, **reading: Unpack[Reading]) -> dict[str, Any]:
    """Returns what a file holds: kind, count, bounds, range of values, arrays, …: the facts of
    `splatkit info --json`.

    Args:
        path: The file, or a folder of DICOM slices.
        reading: How the file is read: the options of reading of `Scene.add`.
    """
    given = _options.checked(reading, _options.READING, "info")
    return dict(json.loads(_pysplatkit.info(os.fspath(path), _options.reading(given))))


class Finding(NamedTuple):
    """Something that `check` has found."""

    #: The name of this kind of finding, the same in every release.
    code: str
    #: “warning” if pictures are right all the same, otherwise “error”.
    severity: str
    #: The place in the file.
    where: str
    #: What was found and what was expected.
    message: str


@dataclass(frozen=True)
class Report:
    """What `check` returns. It is true if the file is sound."""

    #: Whether there is no error.
    ok: bool
    #: All findings.
    findings: list[Finding]

    def __bool__(self) -> bool:
        return self.ok


def check(path: PathLike, **reading: Unpack[Reading]) -> Report:
    """Checks a file: every checksum and guarantee of hierarchies and bricks, oddities of others.

    Args:
        path: The file.
        reading: How the file is read: the options of reading of `Scene.add`.
    """
    given = _options.checked(reading, _options.READING, "check")
    report = json.loads(_pysplatkit.check(os.fspath(path), _options.reading(given)))
    return Report(report["ok"], [Finding(**finding) for finding in report["findings"]])


class Format(NamedTuple):
    """A format of files."""

    name: str
    #: The extensions of files that are read.
    extensions: list[str]
    #: The extension of files that are written; None if none are.
    written: str | None


def formats() -> list[Format]:
    """Returns the formats that are read."""
    return [Format(*fields) for fields in _pysplatkit.known_formats()]


def convert(
    files: PathLike | Sequence[PathLike],
    output: PathLike,
    *,
    overwrite: bool = False,
    preset: str = "balanced",
    lossless: bool = False,
    up: Vector | None = None,
    unit: str | None = None,
    degree: int | None = None,
    spz_version: int | None = None,
    radius_scale: float | None = None,
    lattice: str | None = None,
    memory: int | None = None,
    color: Color | None = None,
    colormap: ColorMap | None = None,
    range: tuple[float, float] | None = None,
    edits: Sequence[tuple[str, object]] = (),
    **reading: Unpack[Reading],
) -> Path:
    """Converts files as `splatkit convert` does. Returns the path of the output.

    Meshes, point clouds, hierarchies and trained Gaussians become .splk, a hierarchy of splats with
    levels of detail, or Gaussians for other viewers: .ply, .compressed.ply, .splat, .spz, .sog,
    meta.json with its planes beside it, or .glb. Meshes and point clouds become points with
    attributes, .las, .laz or .points.ply, or with colours and intensities, .e57. A volume becomes
    .splv, levels of bricks, or .nrrd.

    Args:
        files: A file, or several.
        output: The file to write. Its extension says what the files become.
        overwrite: Replace an existing file.
        preset: Trade the time of building a hierarchy for its quality: fastest, fast, balanced,
            slow or best.
        lossless: Keep every bit of the splats, at about eight times the size.
        up: Record this direction as up.
        unit: Record this unit of lengths.
        degree: Keep the colours of trained Gaussians up to this degree.
        spz_version: Write this version of SPZ, 3 (the default) or 4.
        radius_scale: A factor on all radii.
        lattice: bcc resamples a volume on the body-centred cubic lattice.
        memory: Most bytes of memory. Scans that need more are converted region by region.
        color: What colours surfaces, as for `Scene.add`.
        colormap: The colours of values, as for `Scene.add`.
        range: The values that the colours are spread over.
        edits: What is changed on the way, in this order: names of the command's flags with their
            values, such as ("where", "classification == 2"), ("thin", 0.5),
            ("translate", (1, 2, 3)), ("reproject", "EPSG:25832 to EPSG:4326") or
            ("remove-floaters", "").
        reading: How files are read: the options of reading of `Scene.add`.
    """
    given = _options.checked(reading, _options.READING, "convert")
    several = [files] if isinstance(files, (str, os.PathLike)) else files
    paths = [os.fspath(path) for path in several]
    conversion = {
        "overwrite": overwrite,
        "preset": preset,
        "lossless": lossless,
        "up": _options.direction(up),
        "unit": unit,
        "degree": degree,
        "spz_version": spz_version,
        "radius_scale": radius_scale,
        "lattice": lattice,
        "memory": memory,
        "edits": [(name, _options.edit(value)) for name, value in edits],
    }
    appearance = {"color": color, "colormap": colormap, "range": range}
    _pysplatkit.convert(
        paths,
        os.fspath(output),
        _values.text(conversion),
        _options.reading(given),
        _options.appearance(appearance),
    )
    return Path(output)


class Leaves(NamedTuple):
    """The splats of the finest level of a hierarchy."""

    #: World positions, (n, 3).
    positions: npt.NDArray[np.float64]
    #: Covariances in squared world units, (n, 3, 3).
    covariances: npt.NDArray[np.float32]
    #: Optical depths through the centres, (n,).
    optical_depths: npt.NDArray[np.float32]
    #: Red, green, blue and opacity, (n, 4) bytes.
    colors: npt.NDArray[np.uint8]
    #: Unit normals, (n, 3); NaN where there is none.
    normals: npt.NDArray[np.float32]


class Hierarchy:
    """An open hierarchy (.splk) of a `path`. Only its directory is read; `leaves` reads the rest.

    Its facts are attributes: splats, nodes, points, pages, closed, lossless, degree, has_color,
    has_normals, up, is_guessed, unit, source, origin and bounds.
    """

    splats: int
    nodes: int
    points: int
    pages: int
    closed: bool
    lossless: bool
    degree: int | None
    has_color: bool
    has_normals: bool
    up: list[float] | None
    is_guessed: bool
    unit: str
    source: str
    origin: list[float]
    bounds: list[list[float]]

    def __init__(self, path: PathLike) -> None:
        self.path = Path(os.fspath(path))
        self._native = _pysplatkit.Hierarchy(os.fspath(path), "{}")
        self.__dict__.update(json.loads(self._native.header))

    def leaves(self) -> Leaves:
        """Reads the splats of the finest level into memory."""
        positions, factors, depths, colors, normals = self._native.leaves()
        lower = np.zeros((len(depths), 3, 3), np.float32)
        # The entries of the lower triangle, row by row.
        lower[:, [0, 1, 1, 2, 2, 2], [0, 0, 1, 0, 1, 2]] = factors.reshape(-1, 6)
        return Leaves(
            positions.reshape(-1, 3),
            lower @ lower.transpose(0, 2, 1),
            depths,
            colors.reshape(-1, 4),
            normals.reshape(-1, 3),
        )

    def __len__(self) -> int:
        return self.splats

    def __repr__(self) -> str:
        return f"<pysplatkit.Hierarchy {str(self.path)!r}: {self.splats} splats>"
