"""Files: facts, checks, conversions, hierarchies, and errors."""

from __future__ import annotations

import json
import pickle

import numpy as np
import pytest

import pysplatkit

NAMES = [
    "volume.npy",
    "bytes.npy",
    "mesh.ply",
    "cloud.ply",
    "samples.npy",
    "cells.vtk",
    "tree.splk",
    "bricks.splv",
    "trained.spz",
]


@pytest.mark.parametrize("name", NAMES)
def test_facts_and_findings_are_those_of_the_command(command, data, name):
    path = data / name
    assert pysplatkit.info(path) == json.loads(command("info", "--json", path))
    expected = json.loads(command("check", "--json", path))
    report = pysplatkit.check(path)
    assert bool(report) and report.ok == expected["ok"]
    assert [finding._asdict() for finding in report.findings] == expected["findings"]


def test_an_input_out_of_sight_is_found(tmp_path):
    path = tmp_path / "far.bin"
    path.write_bytes(bytes(range(8)))
    how = {"dims": (2, 2, 2), "sample_type": "u8", "spacing": (1e30, 1e30, 1e30)}
    report = pysplatkit.check(path, **how)
    assert not report.ok
    assert [finding.code for finding in report.findings] == ["out-of-sight"]
    assert "the content reaches from" in report.findings[0].message


CONVERSIONS = [
    ("colors.ply", "splk", [], {}),
    (
        "mesh.ply",
        "splk",
        ["--color", "height", "--preset", "fast", "--unit", "m"],
        {"color": "height", "preset": "fast", "unit": "m"},
    ),
    ("cloud.ply", "splk", ["--lossless", "--up", "z"], {"lossless": True, "up": (0, 0, 1)}),
    ("tree.splk", "ply", [], {}),
    ("trained.spz", "splk", [], {}),
    ("trained.spz", "splat", [], {}),
    ("trained.spz", "compressed.ply", [], {}),
    ("mesh.ply", "glb", ["--radius-scale", "2"], {"radius_scale": 2}),
    (
        "cloud.ply",
        "laz",
        ["--translate", "1,2,3", "--thin", "50%", "--where", "x > -9"],
        {"edits": [("translate", (1, 2, 3)), ("thin", "50%"), ("where", "x > -9")]},
    ),
    ("trained.spz", "ply", ["--scale", "2"], {"edits": [("scale", 2)]}),
    ("bytes.npy", "nrrd", [], {}),
    ("bytes.npy", "splv", ["--spacing", "2"], {"spacing": 2}),
    ("volume.npy", "nrrd", ["--lattice", "bcc"], {"lattice": "bcc"}),
]


@pytest.mark.parametrize(("name", "kind", "flags", "options"), CONVERSIONS)
def test_conversions_are_those_of_the_command(command, data, tmp_path, name, kind, flags, options):
    theirs, ours = tmp_path / f"theirs.{kind}", tmp_path / f"own.{kind}"
    command("convert", data / name, "-o", theirs, *flags)
    assert pysplatkit.convert(data / name, ours, **options) == ours
    assert ours.read_bytes() == theirs.read_bytes()
    assert sorted(path.name for path in tmp_path.iterdir()) == [ours.name, theirs.name]


def test_scans_larger_than_memory_are_converted_in_regions(data, tmp_path):
    from conftest import write_ply

    random = np.random.default_rng(1)
    write_ply(tmp_path / "scan.ply", random.uniform(size=(300_000, 3)) * [10, 10, 0.01])
    pysplatkit.convert(tmp_path / "scan.ply", tmp_path / "scan.splk", memory=220 << 20)
    hierarchy = pysplatkit.Hierarchy(tmp_path / "scan.splk")
    assert hierarchy.splats > 290_000 and pysplatkit.check(tmp_path / "scan.splk")
    picture = pysplatkit.render(tmp_path / "scan.splk", size=(64, 48), budget=5000)
    assert picture.statistics["splats"] < 40_000


def test_hierarchies_are_open_books(data):
    hierarchy = pysplatkit.Hierarchy(data / "tree.splk")
    assert len(hierarchy) == hierarchy.splats > 0 and hierarchy.has_color
    assert hierarchy.degree is None and hierarchy.source == "colors.ply"
    leaves = hierarchy.leaves()
    assert leaves.positions.shape == (hierarchy.splats, 3) and leaves.colors.shape[1] == 4
    low, high = np.array(hierarchy.bounds)
    assert (leaves.positions >= low).all() and (leaves.positions <= high).all()
    assert np.allclose(leaves.covariances, leaves.covariances.transpose(0, 2, 1))
    assert np.allclose(np.linalg.norm(leaves.normals, axis=1), 1, atol=1e-3)
    assert (np.linalg.eigvalsh(leaves.covariances.astype(float))[:, 0] > -1e-6).all()


def test_errors_say_what_to_do(data, tmp_path):
    with pytest.raises(FileNotFoundError) as caught:
        pysplatkit.render(tmp_path / "none.ply")
    assert isinstance(caught.value, pysplatkit.FileError) and caught.value.errno == 2
    assert caught.value.file == tmp_path / "none.ply" and caught.value.filename.endswith("none.ply")
    (tmp_path / "bad.ply").write_text("ply\nformat ascii 1.0\nelement vertex x\nend_header\n")
    with pytest.raises(pysplatkit.InputError) as caught:
        pysplatkit.render(tmp_path / "bad.ply")
    assert caught.value.file.name == "bad.ply" and caught.value.place and caught.value.message
    (tmp_path / "what.xyzzy").write_bytes(b"\0\1\2")
    with pytest.raises(pysplatkit.InputError, match="no format") as caught:
        pysplatkit.info(tmp_path / "what.xyzzy")
    assert "dims" in caught.value.hint
    with pytest.raises(pysplatkit.LimitError) as limit:
        pysplatkit.render(data / "mesh.ply", limits={"points": 10})
    assert (limit.value.kind, limit.value.limit) == ("points", 10) and limit.value.found > 10
    with pytest.raises(pysplatkit.OutputError) as caught:
        pysplatkit.convert(data / "mesh.ply", data / "tree.splk")
    with pytest.raises(pysplatkit.OutputError, match="No such file"):
        pysplatkit.convert(data / "mesh.ply", tmp_path / "none" / "a.splk")
    with pytest.raises(pysplatkit.ArgumentError, match="can be written"):
        pysplatkit.convert(data / "mesh.ply", tmp_path / "a.obj")
    with pytest.raises(pysplatkit.ArgumentError, match="holds no volume"):
        pysplatkit.convert(data / "mesh.ply", tmp_path / "a.splv")
    with pytest.raises(pysplatkit.InputError):
        pysplatkit.Hierarchy(data / "mesh.ply")
    for error in (limit.value, caught.value):
        again = pickle.loads(pickle.dumps(error))
        assert type(again) is type(error) and str(again) == str(error)


def test_raw_volumes_and_names(tmp_path):
    values = np.arange(24, dtype=">u2").reshape(2, 3, 4)
    path = tmp_path / "übung.raw"
    path.write_bytes(b"head" + values.tobytes())
    facts = pysplatkit.info(path, dims=(4, 3, 2), sample_type="u16", endian="big", header=4)
    assert facts["range"] == [0, 23] and facts["dims"] == [4, 3, 2]
    with pytest.raises(pysplatkit.ArgumentError, match="both dims"):
        pysplatkit.info(path, dims=(4, 3, 2))
    with pytest.raises(TypeError, match="did you mean 'sample_type'"):
        pysplatkit.info(path, sampletype="u16")
    assert any("ply" in known.extensions for known in pysplatkit.formats())
