//! Frames between steps show what is between them, and nothing else does.

use super::*;
use systems::ecs::clock;
use systems::space::{GlobalTransform, Interpolated};

#[derive(Component)]
struct Speed(f32);

/// Along x, a quarter turn per step; the third step is a jump.
fn drive(clock: Res<clock::Clock>, mut all: Query<(&Speed, &mut Transform, &mut Interpolated)>) {
    for (speed, mut transform, mut interpolated) in &mut all {
        if speed.0 == 0.0 {
            continue;
        }
        transform.translation.x += speed.0;
        transform.scale += 1.0;
        transform.rotation = Quat::from_rotation_y(std::f32::consts::FRAC_PI_2) * transform.rotation;
        if clock.step == 3 {
            transform.translation.x += 100.0;
            interpolated.jump();
        }
    }
}

struct Scene {
    simulation: Simulation,
    /// Alone; with a child; a child that moves; one that stands; one that is not interpolated.
    all: [Entity; 5],
}

impl Scene {
    fn new() -> Self {
        let mut simulation = Simulation::new();
        let world = &mut simulation.world;
        let moving = |speed| (Transform::IDENTITY, Speed(speed), Interpolated::default(), GlobalTransform::default());
        let alone = world.spawn(moving(2.0)).id();
        let parent = world.spawn(moving(4.0)).id();
        let child = world.spawn((moving(8.0), ChildOf(parent))).id();
        let still = world.spawn(moving(0.0)).id();
        let plain = world.spawn((Transform::from_xyz(7.0, 0.0, 0.0), GlobalTransform::default())).id();
        Self { simulation, all: [alone, parent, child, still, plain] }
    }

    fn step(&mut self) {
        self.simulation.step();
        self.simulation.world.run_system_cached(drive).expect("drives");
    }

    fn at(&mut self, fraction: f32) -> [GlobalTransform; 5] {
        self.simulation.world.insert_resource(Interpolation { enabled: true, fraction });
        self.seen()
    }

    fn seen(&mut self) -> [GlobalTransform; 5] {
        self.simulation.frame();
        self.all.map(|entity| *self.simulation.world.get::<GlobalTransform>(entity).expect("placed"))
    }

    /// The state's places, by bevy's definition.
    fn state(&self) -> [GlobalTransform; 5] {
        let own = |entity| *self.simulation.world.get::<Transform>(entity).expect("placed");
        let mut all = self.all.map(|entity| GlobalTransform::from(own(entity)));
        all[2] = all[1].mul_transform(own(self.all[2]));
        all
    }
}

#[test]
fn a_frame_between_steps_is_between_their_places() {
    let mut scene = Scene::new();
    scene.at(1.0);
    (0..2).for_each(|_| scene.step());
    let [alone, parent, child, still, plain] = scene.at(0.25);
    let (scale, rotation, place) = alone.to_scale_rotation_translation();
    assert!(place.abs_diff_eq(Vec3::X * 2.5, 1e-5) && scale.abs_diff_eq(Vec3::splat(2.25), 1e-5), "{alone:?}");
    let turned = rotation.angle_between(Quat::from_rotation_y(std::f32::consts::FRAC_PI_2));
    // 22.5° on the arc; on its chord 2 · atan(sin 45° / (3 + cos 45°)), 21.60°.
    assert!((turned.to_degrees() - 21.6).abs() < 0.1, "{turned}");
    let local = Transform { translation: Vec3::X * 10.0, ..alone.compute_transform() };
    assert!(child.translation().abs_diff_eq(parent.transform_point(local.translation), 1e-4), "{child:?}");
    assert_eq!((still, plain), (scene.state()[3], scene.state()[4]));
    // The same step, a later frame.
    assert!(scene.at(0.5)[0].translation().abs_diff_eq(Vec3::X * 3.0, 1e-5));
    assert!(scene.at(0.75)[1].translation().abs_diff_eq(Vec3::X * 7.0, 1e-5));
    assert_eq!(scene.at(1.0), scene.state(), "the state itself, to the bit");
}

#[test]
fn the_state_never_sees_it_and_off_it_is_not_there() {
    let (mut plain, mut watched) = (Scene::new(), Scene::new());
    for i in 0..6 {
        plain.step();
        watched.step();
        watched.at(i as f32 / 7.0);
        assert_eq!(plain.seen(), plain.state());
        assert_eq!(watched.state(), plain.state());
    }
    watched.simulation.world.insert_resource(Interpolation::default());
    assert_eq!(watched.seen(), watched.state(), "switched off between two steps");
}

#[test]
fn what_jumps_is_not_drawn_on_the_way() {
    let mut scene = Scene::new();
    scene.at(1.0);
    (0..3).for_each(|_| scene.step());
    assert_eq!(scene.at(0.5), scene.state());
    scene.step();
    assert!(scene.at(0.5)[0].translation().abs_diff_eq(Vec3::X * 107.0, 1e-4), "and goes on from there");
}

#[test]
fn what_stops_comes_to_rest_where_it_is_and_costs_no_more() {
    let mut scene = Scene::new();
    scene.at(1.0);
    (0..2).for_each(|_| scene.step());
    assert_ne!(scene.at(0.5), scene.state());
    for entity in scene.all {
        scene.simulation.world.entity_mut(entity).remove::<Speed>();
    }
    scene.step();
    assert_eq!(scene.at(0.5), scene.state());
    let changed = |scene: &mut Scene| {
        let world = &mut scene.simulation.world;
        let now = world.change_tick();
        let mut globals = world.query::<Ref<GlobalTransform>>();
        let newest = globals.iter(world).map(|global| now.get() - global.last_changed().get()).min();
        newest.expect("some")
    };
    let before = changed(&mut scene);
    scene.step();
    scene.at(0.7);
    assert!(changed(&mut scene) > before, "nothing is written");
}
