"""Threads, signals, memory and processes."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import textwrap
import threading
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from conftest import ball, blob

import pysplatkit
from pysplatkit import Scene

SIZE = (64, 48)


def resident():
    """Returns the bytes of memory that the process holds."""
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * 4096


def interruptible(script, folder=None):
    """Starts a script that Ctrl-C stops, also if these tests run in the background of a shell,
    which lets its children ignore it."""
    heard = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)\n"
    command = [sys.executable, "-c", heard + textwrap.dedent(script)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=folder)


def test_threads_draw_at_once():
    shared = Scene().add_volume(blob()).add_mesh(*ball())
    cameras = shared.turntable(6, SIZE)
    wanted = [shared.render(SIZE, camera).rgba for camera in cameras]

    def draw(turn):
        at = turn % len(cameras)
        scene = Scene().add_volume(blob()).add_mesh(*ball()) if turn % 2 else shared
        return at, scene.render(SIZE, cameras[at]).rgba

    with ThreadPoolExecutor(4) as pool:
        for at, picture in pool.map(draw, range(24)):
            assert np.array_equal(picture, wanted[at])


def test_other_threads_go_on_meanwhile():
    scene = Scene().add_volume(blob((40, 40, 40)))
    count, running = 0, True

    def tick():
        nonlocal count
        while running:
            count += 1
            time.sleep(0.001)

    thread = threading.Thread(target=tick)
    thread.start()
    try:
        begun = time.monotonic()
        scene.render((1200, 900))
        took = time.monotonic() - begun
    finally:
        running = False
        thread.join()
    # Half of the ticks that an idle machine would have, in seconds of which it has few.
    assert count > 50 * took


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_ctrl_c_stops_drawing():
    script = """
        import time, numpy as np, pysplatkit
        scene = pysplatkit.Scene().add_volume(np.random.default_rng(0).random((96, 96, 96)))
        camera = scene.camera((64, 48))
        print("ready", flush=True)
        begun = time.monotonic()
        try:
            scene.render((6000, 4500), camera)
        except KeyboardInterrupt:
            print("stopped", flush=True)
        # What is left behind ends soon. The whole picture would take a minute.
        for _ in range(20):
            spent = time.process_time()
            time.sleep(0.5)
            if time.process_time() - spent < 0.1:
                break
        else:
            raise AssertionError("the drawing goes on")
        scene.render((64, 48), camera)
        print("again", flush=True)
        """
    process = interruptible(script)
    assert process.stdout.readline() == "ready\n"
    time.sleep(1.0)
    begun = time.monotonic()
    process.send_signal(signal.SIGINT)
    assert process.stdout.readline() == "stopped\n"
    assert time.monotonic() - begun < 3.0
    assert process.communicate(timeout=60)[0] == "again\n" and process.returncode == 0


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_an_interrupted_input_is_not_added():
    script = """
        import time, numpy as np, pysplatkit
        positions = np.random.default_rng(0).random((1_000_000, 3))
        scene = pysplatkit.Scene()
        print("ready", flush=True)
        try:
            scene.add_samples(positions, positions[:, 0])
        except KeyboardInterrupt:
            print("stopped", flush=True)
        print(len(scene), scene.bounds, flush=True)
        """
    process = interruptible(script)
    assert process.stdout.readline() == "ready\n"
    time.sleep(0.3)
    process.send_signal(signal.SIGINT)
    assert process.communicate(timeout=120)[0] == "stopped\n0 None\n"


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_an_interrupted_conversion_leaves_no_file(tmp_path):
    script = """
        import numpy as np, pysplatkit
        np.save("cloud.npy", np.random.default_rng(0).random((1_500_000, 3)))
        print("ready", flush=True)
        try:
            pysplatkit.convert("cloud.npy", "cloud.splk", preset="best")
        except KeyboardInterrupt:
            print("stopped", flush=True)
        """
    process = interruptible(script, tmp_path)
    assert process.stdout.readline() == "ready\n"
    time.sleep(1.0)
    process.send_signal(signal.SIGINT)
    assert process.communicate(timeout=20)[0] == "stopped\n" and process.returncode == 0
    assert [path.name for path in tmp_path.iterdir()] == ["cloud.npy"]


@pytest.mark.skipif(sys.platform != "linux", reason="memory is read from /proc")
def test_memory_is_steady_over_a_thousand_frames():
    scene = Scene().add_volume(blob((12, 12, 12)))
    camera = scene.camera(SIZE)

    def frames(count):
        for at in range(count):
            picture = scene.render(SIZE, camera, samples=1)
            assert picture.rgba.size == 4 * picture.depth.size
            if at % 10 == 0:
                Scene().add_volume(blob((12, 12, 12))).render(SIZE, samples=1)

    frames(300)
    before = resident()
    frames(1000)
    assert resident() - before < 16 << 20


@pytest.mark.skipif(sys.platform != "linux", reason="memory is read from /proc")
def test_a_volume_is_not_copied():
    script = textwrap.dedent(
        """
        import numpy as np, pysplatkit
        def memory(name):
            with open("/proc/self/status") as file:
                return next(int(line.split()[1]) for line in file if line.startswith(name)) * 1024
        array = np.ones((512, 512, 512), "u1")
        array[100:150, 100:150, 100:150] = 200
        pysplatkit.Scene().add_volume(array[:8, :8, :8] + np.arange(8, dtype="u1"))
        for copy in (None, True):
            before = memory("VmRSS")
            scene = pysplatkit.Scene().add_volume(array, transfer="generic", copy=copy)
            held, peak = memory("VmRSS") - before, memory("VmHWM") - before
            print(held / array.nbytes, peak / array.nbytes)
        """
    )
    # The allocator gives back at once what is freed, so that what is held is measured.
    at_once = {"MALLOC_TRIM_THRESHOLD_": "65536", "MALLOC_MMAP_THRESHOLD_": "65536"}
    done = subprocess.run(
        [sys.executable, "-c", script],
        capture_output=True,
        text=True,
        check=True,
        env={**os.environ, **at_once},
    )
    held, peak, held_copy, _ = map(float, done.stdout.split())
    assert held < 0.1, done.stdout
    # Making the transfer function takes memory for a while.
    assert peak < 0.8, done.stdout
    assert 0.9 < held_copy < 1.2, done.stdout


@pytest.mark.skipif(not hasattr(__import__("os"), "fork"), reason="needs fork")
def test_a_fork_is_refused_rather_than_hangs():
    script = textwrap.dedent(
        """
        import os, numpy as np, pysplatkit
        array = np.random.default_rng(0).random((8, 8, 8))
        pysplatkit.render(array, size=(16, 16))
        child = os.fork()
        if child == 0:
            try:
                pysplatkit.render(array, size=(16, 16))
            except pysplatkit.ArgumentError as error:
                os._exit(0 if "spawn" in str(error) else 2)
            os._exit(1)
        print(os.waitpid(child, 0)[1])
        """
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, timeout=60, check=True
    )
    assert done.stdout == "0\n"


def test_the_module_has_a_version_and_documentation():
    assert pysplatkit.__version__.count(".") == 2
    for name in pysplatkit.__all__:
        member = getattr(pysplatkit, name)
        assert isinstance(member, tuple) or member.__doc__
