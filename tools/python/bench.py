"""Measures pictures of one volume: by this package, by the command, and by PyVista off screen.

    python bench.py --command ../../target/release/splatkit --sides 256,512

Each time is the median of a few runs, by the clock and as the seconds of all processors together,
which other programs disturb less. The memory is what the process has at its peak beyond the array,
in parts of the array's size.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

SIZE = (1280, 720)


def volume(side):
    """Returns bytes [z, y, x]: shells around a core, none of it symmetric."""
    z, y, x = np.meshgrid(*[np.linspace(-1, 1, side, dtype="f4")] * 3, indexing="ij", sparse=True)
    away = np.sqrt((x - 0.1) ** 2 + 0.8 * y**2 + (z + 0.1) ** 2)
    values = np.exp(-6 * away**2) + 0.4 * np.exp(-60 * (away - 0.7) ** 2) * (
        1 + 0.3 * np.sin(9 * x)
    )
    return (values * (255 / values.max())).astype("u1")


def opacities():
    return [(30, 0.0), (80, 0.05), (255, 0.6)]


def transfer():
    import pysplatkit

    colors = [(0, "navy"), (120, "orange"), (255, "white")]
    return pysplatkit.TransferFunction(colors, opacities(), unit=4)


def spent():
    """Returns the time, and that of all processors for this process and its children."""
    times = os.times()
    return np.array(
        [
            time.perf_counter(),
            times.user + times.system + times.children_user + times.children_system,
        ]
    )


def timed(work):
    """Returns the seconds of a call by the clock and of all processors."""
    start = spent()
    work()
    return (spent() - start).round(3).tolist()


def median(work, runs):
    """Returns the median seconds of a few calls."""
    return np.median([timed(work) for _ in range(runs)], axis=0).round(3).tolist()


def peak():
    """Returns the peak and the present memory of this process in bytes."""
    lines = Path("/proc/self/status").read_text().splitlines()
    fields = {line.split(":")[0]: line.split()[1] for line in lines if line.startswith("Vm")}
    return 1024 * int(fields["VmHWM"]), 1024 * int(fields["VmRSS"])


def of_memory(side, copy):
    """Draws an array, and returns the memory beyond it in parts of its size."""
    import pysplatkit

    array = volume(side)
    small = np.ascontiguousarray(array[:: side // 8, :: side // 8, :: side // 8])
    pysplatkit.Scene().add_volume(small, transfer=transfer()).render(SIZE)
    Path("/proc/self/clear_refs").write_text("5")
    _, before = peak()
    scene = pysplatkit.Scene().add_volume(array, transfer=transfer(), copy=copy)
    added, _ = peak()
    scene.render(SIZE)
    drawn, _ = peak()
    parts = {"added": added, "drawn": drawn}
    return {name: round((value - before) / array.nbytes, 3) for name, value in parts.items()}


def of_splatkit(side, runs):
    import pysplatkit

    array = volume(side)
    scene = pysplatkit.Scene()
    add = timed(lambda: scene.add_volume(array, transfer=transfer()))
    camera = scene.camera(SIZE)
    first = timed(lambda: scene.render(SIZE, camera))
    around = iter(range(10**6))
    again = median(lambda: scene.render(SIZE, camera.copy().azimuth(next(around) % 2)), runs)
    return {"add": add, "first": first, "again": again}


def of_command(command, side, runs):
    """Times `splatkit render` of the array as a file, beside this package with the same file."""
    import pysplatkit

    with tempfile.TemporaryDirectory() as folder:
        file, picture = Path(folder) / "volume.npy", Path(folder) / "picture.png"
        np.save(file, volume(side))
        transfer_file = Path(folder) / "transfer.json"
        transfer_file.write_text(transfer().to_json())
        words = [
            command,
            "render",
            file,
            "-o",
            picture,
            "--engine",
            "cpu",
            "--transfer",
            transfer_file,
        ]
        words += ["--size", "x".join(map(str, SIZE)), "--overwrite"]

        def run():
            subprocess.run(list(map(str, words)), check=True, capture_output=True)

        def call():
            pysplatkit.render(file, transfer=transfer_file, size=SIZE).save(
                Path(folder) / "own.png"
            )

        command_time, python_time = median(run, runs), median(call, runs)
        same = picture.read_bytes() == (Path(folder) / "own.png").read_bytes()
    return {"command": command_time, "python": python_time, "same": same}


def of_pyvista(side, runs):
    import pyvista

    array = volume(side)
    grid = pyvista.ImageData(dimensions=array.shape[::-1])
    grid["values"] = array.ravel()
    steps = np.interp(np.arange(256), *zip(*opacities(), strict=True))
    plotter = pyvista.Plotter(off_screen=True, window_size=SIZE)

    def begin():
        options = {"cmap": "inferno", "opacity": 255 * steps, "opacity_unit_distance": 4}
        plotter.add_volume(grid, shade=True, **options)
        plotter.camera_position = "iso"
        plotter.show(auto_close=False)

    first = timed(begin)
    around = iter(range(10**6))

    def draw():
        # A view that changed, since VTK keeps the last picture.
        plotter.camera.azimuth = next(around) % 2
        plotter.render()
        plotter.screenshot(return_img=True)

    again = median(draw, runs)
    capabilities = plotter.render_window.ReportCapabilities()
    renderer = [line for line in capabilities.splitlines() if "renderer string" in line]
    return {"first": first, "again": again, "renderer": " ".join(renderer).strip()}


def apart(task, *arguments):
    """Runs a measurement in a process of its own."""
    words = [sys.executable, __file__, "--task", json.dumps([task, *arguments])]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    if done.returncode:
        return {"failed": done.stderr.strip().splitlines()[-1:]}
    return json.loads(done.stdout.strip().splitlines()[-1])


def main():
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--command", help="the command splatkit")
    options.add_argument("--sides", default="256,512", help="samples along each axis")
    options.add_argument("--runs", type=int, default=5)
    options.add_argument("--task", help=argparse.SUPPRESS)
    given = options.parse_args()
    if given.task:
        task, *arguments = json.loads(given.task)
        tasks = (of_memory, of_splatkit, of_command, of_pyvista)
        result = {task.__name__: task for task in tasks}[task](*arguments)
        print(json.dumps(result))
        return
    print(
        f"{os.cpu_count()} processors, pictures of {SIZE[0]} × {SIZE[1]}, [seconds, processor seconds]"
    )
    for side in map(int, given.sides.split(",")):
        print(f"{side}³ bytes")
        print("  memory, shared:", apart("of_memory", side, None))
        print("  memory, copied:", apart("of_memory", side, True))
        print("  splatkit:", apart("of_splatkit", side, given.runs))
        if given.command:
            print("  a file:", apart("of_command", given.command, side, given.runs))
        print("  PyVista:", apart("of_pyvista", side, given.runs))


if __name__ == "__main__":
    main()
