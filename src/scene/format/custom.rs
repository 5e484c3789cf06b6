//! Fields of a struct of a file that are not its own: kept as text while the file is parsed.

use bevy_ecs::prelude::*;
use ron::value::RawValue;
use serde::de::value::StrDeserializer;
use serde::de::{DeserializeSeed, Deserializer, EnumAccess, MapAccess, VariantAccess, Visitor};
use serde::forward_to_deserialize_any;
use std::fmt;

/// The value of a field.
pub trait Value: Send + Sync {
    fn check(&self) -> Result<(), String>;

    /// Name of the field, if it makes its entity a sensor.
    fn sensor(&self) -> Option<&'static str>;

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
    /// Names of the fields that make the entity a sensor.
    pub fn sensors(&self) -> impl Iterator<Item = &'static str> {
        self.fields.iter().filter_map(|field| field.value.as_ref()?.sensor())
    }

    /// Puts the values of an entity's fields on it.
    pub fn insert(&self, world: &mut World, entity: Entity) {
        self.fields.iter().filter_map(|field| field.value.as_ref()).for_each(|value| value.insert(world, entity));
    }

    /// Puts the values of a scene's fields into the world.
    pub fn insert_into_world(&self, world: &mut World) {
        self.insert(world, Entity::PLACEHOLDER);
    }
}

/// Takes the fields of a struct of a file that are not its own.
pub trait Others {
    /// Takes a field by its name. `own`: the struct's own.
    ///
    /// # Errors
    /// Those of the map; a name that is not known.
    fn take<'de, A: MapAccess<'de>>(
        &mut self,
        name: String,
        own: &'static [&'static str],
        map: &mut A,
    ) -> Result<(), A::Error>;
}

impl Others for Custom {
    fn take<'de, A: MapAccess<'de>>(
        &mut self,
        name: String,
        own: &'static [&'static str],
        map: &mut A,
    ) -> Result<(), A::Error> {
        self.own = own;
        let text = map.next_value()?;
        self.fields.push(Field { name, text, value: None });
        Ok(())
    }
}

/// Reads a struct by what serde has derived for it, but for the fields that it does not have. Of an enum it reads the
/// struct that is its value.
///
/// # Errors
/// Those of the deserializer.
pub fn beside<'de, D: Deserializer<'de>, O: Others + Default, T>(
    deserializer: D,
    derived: impl FnOnce(Beside<'_, D, O>) -> Result<T, D::Error>,
) -> Result<(T, O), D::Error> {
    let mut others = O::default();
    let value = derived(Beside { inner: deserializer, own: &[], others: &mut others })?;
    Ok((value, others))
}

/// A deserializer, or a part of one, that hands on the fields which the struct does not have.
pub struct Beside<'a, I, O> {
    inner: I,
    own: &'static [&'static str],
    others: &'a mut O,
}

impl<'de, D: Deserializer<'de>, O: Others> Deserializer<'de> for Beside<'_, D, O> {
    type Error = D::Error;

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        name: &'static str,
        own: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, D::Error> {
        self.inner.deserialize_struct(name, own, Beside { inner: visitor, own, others: self.others })
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        name: &'static str,
        variants: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, D::Error> {
        self.inner.deserialize_enum(name, variants, Beside { inner: visitor, own: &[], others: self.others })
    }

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, D::Error> {
        self.inner.deserialize_any(visitor)
    }

    forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf option unit unit_struct
        newtype_struct seq tuple tuple_struct map identifier ignored_any
    }
}

impl<'de, V: Visitor<'de>, O: Others> Visitor<'de> for Beside<'_, V, O> {
    type Value = V::Value;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        self.inner.expecting(f)
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<V::Value, A::Error> {
        self.inner.visit_map(Beside { inner: map, own: self.own, others: self.others })
    }

    fn visit_enum<A: EnumAccess<'de>>(self, data: A) -> Result<V::Value, A::Error> {
        self.inner.visit_enum(Beside { inner: data, own: self.own, others: self.others })
    }
}

impl<'de, 'a, A: EnumAccess<'de>, O: Others> EnumAccess<'de> for Beside<'a, A, O> {
    type Error = A::Error;
    type Variant = Beside<'a, A::Variant, O>;

    fn variant_seed<S: DeserializeSeed<'de>>(self, seed: S) -> Result<(S::Value, Self::Variant), A::Error> {
        let (value, variant) = self.inner.variant_seed(seed)?;
        Ok((value, Beside { inner: variant, own: self.own, others: self.others }))
    }
}

impl<'de, A: VariantAccess<'de>, O: Others> VariantAccess<'de> for Beside<'_, A, O> {
    type Error = A::Error;

    fn unit_variant(self) -> Result<(), A::Error> {
        self.inner.unit_variant()
    }

    fn newtype_variant_seed<S: DeserializeSeed<'de>>(self, seed: S) -> Result<S::Value, A::Error> {
        self.inner.newtype_variant_seed(Beside { inner: seed, own: self.own, others: self.others })
    }

    fn tuple_variant<V: Visitor<'de>>(self, length: usize, visitor: V) -> Result<V::Value, A::Error> {
        self.inner.tuple_variant(length, visitor)
    }

    fn struct_variant<V: Visitor<'de>>(self, own: &'static [&'static str], visitor: V) -> Result<V::Value, A::Error> {
        self.inner.struct_variant(own, Beside { inner: visitor, own, others: self.others })
    }
}

impl<'de, S: DeserializeSeed<'de>, O: Others> DeserializeSeed<'de> for Beside<'_, S, O> {
    type Value = S::Value;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<S::Value, D::Error> {
        self.inner.deserialize(Beside { inner: deserializer, own: self.own, others: self.others })
    }
}

impl<'de, A: MapAccess<'de>, O: Others> MapAccess<'de> for Beside<'_, A, O> {
    type Error = A::Error;

    fn next_key_seed<K: DeserializeSeed<'de>>(&mut self, seed: K) -> Result<Option<K::Value>, A::Error> {
        while let Some(key) = self.inner.next_key_seed(Key { own: self.own })? {
            match key {
                Ok(own) => return seed.deserialize(StrDeserializer::new(own)).map(Some),
                Err(name) => self.others.take(name, self.own, &mut self.inner)?,
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
