//! A checked scene becomes entities.

use super::cells;
use super::files::{Items, Shape};
use super::format::{self, Entity as Source, Scene};
use super::generate;
use super::lights;
use super::physical;
use super::rigs::Rigs;
use super::sensor_warnings;
use super::sensors;
use super::turned_meshes::TurnedMeshes;
use super::values::place;
use super::vehicles::{self, OnRoute, Room, VehiclesFound};
use crate::import::Model;
use crate::name::{self, SceneEntities};
use bevy_ecs::name::Name;
use bevy_ecs::prelude::*;
use glam::{Affine3A, EulerRot, Quat, Vec3};
use std::collections::HashMap;
use systems::assets::{Library, MaterialId, MeshId, MeshVariants};
use systems::draw::pieces::PiecesReport;
use systems::draw::{Camera, Projection, pieces};
use systems::lights::{LUMINANCE, Light, LightKind, LightPolicies, NoShadow, ShadowLights, fade};
use systems::sensors::{Classes, Instance};
use systems::space::{Aabb, Hidden, Spin, Transform};

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

/// Spawns the whole scene. `seed`: of all that is random in it.
pub fn spawn(scene: &Scene, items: &Items, seed: u64, world: &mut World) -> Spawned {
    let mut spawner = Spawner {
        items,
        rigs: &scene.rigs,
        world,
        piece_metres: scene.piece_metres,
        large: Vec::new(),
        model_cameras: Vec::new(),
        turned: TurnedMeshes::default(),
        vehicles: VehiclesFound::default(),
        found: Spawned::default(),
    };
    spawner.world.insert_resource(sensors::classes(&scene.classes));
    spawner.found.warnings = vehicles::insert(scene, seed, spawner.world);
    if let Some(lights) = scene.lights {
        spawner.world.insert_resource(LightPolicies::same(lights.policy()));
    }
    let mut listed = SceneEntities::default();
    for (i, entity) in scene.entities.iter().enumerate() {
        listed.0.insert(spawner.entity(entity, &Placement::of(entity), None), i);
    }
    spawner.world.insert_resource(listed);
    let mut seeds = generate::Random::new(seed);
    for (i, generator) in scene.generators.iter().enumerate() {
        spawner.generator(i, generator, seeds.bits());
    }
    let in_cells = cells::spawn(Some((scene, items)), spawner.world);
    spawner.found.warnings.extend(in_cells);
    spawner.cut();
    spawner.found.warnings.extend(vehicles::warnings(spawner.world));
    spawner.found.warnings.extend(shadows_without_end(spawner.world));
    spawner.found.warnings.extend(too_many_suns(spawner.world));
    spawner.found.warnings.extend(sensor_warnings::warnings(spawner.world));
    let Spawner { model_cameras, mut found, .. } = spawner;
    found.warnings.extend(shared_names(&found.cameras, &model_cameras));
    found.cameras.extend(model_cameras);
    found
}

/// A word about lights that cast shadows and have no range.
fn shadows_without_end(world: &mut World) -> Option<String> {
    let is_endless = |light: &Light| light.shadows && light.kind != LightKind::Directional && light.range.is_infinite();
    let mut lights = world.query::<(Entity, &Light)>();
    let mut endless = lights.iter(world).filter(|(_, light)| is_endless(light)).map(|(entity, _)| entity);
    let first = name::of_entity(world, endless.next()?);
    let lights = match endless.count() {
        0 => " casts shadows and has no range: whatever is in the scene is drawn for its".to_owned(),
        more => {
            let others = if more == 1 { "light" } else { "lights" };
            format!(
                " and {more} other {others} cast shadows and have no range: whatever is in the scene is drawn for their"
            )
        }
    };
    Some(format!("{first}{lights} shadows; set `range`"))
}

/// A word about directional lights that cast no shadows, though they are to.
fn too_many_suns(world: &mut World) -> Option<String> {
    let casts = |light: &Light| light.shadows && light.enabled && light.kind == LightKind::Directional;
    let luminance =
        |light: &Light| (light.color * light.intensity).abs().dot(LUMINANCE).max(light.ambient.abs().dot(LUMINANCE));
    let mut suns: Vec<f32> = world.query::<&Light>().iter(world).filter(|light| casts(light)).map(luminance).collect();
    suns.sort_unstable_by(|a, b| b.total_cmp(a));
    let (count, most) = (suns.len(), ShadowLights::MOST_SUNS);
    let last = *suns.get(most - 1)?;
    let mut others = suns.get(most..)?.iter();
    let mut told = format!("{count} directional lights are to cast shadows; only the {most} brightest do");
    if *others.as_slice().first()? == last {
        told += ", of equally bright ones those that come first";
    }
    // Fainter than it is by itself, since another is nearly as bright.
    let percent = (100.0 * fade(last, others.find(|next| **next < last).copied().unwrap_or(0.0))).floor();
    if percent < 99.0 {
        told += &format!("; the shadow of the faintest of these counts by {percent} %");
    }
    Some(told)
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

/// Spawns a model as a whole scene; returns its root, too.
pub fn spawn_model(model: &Model, bounds: Aabb, world: &mut World) -> (Entity, Spawned) {
    let root = model.spawn(world, Transform::IDENTITY);
    let cameras = cameras_below(world, root);
    let mut warnings = shared_names(&[], &cameras);
    warnings.extend(cells::spawn(None, world));
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

pub(super) struct Spawner<'a> {
    items: &'a Items,
    rigs: &'a Rigs,
    pub(super) world: &'a mut World,
    piece_metres: f32,
    /// What may be larger than that, or than a length of its own.
    large: Vec<(Entity, f32)>,
    model_cameras: Vec<(String, Entity)>,
    turned: TurnedMeshes,
    #[cfg_attr(not(feature = "vehicles"), allow(dead_code))]
    pub(super) vehicles: VehiclesFound,
    pub(super) found: Spawned,
}

/// Where an entity goes and what it looks like; a generator's copies differ from the file's entity in these.
pub(super) struct Placement<'a> {
    name: Option<String>,
    parent_from_entity: Transform,
    world_from_parent: Affine3A,
    mesh: Option<&'a str>,
    material: Option<&'a str>,
    light: Option<&'a format::Light>,
    /// The vehicle's type instead of the entity's, and where it drives.
    pub(super) vehicle: Option<&'a str>,
    pub(super) on_route: Option<OnRoute>,
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
    fn entity(&mut self, source: &Source, placement: &Placement, parent: Option<Entity>) -> Entity {
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
            Some(Shape::Model(model, bounds, no_shadow)) => {
                if *bounds != Aabb::default() {
                    self.enclose(bounds.transformed(&world_from_entity));
                }
                self.model(model, at, material, no_shadow)
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
            self.world.entity_mut(entity).insert(lights::light(source));
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
            vehicles::make_ground(&mut self.world.entity_mut(entity));
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
        if let Some(source) = &source.sensor {
            self.world.entity_mut(entity).insert(sensors::sensor(source));
        }
        if let Some(class) = source.class.as_ref().and_then(|name| self.world.resource::<Classes>().find(name)) {
            self.world.entity_mut(entity).insert(class);
        }
        // What a model consists of is one thing, unless it is a part of another; so is what sensors are mounted on.
        let is_model = matches!(placement.mesh.and_then(|mesh| self.items.shape(mesh)), Some(Shape::Model(..)));
        if source.instance.unwrap_or(is_model && parent.is_none() || source.rig.is_some()) {
            self.world.entity_mut(entity).insert(Instance);
        }
        self.note_large(source, placement, entity, &world_from_entity);
        self.figure(source, material, entity, &world_from_entity);
        if let Some(lights) = source.lights {
            let drawn = std::iter::once(entity).chain(descendants(self.world, entity));
            drawn.for_each(|part| _ = self.world.entity_mut(part).insert(lights.policy()));
        }
        if !source.casts_shadows.0 {
            let drawn = std::iter::once(entity).chain(descendants(self.world, entity));
            drawn.for_each(|part| _ = self.world.entity_mut(part).insert(NoShadow));
        }
        // Before there are children, whose nodes may have the same names.
        let nodes: Vec<_> = source.attach.iter().map(|item| self.node(entity, item.node.as_deref())).collect();
        source.custom.insert(self.world, entity);
        for child in source.children.iter().chain(self.rigs.of(source)) {
            let placement = Placement { world_from_parent: world_from_entity, ..Placement::of(child) };
            self.entity(child, &placement, Some(entity));
        }
        for (item, node) in source.attach.iter().zip(nodes) {
            // The check has seen to it that the node is there.
            let Some((node, root_from_node)) = node else { continue };
            let world_from_parent = world_from_entity * root_from_node;
            self.entity(item, &Placement { world_from_parent, ..Placement::of(item) }, Some(node));
        }
        entity
    }

    /// Notes what may have to be drawn in pieces, before anything with a length of its own is below it.
    fn note_large(&mut self, source: &Source, placement: &Placement, entity: Entity, world_from_entity: &Affine3A) {
        let metres = source.piece_metres.unwrap_or(self.piece_metres);
        let is_longer = |aabb: &Aabb| pieces::is_longer(*aabb, world_from_entity, metres);
        match placement.mesh.and_then(|mesh| self.items.shape(mesh)) {
            Some(Shape::Mesh(_, aabb)) if is_longer(aabb) => self.large.push((entity, metres)),
            Some(Shape::Model(_, aabb, _)) if is_longer(aabb) => {
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

    pub(super) fn enclose(&mut self, aabb: Aabb) {
        self.found.bounds = Some(self.found.bounds.map_or(aabb, |bounds| bounds.union(aabb)));
    }

    fn model(
        &mut self,
        model: &Model,
        at: Transform,
        material: Option<MaterialId>,
        no_shadow: &[MaterialId],
    ) -> Entity {
        let root = model.spawn(self.world, at);
        if !no_shadow.is_empty() {
            for entity in descendants(self.world, root) {
                if self.world.get::<MaterialId>(entity).is_some_and(|own| no_shadow.contains(own)) {
                    self.world.entity_mut(entity).insert(NoShadow);
                }
            }
        }
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
        let figure = MeshVariants { meshes, shown: 0 };
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
        let copies = generate::copies(generator, scene_seed, self.world);
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
            if placement.vehicle.is_none() || room.take(&placement, self.world) {
                self.entity(&generator.entity, &placement, None);
            }
        }
        if room.full > 0 {
            let warning = format!("{name}: {} of {} left out: no room between the others", room.full, copies.len());
            self.found.warnings.push(warning);
        }
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
