//! Values with more than one way of writing: colours, scales, and lists of named things.

use glam::{DVec3, Vec3};
use serde::Deserialize;
use serde::de::{DeserializeSeed, Deserializer, EnumAccess, Error, MapAccess, VariantAccess, Visitor};
use std::collections::HashMap;
use std::fmt;
use std::marker::PhantomData;

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

/// The names of a list.
pub const fn names<T: Copy, const N: usize>(all: &[(&'static str, T); N]) -> [&'static str; N] {
    let mut names = [""; N];
    let mut i = 0;
    while i < N {
        names[i] = all[i].0;
        i += 1;
    }
    names
}

/// Reads one of the names of a list as serde reads the variants of an enum.
pub fn one_of<'de, D: Deserializer<'de>, T: Copy>(
    all: &'static [(&'static str, T)],
    names: &'static [&'static str],
    deserializer: D,
) -> Result<T, D::Error> {
    #[derive(Clone, Copy)]
    struct OneOf<T: 'static> {
        all: &'static [(&'static str, T)],
        names: &'static [&'static str],
    }

    impl<'de, T: Copy> Visitor<'de> for OneOf<T> {
        type Value = T;

        fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
            write!(f, "one of {}", self.names.join(", "))
        }

        fn visit_enum<A: EnumAccess<'de>>(self, data: A) -> Result<T, A::Error> {
            let (value, rest) = data.variant_seed(self)?;
            rest.unit_variant()?;
            Ok(value)
        }

        fn visit_str<E: Error>(self, name: &str) -> Result<T, E> {
            let found = self.all.iter().find(|(known, _)| *known == name);
            found.map(|(_, value)| *value).ok_or_else(|| E::unknown_variant(name, self.names))
        }
    }

    impl<'de, T: Copy> DeserializeSeed<'de> for OneOf<T> {
        type Value = T;

        fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<T, D::Error> {
            deserializer.deserialize_identifier(self)
        }
    }

    deserializer.deserialize_enum("", names, OneOf { all, names })
}

/// A place of a file as the world keeps it.
pub fn place(place: [f64; 3]) -> Vec3 {
    DVec3::from_array(place).as_vec3()
}

/// One number for all three axes, or one for each.
#[derive(Deserialize, Clone, Copy, Debug)]
#[serde(untagged, expecting = "expected a number or (x, y, z)")]
pub enum Scale {
    Uniform(f32),
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
