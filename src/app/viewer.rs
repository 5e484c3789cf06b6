//! State of the viewer: the world, the view's settings, the selection. No window here, and a GPU only where sensors are
//! captured.

use crate::app::control::camera::Controller;
use crate::app::control::driving::{self, Wheel};
use crate::app::control::input::Command;
use crate::app::options::Options;
use crate::app::sensors::views::SensorViews;
use crate::name;
use crate::recording::RecordingError;
use crate::renderer::{DebugView, Settings};
use crate::session::Session;
use crate::viewpoint::Viewpoint;
use bevy_ecs::prelude::*;
use glam::Vec3;
use std::time::{Duration, Instant};
use systems::assets::{Library, Technique, all_bounds};
use systems::draw::View;
use systems::ecs::clock::{Clock, SPEEDS};
use systems::lights::Light;
use systems::run::inputs::{Input, Inputs};
use systems::run::registry::StateId;
use systems::run::standard_inputs::{Drive, EditLight, NextMeshVariant, SetManualControl, push_for};
use systems::sensors::Sensor;
use systems::space::{Aabb, GlobalTransform, Interpolation};
use systems::vehicles::{Controls, Indicator, Motion, Vehicle, VehicleTypes};

/// At most so long the window works on steps before it draws again: slow motion rather than a standstill.
const STEPPING: Duration = Duration::from_millis(30);

/// Metres: nearer than this nothing is turned about.
const NEAREST_PIVOT: f32 = 0.05;

/// Everything that a command can change.
pub struct Viewer {
    /// The world and its run. Its viewpoint is the last one before the camera was moved.
    pub session: Session,
    /// The vehicle that is driven, and the keys held.
    pub driven: Option<Entity>,
    /// The keys that drive.
    pub wheel: Wheel,
    /// The free camera.
    pub controller: Controller,
    /// Render settings; the picked entity is filled in by [`Self::drawn_settings`].
    pub settings: Settings,
    /// Panel is shown.
    pub panel: bool,
    /// Keys are listed in it.
    pub help: bool,
    /// Chosen with a click, in the scene or the list.
    pub selected: Option<Entity>,
    /// Lines lead from the object that is pointed out to its lights.
    pub light_lines: bool,
    /// Under the pointer; kept up only where a debug view points it out.
    pub hovered: Option<Entity>,
    /// Last point picked on an object that was asked about, world space: tells which piece of a large object is meant.
    pub pointed_at: Vec3,
    pub sensors: SensorViews,
    /// Message to the user: a picture saved, or why not.
    pub notice: String,
    /// Technique that B goes back to.
    technique_before_off: Option<Technique>,
}

/// Effect of a command that needs the window.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Effect {
    /// Write a picture of the next frame.
    SavePicture,
    /// Write a snapshot of the state.
    SaveSnapshot,
    /// Close the window.
    Quit,
}

impl Viewer {
    /// The start.
    pub fn new(mut options: Options) -> Self {
        let world = &mut options.session.simulation.world;
        world.insert_resource(Interpolation { enabled: true, fraction: 1.0 });
        if world.query::<&Sensor>().iter(world).next().is_some() {
            // Two renderers draw this world when sensors are looked at, and rays read its texels.
            world.resource_mut::<Library>().keep_texels(true);
        }
        Self {
            session: options.session,
            driven: None,
            wheel: Wheel::default(),
            controller: Controller::default(),
            settings: options.settings,
            panel: options.panel,
            help: false,
            selected: None,
            light_lines: true,
            hovered: None,
            pointed_at: Vec3::ZERO,
            sensors: SensorViews::new(options.settings),
            notice: String::new(),
            technique_before_off: None,
        }
    }

    /// The clock.
    pub fn clock(&mut self) -> Mut<'_, Clock> {
        self.session.simulation.world.resource_mut::<Clock>()
    }

    /// Does what a key asks for; returns what only the window can do.
    pub fn apply(&mut self, command: Command) -> Option<Effect> {
        match command {
            Command::Pause => {
                let mut clock = self.clock();
                clock.paused = !clock.paused;
            }
            Command::Step if self.clock().paused => self.step(),
            Command::Step => {}
            Command::Faster => self.change_speed(2.0),
            Command::Slower => self.change_speed(0.5),
            Command::ToggleBump => self.toggle_bump(),
            // A replay drops it.
            Command::NextMeshVariant => self.keep(|session| {
                session.simulation.world.resource_mut::<Inputs>().push(NextMeshVariant);
                session.apply_inputs()
            }),
            Command::NextDebugView => self.settings.debug = after(&DebugView::ALL, self.settings.debug),
            Command::ToggleLightLines => self.light_lines = !self.light_lines,
            Command::ToggleShadows => {
                let on = Settings::default().shadow_maps;
                self.settings.shadow_maps = if self.settings.shadow_maps == 0 { on } else { 0 };
            }
            Command::ToggleLight => self.toggle_light(),
            Command::NextCamera => self.next_camera(),
            Command::Drive => self.drive(),
            Command::Headlights => self.edit_controls(|c| c.headlights = driving::next_headlights(c.headlights)),
            Command::IndicateLeft => {
                self.edit_controls(|c| c.indicator = driving::toggle_indicator(c.indicator, Indicator::Left))
            }
            Command::IndicateRight => {
                self.edit_controls(|c| c.indicator = driving::toggle_indicator(c.indicator, Indicator::Right))
            }
            Command::ToggleThumbnails => self.toggle_thumbnails(),
            Command::ToggleBeams => self.sensors.beams = !self.sensors.beams,
            Command::ResetCamera => self.controller.reset(),
            Command::TogglePanel => self.panel = !self.panel,
            Command::ToggleHelp => {
                self.help = !(self.help && self.panel);
                self.panel |= self.help;
            }
            Command::SavePicture => return Some(Effect::SavePicture),
            Command::SaveSnapshot => return Some(Effect::SaveSnapshot),
            Command::Quit if self.sensors.full.is_some() => self.sensors.full = None,
            Command::Quit => return Some(Effect::Quit),
        }
        None
    }

    fn change_speed(&mut self, factor: f64) {
        let mut clock = self.clock();
        clock.speed = (clock.speed * factor).clamp(*SPEEDS.start(), *SPEEDS.end());
    }

    fn toggle_bump(&mut self) {
        if self.settings.technique == Some(Technique::Off) {
            self.settings.technique = self.technique_before_off.take();
        } else {
            self.technique_before_off = self.settings.technique.replace(Technique::Off);
        }
    }

    fn toggle_light(&mut self) {
        let Some(entity) = self.selected else { return };
        if let Some(light) = self.session.simulation.world.get::<Light>(entity) {
            let light = Light { enabled: !light.enabled, ..light.clone() };
            self.input(entity, |entity| EditLight { entity, light });
        }
    }

    fn toggle_thumbnails(&mut self) {
        self.sensors.full = None;
        if !self.sensors.toggle_all(&mut self.session.simulation.world) {
            self.notice = "there are no sensors".into();
        }
    }

    fn next_camera(&mut self) {
        let viewpoints = self.viewpoints();
        let now = viewpoints.iter().position(|(_, viewpoint)| *viewpoint == self.session.viewpoint);
        let next = now.map_or(0, |now| (now + 1) % viewpoints.len());
        if let Some((_, viewpoint)) = viewpoints.get(next) {
            self.session.viewpoint = *viewpoint;
        }
        self.controller.reset();
    }

    /// The scene's cameras; and where a vehicle is driven or selected, those that follow it.
    pub fn viewpoints(&self) -> Vec<(String, Viewpoint)> {
        let cameras =
            self.session.scene.cameras.iter().map(|(name, camera)| (name.clone(), Viewpoint::Camera(*camera)));
        let vehicle = self.driven.or(self.session.viewpoint.vehicle()).or_else(|| self.selected_vehicle());
        let follows = vehicle.into_iter().flat_map(|vehicle| {
            let name = name::of_entity(&self.session.simulation.world, vehicle);
            [
                (format!("chase {name}"), Viewpoint::Chase(vehicle)),
                (format!("driver {name}"), Viewpoint::Driver(vehicle)),
            ]
        });
        cameras.chain(follows).collect()
    }

    /// The vehicle that the selected entity is or belongs to.
    pub fn selected_vehicle(&self) -> Option<Entity> {
        let world = &self.session.simulation.world;
        let above = |entity: &Entity| world.get::<ChildOf>(*entity).map(ChildOf::parent);
        // As deep as trees of models go; a ring of parents ends, too.
        std::iter::successors(self.selected, above).take(64).find(|&entity| world.get::<Vehicle>(entity).is_some())
    }

    /// Takes manual control of the selected vehicle, or of the nearest; gives it back if it is taken.
    fn drive(&mut self) {
        if let Some(vehicle) = self.driven.take() {
            self.input(vehicle, |vehicle| SetManualControl { vehicle, manual: false });
            self.wheel = Wheel::default();
            return;
        }
        let eye = self.view((16, 9)).eye();
        let chosen = self.selected_vehicle().or_else(|| {
            let world = &mut self.session.simulation.world;
            let mut vehicles = world.query_filtered::<(Entity, &GlobalTransform), With<Vehicle>>();
            driving::nearest(vehicles.iter(world).map(|(entity, at)| (entity, at.translation())), eye)
        });
        let Some(vehicle) = chosen else {
            self.notice = "there is no vehicle to drive".into();
            return;
        };
        self.input(vehicle, |vehicle| SetManualControl { vehicle, manual: true });
        self.driven = Some(vehicle);
        self.session.viewpoint = Viewpoint::Chase(vehicle);
        self.controller.reset();
    }

    /// Changes the controls of the driven vehicle.
    fn edit_controls(&mut self, edit: impl FnOnce(&mut Controls)) {
        let Some(vehicle) = self.driven else { return };
        let Some(&before) = self.session.simulation.world.get::<Controls>(vehicle) else { return };
        let mut controls = before;
        edit(&mut controls);
        if controls != before {
            self.input(vehicle, |vehicle| Drive { vehicle, controls });
        }
    }

    /// Turns wheel and pedals as the keys are held, for a step.
    fn hold_keys(&mut self) {
        let seconds = self.clock().step_seconds as f32;
        let Some(vehicle) = self.driven else { return };
        let world = &mut self.session.simulation.world;
        let state = world.query::<(&Controls, &Motion, &Vehicle)>().get(world, vehicle).ok();
        let Some((&controls, motion, kind)) = state else {
            self.driven = None;
            return;
        };
        let kind = world.resource::<VehicleTypes>().get(kind.kind);
        let controls = self.wheel.controls(controls, motion, kind, seconds);
        self.edit_controls(|c| *c = controls);
    }

    /// Changes the world from outside: now, between two steps.
    fn input<T: Input>(&mut self, entity: Entity, input: impl FnOnce(StateId) -> T) {
        push_for(&mut self.session.simulation.world, entity, input);
        self.keep(Session::apply_inputs);
    }

    /// Lets real time go by: applies the inputs, and takes the steps that are due, as far as there is time for
    /// them. Returns how many.
    pub fn advance(&mut self, seconds: f64) -> u64 {
        self.keep(Session::apply_inputs);
        let (due, began) = (self.clock().advance(seconds), Instant::now());
        let mut taken = 0;
        while taken < due && !self.clock().paused && (taken == 0 || began.elapsed() < STEPPING) {
            self.step();
            taken += 1;
        }
        let fraction = self.clock().fraction();
        self.session.simulation.world.resource_mut::<Interpolation>().fraction = fraction;
        taken
    }

    /// Brings what is drawn up to date with the state itself, and not, as after [`Self::advance`], between two steps.
    pub fn frame_of_state(&mut self) {
        self.session.simulation.world.resource_mut::<Interpolation>().fraction = 1.0;
        self.session.simulation.frame();
    }

    /// Takes a step. A replay stops where its recording ends.
    fn step(&mut self) {
        self.hold_keys();
        if !self.session.is_at_end() {
            self.keep(Session::step);
            self.sensors.update(&mut self.session.simulation);
        }
        if self.session.is_at_end() && !self.clock().paused {
            self.clock().paused = true;
            self.notice = "the recording ends here".into();
        }
    }

    /// Ends the run in order.
    pub fn finish(&mut self) {
        self.keep(Session::finish);
    }

    /// Does what a recording may have to take note of; says what goes wrong with that, and goes on without it.
    fn keep(&mut self, work: impl FnOnce(&mut Session) -> Result<(), RecordingError>) {
        if let Err(error) = work(&mut self.session) {
            eprintln!("error: {error}");
            self.notice = error.to_string();
            self.session.stop_writing();
            self.clock().paused = true;
        }
    }

    /// View to draw.
    pub fn view(&self, size: (u32, u32)) -> View {
        self.controller.view(&self.session.viewpoint.view(&self.session.simulation.world, size))
    }

    /// The object that is pointed out: under the pointer, else selected.
    pub fn pointed_out(&self) -> Option<Entity> {
        self.hovered.or(self.selected)
    }

    /// The settings for the renderer.
    pub fn drawn_settings(&self) -> Settings {
        Settings { picked_entity: self.pointed_out().map(Entity::index_u32), ..self.settings }
    }

    /// Tells if the object under the pointer matters all the time.
    pub fn follows_pointer(&self) -> bool {
        self.settings.debug == DebugView::ThreeLights
    }

    /// The middle and the radius of everything drawn.
    pub fn scene_extent(&mut self) -> (Vec3, f32) {
        let spheres = all_bounds(&mut self.session.simulation.world);
        let boxes = spheres.iter().filter(|s| s.center.is_finite() && s.radius.is_finite()).map(|s| {
            let half = Vec3::splat(s.radius);
            Aabb { min: s.center - half, max: s.center + half }
        });
        let all = boxes.reduce(Aabb::union).unwrap_or(Aabb { min: Vec3::NEG_ONE, max: Vec3::ONE });
        (all.center(), all.center().distance(all.max))
    }

    /// Pivot where the pointer is on nothing: straight ahead, as far away as the scene's middle.
    pub fn pivot_ahead(&mut self, view: &View) -> Vec3 {
        let (center, _) = self.scene_extent();
        let depth = (center - view.eye()).dot(view.direction()).max(NEAREST_PIVOT);
        view.eye() + view.direction() * depth
    }

    /// The entity of an index that was drawn, while it lives.
    pub fn entity(&self, index: u32) -> Option<Entity> {
        let index = bevy_ecs::entity::EntityIndex::from_raw_u32(index)?;
        let entity = self.session.simulation.world.entities().resolve_from_index(index);
        self.session.simulation.world.get_entity(entity).is_ok().then_some(entity)
    }
}

/// The choice after this one, in the order of a table.
fn after<T: Copy + PartialEq>(table: &[(&str, T)], now: T) -> T {
    let index = table.iter().position(|(_, choice)| *choice == now).map_or(0, |index| (index + 1) % table.len());
    table.get(index).map_or(now, |(_, choice)| *choice)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::session::LoadOptions;
    use glam::Vec2;
    use systems::assets::MeshId;

    const SCENE: &str = r#"(
        meshes: { "small": cube(size: (1, 1, 1)), "large": cube(size: (2, 2, 2)) },
        entities: [
            (figure: ["small", "large"]),
            (name: "near", camera: (), transform: (translation: (0, 0, 5))),
            (name: "far", camera: (), transform: (translation: (0, 0, 9))),
        ],
    )"#;

    fn viewer() -> Viewer {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("test.ron");
        std::fs::write(&path, SCENE).expect("a scene");
        let mut session = Session::load(&path, &LoadOptions { cache: false, ..LoadOptions::default() }).expect("sound");
        session.simulation.frame();
        let settings = Settings { technique: Some(Technique::PerturbedNormal), ..Settings::default() };
        Viewer::new(Options { session, size: (64, 36), settings, paused: false, panel: true })
    }

    #[test]
    fn bump_mapping_goes_off_and_comes_back_as_it_was() {
        let mut viewer = viewer();
        viewer.apply(Command::ToggleBump);
        assert_eq!(viewer.settings.technique, Some(Technique::Off));
        viewer.apply(Command::ToggleBump);
        assert_eq!(viewer.settings.technique, Some(Technique::PerturbedNormal));
        viewer.settings.technique = Some(Technique::Off);
        viewer.apply(Command::ToggleBump);
        assert_eq!(viewer.settings.technique, None, "started without: the materials' own");
    }

    #[test]
    fn figures_go_round_and_cameras_too() {
        let mut viewer = viewer();
        let shown = |viewer: &mut Viewer| {
            let world = &mut viewer.session.simulation.world;
            world.query::<&MeshId>().iter(world).copied().collect::<Vec<_>>()
        };
        let first = shown(&mut viewer);
        viewer.apply(Command::NextMeshVariant);
        assert_ne!(shown(&mut viewer), first);
        viewer.apply(Command::NextMeshVariant);
        assert_eq!(shown(&mut viewer), first);

        let at = |viewer: &Viewer| viewer.view((64, 36)).eye().z;
        let view = viewer.view((64, 36));
        viewer.controller.grab(&view, Vec3::ZERO).orbit(Vec2::new(50.0, 0.0));
        viewer.apply(Command::NextCamera);
        assert_eq!(at(&viewer), 9.0, "a scene's camera, not the free one");
        viewer.apply(Command::NextCamera);
        assert_eq!(at(&viewer), 5.0);
    }

    #[test]
    fn a_selected_light_goes_off_and_on() {
        let mut viewer = viewer();
        viewer.apply(Command::ToggleLight);
        let lamp = viewer.session.simulation.world.spawn(Light::point(1.0, 5.0)).id();
        systems::run::registry::register_all(&mut viewer.session.simulation.world);
        viewer.selected = Some(lamp);
        let mut shines_after_o = || {
            viewer.apply(Command::ToggleLight);
            viewer.session.simulation.world.get::<Light>(lamp).expect("a light").enabled
        };
        assert_eq!([shines_after_o(), shines_after_o()], [false, true]);
    }

    #[test]
    fn a_step_is_taken_only_while_paused() {
        let mut viewer = viewer();
        viewer.apply(Command::Step);
        assert_eq!(viewer.clock().step, 0);
        viewer.apply(Command::Pause);
        viewer.apply(Command::Step);
        assert_eq!((viewer.clock().step, viewer.advance(1.0)), (1, 0));
        viewer.apply(Command::Pause);
        assert_eq!(viewer.advance(0.05), 3);
        assert_eq!(viewer.clock().step, 4);
    }

    #[test]
    fn an_index_that_is_gone_names_no_entity() {
        let mut viewer = viewer();
        let entity = viewer.session.scene.cameras[0].1;
        assert_eq!(viewer.entity(entity.index_u32()), Some(entity));
        viewer.session.simulation.world.despawn(entity);
        assert_eq!(viewer.entity(entity.index_u32()), None);
        assert_eq!(viewer.entity(u32::MAX), None);
    }

    #[test]
    fn what_is_turned_about_is_ahead_at_the_scenes_depth() {
        let mut viewer = viewer();
        let view = viewer.view((64, 36));
        assert!(viewer.pivot_ahead(&view).distance(Vec3::ZERO) < 1e-5);
    }
}
