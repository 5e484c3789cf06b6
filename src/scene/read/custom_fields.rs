//! Fields of scene files that a program of yours adds: of entities ([`EntityField`]), and of the whole scene
//! ([`SceneField`]).
//!
//! Fields of the file beside a struct's own are text ([`Custom`]). [`read`] looks up each name and parses the text as
//! the type that is registered. An error there is told as if it were one of the first pass, with its place in the file.

use crate::scene::format::custom::{Custom, Field, Value};
use crate::scene::format::entities::Entity as Source;
use crate::scene::format::scene::Scene;
use crate::scene::text::faults::suggestion;
use crate::scene::text::parse::from_ron;
use crate::scene::text::places;
use crate::scene::text::slips::{self, Slip};
use bevy_ecs::prelude::*;
use ron::error::SpannedError;
use serde::de::DeserializeOwned;
use systems::describe::Step;
use systems::describe::{Fault, Trail};

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
///         let is_valid = (0.0..=10.0).contains(&self.metres);
///         is_valid.then_some(()).ok_or_else(|| format!("expected metres from 0 to 10, found {}", self.metres))
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
    /// True of a field that makes its entity a sensor, which has a name and no other such field.
    const IS_SENSOR: bool = false;

    /// Checks that the value makes sense.
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

    /// Checks that the value makes sense.
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
        let read = |text: &str| Ok(Box::new(OfEntity(from_ron::<T>(text)?)) as Box<dyn Value>);
        add(&mut self.of_entities, Known { name: T::NAME, read }, |text| Some(parsed::<Source>(text)?.custom));
    }

    /// Adds a field to scenes.
    ///
    /// # Panics
    /// If scenes have a field of that name, or it is no name of a field.
    pub fn register_for_scene<T: SceneField>(&mut self) {
        let read = |text: &str| Ok(Box::new(OfScene(from_ron::<T>(text)?)) as Box<dyn Value>);
        add(&mut self.of_scenes, Known { name: T::NAME, read }, |text| Some(parsed::<Scene>(text)?.custom));
    }
}

fn parsed<T: DeserializeOwned>(text: &str) -> Option<T> {
    from_ron(text).ok()
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

struct OfEntity<T>(T);

impl<T: EntityField> Value for OfEntity<T> {
    fn check(&self) -> Result<(), String> {
        self.0.check()
    }

    fn sensor(&self) -> Option<&'static str> {
        T::IS_SENSOR.then_some(T::NAME)
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

    fn sensor(&self) -> Option<&'static str> {
        None
    }

    fn insert(&self, world: &mut World, _: Entity) {
        self.0.insert(world);
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

/// Does the same as [`read`] for a list of entities.
///
/// # Errors
/// Those of [`read`].
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
