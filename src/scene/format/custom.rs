//! Fields of a struct of a file that are not its own: kept as text while the file is parsed.

use bevy_ecs::prelude::*;
use ron::value::RawValue;
use serde::de::value::StrDeserializer;
use serde::de::{DeserializeSeed, Deserializer, MapAccess, Visitor};
use serde::forward_to_deserialize_any;
use std::fmt;

/// The value of a field.
pub trait Value: Send + Sync {
    fn check(&self) -> Result<(), String>;

    /// The entity is that of the field, if it is one of entities.
    fn insert(&self, world: &mut World, entity: Entity);
}

/// Fields of a struct of a file that are not its own, in the order of the file.
#[derive(Default)]
pub struct Custom {
    /// The struct's own fields.
    pub own: &'static [&'static str],
    pub fields: Vec<Field>,
}

/// A field that is none of the struct's own.
pub struct Field {
    pub name: String,
    pub text: Box<RawValue>,
    /// Once it was read.
    pub value: Option<Box<dyn Value>>,
}

impl fmt::Debug for Custom {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.debug_map().entries(self.fields.iter().map(|field| (&field.name, &field.text))).finish()
    }
}

impl Custom {
    /// Puts the values of an entity's fields on it.
    pub fn insert(&self, world: &mut World, entity: Entity) {
        self.fields.iter().filter_map(|field| field.value.as_ref()).for_each(|value| value.insert(world, entity));
    }

    /// Puts the values of a scene's fields into the world.
    pub fn insert_into_world(&self, world: &mut World) {
        self.insert(world, Entity::PLACEHOLDER);
    }
}

/// Reads a struct by what serde has derived for it, but for the fields that it does not have.
///
/// # Errors
/// Those of the deserializer.
pub fn beside<'de, D: Deserializer<'de>, T>(
    deserializer: D,
    derived: impl FnOnce(Beside<'_, D>) -> Result<T, D::Error>,
) -> Result<(T, Custom), D::Error> {
    let mut custom = Custom::default();
    let value = derived(Beside { inner: deserializer, custom: &mut custom })?;
    Ok((value, custom))
}

/// A deserializer, or a visitor or a map of one, that keeps the fields which the struct does not have.
pub struct Beside<'a, I> {
    inner: I,
    custom: &'a mut Custom,
}

impl<'de, D: Deserializer<'de>> Deserializer<'de> for Beside<'_, D> {
    type Error = D::Error;

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        name: &'static str,
        fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, D::Error> {
        self.custom.own = fields;
        self.inner.deserialize_struct(name, fields, Beside { inner: visitor, custom: self.custom })
    }

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, D::Error> {
        self.inner.deserialize_any(visitor)
    }

    forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf option unit unit_struct
        newtype_struct seq tuple tuple_struct map enum identifier ignored_any
    }
}

impl<'de, V: Visitor<'de>> Visitor<'de> for Beside<'_, V> {
    type Value = V::Value;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        self.inner.expecting(f)
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<V::Value, A::Error> {
        self.inner.visit_map(Beside { inner: map, custom: self.custom })
    }
}

impl<'de, A: MapAccess<'de>> MapAccess<'de> for Beside<'_, A> {
    type Error = A::Error;

    fn next_key_seed<K: DeserializeSeed<'de>>(&mut self, seed: K) -> Result<Option<K::Value>, A::Error> {
        while let Some(key) = self.inner.next_key_seed(Key { own: self.custom.own })? {
            match key {
                Ok(own) => return seed.deserialize(StrDeserializer::new(own)).map(Some),
                Err(name) => {
                    let text = self.inner.next_value()?;
                    self.custom.fields.push(Field { name, text, value: None });
                }
            }
        }
        Ok(None)
    }

    fn next_value_seed<S: DeserializeSeed<'de>>(&mut self, seed: S) -> Result<S::Value, A::Error> {
        self.inner.next_value_seed(seed)
    }
}

/// Reads the name of a field: one of the struct's own, or another.
struct Key {
    own: &'static [&'static str],
}

impl<'de> DeserializeSeed<'de> for Key {
    type Value = Result<&'static str, String>;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<Self::Value, D::Error> {
        deserializer.deserialize_identifier(self)
    }
}

impl Visitor<'_> for Key {
    type Value = Result<&'static str, String>;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("the name of a field")
    }

    fn visit_str<E>(self, name: &str) -> Result<Self::Value, E> {
        Ok(self.own.iter().copied().find(|own| *own == name).ok_or_else(|| name.to_owned()))
    }
}
