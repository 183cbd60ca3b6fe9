"""Cameras and clips."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from . import _pysplatkit
from ._values import text, vector


@dataclass
class Camera:
    """Where a picture is taken from, in world units.

    The usual camera of a scene is `Scene.camera()`. Methods change the camera and return it, so
    that calls can follow one another: `camera.azimuth(30).zoom(1.5)`.
    """

    #: The position of the eye.
    position: Sequence[float]
    #: The point in the middle of the picture.
    focal_point: Sequence[float]
    #: The direction that points up in the picture.
    view_up: Sequence[float] = (0.0, 0.0, 1.0)
    #: The full vertical view angle in degrees; None without perspective.
    view_angle: float | None = 30.0
    #: The world height that the picture shows, without perspective; None in perspective.
    height: float | None = None

    def __post_init__(self) -> None:
        if self.height is not None and self.view_angle == 30.0:
            self.view_angle = None

    @classmethod
    def from_json(cls, text: str) -> Camera:
        """Reads the JSON form, which the command prints with `--json` and takes as `--camera`.

        Args:
            text: The JSON.
        """
        parts = json.loads(text)
        vectors = {name: tuple(parts[name]) for name in ("position", "focal_point", "view_up")}
        return cls(**vectors, view_angle=parts.get("view_angle"), height=parts.get("height"))

    def to_json(self) -> str:
        """Returns the JSON form."""
        parts: dict[str, Any] = {
            name: vector(getattr(self, name)) for name in ("position", "focal_point", "view_up")
        }
        return text({**parts, "view_angle": self.view_angle, "height": self.height})

    def azimuth(self, degrees: float) -> Camera:
        """Orbits to the right around the up axis (VTK's Azimuth).

        Args:
            degrees: The angle.
        """
        return self._take(_pysplatkit.moved_camera(self.to_json(), degrees, 0.0, 1.0))

    def elevation(self, degrees: float) -> Camera:
        """Orbits upwards (VTK's Elevation).

        Args:
            degrees: The angle.
        """
        return self._take(_pysplatkit.moved_camera(self.to_json(), 0.0, degrees, 1.0))

    def zoom(self, factor: float) -> Camera:
        """Narrows the view (VTK's Zoom).

        Args:
            factor: How much larger things appear.
        """
        return self._take(_pysplatkit.moved_camera(self.to_json(), 0.0, 0.0, factor))

    def orthographic(self) -> Camera:
        """Removes the perspective; what lies at the focal point keeps its size."""
        return self._take(_pysplatkit.orthographic_camera(self.to_json()))

    def copy(self) -> Camera:
        """Returns a camera that can be changed without changing this one."""
        return Camera.from_json(self.to_json())

    def _take(self, text: str) -> Camera:
        other = Camera.from_json(text)
        self.__dict__.update(other.__dict__)
        return self


@dataclass(frozen=True)
class Clip:
    """A shape that cuts the scene. `Clip.plane` and `Clip.box` make them."""

    #: The shape, as scene files have it.
    shape: dict[str, Any]
    #: Whether what is inside the shape is kept, or what is outside.
    inside: bool = True

    @classmethod
    def plane(cls, normal: Sequence[float], offset: float, *, inside: bool = True) -> Clip:
        """Keeps one side of a plane: the points x with normal · x ≤ offset.

        Args:
            normal: The direction across the plane.
            offset: The place of the plane along the normal.
            inside: False keeps the other side.
        """
        return cls({"plane": [*vector(normal), float(offset)]}, inside)

    @classmethod
    def box(
        cls, minimum: Sequence[float], maximum: Sequence[float], *, inside: bool = True
    ) -> Clip:
        """Keeps what lies in a box along the axes.

        Args:
            minimum: The smallest x, y and z.
            maximum: The largest x, y and z.
            inside: False keeps what lies outside.
        """
        return cls({"box": [vector(minimum), vector(maximum)]}, inside)

    def _entry(self) -> dict[str, Any]:
        return {**self.shape, "inside": self.inside}
