//! Checks of described values: each number against the range that its field says, then what a whole says itself.

use super::fault::{Fault, Step, Trail};
use super::schema::schema;
use schemars::JsonSchema;
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde::ser::{
    Error, SerializeMap, SerializeSeq, SerializeStruct, SerializeStructVariant, SerializeTuple, SerializeTupleStruct,
    SerializeTupleVariant, Serializer,
};
use serde_json::Value;
use std::fmt::{self, Display};

/// A struct, or a choice of structs, whose fields are described on itself.
pub trait Described: Serialize + DeserializeOwned + JsonSchema + 'static {
    /// Checks what ranges of single fields cannot say. It is asked where they do not hold, too.
    /// Returns each fault with its place in this value.
    fn check_whole(&self) -> Vec<Fault> {
        Vec::new()
    }
}

/// Faults of a value: all that are out of range, and those of the whole that are not of one of these.
pub fn faults<T: Described>(value: &T) -> Vec<Fault> {
    let (mut ranges, whole) = both(value);
    ranges.extend(whole);
    ranges
}

/// Faults of a value as a whole, where its ranges have been checked as those of a part.
pub fn whole_faults<T: Described>(value: &T) -> Vec<Fault> {
    both(value).1
}

fn both<T: Described>(value: &T) -> (Vec<Fault>, Vec<Fault>) {
    let mut found = Found::default();
    walk(value, schema::<T>(), Limits::default(), &mut found);
    let mut whole = value.check_whole();
    whole.retain(|whole| found.faults.iter().all(|fault| !fault.steps.starts_with(&whole.steps)));
    (found.faults, whole)
}

/// Checks a value.
///
/// # Errors
/// The first of its faults.
pub fn check<T: Described>(value: &T) -> Result<(), Fault> {
    faults(value).into_iter().next().map_or(Ok(()), Err)
}

/// Range of numbers. Elements of lists have that of their list, too.
#[derive(Clone, Copy, Debug, Default)]
struct Limits<'a> {
    least: Option<f64>,
    above: Option<f64>,
    most: Option<f64>,
    one_of: Option<&'a Vec<Value>>,
    /// Counted things.
    noun: Option<&'static str>,
}

/// Units that are counted, and are told in place of a number.
const COUNTED: [(&str, &str); 2] = [("px", "pixels"), ("steps", "steps")];

impl<'a> Limits<'a> {
    fn within(self, schema: &'a Value) -> Self {
        let number = |key: &str| schema[key].as_f64();
        Self {
            least: tightest(number("minimum"), self.least, f64::max),
            above: tightest(number("exclusiveMinimum"), self.above, f64::max),
            most: tightest(number("maximum"), self.most, f64::min),
            one_of: schema["enum"].as_array().or(self.one_of),
            noun: COUNTED.iter().find(|(unit, _)| schema["unit"] == *unit).map(|(_, noun)| *noun).or(self.noun),
        }
    }

    /// `round`: to the precision that the number has, so that a limit itself is within.
    fn check(&self, number: f64, shown: impl Display, kind: &str, round: impl Fn(f64) -> f64) -> Result<(), String> {
        if let Some(values) = self.one_of {
            let is_one = values.iter().any(|value| value.as_f64() == Some(number));
            let values: Vec<String> = values.iter().map(Value::to_string).collect();
            let expected = || format!("expected {}, found {shown}", values.join(" or "));
            return is_one.then_some(()).ok_or_else(expected);
        }
        let is_within = self.least.is_none_or(|least| number >= round(least))
            && self.above.is_none_or(|above| number > round(above))
            && self.most.is_none_or(|most| number <= round(most));
        if is_within && number.is_finite() {
            return Ok(());
        }
        let kind = self.noun.unwrap_or(kind);
        Err(match (self.least, self.above, self.most) {
            (_, Some(above), Some(most)) => format!("expected {kind} above {above}, at most {most}, found {shown}"),
            (Some(least), _, Some(most)) => format!("expected {kind} from {least} to {most}, found {shown}"),
            (Some(least), _, None) => format!("expected {kind} of at least {least}, found {shown}"),
            (None, Some(above), None) => format!("expected {kind} above {above}, found {shown}"),
            (None, None, Some(most)) => format!("expected {kind} of at most {most}, found {shown}"),
            (None, None, None) => format!("expected a finite number, found {shown}"),
        })
    }
}

/// Faults so far, and the place where a walk is.
#[derive(Default)]
struct Found {
    at: Vec<Step>,
    faults: Vec<Fault>,
}

fn tightest(own: Option<f64>, outer: Option<f64>, of_two: fn(f64, f64) -> f64) -> Option<f64> {
    own.zip(outer).map(|(own, outer)| of_two(own, outer)).or(own).or(outer)
}

/// A serializer that writes nothing, and finds what is out of its range.
struct Walk<'a, 'f> {
    schema: &'a Value,
    limits: Limits<'a>,
    found: &'f mut Found,
    /// The next element of a list.
    index: usize,
}

/// Fault of a value that cannot be written, such as a colour that is none.
#[derive(Debug)]
struct Refused(String);

impl Display for Refused {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Refused {}

impl Error for Refused {
    fn custom<T: Display>(message: T) -> Self {
        Self(message.to_string())
    }
}

fn walk<T: Serialize + ?Sized>(value: &T, schema: &Value, limits: Limits, found: &mut Found) {
    let walk = Walk { schema, limits: limits.within(schema), found, index: 0 };
    if let Err(Refused(message)) = value.serialize(walk) {
        let at = found.at.iter().fold(Trail::default(), |at, &step| at.enter(step, ""));
        found.faults.push(at.fault(message));
    }
}

/// The part of a schema that has a keyword: itself, or one of its alternatives.
fn with<'a>(schema: &'a Value, has: &dyn Fn(&Value) -> bool) -> &'a Value {
    if has(schema) {
        return schema;
    }
    let mut alternatives = ["anyOf", "oneOf"].into_iter().filter_map(|key| schema[key].as_array()).flatten();
    alternatives.find_map(|schema| Some(with(schema, has)).filter(|found| !found.is_null())).unwrap_or(&Value::Null)
}

impl Walk<'_, '_> {
    fn inside<T: Serialize + ?Sized>(&mut self, step: Step, value: &T, schema: &Value, limits: Limits) {
        self.found.at.push(step);
        walk(value, schema, limits, self.found);
        self.found.at.pop();
    }

    fn field<T: Serialize + ?Sized>(&mut self, name: &'static str, value: &T) {
        let of = with(self.schema, &|schema| !schema["properties"][name].is_null());
        self.inside(Step::Field(name), value, &of["properties"][name], Limits::default());
    }

    fn element<T: Serialize + ?Sized>(&mut self, value: &T) {
        let list = with(self.schema, &|schema| !schema["items"].is_null() || !schema["prefixItems"].is_null());
        let own = &list["prefixItems"][self.index];
        let own = if own.is_null() { &list["items"] } else { own };
        let limits = self.limits.within(list);
        self.inside(Step::Index(self.index), value, own, limits);
        self.index += 1;
    }

    /// The same place, at the value of one of the choices.
    fn variant(self, name: &str) -> Self {
        let of = with(self.schema, &|schema| !schema["properties"][name].is_null());
        let schema = &of["properties"][name];
        Walk { limits: self.limits.within(schema), schema, ..self }
    }

    fn check(self, result: Result<(), String>) -> Result<(), Refused> {
        result.map_err(Refused)
    }
}

macro_rules! whole {
    ($($name:ident: $kind:ty)*) => {
        $(fn $name(self, value: $kind) -> Result<(), Refused> {
            let result = self.limits.check(value as f64, value, "a whole number", |limit| limit);
            self.check(result)
        })*
    };
}

impl Serializer for Walk<'_, '_> {
    type Ok = ();
    type Error = Refused;
    type SerializeSeq = Self;
    type SerializeTuple = Self;
    type SerializeTupleStruct = Self;
    type SerializeTupleVariant = Self;
    type SerializeMap = Self;
    type SerializeStruct = Self;
    type SerializeStructVariant = Self;

    whole! {
        serialize_i8: i8
        serialize_i16: i16
        serialize_i32: i32
        serialize_i64: i64
        serialize_u8: u8
        serialize_u16: u16
        serialize_u32: u32
        serialize_u64: u64
    }

    fn serialize_f32(self, value: f32) -> Result<(), Refused> {
        let result = self.limits.check(value.into(), value, "a number", |limit| f64::from(limit as f32));
        self.check(result)
    }

    fn serialize_f64(self, value: f64) -> Result<(), Refused> {
        let result = self.limits.check(value, value, "a number", |limit| limit);
        self.check(result)
    }

    fn serialize_bool(self, _: bool) -> Result<(), Refused> {
        Ok(())
    }

    fn serialize_char(self, _: char) -> Result<(), Refused> {
        Ok(())
    }

    fn serialize_str(self, _: &str) -> Result<(), Refused> {
        Ok(())
    }

    fn serialize_bytes(self, _: &[u8]) -> Result<(), Refused> {
        Ok(())
    }

    fn serialize_none(self) -> Result<(), Refused> {
        Ok(())
    }

    fn serialize_some<T: Serialize + ?Sized>(self, value: &T) -> Result<(), Refused> {
        value.serialize(self)
    }

    fn serialize_unit(self) -> Result<(), Refused> {
        Ok(())
    }

    fn serialize_unit_struct(self, _: &'static str) -> Result<(), Refused> {
        Ok(())
    }

    fn serialize_unit_variant(self, _: &'static str, _: u32, _: &'static str) -> Result<(), Refused> {
        Ok(())
    }

    fn serialize_newtype_struct<T: Serialize + ?Sized>(self, _: &'static str, value: &T) -> Result<(), Refused> {
        value.serialize(self)
    }

    fn serialize_newtype_variant<T: Serialize + ?Sized>(
        self,
        _: &'static str,
        _: u32,
        variant: &'static str,
        value: &T,
    ) -> Result<(), Refused> {
        value.serialize(self.variant(variant))
    }

    fn serialize_seq(self, length: Option<usize>) -> Result<Self, Refused> {
        let list = with(self.schema, &|schema| schema["type"] == "array");
        let noun = list["of"].as_str().unwrap_or("items");
        let bound = |key: &str| list[key].as_u64().and_then(|bound| usize::try_from(bound).ok());
        let (least, most, found) = (bound("minItems").unwrap_or(0), bound("maxItems"), length.unwrap_or(0));
        match most {
            Some(most) if !(least..=most).contains(&found) => {
                Err(Refused(format!("expected from {least} to {most} {noun}, found {found}")))
            }
            None if found < least => Err(Refused(format!("expected at least {least} {noun}, found {found}"))),
            _ => Ok(self),
        }
    }

    fn serialize_tuple(self, _: usize) -> Result<Self, Refused> {
        Ok(self)
    }

    fn serialize_tuple_struct(self, _: &'static str, _: usize) -> Result<Self, Refused> {
        Ok(self)
    }

    fn serialize_tuple_variant(
        self,
        _: &'static str,
        _: u32,
        variant: &'static str,
        _: usize,
    ) -> Result<Self, Refused> {
        Ok(self.variant(variant))
    }

    fn serialize_map(self, _: Option<usize>) -> Result<Self, Refused> {
        Ok(self)
    }

    fn serialize_struct(self, _: &'static str, _: usize) -> Result<Self, Refused> {
        Ok(self)
    }

    fn serialize_struct_variant(
        self,
        _: &'static str,
        _: u32,
        variant: &'static str,
        _: usize,
    ) -> Result<Self, Refused> {
        Ok(self.variant(variant))
    }
}

macro_rules! parts {
    ($($part:ident :: $name:ident ($($key:ident: $kind:ty)?) by $by:ident;)*) => {
        $(impl $part for Walk<'_, '_> {
            type Ok = ();
            type Error = Refused;

            fn $name<T: Serialize + ?Sized>(&mut self, $($key: $kind,)? value: &T) -> Result<(), Refused> {
                self.$by($($key,)? value);
                Ok(())
            }

            fn end(self) -> Result<(), Refused> {
                Ok(())
            }
        })*
    };
}

parts! {
    SerializeSeq::serialize_element() by element;
    SerializeTuple::serialize_element() by element;
    SerializeTupleStruct::serialize_field() by element;
    SerializeTupleVariant::serialize_field() by element;
    SerializeStruct::serialize_field(name: &'static str) by field;
    SerializeStructVariant::serialize_field(name: &'static str) by field;
}

/// Entries of maps have names of their own, and one schema.
impl SerializeMap for Walk<'_, '_> {
    type Ok = ();
    type Error = Refused;

    fn serialize_key<T: Serialize + ?Sized>(&mut self, _: &T) -> Result<(), Refused> {
        Ok(())
    }

    fn serialize_value<T: Serialize + ?Sized>(&mut self, value: &T) -> Result<(), Refused> {
        let of = with(self.schema, &|schema| !schema["additionalProperties"].is_null());
        self.inside(Step::Entry(self.index), value, &of["additionalProperties"], Limits::default());
        self.index += 1;
        Ok(())
    }

    fn end(self) -> Result<(), Refused> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::infinite;
    use super::*;
    use serde::Deserialize;

    #[derive(Serialize, Deserialize, JsonSchema, Clone, Debug, PartialEq)]
    #[serde(default, deny_unknown_fields)]
    struct Thing {
        #[schemars(range(min = 0.1, max = 10.0))]
        width: f32,
        #[schemars(inner(range(min = -1, max = 1)))]
        along: [f64; 3],
        #[serde(with = "infinite")]
        #[schemars(with = "Option<f32>", range(min = 1.0), extend("infinite" = true))]
        reach: f32,
        #[schemars(extend("enum" = [8, 12]))]
        bits: u32,
        #[schemars(extend("exclusiveMinimum" = 0, "maximum" = 5))]
        gain: Option<f32>,
        part: Option<Part>,
        #[schemars(length(max = 2))]
        parts: Vec<Part>,
    }

    #[derive(Serialize, Deserialize, JsonSchema, Clone, Debug, PartialEq)]
    #[serde(rename_all = "snake_case")]
    enum Part {
        Plain,
        Ball(#[schemars(range(max = 3.0))] f32),
        Block {
            #[schemars(range(min = 2, max = 4))]
            sides: u8,
        },
    }

    impl Default for Thing {
        fn default() -> Self {
            let along = [0.0; 3];
            Self { width: 1.0, along, reach: f32::INFINITY, bits: 8, gain: None, part: None, parts: Vec::new() }
        }
    }

    impl Described for Thing {
        fn check_whole(&self) -> Vec<Fault> {
            let has_both = self.bits == 12 && self.gain.is_some();
            let fault = || Trail::default().field("gain").fault("expected none beside 12 bits");
            has_both.then(fault).into_iter().collect()
        }
    }

    fn told(thing: &Thing) -> Vec<String> {
        faults(thing).iter().map(Fault::to_string).collect()
    }

    #[test]
    fn numbers_are_held_against_the_ranges_of_their_fields() {
        assert_eq!(told(&Thing::default()), [""; 0]);
        // The limit as a single float is within, though it is below the double.
        assert_eq!(told(&Thing { width: 0.1, ..Thing::default() }), [""; 0]);
        let bad = Thing {
            width: f32::NAN,
            along: [0.0, -1.5, f64::INFINITY],
            reach: 0.5,
            bits: 9,
            gain: Some(0.0),
            part: Some(Part::Ball(4.0)),
            parts: vec![Part::Plain, Part::Block { sides: 5 }],
        };
        let expected = [
            "width: expected a number from 0.1 to 10, found NaN",
            "along[1]: expected a number from -1 to 1, found -1.5",
            "along[2]: expected a number from -1 to 1, found inf",
            "reach: expected a number of at least 1, found 0.5",
            "bits: expected 8 or 12, found 9",
            "gain: expected a number above 0, at most 5, found 0",
            "part: expected a number of at most 3, found 4",
            "parts[1].sides: expected a whole number from 2 to 4, found 5",
        ];
        assert_eq!(told(&bad), expected);
    }

    #[test]
    fn lists_are_held_against_their_lengths() {
        let long = Thing { parts: vec![Part::Plain; 3], ..Thing::default() };
        assert_eq!(told(&long), ["parts: expected from 0 to 2 items, found 3"]);
    }

    #[test]
    fn a_fault_of_the_whole_is_told_beside_those_of_other_places() {
        let both = Thing { bits: 12, gain: Some(1.0), ..Thing::default() };
        assert_eq!(told(&both), ["gain: expected none beside 12 bits"]);
        let narrow = "width: expected a number from 0.1 to 10, found 0";
        assert_eq!(told(&Thing { width: 0.0, ..both.clone() }), [narrow, "gain: expected none beside 12 bits"]);
        let loud = Thing { gain: Some(6.0), ..both };
        assert_eq!(told(&loud), ["gain: expected a number above 0, at most 5, found 6"]);
    }

    #[test]
    fn fields_are_named_in_their_order() {
        let names: Vec<&str> = super::super::fields::<Thing>().iter().map(|field| field.name).collect();
        assert_eq!(names, ["width", "along", "reach", "bits", "gain", "part", "parts"]);
        assert_eq!(super::super::schema::<Thing>()["properties"]["width"]["default"], 1.0);
    }
}
