//! Figures: several views in one picture, sizes on paper, and the formats of pictures.

use crate::common::*;
use std::fs;

fn folder() -> Folder {
    let folder = Folder::new();
    folder.put("a.nrrd", nrrd("uint8", &ball()));
    folder.put("a.obj", OBJ);
    folder
}

/// Returns the header of a PNG file, with the pixels a metre.
fn header(bytes: &[u8]) -> (u32, u32, png::BitDepth, Option<u32>) {
    let reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
    let info = reader.info();
    (info.width, info.height, info.bit_depth, info.pixel_dims.map(|density| density.xppu))
}

#[test]
fn one_command_makes_a_figure_for_a_paper() {
    let folder = folder();
    let run = "render a.nrrd -o a.png --json --engine cpu --views front,left,top --width 60mm \
               --dpi 150 --orthographic --background white --scale-bar --scalar-bar --bits 16 \
               --colormap viridis";
    let facts = folder.json(run);
    assert_eq!((&facts["width"], &facts["height"]), (&354.into(), &118.into()));
    let panels = facts["panels"].as_array().unwrap();
    let views: Vec<&str> = panels.iter().map(|panel| panel["view"].as_str().unwrap()).collect();
    assert_eq!(views, ["front", "left", "top"]);
    let heights: Vec<&serde_json::Value> =
        panels.iter().map(|panel| &panel["camera"]["height"]).collect();
    assert!(heights[0] == heights[1] && heights[1] == heights[2] && heights[0].is_number());
    assert!(facts["overlay"]["scale_bar"]["length"].as_f64() > Some(0.0), "{facts}");
    let read = header(&fs::read(folder.path("a.png")).unwrap());
    assert_eq!(read, (354, 118, png::BitDepth::Sixteen, Some(5906)));
}

/// A scene file with several views makes the same bytes as the flags.
#[test]
fn scenes_have_several_views() {
    let folder = folder();
    let scene = r#"{"splatkit_scene": 2, "inputs": [{"file": "a.obj"}],
        "picture": {"views": ["front", "top"], "size": [80, 40], "panel_labels": "letters"}}"#;
    folder.put("scene.json", scene);
    folder.run("render scene.json -o scene.png --engine cpu").ok();
    let flags = "--views front,top --size 80x40 --panel-labels letters --engine cpu";
    folder.run(&format!("render a.obj -o flags.png {flags}")).ok();
    let read = |name: &str| fs::read(folder.path(name)).unwrap();
    assert_eq!(read("scene.png"), read("flags.png"));
    // One view replaces several.
    folder.run("render scene.json -o one.png --engine cpu --view front").ok();
    folder.run("render a.obj -o front.png --size 80x40 --engine cpu --view front").ok();
    assert_eq!(read("one.png"), read("front.png"));
    folder.run("render scene.json -o a.gif --turntable 3").fails(2, &["one view"]);
    folder.put("bad.json", scene.replace("\"size\": [80, 40]", "\"width\": \"9mm\""));
    folder.run("render bad.json -o a.png").fails(3, &["bad.json", "picture.width"]);
}

#[test]
fn pictures_have_many_formats() {
    let folder = folder();
    let render = |name: &str, flags: &str| {
        let run = format!("render a.obj -o {name} --size 40x30 --engine cpu --dpi 300 {flags}");
        folder.run(&run).ok();
        fs::read(folder.path(name)).unwrap()
    };
    let start = |bytes: &[u8], count: usize| bytes[..count].to_vec();
    assert_eq!(start(&render("a.tiff", "--bits 16"), 2), b"II");
    assert_eq!(start(&render("a.exr", "--background none"), 4), [0x76, 0x2f, 0x31, 0x01]);
    let webp = render("a.webp", "--background none");
    let mut decoder = image_webp::WebPDecoder::new(std::io::Cursor::new(webp)).unwrap();
    assert_eq!((decoder.dimensions(), decoder.has_alpha()), ((40, 30), true));
    let mut pixels = vec![0; decoder.output_buffer_size().unwrap()];
    decoder.read_image(&mut pixels).unwrap();
    let raw = "render a.obj -o - --raw --size 40x30 --engine cpu --dpi 300 --background none";
    assert_eq!(folder.run(raw).ok().stdout, pixels);
    assert_eq!(header(&render("a.png", "")), (40, 30, png::BitDepth::Eight, Some(11811)));
    folder
        .run("render a.obj -o b.exr --bits 8")
        .fails(2, &["a .exr file has 16 or 32 bits a channel, not 8"]);
    folder.run("render a.obj -o a.gif --turntable 3 --bits 16").fails(2, &["--bits"]);
}

#[test]
fn openexr_files_have_layers() {
    let folder = folder();
    let all = "--layers normals,albedo,identifiers";
    folder.run(&format!("render a.nrrd a.obj -o a.exr --size 40x30 --engine cpu {all}")).ok();
    let bytes = fs::read(folder.path("a.exr")).unwrap();
    let has = |name: &str| bytes.windows(name.len()).any(|part| part == name.as_bytes());
    assert!(["normal.X", "albedo.G", "id.I"].into_iter().all(has));
    folder.run(&format!("render a.obj -o a.png {all}")).fails(2, &["layers", ".exr"]);
    folder
        .run(&format!("render a.nrrd -o b.exr --size 40x30 --mip --engine cpu {all}"))
        .fails(2, &["lights other than"]);
}
