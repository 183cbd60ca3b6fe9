"""Data that several tests share."""

from __future__ import annotations

import os
import struct
import subprocess
import zlib
from pathlib import Path

import numpy as np
import pytest


def blob(dims=(18, 20, 24)):
    """Returns a volume [z, y, x] with a shell and a core, none of it symmetric."""
    z, y, x = np.meshgrid(*(np.linspace(-1, 1, n) for n in dims), indexing="ij")
    core = np.exp(-6 * ((x - 0.2) ** 2 + y**2 + (z + 0.1) ** 2))
    return core + 0.3 * np.exp(-20 * (np.sqrt(x**2 + 0.7 * y**2 + z**2) - 0.7) ** 2)


def ball(rows=12, columns=24):
    """Returns the vertices and the faces of an egg."""
    theta = np.linspace(0, np.pi, rows)[:, None]
    phi = np.linspace(0, 2 * np.pi, columns, endpoint=False)[None, :]
    ring = np.sin(theta)
    places = [ring * np.cos(phi), 0.8 * ring * np.sin(phi), 1.2 * np.cos(theta) + 0 * phi]
    vertices = np.stack(places, axis=-1).reshape(-1, 3)
    at = np.arange(rows * columns).reshape(rows, columns)
    below, right = at[1:], np.roll(at, -1, axis=1)
    quads = [at[:-1], below, right[1:], right[:-1]]
    a, b, c, d = (quad.ravel() for quad in quads)
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    # The triangles at the poles have no area.
    corners = vertices[faces]
    a, b, c = corners.transpose(1, 0, 2)
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    return vertices, faces[area > 1e-9]


def particles(count=400):
    """Returns positions and values."""
    random = np.random.default_rng(5)
    positions = random.normal(size=(count, 3)) * [1.0, 0.7, 0.5]
    return positions, np.exp(-np.sum(positions**2, axis=1)) + 0.1 * positions[:, 0]


def write_ply(path, vertices, faces=None, colors=None):
    """Writes a binary PLY file."""
    kinds = [("xyz", "<f4", 3)]
    header = [f"element vertex {len(vertices)}", *(f"property float {axis}" for axis in "xyz")]
    if colors is not None:
        kinds.append(("rgb", "u1", 3))
        header += [f"property uchar {name}" for name in ("red", "green", "blue")]
    rows = np.zeros(len(vertices), dtype=[(name, kind, (n,)) for name, kind, n in kinds])
    rows["xyz"] = vertices
    if colors is not None:
        rows["rgb"] = colors
    body = rows.tobytes()
    if faces is not None:
        header += [f"element face {len(faces)}", "property list uchar int vertex_indices"]
        lists = np.zeros(len(faces), dtype=[("count", "u1"), ("at", "<i4", (3,))])
        lists["count"], lists["at"] = 3, faces
        body += lists.tobytes()
    lines = ["ply", "format binary_little_endian 1.0", *header, "end_header", ""]
    Path(path).write_bytes("\n".join(lines).encode() + body)


def write_cells(path):
    """Writes a grid of cells with values as a legacy VTK file."""
    n = 4
    axis = np.linspace(-1, 1, n)
    points = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), -1).reshape(-1, 3)
    at = np.arange(n**3).reshape(n, n, n)
    corners = [
        (0, 0, 0),
        (1, 0, 0),
        (1, 1, 0),
        (0, 1, 0),
        (0, 0, 1),
        (1, 0, 1),
        (1, 1, 1),
        (0, 1, 1),
    ]
    cells = [[at[i + a, j + b, k + c] for a, b, c in corners] for i, j, k in np.ndindex(3, 3, 3)]
    values = np.exp(-2 * np.sum(points**2, axis=1)) + 0.2 * points[:, 0]
    lines = ["# vtk DataFile Version 3.0", "cells", "ASCII", "DATASET UNSTRUCTURED_GRID"]
    lines += [f"POINTS {len(points)} double"]
    lines += [" ".join(map(repr, row)) for row in points.tolist()]
    lines += [f"CELLS {len(cells)} {9 * len(cells)}"]
    lines += ["8 " + " ".join(map(str, cell)) for cell in cells]
    lines += [f"CELL_TYPES {len(cells)}", *(["12"] * len(cells))]
    lines += [f"POINT_DATA {len(points)}", "SCALARS heat double 1", "LOOKUP_TABLE default"]
    lines += [repr(value) for value in values.tolist()]
    Path(path).write_text("\n".join(lines) + "\n")


def read_png(path):
    """Returns the pixels of a PNG of 8 bits a channel."""
    data = Path(path).read_bytes()
    at, packed = 8, b""
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at : at + 8])
        body = data[at + 8 : at + 8 + length]
        if kind == b"IHDR":
            width, height, _, color = struct.unpack(">IIBB", body[:10])
        packed += body if kind == b"IDAT" else b""
        at += 12 + length
    channels = {2: 3, 6: 4}[color]
    lines = np.frombuffer(zlib.decompress(packed), np.uint8).reshape(height, -1)
    out = np.zeros((height + 1, width * channels + channels), np.int32)
    for row, line in enumerate(lines, 1):
        unfilter(int(line[0]), line[1:].astype(np.int32), out[row], out[row - 1], channels)
    return out[1:, channels:].reshape(height, width, channels).astype(np.uint8)


def unfilter(kind, line, out, above, channels):
    """Undoes the filter of a line of a PNG. Before the first pixel there are zeros."""
    for at in range(channels, len(out)):
        left, up, corner = out[at - channels], above[at], above[at - channels]
        if kind == 4:
            guess = left + up - corner
            near = [abs(guess - left), abs(guess - up), abs(guess - corner)]
            add = (left, up, corner)[near.index(min(near))]
        else:
            add = (0, left, up, (left + up) // 2)[kind]
        out[at] = (line[at - channels] + add) & 255


@pytest.fixture(scope="session")
def command():
    """Returns a function that runs the command, which must be built already."""
    path = os.environ.get("SPLATKIT_COMMAND")
    if not path or not Path(path).is_file():
        pytest.skip("SPLATKIT_COMMAND names no command to compare with")

    def run(*arguments):
        words = [path, *map(str, arguments)]
        return subprocess.run(words, check=True, capture_output=True, text=True).stdout

    return run


@pytest.fixture(scope="session")
def data(tmp_path_factory):
    """Returns a folder with a file of each kind."""
    import pysplatkit

    folder = tmp_path_factory.mktemp("data")
    volume = blob()
    np.save(folder / "volume.npy", volume.astype("f4"))
    np.save(folder / "bytes.npy", (255 * volume / volume.max()).astype("u1"))
    vertices, faces = ball()
    colors = np.clip(255 * (0.5 + 0.5 * vertices), 0, 255).astype("u1")
    write_ply(folder / "mesh.ply", vertices, faces)
    write_ply(folder / "colors.ply", vertices, faces, colors)
    write_ply(folder / "cloud.ply", vertices, None, colors)
    positions, values = particles()
    np.save(folder / "samples.npy", np.column_stack([positions, values]))
    write_cells(folder / "cells.vtk")
    pysplatkit.convert(folder / "colors.ply", folder / "tree.splk")
    pysplatkit.convert(folder / "bytes.npy", folder / "bricks.splv")
    pysplatkit.convert(folder / "colors.ply", folder / "trained.spz")
    return folder


#: The word “engine”, packed by lzip.
ENGINE = bytes.fromhex(
    "4c5a4950011a00329b8919dfb867cdf97ffffcd5c0008d1aa8e806000000000000002a00000000000000"
)


@pytest.fixture
def viewer(tmp_path):
    """A viewer that draws nothing."""
    folder = tmp_path / "viewer"
    folder.mkdir()
    for name in ("splatkit-worker.js", "splatkit-viewer.js", "splatkit-unpack.wasm"):
        (folder / name).write_text(f"// {name}")
    (folder / "splatkit.wasm.lz").write_bytes(ENGINE)
    return folder
