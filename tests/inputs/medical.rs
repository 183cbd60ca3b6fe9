//! Small files of NIfTI and DICOM.

/// A NIfTI file of 2 × 2 × 1 bytes. `change` edits its header, of 352 bytes.
pub fn nifti(change: impl Fn(&mut [u8])) -> Vec<u8> {
    let mut bytes = vec![0; 352];
    let mut put = |at: usize, number: &[u8]| bytes[at..at + number.len()].copy_from_slice(number);
    put(0, &348i32.to_le_bytes());
    for (axis, count) in [3i16, 2, 2, 1].into_iter().enumerate() {
        put(40 + 2 * axis, &count.to_le_bytes());
    }
    put(70, &2i16.to_le_bytes());
    (0..8).for_each(|axis| put(76 + 4 * axis, &1f32.to_le_bytes()));
    put(108, &352f32.to_le_bytes());
    put(344, b"n+1\0");
    change(&mut bytes);
    bytes.extend([1, 2, 3, 4]);
    bytes
}

/// An element with a type of two letters.
pub fn element(group: u16, number: u16, kind: &str, value: &[u8]) -> Vec<u8> {
    let mut bytes = [group.to_le_bytes(), number.to_le_bytes()].concat();
    bytes.extend(kind.bytes());
    if ["OB", "OW", "SQ", "UN"].contains(&kind) {
        bytes.extend([0; 2]);
        bytes.extend((value.len() as u32).to_le_bytes());
    } else {
        bytes.extend((value.len() as u16).to_le_bytes());
    }
    bytes.extend(value);
    bytes
}

/// A DICOM file of 2 × 2 bytes, with this transfer syntax and these pixels.
pub fn dicom(syntax: &str, pixels: &[u8]) -> Vec<u8> {
    let mut name = format!("1.2.840.10008.1.2{syntax}");
    if !name.len().is_multiple_of(2) {
        name.push('\0');
    }
    let short = |number: u16, value: u16| element(0x28, number, "US", &value.to_le_bytes());
    [
        vec![0; 128],
        b"DICM".to_vec(),
        element(2, 0x10, "UI", name.as_bytes()),
        element(8, 0x60, "CS", b"CT"),
        short(2, 1),
        element(0x28, 4, "CS", b"MONOCHROME2 "),
        short(0x10, 2),
        short(0x11, 2),
        short(0x100, 8),
        short(0x101, 8),
        short(0x102, 7),
        short(0x103, 0),
        element(0x7fe0, 0x10, "OB", pixels),
    ]
    .concat()
}
