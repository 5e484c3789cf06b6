//! Values that several subcommands read from the command line.

use crate::frames::{FrameJob, RunJob};
use crate::name;
use clap::Args;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use std::fmt::Display;
use std::ops::RangeInclusive;
use std::str::FromStr;
use systems::assets::levels::LevelOfDetail;

/// Frame numbers stay below this.
pub const MOST_FRAMES: u64 = RunJob::MOST_FRAMES;

/// A picture's size, like 1280x720.
pub fn parse_size(text: &str) -> Result<(u32, u32), String> {
    let parse = |side: &str| side.parse::<u32>().ok().filter(|side| (1..=FrameJob::LARGEST_SIDE).contains(side));
    let sides = text.split_once(['x', 'X', '×']).and_then(|(w, h)| Some((parse(w)?, parse(h)?)));
    sides.ok_or_else(|| {
        let other = text.split_once([',', '*', ':', ' ', ';']).and_then(|(w, h)| Some((parse(w)?, parse(h.trim())?)));
        let meant = other.map(|(w, h)| format!("; write {w}x{h}")).unwrap_or_default();
        format!("expected WIDTHxHEIGHT, each 1 to 16384, like 1280x720{meant}")
    })
}

/// The end of a message about a number: what to write in place of a decimal comma; else nothing.
pub fn pointed(text: &str) -> String {
    let pointed = text.replacen(',', ".", 1);
    let is_comma = text.contains(',') && pointed.parse::<f64>().is_ok();
    if is_comma { format!("; use a decimal point, not a comma: {pointed}") } else { String::new() }
}

/// Takes a whole number of a range.
pub fn whole<T>(range: RangeInclusive<T>) -> impl Fn(&str) -> Result<T, String> + Clone + Send + Sync + 'static
where
    T: FromStr + PartialOrd + Display + Clone + Send + Sync + 'static,
{
    move |text: &str| {
        let number = text.parse().ok().filter(|number| range.contains(number));
        number.ok_or_else(|| {
            let comma = if text.contains(',') { "; whole numbers have no comma" } else { "" };
            format!("expected a whole number from {} to {}{comma}", range.start(), range.end())
        })
    }
}

/// Takes a number of a range.
pub fn number<T>(range: RangeInclusive<T>) -> impl Fn(&str) -> Result<T, String> + Clone + Send + Sync + 'static
where
    T: FromStr + PartialOrd + Display + Clone + Send + Sync + 'static,
{
    move |text: &str| {
        let number = text.parse().ok().filter(|number| range.contains(number));
        number.ok_or_else(|| format!("expected a number from {} to {}{}", range.start(), range.end(), pointed(text)))
    }
}

/// Takes the name of a picture that is written as PNG.
#[cfg(feature = "tools")]
pub fn png() -> impl TypedValueParser<Value = std::path::PathBuf> {
    clap::builder::PathBufValueParser::new().try_map(|path| {
        let is_png = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("png"));
        if is_png { Ok(path) } else { Err("expected a name that ends in .png") }
    })
}

/// Takes one of the names of a list; an unknown one is answered with the nearest.
pub fn named<T: Copy + Send + Sync + 'static>(
    what: &'static str,
    all: &'static [(&'static str, T)],
) -> impl Fn(&str) -> Result<T, String> + Clone + Send + Sync + 'static {
    move |text: &str| name::find(what, all, text)
}

/// Takes one of the names of a list, all of which the help explains.
pub fn choice<T: Copy + Send + Sync + 'static>(
    all: &'static [(&'static str, T)],
    help: fn(T) -> &'static str,
) -> impl TypedValueParser<Value = T> {
    let values = all.iter().map(|&(name, value)| PossibleValue::new(name).help(help(value)));
    PossibleValuesParser::new(values).try_map(|text| name::find("value", all, &text))
}

/// Help that ends with the names of a list.
pub fn one_of<const N: usize>(before: &str, names: [&str; N]) -> String {
    before.to_owned() + &names.join(", ")
}

/// Help that lists names in a sentence: first those without a meaning, then the others, each with its own.
pub fn listed<T: Copy>(before: &str, all: &[(&str, T)], meaning: fn(T) -> &'static str) -> String {
    let (plain, others): (Vec<_>, Vec<_>) = all.iter().partition(|(_, value)| meaning(*value).is_empty());
    let plain = plain.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", ");
    let others = others.iter().map(|(name, value)| format!("{name}: {}", meaning(*value)));
    let parts: Vec<String> = std::iter::once(plain).filter(|plain| !plain.is_empty()).chain(others).collect();
    before.to_owned() + &parts.join("; ")
}

/// Number of threads.
#[derive(Args, Clone, Copy)]
pub struct ThreadsArgs {
    /// Worker threads; the number does not change what is made [default: one per core]
    #[arg(long, value_name = "N", value_parser = whole(1u16..=256))]
    threads: Option<u16>,
}

impl ThreadsArgs {
    pub fn count(self) -> Option<usize> {
        self.threads.map(usize::from)
    }

    pub fn set(self) {
        systems::set_threads(self.count());
    }
}

/// `on` and `off`.
pub const ON_OFF: [(&str, bool); 2] = [("on", true), ("off", false)];

/// Levels of detail: `on` or `off`.
pub fn parse_levels(text: &str) -> Result<LevelOfDetail, String> {
    let on = name::find("value", &ON_OFF, text)?;
    Ok(if on { LevelOfDetail::default() } else { LevelOfDetail::OFF })
}

/// Samples per pixel.
pub fn parse_samples(text: &str) -> Result<u32, String> {
    text.parse().ok().filter(|n| [1, 4].contains(n)).ok_or_else(|| "expected 1 or 4".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use systems::ecs::clock::SPEEDS;

    #[test]
    fn names_and_what_they_mean_make_a_sentence() {
        let meaning = |value: u32| ["", "", "one", "two"][value as usize];
        let all = [("a", 0), ("b", 1), ("c", 2), ("d", 3)];
        assert_eq!(listed("Of: ", &all, meaning), "Of: a, b; c: one; d: two");
        assert_eq!(listed("", &all[2..3], meaning), "c: one");
    }

    #[test]
    fn sizes_are_read_strictly() {
        assert_eq!(parse_size("64x36"), Ok((64, 36)));
        for bad in ["64", "0x5", "x", "64x", "99999x2"] {
            assert!(parse_size(bad).is_err(), "{bad}");
        }
        let refusal = |text| parse_size(text).expect_err("refused");
        assert!(refusal("640,480").ends_with("; write 640x480") && refusal("99999,2").ends_with("like 1280x720"));
        let comma = "expected a number from 0.1 to 100; use a decimal point, not a comma: 1.5";
        let speed = number(SPEEDS);
        assert_eq!(speed("1,5").expect_err("refused"), comma);
        assert_eq!((speed("0.1"), speed("100")), (Ok(0.1), Ok(100.0)));
        assert!(["0", "-1", "101", "NaN", "fast"].iter().all(|bad| speed(bad).is_err()));
        let threads = whole(1..=256u16);
        assert_eq!((threads("1"), threads("256")), (Ok(1), Ok(256)));
        let refused = Err("expected a whole number from 1 to 256".to_owned());
        assert!(["0", "-1", "257", "1.5", "1e2", "", "all"].iter().all(|bad| threads(bad) == refused));
        let comma = Err("expected a whole number from 1 to 256; whole numbers have no comma".to_owned());
        assert_eq!((threads("1,5"), threads("1,000")), (comma.clone(), comma));
    }
}
