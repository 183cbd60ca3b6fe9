// Part of ../cases.rs.
vec![
    // VTK.
    (
        "extent.vti",
        vtk_xml("ImageData", "", &vti_piece(""))
            .replace("0 1 0 1 0 0", "0 9223372036854775807 0 1 0 0")
            .into(),
        "extent.vti: extent: 0 to 9223372036854775807 is not a valid range of indices",
    ),
    (
        "wrap.vti",
        vtk_xml("ImageData", "", &vti_piece(""))
            .replace("0 1 0 1 0 0", "-9223372036854775808 9223372036854775807 0 1 0 0")
            .into(),
        "wrap.vti: extent: -9223372036854775808 to 9223372036854775807 is not a valid range of \
         indices",
    ),
    (
        "backwards.vti",
        vtk_xml("ImageData", "", &vti_piece(&array("format='ascii'", "1")))
            .replace("0 1 0 1 0 0", "1 0 0 1 0 0")
            .into(),
        "backwards.vti: extent: 1 to 0 is not a valid range of indices",
    ),
    (
        "large.vti",
        vtk_xml("ImageData", "", &vti_piece(&array("format='ascii'", "1")))
            .replace("0 1 0 1 0 0", "0 999 0 999 0 999")
            .into(),
        "large.vti: DataArray “v”: there are 1 numbers where 1000000000 were expected",
    ),
    (
        "fewer.vti",
        vti("1 2 3"),
        "fewer.vti: DataArray “v”: there are 3 numbers where 4 were expected",
    ),
    (
        "more.vti",
        vti("1 2 3 4 5"),
        "more.vti: DataArray “v”: there are more than the 4 numbers expected",
    ),
    (
        "words.vti",
        vti("1 2 three 4"),
        "words.vti: DataArray “v”: number 2 is “three”, which is not a valid u8",
    ),
    ("comma.vti", vti("1,5 2,5"), "volume [2, 2, 1] [1.0, 5.0]"),
    (
        "count.vti",
        binary("", &counts(&[u32::MAX, 1])),
        "count.vti: DataArray “v”: claims 4294967295 bytes where 4 were expected",
    ),
    (
        "blocks.vti",
        binary(" compressor='vtkZLibDataCompressor'", &counts(&[u32::MAX, 4, 4])),
        "blocks.vti: DataArray “v”: claims 4294967295 blocks of 4 bytes, the last of 4, where \
         4 bytes were expected",
    ),
    (
        "lie.vti",
        binary(" compressor='vtkZLibDataCompressor'", &counts(&[1, 4, 0, u32::MAX])),
        "lie.vti: DataArray “v”: block 0 claims 4294967295 bytes, but 0 are left",
    ),
    (
        "bomb.vti",
        binary(" compressor='vtkZLibDataCompressor'", &{
            let b = zlib(&vec![0; 1 << 24]);
            [counts(&[1, 4, 0, b.len() as u32]), b].concat()
        }),
        "bomb.vti: DataArray “v”: block 0 unpacks to more than its 4 bytes",
    ),
    (
        "base64.vti",
        vtk_xml("ImageData", "", &vti_piece(&array("format='binary'", "????"))).into(),
        "base64.vti: DataArray “v”: is not valid base64 (after 3 bytes): Invalid symbol 63, \
         offset 0.",
    ),
    (
        "laughs.vti",
        format!("{laughs}{}", String::from_utf8_lossy(&vti("&l29;"))).into(),
        "laughs.vti: DataArray “v”: there are 0 numbers where 4 were expected",
    ),
    (
        "laughname.vti",
        format!(
            "{laughs}{}",
            String::from_utf8_lossy(&vti("1 2 3 4")).replace("Name='v'", "Name='&l29;'")
        )
        .into(),
        "laughname.vti: byte 1998: has an invalid attribute: at 1..4: unrecognized entity \
         `l29`",
    ),
    (
        "deep.vti",
        vtk_xml("ImageData", "", &format!("{}{}", "<a>".repeat(100), "</a>".repeat(100)))
            .into(),
        "deep.vti: byte 296: the nesting depth is 65, over the limit of 64",
    ),
    (
        "lz4.vti",
        binary(" compressor='vtkLZ4DataCompressor'", &[]),
        "lz4.vti: DataArray “v”: ends inside the sizes of its blocks",
    ),
    (
        "other.vti",
        binary(" compressor='vtkOtherDataCompressor'", &[]),
        "other.vti: VTKFile: compressor=“vtkOtherDataCompressor” is not supported",
    ),
    (
        "lzma.vti",
        binary(" compressor='vtkLZMADataCompressor'", &counts(&[1, 4, 0, 4, 7])),
        "lzma.vti: DataArray “v”: block 0 cannot be unpacked: failed to fill whole buffer",
    ),
    (
        "ids.vti",
        vtk_xml("ImageData", "", &vti_piece("").replace("</Po", &format!("{}</Po", {
            array("format='ascii'", "1 2 3 4").replace("Name='v'", "Name='PointIds'")
        })))
        .into(),
        "ids.vti: file: contains only identifiers and values that are not numbers",
    ),
    (
        "above.pvti",
        vtk_xml("PImageData", "", "<Piece Extent='0 1 0 1 0 0' Source='../a.vti'/>").into(),
        "above.pvti: reference: refers to “../a.vti”, which leads out of the file's own folder",
    ),
    (
        "none.vtm",
        vtk_xml("vtkMultiBlockDataSet", "", "<DataSet index='0'/>").into(),
        "none.vtm: XML: refers to no files with data",
    ),
    (
        "table.vtu",
        vtk_xml("Table", "", "<Piece NumberOfRows='1'/>").into(),
        "table.vtu: VTKFile: type=“Table” is not supported",
    ),
    (
        "corner.vtu",
        vtu("0 1 3").into(),
        "corner.vtu: Cells: a cell refers to point 3, but there are 3 points",
    ),
    (
        "minus.vtu",
        vtu("0 1 -1").into(),
        "minus.vtu: Cells: a cell refers to point -1, but there are 3 points",
    ),
    (
        "points.vtu",
        vtu("0 1 2")
            .replace("NumberOfPoints='3'", "NumberOfPoints='18446744073709551615'")
            .into(),
        "points.vtu: the number of points is 18446744073709551615, over the limit of \
         2147483648",
    ),
    (
        "cells.vtu",
        vtu("0 1 2").replace("NumberOfCells='1'", "NumberOfCells='4000000000'").into(),
        "cells.vtu: the number of cells is 4000000000, over the limit of 2147483648",
    ),
    (
        "count.vtk",
        vtk().replace("POINT_DATA 4", "POINT_DATA 18446744073709551615").into(),
        "count.vtk: a count of points or cells is 18446744073709551615, over the limit of \
         2147483648",
    ),
    (
        "million.vtk",
        vtk().replace("POINT_DATA 4", "POINT_DATA 1000000").into(),
        "million.vtk: byte 128: there are 4 numbers where 1000000 were expected: the file ends",
    ),
    (
        "twice.vtk",
        "# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 2 float\n\
         0 0 0 1 0 0\nCELLS 1 3\n2 0 1\nPOINTS 1 float\n0 0 0\nCELL_DATA 1\nSCALARS c float\n\
         LOOKUP_TABLE d\n5\n"
            .into(),
        "twice.vtk: byte 104: POINTS are given twice",
    ),
    (
        "dims.vtk",
        vtk().replace("DIMENSIONS 2 2 1", "DIMENSIONS 4294967296 4294967296 4294967296").into(),
        "dims.vtk: the number of points is 18446744073709551615, over the limit of 34359738368",
    ),
    (
        "minus.vtk",
        vtk().replace("DIMENSIONS 2 2 1", "DIMENSIONS -2 2 1").into(),
        "minus.vtk: extent: 0 to -3 is not a valid range of indices",
    ),
    (
        "spacing.vtk",
        vtk().replace("SPACING 1 1 1", "SPACING 0 1 1").into(),
        "spacing.vtk: ImageData: the spacing is 0 × 1 × 1, but every step needs a length",
    ),
    ("crlf.vtk", vtk().replace('\n', "\r\n").into(), "volume [2, 2, 1] [1.0, 4.0]"),
]
