"""The widget for notebooks. It needs the package anywidget."""

from __future__ import annotations

import asyncio
import json
import tempfile
import threading
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import anywidget
import numpy as np
import numpy.typing as npt
import traitlets

from . import _options, _pysplatkit, _values
from ._camera import Camera
from ._errors import ArgumentError, Error
from ._painter import Frame, Order, Painter
from ._picture import Picture
from ._transfer import TransferFunction

if TYPE_CHECKING:
    from ._scene import Scene

_STATIC = Path(__file__).parent / "static"
_OPTIONS = _options.DRAWING
#: What a message of the browser can lead to. It is shown in the widget.
_FAILURES = (Error, ArithmeticError, AttributeError, LookupError, TypeError, ValueError)
#: Most pixels of the screen in a pixel of CSS that are drawn.
_MOST_PIXELS = 3.0
#: What draws: the browser if it can, the browser, or the kernel.
_PLACES = ("auto", "browser", "kernel")
#: Most bytes of a page that the browser gets unasked.
_MOST_PAGE = 16_000_000
#: The bytes of a page that are sent at once.
_CHUNK = 1 << 18


class _CameraTrait(traitlets.Instance[Camera]):
    """A camera that is copied as it is read and set, so that each change is noticed."""

    def __init__(self) -> None:
        super().__init__(Camera, args=((0.0, 0.0, 1.0), (0.0, 0.0, 0.0)))

    def get(self, obj: Any, cls: Any = None) -> Camera:
        return cast(Camera, super().get(obj, cls)).copy()

    def validate(self, obj: Any, value: Any) -> Camera:
        return cast(Camera, super().validate(obj, value)).copy()


class Widget(anywidget.AnyWidget):
    """A picture of a scene that is turned by hand. `Scene.show` returns it.

    Coarse frames follow the hand. When it rests, the exact picture is drawn: the one that
    `Scene.render` returns for `widget.camera`, `widget.pixels` and the same options.

    The kernel draws at once. Meanwhile the browser gets the page that `Scene.save_html` writes, if
    that is not too large, and draws from then on.
    """

    _esm = _STATIC / "widget.js"
    _css = _STATIC / "widget.css"

    #: The camera. A new one may be set, and cameras of several widgets be linked by traitlets.
    camera = _CameraTrait()
    #: Width and height on the screen, in pixels of CSS.
    size = traitlets.Tuple(traitlets.Int(), traitlets.Int()).tag(sync=True)
    #: Which field the editor shows, from 0, if several items have transfer functions.
    field = traitlets.Int(0).tag(sync=True)

    _names: traitlets.List[Any] = traitlets.List().tag(sync=True)
    _ranges: traitlets.List[Any] = traitlets.List().tag(sync=True)
    #: How often the values of each field are; an empty list until they are counted.
    _histograms: traitlets.List[Any] = traitlets.List().tag(sync=True)
    _transfers: traitlets.List[Any] = traitlets.List().tag(sync=True)
    _presets: traitlets.List[Any] = traitlets.List().tag(sync=True)
    _maps: traitlets.List[Any] = traitlets.List().tag(sync=True)
    #: The exact picture as PNG; empty while coarser ones are shown.
    _still = traitlets.Bytes(b"").tag(sync=True)
    #: What is shown: its size and the milliseconds that it took.
    _status = traitlets.Dict().tag(sync=True)
    _error = traitlets.Unicode("").tag(sync=True)
    #: Whether the browser may ask for a page that it draws itself.
    _has_page = traitlets.Bool(False).tag(sync=True)

    _painter: Painter | None = None
    #: The camera that the browser has moved, as JSON, until that is known here.
    _moved: str | None = None

    def __init__(
        self,
        scene: Scene,
        camera: Camera | None = None,
        size: tuple[int, int] = (800, 600),
        draws: str = "auto",
        **drawing: Any,
    ) -> None:
        if draws not in _PLACES:
            raise ArgumentError(f"draws is one of {', '.join(_PLACES)}, not {draws!r}")
        self._scene = scene
        self._place = draws
        # The page that the browser draws, and whether it does.
        self._page: bytes | None = None
        self._is_local = False
        self._drawing = _options.checked(drawing, _OPTIONS, "show")
        self._background = _options.background(drawing.get("background", "black"))
        self._drawing.pop("background", None)
        self._ratio = 1.0
        self._orders = 0
        # The number of the last message of each view of the browser.
        self._answers: dict[str, int] = {}
        self._lock = threading.Lock()
        self._arrived: tuple[Frame, bytes] | None = None
        self._exact: Frame | None = None
        self._shown: _pysplatkit.Picture | None = None
        self._grabbed: list[float] | None = None
        self._loop = _running_loop()
        # Refuses sizes and options that cannot be drawn.
        scene._native.check(self._draws(size))
        start = self._fitted(size) if camera is None else camera
        _pysplatkit.moved_by_hand(
            scene._native, start.to_json(), size, '{"turn": {"drag": [0, 0]}}'
        )
        super().__init__(
            camera=start,
            size=size,
            _has_page=draws != "kernel",
            _presets=list(_pysplatkit.TRANSFER_FUNCTIONS),
            _maps=list(_pysplatkit.COLOR_MAPS),
        )
        self._fields: list[dict[str, Any]] = []
        self._painter = Painter(self._take_frame)
        self.on_msg(self._take_message)
        self.refresh()

    # What programs use.

    @property
    def pixels(self) -> tuple[int, int]:
        """Width and height of the exact picture: `size` times the pixels of the screen in one of
        CSS, which the browser tells."""
        width, height = (max(1, round(side * self._ratio)) for side in self.size)
        return width, height

    @property
    def transfer(self) -> TransferFunction | None:
        """The transfer function of `field`; None if the scene has none.

        It can be set: to a `TransferFunction`, a name, a JSON file or its text. Functions belong to
        the scene, so that `Scene.render` and other widgets of the scene draw with it, too.
        """
        if not self._transfers:
            return None
        return TransferFunction.from_json(json.dumps(self._transfers[self.field]))

    @transfer.setter
    def transfer(self, value: Any) -> None:
        if not self._transfers:
            raise ArgumentError("the scene has no field, and so no transfer function")
        function = TransferFunction.of(value)
        if isinstance(function, str):
            function = self._named(self.field, function)
        self._set_transfer(
            self.field, json.loads(_pysplatkit.checked_transfer(json.dumps(function)))
        )

    def snapshot(self) -> npt.NDArray[np.uint8]:
        """Returns the exact picture: red, green, blue and opacity, (height, width, 4) bytes."""
        order = self._order()
        with self._lock:
            exact = self._exact
        if exact is not None and exact.order == order and exact.picture is not None:
            return Picture(exact.picture, self._background).rgba
        picture = self._scene._native.render(order.camera, "{}", order.draw)
        return Picture(picture, self._background).rgba

    def refresh(self) -> None:
        """Draws the scene again: after items were added or changed, or a transfer function was
        changed elsewhere."""
        native, items = self._scene._native, self._scene._items
        fields = json.loads(_pysplatkit.fields(native))
        contents = native.contents
        known = {id(field["of"]): field for field in self._fields}
        histograms = dict(zip(known, self._histograms, strict=True))
        self._fields = []
        for field in fields:
            # Arguments are those of an item as long as nothing but its function changes.
            of = items[contents[field["item"]][1]].arguments
            before = known.get(id(of))
            # “As loaded” is the function that the item came with.
            loaded = field["transfer"] if before is None else before["transfer"]
            self._fields.append({**field, "of": of, "transfer": loaded})
        with self.hold_sync():
            self.field = max(0, min(self.field, len(fields) - 1))
            self._names = [items[contents[field["item"]][1]].name for field in fields]
            self._ranges = [field["range"] for field in fields]
            self._histograms = [histograms.get(id(field["of"]), []) for field in self._fields]
            self._transfers = [field["transfer"] for field in fields]
        if self._page is not None or self._is_local:
            # The browser asks for the new page.
            self._page, self._is_local = None, False
            self.send({"type": "stale"})
        for number, counts in enumerate(self._histograms):
            if not counts:
                threading.Thread(target=self._count, args=(number,), daemon=True).start()
        self._draw()

    def close(self) -> None:
        """Ends drawing and removes the widget from the page."""
        if self._painter is not None:
            self._painter.order(None)
        super().close()

    # What the browser asks for.

    def _take_message(self, _: Any, content: Any, __: Any = None) -> None:
        self._loop = _running_loop() or self._loop
        before = self._orders
        if "view" in content:
            self._answers = {**self._answers, str(content["view"]): int(content["number"])}
        try:
            for kind, details in content["do"]:
                getattr(self, f"_on_{kind}")(**details)
        except _FAILURES as error:
            self._error = str(error) or repr(error)
        if self._orders == before:
            # No frame follows, which the browser would wait for.
            self.send({"type": "idle", "answers": self._answers})

    def _on_ready(self, ratio: float) -> None:
        """A view is there. Its screen has `ratio` pixels in one of CSS."""
        ratio = min(max(float(ratio), 1.0), _MOST_PIXELS)
        if ratio != self._ratio:
            self._ratio = ratio
            self._draw()

    def _on_turn(self, drag: list[float]) -> None:
        self._move(turn={"drag": drag})

    def _on_look_around(self, drag: list[float]) -> None:
        self._move(look_around={"drag": drag})

    def _on_grab(self, cursor: list[float]) -> None:
        """Takes hold of the point under the cursor, for the drag that follows."""
        self._grabbed = self._picked(cursor)

    def _on_pan(self, drag: list[float]) -> None:
        self._move(pan={"drag": drag, "point": self._grabbed})

    def _on_zoom(self, factor: float, cursor: list[float]) -> None:
        self._move(zoom={"factor": factor, "cursor": cursor, "point": self._picked(cursor)})

    def _on_center(self, cursor: list[float]) -> None:
        point = self._picked(cursor)
        if point is not None:
            self._move(center={"point": point})

    def _on_projection(self) -> None:
        self._move(orthographic=self.camera.height is None)

    def _on_view(self, name: str | None = None) -> None:
        self.camera = self._fitted(self.size, view=name)

    def _on_preset(self, field: int, name: str) -> None:
        """Sets a transfer function by name; the one that the field came with if it is empty."""
        function = self._named(field, name) if name else self._fields[field]["transfer"]
        self._set_transfer(field, function)

    def _on_colors(self, field: int, name: str) -> None:
        """Sets the colours of a map."""
        function = json.dumps(self._transfers[field])
        text = _pysplatkit.recolored(function, name, tuple(self._ranges[field]))
        self._set_transfer(field, json.loads(text))

    def _on_transfer(self, field: int, transfer: dict[str, Any]) -> None:
        text = _pysplatkit.checked_transfer(json.dumps(transfer))
        self._set_transfer(field, json.loads(text))

    def _on_camera(self, camera: dict[str, Any]) -> None:
        """The browser has moved the camera, and draws by itself."""
        moved = Camera.from_json(json.dumps(camera))
        self._moved = moved.to_json()
        self.camera = moved

    def _on_local(self, is_local: bool) -> None:
        """The browser draws from now on, or no longer does."""
        self._is_local = bool(is_local)
        if self._is_local and self._painter is not None:
            self._painter.order(None)
        elif not self._is_local:
            self._draw()

    def _on_page(self, number: int) -> None:
        """Sends a part of the page that the browser draws."""
        if self._page is None:
            threading.Thread(target=self._make_page, daemon=True).start()
        else:
            self._send_page(number)

    # How that is done.

    def _make_page(self) -> None:
        """Makes the page, on a thread of its own."""
        scene, drawing = self._scene, dict(self._drawing)
        for name in _options.OVERLAY & drawing.keys():
            del drawing[name]
        reason = ""
        page = b""
        try:
            with tempfile.TemporaryDirectory() as folder:
                path = Path(folder) / "page.html"
                behind = self._background or "none"
                scene.save_html(path, self.camera, background=behind, **drawing)
                page = path.read_bytes()
            if self._place == "auto" and len(page) > _MOST_PAGE:
                reason = f"the page has {len(page) / 1e6:.0f} MB"
        except _FAILURES as error:
            reason = str(error)

        def take() -> None:
            if reason:
                self._has_page = False
                if self._place == "browser":
                    self._error = f"The kernel draws, and not the browser: {reason}"
                return
            self._page = page
            self._send_page(0)

        self._later(take)

    def _send_page(self, number: int) -> None:
        page = self._page or b""
        count = -(-len(page) // _CHUNK)
        part = page[number * _CHUNK : (number + 1) * _CHUNK]
        self.send({"type": "page", "number": number, "count": count}, [part])

    def _draws(self, size: tuple[int, int]) -> str:
        return _options.drawn(size, behind=self._background, **self._drawing)

    def _fitted(self, size: tuple[int, int], view: str | None = None) -> Camera:
        text = self._scene._native.camera(_options.fit(view=view), self._draws(size))
        return Camera.from_json(text)

    def _order(self) -> Order:
        transfers = json.dumps(self._transfers)
        return Order(
            self._scene._native,
            self.camera.to_json(),
            self._draws(self.pixels),
            transfers,
            self._answers,
        )

    def _draw(self) -> None:
        if self._is_local:
            # What the browser itself has moved, it shows already.
            camera = self.camera.to_json()
            if self._moved != camera:
                self.send({"type": "camera", "camera": json.loads(camera)})
            self._moved = None
        elif self._painter is not None:
            self._orders += 1
            self._still = b""
            self._painter.order(self._order())

    @traitlets.observe("camera", "size")
    def _changed(self, _: Any) -> None:
        self._draw()

    def _move(self, **gesture: Any) -> None:
        text = _values.text(gesture)
        before = self.camera.to_json()
        moved = _pysplatkit.moved_by_hand(self._scene._native, before, self.pixels, text)
        self.camera = Camera.from_json(moved)

    def _picked(self, cursor: list[float]) -> list[float] | None:
        """Returns the world point under the cursor in the picture that is shown."""
        if self._shown is None:
            return None
        x, y = map(float, cursor)
        return _pysplatkit.picked(self._shown, self.pixels, (x, y))

    def _named(self, field: int, name: str) -> dict[str, Any]:
        """Returns a preset for a field. Light fades where the gradient is noise, as before."""
        entry = self._fields[field]
        text = _pysplatkit.named_transfer(name, entry["range"], entry["diagonal"])
        named: dict[str, Any] = json.loads(text)
        certain = (entry["transfer"].get("shade") or {}).get("certain")
        if named.get("shade") and certain is not None:
            named["shade"]["certain"] = certain
        return named

    def _set_transfer(self, field: int, transfer: dict[str, Any]) -> None:
        self._scene._set_transfer(self._fields[field]["item"], json.dumps(transfer))
        transfers = list(self._transfers)
        transfers[field] = transfer
        self._transfers = transfers
        self._draw()

    def _count(self, field: int) -> None:
        """Counts the values of a field, on a thread of its own."""
        entry = self._fields[field]
        counts = _pysplatkit.histogram(self._scene._native, entry["item"])

        def take() -> None:
            # The scene may have changed meanwhile.
            if field < len(self._fields) and self._fields[field]["of"] is entry["of"]:
                histograms = list(self._histograms)
                histograms[field] = counts
                self._histograms = histograms

        self._later(take)

    def _take_frame(self, frame: Frame) -> None:
        """Takes a frame from the thread that draws. The kernel shows the newest when it is free."""
        png = b"" if frame.picture is None else frame.picture.png(self._background)
        with self._lock:
            is_first, self._arrived = self._arrived is None, (frame, png)
            if frame.is_exact:
                self._exact = frame
        if is_first:
            self._later(self._show_frame)

    def _show_frame(self) -> None:
        with self._lock:
            arrived, self._arrived = self._arrived, None
        if arrived is None or self.comm is None:
            return
        frame, png = arrived
        if frame.picture is None:
            self._error = str(frame.error)
            self.send({"type": "idle", "answers": dict(frame.order.answers)})
            return
        self._shown = frame.picture
        is_exact = frame.is_exact and frame.order == self._order()
        size, took = frame.picture.size, frame.milliseconds
        status = {"size": size, "exact": is_exact, "milliseconds": took}
        answers = {"answers": dict(frame.order.answers)}
        if not is_exact:
            # One message a frame: the status goes with it.
            self._error = ""
            self.send({"type": "frame", **status, **answers}, [png])
            return
        with self.hold_sync():
            self._error = ""
            self._status = {**status, **answers}
            self._still = png

    def _later(self, call: Callable[[], None]) -> None:
        """Calls a function on the kernel's thread, which alone may send messages."""
        if self._loop is None or self._loop.is_closed():
            call()
        else:
            self._loop.call_soon_threadsafe(call)


def _running_loop() -> asyncio.AbstractEventLoop | None:
    try:
        return asyncio.get_running_loop()
    except RuntimeError:
        return None
