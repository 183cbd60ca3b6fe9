"""Options that several functions share, and how they are passed to the compiled half."""

from __future__ import annotations

import difflib
import os
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Protocol, TypedDict, Union

import numpy as np

from ._camera import Clip
from ._errors import ArgumentError, KindError
from ._transfer import TransferFunction
from ._values import Color, Vector, color, hex_color, text, vector

#: A path of a file or folder.
PathLike = Union[str, "os.PathLike[str]"]


class MatplotlibMap(Protocol):
    """A colour map of matplotlib, or any other that returns colours for numbers from 0 to 1."""

    @property
    def N(self) -> int: ...  # noqa: N802 (matplotlib's name)

    def __call__(self, X: Any, /) -> Any: ...  # noqa: N803


#: A colour map: a name of `pysplatkit.COLOR_MAPS`, with `_r` at its end reversed; colours at even
#: distances; or a Colormap of matplotlib.
ColorMap = str | Sequence[Color] | MatplotlibMap


class FieldAppearance(TypedDict, total=False):
    """How values are shown: those of volumes, samples and cells."""

    #: A `TransferFunction`, the name of one, a JSON file or its text. Default: made for the values.
    transfer: TransferFunction | PathLike
    #: Spread the transfer function or the colour map over these values.
    range: tuple[float, float]
    #: The channels of a file that are drawn: names or numbers, or dicts with channel, color, range and opacity.
    channels: Sequence[int | str | Mapping[str, Any]]
    #: The length that opacities hold for, in world units.
    opacity_unit: float
    #: Values of surfaces: a number, or a list of numbers, or of (value, colour, opacity) with None for the usual colour.
    isosurfaces: float | Sequence[float | tuple[float, Color | None, float]]
    #: Factors on the opacity by the magnitude of the gradient: (magnitude, factor), ….
    gradient_opacity: Sequence[tuple[float, float]]
    #: Colour values by this map: a name of `pysplatkit.COLOR_MAPS` (`_r` at its end reverses it), a
    #: list of colours, or a Colormap of matplotlib.
    colormap: ColorMap
    #: Spread the colour map over the logarithms of the values.
    log_colors: bool


class KernelAppearance(TypedDict, total=False):
    """How a volume is reconstructed from its samples. Lengths are in samples."""

    #: gaussian, b-spline, hann, linear, catmull-rom, cubic-b-spline, or values from 0 to extent.
    kernel: str | Sequence[float]
    #: The standard deviation of the Gaussian. Default: 0.6.
    sigma: float
    #: The radius of a footprint.
    extent: float
    #: Pass through the samples instead of smoothing them.
    sharp: bool


class SurfaceAppearance(TypedDict, total=False):
    """How meshes and point clouds are shown."""

    #: file, values, height, normal, an attribute of the file, or a colour.
    color: Color
    #: Colour values by this map, as for volumes. Default: viridis.
    colormap: ColorMap
    #: Spread the colour map over these values.
    range: tuple[float, float]
    #: Spread the colour map over the logarithms of the values.
    log_colors: bool
    #: The colour of what has no value.
    nan_color: Color
    #: The share of the light that a surface absorbs, above 0, up to 1.
    opacity: float
    #: A factor on the radii of surfels.
    radius_scale: float
    #: Split normals where two triangles meet at more than this angle, in degrees. Default: 60.
    crease: float
    #: Draw the edges of triangles as thin dark lines.
    edges: bool
    #: auto, surfels, spheres or dots. Default: auto, which draws points on surfaces as surfels, and
    #: others as spheres.
    points: str
    #: The diameter of spheres and dots: a number of world units, or pixels, as "3px".
    point_size: float | str
    #: The attribute of the file that holds the radii of points, in world units.
    point_radius: str
    #: The width of lines: a number of world units, or pixels, as "3px". Default: "3px".
    line_width: float | str
    #: Files: arrows for the vectors, or ellipsoids for the tensors, of an array of points, instead
    #: of the input: "arrows", "ellipsoids" or "arrows:velocity".
    glyphs: str
    #: A factor on the size of glyphs.
    glyph_scale: float


class CellAppearance(FieldAppearance, total=False):
    """How cells are shown."""

    #: values, height, normal, or a colour. Default: values.
    color: Color
    #: The colour of what has no value.
    nan_color: Color
    #: The share of the light that the boundary absorbs, above 0, up to 1.
    opacity: float
    #: Split normals where two sides meet at more than this angle, in degrees. Default: 45.
    crease: float


class VolumeAppearance(FieldAppearance, KernelAppearance):
    """How a volume is shown."""


class Reading(TypedDict, total=False):
    """How files are read."""

    #: The array, property or column that has the values.
    scalar: str
    #: Raw volumes: the number of samples along x, y and z.
    dims: tuple[int, int, int]
    #: Raw volumes: u8, i8, u16, i16, u32, i32, u64, i64, f32 or f64.
    sample_type: str
    #: Raw volumes: little or big.
    endian: str
    #: Raw volumes: bytes before the first sample.
    header: int
    #: Volumes at several times: which one, from 0.
    time: int
    #: DICOM: the series to read: its number, UID or a part of its description.
    series: str | int
    #: HDF5 and NPZ: the data set to read.
    dataset: str
    #: Volumes: the distances between samples along x, y and z, instead of the file's.
    spacing: float | Vector
    #: A value that stands for “no value”.
    missing: float
    #: Volumes: what measured the values, whatever the file says: ct, mr, emission, ultrasound or
    #: microscopy.
    modality: str
    #: Volumes: the array of the file that says how opaque the samples are; of arrays, an array.
    opacity_from: Any
    #: Label maps: a table with names and colours, of ITK-SNAP, FreeSurfer, 3D Slicer or with columns.
    labels: str
    #: Scattered samples: one radius for all, in world units.
    radius: float
    #: Scattered samples: the number of neighbours that kernels are made from, 4 to 64.
    neighbours: int
    #: Scattered samples: whether samples carry slopes.
    slopes: bool
    #: Most of points, bytes, depth, texels, seconds that a file may take.
    limits: Mapping[str, int]


class FileOptions(VolumeAppearance, SurfaceAppearance, Reading, total=False):
    """How a file is read and shown."""

    #: What is changed before it is drawn, as for `convert`, once it is moved: ("where", "z > 0"),
    #: ("thin", "10%"), … For meshes, point clouds and trained Gaussians.
    edits: Sequence[tuple[str, object]]
    #: Cells: solid, an opaque body with the field inside where clips cut it, or volume, the field
    #: by a transfer function. Default: solid, unless another option is one of fields.
    cells: str


class SourceOptions(FileOptions, total=False):
    """How a file, an array or an object is read and shown: what `Scene.add` takes."""

    #: Volumes of arrays: the world position of the first sample.
    origin: Vector
    #: Volumes of arrays: whether the array is copied.
    copy: bool
    #: Volumes of arrays: the axis of an array of four that has channels.
    channel_axis: int
    #: Volumes of arrays: the names of the channels.
    channel_names: Sequence[str]
    #: Arrays: the world direction that is up.
    up: str | Vector
    #: Points and meshes of arrays: a colour for each.
    colors: Any
    #: Points and meshes of arrays: a number for each.
    values: Any
    #: Points and meshes of arrays: a normal for each.
    normals: Any


class View(TypedDict, total=False):
    """How a camera is fitted to a scene."""

    #: front, back, left, right, top, bottom or iso.
    view: str
    #: Degrees to the right, about the up axis.
    azimuth: float
    #: Degrees upwards.
    elevation: float
    #: A factor on the size of what is seen.
    zoom: float
    #: The point that the camera aims at.
    focal_point: Vector
    #: The direction that is up in the picture.
    view_up: str | Vector
    #: The vertical angle of view in degrees.
    view_angle: float
    #: The distance of the camera from its focal point, in world units.
    distance: float
    #: Whether to draw without perspective.
    orthographic: bool
    #: The direction that is up in the scene.
    up: str | Vector


class Method(TypedDict, total=False):
    """How a picture is drawn over any background."""

    #: Pixels that are drawn for each pixel and averaged: 1, 4, 9, 16, 64 or auto.
    samples: int | str
    #: sheets, axis-sheets or splats.
    mode: str
    #: Whether single splats are composited from back to front.
    back_to_front: bool
    #: pre-integrated, post or pre.
    classify: str
    #: light, maximum or x-ray.
    optics: str
    #: False draws without light, True lights volumes in any case.
    shade: bool
    #: soft, head, key, studio or sky.
    light: str
    #: Whether the lamp of the light key or studio casts shadows.
    shadows: bool
    #: How far light is dimmed where things around a place keep it away, from 0 to 1.
    ambient_occlusion: float
    #: How far pixels beside nearer ones are dimmed, about 1.
    eye_dome: float
    #: The width of lines around what stands in front of something farther away, in pixels.
    outline: float
    #: Their colour.
    outline_color: Color
    #: Shapes that cut the scene.
    clips: Sequence[Clip]
    #: How gradients are made.
    gradient: str
    #: Where fields are evaluated.
    evaluate: str
    #: The thickness of sheets, in world units.
    sheet_thickness: float
    #: The width of the splats of hierarchies, in pixels.
    cut: float
    #: About how many splats of hierarchies are drawn.
    budget: int
    #: Most bytes of memory for what is read from files as it is drawn.
    memory: int
    #: Whether faces that look away are left out.
    cull_backfaces: bool
    #: Whether what is hidden is left out early.
    occlusion: bool
    #: cpu, gpu or auto.
    engine: str
    #: Whether the colours of values are drawn, with their numbers.
    scalar_bar: bool
    #: Whether the directions of the axes are drawn.
    axes: bool
    #: Whether a round length is drawn.
    scale_bar: bool
    #: A text above the picture's content.
    caption: str


class Page(TypedDict, total=False):
    """How large a picture is on paper, and what it shows beside each other."""

    #: The width on paper, such as "85mm", instead of a size. Needs dpi.
    width: str
    #: The height on paper.
    height: str
    #: Pixels an inch, which set the height of texts, and which files store.
    dpi: float
    #: Sides that the picture shows beside each other: front, back, left, right, top, bottom, iso.
    views: Sequence[str]
    #: The number of views in a row.
    columns: int
    #: What the corner of each view says: names, letters or none.
    panel_labels: str


class Drawing(Method, total=False):
    """How a picture is drawn: the options of `Scene.render`, but its size and its camera."""

    #: A colour; None for transparent pixels.
    background: Color | None


class Framed(Drawing, View, total=False):
    """How a picture is drawn, and how its camera is fitted."""


class Saved(Framed, Page, total=False):
    """What a scene file says of its picture."""


class RenderOptions(SourceOptions, Page, total=False):
    """What `pysplatkit.render` takes beside its named arguments."""

    #: Layers that are also drawn: normals, albedo, identifiers.
    layers: Sequence[str]

    focal_point: Vector
    view_up: str | Vector
    view_angle: float
    distance: float
    mode: str
    back_to_front: bool
    classify: str
    optics: str
    shade: bool
    light: str
    shadows: bool
    ambient_occlusion: float
    eye_dome: float
    outline: float
    outline_color: Color
    gradient: str
    evaluate: str
    sheet_thickness: float
    cut: float
    budget: int
    memory: int
    cull_backfaces: bool
    occlusion: bool


VIEW = frozenset(View.__annotations__)
#: The options of texts over a picture.
OVERLAY = frozenset({"scalar_bar", "axes", "scale_bar", "caption"})
#: The options of the page of a picture.
PAGE = frozenset(Page.__annotations__)
DRAWING = frozenset(Drawing.__annotations__)
FIELD = frozenset(FieldAppearance.__annotations__)
VOLUME = frozenset(VolumeAppearance.__annotations__)
SURFACE = frozenset(SurfaceAppearance.__annotations__)
#: `cells` is called `style` where cells are an argument.
CELLS = frozenset(CellAppearance.__annotations__) | {"cells"}
READING = frozenset(Reading.__annotations__)


def checked(given: Mapping[str, Any], known: frozenset[str], where: str) -> dict[str, Any]:
    """Returns the options that are given. An unknown one is a `KindError`, which is a `TypeError`
    as in any call."""
    for name in given:
        if name not in known:
            near = difflib.get_close_matches(name, known, 1)
            hint = f"; did you mean {near[0]!r}?" if near else ""
            raise KindError(f"{where}() got an unexpected keyword argument {name!r}{hint}")
    return {name: value for name, value in given.items() if value is not None}


def background(value: Color | None) -> list[float] | None:
    """Returns the colour behind a picture; None for transparency."""
    if value is None or (isinstance(value, str) and value.strip().lower() == "none"):
        return None
    return color(value)


def matrix(value: Any) -> list[list[float]]:
    """Returns the rows of a matrix of 4 × 4."""
    try:
        rows = np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        rows = np.zeros(0)
    if rows.shape != (4, 4):
        raise ArgumentError(f"matrix has 4 × 4 numbers, not the shape {rows.shape}")
    return [list(map(float, row)) for row in rows]


def direction(value: str | Vector | None) -> list[float] | None:
    """Returns three numbers of a direction, which may be an axis such as “+Y”; None for none."""
    if not isinstance(value, str):
        return None if value is None else vector(value)
    if "," in value:
        return vector(value.split(","))
    sign, name = (-1.0, value[1:]) if value.startswith("-") else (1.0, value.removeprefix("+"))
    if name.upper() not in ("X", "Y", "Z"):
        form = "an axis is one of +X, -X, +Y, -Y, +Z, -Z, and a direction is three numbers"
        raise ArgumentError(f"{form}, not {value!r}")
    return [sign if axis == name.upper() else 0.0 for axis in "XYZ"]


def plain_appearance(options: Mapping[str, Any]) -> dict[str, Any]:
    """Returns how an item looks, in plain data that nothing else changes."""
    given = {name: options[name] for name in options if name in VOLUME | SURFACE | CELLS}
    transfer = given.get("transfer")
    if transfer is not None:
        given["transfer"] = TransferFunction.of(transfer)
    if given.get("isosurfaces") is not None:
        value = given["isosurfaces"]
        surfaces = [value] if isinstance(value, (int, float, np.number)) else value
        given["isosurfaces"] = [_surface(surface) for surface in surfaces]
    if given.get("channels") is not None:
        value = given["channels"]
        channels = [value] if isinstance(value, (int, str, Mapping)) else value
        given["channels"] = [_channel(channel) for channel in channels]
    if given.get("colormap") is not None:
        given["colormap"] = colormap(given["colormap"])
    if given.get("nan_color") is not None:
        given["nan_color"] = color(given["nan_color"])
    given_color = given.get("color")
    if given_color is not None and not isinstance(given_color, str):
        given["color"] = hex_color(given_color)
    return given


def appearance(options: Mapping[str, Any]) -> str:
    """Returns how an item looks, as JSON."""
    return text(plain_appearance(options))


def colormap(value: Any) -> str:
    """Returns a colour map as the compiled half takes it: a name, or colours with commas between.

    A map of matplotlib is known by what it does; the package is not imported.
    """
    if isinstance(value, str):
        return value
    if callable(value) and hasattr(value, "N"):
        value = np.asarray(value(np.linspace(0.0, 1.0, 256)))[:, :3].clip(0.0, 1.0)
    try:
        return ",".join(hex_color(part) for part in value)
    except TypeError:
        form = "a colour map is a name, a list of colours, or a Colormap of matplotlib"
        raise KindError(f"{form}, not {value!r}") from None


def _surface(value: Any) -> dict[str, Any]:
    if isinstance(value, (int, float, np.number)):
        return {"value": float(value), "color": None, "opacity": 1.0}
    if isinstance(value, Mapping):
        return dict(value)
    try:
        value, tone, *rest = value
        opacity = float(rest[0]) if rest else 1.0
        return {"value": float(value), "color": tone and color(tone), "opacity": opacity}
    except (TypeError, ValueError) as error:
        form = "an isosurface is a value, or (value, colour, opacity)"
        raise ArgumentError(f"{form}, not {value!r}") from error


def _channel(value: Any) -> dict[str, Any]:
    if isinstance(value, (int, str, np.integer)):
        return {"channel": value if isinstance(value, str) else int(value)}
    if not isinstance(value, Mapping) or "channel" not in value:
        form = "a channel is a name, a number, or a dict with channel, color, range and opacity"
        raise ArgumentError(f"{form}, not {value!r}")
    channel = dict(value)
    if channel.get("color") is not None:
        channel["color"] = color(channel["color"])
    if channel.get("range") is not None:
        channel["range"] = [float(end) for end in channel["range"]]
    return channel


def reading(options: Mapping[str, Any]) -> str:
    """Returns how a file is read, as JSON."""
    given = {name: options[name] for name in options if name in READING}
    if "sample_type" in given:
        given["type"] = given.pop("sample_type")
    if given.get("series") is not None:
        given["series"] = str(given["series"])
    if given.get("spacing") is not None:
        given["spacing"] = vector(given["spacing"])
    return text(given)


def edit(value: object) -> str:
    """Returns the value of an edit as the command's flag has it."""
    if isinstance(value, str):
        return value
    if isinstance(value, Iterable):
        return ",".join(str(float(part)) for part in value)
    return str(value)


def edits(given: Iterable[tuple[str, object] | str]) -> list[str]:
    """Returns edits as a scene file has them: names and values with colons between them."""
    named = (one if isinstance(one, str) else f"{one[0]}:{edit(one[1])}" for one in given)
    return [text.removesuffix(":") for text in named]


def fit(**given: Any) -> str:
    """Returns how a camera is fitted to a scene, as JSON."""
    if given.get("focal_point") is not None:
        given["focal_point"] = vector(given["focal_point"])
    for name in ("view_up", "up"):
        given[name] = direction(given.get(name))
    return text(given)


def drawn(
    size: tuple[int, ...] | None = None,
    clips: Sequence[Clip | dict[str, Any]] | None = (),
    **draw: Any,
) -> str:
    """Returns how a picture is drawn, as JSON."""
    if draw.get("engine") not in (None, "cpu", "gpu", "auto"):
        raise ArgumentError(f"engine is cpu, gpu or auto, not {draw['engine']!r}")
    entries = [clip._entry() if isinstance(clip, Clip) else clip for clip in clips or ()]
    overlay = {name: draw.pop(name) for name in OVERLAY & draw.keys()}
    overlay = {name: value for name, value in overlay.items() if value is not None}
    return text({**draw, "size": size, "clips": entries, "overlay": overlay or None})
