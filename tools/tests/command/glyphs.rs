//! Glyphs of vectors and tensors, and volumes whose opacity another array gives.

use crate::common::*;
use std::fs;

/// Points of VTK with a vector and a tensor each.
const POINTS: &str = "# vtk DataFile Version 3.0\npoints\nASCII\nDATASET POLYDATA\n\
    POINTS 3 float\n0 0 0 1 0 0 2 0 0\nVERTICES 3 6\n1 0\n1 1\n1 2\nPOINT_DATA 3\n\
    SCALARS p float 1\nLOOKUP_TABLE default\n1 2 3\nVECTORS flow float\n0 0 1 0 0 2 0 0 3\n\
    TENSORS stress float\n1 0 0 0 2 0 0 0 1\n1 0 0 0 2 0 0 0 1\n1 0 0 0 2 0 0 0 1\n";

/// A volume of VTK with two arrays: the first rises along x, the second is a block.
fn two_arrays() -> String {
    let mut text = "# vtk DataFile Version 3.0\ntwo\nASCII\nDATASET STRUCTURED_POINTS\n\
                    DIMENSIONS 16 16 16\nORIGIN 0 0 0\nSPACING 1 1 1\nPOINT_DATA 4096\n"
        .to_owned();
    let list = |value: fn(usize, usize, usize) -> u32| {
        let numbers = (0..4096).map(|at| value(at % 16, at / 16 % 16, at / 256).to_string());
        numbers.collect::<Vec<_>>().join(" ")
    };
    let block = |x, y, z| {
        let is_inside = [x, y, z].iter().all(|place| (4..12).contains(place));
        if is_inside { 100 } else { 0 }
    };
    for (name, numbers) in [("heat", list(|x, _, _| x as u32)), ("mass", list(block))] {
        text.push_str(&format!("SCALARS {name} float 1\nLOOKUP_TABLE default\n{numbers}\n"));
    }
    text
}

#[test]
fn vectors_are_arrows_and_tensors_ellipsoids() {
    let folder = Folder::new();
    folder.put("a.vtk", POINTS);
    let facts = |flags: &str| {
        let run =
            format!("render a.vtk -o a.png --overwrite --json --engine cpu --size 60x60 {flags}");
        folder.json(&format!("{run} --scalar-bar"))
    };
    let arrows = facts("--glyphs arrows");
    let title = arrows["overlay"]["scalar_bars"].to_string();
    assert!(title.contains("flow"), "{arrows}");
    let named = fs::read(folder.path("a.png")).unwrap();
    facts("--glyphs arrows:flow");
    assert_eq!(fs::read(folder.path("a.png")).unwrap(), named);
    facts("--glyphs ellipsoids --glyph-scale 0.5");
    assert_ne!(fs::read(folder.path("a.png")).unwrap(), named);
    folder.run("render a.vtk -o b.png --glyphs arrows:p").fails(3, &["“p” has 1 components"]);
    folder.run("render a.vtk -o b.png --glyphs cones").fails(2, &["arrows or ellipsoids"]);
    folder
        .run("render a.vtk -o b.png --glyphs arrows --glyph-scale 0")
        .fails(2, &["--glyph-scale"]);
}

#[test]
fn another_array_gives_the_opacity() {
    let folder = Folder::new();
    folder.put("a.vtk", two_arrays());
    let flags = "--engine cpu --size 64x64 --view front --samples 1";
    let run = format!("render a.vtk -o a.png --scalar heat --opacity-from mass {flags}");
    folder.run(&run).ok();
    let bytes = fs::read(folder.path("a.png")).unwrap();
    let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut pixels).unwrap();
    let pixel = |x: usize, y: usize| pixels[4 * (64 * y + x)..][..3].to_vec();
    // Viridis rises from blue to green along x; around the block there is next to nothing.
    let (left, right) = (pixel(24, 32), pixel(40, 32));
    assert!(left[2] > left[1] && right[1] > right[2], "{left:?} {right:?}");
    assert!(pixel(1, 1).iter().all(|channel| *channel < 8), "{:?}", pixel(1, 1));
    folder.run("render a.vtk -o b.png --opacity-from none").fails(3, &["none"]);
    let run = "render a.vtk -o b.png --scalar heat --opacity-from mass --iso 3";
    folder.run(run).fails(3, &["the opacity of another array"]);
}
