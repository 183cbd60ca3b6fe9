"""Writes files of laboratories into a folder, by the package that is named, and prints for each a
line of JSON: the file, how to read it, its spacing and origin if the package knows them, and the
file with the values that are expected (64-bit floats, x fastest)."""

import importlib
import json
import os
import sys

folder, package = sys.argv[1:]
try:
    np = importlib.import_module("numpy")
    lib = importlib.import_module(package)
except ImportError as error:
    print(f"ImportError: {error}", file=sys.stderr)
    sys.exit(3)
os.chdir(folder)

z, y, x = np.mgrid[0:5, 0:6, 0:7]
base = (1000 * np.sin(x / 3) + 300 * np.cos(y / 2) + 77 * z).round().astype("i2")
unsigned = (base.astype("i4") - base.min()).astype("u2")
byte = (unsigned >> 4).clip(0, 255).astype("u1")
count = 0


def says(file, values, spacing=None, origin=None, **how):
    global count
    count += 1
    expected = f"expected-{count}.f64"
    np.ascontiguousarray(values, dtype="<f8").tofile(expected)
    line = dict(file=file, expected=expected, shape=list(values.shape), how=how)
    print(json.dumps(dict(line, spacing=spacing, origin=origin)))


def numpy():
    for kind in "bool i1 u1 <i2 >i2 <u4 >u4 <i8 >u8 <f2 >f2 <f4 >f8 <c8 >c16".split():
        array = (base > 300) if kind == "bool" else byte // 2 if kind == "i1" else base
        array = np.abs(array) if "u" in kind else array
        if kind == "u1":
            array = byte
        array = array.astype(kind)
        name = f"a{count}.npy"
        np.save(name, array)
        values = np.abs(array) if "c" in kind else array
        says(name, values.astype("f4"))
    np.save("fortran.npy", np.asfortranarray(base.T))
    says("fortran.npy", base)
    np.save("vector.npy", np.stack([base, byte], -1).astype("f8"))
    says("vector.npy", byte.astype("f8"), scalar="v:1")
    np.save("times.npy", np.stack([base] * 5 + [-base]))
    says("times.npy", -base, time=5)
    for name, write in [("a.npz", np.savez), ("b.npz", np.savez_compressed)]:
        write(name, ct=base, mask=byte[1:], affine=np.eye(4))
        says(name, base)
        says(name, byte[1:], dataset="mask")


def SimpleITK():
    image = lib.GetImageFromArray(base)
    image.SetSpacing((0.5, 0.75, 2.0))
    image.SetOrigin((-10.0, 20.0, 30.0))
    image.SetDirection((0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0))

    def place():
        at = image.TransformIndexToPhysicalPoint((3, 1, 2))
        return dict(spacing=list(image.GetSpacing()), origin=list(image.GetOrigin()), at=list(at))

    for name in ["a.mha", "a.mhd"]:
        for packed in [False, True]:
            file = f"{packed}-{name}"
            lib.WriteImage(image, file, packed)
            header = place()
            says(file, base, header["spacing"], header["origin"], at=header["at"])
    kinds = "UInt8 Int8 UInt16 Int32 UInt32 Int64 UInt64 Float32 Float64".split()
    for kind in kinds:
        array = byte // 2 if "8" in kind else unsigned if "U" in kind else base
        cast = lib.Cast(lib.GetImageFromArray(array.astype("f8")), getattr(lib, f"sitk{kind}"))
        lib.WriteImage(cast, f"{kind}.mha")
        says(f"{kind}.mha", array)
    parts = [lib.GetImageFromArray(part.astype("f4")) for part in (base, byte)]
    lib.WriteImage(lib.Compose(parts), "vector.mha")
    says("vector.mha", byte, scalar="v:1")
    both = np.sqrt(base.astype("f8") ** 2 + byte.astype("f8") ** 2).astype("f4")
    says("vector.mha", both)


def tifffile():
    def write(name, array, values=None, how={}, spacing=None, **options):
        try:
            lib.imwrite(name, array, **{"photometric": "minisblack", **options})
        except (ImportError, ValueError, KeyError) as error:
            print(f"left out: {name}: {error}", file=sys.stderr)
            return
        says(name, array if values is None else values, spacing, **how)

    for kind in "u1 i1 u2 i2 u4 i4 f2 f4 f8".split():
        array = byte // 2 if kind == "i1" else byte if kind == "u1" else unsigned
        write(f"{kind}.tif", array.astype(kind))
    for packing in ["lzw", "deflate", "packbits"]:
        write(f"{packing}.tif", unsigned, compression=packing)
        write(f"tiles-{packing}.tif", unsigned, compression=packing, tile=(16, 16))
    write("predicted.tif", unsigned, compression="deflate", predictor=True)
    write("floats.tif", base.astype("f4"), compression="deflate", predictor=3)
    write("big.tif", unsigned, bigtiff=True)
    write("order.tif", unsigned, byteorder=">")
    write("strips.tif", unsigned, rowsperstrip=2)
    write("bits.tif", byte > 30, values=(byte > 30).astype("u1"))
    write("one.tif", unsigned, truncate=True)
    colours = np.stack([byte, byte, byte], -1)
    write("colours.tif", colours, values=byte, photometric="rgb")
    planes = np.stack([byte, byte // 2, byte], 1)
    write("planes.tif", planes, byte // 2, dict(scalar="green"), photometric="rgb", planarconfig=2)
    write("times.tif", np.stack([unsigned, byte]).astype("u2"), byte, dict(time=1))
    common = dict(imagej=True, resolution=(2, 4), photometric="minisblack")
    near = dict(spacing=1.5, unit="um")
    write("ij.tif", unsigned, spacing=[0.5, 0.25, 1.5], metadata=dict(near, axes="ZYX"), **common)
    write("ij1.tif", unsigned, metadata=dict(axes="ZYX"), truncate=True, **common)
    stack = np.stack([unsigned, byte], 1)[None]
    stack = np.concatenate([stack, stack // 3]).astype("u2")
    hyper = dict(metadata=dict(near, axes="TZCYX"), **common)
    write("hyper.tif", stack, stack[1, :, 1], dict(time=1, scalar="channel:1"), **hyper)
    lengths = {f"PhysicalSize{axis}": size for axis, size in zip("XYZ", (0.5, 0.25, 1500.0))}
    lengths["PhysicalSizeZUnit"] = "nm"
    ome = dict(axes="TZCYX", **lengths)
    how = dict(time=1, scalar="channel:1")
    write("a.ome.tif", stack, stack[1, :, 1], how, [0.5, 0.25, 1.5], metadata=ome)


def mrcfile():
    for kind, array in [
        ("i1", byte // 2),
        ("i2", base),
        ("u2", unsigned),
        ("f2", byte),
        ("f4", base),
        ("c8", base),
    ]:
        with lib.new(f"{kind}.mrc", array.astype(kind)) as file:
            file.voxel_size = (1.5, 2.0, 2.5)
            file.header.origin = (5.0, 6.0, 7.0)
            if kind == "i2":
                file.set_extended_header(np.zeros(3, dtype="V80"))
        says(f"{kind}.mrc", np.abs(array) if kind == "c8" else array, [1.5, 2.0, 2.5], [5, 6, 7])
    with lib.new("stack.mrc", np.stack([base, unsigned // 2]).astype("f4")):
        pass
    says("stack.mrc", unsigned // 2, time=1)


def h5py():
    with lib.File("a.h5", "w") as file:
        file["small"] = byte[:2]
        file["text"] = "not numbers"
        group = file.create_group("scan/1")
        packed = dict(chunks=(2, 4, 4))
        for name, how in [
            ("deflate", dict(compression="gzip", shuffle=True)),
            ("lzf", dict(compression="lzf")),
            ("checked", dict(fletcher32=True)),
            ("scaled", dict(scaleoffset=0)),
            ("chunks", {}),
        ]:
            group.create_dataset(name, data=base, **packed, **how)
        group["deflate"].attrs["element_size_um"] = (2.0, 0.75, 0.5)
        group["big"] = base.astype(">f8")
        group["half"] = byte.astype("f2")
        group["mask"] = base > 300
        group["complex"] = base.astype("c16")
        group["vector"] = np.stack([base, byte], -1)
        group["circle"] = file["scan"]
        file["soft"] = lib.SoftLink("/small")
        file["away"] = lib.ExternalLink("none.h5", "/x")
    says("a.h5", base, [0.5, 0.75, 2.0], dataset="scan/1/deflate")
    for name in ["lzf", "checked", "scaled", "chunks", "big"]:
        says("a.h5", base, dataset=f"scan/1/{name}")
    says("a.h5", byte, dataset="scan/1/half")
    says("a.h5", base > 300, dataset="scan/1/mask")
    says("a.h5", np.abs(base), dataset="scan/1/complex")
    says("a.h5", byte, dataset="scan/1/vector", scalar="v:1")
    says("a.h5", byte[:2], dataset="small")
    with lib.File("new.h5", "w", libver=("v110", "v110")) as file:
        free = dict(chunks=(2, 4, 4), maxshape=(None, 6, 7), compression="gzip")
        file.create_dataset("v", data=base, **free)
    says("new.h5", base)
    with lib.File("image.vtkhdf", "w") as file:
        group = file.create_group("VTKHDF")
        group.attrs["Type"] = np.bytes_("ImageData")
        group.attrs["WholeExtent"] = (1, 7, 0, 5, 0, 4)
        group.attrs["Origin"] = (1.0, 2.0, 3.0)
        group.attrs["Spacing"] = (0.5, 1.0, 2.0)
        group.attrs["Direction"] = (1.0, 0, 0, 0, 1, 0, 0, 0, 1)
        points = group.create_group("PointData")
        points["other"] = byte
        points["ct"] = base
        points["flow"] = np.stack([base, byte, byte], -1)
        points.attrs["Scalars"] = np.bytes_("ct")
        group.create_group("CellData")["q"] = byte[1:, 1:, 1:]
    says("image.vtkhdf", base, [0.5, 1.0, 2.0], [1.5, 2.0, 3.0])
    says("image.vtkhdf", byte, scalar="flow:y")
    says("image.vtkhdf", byte[1:, 1:, 1:], None, [1.75, 2.5, 4.0], scalar="cell:q")


globals()[package]()
