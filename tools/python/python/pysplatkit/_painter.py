"""The thread that draws for a widget: a coarse frame at once, then finer ones, up to the exact
picture."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from . import _pysplatkit
from ._errors import Error

#: The wanted time of a moving frame, in milliseconds. With what encoding takes, and the browser
#: beside the kernel, there are then twenty frames a second or more.
MOVING = 25.0
#: A view that changed less than so many seconds ago may still move: it is not refined yet.
CALM = 0.12
#: The effort of the exact picture.
EXACT = (1.0, 1.0)


@dataclass(frozen=True)
class Order:
    """What is to be drawn: a scene, and as JSON a camera, the options of the exact picture, and the
    transfer functions that the scene has then."""

    scene: _pysplatkit.Scene
    camera: str
    draw: str
    transfers: str = ""
    #: The number of the last message of each view of the browser that the order answers.
    answers: Mapping[str, int] = field(default_factory=dict, compare=False)


@dataclass(frozen=True)
class Frame:
    """What was drawn of an order, or why nothing was."""

    order: Order
    picture: _pysplatkit.Picture | None
    is_exact: bool = False
    milliseconds: float = 0.0
    error: Error | None = None


class Painter:
    """Draws the newest order only. Frames of a moving view are finished; one that only refines is
    stopped by the next order. There is a thread only while there is something to draw."""

    def __init__(self, tell: Callable[[Frame], None]) -> None:
        """`tell` is called with each frame, on the thread that draws."""
        self._tell = tell
        self._pace = _pysplatkit.Pace(MOVING)
        self._changed = threading.Condition()
        # All of these are used with the condition's lock only.
        self._order: Order | None = None
        self._is_new = False
        self._since = 0.0
        self._refining: _pysplatkit.Stop | None = None
        self._thread: threading.Thread | None = None

    def order(self, order: Order | None) -> None:
        """Gives an order, which replaces the one before. None ends drawing."""
        with self._changed:
            self._order, self._is_new, self._since = order, True, time.monotonic()
            if self._refining is not None:
                self._refining.request()
            self._changed.notify_all()
            if order is not None and not self._is_drawing():
                self._thread = threading.Thread(target=self._run, name="splatkit", daemon=True)
                self._thread.start()

    def wait(self, seconds: float) -> bool:
        """Waits until nothing is left to draw. Returns whether that is so."""
        with self._changed:
            return self._changed.wait_for(lambda: not self._is_drawing(), seconds)

    def _is_drawing(self) -> bool:
        return self._thread is not None and self._thread.is_alive()

    def _run(self) -> None:
        while (step := self._next()) is not None:
            order, effort, stop = step
            start = time.monotonic()
            try:
                picture = _pysplatkit.render_frame(
                    order.scene, order.camera, order.draw, effort, stop
                )
            except Error as error:
                if not self._is_stopped():
                    self._tell(Frame(order, None, error=error))
                continue
            milliseconds = 1e3 * (time.monotonic() - start)
            self._pace.took(effort, milliseconds)
            self._tell(Frame(order, picture, effort == EXACT, milliseconds))

    def _is_stopped(self) -> bool:
        """Returns whether the frame that failed was stopped by the next order."""
        with self._changed:
            if not self._is_new:
                # What failed is not tried again until something changes.
                self._order = None
                return False
            return self._refining is not None

    def _next(self) -> tuple[Order, tuple[float, float], _pysplatkit.Stop] | None:
        """Waits for the next frame that is to be drawn; None at the end."""
        with self._changed:
            while True:
                self._refining = None
                is_new = self._is_new
                if is_new:
                    self._pace.changed()
                    self._is_new = False
                effort = self._pace.next()
                if self._order is None or effort is None:
                    self._thread = None
                    self._changed.notify_all()
                    return None
                calm = self._since + CALM - time.monotonic()
                if not is_new and calm > 0:
                    self._changed.wait(calm)
                    continue
                stop = _pysplatkit.Stop()
                if not is_new:
                    self._refining = stop
                return self._order, effort, stop
