//! Whether the numbers of a plan, of its tables and of its parts can be those of a conversion.
//! Their hashes only say that nothing has changed since they were made, by whomever. An error names
//! the field, its value and what is expected.

use super::{
    ExternalOptions, FEWEST_POINTS, MOST_POINTS, Shape,
    field::{check, within},
    regions::Ranges,
    survey::{Facts, Tables, Triangulated},
};
use crate::{
    about::Orientation,
    hierarchy::{file::WriteOptions, sphere::Sphere},
};
use glam::DVec3;

/// The most splats in a block; a region has no more points.
const MOST_BLOCK: usize = MOST_POINTS as usize;

impl ExternalOptions {
    pub(super) fn check(&self) -> Result<(), String> {
        let Self { block_splats, surfels, paint, .. } = self;
        let wanted = format!("1 to {MOST_BLOCK} are possible");
        check((1..=MOST_BLOCK).contains(block_splats), "block_splats", block_splats, wanted)?;
        within("surfels", surfels.validate().map_err(|error| error.to_string()))?;
        let paint = paint.as_ref().map_or(Ok(()), |paint| paint.check());
        paint.map_err(|message| format!("paint: {message}"))
    }
}

/// Checks how a hierarchy is written.
pub fn check_write(options: &WriteOptions) -> Result<(), String> {
    let is_direction = |of: DVec3| of.is_finite() && (of.length() - 1.0).abs() < 1e-6;
    let Some(Orientation { up, front }) = options.orientation else { return Ok(()) };
    let is_sound = is_direction(up) && is_direction(front);
    check(is_sound, "orientation", [up, front], "two directions of length 1 are expected")
}

fn check_place(place: DVec3, field: &str) -> Result<(), String> {
    check(place.is_finite(), field, place, "finite numbers are expected")
}

fn check_sphere(sphere: &Sphere, field: &str) -> Result<(), String> {
    let Sphere { center, radius } = *sphere;
    let is_sound = center.is_finite() && radius >= 0.0 && radius.is_finite();
    check(is_sound, field, sphere, "a finite centre, and a radius of at least 0, are expected")
}

impl Shape {
    pub(super) fn check(&self) -> Result<(), String> {
        let most = FEWEST_POINTS..=MOST_POINTS;
        let wanted = format!("{FEWEST_POINTS} to {MOST_POINTS} are possible");
        check(most.contains(&self.most), "most", self.most, wanted)?;
        check_place(self.origin, "origin")?;
        check_sphere(&self.outer, "outer")
    }
}

impl Facts {
    pub fn check(&self) -> Result<(), String> {
        within("settled", self.settled.check())?;
        check_sphere(&self.around, "around")?;
        check_place(self.center, "center")?;
        let Some(Triangulated { pieces, longest, .. }) = &self.mesh else { return Ok(()) };
        within("mesh.pieces", pieces.check())?;
        let is_length = *longest >= 0.0 && longest.is_finite();
        check(is_length, "mesh.longest", longest, "a length is expected")
    }
}

impl Tables {
    /// Checks the tables of a stream that has this many points and this many pieces.
    pub fn check(&self, facts: &Facts, ranges: &Ranges, pieces: usize) -> Result<(), String> {
        let [low, high] = facts.settled.bounds;
        ranges.check_reaches([low, high], &self.reaches)?;
        let wanted = format!("the file has {pieces} pieces");
        check(self.pieces.len() == pieces, "the number of pieces", self.pieces.len(), wanted)?;
        let unsound = self.pieces.iter().position(|piece| !piece.is_sound());
        if let Some(number) = unsound {
            let field = format!("piece {number}");
            return check(false, field, self.pieces[number], "the corners of a box are expected");
        }
        let sides = self.guide.iter().map(|side| side.point).collect::<Vec<_>>();
        let known = sides.last().is_none_or(|last| u64::from(*last) < facts.settled.points);
        let ascend = sides.windows(2).all(|pair| pair[0] < pair[1]);
        check(ascend && known, "the guide", sides.len(), "its points must ascend and exist")?;
        let is_placed = |corner: &[u32; 3]| corner.iter().all(|v| f32::from_bits(*v).is_finite());
        let is_sound = self.long.iter().all(is_placed)
            && self.long.windows(2).all(|pair| pair[0] < pair[1])
            && (self.long.is_empty() || facts.mesh.is_some());
        check(is_sound, "the number of long corners", self.long.len(), "they are of no mesh")
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Plan, part_file::Label, plan::PlanText};
    use crate::{
        Error,
        formats::ply,
        hierarchy::{Preset, external::ExternalOptions, file::WriteOptions},
        input::{Limits, testing::Folder},
        surface::Mesh,
    };
    use serde_json::{Value, json};

    /// Makes a plan of a cloud of several regions.
    fn planned(folder: &Folder, is_mesh: bool) -> Plan {
        let mut shape = Mesh::knot(64, 36);
        if !is_mesh {
            shape.triangles.clear();
            shape.normals.clear();
        }
        shape.colors.clear();
        let path = folder.path("in.ply");
        ply::write(&shape, &path).unwrap();
        let options = ExternalOptions {
            memory: 1,
            preset: Preset::Fastest,
            parts: Some(2),
            ..ExternalOptions::default()
        };
        let write = WriteOptions::default();
        Plan::make(&[path], &folder.path("parts"), &Limits::default(), &options, &write, None)
            .unwrap()
    }

    /// Returns the places of all numbers in JSON.
    fn numbers(value: &Value, at: &str, places: &mut Vec<String>) {
        match value {
            Value::Number(_) => places.push(at.to_owned()),
            Value::Array(all) => {
                // The first and the last of long lists stand for the others.
                let ends = [0, all.len().saturating_sub(1)];
                let all = all.iter().enumerate().filter(|(number, _)| ends.contains(number));
                all.for_each(|(number, value)| numbers(value, &format!("{at}/{number}"), places));
            }
            Value::Object(all) => {
                all.iter()
                    .for_each(|(name, value)| numbers(value, &format!("{at}/{name}"), places));
            }
            _ => {}
        }
    }

    /// Every number of a plan takes values that no plan has. Nothing panics, and an error of a
    /// number is the plan's, or that of a file that is not the plan's.
    #[test]
    fn every_number_of_a_plan_is_checked() {
        let wild = [json!(u64::MAX), json!(-1), json!(0), json!(1e300), json!(3e38)];
        let (mut tried, mut refused) = (0, 0);
        for is_mesh in [false, true] {
            let folder = Folder::new();
            let plan = planned(&folder, is_mesh);
            let text = std::fs::read_to_string(plan.path()).unwrap();
            let whole: Value = serde_json::from_str(&text).unwrap();
            let mut places = Vec::new();
            numbers(&whole, "", &mut places);
            assert!(places.len() > 40, "{places:?}");
            for place in &places {
                for value in &wild {
                    let mut changed = whole.clone();
                    *changed.pointer_mut(place).unwrap() = value.clone();
                    PlanText::sealed(&mut changed);
                    std::fs::write(plan.path(), changed.to_string()).unwrap();
                    tried += 1;
                    let made = Plan::open(plan.path())
                        .and_then(|plan| plan.part(0, &Limits::default(), None));
                    match made {
                        Ok(_) => std::fs::remove_file(plan.part_path(0)).unwrap(),
                        Err(Error::Input { .. }) => refused += 1,
                        Err(error) => panic!("{place} = {value}: {error:?}"),
                    }
                }
            }
        }
        println!("{refused} of {tried} refused");
        assert!(refused > tried / 2, "{refused} of {tried}");
    }

    /// Parts with a correct seal, but with numbers that no part has, are damaged.
    #[test]
    fn every_number_of_a_part_is_checked() {
        let folder = Folder::new();
        let plan = planned(&folder, true);
        for index in 0..2 {
            plan.part(index, &Limits::default(), None).unwrap();
        }
        let path = plan.part_path(0);
        let sound = std::fs::read(&path).unwrap();
        let label = Label::of_bytes(&sound);
        let start = crate::hierarchy::external::part_file::about(&sound);
        let mut refused = 0;
        let places: Vec<usize> = start.step_by(4).collect();
        for (number, at) in places.into_iter().enumerate() {
            // The first fields, and a seventh of the others.
            if number > 80 && number % 7 != 0 {
                continue;
            }
            for value in [u32::MAX, 0x7f7f_ffff, 0x8000_0000] {
                let mut changed = sound.clone();
                changed[at..at + 4].copy_from_slice(&value.to_le_bytes());
                label.seal_again(&mut changed);
                std::fs::write(&path, &changed).unwrap();
                match plan.join(&folder.path("out.splk"), None) {
                    Ok(_) => {}
                    Err(Error::Input { .. }) => refused += 1,
                    Err(error) => panic!("byte {at}, {value:#x}: {error:?}"),
                }
            }
        }
        assert!(refused > 0, "none is refused");
        std::fs::write(&path, &sound).unwrap();
        plan.join(&folder.path("out.splk"), None).unwrap();
    }
}
