//! Conversion in parts, which any number of machines make.

use super::Convert;
use crate::{failure::Failure, given::Given, output, progress::Progress, timing::milliseconds};
use clap::Args;
use serde_json::json;
use splatkit::{
    disk,
    hierarchy::external::{PartMade, Plan, Stage},
};
use std::{
    path::{Path, PathBuf},
    time::Instant,
};

/// Conversion in parts.
#[derive(Args, Debug)]
#[command(next_help_heading = "Parts")]
pub struct PartFlags {
    /// Plan a conversion in parts, and write the plan to this folder as plan.json. Then make the
    /// parts, in any order, at once or on several machines; then join them. Binary PLY of points or
    /// triangles, LAS and LAZ become .splk in parts. Set --memory to what one part may use.
    #[arg(long, value_name = "FOLDER")]
    pub(super) plan: Option<PathBuf>,
    /// Set the number of parts, of about equal size. Without --plan, convert to the same bytes as
    /// the join of so many parts [default: one for each region that fits in --memory]
    #[arg(long, value_name = "COUNT", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub(super) parts: Option<u32>,
    /// Make a part of this plan, with --index, unless it is finished and intact. Needs the inputs
    /// that it meets, but no other part.
    #[arg(
        long,
        value_name = "PLAN",
        requires = "index",
        conflicts_with_all = ["files", "output", "plan", "parts", "join"]
    )]
    pub(super) part: Option<PathBuf>,
    /// Set the number of the part to make, from 0.
    #[arg(long, value_name = "INDEX", requires = "part")]
    index: Option<u32>,
    /// Join the parts of this plan to the file of -o.
    #[arg(long, value_name = "PLAN", conflicts_with_all = ["files", "plan", "parts"])]
    pub(super) join: Option<PathBuf>,
}

/// Flags that may be given with --part and with --join: all others are in the plan.
const OF_PARTS: [&str; 14] = [
    "part",
    "index",
    "join",
    "output",
    "overwrite",
    "json",
    "quiet",
    "verbose",
    "threads",
    "limit-points",
    "limit-bytes",
    "limit-depth",
    "limit-texels",
    "limit-seconds",
];

impl PartFlags {
    /// Returns whether a conversion is in regions, however much memory there is.
    pub(super) fn divide(&self) -> bool {
        self.plan.is_some() || self.parts.is_some()
    }

    /// Refuses flags that have no effect on files of this extension.
    pub(super) fn check(&self, extension: &str) -> Result<(), Failure> {
        let flag = if self.join.is_some() {
            "--join"
        } else if self.plan.is_some() {
            "--plan"
        } else if self.parts.is_some() {
            "--parts"
        } else {
            return Ok(());
        };
        if extension == "splk" {
            return Ok(());
        }
        Err(Failure::Usage(format!("{flag} is for .splk files; it has no effect on .{extension}")))
    }
}

/// Refuses flags that decide what parts contain: the plan has decided.
fn check_flags(given: &Given, flag: &str) -> Result<(), Failure> {
    match given.other_than(&OF_PARTS) {
        Some(other) => Err(Failure::Usage(format!(
            "--{other} has no effect with {flag}: the plan decides; give it with --plan"
        ))),
        None => Ok(()),
    }
}

impl Convert {
    /// Refuses to replace a plan, unless that is allowed.
    pub(super) fn check_plan(&self, folder: &Path) -> Result<(), Failure> {
        let plan = folder.join("plan.json");
        disk::may_replace(&plan, self.overwrite);
        if folder.exists() && !folder.is_dir() || plan.exists() {
            return output::check(if folder.is_dir() { &plan } else { folder }, self.overwrite);
        }
        Ok(())
    }

    /// Prints what a plan contains, and what to do next.
    pub(super) fn print_plan(&self, plan: &Plan) -> Result<(), Failure> {
        let path = plan.path().display();
        let last = plan.parts() - 1;
        let part = format!("splatkit convert --part {path} --index N");
        let join = format!("splatkit convert --join {path} -o {}", self.output().display());
        if self.json {
            return output::line(json!({
                "file": plan.path().to_string_lossy(),
                "points": plan.points(),
                "regions": plan.regions(),
                "parts": plan.parts(),
                "memory": plan.memory(),
                "part_command": part,
                "join_command": join,
            }));
        }
        output::line(format_args!("points          {}", plan.points()))?;
        output::line(format_args!("parts           {}", plan.parts()))?;
        output::line(format_args!("regions         {}", plan.regions()))?;
        output::line(format_args!("memory          about {} MiB a part", plan.memory() >> 20))?;
        output::line(format_args!("make parts      {part}, for N from 0 to {last}"))?;
        output::line(format_args!("join them       {join}"))
    }

    /// Makes a part of a plan.
    pub(super) fn make_part(
        &self,
        plan: &Path,
        given: &Given,
        progress: &Progress,
    ) -> Result<(), Failure> {
        check_flags(given, "--part")?;
        let start = Instant::now();
        let plan = Plan::open(plan)?;
        let index = self.parts.index.unwrap_or(0);
        let stages = progress.stages();
        let watch = |stage, done, total| stages.set(Stage::name(stage), done, total);
        let made = plan.part(index, &self.load.limits(), Some(&watch))?;
        drop(stages);
        progress.clear();
        let path = plan.part_path(index);
        let PartMade { points, splats, bytes, was_finished } = made;
        let total_ms = milliseconds(start);
        if self.json {
            return output::line(json!({
                "file": path.to_string_lossy(),
                "part": index,
                "parts": plan.parts(),
                "points": points,
                "splats": splats,
                "bytes": bytes,
                "was_finished": was_finished,
                "total_ms": total_ms,
            }));
        }
        let (path, count) = (path.display(), plan.parts());
        if was_finished {
            return output::line(format_args!(
                "part {index} of {count} is finished and intact: {path}"
            ));
        }
        output::line(format_args!("part            {index} of {count}: {path}"))?;
        output::line(format_args!("points          {points}"))?;
        output::line(format_args!("splats          {splats}"))?;
        output::line(format_args!("bytes           {bytes}"))?;
        output::line(format_args!("time            {:.2} s", total_ms / 1e3))
    }

    /// Joins the parts of a plan.
    pub(super) fn join_parts(
        &self,
        plan: &Path,
        given: &Given,
        progress: &Progress,
    ) -> Result<(), Failure> {
        check_flags(given, "--join")?;
        output::check(self.output(), self.overwrite)?;
        let start = Instant::now();
        let plan = Plan::open(plan)?;
        let parts = (0..plan.parts()).map(|index| plan.part_path(index));
        let read = plan.inputs().map(Path::to_owned).chain(parts);
        let read: Vec<PathBuf> = read.chain([plan.path().to_owned()]).collect();
        output::try_writing(self.output(), &read)?;
        let stages = progress.stages();
        let watch = |stage, done, total| stages.set(Stage::name(stage), done, total);
        let done = plan.join(self.output(), Some(&watch))?;
        drop(stages);
        progress.clear();
        self.print_regions(&done, milliseconds(start))
    }
}
