"""Several ranks draw what one process draws; failures cost what failed alone."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from conftest import ball, blob, write_ply

import pysplatkit

ray = pytest.importorskip("ray", reason='Ray is missing: pip install "pysplatkit[ray]"')
pytestmark = pytest.mark.filterwarnings("default")

SIZE = (160, 120)
VIEWS = [{}, {"azimuth": 200, "elevation": -35}, {"view": "top", "orthographic": True}]


@pytest.fixture(scope="module")
def cluster():
    ray.init(
        num_cpus=8,
        include_dashboard=False,
        object_store_memory=128 << 20,
        configure_logging=True,
        log_to_driver=False,
    )
    yield
    ray.shutdown()


@pytest.fixture(scope="module")
def bricks(tmp_path_factory):
    """A volume of several bricks along each axis."""
    folder = tmp_path_factory.mktemp("ray")
    volume = blob((70, 100, 90))
    np.save(folder / "bytes.npy", (255 * volume / volume.max()).astype("u1"))
    pysplatkit.convert(folder / "bytes.npy", folder / "bricks.splv")
    return folder / "bricks.splv"


def renderer(scene, ranks=4, **options):
    from pysplatkit.ray import Renderer

    return Renderer(scene, ranks=ranks, **options)


def decibels(a, b):
    error = np.mean((a.astype(float) - b.astype(float)) ** 2)
    return 120.0 if error == 0 else -10 * np.log10(error)


def same(drawn, alone, least=60):
    """Whether two pictures agree, and show something."""
    assert drawn.rgba.shape == alone.rgba.shape
    assert (alone.color[..., 3] > 0.1).mean() > 0.02
    quality = decibels(drawn.color, alone.color)
    assert quality >= least, f"{quality:.1f} dB"
    assert np.abs(drawn.rgba.astype(int) - alone.rgba).max() <= 6
    return quality


@pytest.mark.parametrize("view", VIEWS, ids=["usual", "behind", "flat"])
def test_a_volume_in_bricks(cluster, bricks, view):
    alone = pysplatkit.Scene().add(bricks, transfer="generic")
    camera = alone.camera(SIZE, **view)
    with renderer(bricks, transfer="generic", memory=64 << 20) as ranks:
        picture = ranks.render(SIZE, camera, background="navy")
        same(picture, alone.render(SIZE, camera, background="navy"))
        reports = picture.statistics["ranks"]
        # No rank reads all bricks.
        whole = alone.render(SIZE, camera).statistics["bricks"]
        assert len(reports) == 4 and max(rank["bricks"] for rank in reports) < whole
        assert picture.camera == camera and picture.statistics["moved_bytes"] > 0


def test_an_array(cluster):
    volume = (200 * blob((40, 50, 60))).astype("u1")
    alone = pysplatkit.Scene().add(volume, transfer="generic")
    with renderer(volume, transfer="generic") as ranks:
        picture, one = ranks.render(SIZE), alone.render(SIZE)
        same(picture, one)
        both = np.isfinite(picture.depth) & np.isfinite(one.depth)
        assert (np.isfinite(picture.depth) == np.isfinite(one.depth)).mean() > 0.995
        bounds = np.array(alone.bounds)
        off = np.abs(picture.depth[both] - one.depth[both]) / np.linalg.norm(bounds[1] - bounds[0])
        assert np.median(off) < 1e-3 and np.quantile(off, 0.99) < 0.1


def test_a_hierarchy(cluster, tmp_path):
    vertices, faces = ball(120, 240)
    colors = np.clip(255 * (0.5 + 0.5 * vertices), 0, 255).astype("u1")
    write_ply(tmp_path / "ball.ply", vertices, faces, colors)
    pysplatkit.convert(tmp_path / "ball.ply", tmp_path / "ball.splk")
    alone = pysplatkit.Scene().add(tmp_path / "ball.splk")
    with renderer(tmp_path / "ball.splk") as ranks:
        for view in VIEWS:
            camera = alone.camera(SIZE, **view)
            same(ranks.render(SIZE, camera), alone.render(SIZE, camera))


def test_a_mesh_in_a_volume(cluster):
    vertices, faces = ball()
    volume = blob((40, 50, 60)).astype("f4")

    def scene():
        made = pysplatkit.Scene().add_mesh(15 * vertices + [30, 25, 20], faces, color="gold")
        return made.add_volume(volume, transfer="generic")

    alone = scene()
    with renderer(scene) as ranks:
        for view in VIEWS:
            camera = alone.camera(SIZE, **view)
            same(ranks.render(SIZE, camera), alone.render(SIZE, camera))
        # Clips and other options reach all ranks.
        options = {"clips": [pysplatkit.Clip.plane((1, 0, 0), 28.0)], "samples": 4, "shade": True}
        camera = alone.camera(SIZE)
        same(ranks.render(SIZE, camera, **options), alone.render(SIZE, camera, **options))


def test_colours_of_16_bits(cluster, bricks):
    alone = pysplatkit.Scene().add(bricks, transfer="generic").render(SIZE)
    with renderer(bricks, transfer="generic", precision="float16") as ranks:
        same(ranks.render(SIZE), alone)


def test_ranks_that_swap_halves(cluster, bricks, monkeypatch):
    from pysplatkit.ray import _renderer

    monkeypatch.setattr(_renderer, "_DIRECT", 2)
    alone = pysplatkit.Scene().add(bricks, transfer="generic")
    with renderer(bricks, ranks=8, transfer="generic") as ranks:
        for view in VIEWS:
            camera = alone.camera(SIZE, **view)
            same(ranks.render(SIZE, camera), alone.render(SIZE, camera))


def test_one_rank_draws_the_same_bytes(cluster, bricks):
    alone = pysplatkit.Scene().add(bricks, transfer="generic").render(SIZE)
    with renderer(bricks, ranks=1, transfer="generic") as ranks:
        assert decibels(ranks.render(SIZE).color, alone.color) > 100


def test_ranks_with_little_memory_agree_on_a_level(cluster, bricks):
    with renderer(bricks, ranks=3, transfer="generic", memory=300_000) as ranks:
        picture = ranks.render((400, 300))
        levels = {rank["level"] for rank in picture.statistics["ranks"]}
        assert len(levels) == 1 and levels.pop() > 0
        alone = pysplatkit.Scene().add(bricks, transfer="generic").render((400, 300))
        assert decibels(picture.color, alone.color) > 25


def test_a_killed_rank_is_started_again(cluster, bricks):
    alone = pysplatkit.Scene().add(bricks, transfer="generic").render((600, 450), samples=4)
    with renderer(bricks, transfer="generic") as ranks:
        ranks.render(SIZE)
        victim = ray.get(ranks.ranks[2].pid.remote())
        timer = threading.Timer(0.3, os.kill, (victim, signal.SIGKILL))
        timer.start()
        picture = ranks.render((600, 450), samples=4)
        assert timer.finished.is_set(), "the picture was done before the rank was killed"
        same(picture, alone)
        assert ray.get(ranks.ranks[2].pid.remote()) != victim


def test_a_film_and_a_straggler(cluster, tmp_path):
    volume = (200 * blob()).astype("u1")
    slow = tmp_path / "slow"

    def scene():
        # The first rank that comes here stops for a while.
        try:
            slow.mkdir()
        except FileExistsError:
            pass
        else:
            time.sleep(150)
        return pysplatkit.Scene().add(volume, transfer="generic")

    alone = pysplatkit.Scene().add(volume, transfer="generic")
    cameras = alone.turntable(7, SIZE)
    with renderer(scene, ranks=3) as ranks:
        start = time.monotonic()
        frames = list(ranks.render_path(cameras, SIZE, background=None))
        assert time.monotonic() - start < 120
    assert len(frames) == 7
    for frame, camera in zip(frames, cameras, strict=True):
        assert np.array_equal(frame.rgba, alone.render(SIZE, camera, background=None).rgba)


def test_errors_are_those_of_the_package(cluster, tmp_path):
    with renderer(tmp_path / "none.splv", ranks=2) as ranks:
        with pytest.raises(pysplatkit.MissingFileError) as caught:
            ranks.render(SIZE)
        assert caught.value.file == tmp_path / "none.splv"
    (tmp_path / "broken.ply").write_text("ply\nformat nonsense\n")
    with renderer(tmp_path / "broken.ply", ranks=2) as ranks:
        with pytest.raises(pysplatkit.InputError) as caught:
            ranks.render(SIZE)
        assert caught.value.file.name == "broken.ply" and caught.value.place
        with pytest.raises(pysplatkit.ArgumentError, match="render_path"):
            ranks.render(SIZE, optics="maximum")
        with pytest.raises(TypeError, match="backgroud"):
            ranks.render(SIZE, backgroud="red")
    with pytest.raises(pysplatkit.ArgumentError, match="more than the cluster has"):
        renderer("any.splv", ranks=1000)


def test_without_ray_the_error_names_the_command(tmp_path):
    (tmp_path / "ray.py").write_text("raise ImportError('no ray here')\n")
    path = os.pathsep.join([str(tmp_path), str(Path(pysplatkit.__file__).parents[1])])
    words = [sys.executable, "-c", "import pysplatkit.ray"]
    done = subprocess.run(
        words, capture_output=True, text=True, env={**os.environ, "PYTHONPATH": path}, check=False
    )
    assert done.returncode and 'pip install "pysplatkit[ray]"' in done.stderr


def cloud(path):
    """Writes a cloud that is divided into parts."""
    vertices, _ = ball(200, 400)
    write_ply(path, vertices)
    return path


def test_a_killed_worker_costs_its_part(cluster, tmp_path, monkeypatch):
    from pysplatkit.ray import _convert, convert

    log, killed = tmp_path / "log", []

    def slow(plan, index, load):
        # A function inside another one goes to the workers as it is.
        with open(log, "a") as file:
            file.write(f"{index} {os.getpid()}\n")
        time.sleep(1.5)
        pysplatkit._pysplatkit.make_part(plan, index, load)

    def begun():
        return [line.split() for line in log.read_text().splitlines()] if log.exists() else []

    def kill():
        while not begun():
            time.sleep(0.02)
        killed.append(int(begun()[0][1]))
        os.kill(killed[0], signal.SIGKILL)

    source = cloud(tmp_path / "cloud.ply")
    convert(source, tmp_path / "whole.splk", parts=4)
    monkeypatch.setattr(_convert, "_part", slow)
    killer = threading.Thread(target=kill)
    killer.start()
    out = convert(source, tmp_path / "out.splk", parts=4, folder=tmp_path / "parts")
    killer.join()
    assert killed and out.read_bytes() == (tmp_path / "whole.splk").read_bytes()
    parts = sorted(index for index, _ in begun())
    assert len(parts) == 5 and set(parts) == {"0", "1", "2", "3"}
    assert not list(tmp_path.glob(".*"))


def test_a_part_that_fails_says_why(cluster, tmp_path):
    from pysplatkit.ray import convert

    source, out = cloud(tmp_path / "cloud.ply"), tmp_path / "out.splk"
    folder = tmp_path / "parts"
    convert(source, out, parts=2, folder=folder)
    for part in folder.glob("part-*"):
        part.unlink()
    write_ply(source, ball(150, 300)[0])
    with pytest.raises(pysplatkit.InputError, match="when the plan was made"):
        convert(source, tmp_path / "other.splk", parts=2, folder=folder)
    assert not (tmp_path / "other.splk").exists()
    with pytest.raises(pysplatkit.OutputError, match="exists already"):
        convert(source, out)
    with pytest.raises(pysplatkit.ArgumentError, match="splk"):
        convert(source, tmp_path / "out.splv")
    with pytest.raises(pysplatkit.ArgumentError, match="preset"):
        convert(source, tmp_path / "other.splk", preset="quick")


def test_parts_need_no_command_and_are_those_of_one_machine(cluster, tmp_path, monkeypatch):
    from pysplatkit.ray import convert

    command = os.environ.get("SPLATKIT_COMMAND")
    source, in_parts = cloud(tmp_path / "cloud.ply"), tmp_path / "in-parts.splk"
    monkeypatch.delenv("SPLATKIT_COMMAND", raising=False)
    convert(source, in_parts, parts=4, color="height", lossless=True)
    assert not pysplatkit.check(in_parts).findings
    if not command or not Path(command).is_file():
        pytest.skip("SPLATKIT_COMMAND names no command")
    at_once = tmp_path / "at-once.splk"
    words = [command, "convert", source, "-o", at_once, "--parts", "4", "--color", "height"]
    subprocess.run([*words, "--lossless"], check=True)
    assert at_once.read_bytes() == in_parts.read_bytes()


def test_ranks_take_a_scene(cluster):
    scene = pysplatkit.Scene().add_volume(blob(), name="a").transform("a", translate=(5, 0, 0))
    camera = scene.camera(SIZE, view="left")
    with renderer(scene, ranks=2) as ranks:
        same(ranks.render(SIZE, camera), scene.render(SIZE, camera))
