"""Servers of notebooks, and a browser to drive them."""

from __future__ import annotations

import itertools
import json
import math
import os
import shutil
import socket
import subprocess
import sys
import time
import urllib.request
from contextlib import contextmanager

#: Debian's browser; None if it is not installed.
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
#: The seconds that a notebook may take on a busy machine.
PATIENCE = 90

MARIMO = """
import marimo

app = marimo.App()

@app.cell
def _():
    import marimo as mo
{cell}
    shown = mo.ui.anywidget(widget)
    shown
    return
"""


def free_port():
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        return listener.getsockname()[1]


@contextmanager
def served(folder, arguments, path):
    """Runs a server in a folder, and yields the address of a page once it answers."""
    port = free_port()
    address = f"http://127.0.0.1:{port}"
    options = [part.format(port=port, folder=folder) for part in arguments]
    places = ("CONFIG_DIR", "DATA_DIR", "RUNTIME_DIR")
    environment = {
        **os.environ,
        **{f"JUPYTER_{place}": str(folder / "jupyter") for place in places},
        **{f"XDG_{place}_HOME": str(folder / "xdg") for place in ("CONFIG", "CACHE", "STATE")},
        "JUPYTERLAB_SETTINGS_DIR": str(folder / "jupyter"),
        "JUPYTERLAB_WORKSPACES_DIR": str(folder / "jupyter"),
    }
    with (folder / "log.txt").open("w") as log:
        server = subprocess.Popen(
            [sys.executable, "-m", *options], cwd=folder, env=environment, stdout=log, stderr=log
        )
        try:
            deadline = time.monotonic() + PATIENCE
            while True:
                try:
                    urllib.request.urlopen(address + path, timeout=5).close()
                    break
                except OSError:
                    text = (folder / "log.txt").read_text()
                    assert server.poll() is None and time.monotonic() < deadline, text
                    time.sleep(0.3)
            yield address + path
        finally:
            server.terminate()
            try:
                server.wait(20)
            except subprocess.TimeoutExpired:
                server.kill()
                server.wait()


@contextmanager
def jupyterlab(folder, source, theme="Light"):
    """Runs JupyterLab. Yields a function that opens a notebook with a cell and runs it."""
    cell = {"cell_type": "code", "id": "one", "metadata": {}, "outputs": []}
    cell |= {"execution_count": None, "source": source + "\nwidget"}
    kernel = {"name": "python3", "display_name": "Python 3", "language": "python"}
    notebook = {"cells": [cell], "metadata": {"kernelspec": kernel}}
    notebook |= {"nbformat": 4, "nbformat_minor": 5}
    # News would cover the page.
    settings = folder / "jupyter/@jupyterlab/apputils-extension"
    settings.mkdir(parents=True)
    (settings / "notification.jupyterlab-settings").write_text('{"fetchNews": "false"}')
    theme = f'{{"theme": "JupyterLab {theme}"}}'
    (settings / "themes.jupyterlab-settings").write_text(theme)
    (folder / "own.ipynb").write_text(json.dumps(notebook))
    arguments = ["jupyterlab", "--no-browser", "--allow-root", "--port={port}"]
    arguments += ["--IdentityProvider.token=", "--ServerApp.port_retries=0"]
    arguments += ["--ServerApp.root_dir={folder}"]
    with served(folder, arguments, "/lab/tree/own.ipynb?reset") as address:

        def start(page):
            page.goto(address)
            page.click(".jp-CodeCell .cm-content", timeout=1000 * PATIENCE)
            page.wait_for_selector('[data-status="idle"]', timeout=1000 * PATIENCE)
            page.keyboard.press("Shift+Enter")

        yield start


@contextmanager
def marimo(folder, source):
    """Runs marimo. Yields a function that opens a notebook with a cell."""
    cell = "\n".join("    " + line for line in source.splitlines())
    (folder / "own.py").write_text(MARIMO.format(cell=cell))
    arguments = ["marimo", "run", "own.py", "--headless", "--port={port}", "--no-token"]
    with served(folder, arguments, "/") as address:
        yield lambda page: page.goto(address)


#: Counts the frames that the widget's canvas gets.
COUNT = """canvas => {
    const context = canvas.getContext("2d");
    const draw = CanvasRenderingContext2D.prototype.drawImage;
    window.frames_ = [];
    context.drawImage = function (...parts) {
        window.frames_.push([performance.now(), canvas.width]);
        return draw.apply(this, parts);
    };
}"""


def drag_frames(page, seconds):
    """Turns the scene by the pointer. Returns the frames a second, the least and the largest width
    of the frames after the first ones, and the longest time between two in milliseconds."""
    canvas = page.locator(".splatkit canvas")
    canvas.evaluate(COUNT)
    box = canvas.bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    start = time.monotonic()
    step = 0
    while time.monotonic() < start + seconds:
        step += 1
        page.mouse.move(x + 60 * math.sin(step / 30), y + 20 * math.sin(step / 50))
        time.sleep(0.012)
    frames = page.evaluate("window.frames_")
    page.mouse.up()
    times = [at for at, _ in frames]
    widths = [width for _, width in frames[len(frames) // 3 :]] or [0]
    gaps = [b - a for a, b in itertools.pairwise(times)] or [0]
    return len(frames) / seconds, (min(widths), max(widths)), max(gaps)
