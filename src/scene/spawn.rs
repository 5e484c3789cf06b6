//! A checked scene becomes entities.

use super::faults;
use super::files::{Items, Shape};
use super::format::{self, Entity as Source, Scene};
use super::generate;
use super::overlaps;
use super::physical;
use super::road_warnings;
use super::traffic::{self, LitGlass};
use super::turned_meshes::TurnedMeshes;
use super::values::place;
use crate::import::Model;
use crate::name;
use bevy_ecs::name::Name;
use bevy_ecs::prelude::*;
use glam::{Affine3A, EulerRot, Quat, Vec3};
use std::collections::HashMap;
use systems::assets::{Figure, Library, MaterialId, MeshId};
use systems::draw::pieces::PiecesReport;
use systems::draw::{Camera, Projection, pieces};
use systems::lights::{Light, LightKind};
use systems::space::origin::Origin;
use systems::space::{Aabb, Hidden, Spin, Transform};
use systems::vehicles::ground::Ground;
use systems::vehicles::routes::Routes;
use systems::vehicles::signals::Signals;
use systems::vehicles::{
    ByHand, Controls, Motion, NextVehicleNumber, OnRoute, RouteId, Vehicle, VehicleTypeId, VehicleTypes,
};

/// What spawning found out about the scene.
#[derive(Default)]
pub struct Spawned {
    /// Name and entity of every camera: the file's own first, in its order, then those within models.
    pub cameras: Vec<(String, Entity)>,
    /// Around everything that is drawn, world space.
    pub bounds: Option<Aabb>,
    /// Whether anything shines.
    pub has_lights: bool,
    /// What did not come out as asked.
    pub warnings: Vec<String>,
}

/// Spawns the whole scene.
pub fn spawn(scene: &Scene, items: &Items, world: &mut World) -> Spawned {
    let mut spawner = Spawner {
        items,
        world,
        piece_metres: scene.piece_metres,
        large: Vec::new(),
        model_cameras: Vec::new(),
        turned: TurnedMeshes::default(),
        unknown_types: Vec::new(),
        glass: LitGlass::default(),
        found: Spawned::default(),
    };
    spawner.found.warnings = traffic::insert(scene, spawner.world);
    for entity in &scene.entities {
        spawner.entity(entity, &Placement::of(entity), None);
    }
    let mut seeds = generate::Random::new(scene.seed);
    for (i, generator) in scene.generators.iter().enumerate() {
        spawner.generator(i, generator, seeds.bits());
    }
    spawner.cut();
    spawner.found.warnings.extend(of_vehicles(spawner.world));
    let Spawner { model_cameras, mut found, .. } = spawner;
    found.warnings.extend(shared_names(&found.cameras, &model_cameras));
    found.cameras.extend(model_cameras);
    found
}

/// A word about each name of a model's camera that an earlier one has; the scene's own have been checked.
fn shared_names(own: &[(String, Entity)], of_models: &[(String, Entity)]) -> Vec<String> {
    let mut counts: HashMap<&str, usize> = own.iter().map(|(name, _)| (name.as_str(), 1)).collect();
    let mut shared = Vec::new();
    for (name, _) in of_models.iter().filter(|(name, _)| !name.is_empty()) {
        let count = counts.entry(name).or_default();
        *count += 1;
        if *count == 2 {
            shared.push(format!("duplicate camera name {name:?} in a model: the name selects the first camera only"));
        }
    }
    shared
}

/// What is to be said of vehicles once all are there.
fn of_vehicles(world: &mut World) -> Vec<String> {
    let mut warnings = overlaps::warnings(world);
    if world.query::<&OnRoute>().iter(world).next().is_some() {
        let origin = world.resource::<Origin>().0;
        warnings.extend(road_warnings::of_beginning_anew(world.resource::<Routes>(), origin));
    }
    warnings
}

/// Spawns a model as a whole scene; returns its root, too.
pub fn spawn_model(model: &Model, bounds: Aabb, world: &mut World) -> (Entity, Spawned) {
    let root = model.spawn(world, Transform::IDENTITY);
    let cameras = cameras_below(world, root);
    let warnings = shared_names(&[], &cameras);
    let bounds = (bounds != Aabb::default()).then_some(bounds);
    (root, Spawned { cameras, bounds, has_lights: model.has_lights(), warnings })
}

/// Draws the large objects of a model that is a whole scene in pieces. Its lengths may not be metres, so at least
/// 1/64 of its own is left.
pub fn cut_model(root: Entity, bounds: Aabb, world: &mut World) {
    if has_a_choice(world) {
        let length = (bounds.max - bounds.min).max_element();
        pieces::draw_in_pieces(world, root, pieces::DEFAULT_METRES.max(length / 64.0));
    }
}

/// Whether there are more lights than an object takes.
fn has_a_choice(world: &mut World) -> bool {
    world.query::<&Light>().iter(world).nth(3).is_some()
}

/// What to say where pieces are longer than was asked for.
fn too_many(name: &str, report: PiecesReport, metres: f32) -> Option<String> {
    (report.metres > metres * 1.01).then(|| {
        let PiecesReport { metres: made, .. } = report;
        format!("{name}: drawn in pieces of {made:.3} m, not {metres} m, of which there would be too many")
    })
}

/// Pieces of a scene, beyond which objects are left whole. Each takes a page of 64 slots in the instance table: so many
/// are 805 MB, and a texture of 16384 rows, which adapters have, holds a third more.
const MOST_PIECES: usize = 1 << 17;

struct Spawner<'a> {
    items: &'a Items,
    world: &'a mut World,
    piece_metres: f32,
    /// What may be larger than that, or than a length of its own.
    large: Vec<(Entity, f32)>,
    model_cameras: Vec<(String, Entity)>,
    turned: TurnedMeshes,
    /// Names of types that were asked for in vain.
    unknown_types: Vec<String>,
    glass: LitGlass,
    found: Spawned,
}

/// Where an entity goes and what it looks like; a generator's copies differ from the file's entity in these.
struct Placement<'a> {
    name: Option<String>,
    parent_from_entity: Transform,
    world_from_parent: Affine3A,
    mesh: Option<&'a str>,
    material: Option<&'a str>,
    light: Option<&'a format::Light>,
    /// The vehicle's type instead of the entity's, and where it drives.
    vehicle: Option<&'a str>,
    on_route: Option<OnRoute>,
}

impl<'a> Placement<'a> {
    fn of(source: &'a Source) -> Self {
        Self {
            name: source.name.clone(),
            parent_from_entity: transform(&source.transform),
            world_from_parent: Affine3A::IDENTITY,
            mesh: source.mesh.as_deref(),
            material: source.material.as_deref(),
            light: source.light.as_ref(),
            vehicle: source.vehicle.as_ref().map(|vehicle| vehicle.r#type.as_str()),
            on_route: None,
        }
    }
}

impl Spawner<'_> {
    fn entity(&mut self, source: &Source, placement: &Placement, parent: Option<Entity>) {
        let at = placement.parent_from_entity;
        let world_from_entity = placement.world_from_parent * at.compute_affine();
        let material = self.items.material(placement.material);
        let entity = match placement.mesh.and_then(|mesh| self.items.shape(mesh)) {
            Some(Shape::Mesh(mesh, aabb)) => {
                self.enclose(aabb.transformed(&world_from_entity));
                let drawn = (at, *mesh, material.unwrap_or_default());
                // Named at once: an entity that gets a component later is moved, which for 100,000 copies is noticed.
                match &placement.name {
                    Some(name) => self.world.spawn((drawn, Name::new(name.clone()))).id(),
                    None => self.world.spawn(drawn).id(),
                }
            }
            Some(Shape::Model(model, bounds)) => {
                if *bounds != Aabb::default() {
                    self.enclose(bounds.transformed(&world_from_entity));
                }
                self.model(model, at, material)
            }
            None => self.world.spawn(at).id(),
        };
        if let Some(parent) = parent {
            self.world.entity_mut(entity).insert(ChildOf(parent));
        }
        if let Some(name) = &placement.name
            && self.world.get::<Name>(entity).map(Name::as_str) != Some(name)
        {
            self.world.entity_mut(entity).insert(Name::new(name.clone()));
        }
        if let Some(source) = placement.light {
            self.found.has_lights = true;
            self.world.entity_mut(entity).insert(light(source));
        }
        if let Some(spin) = &source.spin {
            self.world.entity_mut(entity).insert(Spin {
                axis: Vec3::from_array(spin.axis).normalize(),
                rate: spin.degrees_per_second.to_radians(),
                start: at.rotation,
            });
        }
        if let Some(name) = placement.vehicle {
            self.vehicle(name, source.vehicle.as_ref(), placement.on_route, entity, &world_from_entity);
        }
        if source.ground {
            self.world.entity_mut(entity).insert(Ground);
        }
        if let Some(obstacle) = source.obstacle {
            physical::make_obstacle(&mut self.world.entity_mut(entity), obstacle);
        }
        if let Some(head) = &source.signal_head {
            self.signal_head(head, entity);
        }
        if source.hidden {
            self.world.entity_mut(entity).insert(Hidden);
        }
        if let Some(source) = &source.camera {
            let name = placement.name.clone().unwrap_or_else(|| format!("camera {}", self.found.cameras.len() + 1));
            self.world.entity_mut(entity).insert((camera(source), Name::new(name.clone())));
            self.found.cameras.push((name, entity));
        }
        self.note_large(source, placement, entity, &world_from_entity);
        self.figure(source, material, entity, &world_from_entity);
        // Before there are children, whose nodes may have the same names.
        let nodes: Vec<_> = source.attach.iter().map(|item| self.node(entity, item.node.as_deref())).collect();
        for child in &source.children {
            let placement = Placement { world_from_parent: world_from_entity, ..Placement::of(child) };
            self.entity(child, &placement, Some(entity));
        }
        for (item, node) in source.attach.iter().zip(nodes) {
            // The check has seen to it that the node is there.
            let Some((node, root_from_node)) = node else { continue };
            let world_from_parent = world_from_entity * root_from_node;
            self.entity(item, &Placement { world_from_parent, ..Placement::of(item) }, Some(node));
        }
    }

    /// Notes what may have to be drawn in pieces, before anything with a length of its own is below it.
    fn note_large(&mut self, source: &Source, placement: &Placement, entity: Entity, world_from_entity: &Affine3A) {
        let metres = source.piece_metres.unwrap_or(self.piece_metres);
        let is_longer = |aabb: &Aabb| pieces::is_longer(*aabb, world_from_entity, metres);
        match placement.mesh.and_then(|mesh| self.items.shape(mesh)) {
            Some(Shape::Mesh(_, aabb)) if is_longer(aabb) => self.large.push((entity, metres)),
            Some(Shape::Model(_, aabb)) if is_longer(aabb) => {
                let below = descendants(self.world, entity).into_iter();
                self.large.extend(below.map(|part| (part, metres)));
            }
            _ => {}
        }
    }

    /// Draws large objects in pieces, where there are lights to choose between.
    fn cut(&mut self) {
        if !has_a_choice(self.world) {
            return;
        }
        let (mut made, large) = (0, std::mem::take(&mut self.large));
        for (i, &(entity, metres)) in large.iter().enumerate() {
            if made >= MOST_PIECES {
                let whole = large.len() - i;
                self.found.warnings.push(format!(
                    "{whole} large objects are drawn whole: the scene has {made} pieces already; choose a \
                     larger piece_metres"
                ));
                break;
            }
            let report = pieces::draw_one_in_pieces(self.world, entity, metres).unwrap_or_default();
            made += report.pieces;
            self.found.warnings.extend(too_many(&name::of_entity(self.world, entity), report, metres));
        }
    }

    fn enclose(&mut self, aabb: Aabb) {
        self.found.bounds = Some(self.found.bounds.map_or(aabb, |bounds| bounds.union(aabb)));
    }

    fn model(&mut self, model: &Model, at: Transform, material: Option<MaterialId>) -> Entity {
        let root = model.spawn(self.world, at);
        self.found.has_lights |= model.has_lights();
        self.model_cameras.extend(cameras_below(self.world, root));
        if let Some(material) = material {
            for entity in descendants(self.world, root) {
                let Some(&mesh) = self.world.get::<MeshId>(entity) else { continue };
                let mesh = self.turned.mesh_for(&mut self.world.resource_mut(), mesh, material);
                self.world.entity_mut(entity).insert((mesh, material));
            }
        }
        root
    }

    /// Of a type, with what the entity's `vehicle` says beside it, if it has one.
    fn vehicle(
        &mut self,
        name: &str,
        source: Option<&format::Vehicle>,
        on_route: Option<OnRoute>,
        entity: Entity,
        world_from_entity: &Affine3A,
    ) {
        let types = self.world.resource::<VehicleTypes>();
        let kind = types.find(name);
        if kind.is_none() && !self.unknown_types.iter().any(|known| known == name) {
            let names: Vec<&str> = types.iter().map(|(_, known)| known.name.as_str()).collect();
            let hint = faults::suggestion(name, &names);
            self.found.warnings.push(format!("unknown vehicle type {name:?}{hint}; a box is drawn instead"));
            self.unknown_types.push(name.to_owned());
        }
        let kind = kind.unwrap_or(VehicleTypeId::STAND_IN);
        let bounds = types.get(kind).bounds();
        let routes = self.world.resource::<Routes>();
        let own_route = source.and_then(|source| {
            let id = routes.find(source.route.as_deref()?)?;
            Some(OnRoute::new(id, source.lane, source.at.min(routes.get(id)?.length)))
        });
        let on_route = own_route.or(on_route);
        let stands = on_route.map(|on| routes.stand(&on));
        let place = on_route.map(|on| routes.stand_at(&on).0).unwrap_or_default();
        let world_from_vehicle = stands.map_or(*world_from_entity, |stands| stands.compute_affine());
        self.enclose(bounds.transformed(&world_from_vehicle));
        let number = self.world.resource::<NextVehicleNumber>().0;
        let mut entity = self.world.entity_mut(entity);
        if !entity.contains::<Name>() {
            entity.insert(Name::new(format!("{name} {}", number + 1)));
        }
        let headlights = source.map_or_else(Default::default, |source| source.headlights.into());
        let controls = Controls { headlights, ..Controls::default() };
        let speed = source.map_or(0.0, |source| f64::from(source.speed_kmh) / 3.6);
        // Paints in turn where none is asked for.
        let paint = source.and_then(|source| source.paint).unwrap_or(number);
        if let Some((on, stands)) = on_route.zip(stands) {
            entity.insert((stands, on));
        }
        let motion = Motion { place, speed, ..Motion::default() };
        entity.insert((controls, motion, Vehicle::of(kind).painted(paint)));
        if source.is_some_and(|source| source.by_hand) {
            entity.insert(ByHand);
        }
        if let Some(physical) = source.and_then(|source| source.physical) {
            physical::make_physical(&mut entity, physical);
        }
        self.found.has_lights = true;
    }

    fn signal_head(&mut self, source: &format::SignalHead, entity: Entity) {
        let Some(head) = self.world.resource::<Signals>().head(&source.signal, source.group) else { return };
        let below = descendants(self.world, entity);
        if !self.glass.make_head(self.world, entity, &below, head) {
            let name = name::of_entity(self.world, entity);
            self.found.warnings.push(format!("{name}: no node lamp_red, lamp_amber or lamp_green: it shows no signal"));
        }
    }

    fn figure(&mut self, source: &Source, material: Option<MaterialId>, entity: Entity, world_from_entity: &Affine3A) {
        let meshes: Vec<_> = source.figure.iter().filter_map(|name| self.items.single_mesh(name)).collect();
        let Some(&(_, own_material)) = meshes.first() else { return };
        let mesh_for = |(mesh, _)| match material {
            Some(material) => self.turned.mesh_for(&mut self.world.resource_mut(), mesh, material),
            None => mesh,
        };
        let meshes: Vec<MeshId> = meshes.into_iter().map(mesh_for).collect();
        for &mesh in &meshes {
            let aabb = self.world.resource::<Library>().mesh(mesh).map(|entry| entry.mesh.aabb());
            aabb.into_iter().for_each(|aabb| self.enclose(aabb.transformed(world_from_entity)));
        }
        let figure = Figure { meshes, shown: 0 };
        self.world.entity_mut(entity).insert((figure.meshes[0], material.unwrap_or(own_material), figure));
    }

    /// The entity of a model's node below the model's root, and its `root_from_node`.
    fn node(&self, root: Entity, name: Option<&str>) -> Option<(Entity, Affine3A)> {
        let named = |&entity: &Entity| self.world.get::<Name>(entity).map(Name::as_str) == name;
        let node = descendants(self.world, root).into_iter().find(named)?;
        let (mut root_from_node, mut at) = (Affine3A::IDENTITY, node);
        while at != root {
            root_from_node = self.world.get::<Transform>(at)?.compute_affine() * root_from_node;
            at = self.world.get::<ChildOf>(at)?.parent();
        }
        Some((node, root_from_node))
    }

    fn generator(&mut self, index: usize, generator: &format::Generator, scene_seed: u64) {
        let copies = generate::copies(generator, scene_seed, self.world.resource::<Routes>());
        let name = generator.name.clone().unwrap_or_else(|| format!("generator {}", index + 1));
        if let format::Place::Scatter(scatter) = &generator.place
            && copies.len() < scatter.count as usize
        {
            let (placed, asked) = (copies.len(), scatter.count);
            self.found.warnings.push(format!("{name}: {placed} of {asked} placed: min_distance leaves no room"));
        }
        if copies.is_empty() {
            self.found.warnings.push(format!("{name}: nothing is placed: there is no route with room for it"));
        }
        let mut room = Room::default();
        for (i, copy) in copies.iter().enumerate() {
            let own = Placement::of(&generator.entity);
            let placement = Placement {
                name: Some(format!("{name} {i}")),
                parent_from_entity: copy.at.mul_transform(own.parent_from_entity),
                mesh: generator.meshes.get(copy.mesh).map(String::as_str).or(own.mesh),
                material: generator.materials.get(copy.material).map(String::as_str).or(own.material),
                light: generator.lights.get(copy.light).or(own.light),
                vehicle: generator.vehicles.get(copy.vehicle).map(String::as_str).or(own.vehicle),
                on_route: copy.on_route,
                ..own
            };
            if placement.vehicle.is_none() || room.take(&placement, self.world.resource()) {
                self.entity(&generator.entity, &placement, None);
            }
        }
        if room.full > 0 {
            let warning =
                format!("{name}: {} of {} left out: no room between the earlier ones", room.full, copies.len());
            self.found.warnings.push(warning);
        }
    }
}

/// How far the vehicles that a generator puts on a lane reach.
#[derive(Default)]
struct Room {
    /// The lane that is being filled, and where the front of the last one on it is.
    last: Option<(RouteId, u8, f64)>,
    /// Vehicles that found no room.
    full: usize,
}

impl Room {
    /// Metres between two vehicles at least.
    const GAP: f64 = 2.0;

    /// Whether a vehicle has room behind which it stands free.
    fn take(&mut self, placement: &Placement, types: &VehicleTypes) -> bool {
        let Some((on, name)) = placement.on_route.zip(placement.vehicle) else { return true };
        let kind = types.get(types.find(name).unwrap_or_default());
        let is_free = self.last.is_none_or(|(route, lane, front)| {
            (route, lane) != (on.route, on.lane) || on.at - f64::from(kind.rear()) > front + Self::GAP
        });
        if is_free {
            self.last = Some((on.route, on.lane, on.at + f64::from(kind.front())));
        } else {
            self.full += 1;
        }
        is_free
    }
}

fn cameras_below(world: &World, root: Entity) -> Vec<(String, Entity)> {
    let name = |entity| world.get::<Name>(entity).map_or_else(String::new, ToString::to_string);
    let below = descendants(world, root).into_iter();
    below.filter(|&entity| world.get::<Camera>(entity).is_some()).map(|entity| (name(entity), entity)).collect()
}

/// Everything below an entity, each parent before its children.
pub(super) fn descendants(world: &World, root: Entity) -> Vec<Entity> {
    let (mut open, mut found) = (vec![root], Vec::new());
    while let Some(entity) = open.pop() {
        if let Some(children) = world.get::<Children>(entity) {
            found.extend(children.iter());
            open.extend(children.iter().rev());
        }
    }
    found
}

/// The transform of a checked scene.
pub fn transform(source: &format::Transform) -> Transform {
    let translation = place(source.translation.unwrap_or_default());
    let unrotated = Transform { translation, scale: source.scale.vec3(), ..Transform::IDENTITY };
    if let Some([x, y, z]) = source.rotation_degrees.map(|degrees| degrees.map(f32::to_radians)) {
        // Roll about the entity's own Z, then pitch, then yaw: what one expects of a camera.
        unrotated.with_rotation(Quat::from_euler(EulerRot::YXZ, y, x, z))
    } else if let Some(quaternion) = source.quaternion {
        unrotated.with_rotation(Quat::from_array(quaternion).normalize())
    } else if let Some(target) = source.look_at {
        unrotated.looking_at(place(target), Vec3::Y)
    } else {
        unrotated
    }
}

/// The light of a checked scene.
pub fn light(source: &format::Light) -> Light {
    let range = |range: Option<f32>| range.unwrap_or(f32::INFINITY);
    match source {
        format::Light::Point(l) => Light {
            kind: LightKind::Point,
            color: l.color.rgb(),
            intensity: l.intensity,
            ambient: l.ambient.rgb(),
            range: range(l.range),
            attenuation: Vec3::from_array(l.attenuation.0),
            enabled: l.on,
        },
        format::Light::Spot(l) => Light {
            kind: cone(l),
            color: l.color.rgb(),
            intensity: l.intensity,
            ambient: l.ambient.rgb(),
            range: range(l.range),
            attenuation: Vec3::from_array(l.attenuation.0),
            enabled: l.on,
        },
        format::Light::Directional(l) => Light {
            ambient: l.ambient.rgb(),
            enabled: l.on,
            ..Light::directional(l.intensity).with_color(l.color.rgb())
        },
    }
}

fn cone(l: &format::SpotLight) -> LightKind {
    match (l.cutoff_degrees, l.outer_degrees) {
        (None, Some(outer)) => LightKind::Spot {
            outer: outer.to_radians(),
            inner: Some(l.inner_degrees.unwrap_or(outer * 0.8).to_radians()),
            exponent: 0.0,
        },
        (cutoff, _) => LightKind::Spot {
            outer: cutoff.unwrap_or(45.0).to_radians(),
            inner: None,
            exponent: l.exponent.unwrap_or(0.0),
        },
    }
}

fn camera(source: &format::Camera) -> Camera {
    let default = Camera::default();
    match (source.orthographic_half_height, source.fov_y_degrees) {
        (Some(half_height), _) => Camera {
            projection: Projection::Orthographic { half_height, aspect: source.aspect },
            near: source.near,
            // A parallel projection has to end somewhere.
            far: source.far.unwrap_or(source.near + 1000.0),
        },
        (None, fov_y) => Camera {
            projection: Projection::Perspective { fov_y: fov_y.unwrap_or(45.0).to_radians(), aspect: source.aspect },
            near: source.near,
            far: source.far.unwrap_or(default.far),
        },
    }
}
