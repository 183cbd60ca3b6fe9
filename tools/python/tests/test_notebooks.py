"""The widget in JupyterLab and in marimo, driven by a real browser."""

from __future__ import annotations

import json
import os
import time

import numpy as np
import pytest
from notebooks import CHROMIUM, PATIENCE, drag_frames, jupyterlab, marimo

for name in ("anywidget", "jupyterlab", "marimo", "playwright"):
    pytest.importorskip(name, reason=f"{name} is not installed")
if CHROMIUM is None:
    pytest.skip("there is no chromium", allow_module_level=True)

from playwright.sync_api import sync_playwright

SIZE = (320, 240)

#: What a notebook does. Whenever a picture is exact, it writes what `Scene.render` draws.
CELL = f"""
import json, os
import numpy as np
import pysplatkit

z, y, x = np.meshgrid(*3 * [np.linspace(-1, 1, 40)], indexing="ij")
values = np.exp(-6 * ((x - 0.2) ** 2 + y**2 + (z + 0.1) ** 2)) + 0.1 * x
scene = pysplatkit.Scene().add_volume(values)
widget = scene.show(size={SIZE}, draws="kernel")

def write(change):
    if change.new:
        rgba = scene.render(widget.pixels, widget.camera).rgba
        facts = {{
            "position": widget.camera.position,
            "opacities": widget.transfer.opacities,
            "color": widget.transfer.colors[-1],
            "pixels": rgba.ravel().tolist(),
        }}
        with open("new.json", "w") as file:
            json.dump(facts, file)
        os.replace("new.json", "facts.json")

widget.observe(write, "_still")
if widget._still:
    write(type("Change", (), {{"new": True}}))
"""


@pytest.fixture(scope="module", params=[jupyterlab, marimo], ids=lambda server: server.__name__)
def notebook(request, tmp_path_factory):
    """Returns a page that shows the widget, and the folder of its notebook."""
    folder = tmp_path_factory.mktemp(request.param.__name__)
    with request.param(folder, CELL) as start, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 1300, "height": 1000})
        errors = []
        page.on("pageerror", lambda error: errors.append(str(error)))
        start(page)
        try:
            page.wait_for_selector(".splatkit canvas", timeout=1000 * PATIENCE)
            yield NotebookPage(page, folder)
        except Exception:
            print((folder / "log.txt").read_text())
            raise
        browser.close()
        assert not [error for error in errors if "splatkit" in error]


class NotebookPage:
    """A widget on a page."""

    def __init__(self, page, folder):
        self.page, self.folder = page, folder

    def pixels(self):
        """Returns the pixels that the page shows."""
        script = """canvas => {
            const { width, height } = canvas;
            const pixels = canvas.getContext("2d").getImageData(0, 0, width, height).data;
            return [width, height, Array.from(pixels)];
        }"""
        width, height, flat = self.page.locator(".splatkit canvas").evaluate(script)
        return np.array(flat, np.uint8).reshape(height, width, 4)

    def facts(self):
        """Returns what the kernel has written last."""
        file = self.folder / "facts.json"
        return json.loads(file.read_text()) if file.exists() else None

    def rest(self, is_new=lambda facts: True):
        """Waits until the page shows what `Scene.render` draws of a new state. Returns that."""
        deadline = time.monotonic() + PATIENCE
        while time.monotonic() < deadline:
            facts = self.facts()
            if facts and is_new(facts) and self.state() == "exact":
                pixels = self.pixels()
                if pixels.ravel().tolist() == facts["pixels"]:
                    assert pixels.shape == (SIZE[1], SIZE[0], 4)
                    return facts
            time.sleep(0.1)
        log = (self.folder / "log.txt").read_text()
        error = self.page.locator(".splatkit-error").text_content()
        pytest.fail(f"no exact picture of the new state: {self.state()} {error!r}\n{log}")

    def state(self):
        return self.page.locator(".splatkit-picture").get_attribute("data-shown")

    def drag(self, place, by, steps=12, **keys):
        """Drags the pointer from a place. Returns the states of the picture on the way."""
        mouse, states = self.page.mouse, set()
        mouse.move(*place)
        mouse.down(**keys)
        for step in range(1, steps + 1):
            x, y = (at + way * step / steps for at, way in zip(place, by, strict=True))
            mouse.move(x, y)
            time.sleep(0.05)
            states.add(self.state())
        mouse.up(**keys)
        return states

    def middle(self, selector):
        box = self.page.locator(selector).bounding_box()
        return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


def test_the_first_picture_arrives(notebook):
    facts = notebook.rest()
    assert len(np.unique(np.reshape(facts["pixels"], (-1, 4)), axis=0)) > 50
    assert notebook.page.locator(".splatkit-error").is_hidden()
    assert f"{SIZE[0]} × {SIZE[1]}" in notebook.page.locator(".splatkit-status").inner_text()


def test_a_drag_turns_the_scene(notebook):
    before = notebook.rest()
    states = notebook.drag(notebook.middle(".splatkit canvas"), (90, 30))
    assert "coarse" in states
    after = notebook.rest(lambda facts: facts["position"] != before["position"])
    assert after["pixels"] != before["pixels"]


def test_keys_and_the_wheel_move_the_camera(notebook):
    before = notebook.rest()
    notebook.page.locator(".splatkit canvas").focus()
    notebook.page.keyboard.press("7")
    top = notebook.rest(lambda facts: facts["position"] != before["position"])
    assert top["position"][2] > 5 * abs(top["position"][0] - 19.5)
    notebook.page.mouse.move(*notebook.middle(".splatkit canvas"))
    notebook.page.mouse.wheel(0, -200)
    closer = notebook.rest(lambda facts: facts["position"] != top["position"])
    assert closer["position"][2] < top["position"][2]
    notebook.page.keyboard.press("Home")
    notebook.rest(lambda facts: facts["position"] != closer["position"])


def test_a_point_of_the_transfer_function_is_dragged(notebook):
    before = notebook.rest()
    height = notebook.page.locator(".splatkit-plot").bounding_box()["height"]
    opacity = before["opacities"][-1][1]
    notebook.drag(notebook.middle(".splatkit-plot circle >> nth=-1"), (0, 0.4 * height))
    changed = (np.sqrt(opacity) - 0.4) ** 2

    def is_dragged(facts):
        return abs(facts["opacities"][-1][1] - changed) < 0.03

    after = notebook.rest(is_dragged)
    assert after["pixels"] != before["pixels"]
    assert after["opacities"][:-1] == before["opacities"][:-1]


def test_presets_colours_and_the_window_are_chosen(notebook):
    before = notebook.rest()
    notebook.page.get_by_label("Colours").select_option("magma")
    magma = notebook.rest(lambda facts: facts["color"] != before["color"])
    assert magma["opacities"] == before["opacities"]
    notebook.page.get_by_label("Preset").select_option("generic")
    generic = notebook.rest(lambda facts: facts["opacities"] != magma["opacities"])
    notebook.page.get_by_role("slider", name="Level").focus()
    notebook.page.keyboard.press("PageUp")
    higher = notebook.rest(lambda facts: facts["opacities"] != generic["opacities"])
    assert higher["opacities"][0][0] > generic["opacities"][0][0]
    notebook.page.get_by_label("Preset").select_option("as loaded")
    notebook.rest(lambda facts: facts["opacities"] != higher["opacities"])


def test_frames_follow_the_hand(notebook):
    """Frames are shown while the pointer moves. `tools/python/frames` measures how many."""
    notebook.rest()
    rate, widths, longest = drag_frames(notebook.page, 3)
    print(f"{rate:.1f} frames/s, {widths} pixels wide, {longest:.0f} ms at most")
    # Far fewer than usual: the machine may be busy.
    assert rate > 4 and longest < 1500


#: A notebook whose scene the browser draws.
LOCAL = f"""
import json, os
import numpy as np
import pysplatkit

z, y, x = np.meshgrid(*3 * [np.linspace(-1, 1, 40)], indexing="ij")
scene = pysplatkit.Scene().add_volume(np.exp(-6 * ((x - 0.2) ** 2 + y**2 + (z + 0.1) ** 2)))
widget = scene.show(size={SIZE}, draws="browser")

def write(change):
    with open("new.json", "w") as file:
        json.dump(widget.camera.position, file)
    os.replace("new.json", "camera.json")

widget.observe(write, "camera")
"""


@pytest.mark.skipif(
    not os.environ.get("SPLATKIT_VIEWER"), reason="SPLATKIT_VIEWER names no viewer for pages"
)
def test_the_browser_draws_once_it_has_the_page(tmp_path):
    camera = tmp_path / "camera.json"
    with jupyterlab(tmp_path, LOCAL) as start, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 1300, "height": 1000})
        start(page)
        page.wait_for_selector(".splatkit-page", state="visible", timeout=1000 * PATIENCE)
        status = page.locator(".splatkit-status")
        deadline = time.monotonic() + PATIENCE
        while "exact · browser" not in status.inner_text() and time.monotonic() < deadline:
            time.sleep(0.2)
        assert "exact · browser" in status.inner_text()
        page.screenshot(path=tmp_path / "shown.png")
        box = page.locator(".splatkit-page").bounding_box()
        page.mouse.move(box["x"] + 100, box["y"] + 100)
        page.mouse.down()
        page.mouse.move(box["x"] + 180, box["y"] + 120, steps=8)
        page.mouse.up()
        while not camera.exists() and time.monotonic() < deadline:
            time.sleep(0.2)
        assert camera.exists(), (tmp_path / "log.txt").read_text()
        browser.close()
