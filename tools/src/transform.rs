//! The flags that move inputs.

use crate::{
    failure::Failure,
    input_values::{InputValue, name_of},
    parse,
};
use clap::Args;
use splatkit::session::{Description, Rotation, TransformEntry};
use std::{collections::HashMap, path::Path};

/// Where inputs are moved to. They are scaled first, then turned, then moved.
#[derive(Args, Debug, Clone)]
#[command(next_help_heading = "Input")]
pub struct TransformFlags {
    /// Scale inputs about the world's origin by this factor. FILE=FACTOR is for one input, and the
    /// flag can be given several times. Not for .splk and .splv.
    #[arg(long, value_name = "[FILE=]FACTOR", value_parser = scale)]
    scale: Vec<InputValue<f64>>,
    /// Turn inputs about an axis through the world's origin, counter-clockwise for an eye that
    /// looks against the axis: x, y, z or a direction X,Y,Z, and degrees, such as z:90. They are
    /// scaled before. FILE=AXIS:DEGREES is for one input, and the flag can be given several times.
    #[arg(
        long,
        value_name = "[FILE=]AXIS:DEGREES",
        value_parser = rotation,
        allow_hyphen_values = true
    )]
    rotate: Vec<InputValue<Rotation>>,
    /// Move inputs by this much along x, y and z, in world units. They are scaled and turned
    /// before. FILE=X,Y,Z is for one input, and the flag can be given several times.
    #[arg(
        long,
        value_name = "[FILE=]X,Y,Z",
        value_parser = translation,
        allow_hyphen_values = true
    )]
    translate: Vec<InputValue<[f64; 3]>>,
}

impl TransformFlags {
    /// Changes where the inputs of a scene are moved to: by the flags that are given.
    pub fn apply(&self, scene: &mut Description) -> Result<(), Failure> {
        set(scene, &self.scale, "scale", |transform| &mut transform.scale)?;
        set(scene, &self.rotate, "rotate", |transform| &mut transform.rotate)?;
        set(scene, &self.translate, "translate", |transform| &mut transform.translate)
    }
}

/// Sets a field to the values of all inputs and of single ones, if there are any.
fn set<T: Copy>(
    scene: &mut Description,
    values: &[InputValue<T>],
    flag: &str,
    field: impl Fn(&mut TransformEntry) -> &mut Option<T>,
) -> Result<(), Failure> {
    if values.is_empty() {
        return Ok(());
    }
    let inputs: Vec<_> = scene.visible().map(|input| input.file.clone()).collect();
    InputValue::check(values, flag, &inputs)?;
    let shared = InputValue::shared(values);
    let singles: HashMap<&Path, &T> = values.iter().filter_map(InputValue::single).collect();
    for input in &mut scene.inputs {
        let value = singles.get(name_of(&input.file)).copied().or(shared);
        *field(&mut input.transform) = value.copied();
    }
    Ok(())
}

fn scale(text: &str) -> Result<InputValue<f64>, String> {
    InputValue::parse(text, parse::positive)
}

fn translation(text: &str) -> Result<InputValue<[f64; 3]>, String> {
    InputValue::parse(text, |text| Ok(parse::vector(text)?.to_array()))
}

fn rotation(text: &str) -> Result<InputValue<Rotation>, String> {
    InputValue::parse(text, |text| {
        let form = "the form is AXIS:DEGREES, such as z:90 or 1,1,0:-30";
        let (axis, degrees) = text.split_once(':').ok_or(form)?;
        let axis = match axis.contains(',') {
            true => parse::vector(axis)?,
            false => parse::axis(axis).map_err(|message| message + ", or a direction X,Y,Z")?,
        };
        if axis.try_normalize().is_none() {
            return Err("an axis needs a length above 0".into());
        }
        Ok(Rotation { axis: axis.to_array(), degrees: parse::finite(degrees).map_err(|_| form)? })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rotations_are_read() {
        let of = |axis, degrees| Ok(InputValue::of_all(Rotation { axis, degrees }));
        assert_eq!(rotation("z:90"), of([0.0, 0.0, 1.0], 90.0));
        assert_eq!(rotation("-X:-1.5"), of([-1.0, 0.0, 0.0], -1.5));
        assert_eq!(rotation("0,2,2:10"), of([0.0, 2.0, 2.0], 10.0));
        for (bad, word) in [
            ("90", "AXIS:DEGREES"),
            ("z:", "AXIS:DEGREES"),
            ("w:90", "direction X,Y,Z"),
            ("0,0,0:90", "above 0"),
            ("z:inf", "AXIS:DEGREES"),
        ] {
            let message = rotation(bad).unwrap_err();
            assert!(message.contains(word), "{bad}: {message}");
        }
        assert!(scale("0").is_err() && translation("1,2").is_err());
    }

    /// Flags replace what a scene file says of the same step; other steps stay.
    #[test]
    fn inputs_have_their_own_values_or_that_of_all() {
        let before = TransformEntry { translate: Some([9.0; 3]), ..TransformEntry::default() };
        let mut scene = Description::new(["a.ply", "b.ply", "c.ply"].map(Into::into));
        scene.inputs.iter_mut().for_each(|input| input.transform = before);
        let flags = TransformFlags {
            scale: ["2", "b.ply=3"].map(|text| scale(text).unwrap()).to_vec(),
            rotate: vec![rotation("c.ply=y:45").unwrap()],
            translate: Vec::new(),
        };
        flags.apply(&mut scene).unwrap();
        let transforms = scene.inputs.iter().map(|input| input.transform);
        let [a, b, c] = transforms.collect::<Vec<_>>().try_into().unwrap();
        assert_eq!(a, TransformEntry { scale: Some(2.0), ..before });
        assert_eq!(b, TransformEntry { scale: Some(3.0), ..before });
        let rotate = Some(Rotation { axis: [0.0, 1.0, 0.0], degrees: 45.0 });
        assert_eq!(c, TransformEntry { scale: Some(2.0), rotate, ..before });
        let unknown = TransformFlags { rotate: vec![rotation("d.ply=y:45").unwrap()], ..flags };
        let message = unknown.apply(&mut scene).unwrap_err().to_string();
        assert!(message.contains("--rotate d.ply=…"), "{message}");
    }
}
