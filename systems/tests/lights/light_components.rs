//! Light entities, and a frame's statistics of the choice of lights.

use super::*;
use systems::assets::color::linear_from_kelvin;

#[test]
fn a_temperature_becomes_the_colour_of_a_black_body() {
    assert_eq!(Some(Light::point(1.0, 5.0).with_kelvin(2700.0).color), linear_from_kelvin(2700.0));
    assert_eq!(Some(Light::point(1.0, 5.0).with_kelvin(-4.0).color), linear_from_kelvin(1667.0));
    assert_eq!(Some(Light::point(1.0, 5.0).with_kelvin(f32::INFINITY).color), linear_from_kelvin(25000.0));
    assert_eq!(Light::point(1.0, 5.0).with_color(Vec3::X).with_kelvin(f32::NAN).color, Vec3::X);
}

#[test]
fn a_light_follows_its_parent_from_frame_to_frame() {
    let mut simulation = Simulation::new();
    let vehicle = simulation.world.spawn(Transform::default()).id();
    let mount = simulation.world.spawn((Transform::from_xyz(0.0, 1.0, 0.0), ChildOf(vehicle))).id();
    let lamp = Transform::from_xyz(0.0, 0.0, -2.0);
    simulation.world.spawn((Light::spot(1.0, 10.0, 0.5), lamp, ChildOf(mount)));
    simulation.frame();
    let lamp = |simulation: &Simulation| {
        let LightRecord { position, direction, .. } = simulation.draw_list().lights.records[0].unpacked();
        (Vec3::from(position), Vec3::from(direction))
    };
    assert_eq!(lamp(&simulation), (Vec3::new(0.0, 1.0, -2.0), Vec3::NEG_Z));
    let turn = Quat::from_rotation_y(std::f32::consts::FRAC_PI_2);
    *simulation.world.get_mut::<Transform>(vehicle).expect("placed") =
        Transform::from_xyz(5.0, 0.0, 0.0).with_rotation(turn);
    simulation.frame();
    let (position, direction) = lamp(&simulation);
    assert!(position.distance(Vec3::new(3.0, 1.0, 0.0)) < 1e-5, "{position}");
    assert!(direction.distance(Vec3::NEG_X) < 1e-6, "{direction}");
}

#[test]
fn the_objects_whose_lights_are_chosen_again_are_counted() {
    let mut simulation = Simulation::new();
    let cube = simulation.world.resource_mut::<Library>().add_mesh(shapes::cube(Vec3::ONE));
    let objects: Vec<Entity> =
        (0..4).map(|i| simulation.world.spawn((cube, Transform::from_xyz(i as f32 * 3.0, 0.0, 0.0))).id()).collect();
    simulation.world.spawn(Light::point(1.0, 30.0));
    let frame = |simulation: &mut Simulation| {
        simulation.frame();
        simulation.world.resource::<FrameStats>().selected
    };
    assert_eq!(frame(&mut simulation), 4);
    assert_eq!(frame(&mut simulation), 0);
    simulation.world.get_mut::<Transform>(objects[2]).expect("placed").translation.y = 1.0;
    assert_eq!(frame(&mut simulation), 1);
    simulation.world.insert_resource(LightPolicies::forced(LightPolicy::Hard));
    assert_eq!(frame(&mut simulation), 4);
}
