#!/usr/bin/env python3
"""Measures several ranks of Ray against one process, for a generated volume in bricks.

    SPLATKIT_COMMAND=target/release/splatkit python bench_ray.py --side 1024 --ranks 4 --memory 512

Prints decibels, memory, bytes that are moved, and times. It needs about twice the bytes of the
volume on the disk of --folder, and removes them.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import tempfile
import time
from pathlib import Path

import numpy as np
import ray

import pysplatkit
import pysplatkit.ray

MIB = 1 << 20


def volume(folder: Path, side: int) -> Path:
    """Makes a volume in bricks."""
    command = os.environ.get("SPLATKIT_COMMAND", "splatkit")
    raw, bricks = folder / "volume.nrrd", folder / "volume.splv"
    dims = "x".join([str(side)] * 3)
    generate = [command, "generate", "specimen", "--dims", dims, "--type", "u8", "-o", raw]
    for words in (generate, [command, "convert", raw, "-o", bricks]):
        subprocess.run(words, check=True, stdout=subprocess.DEVNULL)
    raw.unlink()
    return bricks


def drawn(path: Path, ranks: int, memory: int, given: argparse.Namespace, precision: str):
    """Draws a picture twice, and prints what that took. Returns the picture."""
    size = (given.width, given.height)
    options = {"transfer": given.transfer, "memory": memory * MIB, "precision": precision}
    cpus = max((os.cpu_count() or 1) // ranks, 1)
    with pysplatkit.ray.Renderer(path, ranks=ranks, cpus=cpus, **options) as renderer:
        camera = renderer.camera(size)
        base = ray.get([rank.memory.remote() for rank in renderer.ranks])
        times = []
        for _ in range(2):
            start = time.perf_counter()
            picture = renderer.render(size, camera, background="white", cut=given.cut)
            times.append(time.perf_counter() - start)
    statistics = picture.statistics
    per_rank = statistics["ranks"]
    print(f"\n{ranks} ranks, {memory} MiB for bricks each, {cpus} threads, {precision}")
    print(
        f"  first picture {times[0]:.1f} s, second {times[1]:.1f} s; level {statistics['level']:.2f}"
    )
    print(f"  moved for a picture: {statistics['moved_bytes'] / MIB:.1f} MiB")
    for number, rank in enumerate(per_rank):
        peak, before = rank["peak_memory"] / MIB, base[number] / MIB
        print(
            f"  rank {number}: {rank['bricks']} bricks, {rank['seconds']:.1f} s, peak "
            f"{peak:.0f} MiB ({before:.0f} MiB before the scene is drawn)"
        )
    return picture


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--side", type=int, default=256, help="samples along each axis")
    parser.add_argument("--ranks", type=int, default=4)
    parser.add_argument("--memory", type=int, default=512, help="MiB for the bricks of a rank")
    parser.add_argument("--width", type=int, default=800)
    parser.add_argument("--height", type=int, default=600)
    parser.add_argument("--cut", type=float, default=2.0, help="pixels; 0 draws the finest level")
    parser.add_argument("--transfer", default="generic")
    parser.add_argument("--folder", type=Path, help="default: that of temporary files")
    parser.add_argument("--save", type=Path, help="write the pictures to this folder")
    given = parser.parse_args()
    ray.init(
        num_cpus=max(given.ranks, os.cpu_count() or 1),
        include_dashboard=False,
        log_to_driver=False,
        object_store_memory=256 * MIB,
    )
    with tempfile.TemporaryDirectory(dir=given.folder) as folder:
        start = time.perf_counter()
        path = volume(Path(folder), given.side)
        print(f"{given.side}³ samples made and in bricks: {time.perf_counter() - start:.0f} s")
        one = drawn(path, 1, 1 << 20, given, "float32")
        pictures = {"one": one}
        for precision in ("float32", "float16"):
            picture = drawn(path, given.ranks, given.memory, given, precision)
            pictures[precision] = picture
            error = np.mean((picture.color.astype(float) - one.color) ** 2)
            most = np.abs(picture.rgba.astype(int) - one.rgba).max()
            decibels = -10 * np.log10(max(error, 1e-15))
            print(f"  {decibels:.1f} dB to one process; at most {most} of 255 off")
    if given.save:
        given.save.mkdir(parents=True, exist_ok=True)
        for name, picture in pictures.items():
            picture.save(given.save / f"{name}.png")


if __name__ == "__main__":
    main()
