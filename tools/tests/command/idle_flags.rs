//! Each flag that is meant to change a picture, on each kind of input: it changes the picture, or
//! the command says that it does not.

use crate::common::*;
use std::fs;

/// Flags with values that change a picture of the inputs below, if anything does.
const FLAGS: &[&str] = &[
    "--transfer generic",
    "--range 50,200",
    "--colormap turbo",
    "--color orange",
    "--opacity-unit 3",
    "--iso 50%",
    "--gradient-opacity 0,0:50,1",
    "--kernel hann",
    "--sigma 1",
    "--sharp",
    "--radius-scale 0.3",
    "--crease 0",
    "--edges",
    "--radius 3",
    "--neighbours 5",
    "--no-slopes",
    "--shade",
    "--no-shade",
    "--flat",
    "--cut 30",
    "--budget 4",
    "--optics maximum",
    "--mip",
    "--x-ray",
    "--view top",
    "--distance 70",
    "--azimuth 100",
    "--elevation 60",
    "--zoom 2",
    "--view-angle 60",
    "--focal-point 3,3,1",
    "--orthographic",
    "--up 1,2,0.5",
    "--view-up 1,1,0.3",
    "--background teal",
    "--clip x<50%",
    "--cut-out x<30%",
];

/// Flags that apply to an input, but leave this one as it is: its bricks have one level.
const ALIKE: [(&str, &str); 2] = [("a.splv", "--cut"), ("a.splv", "--budget")];

const INPUTS: [&str; 7] = ["a.ply", "b.ply", "a.xyz", "a.splk", "a.nrrd", "a.splv", "a.csv"];

fn folder() -> Folder {
    let folder = Folder::new();
    folder.put("a.ply", sheet(24));
    let places = || (0..900).map(|i| [f64::from(i % 30), f64::from(i / 30)]);
    let height = |[x, y]: [f64; 2]| (0.3 * x).sin() * (0.2 * y).cos() * 4.0;
    let cloud: String = places().map(|p| format!("{} {} {}\n", p[0], p[1], height(p))).collect();
    folder.put("a.xyz", cloud);
    folder.put("a.nrrd", nrrd("uint8", &ball()));
    let rows = |p: [f64; 2]| {
        let z = 6.0 * height(p).fract();
        format!("{},{},{z},{}\n", p[0], p[1], 120.0 + 25.0 * height(p))
    };
    folder.put("a.csv", format!("x,y,z,value\n{}", places().map(rows).collect::<String>()));
    folder.run("generate gaussians -o b.ply --points 900").ok();
    folder.run("convert a.ply -o a.splk").ok();
    folder.run("convert a.nrrd -o a.splv").ok();
    folder
}

fn draw(folder: &Folder, input: &str, flag: &str) -> (Option<i32>, String, Vec<u8>) {
    let arguments =
        format!("render {input} -o out.png --size 48x36 --samples 1 --engine cpu {flag}");
    let run = folder.run(&arguments);
    let picture = fs::read(folder.path("out.png")).unwrap_or_default();
    fs::remove_file(folder.path("out.png")).ok();
    (run.code(), run.stderr(), picture)
}

#[test]
fn no_flag_is_without_effect_in_silence() {
    let folder = folder();
    let mut wrong = Vec::new();
    for input in INPUTS {
        let (code, stderr, plain) = draw(&folder, input, "");
        assert_eq!(code, Some(0), "{input}: {stderr}");
        for flag in FLAGS {
            let (code, stderr, picture) = draw(&folder, input, flag);
            let name = flag.split(' ').next().expect("a name");
            let says =
                code != Some(0) || (stderr.contains("has no effect") && stderr.contains(name));
            let changes = code == Some(0) && picture != plain;
            if says == changes && !ALIKE.contains(&(input, name)) {
                wrong.push(format!("{input} {flag}: {code:?}, changes: {changes}: {stderr}"));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
