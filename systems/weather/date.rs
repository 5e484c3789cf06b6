//! Dates with a time, by ISO 8601.

use jiff::Timestamp;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::borrow::Cow;
use std::fmt;
use std::ops::RangeInclusive;
use std::str::FromStr;

/// Years for which the almanac holds, as seconds since 1970: from 1900 to the end of 2100.
const KNOWN: RangeInclusive<f64> = -2_208_988_800.0..=4_133_980_799.0;

const EXPECTED: &str = "expected a date from 1900 to 2100 with its offset from UTC, as \"2026-06-21T12:00+02:00\"";

/// A moment: seconds since 1970-01-01T00:00Z, without leap seconds.
#[derive(Clone, Copy, PartialEq, PartialOrd, Debug)]
pub struct Date(pub f64);

impl Date {
    /// Tells if the almanac knows where sun and moon stand then.
    pub fn is_known(self) -> bool {
        KNOWN.contains(&self.0)
    }

    /// The moment some seconds later, within the years that are known.
    pub fn later(self, seconds: f64) -> Self {
        Self((self.0 + seconds).clamp(*KNOWN.start(), *KNOWN.end()))
    }
}

impl Default for Date {
    /// Noon of a midsummer's day, UTC.
    fn default() -> Self {
        Self(1_782_043_200.0)
    }
}

impl FromStr for Date {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parsed: Result<Timestamp, jiff::Error> = text.parse();
        let seconds = parsed.map_err(|error| format!("{EXPECTED}: {error}"))?.as_duration().as_secs_f64();
        if Self(seconds).is_known() { Ok(Self(seconds)) } else { Err(EXPECTED.into()) }
    }
}

impl fmt::Display for Date {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        // To a millisecond: finer is what is left of a sum.
        let millis = (self.0 * 1000.0).round() as i64;
        let stamp = Timestamp::from_millisecond(millis).unwrap_or_default();
        write!(f, "{stamp}")
    }
}

/// Text for people, a number for programs.
impl Serialize for Date {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        if serializer.is_human_readable() { serializer.collect_str(self) } else { self.0.serialize(serializer) }
    }
}

impl<'de> Deserialize<'de> for Date {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        if deserializer.is_human_readable() {
            Cow::<str>::deserialize(deserializer)?.parse().map_err(D::Error::custom)
        } else {
            f64::deserialize(deserializer).map(Self)
        }
    }
}

impl JsonSchema for Date {
    fn schema_name() -> Cow<'static, str> {
        "Date".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ "type": "string", "format": "date-time" })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_have_an_offset_and_are_between_1900_and_2100() {
        let at = |text: &str| text.parse::<Date>().map(|date| date.0);
        assert_eq!(at("1970-01-01T00:00Z"), Ok(0.0));
        assert_eq!(at("2026-11-28T07:30+01:00"), Ok(1_795_847_400.0));
        assert_eq!(at("2026-06-21T12:00Z"), Ok(Date::default().0));
        for bad in ["2026-02-31T00:00Z", "2026-06-21T12:00", "1899-12-31T23:59Z", "2101-01-01T00:00Z", "noon", ""] {
            let error = at(bad).expect_err(bad);
            assert!(error.starts_with(EXPECTED), "{bad}: {error}");
        }
    }

    #[test]
    fn a_date_comes_back_as_it_was_written() {
        for text in ["1900-01-01T00:00:00Z", "2026-06-21T12:00:00Z", "2026-06-21T12:00:00.25Z", "2100-12-31T23:59:59Z"]
        {
            assert_eq!(text.parse::<Date>().expect(text).to_string(), text);
        }
    }
}
