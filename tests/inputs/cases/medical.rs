// Part of ../cases.rs.
vec![
    // NIfTI.
    (
        "analyze.nii",
        medical::nifti(|header| header[344..].fill(0)),
        "analyze.nii: pair: refers to “analyze.img”: No such file or directory (os error 2)",
    ),
    (
        "axes.nii",
        medical::nifti(|header| header[40] = 9),
        "axes.nii: header, dim[0]: the number of axes is 9, but 1 to 7 are possible",
    ),
    (
        "huge.nii",
        medical::nifti(|header| header[42..48].copy_from_slice(&[255, 127].repeat(3))),
        "huge.nii: the size of the samples in bytes is 35181150961663, over the limit of \
         34359738368",
    ),
    (
        "bits.nii",
        medical::nifti(|header| header[70] = 1),
        "bits.nii: header, datatype: 1 (bits) is not a type that can be read",
    ),
    (
        "bomb.nii.gz",
        gzip(&[medical::nifti(|_| {}), vec![0; 1 << 24]].concat()),
        "volume [2, 2, 1] [1.0, 4.0]",
    ),
    ("named.bin", medical::nifti(|_| {}), "volume [2, 2, 1] [1.0, 4.0]"),
    // DICOM.
    (
        "foreign.dcm",
        b"hello".to_vec(),
        "foreign.dcm: header: is not DICOM: it has no “DICM” at byte 128, and does not begin \
         with an element of group 0008",
    ),
    (
        "video.dcm",
        medical::dicom(".4.102", &[1, 2, 3, 4]),
        "video.dcm: pixel data: the pixels are packed by MPEG-4 AVC (transfer syntax \
         1.2.840.10008.1.2.4.102), which is not read",
    ),
    (
        "few.dcm",
        medical::dicom(".1", &[1, 2]),
        "few.dcm: pixel data: a frame of 2 × 2 pixels needs 4 bytes, but the pixels of all \
         frames have 2",
    ),
    (
        "typeless.dcm",
        [medical::dicom(".1", &[1, 2, 3, 4]), vec![0; 512]].concat(),
        "volume [2, 2, 1] [1.0, 4.0]",
    ),
    ("dicom.bin", medical::dicom(".1", &[1, 2, 3, 4]), "volume [2, 2, 1] [1.0, 4.0]"),
]
