// Part of ../cases.rs.
vec![
    // NPY.
    (
        "rows.npy",
        npy("(18446744073709551615, 4)", &[]),
        "rows.npy: the number of rows is 18446744073709551615, over the limit of 2147483648",
    ),
    (
        "million.npy",
        npy("(1000000, 4)", &[1.0]),
        "million.npy: data: there are 4 bytes where 16000000 were expected",
    ),
    ("none.npy", npy("(0, 4)", &[]), "none.npy: file: contains no samples"),
    (
        "nan.npy",
        npy("(1, 4)", &[f32::NAN, 2.0, 3.0, 4.0]),
        "nan.npy: samples: none is at finite coordinates",
    ),
    ("shape.npy", npy("((((((", &[]), "shape.npy: header: has no “shape”"),
    (
        "five.npy",
        npy("(2, 3, 4, 5, 6)", &[]),
        "five.npy: header: has the shape (2, 3, 4, 5, 6), but (z, y, x) was expected for a \
         volume",
    ),
    (
        "huge.npy",
        npy("(1048576, 1048576, 1048576)", &[1.0]),
        "huge.npy: the size of the samples in bytes is 4611686018427387904, over the limit of \
         34359738368",
    ),
    // MetaImage, MRC, TIFF and HDF5.
    (
        "size.mha",
        mha("100 100 100", "", b"1234"),
        "size.mha: data: there are 4 bytes where 1000000 were expected",
    ),
    (
        "none.mha",
        mha("0 4 4", "", b""),
        "none.mha: header: a volume of 0 × 4 × 4 samples holds none",
    ),
    (
        "bomb.mha",
        mha("1 1 1", "CompressedData = True\n", &zlib(&[7; 1 << 20])),
        "volume [1, 1, 1] [7.0, 7.0]",
    ),
    (
        "lie.mha",
        mha("100 100 100", "CompressedData = True\n", &zlib(&[7; 1000])),
        "lie.mha: data: unpacks to 1000 bytes where 1000000 were expected",
    ),
    (
        "mode.mrc",
        mrc([1, 1, 1], 99, &[0]),
        "mode.mrc: header, mode: is 99, but 0, 1, 2, 3, 4, 6, 12, 16 or 101 was expected",
    ),
    (
        "size.mrc",
        mrc([1000, 1000, 1000], 0, &[0]),
        "size.mrc: data: there are 1 bytes where 1000000000 were expected",
    ),
    ("one.tif", tiff(1), "volume [2, 1, 1] [0.0, 9.0]"),
    (
        "flat.h5",
        hdf5(&[2, 2]),
        "flat.h5: file: has neither numbers of three dimensions nor a picture of two; it has “v”, \
         u8 (2, 2)",
    ),
    // NRRD.
    (
        "size.nrrd",
        nrrd("4294967296 4294967296 4294967296", "encoding: raw", b""),
        "size.nrrd: header: 4294967296 × 4294967296 × 4294967296 samples are more than memory \
         can hold",
    ),
    (
        "large.nrrd",
        nrrd("1000 1000 1000", "encoding: raw", b"1234"),
        "large.nrrd: data: there are 4 bytes where 1000000000 were expected",
    ),
    (
        "none.nrrd",
        nrrd("0 4 4", "encoding: raw", b""),
        "none.nrrd: header: a volume of 0 × 4 × 4 samples holds none",
    ),
    (
        "minus.nrrd",
        nrrd("-4 4 4", "encoding: raw", b""),
        "minus.nrrd: sizes: “-4 4 4” is not a list of 3 numbers",
    ),
    (
        "four.nrrd",
        nrrd("4 4 4 4", "encoding: raw", b""),
        "four.nrrd: sizes: “4 4 4 4” is not a list of 3 numbers",
    ),
    (
        "lie.nrrd",
        nrrd("1000 1000 1000", "encoding: gzip", &gzip(&[0; 1000])),
        "lie.nrrd: data: unpacks to 1000 bytes where 1000000000 were expected",
    ),
    (
        "bomb.nrrd",
        nrrd("1 1 1", "encoding: gzip", &gzip(&vec![0; 1 << 24])),
        "bomb.nrrd: data: unpacks to too many bytes where 1 were expected",
    ),
    (
        "notgzip.nrrd",
        nrrd("1 1 1", "encoding: gzip", b"not packed"),
        "notgzip.nrrd: data: cannot be unpacked after 0 bytes: invalid gzip header",
    ),
    (
        "bzip.nrrd",
        nrrd("1 1 1", "encoding: bzip2", b""),
        "bzip.nrrd: encoding: “bzip2” is not supported",
    ),
    ("same.nrrd", nrrd("2 2 1", "encoding: raw", &[7; 4]), "volume [2, 2, 1] [7.0, 7.0]"),
    (
        "spacing.nrrd",
        nrrd("2 2 1", "spacings: 0 1 1\nencoding: raw", &[7; 4]),
        "spacing.nrrd: header: the spacing is 0 × 1 × 1, but every step needs a length",
    ),
    (
        "origin.nrrd",
        nrrd("2 2 1", "space origin: (nan,0,0)\nencoding: raw", &[7; 4]),
        "origin.nrrd: header: the origin and the steps between samples must be finite",
    ),
    (
        "skip.nrrd",
        nrrd("2 2 1", "byte skip: 99\nencoding: raw", &[7; 4]),
        "skip.nrrd: data: there are 0 bytes where 4 were expected",
    ),
    (
        "skips.nrrd",
        nrrd("2 2 1", "byte skip: 9223372036854775807\nencoding: gzip", &gzip(&[7; 4])),
        "skips.nrrd: the unpacked size in bytes is 9223372036854775811, over the limit of \
         34359738368",
    ),
    (
        "commas.nrrd",
        nrrd("2 2 1", "encoding: ascii", b"1,5 2,5"),
        "volume [2, 2, 1] [1.0, 5.0]",
    ),
    (
        "missing.nhdr",
        nrrd("2 2 1", "encoding: raw\ndata file: missing.raw", b""),
        "missing.nhdr: data file: refers to “missing.raw”: No such file or directory (os error \
         2)",
    ),
    (
        "up.nhdr",
        nrrd("2 2 1", "encoding: raw\ndata file: ../up.raw", b""),
        "up.nhdr: data file: refers to “../up.raw”, which leads out of the file's own folder",
    ),
    (
        "absolute.nhdr",
        nrrd("2 2 1", "encoding: raw\ndata file: /etc/hostname", b""),
        "absolute.nhdr: data file: refers to “/etc/hostname”, an absolute path; only files in \
         the same folder or below it are read",
    ),
    (
        "drive.nhdr",
        nrrd("2 2 1", "encoding: raw\ndata file: C:\\up.raw", b""),
        "drive.nhdr: data file: refers to “C:\\up.raw”, an address or a drive; only files in \
         the same folder or below it are read",
    ),
    (
        "address.nhdr",
        nrrd("2 2 1", "encoding: raw\ndata file: file:///etc/hostname", b""),
        "address.nhdr: data file: refers to “file:///etc/hostname”, an address or a drive; \
         only files in the same folder or below it are read",
    ),
    (
        "self.nhdr",
        nrrd("2 2 1", "encoding: raw\ndata file: self.nhdr", b""),
        "self.nhdr: data file: refers to “self.nhdr”, the file itself",
    ),
    (
        "folder.nhdr",
        nrrd("2 2 1", "encoding: raw\ndata file: folder", b""),
        "folder.nhdr: data file: refers to “folder”, which is not a regular file",
    ),
    (
        "list.nhdr",
        nrrd("2 2 1", "encoding: raw\ndata file: LIST 1\n../a.raw\n/etc/hostname", b""),
        "list.nhdr: data file: refers to “../a.raw”, which leads out of the file's own folder",
    ),
    (
        "pattern.nhdr",
        nrrd("2 2 1", "encoding: raw\ndata file: ../a%03d.raw 1 2 1 1", b""),
        "pattern.nhdr: data file: refers to “../a001.raw”, which leads out of the file's own \
         folder",
    ),
    // Raw volumes of 4 × 4 × 4 bytes.
    (
        "short.raw",
        vec![1; 63],
        "short.raw: size: has 63 bytes after the header, but 4 × 4 × 4 samples of type u8 need \
         64",
    ),
    (
        "long.raw",
        vec![1; 125],
        "long.raw: size: has 125 bytes after the header, but 4 × 4 × 4 samples of type u8 need \
         64",
    ),
    ("same.raw", vec![7; 64], "volume [4, 4, 4] [7.0, 7.0]"),
    (
        "bomb.gz",
        gzip(&vec![0; 1 << 24]),
        "bomb.gz: gzip stream: unpacks to too many bytes where 64 were expected",
    ),
]
