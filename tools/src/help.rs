//! What `-h` shows of tasks with many flags: the flags that are needed most, and examples. `--help`
//! shows all flags.

use clap::{Arg, Command};

/// A task with more flags than fit on a screen.
struct Task {
    name: &'static str,
    /// The flags that `-h` lists.
    flags: &'static str,
    examples: &'static str,
}

const TASKS: [Task; 9] = [
    Task {
        name: "render",
        flags: DRAWN,
        examples: "  splatkit render bunny.ply
  splatkit render head.nrrd --transfer ct-bone --view left -o head.png
  splatkit render head.nrrd --iso 300 --clip 'x<50%' --size 1920x1080 -o cut.png
  splatkit render scan.las --color intensity --colormap gray --turntable 90 -o scan.gif",
    },
    Task {
        name: "view",
        flags: DRAWN,
        examples: "  splatkit view
  splatkit view head.nrrd --transfer ct-bone
  splatkit view scan.splk --up +Z",
    },
    Task {
        name: "publish",
        flags: "output overwrite quality limit title viewer background json transfer range iso \
            colormap color view azimuth elevation zoom up clip",
        examples: "  splatkit publish scan.ply skull.nrrd scene.spz -o look.html
  splatkit publish head.nrrd --transfer ct-bone -o site",
    },
    Task {
        name: "serve",
        flags: "address port no-open title viewer background transfer range iso colormap color \
            view azimuth elevation zoom up clip",
        examples: "  splatkit serve scan.ply
  splatkit serve head.nrrd --transfer ct-bone --port 8000
  splatkit serve site",
    },
    Task {
        name: "convert",
        flags: "output lattice overwrite dry-run json crop where translate rotate scale thin \
            remove-floaters plan preset lossless up unit memory color range dims type",
        examples: "  splatkit convert scan.laz -o scan.splk
  splatkit convert head.nrrd -o head.splv
  splatkit convert trained.ply -o trained.spz
  splatkit convert scan.laz -o ground.laz --where 'classification == 2' --thin 0.5
  splatkit convert ct.raw --dims 512x512x300 --type u16 -o ct.nrrd",
    },
    Task {
        name: "bench",
        flags: "frames json transfer iso view azimuth elevation zoom size engine gpu evaluate cut \
            budget memory no-occlusion",
        examples: "  splatkit bench head.nrrd --size 768x768
  splatkit bench scan.splk --cut 1 --engine cpu --json",
    },
    Task {
        name: "transfer",
        flags: "output overwrite dims type spacing scalar time series dataset transfer range \
            opacity-unit iso colormap",
        examples: "  splatkit transfer head.nrrd -o head.json
  splatkit transfer head.nrrd --transfer ct-bone --range 200,1500 -o bone.json",
    },
    Task {
        name: "info",
        flags: "json stats dims type spacing scalar time series dataset missing labels",
        examples: "  splatkit info scan.laz
  splatkit info scan.laz --stats
  splatkit info study/ --series 2
  splatkit info aseg.nii.gz --labels FreeSurferColorLUT.txt",
    },
    Task {
        name: "check",
        flags: LOOKED_AT,
        examples: "  splatkit check scan.splk
  splatkit check ct.raw --dims 512x512x300 --type u16",
    },
];

/// The flags of a look at a file.
const LOOKED_AT: &str = "json dims type spacing scalar time series dataset missing labels";

/// The flags of a picture.
const DRAWN: &str = "output overwrite background samples json transfer range iso colormap color \
    turntable path scalar-bar axes view azimuth elevation zoom up size engine clip";

/// Returns the whole command line with short texts for `-h`.
pub fn with_short_help(command: Command) -> Command {
    command.mut_subcommands(|task| match TASKS.iter().find(|entry| entry.name == task.get_name()) {
        Some(entry) => entry.shortened(task),
        None => task,
    })
}

/// Whether a list of words has this one.
fn has(words: &str, word: &str) -> bool {
    words.split_whitespace().any(|other| other == word)
}

impl Task {
    fn shortened(&self, task: Command) -> Command {
        let examples = format!("Examples:\n{}", self.examples);
        let note = format!("{examples}\n\n--help lists all flags.");
        task.mut_args(|flag| if self.lists(&flag) { flag } else { flag.hide_short_help(true) })
            .after_help(note)
            .after_long_help(examples)
    }

    fn lists(&self, flag: &Arg) -> bool {
        flag.get_long().is_none_or(|name| has(self.flags, name))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    /// The most flags that `-h` lists.
    const MOST: usize = 25;

    /// The flags under each heading. All others are under “Options”.
    const HEADINGS: &[(&str, &str)] = &[
        (
            "Input",
            "dims type spacing endian header scalar time series dataset missing radius neighbours \
            no-slopes labels modality opacity-from scale rotate translate edit",
        ),
        ("Limits", "limit-points limit-bytes limit-depth limit-texels limit-seconds"),
        (
            "Appearance",
            "transfer range channels opacity-unit iso gradient-opacity radius-scale points \
            point-size point-radius line-width glyphs glyph-scale cells crease edges opacity \
            colormap color nan-color log-colors",
        ),
        ("Kernel", "kernel sigma extent sharp"),
        ("Page", "title viewer quality limit"),
        ("Animation", "turntable path times fps"),
        ("Figures", "width height dpi views split-channels columns panel-labels"),
        ("Texts", "scalar-bar axes scale-bar caption"),
        (
            "Camera",
            "camera view-of view camera-position focal-point view-up view-angle distance azimuth \
            elevation zoom orthographic up",
        ),
        (
            "Engine",
            "size engine gpu gpu-timeout gpu-memory pass-entries gradient evaluate shade no-shade \
            light shadows ambient-occlusion eye-dome outline outline-color sheet-thickness cut \
            budget frame-time memory cull-backfaces no-occlusion reference",
        ),
        ("Method", "mode back-to-front classify optics mip x-ray"),
        ("Clipping", "clip cut-out"),
        ("Hierarchy", "preset lossless radius-scale up unit degree spz-version memory"),
        (
            "Edits",
            "crop where translate rotate scale matrix reproject from-crs thin remove-floaters \
            keep-cluster normals",
        ),
        ("Parts", "plan parts part index join"),
        ("Remote inputs", "cache cache-size allow-host"),
        ("Server", "address port no-open"),
    ];

    /// Flags that have the names of others with a heading, but are a task's own.
    const OWN: &[(&str, &str)] = &[("generate", "dims type parts points"), ("demo", "gpu")];

    fn tasks() -> Vec<Command> {
        let mut command = crate::command();
        command.build();
        command.get_subcommands().filter(|task| task.get_name() != "help").cloned().collect()
    }

    /// A flag after a flattened group would get the group's heading.
    #[test]
    fn every_flag_is_under_its_heading() {
        let mut wrong = Vec::new();
        for task in tasks() {
            let name = task.get_name();
            let own_flags =
                OWN.iter().find(|(task, _)| *task == name).map_or("", |(_, flags)| flags);
            for flag in task.get_arguments() {
                let (heading, long) = (flag.get_help_heading(), flag.get_long().unwrap_or(""));
                let of =
                    HEADINGS.iter().filter(|(_, flags)| has(flags, long) && !has(own_flags, long));
                let mut headings = of.map(|(heading, _)| *heading).peekable();
                let is_right = match heading {
                    Some(heading) => headings.any(|other| other == heading),
                    None => headings.peek().is_none(),
                };
                if !is_right {
                    wrong.push(format!("{name} {}: {heading:?}", flag.get_id()));
                }
            }
        }
        assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    }

    /// Returns the names of the flags that a help text lists. Descriptions are indented further.
    fn listed(text: &str) -> Vec<String> {
        let flag = |line: &str| {
            let words = line.trim_start();
            let is_flag = words.starts_with('-') && [2, 6].contains(&(line.len() - words.len()));
            let long =
                words.split([' ', ',', '[', '=', '.']).find_map(|word| word.strip_prefix("--"));
            long.filter(|_| is_flag).map(str::to_owned)
        };
        text.lines().filter_map(flag).collect()
    }

    #[test]
    fn short_help_fits_on_a_screen_and_long_help_has_all() {
        for mut task in tasks() {
            let (short, long) = (task.render_help().to_string(), task.render_long_help());
            let (name, long) = (task.get_name().to_owned(), long.to_string());
            let [few, all] = [&short, &long].map(|text| listed(text));
            assert!(few.len() <= MOST, "{name} -h lists {}: {few:?}", few.len());
            let flags = task.get_arguments().filter(|flag| !flag.is_hide_set());
            for flag in flags.filter_map(Arg::get_long) {
                assert!(all.iter().any(|other| other == flag), "{name}: {flag} in {all:?}");
            }
            let is_long = all.len() > MOST;
            assert_eq!(short.contains("--help lists all flags."), is_long, "{name}: {short}");
            assert_eq!(long.contains("Examples:"), is_long, "{name}");
        }
    }

    #[test]
    fn short_help_names_flags_that_exist() {
        for entry in TASKS {
            let command = crate::Command::command();
            let Some(task) = command.find_subcommand(entry.name) else { continue };
            for flag in entry.flags.split_whitespace() {
                let is_it = |other: &Arg| other.get_long() == Some(flag);
                assert!(task.get_arguments().any(is_it), "{} --{flag}", entry.name);
            }
        }
    }
}
