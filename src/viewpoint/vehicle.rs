//! Vehicles seen from behind, and the road seen from their seats.

use super::{Viewpoint, place};
use bevy_ecs::name::Name;
use bevy_ecs::prelude::*;
use glam::{Affine3A, Quat, Vec3};
use systems::draw::{Camera, Projection, View};
use systems::space::Transform;
use systems::vehicles::{Vehicle, VehicleType, VehicleTypes};

/// `chase NAME` or `driver NAME`, with the name of a vehicle.
pub fn find(wanted: &str, world: &mut World) -> Option<Viewpoint> {
    let (kind, name) = wanted.split_once(' ')?;
    let kind = match kind {
        "chase" => Viewpoint::Chase,
        "driver" => Viewpoint::Driver,
        _ => return None,
    };
    let mut vehicles = world.query_filtered::<(Entity, &Name), With<Vehicle>>();
    vehicles.iter(world).find(|(_, known)| known.as_str() == name).map(|(vehicle, _)| kind(vehicle))
}

/// From behind a vehicle and above it.
pub fn from_behind(world: &World, vehicle: Entity, (width, height): (u32, u32)) -> View {
    let behind = vehicle_type(world, vehicle, |kind| behind(&place(world, vehicle), kind));
    View::new(&behind, &wide(), width, height)
}

/// From the driver's seat.
pub fn from_seat(world: &World, vehicle: Entity, (width, height): (u32, u32)) -> View {
    let (eye, front) = vehicle_type(world, vehicle, |t| (t.eye, t.front()));
    // A camera looks down −Z, a vehicle along +Z.
    let around = Quat::from_rotation_y(std::f32::consts::PI);
    let vehicle_from_eye = Affine3A::from_rotation_translation(around, eye);
    let wide = wide();
    // The picture begins at the bumper: models have no insides.
    let near = (front - eye.z).max(wide.near);
    View::new(&(place(world, vehicle) * vehicle_from_eye), &Camera { near, ..wide }, width, height)
}

/// Camera of views of a vehicle and from its seat.
fn wide() -> Camera {
    Camera { projection: Projection::Perspective { fov_y: 0.9, aspect: None }, ..Camera::default() }
}

/// Something of the type that a vehicle is of; of the stand-in where it is no vehicle.
fn vehicle_type<T>(world: &World, entity: Entity, get: impl FnOnce(&VehicleType) -> T) -> T {
    let kind = world.get::<Vehicle>(entity).map(|vehicle| vehicle.kind).unwrap_or_default();
    get(world.resource::<VehicleTypes>().get(kind))
}

/// World from view: behind a vehicle of that type and above it, upright whatever the slope; over its trailer if it has
/// one.
fn behind(world_from_vehicle: &Affine3A, kind: &VehicleType) -> Affine3A {
    let (size, trailer) = (kind.size, kind.rear() - kind.rear_overhang);
    let forward = Vec3::from(world_from_vehicle.matrix3.z_axis).with_y(0.0).normalize_or(Vec3::Z);
    let at = Vec3::from(world_from_vehicle.translation);
    let eye = at - forward * (size.z * 0.6 + 4.0 + trailer) + Vec3::Y * (size.y * 0.9 + 1.2 + trailer * 0.6);
    let ahead = at + forward * (size.z * 0.5 + 4.0) + Vec3::Y * size.y * 0.5;
    Transform::from_translation(eye).looking_at(ahead, Vec3::Y).compute_affine()
}

#[cfg(test)]
mod tests {
    use super::*;
    use systems::Simulation;
    use systems::vehicles::VehicleTypeId;
    use systems::vehicles::types::Trailer;

    #[test]
    fn a_trailer_is_looked_over() {
        let trailer = Trailer { hitch: 0.5, length: 8.0, end: 11.0 };
        let size = Vec3::new(2.5, 4.0, 6.0);
        let alone = VehicleType { size, rear_overhang: 1.0, ..VehicleType::default() };
        let pulling = VehicleType { trailer: Some(trailer), ..alone.clone() };
        for kind in [alone, pulling] {
            let world_from_view = behind(&Affine3A::IDENTITY, &kind);
            let eye = Vec3::from(world_from_view.translation);
            assert!(eye.z < -kind.rear() - 3.0, "{eye}");
            // Where the line of sight passes the front of a trailer, over the rear axle, it is above its roof.
            let ahead = -Vec3::from(world_from_view.matrix3.z_axis);
            let over_axle = eye + ahead * (-eye.z / ahead.z);
            assert!(kind.trailer.is_none() || over_axle.y > 4.0, "{over_axle}");
        }
    }

    #[test]
    fn a_vehicle_is_followed_from_behind_and_from_its_seat() {
        let mut simulation = Simulation::new();
        let at = Transform::from_xyz(10.0, 2.0, -5.0).with_rotation(Quat::from_rotation_y(0.7));
        let vehicle = Vehicle::of(VehicleTypeId::STAND_IN);
        let vehicle = simulation.world.spawn((vehicle, Name::new("box 1"), at)).id();
        let camera = simulation.world.spawn(Camera::default()).id();
        simulation.frame();
        let cameras = [("front".to_owned(), camera)];
        let mut find = |name: &str| Viewpoint::find(name, &cameras, &mut simulation.world);
        let (chase, driver) = (find("chase box 1").expect("a vehicle"), find("driver box 1").expect("a vehicle"));
        assert_eq!((find("front"), find("chase box 2"), find("beside box 1")), (Some(camera.into()), None, None));
        assert_eq!((chase.vehicle(), driver.vehicle()), (Some(vehicle), Some(vehicle)));
        let forward = at.rotation * Vec3::Z;
        let (chase, driver) = (chase.view(&simulation.world, (64, 36)), driver.view(&simulation.world, (64, 36)));
        assert!(driver.direction().dot(forward) > 0.9999 && driver.eye().y > 3.0);
        assert!((chase.eye() - at.translation).dot(forward) < -5.0 && chase.direction().dot(forward) > 0.9);
    }
}
