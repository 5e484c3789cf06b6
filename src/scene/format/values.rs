//! Values with more than one way of writing: colours, scales, and lists of named things.

use glam::{DVec3, Vec3};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{Deserializer, MapAccess, Visitor};
use serde::{Deserialize, Serialize, Serializer};
use std::borrow::Cow;
use std::collections::HashMap;
use std::fmt;
use std::marker::PhantomData;
use systems::describe::Described;
use systems::space::{FARTHEST, LARGEST};

/// Least size, metres; also factor of scale.
pub const SMALLEST: f64 = 1e-5;

/// `{ "name": value, … }` in the order of the file; the same name twice is kept for the check to find.
#[derive(Debug)]
pub struct Named<T> {
    entries: Vec<(String, T)>,
    /// The first entry of each name.
    index: HashMap<String, usize>,
}

impl<T> Default for Named<T> {
    fn default() -> Self {
        Self { entries: Vec::new(), index: HashMap::new() }
    }
}

impl<T> Named<T> {
    pub fn entries(&self) -> &[(String, T)] {
        &self.entries
    }

    pub fn entries_mut(&mut self) -> &mut [(String, T)] {
        &mut self.entries
    }

    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.entries.iter().map(|(name, _)| name.as_str())
    }

    /// Position of the first entry of that name.
    pub fn position(&self, name: &str) -> Option<usize> {
        self.index.get(name).copied()
    }

    pub fn get(&self, name: &str) -> Option<&T> {
        self.position(name).and_then(|i| self.entries.get(i)).map(|(_, value)| value)
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Named<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Entries<T>(PhantomData<T>);
        impl<'de, T: Deserialize<'de>> Visitor<'de> for Entries<T> {
            type Value = Named<T>;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("named entries: { \"name\": … }")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
                let mut named = Named::default();
                while let Some((name, value)) = map.next_entry::<String, T>()? {
                    named.index.entry(name.clone()).or_insert(named.entries.len());
                    named.entries.push((name, value));
                }
                Ok(named)
            }
        }
        deserializer.deserialize_map(Entries(PhantomData))
    }
}

impl<T: Serialize> Serialize for Named<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.entries.iter().map(|(name, value)| (name, value)))
    }
}

impl<T: JsonSchema> JsonSchema for Named<T> {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        format!("Named_{}", T::schema_name()).into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        json_schema!({ "type": "object", "additionalProperties": generator.subschema_for::<T>() })
    }
}

/// Length beyond which objects are drawn in pieces; 0: never.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Copy, Debug)]
pub struct PieceMetres(#[schemars(range(min = 0.0, max = LARGEST), extend("unit" = "m"))] pub f32);

impl Described for PieceMetres {}

/// Point of the file that the world's places count from.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Copy, Debug)]
pub struct Origin(#[schemars(inner(range(min = -FARTHEST, max = FARTHEST)), extend("unit" = "m"))] pub [f64; 3]);

impl Described for Origin {}

/// A place of a file as the world keeps it.
pub fn place(place: [f64; 3]) -> Vec3 {
    DVec3::from_array(place).as_vec3()
}

/// One number for all three axes, or one for each.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Copy, Debug)]
#[serde(untagged, expecting = "expected a number or (x, y, z)")]
#[schemars(extend("see" = "number or (x, y, z)"))]
pub enum Scale {
    /// The same along all axes.
    Uniform(f32),
    /// Along x, y and z.
    PerAxis([f32; 3]),
}

impl Default for Scale {
    fn default() -> Self {
        Self::Uniform(1.0)
    }
}

impl Scale {
    pub fn vec3(self) -> Vec3 {
        match self {
            Self::Uniform(s) => Vec3::splat(s),
            Self::PerAxis(s) => Vec3::from_array(s),
        }
    }
}
