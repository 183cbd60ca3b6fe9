"""Messages name options as Python does, not as flags of the command."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import pysplatkit
from pysplatkit import Clip, NothingToDrawError, Scene, _options
from pysplatkit._keywords import NO_KEYWORDS, in_python, keyword

ROOT = Path(__file__).parents[3]
VOLUME = np.arange(64, dtype=np.uint8).reshape(4, 4, 4)


def test_an_empty_picture_names_the_keyword_of_clips() -> None:
    scene = Scene()
    scene.add_volume(VOLUME)
    away = Clip.box((90, 90, 90), (91, 91, 91))
    camera = scene.camera()
    with pytest.raises(NothingToDrawError, match="clips") as raised:
        scene.render(camera=camera, size=(32, 32), clips=[away])
    assert "--" not in str(raised.value)


def test_warnings_and_hints_name_keywords(tmp_path: Path) -> None:
    file = tmp_path / "times.nrrd"
    head = "NRRD0005\ntype: uint8\ndimension: 4\nsizes: 2 2 2 3\nencoding: raw\n"
    kinds = "kinds: domain domain domain time\n\n"
    file.write_bytes((head + kinds).encode() + bytes(range(24)))
    with pytest.warns(pysplatkit.DataWarning, match="time=1 shows the second"):
        pysplatkit.info(file)
    raw = tmp_path / "head_4x5x6_uint8.raw"
    raw.write_bytes(bytes(range(120)))
    with pytest.raises(pysplatkit.InputError) as raised:
        pysplatkit.info(raw)
    call = f"pysplatkit.render({str(raw)!r}, dims=(4, 5, 6), sample_type='u8')"
    assert raised.value.hint == call
    # The hint is a call that works.
    assert eval(call.replace("render(", "render(size=(16, 16), source=", 1)).size == (16, 16)


def test_values_become_those_of_python() -> None:
    for text, expected in [
        ("--scalar channel:1 shows the second", "scalar='channel:1' shows the second"),
        ("needs it (--mode splats): so", "needs it (mode='splats'): so"),
        ("`--cells solid` draws", "`cells='solid'` draws"),
        ("by --clip 'x<50%'", "by clips 'x<50%'"),
        ("a--time.ply --limit-points on", "a--time.ply limits={'points': …} on"),
        ("add --allow-host example.org", "add --allow-host example.org"),
    ]:
        assert in_python(text) == expected


def _named_by_the_library() -> Iterator[tuple[Path, str]]:
    """Returns the flags in the texts of the library, apart from tests."""
    for folder in ("src", "tools/media/src"):
        for file in (ROOT / folder).rglob("*.rs"):
            code = file.read_text("utf-8").split("#[cfg(test)]\nmod tests {")[0]
            if "tests" in file.name or "tests" in file.parts:
                continue
            lines = (line for line in code.splitlines() if not line.lstrip().startswith("//"))
            for flag in re.findall(r"(?<![\w-])--([a-z]+(?:-[a-z]+)*)", "\n".join(lines)):
                yield file, flag


def _keywords() -> set[str]:
    """Returns the names of all arguments and options of the package."""
    names: set[str] = set()
    public = [getattr(pysplatkit, name) for name in pysplatkit.__all__]
    methods = [
        member
        for one in public
        if inspect.isclass(one)
        for _, member in inspect.getmembers(one, callable)
    ]
    for one in [*public, *methods]:
        if inspect.isroutine(one):
            try:
                names.update(inspect.signature(one).parameters)
            except ValueError:
                continue
    for one in vars(_options).values():
        names.update(getattr(one, "__annotations__", {}))
    return names


def test_each_flag_of_the_library_has_a_keyword() -> None:
    flags = list(_named_by_the_library())
    assert len(flags) > 30, "no flags were found"
    known = _keywords()
    for file, flag in flags:
        name = re.split("[={]", keyword(flag))[0]
        assert flag in NO_KEYWORDS or name in known, f"{file}: --{flag} is not {name} in Python"
