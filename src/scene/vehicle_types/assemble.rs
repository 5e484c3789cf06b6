//! A model and the names of its nodes become the parts of a vehicle type.
//!
//! The model's tree is flattened: what does not move is fixed to the vehicle, or to the moving part above it, by one
//! transform, so that a vehicle has no entity without a purpose.

use super::format::{Lamps, VehicleType as Source};
use crate::import::Model;
use crate::scene::spawn;
use glam::{Affine3A, Vec3, Vec3A};
use std::collections::HashMap;
use systems::bounds::{Aabb, Sphere};
use systems::components::LightKind;
use systems::library::{Library, Material, MaterialId};
use systems::transform::Transform;
use systems::vehicles::parts::{Movement, Part, PartLamp};
use systems::vehicles::types::{self, Limits, VehicleType};

/// What a node of the model is to the vehicle.
#[derive(Default, Clone)]
struct Role<'a> {
    movement: Option<Movement>,
    /// A wheel that the vehicle stands on.
    carries: bool,
    lamp: Option<&'a Lamps>,
}

/// A checked type, with its materials in the library. `warnings` are added to.
pub fn assemble(
    name: &str,
    source: &Source,
    model: &Model,
    library: &mut Library,
    warnings: &mut Vec<String>,
) -> VehicleType {
    let named = |node: &str| model.nodes.iter().position(|n| n.name == node);
    let mut builder = Builder {
        model,
        source,
        library,
        roles: roles(source, &named),
        placed: model.placed().into_iter().collect(),
        vehicle_from_model: spawn::transform(&source.transform).compute_affine(),
        parts: Vec::new(),
        painted: HashMap::new(),
        lit: HashMap::new(),
    };
    builder.measure_wheels();
    builder.stand_on_wheels();
    for node in builder.build() {
        warnings.push(format!("vehicle type {name:?}: node {node:?} is sheared; it is drawn without that"));
    }
    for (index, node) in model.nodes.iter().enumerate() {
        let is_lamp = builder.roles.get(&index).is_some_and(|role| role.lamp.is_some());
        if node.light.is_some() && builder.placed.contains_key(&index) && !is_lamp {
            let node = &node.name;
            warnings
                .push(format!("vehicle type {name:?}: the light at node {node:?} is no lamp of it and is left out"));
        }
    }
    builder.finish(name)
}

fn roles<'a>(source: &'a Source, named: &impl Fn(&str) -> Option<usize>) -> HashMap<usize, Role<'a>> {
    let mut roles: HashMap<usize, Role> = HashMap::new();
    for wheels in &source.wheels {
        let movement = Some(Movement::Wheel { radius: wheels.radius.unwrap_or(0.0), steers: wheels.steers });
        for index in wheels.nodes.iter().filter_map(|node| named(node)) {
            roles.insert(index, Role { movement, carries: true, lamp: None });
        }
    }
    let mut moves = |node: &str, movement: Movement| {
        if let Some(index) = named(node) {
            roles.entry(index).or_default().movement = Some(movement);
        }
    };
    for cranks in &source.cranks {
        let movement = Movement::Wheel { radius: cranks.radius, steers: false };
        cranks.nodes.iter().for_each(|node| moves(node, movement));
    }
    source.forks.iter().for_each(|node| moves(node, Movement::Fork));
    for swing in &source.swings {
        let movement =
            Movement::Swing { angle: swing.degrees.to_radians(), stride: swing.stride_metres, phase: swing.phase };
        moves(&swing.node, movement);
    }
    if let Some(trailer) = &source.trailer {
        moves(&trailer.node, Movement::Trailer);
    }
    for lamps in &source.lamps {
        for index in lamps.nodes.iter().filter_map(|node| named(node)) {
            roles.entry(index).or_default().lamp = Some(lamps);
        }
    }
    roles
}

struct Builder<'a> {
    model: &'a Model,
    source: &'a Source,
    library: &'a mut Library,
    roles: HashMap<usize, Role<'a>>,
    /// `model_from_node` of each node of the scene.
    placed: HashMap<usize, Affine3A>,
    vehicle_from_model: Affine3A,
    parts: Vec<Part>,
    /// Materials in all paints.
    painted: HashMap<MaterialId, Vec<MaterialId>>,
    /// Lit twins, by the colour's bits.
    lit: HashMap<(MaterialId, [u32; 3]), MaterialId>,
}

impl Builder<'_> {
    /// The radii of wheels that say none: half their height.
    fn measure_wheels(&mut self) {
        for index in 0..self.model.nodes.len() {
            let bounds = self.bounds_below(index, None);
            if let Some(Role { movement: Some(Movement::Wheel { radius, .. }), .. }) = self.roles.get_mut(&index)
                && *radius == 0.0
            {
                *radius = ((bounds.max.y - bounds.min.y) / 2.0).max(0.01);
            }
        }
    }

    /// Nodes that are wheels, and whether they turn with the steering, by themselves or with a fork above.
    fn wheels(&self) -> Vec<(usize, bool)> {
        let mut wheels = Vec::new();
        let mut open: Vec<(usize, bool, bool)> = self.model.roots.iter().map(|&root| (root, false, false)).collect();
        while let Some((index, in_fork, in_trailer)) = open.pop() {
            let role = self.roles.get(&index);
            let (movement, carries) = role.map_or((None, false), |role| (role.movement, role.carries));
            let in_fork = in_fork || movement == Some(Movement::Fork);
            let in_trailer = in_trailer || movement == Some(Movement::Trailer);
            if let (Some(Movement::Wheel { steers, .. }), true, false) = (movement, carries, in_trailer) {
                wheels.push((index, steers || in_fork));
            }
            open.extend(self.model.nodes[index].children.iter().map(|&child| (child, in_fork, in_trailer)));
        }
        wheels.sort_unstable();
        wheels
    }

    /// The origin of a node, vehicle space.
    fn hub(&self, node: usize) -> Vec3 {
        let model_from_node = self.placed.get(&node).copied().unwrap_or_default();
        (self.vehicle_from_model * model_from_node).translation.into()
    }

    /// The hubs of the wheels that turn with the steering, and of those that do not; a trailer's apart.
    fn axles(&self) -> [Vec<Vec3>; 2] {
        let wheels = self.wheels();
        [true, false]
            .map(|front| wheels.iter().filter(|wheel| wheel.1 == front).map(|wheel| self.hub(wheel.0)).collect())
    }

    /// Moves the model so that its wheels stand on the ground, the middle of its rear axle above the origin.
    fn stand_on_wheels(&mut self) {
        let [front, rear] = self.axles();
        let all = [front, rear.clone()].concat();
        let (Some(middle), Some(rear)) = (mean(&all), mean(&rear).or(mean(&all))) else { return };
        let bottoms = self.wheels().into_iter().filter_map(|(node, _)| match self.roles.get(&node)?.movement {
            Some(Movement::Wheel { radius, .. }) => Some(self.hub(node).y - radius),
            _ => None,
        });
        let origin = Vec3::new(middle.x, bottoms.fold(f32::INFINITY, f32::min), rear.z);
        self.vehicle_from_model = Affine3A::from_translation(-origin) * self.vehicle_from_model;
    }

    /// The box around what is drawn at a node and below, but for another node and what is below that; vehicle space.
    fn bounds_below(&self, node: usize, but: Option<usize>) -> Aabb {
        let (mut open, mut boxes) = (vec![node], Vec::new());
        while let Some(index) = open.pop() {
            if Some(index) == but {
                continue;
            }
            let node = &self.model.nodes[index];
            open.extend(&node.children);
            let Some(model_from_node) = self.placed.get(&index) else { continue };
            for part_from in node.part_transforms() {
                let place = self.vehicle_from_model * *model_from_node * part_from.compute_affine();
                let meshes = node.parts.iter().filter_map(|&(mesh, _)| self.library.mesh(mesh));
                boxes.extend(meshes.map(|entry| entry.mesh.aabb().transformed(&place)));
            }
        }
        boxes.into_iter().reduce(Aabb::union).unwrap_or_default()
    }

    /// Makes the parts; returns the names of nodes that had to be straightened.
    fn build(&mut self) -> Vec<String> {
        let mut sheared = Vec::new();
        // Node, the part it hangs from, and `part_from_parent`.
        let mut open: Vec<(usize, Option<usize>, Affine3A)> =
            self.model.roots.iter().rev().map(|&root| (root, None, self.vehicle_from_model)).collect();
        while let Some((index, parent, part_from_parent)) = open.pop() {
            let model = self.model;
            let node = &model.nodes[index];
            let role = self.roles.get(&index).cloned().unwrap_or_default();
            let place = part_from_parent * node.transform.compute_affine();
            let (rest, is_sheared) = decomposed(&place);
            let below = if role.movement.is_some() || role.lamp.is_some() {
                if is_sheared {
                    sheared.push(node.name.clone());
                }
                (Some(self.moving(index, parent, rest, &role)), Affine3A::IDENTITY)
            } else {
                self.fixed(index, parent, &place, &mut sheared);
                (parent, place)
            };
            open.extend(node.children.iter().rev().map(|&child| (child, below.0, below.1)));
        }
        sheared
    }

    /// Adds the parts of a node that moves or shines; returns the first, from which others may hang.
    fn moving(&mut self, index: usize, parent: Option<usize>, rest: Transform, role: &Role) -> usize {
        let model = self.model;
        let node = &model.nodes[index];
        let light = role.lamp.and_then(|lamps| lamps.light.as_ref().map(spawn::light).or(node.light.clone()));
        let glow = role.lamp.map(|lamps| {
            let own = light.as_ref().map_or(Vec3::ONE, |light| light.color);
            lamps.color.map_or(own, |color| color.rgb()) * lamps.glow
        });
        let first = self.parts.len();
        // Instances of a node that moves would each need a rest of their own: they are fixed to it.
        let at_node = if node.instances.is_empty() { node.parts.as_slice() } else { &[] };
        let blank = Part { name: node.name.clone(), parent, rest, movement: role.movement, ..Part::default() };
        for number in 0..at_node.len().max(1) {
            let drawn = at_node.get(number).copied();
            let lit = drawn.zip(glow).map(|((_, material), glow)| self.lit(material, glow));
            let light = light.clone().filter(|_| number == 0);
            let lamp = role.lamp.map(|lamps| PartLamp { kind: lamps.kind.into(), light, lit });
            let painted = drawn.map_or(Vec::new(), |(_, material)| self.painted(material));
            self.parts.push(Part { drawn, painted, lamp, ..blank.clone() });
        }
        for &instance in &node.instances {
            for &drawn in &node.parts {
                let painted = self.painted(drawn.1);
                let name = node.name.clone();
                let part =
                    Part { name, parent: Some(first), rest: instance, drawn: Some(drawn), painted, ..Part::default() };
                self.parts.push(part);
            }
        }
        first
    }

    fn fixed(&mut self, index: usize, parent: Option<usize>, place: &Affine3A, sheared: &mut Vec<String>) {
        let model = self.model;
        let node = &model.nodes[index];
        for part_from in node.part_transforms() {
            let (rest, is_sheared) = decomposed(&(*place * part_from.compute_affine()));
            if is_sheared && !node.parts.is_empty() {
                sheared.push(node.name.clone());
            }
            for &drawn in &node.parts {
                let painted = self.painted(drawn.1);
                self.parts.push(Part {
                    name: node.name.clone(),
                    parent,
                    rest,
                    drawn: Some(drawn),
                    painted,
                    ..Part::default()
                });
            }
        }
    }

    /// A material in all paints of the type; none where it is not painted.
    fn painted(&mut self, material: MaterialId) -> Vec<MaterialId> {
        let Some(paint) = &self.source.paint else { return Vec::new() };
        let Some(plain) = self.library.material(material).cloned() else { return Vec::new() };
        if !paint.materials.contains(&plain.name) {
            return Vec::new();
        }
        let library = &mut *self.library;
        let mut in_color = |rgb: Vec3| {
            let base_factor = plain.base_factor * rgb.extend(1.0);
            library.add_material(Material { base_factor, ..plain.clone() })
        };
        let all = || paint.colors.iter().map(|color| in_color(color.rgb())).collect();
        self.painted.entry(material).or_insert_with(all).clone()
    }

    /// The same glass, glowing: brighter where its base colour is.
    fn lit(&mut self, material: MaterialId, glow: Vec3) -> MaterialId {
        let key = (material, glow.to_array().map(f32::to_bits));
        let library = &mut *self.library;
        *self.lit.entry(key).or_insert_with(|| {
            let dark = library.material(material).cloned().unwrap_or_default();
            let (emissive_factor, emissive_map) = (glow, dark.emissive_map.or(dark.base_map));
            library.add_material(Material { emissive_factor, emissive_map, ..dark })
        })
    }

    fn finish(mut self, name: &str) -> VehicleType {
        shine_from_outside(&mut self.parts, self.library);
        let s = self.source;
        let named = |node: &str| self.model.nodes.iter().position(|n| n.name == node);
        let trailer = s.trailer.as_ref().and_then(|trailer| Some((trailer, named(&trailer.node)?)));
        let roots = self.model.roots.iter();
        let whole = roots.map(|&root| self.bounds_below(root, trailer.map(|trailer| trailer.1)));
        let whole = whole.reduce(Aabb::union).unwrap_or_default();
        let size = s.size.map_or(whole.max - whole.min, Vec3::from_array).max(Vec3::splat(0.01));
        let [front, rear] = self.axles();
        let axles = mean(&front).zip(mean(&rear)).map(|(front, rear)| front.z - rear.z);
        let spread = |hubs: &[Vec3]| {
            let x = hubs.iter().map(|hub| hub.x);
            (x.clone().fold(f32::NEG_INFINITY, f32::max) - x.fold(f32::INFINITY, f32::min)).max(0.0)
        };
        let trailer = trailer.map(|(trailer, node)| {
            let hitch = self.hub(node).z;
            let end = hitch - self.bounds_below(node, None).min.z;
            types::Trailer { hitch, length: trailer.length, end: end.max(trailer.length) }
        });
        VehicleType {
            name: name.into(),
            size,
            rear_overhang: (-whole.min.z).clamp(0.0, size.z),
            wheelbase: s.wheelbase.or(axles.filter(|length| *length > 0.05)).unwrap_or((size.z * 0.6).max(0.05)),
            track: s.track.unwrap_or(spread(&rear)),
            mass: s.mass,
            limits: Limits {
                speed: s.limits.speed_kmh / 3.6,
                reverse_speed: s.limits.reverse_speed_kmh / 3.6,
                acceleration: s.limits.acceleration,
                braking: s.limits.braking,
                steering: s.limits.steering_degrees.to_radians(),
                steering_rate: s.limits.steering_degrees_per_second.to_radians(),
                lateral_acceleration: s.limits.lateral_acceleration,
            },
            driver: types::Driver {
                speed_factor: s.driver.speed_factor,
                headway: s.driver.headway_seconds,
                gap: s.driver.gap_metres,
                acceleration: s.driver.acceleration,
                braking: s.driver.braking,
                exponent: s.driver.exponent,
            },
            trailer,
            paints: s.paint.iter().flat_map(|paint| paint.colors.iter().map(|color| color.rgb())).collect(),
            eye: s.eye.map_or(Vec3::new(size.x * 0.2, size.y * 0.8, size.z * 0.3), Vec3::from_array),
            parts: self.parts,
        }
    }
}

/// Metres that a lamp's light is moved ahead of its glass, at most.
const AHEAD: f32 = 1.0;

/// Moves spot lights ahead, so that the vehicle's own parts are behind them and not, by their bounding spheres, among
/// what they light: an object has room for three lights, and its own do nothing for it.
fn shine_from_outside(parts: &mut Vec<Part>, library: &Library) {
    let mut places: Vec<Affine3A> = Vec::new();
    for part in &*parts {
        let parent = part.parent.and_then(|index| places.get(index).copied()).unwrap_or_default();
        places.push(parent * part.rest.compute_affine());
    }
    let spheres = |parts: &[Part]| -> Vec<Sphere> {
        let drawn = parts.iter().zip(&places).filter_map(|(part, place)| Some((part.drawn?.0, place)));
        drawn.filter_map(|(mesh, place)| Some(library.mesh(mesh)?.bounds.transformed(place))).collect()
    };
    let spheres = spheres(parts);
    for (index, place) in places.iter().enumerate() {
        let Some(lamp) = &mut parts[index].lamp else { continue };
        let Some(light) = lamp.light.take_if(|light| matches!(light.kind, LightKind::Spot { .. })) else { continue };
        let (kind, name) = (lamp.kind, parts[index].name.clone());
        let (apex, ahead) = (place.translation, -place.matrix3.z_axis.normalize_or_zero());
        let beyond = |sphere: &Sphere| (Vec3A::from(sphere.center) - apex).dot(ahead) + sphere.radius;
        let needed = spheres.iter().map(beyond).fold(0.0, f32::max) + 0.01;
        // The part may be scaled.
        let scale = place.matrix3.z_axis.length().max(1e-6);
        let rest = Transform::from_xyz(0.0, 0.0, -needed.min(AHEAD) / scale);
        let lamp = Some(PartLamp { kind, light: Some(light), lit: None });
        parts.push(Part { name, parent: Some(index), rest, lamp, ..Part::default() });
    }
}

fn mean(points: &[Vec3]) -> Option<Vec3> {
    (!points.is_empty()).then(|| points.iter().sum::<Vec3>() / points.len() as f32)
}

/// Scale, rotation and translation of a place, and whether that is not all of it.
fn decomposed(place: &Affine3A) -> (Transform, bool) {
    let (scale, rotation, translation) = place.to_scale_rotation_translation();
    let transform = Transform { translation, rotation, scale };
    let again = transform.compute_affine();
    let error = (again.matrix3 - place.matrix3).abs();
    let error = error.x_axis.max(error.y_axis).max(error.z_axis).max_element();
    (transform, error > 1e-4 * scale.abs().max_element())
}
