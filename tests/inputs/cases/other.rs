// Part of ../cases.rs.
vec![
    // Files of no format.
    ("nothing.bin", Vec::new(), "nothing.bin: file: is of no kind"),
    ("zeros.bin", vec![0; 4096], "zeros.bin: file: is of no kind"),
    ("text.bin", b"hello".to_vec(), "text.bin: file: is of no kind"),
]
