"""Scenes."""

from __future__ import annotations

import inspect
import json
import os
import warnings
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np

from . import _arrays, _neighbours, _options, _pysplatkit
from ._camera import Camera, Clip
from ._errors import ArgumentError, DataWarning, KindError
from ._options import (
    CellAppearance,
    Color,
    FieldAppearance,
    FileOptions,
    SurfaceAppearance,
    Vector,
    VolumeAppearance,
)
from ._picture import Picture

if TYPE_CHECKING:
    from ._widget import Widget


class Scene:
    """What is drawn together in one picture. Methods that add return the scene.

    >>> Scene().add("skull.nrrd").add("knee.stl", color="ivory").render().save("both.png")

    World coordinates are x, y, z, in any unit. A scene may be drawn by several threads at once.
    """

    def __init__(self) -> None:
        self._native = _pysplatkit.Scene()
        # The files that were added, with how each is read and shown; None beside arrays.
        self._files: list[tuple[str, str, str]] | None = []
        # What a scene file says of the picture.
        self._described: dict[str, Any] = {}

    @classmethod
    def open(cls, path: str | os.PathLike[str], *, trusted: bool = False) -> Scene:
        """Opens a scene file: that of the window, of `save` or by hand (docs/scene-files.md).

        `render` then draws the picture that the file describes, as `splatkit render scene.json`
        does; its arguments count more than the file. Texts over the picture are the command's.

        Args:
            trusted: Whether the scene may name files outside its folder, and addresses.
        """
        scene = cls()
        scene._described = json.loads(scene._native.add_scene(os.fspath(path), trusted))
        scene._files = None
        if scene._described["overlay"]:
            message = (
                f"{os.fspath(path)}: the texts over the picture are drawn by the command alone"
            )
            warnings.warn(message, DataWarning, stacklevel=2)
        return scene

    def save(
        self,
        path: str | os.PathLike[str],
        camera: Camera | None = None,
        size: tuple[int, int] | None = None,
        **drawing: Any,
    ) -> None:
        """Writes a scene file, which the command, the window and `open` draw alike.

        Only scenes of files can be written; save arrays as files first. The arguments are those of
        `render`.
        """
        if self._files is None:
            raise ArgumentError("a scene file names files: a scene of arrays cannot be saved")
        if not self._files:
            raise ArgumentError("the scene is empty")
        known = frozenset(_DRAW) - {"size"} | {"background"}
        given = _options.checked(drawing, known, "save")
        if "background" in given or drawing.get("background", "") is None:
            given["background"] = _options.background(drawing["background"]) or "none"
        text = None if camera is None else camera.to_json()
        draw = _drawn(size=size, **given)
        _pysplatkit.write_scene(os.fspath(path), self._files, text, "{}", draw)

    def add(self, source: Any, **options: Unpack[FileOptions]) -> Scene:
        """Adds a file, a folder of DICOM slices, an array, or an object of another package.

        Arrays of three axes are volumes, those of (n, 3) points. A dictionary has the arguments of
        a method: an `array`, `vertices`, `positions`, `points` or `centers`, and more.
        `docs/python.md` lists the options, and the objects that are known.
        """
        if isinstance(source, (str, os.PathLike)):
            known = _options.VOLUME | _options.SURFACE | _options.CELLS | _options.READING
            given = _options.checked(options, known, "add")
            path = os.fspath(source)
            reading, appearance = _options.reading(given), _options.appearance(given)
            self._native.add_file(path, reading, appearance)
            if self._files is not None:
                self._files.append((path, reading, appearance))
            return self
        parts = _neighbours.parts_of(source, options.get("scalar"))
        if parts is not None:
            options.pop("scalar", None)
            arguments: dict[str, Any] = dict(options)
            if parts.method == "add_cells" and "cells" in arguments:
                arguments["style"] = arguments.pop("cells")
            return getattr(self, parts.method)(parts, **arguments)  # type: ignore[no-any-return]
        if isinstance(source, Mapping):
            return self._add_arguments(source, options)
        shape = np.shape(source)
        if len(shape) == 3:
            return self.add_volume(source, **options)  # type: ignore[misc]
        if len(shape) == 2 and shape[1] == 3:
            return self.add_points(source, **options)  # type: ignore[misc]
        if len(shape) == 0:
            raise _neighbours.unknown(source, "Scene.add", _ALSO)
        raise ArgumentError(
            f"an array of the shape {shape} is neither a volume (z, y, x) nor points (n, 3)"
        )

    def _add_arguments(self, source: Mapping[str, Any], options: Mapping[str, Any]) -> Scene:
        methods = {
            "array": self.add_volume,
            "vertices": self.add_mesh,
            "centers": self.add_gaussians,
            "points": self.add_cells,
            "positions": self.add_points,
        }
        if {"positions", "values"} < set(source) and set(source) & {"radii", "covariances"}:
            methods["positions"] = self.add_samples
        for first, method in methods.items():
            if first in source:
                given = {**source, **options}
                return method(given.pop(first), **given)  # type: ignore[no-any-return, operator]
        raise _neighbours.unknown(source, "Scene.add", _ALSO)

    def add_volume(
        self,
        array: Any,
        *,
        scalar: str | None = None,
        copy: bool | None = None,
        spacing: float | Vector | None = None,
        origin: Vector | None = None,
        axes: Any = None,
        coordinates: Sequence[Any] | None = None,
        missing: float | None = None,
        modality: str | None = None,
        value_name: str | None = None,
        value_unit: str | None = None,
        unit: str | None = None,
        up: str | Vector | None = None,
        labels: bool | Mapping[int, str] | str | os.PathLike[str] | None = None,
        name: str = "volume",
        **appearance: Unpack[VolumeAppearance],
    ) -> Scene:
        """Adds the samples of an array, which is indexed [z, y, x] whatever its order in memory.

        Args:
            array: Booleans or numbers, or an image of another package, which says where it is.
                NaN and infinite samples have no value.
            scalar: The name of the array of an object that has several.
            copy: None draws an array in C order and of a type of the library where it is; nothing
                may write to it as long as the scene lives. Others are copied. True copies in any
                case, False never: that is an error where a copy is needed.
            spacing: The distances between samples along x, y and z, in world units. Default: those
                of the object, else 1.
            origin: The world position x, y, z of the sample array[0, 0, 0].
            axes: A 3 × 3 matrix whose columns are the directions of x, y and z of the array in
                the world. They are multiplied by `spacing`.
            coordinates: Where samples are along x, y and z if they are not evenly spaced: three
                lists of ascending numbers, in units of the spacing.
            missing: A value that stands for “no value”.
            modality: ct, mr, emission, ultrasound or microscopy: for the automatic colours.
            up: The world direction that is up: x, y, z, or an axis such as “+Y”. Default: z.
            labels: Whether the values are labels, each drawn where its samples are nearest; their
                names as {value: name}; or the path of a table with names and colours. Default:
                values that look like labels are.
        """
        given = _options.checked(appearance, _options.VOLUME, "add_volume")
        volume = _neighbours.of_kind(_neighbours.Volume, array, scalar, "add_volume")
        volume = volume or _neighbours.Volume(array)
        samples = _arrays.samples(volume.samples, copy)
        axes = volume.axes if axes is None else axes
        coordinates = volume.coordinates if coordinates is None else coordinates
        matrix = None
        if axes is not None:
            matrix = _arrays.rows(axes, 3, "axes", "f8")
            if matrix.shape != (3, 3):
                raise ArgumentError(f"axes is a matrix of 3 × 3, not {matrix.shape}")
        facts = {
            "name": name,
            "spacing": _options.vector(volume.spacing if spacing is None else spacing),
            "origin": _options.vector(volume.origin if origin is None else origin),
            "axes": matrix,
            "coordinates": _coordinates(coordinates, samples.shape),
            "missing": missing,
            "modality": modality,
            "value_name": volume.value_name if value_name is None else value_name,
            "value_unit": volume.value_unit if value_unit is None else value_unit,
            "unit": volume.unit if unit is None else unit,
            "up": _options.direction(up),
            "frame": volume.frame,
            "labels": _labels(labels),
        }
        self._files = None
        self._native.add_volume(samples, _options.text(facts), "{}", _options.appearance(given))
        return self

    def add_mesh(
        self,
        vertices: Any,
        faces: Any = None,
        *,
        scalar: str | None = None,
        normals: Any = None,
        colors: Any = None,
        values: Any = None,
        up: str | Vector | None = None,
        name: str = "mesh",
        **appearance: Unpack[SurfaceAppearance],
    ) -> Scene:
        """Adds triangles.

        Args:
            vertices: Positions x, y, z, (n, 3), or a mesh of another package, which has its own
                faces, and the other arrays that are not given.
            scalar: The name of the array of such a mesh that colours it.
            faces: Rows of three indices of vertices, counter-clockwise from outside. Rows of more
                are convex polygons.
            normals: One normal for each vertex, (n, 3).
            colors: (n, 3) or (n, 4): bytes, 16-bit integers, or real numbers from 0 to 1.
            values: One number for each vertex, to colour it by `colormap`; NaN for none.
            up: The world direction that is up. Default: guessed from the shape.
        """
        given = _options.checked(appearance, _options.SURFACE, "add_mesh")
        surface = _neighbours.of_kind(_neighbours.Surface, vertices, scalar, "add_mesh")
        surface = surface or _neighbours.Surface(vertices)
        if faces is not None:
            surface.faces = faces
        if surface.faces is None:
            raise KindError("add_mesh() needs faces: add_points() adds points without")
        return self._add_mesh(surface.with_given(normals, colors, values), up, name, given)

    def add_points(
        self,
        positions: Any,
        *,
        scalar: str | None = None,
        colors: Any = None,
        values: Any = None,
        normals: Any = None,
        up: str | Vector | None = None,
        name: str = "points",
        **appearance: Unpack[SurfaceAppearance],
    ) -> Scene:
        """Adds a point cloud: points of a surface, each drawn as a disc.

        `values` colour the points. Values in space, such as those of particles, are drawn by
        `add_samples`. The arguments are those of `add_mesh`. Of a mesh of another package the
        vertices are drawn.
        """
        given = _options.checked(appearance, _options.SURFACE, "add_points")
        surface = _neighbours.points(positions, scalar, "add_points")
        surface = surface or _neighbours.Surface(positions)
        up = surface.up if up is None else up
        return self._add_mesh(surface.with_given(normals, colors, values), up, name, given)

    def _add_mesh(
        self,
        surface: _neighbours.Surface,
        up: str | Vector | None,
        name: str,
        given: Mapping[str, Any],
    ) -> Scene:
        vertices, faces, normals = surface.positions, surface.faces, surface.normals
        colors, values = surface.colors, surface.values
        positions = _arrays.positions(vertices, "vertices" if faces is not None else "positions")
        count = len(positions)
        arrays = {
            "positions": positions,
            "faces": None if faces is None else _arrays.faces(faces, count),
            "normals": None if normals is None else _arrays.rows(normals, 3, "normals"),
            "colors": None if colors is None else _arrays.colors(colors, count),
            "values": None if values is None else _arrays.column(values, "values"),
        }
        facts = _options.text({"name": name, "up": _options.direction(up)})
        # Values colour a surface even if it has colours.
        named = {"scalar": "values"} if values is not None else {}
        self._files = None
        self._native.add_mesh(arrays, facts, _options.text(named), _options.appearance(given))
        return self

    def add_cells(
        self,
        points: Any,
        cells: Any = None,
        values: Any = None,
        *,
        kinds: Any = None,
        scalar: str | None = None,
        missing: float | None = None,
        up: str | Vector | None = None,
        name: str = "cells",
        style: str | None = None,
        **appearance: Unpack[CellAppearance],
    ) -> Scene:
        """Adds cells that fill space, such as those of a solver, with the field inside. Triangles
        (VTK's type 5), polygons (7) and quadrilaterals (8, 9) are drawn with their boundary.

        Args:
            points: Positions x, y, z, (n, 3), or a grid of PyVista or VTK, which has the rest.
            cells: Rows of the points of cells of one kind, in VTK's order, or the list of the
                number of points and the points of each cell.
            values: One number for each point, or for each cell. Cells with a value that is not
                finite, or at a point with one, are left out. None draws one colour.
            kinds: VTK's number of the type of all cells, or of each. Default: by the length of
                rows: 4 tetrahedra, 5 pyramids, 6 wedges, 8 hexahedra.
            scalar: The name of the array of a grid.
            style: solid, an opaque body with the field inside where clips cut it, or volume, the
                field by a transfer function. Default: solid, unless another option is one of
                fields.
        """
        given = _options.checked(appearance, _options.CELLS - {"cells"}, "add_cells")
        if style is not None:
            given["cells"] = style
        grid = _neighbours.of_kind(_neighbours.Cells, points, scalar, "add_cells")
        if grid is None:
            if cells is None:
                raise KindError("add_cells() needs points and cells, or a grid")
            arrays = _arrays.cells(cells, kinds)
        else:
            points = grid.positions
            arrays = _arrays.raw_cells(grid.kinds, grid.offsets, grid.nodes)
        uses_grid = grid is not None and values is None
        positions = _arrays.positions(points, "points")
        numbers = grid.values if uses_grid else values
        column = None if numbers is None else _arrays.column(numbers, "values")
        count, of_cells = len(arrays["kinds"]), False
        if column is not None:
            of_cells = grid.of_cells if uses_grid else len(column) == count != len(positions)
            if len(column) != (count if of_cells else len(positions)):
                raise ArgumentError(
                    f"there are {len(column)} values for {len(positions)} points and {count} cells"
                )
        points, arrays["nodes"] = _arrays.used(arrays["nodes"], len(positions))
        given_arrays = {
            **arrays,
            "positions": positions[points],
            "values": column if of_cells or column is None else column[points],
            "of_cells": of_cells,
        }
        facts = {"name": name, "missing": missing, "up": _options.direction(up)}
        self._files = None
        self._native.add_cells(given_arrays, _options.text(facts), _options.appearance(given))
        return self

    def add_samples(
        self,
        positions: Any,
        values: Any,
        *,
        radii: Any = None,
        covariances: Any = None,
        missing: float | None = None,
        radius: float | None = None,
        neighbours: int | None = None,
        slopes: bool | None = None,
        up: str | Vector | None = None,
        name: str = "samples",
        **appearance: Unpack[FieldAppearance],
    ) -> Scene:
        """Adds values at any positions, such as those of particles, and draws the field between.

        Args:
            positions: x, y, z, (n, 3).
            values: One number for each position. Samples without a finite value are left out.
            radii: The reach of each sample: two standard deviations of its kernel, such as the
                smoothing length of SPH. Default: made from the distances of neighbours.
            covariances: xx, xy, xz, yy, yz, zz of each kernel, (n, 6), instead of radii.
            radius: One radius for all samples.
            neighbours: The number of neighbours that kernels are made from, 4 to 64.
            slopes: Whether samples carry slopes. Default: True.
        """
        given = _options.checked(appearance, _options.FIELD, "add_samples")
        arrays = {
            "positions": _arrays.positions(positions, "positions"),
            "values": _arrays.column(values, "values"),
            "radii": None if radii is None else _arrays.column(radii, "radii"),
            "covariances": None,
        }
        if covariances is not None:
            arrays["covariances"] = _arrays.rows(covariances, 6, "covariances")
        facts = {"name": name, "missing": missing, "up": _options.direction(up)}
        load = {"radius": radius, "neighbours": neighbours, "slopes": slopes}
        self._files = None
        self._native.add_samples(
            arrays, _options.text(facts), _options.text(load), _options.appearance(given)
        )
        return self

    def add_gaussians(
        self,
        centers: Any,
        scales: Any,
        rotations: Any,
        opacities: Any,
        *,
        colors: Any = None,
        harmonics: Any = None,
        up: str | Vector | None = None,
        name: str = "gaussians",
    ) -> Scene:
        """Adds trained 3D Gaussians.

        Args:
            centers: Positions x, y, z, (n, 3).
            scales: Standard deviations along the axes of each Gaussian, (n, 3); not logarithms.
            rotations: Quaternions w, x, y, z, (n, 4).
            opacities: 0 to 1, (n,); not logits.
            colors: Red, green and blue, the same from all sides, (n, 3).
            harmonics: Coefficients of spherical harmonics, (n, 1, 4, 9 or 16, 3), instead of
                colours.
            up: The world direction that is up. Default: −y, as trainers have it.
        """
        places = _arrays.positions(centers, "centers")
        if (colors is None) == (harmonics is None):
            raise ArgumentError("Gaussians have either colors or harmonics")
        if harmonics is not None:
            terms = _arrays.numbers(harmonics, "harmonics")
            if terms.ndim != 3 or terms.shape[0] != len(places) or terms.shape[2] != 3:
                form = "(n, terms, 3) is needed"
                raise ArgumentError(f"harmonics has the shape {terms.shape}; {form}")
        else:
            # The constant term of the harmonics.
            rgb = _arrays.colors(colors, len(places))[:, :3]
            terms = (rgb.astype(np.float64) / 255.0 - 0.5) / 0.28209479177387814
        arrays = {
            "centers": places,
            "scales": _arrays.rows(scales, 3, "scales"),
            "rotations": _arrays.rows(rotations, 4, "rotations"),
            "opacities": _arrays.column(opacities, "opacities"),
            "harmonics": np.ascontiguousarray(terms.reshape(-1, 3), dtype=np.float32),
        }
        facts = {"name": name, "up": _options.direction(up)}
        self._files = None
        self._native.add_gaussians(arrays, _options.text(facts))
        return self

    def camera(
        self,
        size: tuple[int, int] = (1280, 720),
        *,
        view: str | None = None,
        azimuth: float | None = None,
        elevation: float | None = None,
        zoom: float | None = None,
        focal_point: Vector | None = None,
        view_up: str | Vector | None = None,
        view_angle: float | None = None,
        distance: float | None = None,
        orthographic: bool = False,
        up: str | Vector | None = None,
        clips: Sequence[Clip] = (),
    ) -> Camera:
        """Returns the camera that sees the whole scene in a picture of this size.

        By default it looks from the front, 30° to the right and 20° upwards. `view` is front, back,
        left, right, top, bottom or iso; `azimuth` and `elevation` turn it further.
        """
        given = dict(locals())
        fit = _fit(**{name: given[name] for name in _FIT})
        return Camera.from_json(self._native.camera(fit, _drawn(size, clips)))

    def turntable(
        self, frames: int, size: tuple[int, int] = (1280, 720), **view: Any
    ) -> list[Camera]:
        """Returns the cameras of a film that turns once around the scene, all at one distance.

        The options are those of `camera`.
        """
        clips = view.pop("clips", ())
        given = _options.checked(view, frozenset(_FIT), "turntable")
        if frames < 1:
            raise ArgumentError("a turntable has at least one frame")
        cameras = self._native.turntable(frames, _fit(**given), _drawn(size, clips))
        return [Camera.from_json(text) for text in cameras]

    def render(
        self,
        size: tuple[int, int] | None = None,
        camera: Camera | None = None,
        *,
        background: Color | None = "auto",
        samples: int | str | None = None,
        mode: str | None = None,
        back_to_front: bool | None = None,
        classify: str | None = None,
        optics: str | None = None,
        shade: bool | None = None,
        clips: Sequence[Clip] | None = None,
        gradient: str | None = None,
        evaluate: str | None = None,
        sheet_thickness: float | None = None,
        cut: float | None = None,
        budget: int | None = None,
        memory: int | None = None,
        cull_backfaces: bool | None = None,
        occlusion: bool | None = None,
    ) -> Picture:
        """Draws a picture. What is not given is as a scene file says (`open`), or as usual: as
        `splatkit render --engine cpu` does.

        Ctrl-C stops it. Other threads of Python go on meanwhile.

        Args:
            size: Width and height in pixels. Default: 1280 × 720.
            camera: Default: that of `Scene.camera`. If nothing is seen then, that is a
                `NothingToDrawError`; with a camera of one's own, the picture is empty.
            background: A colour; None for transparent pixels. Default: black.
            samples: Pixels that are drawn for each pixel and averaged: 1, 4, 9, 16, 64 or auto.
                Default: auto.
            mode: sheets, axis-sheets or splats. Default: sheets.
            back_to_front: Whether single splats are composited from back to front.
            classify: pre-integrated, post or pre. Default: pre-integrated.
            optics: light, maximum or x-ray. Default: light.
            shade: False draws without light, True lights volumes in any case.
            clips: Shapes that cut the scene.
            cut, budget: The width of splats of hierarchies, in pixels, or about how many.
        """
        given = dict(locals())
        said: dict[str, Any] = dict(self._described.get("picture", {}))
        behind = said.pop("background", "black") if background == "auto" else background
        # What is given counts more than what the scene file says.
        chosen = {name: given[name] for name in _DRAW if given[name] is not None}
        if {"cut", "budget"} & chosen.keys():
            for name in ("cut", "budget", "frame_time"):
                said.pop(name, None)
        draw = {**said, **chosen}
        if camera is None:
            camera = self._described_camera(draw)
        return Picture(self._pixels(camera, draw), _options.background(behind))

    def _described_camera(self, draw: Mapping[str, Any]) -> Camera | None:
        """Returns the camera of a scene file; None if the usual one is drawn."""
        camera, framing = self._described.get("camera"), self._described.get("framing")
        if camera is not None:
            return Camera.from_json(json.dumps(camera))
        if not framing:
            return None
        return Camera.from_json(self._native.camera(json.dumps(framing), _drawn(**draw)))

    def _pixels(self, camera: Camera | None, draw: Mapping[str, Any]) -> _pysplatkit.Picture:
        """Draws with options by their names."""
        text = None if camera is None else camera.to_json()
        return self._native.render(text, _drawn(**draw))

    def show(
        self, camera: Camera | None = None, size: tuple[int, int] = (800, 600), **drawing: Any
    ) -> Widget:
        """Returns a widget for notebooks, in which the scene is turned by hand.

        It needs the package anywidget: `pip install "pysplatkit[notebook]"`.

        Args:
            camera: The first view. Default: that of `Scene.camera`.
            size: Width and height on the screen, in pixels of CSS.
            drawing: The other options of `render`.
        """
        try:
            from ._widget import Widget
        except ModuleNotFoundError as error:
            if error.name not in ("anywidget", "traitlets"):
                raise
            message = 'Scene.show needs anywidget: pip install "pysplatkit[notebook]"'
            raise ImportError(message, name=error.name) from error
        return Widget(self, camera, size, **drawing)

    @property
    def bounds(self) -> tuple[tuple[float, ...], tuple[float, ...]] | None:
        """The smallest and the largest x, y, z of samples and vertices; None for an empty scene."""
        bounds = self._native.bounds
        return None if bounds is None else (tuple(bounds[0]), tuple(bounds[1]))

    @property
    def contents(self) -> list[tuple[str, str, int]]:
        """What was added: its kind, its name, and the number of splats or samples."""
        return self._native.contents

    def __len__(self) -> int:
        return len(self._native.contents)

    def __repr__(self) -> str:
        items = ", ".join(f"{kind} {name!r} of {count}" for kind, name, count in self.contents)
        return f"<pysplatkit.Scene: {items or 'empty'}>"


#: What else `Scene.add` takes.
_ALSO = "a path, a dictionary of the arguments of a method, "

_FIT = (
    "view",
    "azimuth",
    "elevation",
    "zoom",
    "focal_point",
    "view_up",
    "view_angle",
    "distance",
    "orthographic",
    "up",
)


#: The names of the options of `Scene.render`.
DRAWING = frozenset(inspect.signature(Scene.render).parameters) - {"self"}
#: Those that the compiled half takes.
_DRAW = DRAWING - {"camera", "background"}


def _labels(given: bool | Mapping[int, str] | str | os.PathLike[str] | None) -> Any:
    if isinstance(given, Mapping):
        return [(int(value), str(name)) for value, name in given.items()]
    return given if given is None or isinstance(given, bool) else os.fspath(given)


def _coordinates(given: Sequence[Any] | None, shape: tuple[int, ...]) -> list[Any] | None:
    if given is None:
        return None
    lines = [_arrays.numbers(line, "coordinates").ravel().astype(float) for line in given]
    if tuple(map(len, reversed(lines))) != shape:
        raise ArgumentError(
            f"coordinates of {' × '.join(str(len(line)) for line in lines)} samples along x, y and z "
            f"do not fit an array of the shape {shape}"
        )
    return [line.tolist() for line in lines]


def _fit(**given: Any) -> str:
    if given.get("focal_point") is not None:
        given["focal_point"] = _options.vector(given["focal_point"])
    for name in ("view_up", "up"):
        given[name] = _options.direction(given.get(name))
    return _options.text(given)


def _drawn(
    size: tuple[int, int] | None = None, clips: Sequence[Clip | dict[str, Any]] = (), **draw: Any
) -> str:
    """Returns how a picture is drawn, as JSON."""
    entries = [clip._entry() if isinstance(clip, Clip) else clip for clip in clips or ()]
    return _options.text({**draw, "size": size, "clips": entries})
