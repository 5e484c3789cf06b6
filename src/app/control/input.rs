//! Keys and pointer: what they do, in one table each, and what a pointer is doing now.
//!
//! [`KEYS`] drives the handling of keys, the help in the panel and the documentation.

use glam::{Vec2, Vec3};
use winit::event::{KeyEvent, MouseButton};
use winit::keyboard::{Key, KeyCode, ModifiersState, NamedKey, PhysicalKey};

/// Commands of keys.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Command {
    /// Stops the clock, or starts it.
    Pause,
    /// One step of a stopped clock.
    Step,
    /// Twice as fast.
    Faster,
    /// Half as fast.
    Slower,
    /// Bump mapping off, or as before.
    ToggleBump,
    /// The next mesh variant of every entity that has some.
    NextMeshVariant,
    /// The next debug view.
    NextDebugView,
    /// The next camera of the scene.
    NextCamera,
    /// Lines from the selected object to its lights, or none.
    ToggleLightLines,
    /// Shadows, or none.
    ToggleShadows,
    /// The selected light on, or off.
    ToggleLight,
    /// Manual control of a vehicle on, or off.
    Drive,
    /// The driven vehicle's head lamps: off, low, high.
    Headlights,
    /// The driven vehicle's left indicators.
    IndicateLeft,
    /// The driven vehicle's right indicators.
    IndicateRight,
    /// Thumbnails of all sensors, or none.
    ToggleThumbnails,
    /// Frusta and beams of sensors, or none.
    ToggleBeams,
    /// Back to the scene's camera.
    ResetCamera,
    /// Shows the panel, or hides it.
    TogglePanel,
    /// Shows the keys in the panel, or hides them.
    ToggleHelp,
    /// Writes what is seen to a file.
    SavePicture,
    /// Writes the state of the simulation to a file.
    SaveSnapshot,
    /// Closes the window.
    Quit,
}

/// Keys with what they do.
#[derive(Debug)]
pub struct KeyBinding {
    /// Any of these; named as on an English keyboard.
    pub keys: &'static [&'static str],
    /// Carried out when one is pressed.
    pub command: Command,
    /// For people.
    pub help: &'static str,
}

const fn key(keys: &'static [&'static str], command: Command, help: &'static str) -> KeyBinding {
    KeyBinding { keys, command, help }
}

/// All keys of the window.
pub const KEYS: [KeyBinding; 23] = [
    key(&["Space"], Command::Pause, "pause, resume"),
    key(&[".", "N"], Command::Step, "one step, while paused"),
    key(&["+", "="], Command::Faster, "faster"),
    key(&["-"], Command::Slower, "slower"),
    key(&["B"], Command::ToggleBump, "bump mapping on, off"),
    key(&["F"], Command::NextMeshVariant, "next mesh variant"),
    key(&["V"], Command::NextDebugView, "next debug view"),
    key(&["L"], Command::ToggleLightLines, "lines to an object's lights on, off"),
    key(&["X"], Command::ToggleShadows, "shadows on, off"),
    key(&["O"], Command::ToggleLight, "the selected light on, off"),
    key(&["C"], Command::NextCamera, "next camera: the scene's, and those that follow a vehicle"),
    key(&["G"], Command::Drive, "manual control of the selected or nearest vehicle on, off"),
    key(&["K"], Command::Headlights, "its head lamps: off, low, high"),
    key(&["["], Command::IndicateLeft, "its indicators, left"),
    key(&["]"], Command::IndicateRight, "its indicators, right"),
    key(&["T"], Command::ToggleThumbnails, "thumbnails of all sensors on, off"),
    key(&["M"], Command::ToggleBeams, "frusta and beams of sensors on, off"),
    key(&["R"], Command::ResetCamera, "back to the scene's camera"),
    key(&["Tab"], Command::TogglePanel, "show or hide the panel"),
    key(&["H", "F1"], Command::ToggleHelp, "show or hide this list"),
    key(&["P", "F12"], Command::SavePicture, "save a picture"),
    key(&["F5"], Command::SaveSnapshot, "save a snapshot of the state"),
    key(&["Esc"], Command::Quit, "back from a sensor in full size; close the window"),
];

/// Actions of the pointer, and the keys that go with it.
pub const POINTER: [(&str, &str); 7] = [
    ("click", "select an object"),
    ("left drag", "turn about the point under it"),
    ("middle drag, Shift + left drag", "move sideways"),
    ("wheel", "nearer, farther"),
    ("right drag", "look around"),
    ("right held + W A S D Q E", "fly; faster with Shift"),
    ("arrow keys", "drive the vehicle under manual control"),
];

/// The binding of a key press, if any. A repeated press counts only where repeating makes sense.
pub fn command_of(event: &KeyEvent, modifiers: ModifiersState) -> Option<Command> {
    if modifiers.control_key() || modifiers.alt_key() || modifiers.super_key() {
        return None;
    }
    let bound = |name: String| KEYS.iter().find(|binding| binding.keys.contains(&name.as_str()));
    // By the letter on the key; where a layout has no Latin letters, by its place on an English keyboard.
    let binding =
        logical_name(&event.logical_key).and_then(bound).or_else(|| latin(event.physical_key).and_then(bound))?;
    let repeats = matches!(binding.command, Command::Step | Command::Faster | Command::Slower);
    (repeats || !event.repeat).then_some(binding.command)
}

fn logical_name(key: &Key) -> Option<String> {
    match key {
        Key::Character(text) => Some(text.to_uppercase()),
        Key::Named(NamedKey::Space) => Some("Space".into()),
        Key::Named(NamedKey::Tab) => Some("Tab".into()),
        Key::Named(NamedKey::Escape) => Some("Esc".into()),
        Key::Named(NamedKey::F1) => Some("F1".into()),
        Key::Named(NamedKey::F5) => Some("F5".into()),
        Key::Named(NamedKey::F12) => Some("F12".into()),
        _ => None,
    }
}

/// The letter of a key called `KeyB` and the like.
fn latin(key: PhysicalKey) -> Option<String> {
    let PhysicalKey::Code(code) = key else { return None };
    format!("{code:?}").strip_prefix("Key").map(str::to_owned)
}

/// Kinds of drags.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Gesture {
    /// Left: turn about the pivot; a click where the pointer stays.
    Orbit,
    /// Middle, or left with Shift.
    Pan,
    /// Right.
    Look,
}

/// State of the pointer over the scene. Pixels.
#[derive(Clone, Debug, Default)]
pub struct Pointer {
    /// Position; `None` outside the window.
    pub at: Option<Vec2>,
    /// The button that drags, and what it does.
    pub drag: Option<(MouseButton, Gesture)>,
    /// Length of the drag.
    travelled: f32,
    /// The keys that fly, by place: W A S D Q E.
    flying: [bool; 6],
}

/// A drag that went less far is a click.
const CLICK_PIXELS: f32 = 4.0;

const FLY_KEYS: [(KeyCode, Vec3); 6] = [
    (KeyCode::KeyW, Vec3::NEG_Z),
    (KeyCode::KeyA, Vec3::NEG_X),
    (KeyCode::KeyS, Vec3::Z),
    (KeyCode::KeyD, Vec3::X),
    (KeyCode::KeyQ, Vec3::NEG_Y),
    (KeyCode::KeyE, Vec3::Y),
];

impl Pointer {
    /// A button goes down over the scene; the gesture that begins, unless another is under way.
    pub fn press(&mut self, button: MouseButton, shift: bool) -> Option<Gesture> {
        let gesture = match button {
            MouseButton::Left if shift => Gesture::Pan,
            MouseButton::Left => Gesture::Orbit,
            MouseButton::Middle => Gesture::Pan,
            MouseButton::Right => Gesture::Look,
            _ => return None,
        };
        if self.drag.is_some() {
            return None;
        }
        self.drag = Some((button, gesture));
        self.travelled = 0.0;
        Some(gesture)
    }

    /// A button goes up; the gesture that ends, and whether it was a click.
    pub fn release(&mut self, button: MouseButton) -> Option<(Gesture, bool)> {
        let (_, gesture) = self.drag.take_if(|(held, _)| *held == button)?;
        self.flying = Default::default();
        Some((gesture, self.travelled < CLICK_PIXELS))
    }

    /// Forgets the drag and the keys: the window lost the focus.
    pub fn release_all(&mut self) {
        self.drag = None;
        self.flying = Default::default();
    }

    /// The pointer moves; by how much a drag should move, which is nothing while it may still become a click.
    pub fn moved(&mut self, to: Vec2) -> Option<(Gesture, Vec2)> {
        let by = to - self.at.replace(to).unwrap_or(to);
        self.dragged(by)
    }

    /// The mouse moves by itself, whether the pointer can or not.
    pub fn dragged(&mut self, by: Vec2) -> Option<(Gesture, Vec2)> {
        let (_, gesture) = self.drag?;
        self.travelled += by.length();
        (self.travelled >= CLICK_PIXELS || gesture == Gesture::Look).then_some((gesture, by))
    }

    /// Takes note of a key; `true` if it is one that flies now.
    pub fn fly_key(&mut self, key: PhysicalKey, pressed: bool) -> bool {
        let Some(index) = FLY_KEYS.iter().position(|(code, _)| key == PhysicalKey::Code(*code)) else { return false };
        let looking = matches!(self.drag, Some((_, Gesture::Look)));
        self.flying[index] = pressed && looking;
        looking
    }

    /// Direction of flight by the keys held, in the camera's axes.
    pub fn fly_direction(&self) -> Vec3 {
        FLY_KEYS.iter().zip(self.flying).filter(|(_, held)| *held).map(|((_, direction), _)| *direction).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_key_is_bound_twice() {
        let mut keys: Vec<&str> = KEYS.iter().flat_map(|binding| binding.keys).copied().collect();
        let count = keys.len();
        keys.sort_unstable();
        keys.dedup();
        assert_eq!(keys.len(), count);
    }

    #[test]
    fn keys_are_named_as_the_table_names_them() {
        assert_eq!(logical_name(&Key::Character("b".into())).as_deref(), Some("B"));
        assert_eq!(logical_name(&Key::Named(NamedKey::Escape)).as_deref(), Some("Esc"));
        assert_eq!(latin(PhysicalKey::Code(KeyCode::KeyB)).as_deref(), Some("B"));
        assert_eq!(latin(PhysicalKey::Code(KeyCode::Backspace)), None);
    }

    #[test]
    fn a_press_that_hardly_moves_is_a_click_and_drags_nothing() {
        let mut pointer = Pointer::default();
        pointer.moved(Vec2::new(10.0, 10.0));
        assert_eq!(pointer.press(MouseButton::Left, false), Some(Gesture::Orbit));
        assert_eq!(pointer.moved(Vec2::new(11.0, 11.0)), None);
        assert_eq!(pointer.release(MouseButton::Left), Some((Gesture::Orbit, true)));

        pointer.press(MouseButton::Left, true);
        assert_eq!(pointer.moved(Vec2::new(21.0, 11.0)), Some((Gesture::Pan, Vec2::new(10.0, 0.0))));
        assert_eq!(pointer.press(MouseButton::Right, false), None, "one gesture at a time");
        assert_eq!(pointer.release(MouseButton::Right), None);
        assert_eq!(pointer.release(MouseButton::Left), Some((Gesture::Pan, false)));
    }

    #[test]
    fn keys_fly_only_while_looking_and_stop_with_it() {
        let w = PhysicalKey::Code(KeyCode::KeyW);
        let mut pointer = Pointer::default();
        assert!(!pointer.fly_key(w, true));
        assert_eq!(pointer.fly_direction(), Vec3::ZERO);
        pointer.press(MouseButton::Right, false);
        assert!(pointer.fly_key(w, true));
        assert_eq!(pointer.fly_direction(), Vec3::NEG_Z);
        pointer.release(MouseButton::Right);
        assert_eq!(pointer.fly_direction(), Vec3::ZERO);
    }
}
