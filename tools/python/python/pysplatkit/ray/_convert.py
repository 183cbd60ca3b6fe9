"""Conversion in parts: the command's plan, its parts as tasks, and its join."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import ray

from .._errors import ArgumentError, Error, OutputError
from .._options import PathLike
from ._results import get

#: How often a part is made again if its worker dies.
_RETRIES = 5


class CommandError(Error):
    """A command that failed. Its text is what the command wrote."""

    def __init__(self, command: Sequence[str], code: int, text: str) -> None:
        super().__init__(list(command), code, text)
        #: The words of the command.
        self.command = list(command)
        #: Its exit status.
        self.code = code
        self._text = text

    def __str__(self) -> str:
        return f"{' '.join(self.command)}: {self._text.strip() or f'exit status {self.code}'}"


def convert(
    inputs: PathLike | Sequence[PathLike],
    out: PathLike,
    *,
    parts: int | None = None,
    folder: PathLike | None = None,
    cpus: float = 1.0,
    overwrite: bool = False,
    options: Sequence[str] = (),
    task_options: dict[str, Any] | None = None,
) -> Path:
    """Converts files to one hierarchy, part by part on the whole cluster. Returns its path.

    It runs `splatkit convert --plan`, then `--part` for each part as a task of Ray, then `--join`,
    with the command that SPLATKIT_COMMAND names, or `splatkit` on PATH, which all nodes need. If a
    worker dies, its part alone is made again. The file is that of one machine, byte for byte.

    Args:
        inputs: The files, which all nodes can read.
        out: The hierarchy, a .splk file.
        parts: The number of parts. Default: the command's.
        folder: Where the plan and the parts are kept, on a file system that all nodes share. If it
            holds finished parts of the same plan, they are not made again. Default: a new folder
            beside `out`, which is removed at the end.
        cpus: Processors of each part.
        overwrite: Whether `out` is replaced if it exists.
        options: Further flags of `splatkit convert`, for the plan.
        task_options: Further options of Ray's tasks, such as memory or resources.
    """
    files = [inputs] if isinstance(inputs, (str, os.PathLike)) else list(inputs)
    if not files:
        raise ArgumentError("a conversion needs at least one input")
    if parts is not None and parts < 1:
        raise ArgumentError(f"a conversion has at least one part, not {parts}")
    to = Path(os.path.abspath(os.fspath(out)))
    if to.exists() and not overwrite:
        raise OutputError(to, "cannot be written", None, "it exists already")
    if not ray.is_initialized():
        ray.init(include_dashboard=False)
    given_folder = None if folder is None else Path(os.path.abspath(os.fspath(folder)))
    try:
        at = given_folder or Path(tempfile.mkdtemp(prefix=f".{to.name}-parts-", dir=to.parent))
    except OSError as error:
        raise OutputError(to, "cannot be written", error.errno, error.strerror or "") from error
    try:
        return _converted(
            [os.path.abspath(os.fspath(file)) for file in files],
            to,
            at,
            parts,
            cpus,
            overwrite,
            options,
            task_options or {},
        )
    finally:
        if given_folder is None:
            shutil.rmtree(at, ignore_errors=True)


def _converted(
    files: list[str],
    to: Path,
    folder: Path,
    parts: int | None,
    cpus: float,
    overwrite: bool,
    options: Sequence[str],
    task_options: dict[str, Any],
) -> Path:
    plan = folder / "plan.json"
    if not plan.is_file():
        count = [] if parts is None else ["--parts", str(parts)]
        run(["convert", *files, "-o", str(to), "--plan", str(folder), *count, *options])
    part_count = len(json.loads(plan.read_text())["parts"])
    # A plan may have fewer parts than were asked for: a part has at least one point.
    if parts is not None and part_count > parts:
        raise ArgumentError(f"{plan} has {part_count} parts, not {parts}; choose another folder")
    make = ray.remote(max_retries=_RETRIES, num_cpus=cpus, **task_options)(_part)
    waiting = [make.remote(str(plan), index) for index in range(part_count)]
    while waiting:
        ready, waiting = ray.wait(waiting)
        try:
            get(ready)
        except Error:
            for ref in waiting:
                ray.cancel(ref)
            raise
    run(["convert", "--join", str(plan), "-o", str(to), *(["--overwrite"] if overwrite else [])])
    return to


def _part(plan: str, index: int) -> None:
    run(["convert", "--part", plan, "--index", str(index)])


def run(words: Sequence[str]) -> str:
    """Runs the command. Returns what it prints."""
    command = os.environ.get("SPLATKIT_COMMAND") or "splatkit"
    program = shutil.which(command)
    if program is None:
        raise ArgumentError(
            f"there is no command {command}: build splatkit's, or let SPLATKIT_COMMAND name it"
        )
    done = subprocess.run([program, *words], capture_output=True, text=True, check=False)
    if done.returncode:
        raise CommandError(["splatkit", *words], done.returncode, done.stderr)
    return done.stdout
