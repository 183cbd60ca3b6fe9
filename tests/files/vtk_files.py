"""Writes files of every kind with VTK, and what they hold as JSON lines. Usage: vtk_files.py FOLDER.

Needs the package `vtk`, which brings numpy's arrays by `vtk.util.numpy_support`.
"""

import json
import os
import sys

import vtk

FOLDER = sys.argv[1]


def array(data, name, function, kind=vtk.vtkFloatArray, components=1, of_cells=False):
    """Adds an array with a function of positions."""
    values = kind()
    values.SetName(name)
    values.SetNumberOfComponents(components)
    source = data
    if of_cells:
        centres = vtk.vtkCellCenters()
        centres.SetInputData(data)
        centres.Update()
        source = centres.GetOutput()
    for index in range(source.GetNumberOfPoints()):
        value = function(source.GetPoint(index))
        for component in range(components):
            values.InsertNextValue(value[component] if components > 1 else value)
    (data.GetCellData() if of_cells else data.GetPointData()).AddArray(values)


def dress(data):
    """Adds identifiers, a field, a vector, a field of the cells, strings and bits."""
    count = iter(range(10**9))
    array(data, "GlobalNodeId", lambda p: next(count), vtk.vtkIdTypeArray)
    array(data, "t", lambda p: p[0] + 2 * p[1] - p[2] * p[2])
    array(data, "v", lambda p: (p[0], -p[1], 0.5), vtk.vtkDoubleArray, 3)
    array(data, "c", lambda p: p[0] * 3 + p[2], vtk.vtkDoubleArray, 1, True)
    words, bits = vtk.vtkStringArray(), vtk.vtkBitArray()
    words.SetName("words")
    bits.SetName("bits")
    for index in range(data.GetNumberOfPoints()):
        words.InsertNextValue("w %d" % index)
        bits.InsertNextValue(index % 2)
    data.GetPointData().AddArray(words)
    data.GetPointData().AddArray(bits)
    return data


def image():
    data = vtk.vtkImageData()
    data.SetExtent(2, 9, -1, 5, 0, 4)
    data.SetSpacing(0.5, 1, 0.25)
    data.SetOrigin(10, 0, -1)
    return dress(data)


def rectilinear():
    data = vtk.vtkRectilinearGrid()
    data.SetDimensions(6, 5, 4)
    for axis, count in zip("XYZ", (6, 5, 4)):
        places = vtk.vtkDoubleArray()
        for index in range(count):
            places.InsertNextValue(index * index / 4 + index)
        getattr(data, "Set%sCoordinates" % axis)(places)
    return dress(data)


def structured():
    data = vtk.vtkStructuredGrid()
    data.SetDimensions(5, 4, 3)
    points = vtk.vtkPoints()
    for k in range(3):
        for j in range(4):
            for i in range(5):
                points.InsertNextPoint(i + 0.2 * j, j + 0.1 * k * i, k + 0.1 * i)
    data.SetPoints(points)
    return dress(data)


def cell_types():
    """One cell of each type that fills space, side by side, with VTK's parametric coordinates."""
    data = vtk.vtkUnstructuredGrid()
    points = vtk.vtkPoints()
    kinds = [
        vtk.vtkTetra, vtk.vtkVoxel, vtk.vtkHexahedron, vtk.vtkWedge, vtk.vtkPyramid,
        vtk.vtkPentagonalPrism, vtk.vtkHexagonalPrism, vtk.vtkQuadraticTetra,
        vtk.vtkQuadraticHexahedron, vtk.vtkQuadraticWedge, vtk.vtkQuadraticPyramid,
        vtk.vtkTriQuadraticHexahedron, vtk.vtkQuadraticLinearWedge,
        vtk.vtkBiQuadraticQuadraticWedge, vtk.vtkBiQuadraticQuadraticHexahedron,
        vtk.vtkTriQuadraticPyramid,
    ]
    data.Allocate(len(kinds))
    for row, kind in enumerate(kinds):
        cell = kind()
        places = cell.GetParametricCoords()
        ids = vtk.vtkIdList()
        for node in range(cell.GetNumberOfPoints()):
            place = [places[3 * node + axis] for axis in range(3)]
            ids.InsertNextId(points.InsertNextPoint(place[0] + 2 * row, place[1], place[2]))
        data.InsertNextCell(cell.GetCellType(), ids)
    first = points.InsertNextPoint(0, 5, 0)
    points.InsertNextPoint(1, 5, 0)
    points.InsertNextPoint(0, 6, 0)
    points.InsertNextPoint(0, 5, 1)
    faces = [4, 3, 0, 2, 1, 3, 0, 1, 3, 3, 1, 2, 3, 3, 2, 0, 3]
    stream = vtk.vtkIdList()
    at = 1
    stream.InsertNextId(faces[0])
    while at < len(faces):
        stream.InsertNextId(faces[at])
        for corner in faces[at + 1:at + 1 + faces[at]]:
            stream.InsertNextId(first + corner)
        at += 1 + faces[at]
    data.SetPoints(points)
    data.InsertNextCell(vtk.VTK_POLYHEDRON, stream)
    return dress(data)


def polygons(strips):
    source = vtk.vtkSphereSource()
    source.SetThetaResolution(18)
    source.SetPhiResolution(11)
    source.SetCenter(100, 0, 0)
    last = source
    if strips:
        last = vtk.vtkStripper()
        last.SetInputConnection(source.GetOutputPort())
    last.Update()
    data = vtk.vtkPolyData()
    data.DeepCopy(last.GetOutput())
    return dress(data)


def area(data):
    triangles = vtk.vtkTriangleFilter()
    triangles.SetInputData(data)
    properties = vtk.vtkMassProperties()
    properties.SetInputConnection(triangles.GetOutputPort())
    properties.Update()
    return properties.GetSurfaceArea()


KINDS = {
    "image": (image, "volume", "vti", "ImageData"),
    "rectilinear": (rectilinear, "volume", "vtr", "RectilinearGrid"),
    "structured": (structured, "cells", "vts", "StructuredGrid"),
    "cells": (cell_types, "cells", "vtu", "UnstructuredGrid"),
    "polygons": (lambda: polygons(False), "mesh", "vtp", "PolyData"),
    "strips": (lambda: polygons(True), "mesh", "vtp", "PolyData"),
}


def facts(data, kind):
    """What a reader must find: counts, bounds, and the ranges of two arrays."""
    expected = {"kind": kind, "points": data.GetNumberOfPoints(), "cells": data.GetNumberOfCells()}
    expected["bounds"] = data.GetBounds()
    expected["t"] = data.GetPointData().GetArray("t").GetRange()
    expected["v"] = data.GetPointData().GetArray("v").GetRange(-1)
    expected["c"] = data.GetCellData().GetArray("c").GetRange()
    if kind == "mesh":
        expected["area"] = area(data)
    return expected


def report(name, expected):
    print(json.dumps({"file": name, **expected}))


def xml(name, data, expected, extension, writer):
    modes = [
        (mode, packing, order)
        for mode in ("Ascii", "Binary", "Appended")
        for packing in ("None", "ZLib", "LZ4", "LZMA")
        for order in ("Little", "Big")
        if mode != "Ascii" or (packing, order) == ("None", "Little")
    ]
    for number, (mode, packing, order) in enumerate(modes):
        file = "%s-%d.%s" % (name, number, extension)
        out = writer()
        out.SetFileName(os.path.join(FOLDER, file))
        out.SetInputData(data)
        getattr(out, "SetDataModeTo" + mode)()
        getattr(out, "SetCompressorTypeTo" + packing)()
        getattr(out, "SetByteOrderTo%sEndian" % order)()
        out.SetEncodeAppendedData(number % 2)
        out.SetHeaderTypeToUInt32() if number % 3 else out.SetHeaderTypeToUInt64()
        out.SetBlockSize(1 << 10)
        out.Write()
        report(file, expected)


def legacy(name, data, expected):
    for number, (kind, version) in enumerate([(1, 42), (2, 42), (1, 51), (2, 51)]):
        file = "%s-%d.vtk" % (name, number)
        out = vtk.vtkDataSetWriter()
        out.SetFileName(os.path.join(FOLDER, file))
        out.SetInputData(data)
        out.SetFileType(kind)
        out.SetFileVersion(version)
        out.Write()
        report(file, expected)


def parallel():
    waves = vtk.vtkRTAnalyticSource()
    waves.SetWholeExtent(-5, 5, -4, 4, -3, 3)
    tetrahedra = vtk.vtkDataSetTriangleFilter()
    tetrahedra.SetInputConnection(waves.GetOutputPort())
    for name, source, kind, what in [
        ("waves.pvti", waves, "ImageData", "volume"),
        ("waves.pvtu", tetrahedra, "UnstructuredGrid", "cells"),
    ]:
        out = getattr(vtk, "vtkXMLP%sWriter" % kind)()
        out.SetFileName(os.path.join(FOLDER, name))
        out.SetInputConnection(source.GetOutputPort())
        out.SetNumberOfPieces(3)
        out.SetStartPiece(0)
        out.SetEndPiece(2)
        out.SetGhostLevel(1)
        out.Write()
        source.UpdatePiece(0, 1, 0)
        data = source.GetOutput()
        expected = {"kind": what, "points": data.GetNumberOfPoints()}
        expected["cells"] = data.GetNumberOfCells()
        expected["bounds"] = data.GetBounds()
        expected["RTData"] = data.GetPointData().GetArray("RTData").GetRange()
        report(name, expected)


for name, (make, kind, extension, writer) in KINDS.items():
    data = make()
    expected = facts(data, kind)
    xml(name, data, expected, extension, getattr(vtk, "vtkXML%sWriter" % writer))
    legacy(name, data, expected)
parallel()
