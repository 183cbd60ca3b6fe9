"""Scenes."""

from __future__ import annotations

import json
import os
import threading
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np

from . import _film, _items, _neighbours, _options, _page, _pysplatkit, _values
from ._camera import Camera, Clip
from ._errors import ArgumentError
from ._items import Item
from ._options import (
    CellAppearance,
    Drawing,
    FieldAppearance,
    Framed,
    PathLike,
    Saved,
    SourceOptions,
    SurfaceAppearance,
    View,
    VolumeAppearance,
)
from ._picture import Picture
from ._values import Color, Vector

if TYPE_CHECKING:
    from ._widget import Widget


class Scene:
    """What is drawn together in one picture. Methods that add or change items return the scene.

    >>> Scene().add("skull.nrrd").add("knee.stl", color="ivory").render().save("both.png")

    World coordinates are x, y, z, in any unit. Items have names: `update`, `transform` and `remove`
    take them. A scene may be drawn by several threads at once, copied and pickled.
    """

    def __init__(self) -> None:
        self._native = _pysplatkit.Scene()
        self._items: list[Item] = []
        # What a scene file says of the picture.
        self._described: dict[str, Any] = {}
        # Held while items change.
        self._lock = threading.RLock()

    @classmethod
    def open(cls, path: PathLike, *, trusted: bool = False) -> Scene:
        """Opens a scene file: that of the window, of `save` or by hand (docs/scene-files.md).

        `render` then draws the picture that the file describes, as `splatkit render scene.json`
        does; its arguments count more than the file.

        Args:
            path: The scene file.
            trusted: Whether the scene may name files outside its folder, and addresses.
        """
        described = json.loads(_pysplatkit.read_scene(os.fspath(path), trusted))
        scene = cls()
        optics = described["picture"].get("optics")
        for file in described.pop("inputs"):
            arguments = {"source": file["file"], "_optics": optics}
            arguments |= {"_reading": file["reading"], "_appearance": file["appearance"]}
            if file["edits"]:
                arguments["edits"] = file["edits"]
            name = scene._unused(None, _items.name_of(file["file"]))
            item = Item.of(name, "add", arguments)
            scene._append(replace(item, transform=json.dumps(file["transform"])))
        scene._described = described
        return scene

    def save(
        self,
        path: PathLike,
        camera: Camera | None = None,
        size: tuple[int, int] | None = None,
        **drawing: Unpack[Saved],
    ) -> None:
        """Writes a scene file, which the command, the window and `open` draw alike.

        Only scenes of files can be written; save arrays as files first. What is not given is as the
        scene file says that `open` has read, if there is one.

        Args:
            path: The scene file.
            camera: The camera. Default: one that is fitted to the scene.
            size: Width and height of the picture in pixels.
            drawing: The other options of `render`.
        """
        inputs = [item.input for item in self._items]
        files = [file for file in inputs if file is not None]
        if len(files) < len(inputs):
            raise ArgumentError("a scene file names files: a scene of arrays cannot be saved")
        if not files:
            raise ArgumentError("the scene is empty")
        described = self._said(camera, {**drawing, "size": size}, "save")
        _pysplatkit.write_scene(os.fspath(path), files, json.dumps(described))

    def save_html(
        self,
        path: PathLike,
        camera: Camera | None = None,
        *,
        title: str | None = None,
        quality: float | None = None,
        limit: int | str | None = None,
        viewer: PathLike | None = None,
        **drawing: Unpack[Framed],
    ) -> dict[str, Any]:
        """Writes a page that shows the scene in a browser, as `splatkit publish` does
        (docs/browser.md). Arrays become files in the page.

        >>> scene.save_html("look.html", limit="20MB")

        Args:
            path: An .html file with everything inside, which opens by a double click; or a folder
                for a static host.
            camera: The first view. Default: one that is fitted to the scene.
            title: The title of the page. Default: the names of the files.
            quality: The share of points, triangles, Gaussians and samples that is shown, up to 1.
            limit: Most bytes of the page, as a number or a text such as "20MB". As much is shown
                as fits.
            viewer: The folder that tools/web/build has made. Default: what the package contains.
            drawing: The other options of `render`.

        Returns:
            The `bytes` of the page; the `share` that it shows; and `psnr`, how alike its picture is
            in dB, if it shows less or inputs were converted.
        """
        if not self._items:
            raise ArgumentError("the scene is empty")
        _options.checked(drawing, _options.DRAWING | _options.VIEW, "save_html")
        described = self._said(camera, drawing, "save_html")
        return _page.write(self, path, described, (title, quality, limit, viewer))

    def add(
        self, source: Any, *, name: str | None = None, **options: Unpack[SourceOptions]
    ) -> Scene:
        """Adds a file, a folder of DICOM slices, an array, or an object of another package.

        Args:
            source: A path; an array of three axes, a volume, or of (n, 3), points; an object that
                docs/python.md lists; or a dictionary with the arguments of a method: an `array`,
                `vertices`, `positions`, `points` or `centers`, and more.
            name: What the item is called. Default: made of the file's name, or of the kind.
            options: How the source is read and shown (docs/python.md lists the options).
        """
        method, arguments = _arguments(source, dict(options))
        return self._added(method, {**arguments, "name": name or arguments.get("name")})

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
        channel_axis: int | None = None,
        channel_names: Sequence[str] | None = None,
        opacity_from: Any = None,
        name: str | None = None,
        **appearance: Unpack[VolumeAppearance],
    ) -> Scene:
        """Adds the samples of an array, which is indexed [z, y, x] whatever its order in memory,
        with one more axis if `channel_axis` names it.

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
            value_name: What the values are called: the title of the scalar bar.
            value_unit: The unit of the values.
            unit: The unit of lengths.
            up: The world direction that is up: x, y, z, or an axis such as “+Y”. Default: z.
            labels: Whether the values are labels, each drawn where its samples are nearest; their
                names as {value: name}; or the path of a table with names and colours. Default:
                values that look like labels are.
            channel_axis: The axis of an array of four that has channels, up to eight: all are
                drawn, each in a colour (`channels`).
            channel_names: The names of the channels.
            opacity_from: An array of the same shape, or the name of an array of the object, that
                says how opaque the samples are; the values give the colours.
            name: What the item is called. Default: “volume”, with a number if there are several.
            appearance: `transfer`, `range`, `opacity_unit`, `isosurfaces`, `gradient_opacity`,
                `colormap`, `log_colors`, `kernel`, `sigma`, `extent`, `sharp` (docs/python.md).
        """
        return self._added("add_volume", locals())

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
        name: str | None = None,
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
            name: What the item is called. Default: “mesh”, with a number if there are several.
            appearance: `color`, `colormap`, `range`, `log_colors`, `nan_color`, `opacity`,
                `radius_scale`, `crease`, `edges`, `points`, `point_size`, `line_width`
                (docs/python.md).
        """
        return self._added("add_mesh", locals())

    def add_points(
        self,
        positions: Any,
        *,
        scalar: str | None = None,
        colors: Any = None,
        values: Any = None,
        normals: Any = None,
        radius: Any = None,
        up: str | Vector | None = None,
        name: str | None = None,
        **appearance: Unpack[SurfaceAppearance],
    ) -> Scene:
        """Adds a point cloud: points of a surface are drawn as discs, others as balls.

        Values in space, such as those of particles, are drawn by `add_samples`.

        Args:
            positions: x, y, z, (n, 3), or an object of another package; of a mesh, its vertices.
            scalar: The name of the array of such an object that colours the points.
            colors: (n, 3) or (n, 4): bytes, 16-bit integers, or real numbers from 0 to 1.
            values: One number for each point, to colour it by `colormap`; NaN for none.
            normals: One normal for each point, (n, 3).
            radius: The radius of the points in world units, one for all or one for each. Points
                with a radius are balls.
            up: The world direction that is up. Default: guessed from the shape.
            name: What the item is called. Default: “points”, with a number if there are several.
            appearance: `color`, `colormap`, `range`, `log_colors`, `nan_color`, `opacity`,
                `radius_scale`, `crease`, `edges`, `points`, `point_size`, `line_width`
                (docs/python.md).
        """
        return self._added("add_points", locals())

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
        name: str | None = None,
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
            missing: A value that stands for “no value”.
            up: The world direction that is up. Default: z.
            name: What the item is called. Default: “cells”, with a number if there are several.
            appearance: The options of fields, as for volumes, and `color`, `nan_color`, `opacity`,
                `crease` (docs/python.md).
        """
        return self._added("add_cells", locals())

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
        name: str | None = None,
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
            missing: A value that stands for “no value”.
            up: The world direction that is up. Default: z.
            name: What the item is called. Default: “samples”, with a number if there are several.
            appearance: The options of fields, as for volumes (docs/python.md).
        """
        return self._added("add_samples", locals())

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
        name: str | None = None,
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
            name: What the item is called. Default: “gaussians”, with a number if there are several.
        """
        return self._added("add_gaussians", locals())

    def update(self, name: str, source: Any = None, **options: Any) -> Scene:
        """Replaces the data of an item, or changes its options; the rest stays as it is.

        >>> scene.update("skull", colormap="magma").update("flow", values=new_values)

        Items that were added later are made again, because an item may turn those after it.

        Args:
            name: The item.
            source: Other data: what `add` takes. Data of another kind begins with no options.
            options: Arguments of the method that added the item. None is what that method takes
                by default.
        """
        at = self._index(name)
        with self._lock:
            return self._replaced(at, _changed(self._items[at], source, options))

    def transform(
        self,
        name: str,
        *,
        scale: float | None = None,
        rotate: tuple[Vector | str, float] | None = None,
        translate: Vector | None = None,
        matrix: Any = None,
        reset: bool = False,
    ) -> Scene:
        """Moves an item from where it is: it is scaled about the world's origin, then turned, then
        shifted.

        >>> scene.transform("knee", rotate=("z", 90), translate=(0, 0, 12.5))

        Args:
            name: The item.
            scale: A factor on lengths, above 0.
            rotate: An axis through the world's origin, as x, y, z or a name such as “z”, and an
                angle in degrees: counter-clockwise for an eye that looks against the axis.
            translate: A shift along x, y and z in world units.
            matrix: A matrix of 4 × 4 that scales all axes alike, turns and shifts. It is applied
                before the other moves.
            reset: Whether the item is first put back where it was added.
        """
        turn = None
        if rotate is not None:
            try:
                axis, degrees = rotate
                turn = {"axis": _options.direction(axis), "degrees": float(degrees)}
            except (TypeError, ValueError) as error:
                form = "rotate is an axis and an angle in degrees, such as ('z', 90)"
                raise ArgumentError(f"{form}, not {rotate!r}") from error
        rows = None
        if matrix is not None:
            rows = _options.matrix(matrix)
        shift = None if translate is None else _values.vector(translate)
        move = {"scale": scale, "rotate": turn, "translate": shift, "matrix": rows}
        at = self._index(name)
        with self._lock:
            item = self._items[at]
            before = "{}" if reset else item.transform
            moved = _pysplatkit.moved(before, _values.text(move))
            return self._replaced(at, replace(item, transform=moved))

    def remove(self, name: str) -> Scene:
        """Removes an item. The scene is then as if the item had never been added.

        Args:
            name: The item.
        """
        at = self._index(name)
        with self._lock:
            return self._replaced(at, None)

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

        By default it looks from the front, 30° to the right and 20° upwards.

        Args:
            size: Width and height of the picture in pixels.
            view: The side to look from: front, back, left, right, top, bottom or iso.
            azimuth: Degrees to the right about the up axis, further than `view`.
            elevation: Degrees upwards, further than `view`.
            zoom: A factor on the size of what is seen.
            focal_point: The point that the camera aims at. Default: the middle of what is seen.
            view_up: The direction that is up in the picture: x, y, z, or an axis such as “+Y”.
            view_angle: The vertical angle of view in degrees. Default: 30.
            distance: The distance from the focal point. Default: the scene fills the picture.
            orthographic: Whether to draw without perspective.
            up: The direction that is up in the scene. Default: that of its items.
            clips: Shapes that cut the scene; the camera is fitted to what is left.
        """
        given = dict(locals())
        fit = _options.fit(**{name: given[name] for name in _FIT})
        return Camera.from_json(self._native.camera(fit, _options.drawn(size, clips)))

    def turntable(
        self,
        frames: int,
        size: tuple[int, int] = (1280, 720),
        *,
        clips: Sequence[Clip] = (),
        **view: Unpack[View],
    ) -> list[Camera]:
        """Returns the cameras of a film that turns once around the scene, all at one distance.

        Args:
            frames: The number of cameras.
            size: Width and height of the pictures in pixels.
            clips: Shapes that cut the scene.
            view: The first camera: the other options of `camera`.
        """
        given = _options.checked(view, _options.VIEW, "turntable")
        if frames < 1:
            raise ArgumentError("a turntable has at least one frame")
        cameras = self._native.turntable(frames, _options.fit(**given), _options.drawn(size, clips))
        return [Camera.from_json(text) for text in cameras]

    def render(
        self,
        size: tuple[int, int] | None = None,
        camera: Camera | None = None,
        *,
        view: str | None = None,
        azimuth: float | None = None,
        elevation: float | None = None,
        zoom: float | None = None,
        focal_point: Vector | None = None,
        view_up: str | Vector | None = None,
        view_angle: float | None = None,
        distance: float | None = None,
        orthographic: bool | None = None,
        up: str | Vector | None = None,
        background: Color | None = "auto",
        width: str | None = None,
        height: str | None = None,
        dpi: float | None = None,
        views: Sequence[str] | None = None,
        columns: int | None = None,
        panel_labels: str | None = None,
        samples: int | str | None = None,
        mode: str | None = None,
        back_to_front: bool | None = None,
        classify: str | None = None,
        optics: str | None = None,
        shade: bool | None = None,
        light: str | None = None,
        shadows: bool | None = None,
        ambient_occlusion: float | None = None,
        eye_dome: float | None = None,
        outline: float | None = None,
        outline_color: Color | None = None,
        clips: Sequence[Clip] | None = None,
        gradient: str | None = None,
        evaluate: str | None = None,
        sheet_thickness: float | None = None,
        cut: float | None = None,
        budget: int | None = None,
        memory: int | None = None,
        cull_backfaces: bool | None = None,
        occlusion: bool | None = None,
        engine: str | None = None,
        scalar_bar: bool | None = None,
        axes: bool | None = None,
        scale_bar: bool | None = None,
        caption: str | None = None,
        layers: Sequence[str] | None = None,
    ) -> Picture:
        """Draws a picture. What is not given is as a scene file says (`open`), or as usual: as
        `splatkit render --engine cpu` does.

        Ctrl-C stops it. Other threads of Python go on meanwhile.

        Args:
            size: Width and height in pixels. Default: 1280 × 720.
            camera: Default: one that sees the whole scene. If nothing is seen then, that is a
                `NothingToDrawError`; with a camera of one's own, the picture is empty.
            view: The side to look from: front, back, left, right, top, bottom or iso.
            azimuth: Degrees to the right about the up axis.
            elevation: Degrees upwards.
            zoom: A factor on the size of what is seen.
            focal_point: The point that the camera aims at.
            view_up: The direction that is up in the picture.
            view_angle: The vertical angle of view in degrees. Default: 30.
            distance: The distance of the camera from its focal point.
            orthographic: Whether to draw without perspective.
            up: The direction that is up in the scene.
            background: A colour; None for transparent pixels. Default: black.
            width: The width on paper instead of a size, such as "85mm"; also cm, in and pt. Needs
                dpi.
            height: The height on paper. Without one of them, the other gives it.
            dpi: Pixels an inch. Files store them, letters are 8 points high, and edges half a
                point wide.
            views: Sides that the picture shows beside each other in one scale, such as
                ["front", "left", "top"].
            columns: The number of views in a row. Default: all of up to four.
            panel_labels: What the corner of each view says: names, letters or none. Default: names.
            samples: Pixels that are drawn for each pixel and averaged: 1, 4, 9, 16, 64 or auto.
                Default: auto.
            mode: sheets, axis-sheets or splats. Default: sheets.
            back_to_front: Whether single splats are composited from back to front.
            classify: pre-integrated, post or pre. Default: pre-integrated.
            optics: light, maximum or x-ray. Default: light.
            shade: False draws without light, True lights volumes in any case.
            light: soft (from the eye, for surfaces also from beside it), head (from the eye), key
                (a lamp that casts shadows), studio (that lamp and all sides) or sky (all sides,
                more from above). Default: soft.
            shadows: Whether the lamp casts shadows. Default: True.
            ambient_occlusion: How far light is dimmed where things around a place keep it away,
                from 0 to 1. Default: 1 for studio and sky, else 0.
            eye_dome: How far pixels beside nearer ones are dimmed, about 1: for clouds without
                normals. Default: 0.
            outline: The width of lines around what stands in front of something farther away, in
                pixels. Default: none.
            outline_color: Their colour. Default: black, or white on a dark background.
            clips: Shapes that cut the scene.
            gradient: How gradients are made (docs/volumes.md).
            evaluate: Where fields are evaluated (docs/volumes.md).
            sheet_thickness: The thickness of sheets in world units. Default: that of samples.
            cut: The width of splats of hierarchies, in pixels.
            budget: About how many splats of hierarchies are drawn.
            memory: Most bytes that are kept of files which are read as they are drawn.
            cull_backfaces: Whether faces that look away are left out.
            occlusion: Whether what is hidden is left out early. Default: True.
            engine: cpu, gpu or auto. Default: cpu, the only one of the usual wheel.
            scalar_bar: Whether the colours of values are drawn, with their numbers.
            axes: Whether the directions of the axes are drawn; of patients, their sides.
            scale_bar: Whether a round length is drawn.
            caption: A text above the picture's content.
            layers: Layers that are also drawn, for `Picture.layers` and for .exr files: normals,
                albedo, identifiers (docs/figures.md).
        """
        given = dict(locals())
        picture = self._picture(camera, {name: given[name] for name in _GIVEN})
        return picture if layers is None else self._with_layers(picture, given)

    def film(
        self,
        path: PathLike,
        frames: int | None = None,
        *,
        cameras: Iterable[Camera] | None = None,
        keyframes: PathLike | Iterable[tuple[float, Camera]] | None = None,
        fps: float = 30.0,
        size: tuple[int, int] | None = None,
        overwrite: bool = True,
        **options: Unpack[Framed],
    ) -> Path:
        """Draws a film: a turn around the scene, or the way of a camera. Returns its path.

        >>> scene.film("skull.mp4", 120)
        >>> scene.film("flight.webm", keyframes=[(0, start), (2.5, end)])

        One frame is drawn, encoded and forgotten before the next. A film appears when it is
        complete.

        Args:
            path: .gif, .webp or .apng; .mp4, .mov or .webm, which need ffmpeg; or a .png or .jpg
                for numbered pictures: `{frame:04}` in its name is replaced by the number, or else
                the number is added. An ending slash makes a folder of pictures.
            frames: The number of frames of a turn. Default: 90.
            cameras: One camera for each frame, instead of a turn.
            keyframes: Times in seconds with cameras, which a smooth way connects, or a file of
                them (docs/video.md), instead of a turn.
            fps: Frames per second.
            size: Width and height in pixels. Default: 1280 × 720.
            overwrite: Whether files are replaced that are there already.
            options: The other options of `render`.
        """
        known = _options.DRAWING | _options.VIEW
        given = dict(_options.checked(options, known, "film"))
        if options.get("background", "") is None:
            given["background"] = None
        view = {name: given.pop(name) for name in _options.VIEW & given.keys()}
        size = size or tuple(self._described.get("picture", {}).get("size") or (1280, 720))
        ways = [way for way in (frames, cameras, keyframes) if way is not None]
        if len(ways) > 1:
            raise ArgumentError("a film has either frames of a turn, cameras or keyframes")
        if view and frames is None and ways:
            names = ", ".join(sorted(view))
            raise ArgumentError(f"the cameras of this film are given already; leave {names} out")
        if keyframes is not None:
            shots = _film.along(keyframes, fps)
        elif cameras is not None:
            shots = list(cameras)
        else:
            shots = self._turn(90 if frames is None else frames, size, view, given)
        return _film.write(self, path, shots, fps, size, given, overwrite)

    def show(
        self,
        camera: Camera | None = None,
        size: tuple[int, int] = (800, 600),
        draws: str = "auto",
        **drawing: Unpack[Drawing],
    ) -> Widget:
        """Returns a widget for notebooks, in which the scene is turned by hand.

        It needs the package anywidget: `pip install "pysplatkit[notebook]"`.

        Args:
            camera: The first view. Default: that of `Scene.camera`.
            size: Width and height on the screen, in pixels of CSS.
            draws: kernel, browser or auto. The browser gets the page that `save_html` writes, and
                draws once it has come; until then the kernel does. `auto` leaves pages above 16 MB
                to the kernel, and what pages do not show.
            drawing: The other options of `render`.
        """
        try:
            from ._widget import Widget
        except ModuleNotFoundError as error:
            if error.name not in ("anywidget", "traitlets"):
                raise
            message = 'Scene.show needs anywidget: pip install "pysplatkit[notebook]"'
            raise ImportError(message, name=error.name) from error
        return Widget(self, camera, size, draws, **drawing)

    @property
    def names(self) -> list[str]:
        """What the items are called, in the order in which they were added."""
        return [item.name for item in self._items]

    @property
    def bounds(self) -> tuple[tuple[float, ...], tuple[float, ...]] | None:
        """The smallest and the largest x, y, z of samples and vertices; None for an empty scene."""
        bounds = self._native.bounds
        return None if bounds is None else (tuple(bounds[0]), tuple(bounds[1]))

    @property
    def contents(self) -> list[tuple[str, str, int]]:
        """What the scene holds: kinds, names of items, and numbers of splats or samples.

        An item may have several: a mesh has its triangles, and its lines.
        """
        names = self.names
        return [(kind, names[item], count) for kind, item, count in self._native.contents]

    def __len__(self) -> int:
        return len(self._items)

    def __contains__(self, name: object) -> bool:
        return name in self.names

    def __repr__(self) -> str:
        items = ", ".join(f"{kind} {name!r} of {count}" for kind, name, count in self.contents)
        return f"<pysplatkit.Scene: {items or 'empty'}>"

    def __copy__(self) -> Scene:
        scene = Scene()
        with self._lock:
            scene._native = self._native.forked(len(self._items))
            scene._items = list(self._items)
        scene._described = dict(self._described)
        return scene

    def __getstate__(self) -> dict[str, Any]:
        with self._lock:
            items = [item.portable() for item in self._items]
        return {"items": items, "described": self._described}

    def __setstate__(self, state: dict[str, Any]) -> None:
        Scene.__init__(self)
        for item in state["items"]:
            self._append(item)
        self._described = state["described"]

    # How items are kept.

    def _added(self, method: str, given: Mapping[str, Any]) -> Scene:
        """Adds an item of the arguments of a method."""
        arguments = {name: given[name] for name in given if name not in ("self", "name")}
        arguments |= arguments.pop("appearance", {})
        if method == "add":
            name = _items.name_of(os.fspath(arguments["source"]))
        else:
            name = method.removeprefix("add_")
        with self._lock:
            name = self._unused(given.get("name"), name)
            self._append(Item.of(name, method, arguments))
        return self

    def _unused(self, name: str | None, usual: str) -> str:
        """Returns the name of a new item: the one that is given, or the usual one."""
        if name is None:
            return _items.unused(usual, self.names)
        if not isinstance(name, str) or not name:
            raise ArgumentError(f"the name of an item is a text, not {name!r}")
        if name in self.names:
            raise ArgumentError(f"the scene has an item {name!r} already; names differ")
        return name

    def _append(self, item: Item) -> None:
        with self._lock:
            item.put(self._native)
            self._items.append(item)

    def _index(self, name: str) -> int:
        if name in self.names:
            return self.names.index(name)
        names = ", ".join(map(repr, self.names)) or "none"
        raise ArgumentError(f"the scene has no item {name!r}; its items are {names}")

    def _replaced(self, at: int, item: Item | None) -> Scene:
        """Puts an item in the place of another, or removes that one. After an error, the scene is
        as before."""
        items = [*([] if item is None else [item]), *self._items[at + 1 :]]
        native = self._native.forked(at)
        for other in items:
            other.put(native)
        self._native, self._items = native, [*self._items[:at], *items]
        return self

    def _set_transfer(self, number: int, transfer: str) -> None:
        """Sets the transfer function of a field, by the number of the field in the contents."""
        with self._lock:
            _pysplatkit.set_transfer(self._native, number, transfer)
            at = self._native.contents[number][1]
            self._items[at] = replace(self._items[at], transfer=transfer)

    # How pictures are drawn.

    def _picture(self, camera: Camera | None, given: Mapping[str, Any]) -> Picture:
        """Draws with options by their names; those that are None are not given."""
        is_placed = camera is not None or given.get("view") is not None
        draw = self._drawing(given, is_placed)
        behind = draw.pop("background", "black")
        # None is transparent.
        if "background" in given and given["background"] is None:
            behind = None
        view = {name: draw.pop(name) for name in _options.VIEW & draw.keys()}
        if camera is not None and view:
            names = ", ".join(sorted(view))
            raise ArgumentError(f"a picture has either a camera or a view; leave {names} out")
        views = given.get("views")
        if "view" in view and views is not None:
            raise ArgumentError("a picture has either a view or views; leave one of them out")
        background = _options.background(behind)
        draw["behind"] = background
        is_fitted = bool(view) or views is not None
        if camera is None and not is_fitted and self._described.get("camera") is not None:
            camera = Camera.from_json(json.dumps(self._described["camera"]))
        fit = {**(self._described.get("framing") or {}), **json.loads(_options.fit(**view))}
        return Picture(self._pixels(camera, draw, json.dumps(fit)), background, draw.get("dpi"))

    def _with_layers(self, picture: Picture, given: Mapping[str, Any]) -> Picture:
        """Draws the layers of a picture that was drawn with these options."""
        layers = given["layers"]
        wanted = layers.split(",") if isinstance(layers, str) else [str(name) for name in layers]
        options = {name: given[name] for name in _GIVEN}
        is_placed = given["camera"] is not None or given["view"] is not None
        draw = self._drawing(options, is_placed)
        for name in ("background", *_options.VIEW):
            draw.pop(name, None)
        camera = picture.camera.to_json()
        known = self._native.layers(camera, _options.drawn(**draw), wanted)
        return Picture(picture._native, picture._background, picture._dpi, known)

    def _drawing(self, given: Mapping[str, Any], is_placed: bool) -> dict[str, Any]:
        """Returns the options of a picture by their names: those that are given, unless they are
        None, and otherwise those of the scene file. A camera or view that is given takes the place
        of the file's views."""
        said: dict[str, Any] = {**(self._described.get("picture") or {})}
        said |= self._described.get("overlay") or {}
        if self._described.get("engine") is not None:
            said["engine"] = self._described["engine"]
        chosen = {name: given[name] for name in given if given[name] is not None}
        if isinstance(chosen.get("views"), str):
            chosen["views"] = chosen["views"].split(",")
        if chosen.get("background") == "auto":
            del chosen["background"]
        if {"cut", "budget"} & chosen.keys():
            for name in ("cut", "budget", "frame_time"):
                said.pop(name, None)
        if {"size", "width", "height"} & chosen.keys():
            for name in ("size", "width", "height"):
                said.pop(name, None)
        if is_placed:
            for name in ("views", "columns", "panel_labels"):
                said.pop(name, None)
        return {**said, **chosen}

    def _pixels(
        self, camera: Camera | None, draw: Mapping[str, Any], fit: str = "{}"
    ) -> _pysplatkit.Picture:
        """Draws with options by their names."""
        text = None if camera is None else camera.to_json()
        return self._native.render(text, fit, _options.drawn(**draw))

    def _said(self, camera: Camera | None, given: Mapping[str, Any], method: str) -> dict[str, Any]:
        """Returns what a scene file says beside the inputs: what is given, and otherwise what the
        scene file says that `open` has read."""
        known = _options.DRAWING | _options.PAGE | _options.VIEW | {"size"}
        options = _options.checked(given, known, method)
        view = {name: options.pop(name) for name in _options.VIEW & options.keys()}
        draw = self._drawing(options, camera is not None or "view" in view)
        if "background" in given:
            draw["background"] = _options.background(given["background"]) or "none"
        framing = self._described.get("framing") or {} if camera is None else {}
        shot = None if camera is None else json.loads(camera.to_json())
        return {
            "camera": self._described.get("camera") if camera is None and not view else shot,
            "framing": {**framing, **json.loads(_options.fit(**view))},
            "engine": draw.pop("engine", None),
            "overlay": {name: draw.pop(name) for name in _options.OVERLAY & draw.keys()},
            "picture": json.loads(_options.drawn(**draw)),
        }

    def _turn(
        self,
        frames: int,
        size: tuple[int, ...],
        view: Mapping[str, Any],
        given: Mapping[str, Any],
    ) -> list[Camera]:
        """Returns the cameras of a turn, which leave room for scalar bars."""
        if frames < 1:
            raise ArgumentError("a turn has at least one frame")
        said = self._described
        names = ("clips", *_options.OVERLAY)
        parts = {**said.get("picture", {}), **(said.get("overlay") or {})}
        draw = {name: {**parts, **given}.get(name) for name in names}
        fit = {**(said.get("framing") or {}), **json.loads(_options.fit(**view))}
        cameras = self._native.turntable(frames, json.dumps(fit), _options.drawn(size, **draw))
        return [Camera.from_json(text) for text in cameras]


#: What else `Scene.add` takes.
_ALSO = "a path, a dictionary of the arguments of a method, "

#: The options of a camera that is fitted, in their order.
_FIT = tuple(View.__annotations__)
#: The options of `Scene.render` beside the camera.
_GIVEN = _options.DRAWING | _options.PAGE | _options.VIEW | {"size"}


def _arguments(source: Any, options: dict[str, Any]) -> tuple[str, dict[str, Any]]:
    """Returns the method that adds a source, and its arguments."""
    if isinstance(source, (str, os.PathLike)):
        return "add", {"source": source, **options}
    parts = _neighbours.parts_of(source, options.get("scalar"))
    if parts is not None:
        options.pop("scalar", None)
        if parts.method == "add_cells" and "cells" in options:
            options["style"] = options.pop("cells")
        return parts.method, {_items.FIRST[parts.method]: parts, **options}
    if isinstance(source, Mapping):
        methods = {
            "array": "add_volume",
            "vertices": "add_mesh",
            "centers": "add_gaussians",
            "points": "add_cells",
            "positions": "add_points",
        }
        if {"positions", "values"} < set(source) and set(source) & {"radii", "covariances"}:
            methods["positions"] = "add_samples"
        for first, method in methods.items():
            if first in source:
                return method, {**source, **options}
        raise _neighbours.unknown(source, "Scene.add", _ALSO)
    shape = np.shape(source)
    if len(shape) == (4 if options.get("channel_axis") is not None else 3):
        return "add_volume", {"array": source, **options}
    if len(shape) == 2 and shape[1] == 3:
        return "add_points", {"positions": source, **options}
    if len(shape) == 0:
        raise _neighbours.unknown(source, "Scene.add", _ALSO)
    raise ArgumentError(
        f"an array of the shape {shape} is neither a volume (z, y, x) nor points (n, 3)"
    )


def _changed(item: Item, source: Any, options: dict[str, Any]) -> Item:
    """Returns an item with other data or other options."""
    if source is None:
        return item.changed(options)
    first = _items.FIRST[item.method]
    is_path = isinstance(source, (str, os.PathLike))
    is_object = not is_path and _neighbours.parts_of(source, options.get("scalar")) is not None
    if not is_path and not is_object and not isinstance(source, Mapping):
        # Rows of three numbers are positions, whatever they are positions of.
        axes = 3 if item.method == "add_volume" else 2
        if item.method != "add" and np.ndim(source) == axes:
            return item.changed({first: source, **options})
    method, arguments = _arguments(source, options)
    arguments.pop("name", None)
    if method != item.method:
        return replace(Item.of(item.name, method, arguments), transform=item.transform)
    if is_object:
        said = _items.SAID[method]
        kept = {name: item.arguments[name] for name in item.arguments if name not in said}
        item = replace(item, arguments=kept)
    return item.changed(arguments)
