//! Which of several volumes of a file is read: the one rule of all formats.
//!
//! The caller chooses by number, and the first is the default. Nothing is chosen in silence: a
//! warning says how many there are and which flag reads another.

use crate::{Result, about::Channel, formats::ReadOptions, input::Source, warning};

/// Returns the number of the time to read of a file with `count` of them, from 0: the one that
/// [`ReadOptions::time`] names, else the first, with a warning if there are several. `place` is
/// where the file says how many there are.
///
/// # Errors
/// [`Error::Input`](crate::Error::Input) for a time that the file does not have.
pub(crate) fn time(
    source: &Source,
    place: &str,
    count: u64,
    options: &ReadOptions,
) -> Result<usize> {
    of_times(source, place, count, options, "times")
}

/// As [`time`], of what the file calls `names`: “times”, “members”, “times or echoes”.
///
/// # Errors
/// As [`time`].
pub(crate) fn of_times(
    source: &Source,
    place: &str,
    count: u64,
    options: &ReadOptions,
    names: &str,
) -> Result<usize> {
    let time = options.time.unwrap_or(0);
    if (time as u64) < count {
        source.choose_time(count, time);
        warn_of_times(source, count, options, names);
        return Ok(time);
    }
    let are = if count == 1 { names.strip_suffix('s').unwrap_or(names) } else { names };
    let message = format!("has {count} {are}, but number {time} was asked for");
    let hint = match count {
        0 | 1 => "leave out --time".into(),
        _ => format!("choose a time from 0 to {}", count - 1),
    };
    Err(source.error(place, message).hint(hint))
}

/// Says that the first of several times is shown, unless the caller has named one. For readers that
/// choose a time more than once.
pub(crate) fn warn_of_times(source: &Source, count: u64, options: &ReadOptions, names: &str) {
    if count > 1 && options.time.is_none() {
        let path = source.path.display();
        warning::give!("{path}: shows the first of {count} {names}; --time 1 shows the second");
    }
}

/// Returns the numbers of the channels to read of a file that has these: those of
/// [`ReadOptions::channels`], or the one that [`ReadOptions::scalar`] names (by its name, as
/// `channel:1` or `:1`). By default this is the first, with a warning if there are several.
///
/// # Errors
/// [`Error::Input`](crate::Error::Input) for a channel that the file does not have.
pub(crate) fn channels(
    source: &Source,
    options: &ReadOptions,
    all: &[Channel],
) -> Result<Vec<usize>> {
    if all.len() < 2 {
        return Ok(vec![0]);
    }
    let path = source.path.display();
    match (&options.scalar, &options.channels) {
        (Some(name), _) => Ok(vec![channel(source, name, all)?]),
        (None, Some(names)) if names.is_empty() => {
            let most = Channel::MOST;
            if all.len() > most {
                let (last, count) = (most - 1, all.len());
                warning::give!(
                    "{path}: shows the channels 0 to {last} of {count}; --channels {most},… shows \
                     others"
                );
            }
            Ok((0..all.len().min(most)).collect())
        }
        (None, Some(names)) => names.iter().map(|name| channel(source, name, all)).collect(),
        (None, None) => {
            warning::give!(
                "{path}: shows the first of {} channels; --scalar channel:1 shows the second",
                all.len()
            );
            Ok(vec![0])
        }
    }
}

/// Returns the number of the channel of a name: its own, its number, or its number behind a colon.
fn channel(source: &Source, name: &str, all: &[Channel]) -> Result<usize> {
    let is_named = |channel: &Channel| {
        !channel.name.is_empty() && channel.name.eq_ignore_ascii_case(name.trim())
    };
    if let Some(number) = all.iter().position(is_named) {
        return Ok(number);
    }
    let word = name.rsplit(':').next().unwrap_or(name).trim();
    match word.parse::<usize>() {
        Ok(number) if number < all.len() => Ok(number),
        _ => {
            let names = (0..all.len()).map(|number| match &*all[number].name {
                "" => number.to_string(),
                name => format!("{number} ({name})"),
            });
            let names: Vec<String> = names.take(32).collect();
            let message = format!("has no channel “{name}”; the channels are {}", names.join(", "));
            Err(source.error("channels", message))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{channels as channels_of, *};
    use crate::{
        formats::{Times, times},
        input::{Limits, testing::warnings_of},
    };
    use std::path::Path;

    fn chosen(count: u64, wanted: Option<usize>) -> (Result<usize>, Vec<String>) {
        let limits = Limits::default();
        let source = Source::from_bytes(Path::new("a"), &[], &limits).unwrap();
        let options = ReadOptions { time: wanted, ..ReadOptions::default() };
        warnings_of(|| time(&source, "header", count, &options))
    }

    #[test]
    fn the_first_of_several_is_said_to_be_the_first() {
        let (time, words) = chosen(5, None);
        assert_eq!(time.unwrap(), 0);
        assert_eq!(words, ["a: shows the first of 5 times; --time 1 shows the second"]);
        let (time, words) = chosen(5, Some(4));
        assert_eq!((time.unwrap(), words.len()), (4, 0));
        let (time, words) = chosen(1, None);
        assert_eq!((time.unwrap(), words.len()), (0, 0));
    }

    #[test]
    fn the_times_of_a_file_are_known_once_it_is_read() {
        let limits = Limits::default();
        let source = Source::from_bytes(Path::new("a"), &[], &limits).unwrap();
        let options = ReadOptions { time: Some(3), ..ReadOptions::default() };
        assert_eq!(times(&source), None);
        // A file that another one refers to has a single time.
        for count in [5, 1] {
            let wanted =
                ReadOptions { time: options.time.filter(|_| count > 1), ..options.clone() };
            time(&source, "header", count, &wanted).unwrap();
        }
        assert_eq!(times(&source), Some(Times { count: 5, read: 3 }));
    }

    #[test]
    fn a_time_that_is_missing_is_an_error_with_those_that_are_there() {
        let error = chosen(5, Some(5)).0.unwrap_err().to_string();
        assert!(error.contains("has 5 times, but number 5 was asked for"), "{error}");
        let error = chosen(1, Some(1)).0.unwrap_err().to_string();
        assert!(error.contains("has 1 time, but number 1 was asked for"), "{error}");
    }

    #[test]
    fn channels_are_chosen_by_name_or_number() {
        let named = |name: &str| Channel { name: name.into(), ..Channel::default() };
        let all = [named("DAPI"), named(""), named("GFP")];
        let limits = Limits::default();
        let source = Source::from_bytes(Path::new("a"), &[], &limits).unwrap();
        let of = |names: &[&str]| {
            let channels = Some(names.iter().map(|name| (*name).to_owned()).collect());
            let options = ReadOptions { channels, ..ReadOptions::default() };
            warnings_of(|| channels_of(&source, &options, &all))
        };
        assert_eq!(of(&[]).0.unwrap(), [0, 1, 2]);
        assert_eq!(of(&["gfp", "0"]).0.unwrap(), [2, 0]);
        let error = of(&["YFP"]).0.unwrap_err().to_string();
        assert!(error.contains("no channel “YFP”") && error.contains("2 (GFP)"), "{error}");
        let (first, words) = warnings_of(|| channels_of(&source, &ReadOptions::default(), &all));
        assert_eq!((first.unwrap(), words.len()), (vec![0], 1));
        let second = ReadOptions::scalar(Some("channel:1"));
        assert_eq!(channels_of(&source, &second, &all).unwrap(), [1]);
        let many = vec![Channel::default(); 9];
        let options = ReadOptions { channels: Some(Vec::new()), ..ReadOptions::default() };
        let (most, words) = warnings_of(|| channels_of(&source, &options, &many));
        assert_eq!((most.unwrap().len(), words.len()), (Channel::MOST, 1));
    }
}
