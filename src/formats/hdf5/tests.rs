//! Files that the crate's own writer makes.

use super::*;
use crate::{Error, input::testing::*};
use glam::DVec3;
use hdf5_pure::{AttrValue, FileBuilder};

fn load(bytes: &[u8], options: &ReadOptions) -> Result<Volume> {
    let folder = Folder::new();
    read_with(&folder.write("a.h5", bytes), |source| read(source, options))
}

fn values(volume: &Volume) -> Vec<f64> {
    (0..volume.len()).map(|index| volume.value(index)).collect()
}

fn named(name: &str) -> ReadOptions {
    ReadOptions { dataset: Some(name.into()), ..ReadOptions::default() }
}

/// A file with a small volume, a larger one in a group, a vector field and a table.
fn several() -> Vec<u8> {
    let mut file = FileBuilder::new();
    file.create_dataset("small").with_u8_data(&[1, 2]).with_shape(&[1, 1, 2]);
    file.create_dataset("table").with_f64_data(&[0.0; 64]).with_shape(&[8, 8]);
    let mut group = file.create_group("scan");
    group.create_dataset("ct").with_i16_data(&[-1, 2, -3, 4]).with_shape(&[1, 2, 2]);
    group.create_dataset("flow").with_f32_data(&[3.0, 4.0]).with_shape(&[1, 1, 1, 2]);
    file.add_group(group.finish());
    file.finish().unwrap()
}

#[test]
fn the_largest_volume_or_the_named_one_is_read() {
    let bytes = several();
    let volume = load(&bytes, &ReadOptions::default()).unwrap();
    assert_eq!(volume.lattice.dims, [2, 2, 1]);
    assert_eq!(values(&volume), [-1.0, 2.0, -3.0, 4.0]);
    for name in ["small", "/small"] {
        assert_eq!(values(&load(&bytes, &named(name)).unwrap()), [1.0, 2.0], "{name}");
    }
    assert_eq!(values(&load(&bytes, &named("scan/flow")).unwrap()), [5.0]);
    let second = ReadOptions { scalar: Some("flow:1".into()), ..named("scan/flow") };
    assert_eq!(values(&load(&bytes, &second).unwrap()), [4.0]);
    let error = load(&bytes, &named("pet")).unwrap_err().to_string();
    assert!(error.contains("has no data set “pet”; it has"), "{error}");
    assert!(error.contains("“scan/ct”, i16 (1, 2, 2)"), "{error}");
    let error = load(&bytes, &named("table")).unwrap_err().to_string();
    assert!(error.contains("data set “table”: has the shape f64 (8, 8)"), "{error}");
    let folder = Folder::new();
    let path = folder.write("a.h5", &bytes);
    let list = read_with(&path, |source| arrays(source, &ReadOptions::default())).unwrap();
    let drawn: Vec<_> = list.iter().filter(|a| a.is_drawn).map(|a| &a.name[..]).collect();
    assert_eq!((list.len(), drawn), (4, vec!["scan/ct"]));
}

#[test]
fn chunks_and_filters_are_undone() {
    let data: Vec<i32> = (0..4 * 5 * 6).map(|v| v * 1000 - 7).collect();
    for filter in 0..4 {
        let mut file = FileBuilder::new();
        let set = file.create_dataset("v").with_i32_data(&data).with_shape(&[4, 5, 6]);
        let set = set.with_chunks(&[2, 3, 4]);
        match filter {
            0 => set,
            1 => set.with_deflate(6),
            2 => set.with_shuffle().with_deflate(6),
            _ => set.with_shuffle().with_deflate(1).with_fletcher32(),
        };
        let volume = load(&file.finish().unwrap(), &ReadOptions::default()).unwrap();
        assert_eq!(volume.lattice.dims, [6, 5, 4]);
        let expected: Vec<f64> = data.iter().map(|&v| f64::from(v)).collect();
        assert_eq!(values(&volume), expected, "filter {filter}");
    }
}

#[test]
fn attributes_give_spacing_and_scale() {
    let mut file = FileBuilder::new();
    file.create_dataset("v")
        .with_i16_data(&[0, 10])
        .with_shape(&[1, 1, 2])
        .set_attr("element_size_um", AttrValue::F64Array(vec![2.0, 0.5, 0.25]))
        .set_attr("scale_factor", AttrValue::F64(0.5))
        .set_attr("add_offset", AttrValue::F64(100.0))
        .set_attr("units", AttrValue::String("K".into()))
        .set_attr("long_name", AttrValue::String("Temperature".into()));
    let volume = load(&file.finish().unwrap(), &ReadOptions::default()).unwrap();
    assert_eq!(volume.lattice.spacing(), DVec3::new(0.25, 0.5, 2.0));
    assert_eq!((values(&volume), volume.range), (vec![100.0, 105.0], [100.0, 105.0]));
    let about = &volume.about;
    assert_eq!([&about.length[..], &about.unit, &about.name], ["µm", "K", "Temperature"]);
}

#[test]
fn a_fourth_dimension_may_be_time() {
    let mut file = FileBuilder::new();
    let data: Vec<u8> = (0..40).collect();
    file.create_dataset("v").with_u8_data(&data).with_shape(&[2, 2, 2, 5]);
    let bytes = file.finish().unwrap();
    let at = |time| load(&bytes, &ReadOptions { time, ..ReadOptions::default() });
    assert!(at(None).unwrap_err().to_string().contains("has neither numbers of three dimensions"));
    let second = ReadOptions { time: Some(1), ..named("v") };
    let volume = load(&bytes, &second).unwrap();
    assert_eq!((volume.lattice.dims, volume.range), ([5, 2, 2], [20.0, 39.0]));
}

#[test]
fn meshes_of_solvers_are_no_volumes() {
    let folder = Folder::new();
    let of = |name: &str| read_with(&folder.write(name, several()), kind);
    for name in ["a.nc", "a.mat", "a.mnc", "a.other"] {
        assert_eq!(of(name).unwrap(), Kind::Volume, "{name}");
    }
    for name in ["a.e", "a.cgns", "a.med"] {
        let Error::Input { hint, .. } = of(name).unwrap_err() else { panic!("{name}") };
        assert!(hint.unwrap().contains("python -m pysplatkit render"), "{name}");
    }
}

#[test]
fn without_volumes_the_largest_picture_is_read() {
    let file = |with_scales: bool| {
        let mut file = FileBuilder::new();
        let data: Vec<f32> = (0..16 * 20).map(|v| v as f32).collect();
        file.create_dataset("small").with_u8_data(&[0; 256]).with_shape(&[16, 16]);
        let picture = file.create_dataset("picture").with_f32_data(&data).with_shape(&[16, 20]);
        if with_scales {
            picture.set_attr("DIMENSION_LIST", AttrValue::I64(0));
            let north: Vec<f64> = (0..16).map(|at| 60.0 - f64::from(at)).collect();
            let east: Vec<f64> = (0..20).map(f64::from).collect();
            for (name, values) in [("lat", north), ("lon", east)] {
                let count = values.len() as u64;
                file.create_dataset(name)
                    .with_f64_data(&values)
                    .with_shape(&[count])
                    .set_attr("CLASS", AttrValue::String("DIMENSION_SCALE".into()))
                    .set_attr("NAME", AttrValue::String(name.into()))
                    .set_attr("units", AttrValue::String("degrees".into()));
            }
        }
        load(&file.finish().unwrap(), &ReadOptions::default()).unwrap()
    };
    let plain = file(false);
    assert_eq!((plain.lattice.dims, plain.range), ([20, 16, 1], [0.0, 319.0]));
    assert_eq!(plain.about.orientation, Some(Orientation::Y_DOWN));
    let placed = file(true);
    assert_eq!(placed.about.orientation, Some(Orientation::Y_UP));
    assert_eq!(placed.lattice.position(DVec3::Y), DVec3::new(0.0, 59.0, 0.0));
}

/// A data set of two times with scales along its four dimensions, of which three have one length.
fn with_scales(names: [&str; 3]) -> Vec<u8> {
    let mut file = FileBuilder::new();
    let data: Vec<f32> = (0..2 * 27).map(|v| v as f32).collect();
    file.create_dataset("v")
        .with_f32_data(&data)
        .with_shape(&[2, 3, 3, 3])
        .set_attr("DIMENSION_LIST", AttrValue::I64(0));
    let mut scale = |name: &str, values: &[f64], unit: &str, positive: &str| {
        file.create_dataset(name)
            .with_f64_data(values)
            .with_shape(&[values.len() as u64])
            .set_attr("CLASS", AttrValue::String("DIMENSION_SCALE".into()))
            .set_attr("NAME", AttrValue::String(name.into()))
            .set_attr("units", AttrValue::String(unit.into()))
            .set_attr("positive", AttrValue::String(positive.into()));
    };
    let [x, y, z] = names;
    scale("when", &[0.0, 6.0], "hours since 1970-01-01", "");
    scale(x, &[100.0, 102.0, 104.0], "m", "");
    scale(y, &[9.0, 6.0, 3.0], "m", "");
    scale(z, &[0.0, 1.0, 5.0], "m", if z == "depth" { "down" } else { "" });
    file.finish().unwrap()
}

#[test]
fn scales_place_the_samples_and_name_the_times() {
    let bytes = with_scales(["x", "lat", "depth"]);
    let (volume, words) = warnings_of(|| load(&bytes, &ReadOptions::default()));
    let volume = volume.unwrap();
    assert_eq!(words.len(), 1);
    assert!(words[0].ends_with("a.h5: shows the first of 2 times; --time 1 shows the second"));
    assert_eq!((volume.range, &volume.about.length[..]), ([0.0, 26.0], "m"));
    let places = [0, 26].map(|sample| volume.lattice.sample_position(sample));
    assert_eq!(places, [DVec3::new(100.0, 9.0, 0.0), DVec3::new(104.0, 3.0, -5.0)]);
    let second = ReadOptions { time: Some(1), ..ReadOptions::default() };
    assert_eq!(load(&bytes, &second).unwrap().range, [27.0, 53.0]);
}

#[test]
fn scales_that_cannot_be_told_apart_are_named() {
    let bytes = with_scales(["a", "b", "c"]);
    let (volume, words) = warnings_of(|| load(&bytes, &ReadOptions::default()));
    assert_eq!(volume.unwrap().lattice.spacing(), DVec3::ONE);
    assert!(words[0].contains("“v” has which coordinates (a, b, c) is not"), "{words:?}");
}

#[test]
fn cuts_are_errors() {
    let folder = Folder::new();
    let bytes = several();
    for end in (0..bytes.len()).step_by(7) {
        let path = folder.write("a.h5", &bytes[..end]);
        let load = read_with(&path, |source| read(source, &ReadOptions::default()));
        assert!(load.is_err() || end + 64 > bytes.len(), "cut at {end} of {}", bytes.len());
    }
    let error = load(b"no file of this kind", &ReadOptions::default()).unwrap_err().to_string();
    assert!(error.contains("file: cannot be read"), "{error}");
}
