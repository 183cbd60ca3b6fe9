"""The library names options as flags of the command. In Python they are keywords."""

from __future__ import annotations

import re

#: Flags whose keywords have other names, or another value.
_NAMES = {
    "clip": "clips",
    "cut-out": "clips",
    "iso": "isosurfaces",
    "type": "sample_type",
    "trust-scene": "trusted",
    "no-shade": "shade=False",
    "no-slopes": "slopes=False",
    "no-occlusion": "occlusion=False",
    "camera-position": "camera",
    "thin": "edits",
    "edit": "edits",
    "from-crs": "edits",
    "reproject": "edits",
}

#: Flags that have no keyword. They stay as they are.
NO_KEYWORDS = frozenset(
    ("allow-host", "cache", "cache-size", "dry-run", "index", "part", "raw", "stats")
)

#: A value that nobody takes for a word of the sentence: a number, a part of an array, or the last
#: word before a bracket or a quotation mark closes.
_VALUE = r"-?\d[\w.,]*|\w*:\w+|[\w-]+(?=[)`”])"
_FLAG = re.compile(rf"(?<![\w-])--([a-z]+(?:-[a-z]+)*)(?: ({_VALUE}))?")

#: A command that draws a file, as `splatkit render 'a b.raw' --dims 4x5x6 --type u8 -o out.png`.
_COMMAND = re.compile(r"splatkit render ('(?:[^']|'\\'')*'|\S+)((?: --[a-z-]+ \S+)+) -o out\.png")


def keyword(flag: str) -> str:
    """Returns the keyword of a flag, which is named without its dashes."""
    if flag.startswith("limit-"):
        return f"limits={{'{flag.removeprefix('limit-')}': …}}"
    return _NAMES.get(flag, flag.replace("-", "_"))


def _value(text: str) -> str:
    """Returns a value of a flag as Python has it: a number, a tuple of numbers, or a text."""
    parts = re.split(r"[x,]", text)
    if all(re.fullmatch(r"-?[\d.]+|[XYZ]", part) for part in parts):
        return parts[0] if len(parts) == 1 else f"({', '.join(parts)})"
    return repr(text)


def _keyword(match: re.Match[str]) -> str:
    flag, value = match.groups()
    if flag in NO_KEYWORDS:
        return match.group()
    name = keyword(flag)
    return name if value is None or "=" in name else f"{name}={_value(value)}"


def _call(match: re.Match[str]) -> str:
    file, flags = match.groups()
    if file.startswith("'"):
        file = file[1:-1].replace("'\\''", "'")
    words = flags.split()
    pairs = zip(words[::2], words[1::2], strict=True)
    given = [f"{keyword(flag[2:])}={_value(value)}" for flag, value in pairs]
    return f"pysplatkit.render({', '.join([repr(file), *given])})"


def in_python(text: str) -> str:
    """Returns a message of the library with keywords instead of flags."""
    return _FLAG.sub(_keyword, _COMMAND.sub(_call, text))
