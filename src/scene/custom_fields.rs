//! Fields of scene files that a program of yours adds: of entities ([`EntityField`]), and of the whole scene
//! ([`SceneField`]).
//!
//! What a struct of the file has beside its own fields is kept as text while the file is parsed. [`read`] then looks up
//! each name and parses the text as the type that is registered. An error there is told as if it were one of the first
//! pass, with its place in the file.

use super::faults::{Fault, Trail, suggestion};
use super::format::{Entity as Source, Scene};
use super::places::{self, Step};
use super::slips::{self, Slip};
use bevy_ecs::prelude::*;
use ron::error::SpannedError;
use ron::value::RawValue;
use serde::de::value::StrDeserializer;
use serde::de::{DeserializeOwned, DeserializeSeed, Deserializer, MapAccess, Visitor};
use serde::forward_to_deserialize_any;
use std::fmt;

/// A field of entities in scene files: at their top level, in `children`, in `attach`, and in generators, where each
/// copy gets the value.
///
/// ```
/// use relief::prelude::*;
/// use relief::scene::{self, EntityField, SceneFields};
///
/// /// Comes up and goes down.
/// #[derive(Component, serde::Deserialize, Clone)]
/// #[serde(deny_unknown_fields)]
/// struct Buoy { metres: f32 }
///
/// impl EntityField for Buoy {
///     const NAME: &'static str = "buoy";
///
///     fn check(&self) -> Result<(), String> {
///         let is_sound = (0.0..=10.0).contains(&self.metres);
///         is_sound.then_some(()).ok_or_else(|| format!("expected metres from 0 to 10, found {}", self.metres))
///     }
///
///     fn insert(&self, entity: &mut EntityWorldMut) {
///         entity.insert(self.clone());
///     }
/// }
///
/// let folder = tempfile::tempdir()?;
/// let path = folder.path().join("sea.ron");
/// std::fs::write(&path, "(entities: [(name: \"red\", buoy: (metres: 0.5))])")?;
/// let mut simulation = Simulation::new();
/// simulation.world.init_resource::<SceneFields>();
/// simulation.world.resource_mut::<SceneFields>().register::<Buoy>();
/// scene::load(&path, &mut simulation)?;
/// assert_eq!(simulation.world.query::<&Buoy>().single(&simulation.world)?.metres, 0.5);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub trait EntityField: DeserializeOwned + Send + Sync + 'static {
    /// The field's name: an identifier that no other field of entities has.
    const NAME: &'static str;

    /// Whether the value makes sense.
    ///
    /// # Errors
    /// A line that says what was expected; the scene is refused with it, and with the field's place.
    fn check(&self) -> Result<(), String> {
        Ok(())
    }

    /// Puts the value on the entity, which has all that its other fields give it, but for children.
    fn insert(&self, entity: &mut EntityWorldMut);
}

/// A field of whole scenes.
pub trait SceneField: DeserializeOwned + Send + Sync + 'static {
    /// The field's name: an identifier that no other field of scenes has.
    const NAME: &'static str;

    /// Whether the value makes sense.
    ///
    /// # Errors
    /// A line that says what was expected; the scene is refused with it, and with the field's place.
    fn check(&self) -> Result<(), String> {
        Ok(())
    }

    /// Puts the value into the world, before any entity of the scene is there.
    fn insert(&self, world: &mut World);
}

/// The fields that a program adds to scene files. Loading a scene asks the world for them.
#[derive(Resource, Clone, Debug, Default)]
pub struct SceneFields {
    of_entities: Vec<Known>,
    of_scenes: Vec<Known>,
}

impl SceneFields {
    /// Adds a field to entities.
    ///
    /// # Panics
    /// If entities have a field of that name, or it is no name of a field.
    pub fn register<T: EntityField>(&mut self) {
        let read = |text: &str| Ok(Box::new(OfEntity(super::from_ron::<T>(text)?)) as Box<dyn Value>);
        add(&mut self.of_entities, Known { name: T::NAME, read }, |text| Some(parsed::<Source>(text)?.custom));
    }

    /// Adds a field to scenes.
    ///
    /// # Panics
    /// If scenes have a field of that name, or it is no name of a field.
    pub fn register_for_scene<T: SceneField>(&mut self) {
        let read = |text: &str| Ok(Box::new(OfScene(super::from_ron::<T>(text)?)) as Box<dyn Value>);
        add(&mut self.of_scenes, Known { name: T::NAME, read }, |text| Some(parsed::<Scene>(text)?.custom));
    }
}

fn parsed<T: DeserializeOwned>(text: &str) -> Option<T> {
    super::from_ron(text).ok()
}

fn add(all: &mut Vec<Known>, field: Known, custom: fn(&str) -> Option<Custom>) {
    let name = field.name;
    assert!(all.iter().all(|known| known.name != name), "{name} is a field already");
    let is_free =
        custom(&format!("({name}: ())")).is_some_and(|custom| matches!(&*custom.fields, [field] if field.name == name));
    assert!(is_free, "{name} is a field already, or not an identifier");
    all.push(field);
}

/// A registered field.
#[derive(Clone, Copy, Debug)]
struct Known {
    name: &'static str,
    read: fn(&str) -> Result<Box<dyn Value>, SpannedError>,
}

/// What a field holds.
trait Value: Send + Sync {
    fn check(&self) -> Result<(), String>;

    /// The entity is that of the field, if it is one of entities.
    fn insert(&self, world: &mut World, entity: Entity);
}

struct OfEntity<T>(T);

impl<T: EntityField> Value for OfEntity<T> {
    fn check(&self) -> Result<(), String> {
        self.0.check()
    }

    fn insert(&self, world: &mut World, entity: Entity) {
        self.0.insert(&mut world.entity_mut(entity));
    }
}

struct OfScene<T>(T);

impl<T: SceneField> Value for OfScene<T> {
    fn check(&self) -> Result<(), String> {
        self.0.check()
    }

    fn insert(&self, world: &mut World, _: Entity) {
        self.0.insert(world);
    }
}

/// What a struct of a file has beside its own fields, in the order of the file.
#[derive(Default)]
pub struct Custom {
    /// The struct's own fields.
    own: &'static [&'static str],
    fields: Vec<Field>,
}

struct Field {
    name: String,
    text: Box<RawValue>,
    /// Once it was read.
    value: Option<Box<dyn Value>>,
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

/// Reads the fields that the program has added to a scene. Returns those whose values make no sense.
///
/// # Errors
/// The first name that is not known or is there twice, and the first value that is not of its field's type.
pub fn read(scene: &mut Scene, fields: &SceneFields, text: &str) -> Result<Vec<Fault>, Slip> {
    let mut reader = Reader { fields, text, faults: Vec::new() };
    let top = Trail::default();
    reader.custom(&mut scene.custom, &fields.of_scenes, &top)?;
    reader.entities(&mut scene.entities, &top.field("entities"))?;
    for (i, generator) in scene.generators.iter_mut().enumerate() {
        let at = top.field("generators").enter(Step::Index(i), "").field("entity");
        reader.entity(&mut generator.entity, &at)?;
    }
    Ok(reader.faults)
}

/// As [`read`], of a list of entities.
///
/// # Errors
/// As [`read`].
pub fn read_entities(entities: &mut [Source], fields: &SceneFields, text: &str) -> Result<Vec<Fault>, Slip> {
    let mut reader = Reader { fields, text, faults: Vec::new() };
    reader.entities(entities, &Trail::default())?;
    Ok(reader.faults)
}

struct Reader<'a> {
    fields: &'a SceneFields,
    text: &'a str,
    faults: Vec<Fault>,
}

impl Reader<'_> {
    fn entities(&mut self, entities: &mut [Source], at: &Trail) -> Result<(), Slip> {
        entities.iter_mut().enumerate().try_for_each(|(i, entity)| self.entity(entity, &at.enter(Step::Index(i), "")))
    }

    fn entity(&mut self, entity: &mut Source, at: &Trail) -> Result<(), Slip> {
        self.custom(&mut entity.custom, &self.fields.of_entities, at)?;
        self.entities(&mut entity.children, &at.field("children"))?;
        self.entities(&mut entity.attach, &at.field("attach"))
    }

    fn custom(&mut self, custom: &mut Custom, known: &[Known], at: &Trail) -> Result<(), Slip> {
        for i in 0..custom.fields.len() {
            let (before, rest) = custom.fields.split_at_mut(i);
            let [Field { name, text, value }, ..] = rest else { break };
            let earlier = before.iter().filter(|field| field.name == *name).count();
            let slip = |message: String| {
                let offset = places::find_name(self.text, at.steps(), name, earlier);
                Slip { line_column: places::line_column(self.text, offset), place: String::new(), message }
            };
            if earlier > 0 {
                return Err(slip(format!("duplicate field {name:?}")));
            }
            let Some(Known { name, read }) = known.iter().find(|known| known.name == *name) else {
                let names: Vec<&str> = custom.own.iter().copied().chain(known.iter().map(|known| known.name)).collect();
                return Err(slip(format!("unknown field {name:?}{}", suggestion(name, &names))));
            };
            let at = at.field(name);
            let read = read(text.get_ron()).map_err(|error| self.slip(&at, text.get_ron(), error))?;
            self.faults.extend(read.check().err().map(|message| at.fault(message)));
            *value = Some(read);
        }
        Ok(())
    }

    /// An error in the text of a field, which is at a place of the file.
    fn slip(&self, at: &Trail, text: &str, error: SpannedError) -> Slip {
        let within = places::offset(text, (error.span.start.line, error.span.start.col));
        let begin = places::token_after(text, 0);
        let offset = places::find_offset(self.text, at.steps()) + within.saturating_sub(begin);
        // The text ends behind the field's value, where the file goes on.
        let code = if error.code == ron::Error::TrailingCharacters { ron::Error::ExpectedComma } else { error.code };
        slips::explain_at(self.text, offset, &code)
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
