"""What editors and type checkers see: every name has types, and a text that names its parameters."""

from __future__ import annotations

import importlib.util
import inspect
import os
import subprocess
import sys

import pytest

import pysplatkit

#: Twenty calls as programs have them.
SCRIPT = """
from pathlib import Path
import numpy as np
import pysplatkit
from pysplatkit import Camera, Clip, Scene, TransferFunction

array = np.zeros((3, 4, 5), np.float32)
points = np.zeros((9, 3))
picture = pysplatkit.render("skull.nrrd", view="left", azimuth=20, elevation=5, zoom=2, size=(64, 48))
pysplatkit.render(array, transfer="ct-bone", colormap="magma", scalar_bar=True, caption="A head")
pysplatkit.render(Path("scan.ply"), color=(1, 0.5, 0), background=None, orthographic=True)
scene = Scene().add("skull.nrrd", name="skull", scalar="heat", colormap=["black", "white"])
scene.add_volume(array, spacing=(1, 1, 2), isosurfaces=[300, (500, "red", 0.5)], name="head")
scene.add_points(points, radius=np.ones(9), colors=(1.0, 0.0, 0.0)).add_mesh(points, [[0, 1, 2]])
scene.add_samples(points, np.ones(9), radius=0.5).add_cells(points, [[0, 1, 2, 3]], np.ones(9))
scene.update("skull", colormap="viridis_r").update("head", array + 1)
scene.transform("skull", scale=2, rotate=("z", 90.0), translate=(0, 0, 1)).remove("head")
camera: Camera = scene.camera((64, 48), view="iso", clips=[Clip.plane((1, 0, 0), 5)])
cameras: list[Camera] = scene.turntable(12, (64, 48), elevation=10)
film: Path = scene.film("out.gif", 30, fps=25, size=(64, 48), scale_bar=True)
scene.film("way.webm", keyframes=[(0, camera), (2, camera.copy().azimuth(40))], engine="cpu")
width, height = scene.render((64, 48), camera, axes=True, samples=4).save("out.png"), 3
bytes_: int = picture.rgba[0, 0].sum().item() + picture.size[0]
function = TransferFunction([(0, "red")], [(0, 0.5)]).to_json()
pysplatkit.convert(["a.laz", "b.laz"], "both.splk", memory=1 << 30, lossless=True)
facts: dict[str, object] = pysplatkit.info("skull.nrrd", dims=(3, 4, 5), sample_type="u8")
is_sound: bool = pysplatkit.check("both.splk").ok
scene.save("scene.json", size=(64, 48), view="left", background="white")
"""

#: Calls that a type checker refuses, each with a part of what it says.
WRONG = {
    'pysplatkit.render("a", vews=["left"])': "vews",
    'pysplatkit.render("a", size=(1, 2, 3))': "size",
    'Scene().add("a", colormap=3)': "colormap",
    "Scene().render(clip=[])": "clip",
    'Scene().film("a.gif", bakground="red")': "bakground",
    'Scene().transform("a", rotate=3)': "rotate",
    "Scene().remove(3)": "str",
}


def checked(tmp_path, text):
    pytest.importorskip("mypy", reason="mypy is not installed")
    script = tmp_path / "script.py"
    script.write_text(text)
    words = [sys.executable, "-m", "mypy", "--strict", "--cache-dir", tmp_path / "mypy", script]
    done = subprocess.run(words, capture_output=True, text=True, check=False, cwd=tmp_path)
    return done.returncode, done.stdout + done.stderr


def test_a_program_of_twenty_calls_is_well_typed(tmp_path):
    assert checked(tmp_path, SCRIPT)[1].startswith("Success")
    head = "import pysplatkit\nfrom pysplatkit import Scene\n"
    status, said = checked(tmp_path, head + "\n".join(WRONG) + "\n")
    lines = said.splitlines()
    for number, name in enumerate(WRONG.values(), 3):
        errors = [line for line in lines if f"script.py:{number}: error" in line]
        assert errors and any(name in line for line in errors), said
    assert status == 1


def public():
    """Yields the public functions, classes and methods, with their names."""
    modules = [pysplatkit]
    if importlib.util.find_spec("ray"):
        modules.append(importlib.import_module("pysplatkit.ray"))
    for module in modules:
        for name in module.__all__:
            thing = getattr(module, name)
            if not (inspect.isclass(thing) or inspect.isfunction(thing)):
                continue
            yield f"{module.__name__}.{name}", thing
            if not inspect.isclass(thing):
                continue
            for attribute, member in vars(thing).items():
                # Fields of tuples are explained at their places.
                if attribute.startswith("_") or hasattr(tuple, attribute):
                    continue
                member = getattr(member, "__func__", member)
                member = getattr(member, "func", getattr(member, "fget", member))
                if inspect.isfunction(member):
                    yield f"{module.__name__}.{name}.{attribute}", member


def test_help_is_complete():
    """Every public function and method says what it does, and what each parameter is."""
    faults, count = [], 0
    for name, thing in public():
        text = inspect.getdoc(thing) or ""
        if not text:
            faults.append(f"{name} has no text")
        if inspect.isclass(thing):
            continue
        count += 1
        for parameter in inspect.signature(thing).parameters:
            if parameter not in ("self", "cls") and f"\n    {parameter}: " not in text:
                faults.append(f"{name} does not explain {parameter}")
    assert count > 40 and not faults, "\n".join(faults)


def test_options_are_those_of_the_signatures():
    """The types of options that several functions share have the names of `Scene.render`."""
    from pysplatkit import _options

    # Scene files say nothing of layers.
    own = {"self", "size", "camera", "layers"}
    names = set(inspect.signature(pysplatkit.Scene.render).parameters) - own
    assert names == set(_options.Saved.__annotations__)
    one = set(inspect.signature(pysplatkit.render).parameters) - {"source", "size", "camera"}
    rest = set(_options.RenderOptions.__annotations__)
    # `axes` and `up` are also those of an array.
    assert one.isdisjoint(rest) and names <= (one | rest)
    fit = set(inspect.signature(pysplatkit.Scene.camera).parameters) - {"self", "size", "clips"}
    assert fit == set(_options.View.__annotations__)


def test_help_prints(tmp_path):
    words = [sys.executable, "-c", "import pysplatkit; help(pysplatkit.render)"]
    environment = {**os.environ, "PAGER": "cat", "TERM": "dumb"}
    text = subprocess.run(words, capture_output=True, text=True, check=True, env=environment).stdout
    for word in ("azimuth", "zoom", "scalar_bar", "engine", "colormap"):
        assert word in text
