//! Inputs: changes of the world from outside. They are the only way from a window, a recording or a program into a
//! running simulation. So a recording of the inputs is a recording of the run.
//!
//! [`Inputs::push`] queues; [`apply_queued`] applies, between steps: the first system of the step schedule does it, and
//! a window does it in every frame, so that an edit shows while the clock stands. Nothing happens between two steps
//! that steps read, so it makes no difference when between them an input comes.
//!
//! Types of inputs are registered by name ([`Inputs::register`]), those of [`super::standard_inputs`] and those of a
//! program of yours alike. An input is queued as bytes, and applied from them: in a replay it comes from the same.

use super::state::{decode, encode};
use bevy_ecs::prelude::*;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::any::TypeId;

/// A type of input: a change from outside.
///
/// Entities within it are [`StateId`](super::registry::StateId)s, which mean the same in every run. Recordings hold its
/// values as [postcard](https://docs.rs/postcard) writes them, which reads no `serde(flatten)`, `untagged` or
/// `skip_serializing_if`. A recording may come from anyone, so a type must not contain itself: values could be nested
/// without end.
///
/// ```
/// use bevy_ecs::prelude::*;
/// use systems::Simulation;
/// use systems::run::inputs::{Input, Inputs};
/// use systems::run::registry::{EntityRegistry, StateId};
/// use systems::space::Transform;
///
/// #[derive(serde::Serialize, serde::Deserialize)]
/// struct Lift { entity: StateId, metres: f32 }
///
/// impl Input for Lift {
///     const NAME: &'static str = "lift";
///
///     fn apply(&self, world: &mut World) {
///         let Some(entity) = world.resource::<EntityRegistry>().entity(self.entity) else { return };
///         if let Some(mut place) = world.get_mut::<Transform>(entity) {
///             place.translation.y += self.metres;
///         }
///     }
///
///     fn is_valid(&self) -> bool {
///         self.metres.is_finite()
///     }
/// }
///
/// let mut simulation = Simulation::new();
/// simulation.world.resource_mut::<Inputs>().register::<Lift>();
/// simulation.world.resource_mut::<Inputs>().push(Lift { entity: StateId(0), metres: 2.0 });
/// ```
pub trait Input: Serialize + DeserializeOwned + Send + Sync + 'static {
    /// Its name in recordings, which no other type has.
    const NAME: &'static str;

    /// Changes the world, by nothing but the value and the state. An input that names an entity that is gone, or has no
    /// such component, changes nothing. What it queues is applied right after it.
    fn apply(&self, world: &mut World);

    /// Tells if its numbers can be what a world holds. Others are not applied.
    fn is_valid(&self) -> bool {
        true
    }
}

/// An input as recordings hold it.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub struct SavedInput {
    /// Name of its type, [`Input::NAME`].
    pub name: String,
    /// Its value.
    pub value: Vec<u8>,
}

impl SavedInput {
    /// An input's.
    pub fn of<T: Input>(input: &T) -> Self {
        let value = encode(input);
        debug_assert!(decode::<T>(T::NAME, &value).is_ok(), "input {:?} cannot be read as it is written", T::NAME);
        Self { name: T::NAME.to_owned(), value }
    }
}

/// Reason for which an input of a file is refused.
#[derive(Debug, thiserror::Error)]
pub enum InputError {
    /// No type of that name is registered.
    #[error("unknown input {0:?}, which this program does not register")]
    Unknown(String),
    /// Its bytes are no value of its type, or one that is not sound.
    #[error("input {name:?}: {message}")]
    Invalid {
        /// Its type's.
        name: &'static str,
        /// Description of the fault.
        message: String,
    },
}

/// Letters of an unknown name that a message shows.
pub(super) const MOST_SHOWN: usize = 60;

/// A registered type.
#[derive(Clone, Copy, Debug)]
struct InputType {
    name: &'static str,
    id: TypeId,
    check: fn(&[u8]) -> Result<(), InputError>,
    apply: fn(&mut World, &[u8]) -> Result<(), InputError>,
}

fn read<T: Input>(bytes: &[u8]) -> Result<T, InputError> {
    let invalid = |message: String| InputError::Invalid { name: T::NAME, message };
    let input: T = decode(T::NAME, bytes).map_err(|error| invalid(error.message))?;
    if input.is_valid() { Ok(input) } else { Err(invalid("invalid value".into())) }
}

/// The types of inputs that there are, and inputs that wait for the time between two steps.
#[derive(Resource, Debug)]
pub struct Inputs {
    types: Vec<InputType>,
    queued: Vec<SavedInput>,
}

impl Inputs {
    /// Without any type.
    pub(super) fn empty() -> Self {
        Self { types: Vec::new(), queued: Vec::new() }
    }

    /// Makes a type known: from then on it can be pushed, and recordings that hold it are replayed.
    ///
    /// # Panics
    /// If there is a type of that name: its values would be taken for the other's.
    pub fn register<T: Input>(&mut self) {
        assert!(self.find(T::NAME).is_none(), "{} is an input already", T::NAME);
        self.types.push(InputType {
            name: T::NAME,
            id: TypeId::of::<T>(),
            check: |bytes| read::<T>(bytes).map(drop),
            apply: |world, bytes| read::<T>(bytes).map(|input| input.apply(world)),
        });
    }

    /// Queues an input.
    ///
    /// # Panics
    /// If its type is not registered.
    pub fn push<T: Input>(&mut self, input: T) {
        let is_known = self.find(T::NAME).is_some_and(|known| known.id == TypeId::of::<T>());
        assert!(is_known, "input {:?} is not registered: call Inputs::register first", T::NAME);
        self.push_saved(SavedInput::of(&input));
    }

    /// Queues an input of a recording. One that [`Self::check`] refuses changes nothing.
    pub fn push_saved(&mut self, input: SavedInput) {
        self.queued.push(input);
    }

    /// Checks that an input of a recording can be applied.
    ///
    /// # Errors
    /// Its type is not registered, or its bytes are none of its type's.
    pub fn check(&self, input: &SavedInput) -> Result<(), InputError> {
        let unknown = || InputError::Unknown(input.name.chars().take(MOST_SHOWN).collect());
        (self.find(&input.name).ok_or_else(unknown)?.check)(&input.value)
    }

    /// Tells if nothing waits.
    pub fn is_empty(&self) -> bool {
        self.queued.is_empty()
    }

    /// Forgets what is queued.
    pub fn clear(&mut self) {
        self.queued.clear();
    }

    fn find(&self, name: &str) -> Option<&InputType> {
        self.types.iter().find(|known| known.name == name)
    }
}

/// Applies what is queued, in order, and returns what was applied. What an input queues itself is applied right after
/// it, and not returned: in a replay that input queues it again.
pub fn apply_queued(world: &mut World) -> Vec<SavedInput> {
    let mut queued = take_queued(world);
    queued.retain(|input| {
        let is_applied = apply(world, input);
        let mut follow = take_queued(world);
        while !follow.is_empty() {
            follow.iter().for_each(|input| _ = apply(world, input));
            follow = take_queued(world);
        }
        is_applied
    });
    queued
}

fn take_queued(world: &mut World) -> Vec<SavedInput> {
    if world.resource::<Inputs>().is_empty() {
        return Vec::new();
    }
    std::mem::take(&mut world.resource_mut::<Inputs>().queued)
}

/// Applies an input; false if it cannot be applied.
fn apply(world: &mut World, input: &SavedInput) -> bool {
    let known = world.resource::<Inputs>().find(&input.name).copied();
    known.is_some_and(|known| (known.apply)(world, &input.value).is_ok())
}

/// The first system of a step.
pub(crate) fn apply_inputs(world: &mut World) {
    apply_queued(world);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::standard_inputs::{Despawn, NextMeshVariant};

    #[derive(Serialize, Deserialize)]
    struct Other;

    impl Input for Other {
        const NAME: &'static str = NextMeshVariant::NAME;

        fn apply(&self, _: &mut World) {}
    }

    #[test]
    #[should_panic(expected = "next figure is an input already")]
    fn a_name_is_registered_once() {
        Inputs::default().register::<Other>();
    }

    #[test]
    #[should_panic(expected = "input \"next figure\" is not registered")]
    fn a_type_that_is_not_registered_cannot_be_pushed() {
        Inputs::default().push(Other);
    }

    /// Queues itself until it is 0.
    #[derive(Serialize, Deserialize)]
    struct CountDown(u8);

    #[derive(Resource, Default)]
    struct Counted(Vec<u8>);

    impl Input for CountDown {
        const NAME: &'static str = "count down";

        fn apply(&self, world: &mut World) {
            world.resource_mut::<Counted>().0.push(self.0);
            if let Some(next) = self.0.checked_sub(1) {
                world.resource_mut::<Inputs>().push(Self(next));
            }
        }
    }

    #[test]
    fn what_an_input_queues_follows_it_at_once_and_is_not_recorded() {
        let mut world = World::new();
        world.init_resource::<Counted>();
        let mut inputs = Inputs::default();
        inputs.register::<CountDown>();
        inputs.push(CountDown(2));
        inputs.push(CountDown(1));
        world.insert_resource(inputs);
        let wanted = [CountDown(2), CountDown(1)].map(|input| SavedInput::of(&input));
        assert_eq!(apply_queued(&mut world), wanted);
        assert_eq!(world.resource::<Counted>().0, [2, 1, 0, 1, 0]);
        assert!(world.resource::<Inputs>().is_empty());
    }

    #[test]
    fn inputs_of_files_are_checked() {
        let inputs = Inputs::default();
        let input = |name: &str, value: &[u8]| SavedInput { name: name.into(), value: value.into() };
        assert!(inputs.check(&SavedInput::of(&Despawn(crate::run::registry::StateId(300)))).is_ok());
        for (input, expected) in [
            (input("honk", &[]), "unknown input \"honk\", which this program does not register"),
            (input("despawn", &[0x80]), "input \"despawn\": "),
            (input("despawn", &[1, 2]), "input \"despawn\": unexpected data after the end"),
        ] {
            let error = inputs.check(&input).expect_err("refused").to_string();
            assert!(error.starts_with(expected), "{error}");
        }
    }
}
