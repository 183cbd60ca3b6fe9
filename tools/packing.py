"""The parts of tools/release that a shell does badly. Needs nothing but Python's own library.

packing.py notices TARGET           print the licences of the crates built into the command
packing.py pack FOLDER ARCHIVE      pack a folder as .tar.xz or .zip, the same bytes each time
packing.py unpack ARCHIVE FOLDER    unpack such an archive
packing.py sums [--check]           write SHA256SUMS of this folder's files, or compare them
packing.py picture FILE             fail if a PNG has fewer than 100 colours
"""

import hashlib
import json
import os
import subprocess
import sys
import tarfile
import time
import zipfile
import zlib
from pathlib import Path

SUMS = Path("SHA256SUMS")


def notices(target: str) -> None:
    """Prints the licence texts of all crates of the command, each text once."""
    metadata = json.loads(
        subprocess.check_output(
            ["cargo", "metadata", "--format-version", "1", "--locked"]
            + ["--filter-platform", target]
        )
    )
    packages = {package["id"]: package for package in metadata["packages"]}
    nodes = {node["id"]: node for node in metadata["resolve"]["nodes"]}
    (command,) = (p["id"] for p in metadata["packages"] if p["name"] == "splatkit-tools")
    built, left = set(), [command]
    while left:
        name = left.pop()
        if name in built:
            continue
        built.add(name)
        # Not what only builds or tests.
        for dependency in nodes[name]["deps"]:
            if any(kind["kind"] is None for kind in dependency["dep_kinds"]):
                left.append(dependency["pkg"])
    crates = [packages[name] for name in built if packages[name]["source"]]
    crates.sort(key=lambda crate: (crate["name"], crate["version"]))
    users: dict[str, list[str]] = {}
    print("The splatkit command contains Rust's standard library (MIT OR Apache-2.0)")
    print("and these crates. Their licences follow.\n")
    for crate in crates:
        title = f"{crate['name']} {crate['version']}"
        print(f"{title}: {crate['license'] or crate['license_file']}", crate["repository"] or "")
        for file in sorted(Path(crate["manifest_path"]).parent.rglob("*")):
            if is_licence(file):
                text = file.read_bytes().decode("utf-8", "replace").replace("\r\n", "\n").strip()
                users.setdefault(text, []).append(title)
    for text, titles in users.items():
        print(f"\n{'-' * 79}\n{', '.join(dict.fromkeys(titles))}\n\n{text}")


def is_licence(file: Path) -> bool:
    name = file.name.lower()
    # Fonts have theirs beside them, under the font's name.
    named = any(word in name for word in ("licen", "copying", "notice"))
    named |= file.parent.name == "fonts"
    # Such as LICENSE-MIT, LICENSE_1_0.txt and LICENSE.md, but not license.rs.
    return named and file.suffix.lower() in ("", ".txt", ".md") and file.is_file()


def pack(folder: Path, archive: Path) -> None:
    """Packs a folder under its own name. Times, owners and the order of files are fixed."""
    when = int(os.environ["SOURCE_DATE_EPOCH"])
    files = sorted(file for file in folder.rglob("*") if file.is_file())
    names = [(file, file.relative_to(folder.parent).as_posix()) for file in files]
    if archive.suffix == ".zip":
        with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as packed:
            for file, name in names:
                entry = zipfile.ZipInfo(name, time.gmtime(when)[:6])
                entry.compress_type = zipfile.ZIP_DEFLATED
                entry.external_attr = mode(file) << 16
                packed.writestr(entry, file.read_bytes())
        return
    with tarfile.open(archive, "w:xz") as tar:
        for file, name in names:
            info = tarfile.TarInfo(name)
            info.size, info.mtime, info.mode = file.stat().st_size, when, mode(file)
            with file.open("rb") as content:
                tar.addfile(info, content)


def mode(file: Path) -> int:
    return 0o755 if file.name in ("splatkit", "splatkit.exe") else 0o644


def unpack(archive: Path, folder: Path) -> None:
    if archive.suffix == ".zip":
        with zipfile.ZipFile(archive) as packed:
            packed.extractall(folder)
        return
    with tarfile.open(archive) as tar:
        tar.extractall(folder, filter="data")


def sums(check: bool) -> None:
    """Writes or compares the checksums, in the form that `sha256sum --check` reads."""
    files = sorted(file for file in Path().iterdir() if file != SUMS)
    lines = (f"{hashlib.sha256(file.read_bytes()).hexdigest()}  {file}\n" for file in files)
    text = "".join(lines)
    if not check:
        SUMS.write_text(text, newline="\n")
    elif SUMS.read_text() != text:
        sys.exit(f"error: {SUMS} differs from the files beside it")


def picture(file: Path) -> None:
    """Fails if a PNG of 8 bits has too few colours to show anything."""
    data = file.read_bytes()
    if data[:8] != b"\x89PNG\r\n\x1a\n":
        sys.exit(f"error: {file} is no PNG")
    at, packed = 8, b""
    while at < len(data):
        size, kind = int.from_bytes(data[at : at + 4], "big"), data[at + 4 : at + 8]
        body = data[at + 8 : at + 8 + size]
        if kind == b"IHDR":
            width, height = (int.from_bytes(body[i : i + 4], "big") for i in (0, 4))
            depth, channels = body[8], {2: 3, 6: 4}[body[9]]
        packed += body if kind == b"IDAT" else b""
        at += 12 + size
    if depth != 8:
        sys.exit(f"error: {file} has {depth} bits")
    rows, stride = zlib.decompress(packed), width * channels
    above = bytearray(stride)
    colors: set[bytes] = set()
    for y in range(height):
        start = y * (stride + 1)
        predictor, row = rows[start], bytearray(rows[start + 1 : start + 1 + stride])
        for i in range(stride):
            left = row[i - channels] if i >= channels else 0
            corner = above[i - channels] if i >= channels else 0
            near = (0, left, above[i], (left + above[i]) // 2)
            guess = near[predictor] if predictor < 4 else paeth(left, above[i], corner)
            row[i] = (row[i] + guess) & 255
        colors.update(bytes(row[x : x + channels]) for x in range(0, stride, channels))
        above = row
    print(f"{file.name}: {width}x{height}, {len(colors)} colours")
    if len(colors) < 100:
        sys.exit(f"error: {file} shows nothing")


def paeth(left: int, above: int, corner: int) -> int:
    guess = left + above - corner
    return min((left, above, corner), key=lambda value: abs(guess - value))


match sys.argv[1:]:
    case ["notices", target]:
        notices(target)
    case ["pack", folder, archive]:
        pack(Path(folder), Path(archive))
    case ["unpack", archive, folder]:
        unpack(Path(archive), Path(folder))
    case ["sums", *rest] if rest in ([], ["--check"]):
        sums(bool(rest))
    case ["picture", file]:
        picture(Path(file))
    case _:
        sys.exit(__doc__)
