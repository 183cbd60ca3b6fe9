"""The widget for notebooks, without a browser: what it answers to the messages of one."""

from __future__ import annotations

import asyncio
import json
import subprocess
import sys
import threading
import time

import numpy as np
import pytest
from conftest import ball, blob, particles

import pysplatkit
from pysplatkit import Camera, Scene, TransferFunction, _painter

pytest.importorskip("anywidget", reason="anywidget is not installed")

SIZE = (96, 72)


@pytest.fixture(scope="module")
def scene():
    return Scene().add_volume(blob())


@pytest.fixture
def widget(scene):
    opened = scene.show(size=SIZE)
    rest(opened)
    yield opened
    opened.close()


def rest(widget):
    """Waits for the exact picture."""
    assert widget._painter.wait(60)
    return widget


def tell(widget, *gestures):
    """Does what a browser asks for."""
    widget._take_message(widget, {"do": [list(gesture) for gesture in gestures]}, [])
    return rest(widget)


def pixels(png, tmp_path):
    from conftest import read_png

    file = tmp_path / "shown.png"
    file.write_bytes(png)
    return read_png(file)


def messages(widget):
    """Returns a list that all further messages to the browser are added to."""
    sent = []
    widget.send = lambda content, buffers=None: sent.append((content, buffers))
    return sent


def test_the_still_picture_is_that_of_render(scene, widget, tmp_path):
    for gesture in (("ready", {"ratio": 1}), ("turn", {"drag": [30, 10]})):
        tell(widget, gesture)
        wanted = scene.render(SIZE, widget.camera).rgba
        still = pixels(widget._still, tmp_path)
        assert np.array_equal(still, wanted[..., : still.shape[2]])
        assert np.array_equal(widget.snapshot(), wanted)
        assert widget._status["exact"] and tuple(widget._status["size"]) == SIZE


def test_options_and_screens_with_small_pixels(scene):
    clip = pysplatkit.Clip.plane((1, 0, 0), 12)
    options = {"background": "white", "clips": [clip], "shade": False}
    widget = rest(scene.show(scene.camera(SIZE, view="left"), SIZE, **options))
    assert widget.camera == scene.camera(SIZE, view="left")
    tell(widget, ("ready", {"ratio": 1.5}))
    assert widget.pixels == (144, 108)
    wanted = scene.render((144, 108), widget.camera, **options).rgba
    assert np.array_equal(widget.snapshot(), wanted)


def test_wrong_options_are_refused_at_once(scene):
    for camera in (None, scene.camera(SIZE)):
        with pytest.raises(pysplatkit.ArgumentError, match="optics"):
            scene.show(camera, SIZE, optics="bright")
        with pytest.raises(TypeError, match="optic"):
            scene.show(camera, SIZE, optic="light")


def test_gestures_move_the_camera(scene, widget):
    home = widget.camera
    distance = np.linalg.norm(np.subtract(home.position, home.focal_point))
    tell(widget, ("turn", {"drag": [20, 0]}))
    turned = widget.camera
    assert turned.focal_point == home.focal_point and turned.position != home.position
    after = np.linalg.norm(np.subtract(turned.position, turned.focal_point))
    assert after == pytest.approx(distance)
    tell(widget, ("grab", {"cursor": [48, 36]}), ("pan", {"drag": [9, 4]}))
    assert widget.camera.focal_point != home.focal_point
    tell(widget, ("zoom", {"factor": 2, "cursor": [48, 36]}))
    closer = widget.camera
    after = np.linalg.norm(np.subtract(closer.position, closer.focal_point))
    assert after == pytest.approx(distance / 2)
    tell(widget, ("projection", {}))
    assert widget.camera.height is not None
    tell(widget, ("view", {"name": "top"}))
    assert widget.camera == scene.camera(SIZE, view="top")
    tell(widget, ("view", {}))
    assert widget.camera == home


def test_the_point_under_the_cursor_stays_there(scene, widget):
    """A double click brings the point to the middle; a zoom leaves it where it is."""
    cursor = [40.5, 30.5]
    point = widget._picked(cursor)
    assert point is not None
    before = np.linalg.norm(np.subtract(widget.camera.position, point))
    tell(widget, ("zoom", {"factor": 1.3, "cursor": cursor}))
    assert place(widget.camera, point) == pytest.approx(cursor, abs=1e-6)
    after = np.linalg.norm(np.subtract(widget.camera.position, point))
    assert after == pytest.approx(before / 1.3)
    tell(widget, ("view", {}))
    tell(widget, ("center", {"cursor": cursor}))
    assert widget.camera.focal_point == pytest.approx(point)
    before = widget.camera
    # Nothing is in the corner.
    tell(widget, ("center", {"cursor": [0.5, 0.5]}))
    assert widget.camera == before


def place(camera, point):
    """Returns where a camera shows a point."""
    forward = np.subtract(camera.focal_point, camera.position)
    forward = forward / np.linalg.norm(forward)
    right = np.cross(forward, camera.view_up)
    right = right / np.linalg.norm(right)
    down = np.cross(forward, right)
    offset = np.subtract(point, camera.position)
    scale = SIZE[1] / 2 / np.tan(np.radians(camera.view_angle / 2)) / (offset @ forward)
    return [SIZE[0] / 2 + offset @ right * scale, SIZE[1] / 2 + offset @ down * scale]


def test_the_camera_is_read_and_set(scene, widget):
    seen = []
    widget.observe(lambda change: seen.append(change.new), "camera")
    widget.camera = widget.camera.azimuth(40)
    assert len(seen) == 1
    assert np.array_equal(rest(widget).snapshot(), scene.render(SIZE, widget.camera).rgba)
    # What was read is a copy.
    before = widget.snapshot()
    widget.camera.azimuth(90)
    assert np.array_equal(rest(widget).snapshot(), before)
    with pytest.raises(Exception, match="camera"):
        widget.camera = "left"


def test_transfer_functions_are_edited():
    scene = Scene().add_mesh(*ball()).add_volume(blob())
    widget = rest(scene.show(size=SIZE))
    loaded, before = widget.transfer, widget.snapshot()
    edited = json.loads(loaded.to_json())
    edited["opacity"][-1][1] = 0.05
    tell(widget, ("transfer", {"field": 0, "transfer": edited}))
    assert widget.transfer.opacities[-1][1] == 0.05
    assert not np.array_equal(widget.snapshot(), before)
    # The scene draws with it, too.
    assert np.array_equal(widget.snapshot(), scene.render(SIZE, widget.camera).rgba)
    tell(widget, ("preset", {"field": 0, "name": ""}))
    assert widget.transfer == loaded and np.array_equal(widget.snapshot(), before)
    tell(widget, ("colors", {"field": 0, "name": "viridis"}))
    assert widget.transfer.opacities == loaded.opacities
    assert widget.transfer.colors != loaded.colors
    widget.transfer = "generic"
    assert np.array_equal(rest(widget).snapshot(), scene.render(SIZE, widget.camera).rgba)
    function = TransferFunction([(0, "red")], [(0.2, 0.0), (0.5, 0.9)], unit=2.0)
    widget.transfer = function
    assert widget.transfer == TransferFunction.from_json(function.to_json())


def test_an_edited_function_is_that_of_a_new_scene(scene, tmp_path):
    """A renderer that is kept draws with a new function as a new renderer does."""
    function = TransferFunction([(0, "red"), (1, "blue")], [(0.1, 0.0), (0.6, 0.8)])
    first = Scene().add_volume(blob())
    first.render(SIZE)
    widget = rest(first.show(first.camera(SIZE, view="front"), SIZE))
    widget.transfer = function
    wanted = Scene().add_volume(blob(), transfer=function).render(SIZE, widget.camera)
    assert np.array_equal(rest(widget).snapshot(), wanted.rgba)


def test_histograms_count_all_samples(widget):
    deadline = time.monotonic() + 20
    while not widget._histograms[0] and time.monotonic() < deadline:
        time.sleep(0.01)
    assert sum(widget._histograms[0]) == blob().size
    assert widget._ranges[0] == pytest.approx([blob().min(), blob().max()])


def test_items_that_are_added_later_are_drawn_by_refresh():
    scene = Scene().add_mesh(*ball())
    widget = rest(scene.show(size=SIZE))
    assert widget.transfer is None and not widget._transfers
    with pytest.raises(pysplatkit.ArgumentError, match="no field"):
        widget.transfer = "generic"
    before = widget._still
    scene.add_volume(2 + blob(), origin=(2, 0, 0), spacing=0.1, name="late")
    widget.refresh()
    assert rest(widget)._names == ["late"] and widget.transfer is not None
    assert widget._still != before
    assert np.array_equal(widget.snapshot(), scene.render(SIZE, widget.camera).rgba)


def test_changed_items_are_drawn_by_refresh():
    scene = Scene().add_mesh(*ball()).add_volume(blob(), name="first")
    scene.add_volume(2 + blob(), origin=(2, 0, 0), spacing=0.1, name="second")
    widget = rest(scene.show(size=SIZE))
    widget.field = 1
    function = TransferFunction([(0, "red")], [(0.2, 0.0), (0.5, 0.9)])
    tell(widget, ("transfer", {"field": 0, "transfer": json.loads(function.to_json())}))
    edited = widget._transfers[0]
    # What was edited stays as the items around it change.
    scene.transform("mesh", scale=0.5).update("second", 3 + blob())
    widget.refresh()
    assert rest(widget)._names == ["first", "second"] and widget._transfers[0] == edited
    assert np.array_equal(widget.snapshot(), scene.render(SIZE, widget.camera).rgba)
    scene.remove("second")
    widget.refresh()
    assert rest(widget)._names == ["first"] and widget.field == 0
    # “As loaded” is the function that the volume came with.
    tell(widget, ("preset", {"field": 0, "name": ""}))
    assert widget._transfers[0] != edited
    wanted = Scene().add_mesh(*ball()).transform("mesh", scale=0.5).add_volume(blob())
    assert np.array_equal(widget.snapshot(), wanted.render(SIZE, widget.camera).rgba)


def test_every_message_is_answered(widget):
    """Each view of the browser hears up to which of its messages a frame goes."""
    sent = messages(widget)
    turn = [["turn", {"drag": [4, 1]}]]
    for number in range(1, 9):
        content = {"do": turn, "view": "one", "number": number}
        widget._take_message(widget, content, [])
    widget._take_message(widget, {"do": turn, "view": "two", "number": 5}, [])
    rest(widget)
    assert widget._status["exact"] and widget._status["answers"] == {"one": 8, "two": 5}
    numbers = [content["answers"]["one"] for content, _ in sent]
    assert numbers == sorted(numbers) and numbers
    # One that changes nothing is answered, too.
    sent.clear()
    content = {"do": [["no such gesture", {}]], "view": "one", "number": 9}
    widget._take_message(widget, content, [])
    assert sent == [({"type": "idle", "answers": {"one": 9, "two": 5}}, None)]


def test_errors_are_told_and_pass(widget):
    sent = messages(widget)
    for gesture in (
        ("preset", {"field": 0, "name": "no such name"}),
        ("transfer", {"field": 0, "transfer": {"color": []}}),
        ("turn", {"drag": [float("nan"), 0]}),
        ("no such gesture", {}),
    ):
        widget._error = ""
        sent.clear()
        tell(widget, gesture)
        assert widget._error
        assert sent == [({"type": "idle", "answers": {}}, None)]
    tell(widget, ("turn", {"drag": [3, 3]}))
    assert widget._error == "" and widget._still
    # A picture that cannot be drawn is an error, too, and the next one is drawn again.
    widget.camera = Camera((0, 0, 0), (0, 0, 0))
    assert rest(widget)._error and not widget._still
    tell(widget, ("view", {}))
    assert widget._error == "" and widget._still


def test_wrong_arguments_are_refused_at_once(scene):
    with pytest.raises(TypeError, match="background"):
        scene.show(bakground="white")
    with pytest.raises(pysplatkit.ArgumentError):
        scene.show(size=(0, 100))
    with pytest.raises(pysplatkit.ArgumentError, match="mode"):
        scene.show(mode="fast")
    with pytest.raises(pysplatkit.NothingToDrawError):
        Scene().show()


def test_moving_frames_are_coarse_and_stale_ones_are_dropped():
    scene = Scene().add_volume(blob((64, 64, 64)))
    widget = rest(scene.show(size=(640, 480)))
    sent = messages(widget)
    begun = time.monotonic()
    count = 60
    for _ in range(count):
        widget._take_message(widget, {"do": [["turn", {"drag": [4, 1]}]]}, [])
        time.sleep(0.005)
    sending = time.monotonic() - begun
    rest(widget)
    frames = [content for content, _ in sent if content["type"] == "frame"]
    # Messages are answered at once, and no frame is drawn for each of them.
    assert sending < 3.0
    assert 1 <= len(frames) < count
    assert frames[0]["size"][0] < 640 and not frames[0]["exact"]
    assert widget._status["exact"]
    assert np.array_equal(widget.snapshot(), scene.render((640, 480), widget.camera).rgba)


def test_a_frame_that_refines_is_stopped_by_the_next_order(monkeypatch):
    class Stop(threading.Event):
        request = threading.Event.set

    begun = threading.Event()

    def render_frame(scene, camera, draw, effort, stop):
        if effort == _painter.EXACT and camera == "first":
            begun.set()
            assert stop.wait(20)
            raise pysplatkit.Error("stopped")
        return camera

    frames = []
    monkeypatch.setattr(_painter._pysplatkit, "Stop", Stop)
    monkeypatch.setattr(_painter._pysplatkit, "render_frame", render_frame)
    painter = _painter.Painter(frames.append)
    painter.order(_painter.Order(None, "first", ""))
    assert begun.wait(20)
    painter.order(_painter.Order(None, "second", ""))
    assert painter.wait(20)
    assert frames[0].order.camera == "first" and not any(frame.error for frame in frames)
    assert frames[-1].order.camera == "second" and frames[-1].is_exact
    assert all(not frame.is_exact for frame in frames[:-1])
    # The end of drawing is an order, too.
    begun.clear()
    painter.order(_painter.Order(None, "first", ""))
    assert begun.wait(20)
    painter.order(None)
    assert painter.wait(20) and not frames[-1].is_exact


def test_the_kernel_goes_on_while_a_picture_is_drawn():
    """Frames come from a thread, and are sent by the thread of the event loop."""
    scene = Scene().add_volume(blob((48, 48, 48)))

    async def kernel():
        widget = scene.show(size=(480, 360))
        senders = set()
        widget.observe(lambda _: senders.add(threading.current_thread()), "_status")
        longest, last = 0.0, time.monotonic()
        deadline = last + 60
        while not widget._still and time.monotonic() < deadline:
            await asyncio.sleep(0.001)
            longest, last = max(longest, time.monotonic() - last), time.monotonic()
        assert widget._still and senders == {threading.current_thread()}
        return longest, widget._status["milliseconds"]

    longest, picture = asyncio.run(kernel())
    assert longest < max(100.0, 0.5 * picture) / 1000


def test_several_widgets_of_one_scene(scene):
    sides = ["front", "right", "top"]
    widgets = [scene.show(scene.camera(SIZE, view=side), SIZE) for side in sides]
    for side, widget in zip(sides, widgets, strict=True):
        wanted = scene.render(SIZE, scene.camera(SIZE, view=side)).rgba
        assert np.array_equal(rest(widget).snapshot(), wanted)
        widget.close()
        assert rest(widget)._painter._order is None


def test_without_anywidget_the_error_says_what_to_install():
    code = """
import sys
sys.modules["anywidget"] = None
import numpy, pysplatkit
try:
    pysplatkit.Scene().add_volume(numpy.random.rand(4, 4, 4)).show()
except ImportError as error:
    print(error)
"""
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert 'pip install "pysplatkit[notebook]"' in ran.stdout


def test_the_browser_draws_the_page_of_the_scene(scene, viewer, monkeypatch, tmp_path):
    monkeypatch.setenv("SPLATKIT_VIEWER", str(viewer))
    widget = rest(scene.show(size=SIZE, background="white", scalar_bar=True))
    sent = messages(widget)
    assert widget._has_page
    parts = []
    while not parts or len(parts) < parts[0][0]["count"]:
        tell(widget, ("page", {"number": len(parts)}))
        pages = eventually(lambda: [m for m in sent if m[0]["type"] == "page"][len(parts) :])
        parts.append(pages[0])
    scene.save_html(tmp_path / "a.html", widget.camera, viewer=viewer, background="white")
    assert b"".join(part[1][0] for part in parts) == (tmp_path / "a.html").read_bytes()

    # The kernel no longer draws, but knows the camera.
    tell(widget, ("local", {"is_local": True}))
    sent.clear()
    camera = json.loads(scene.camera(SIZE, view="left").to_json())
    tell(widget, ("camera", {"camera": camera}))
    assert widget.camera == scene.camera(SIZE, view="left")
    assert {message["type"] for message, _ in sent} == {"idle"}
    widget.camera = scene.camera(SIZE, view="top")
    assert [m["camera"] for m, _ in sent if m["type"] == "camera"] == [
        json.loads(widget.camera.to_json())
    ]
    wanted = scene.render(SIZE, widget.camera, background="white", scalar_bar=True).rgba
    assert np.array_equal(widget.snapshot(), wanted)
    # A changed scene has another page. Until it is there, the kernel draws.
    widget.refresh()
    assert [m["type"] for m, _ in sent].count("stale") == 1 and not widget._is_local
    widget.close()


def test_the_kernel_draws_what_no_page_shows(viewer, monkeypatch, scene):
    with pytest.raises(pysplatkit.ArgumentError, match="draws is one of"):
        scene.show(draws="moon")
    assert not scene.show(size=SIZE, draws="kernel")._has_page
    monkeypatch.setenv("SPLATKIT_VIEWER", str(viewer))
    positions, values = particles()
    samples = Scene().add_samples(positions, values, radii=np.full(len(values), 0.2))
    widget = rest(samples.show(size=SIZE, draws="browser"))
    tell(widget, ("page", {"number": 0}))
    assert "scattered samples" in eventually(lambda: widget._error)
    assert not widget._has_page


def eventually(found):
    """Waits until a function returns something."""
    for _ in range(600):
        if answer := found():
            return answer
        time.sleep(0.05)
    raise AssertionError("nothing came")
