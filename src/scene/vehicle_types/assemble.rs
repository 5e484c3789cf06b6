//! A model and the names of its nodes become the parts of a vehicle type.
//!
//! The model's tree is flattened: what does not move is fixed to the vehicle, or to the moving part above it, by one
//! transform, so that a vehicle has no entity without a purpose.

use super::lamps::{self, Aim};
use super::placed_model::PlacedModel;
use super::roles::{Role, roles};
use super::wheels::{self, Wheel};
use crate::import::Model;
use crate::scene::format::entities::transform;
use crate::scene::format::vehicle_types::VehicleType as Source;
use glam::{Affine3A, Mat3A, Quat, Vec3, Vec3A};
use std::collections::HashMap;
use systems::assets::{Library, Material, MaterialId};
use systems::space::Transform;
use systems::vehicles::parts::{Movement, Part, PartLamp};
use systems::vehicles::proxies::add_proxies;
use systems::vehicles::types::{self, Limits, VehicleType};

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
        name,
        model,
        source,
        library,
        roles: roles(source, &named),
        placed: model.placed().into_iter().collect(),
        vehicle_from_model: transform(&source.transform).compute_affine(),
        wheels: Vec::new(),
        parts: Vec::new(),
        aims: HashMap::new(),
        painted: HashMap::new(),
        lit: HashMap::new(),
        warnings: Vec::new(),
    };
    for (node, count) in
        source.nodes().into_iter().map(|node| (node, model.nodes.iter().filter(|n| n.name == *node).count()))
    {
        if count > 1 {
            builder.warn(format_args!("{count} nodes are named {node:?}: the first is used"));
        }
    }
    builder.find_wheels();
    builder.stand_on_wheels();
    for node in builder.build() {
        builder.warn(format_args!("node {node:?} is sheared; it is drawn without the shear"));
    }
    // Before lamps are aimed, whose lights are to shine from before proxies, too.
    add_proxies(&mut builder.parts, builder.library);
    for warning in lamps::aim(&mut builder.parts, &builder.aims, builder.library) {
        builder.warn(warning);
    }
    for (index, node) in model.nodes.iter().enumerate() {
        let is_lamp = builder.roles.get(&index).is_some_and(|role| role.lamp.is_some());
        if node.light.is_some() && builder.placed.contains_key(&index) && !is_lamp {
            builder.warn(format_args!("the light at node {:?} belongs to none of its lamps and is ignored", node.name));
        }
    }
    warnings.append(&mut builder.warnings);
    builder.finish()
}

struct Builder<'a> {
    name: &'a str,
    model: &'a Model,
    source: &'a Source,
    library: &'a mut Library,
    roles: HashMap<usize, Role<'a>>,
    /// `model_from_node` of each node of the scene.
    placed: HashMap<usize, Affine3A>,
    vehicle_from_model: Affine3A,
    wheels: Vec<Wheel>,
    parts: Vec<Part>,
    /// Aims of the parts that are lamps.
    aims: HashMap<usize, Aim>,
    /// Materials in all paints.
    painted: HashMap<MaterialId, Vec<MaterialId>>,
    /// Lit twins, by the colour's bits.
    lit: HashMap<(MaterialId, [u32; 3]), MaterialId>,
    warnings: Vec<String>,
}

impl Builder<'_> {
    fn warn(&mut self, message: impl std::fmt::Display) {
        self.warnings.push(format!("vehicle type {:?}: {message}", self.name));
    }

    fn find_wheels(&mut self) {
        let (mut roles, mut warnings) = (std::mem::take(&mut self.roles), Vec::new());
        self.wheels = wheels::find(&self.placed_model(), &mut roles, &mut warnings);
        self.roles = roles;
        warnings.into_iter().for_each(|warning| self.warn(warning));
    }

    fn placed_model(&self) -> PlacedModel<'_> {
        let (model, library, placed) = (self.model, &*self.library, &self.placed);
        PlacedModel { model, library, placed, vehicle_from_model: self.vehicle_from_model }
    }

    /// The wheels that turn with the steering, by themselves or with a fork above, and those that do not; hub in
    /// vehicle space, and radius. A trailer's apart.
    fn axles(&self) -> [Vec<(Vec3, f32)>; 2] {
        let movement = |wheel: &Wheel| self.roles.get(&wheel.hangs_from?)?.movement;
        [true, false].map(|front| {
            let of_axle = self.wheels.iter().filter(|wheel| match movement(wheel) {
                Some(Movement::Trailer) => false,
                Some(Movement::Fork) => front,
                _ => wheel.steers == front,
            });
            of_axle.map(|wheel| (self.vehicle_from_model.transform_point3(wheel.hub), wheel.radius)).collect()
        })
    }

    /// Moves the model so that its wheels stand on the ground, the middle of its rear axle above the origin.
    fn stand_on_wheels(&mut self) {
        let [front, rear] = self.axles();
        let all = [front, rear.clone()].concat();
        let (Some(middle), Some(rear)) = (mean(&all), mean(&rear).or(mean(&all))) else { return };
        let bottom = all.iter().map(|(hub, radius)| hub.y - radius).fold(f32::INFINITY, f32::min);
        let origin = Vec3::new(middle.x, bottom, rear.z);
        self.vehicle_from_model = Affine3A::from_translation(-origin) * self.vehicle_from_model;
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
            let wheel = self.wheels.iter().position(|wheel| wheel.nodes.contains(&index));
            let below = if let Some(number) = wheel {
                self.wheel(number, index, parent, &place, &mut sheared)
            } else if role.movement.is_some() || role.lamp.is_some() {
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

    /// Adds the parts of a wheel's node; returns what is fixed to the wheel hangs from, and `part_from_node`.
    ///
    /// A node of one mesh with its origin at the hub turns by itself. For others there is a part without anything drawn
    /// that turns at the hub, about the vehicle's axes, from which they hang.
    fn wheel(
        &mut self,
        number: usize,
        index: usize,
        parent: Option<usize>,
        parent_from_node: &Affine3A,
        sheared: &mut Vec<String>,
    ) -> (Option<usize>, Affine3A) {
        let node = &self.model.nodes[index];
        let role = self.roles.get(&index).cloned().unwrap_or_default();
        let vehicle_from_parent = self.vehicle_from_part(parent);
        let wheel = &self.wheels[number];
        let movement = Some(Movement::Wheel { radius: wheel.radius, steers: wheel.steers });
        let hub = self.vehicle_from_model.transform_point3(wheel.hub);
        let scale = vehicle_from_parent.matrix3.x_axis.x;
        let is_straight = scale > 0.0
            && vehicle_from_parent.matrix3.abs_diff_eq(Mat3A::from_diagonal(Vec3::splat(scale)), 1e-5 * scale);
        let (rest, is_sheared) = decomposed(parent_from_node);
        let is_alone = wheel.nodes.len() == 1 && node.parts.len() < 2 && node.instances.is_empty();
        if is_straight && is_alone && wheel.is_at_origin && !is_sheared {
            return (Some(self.moving(index, parent, rest, &Role { movement, ..role })), Affine3A::IDENTITY);
        }
        let pivot = wheel.part.unwrap_or_else(|| {
            let part_from_vehicle = vehicle_from_parent.inverse();
            let (straight, is_sheared) = decomposed(&(part_from_vehicle * Affine3A::from_translation(hub)));
            let blank = Part { name: node.name.clone(), parent, ..Part::default() };
            if is_straight {
                let rest = Transform::from_translation(part_from_vehicle.transform_point3(hub));
                self.parts.push(Part { rest, movement, ..blank });
            } else {
                if is_sheared {
                    sheared.push(node.name.clone());
                }
                self.parts.push(Part { rest: straight, ..blank.clone() });
                self.parts.push(Part { parent: Some(self.parts.len() - 1), movement, ..blank });
            }
            self.parts.len() - 1
        });
        self.wheels[number].part = Some(pivot);
        let pivot_from_node = self.vehicle_from_part(Some(pivot)).inverse() * vehicle_from_parent * *parent_from_node;
        if role.lamp.is_some() {
            let (rest, is_sheared) = decomposed(&pivot_from_node);
            if is_sheared {
                sheared.push(node.name.clone());
            }
            let role = Role { movement: None, ..role };
            return (Some(self.moving(index, Some(pivot), rest, &role)), Affine3A::IDENTITY);
        }
        self.fixed(index, Some(pivot), &pivot_from_node, sheared);
        (Some(pivot), pivot_from_node)
    }

    /// While the vehicle stands straight.
    fn vehicle_from_part(&self, part: Option<usize>) -> Affine3A {
        let (mut vehicle_from_part, mut above) = (Affine3A::IDENTITY, part);
        while let Some(part) = above.and_then(|index| self.parts.get(index)) {
            vehicle_from_part = part.rest.compute_affine() * vehicle_from_part;
            above = part.parent;
        }
        vehicle_from_part
    }

    /// Adds the parts of a node that moves or shines; returns the first, from which others may hang.
    fn moving(&mut self, index: usize, parent: Option<usize>, rest: Transform, role: &Role) -> usize {
        let model = self.model;
        let node = &model.nodes[index];
        let light = role.lamp.and_then(|lamps| match &lamps.light {
            Some(light) => Some(light.into()),
            None => node.light.clone().map(|own| lamps::with_shadows(own, lamps.shadows)),
        });
        let glow = role.lamp.map(|lamps| {
            let own = light.as_ref().map_or(Vec3::ONE, |light| light.color);
            lamps.color.map_or(own, |color| color.rgb()) * lamps.glow
        });
        let first = self.parts.len();
        if let Some(lamps) = role.lamp {
            let direction = lamps.direction.map(Vec3::from_array);
            let is_flat = self.placed.get(&index).is_some_and(lamps::is_flat);
            self.aims.insert(first, Aim { direction, has_own_light: node.light.is_some(), is_flat });
        }
        // Instances of a node that moves would each need a rest of their own: they are fixed to it.
        let at_node = if node.instances.is_empty() { node.parts.as_slice() } else { &[] };
        let blank = Part { name: node.name.clone(), parent, rest, movement: role.movement, ..Part::default() };
        for number in 0..at_node.len().max(1) {
            let drawn = at_node.get(number).copied();
            let lit = drawn.zip(glow).map(|((_, material), glow)| self.lit(material, glow));
            let light = light.clone().filter(|_| number == 0);
            let lamp = role.lamp.map(|lamps| PartLamp { kind: lamps.kind, light, lit });
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

    fn finish(self) -> VehicleType {
        let s = self.source;
        let named = |node: &str| self.model.nodes.iter().position(|n| n.name == node);
        let trailer = s.trailer.as_ref().and_then(|trailer| Some((trailer, named(&trailer.node)?)));
        let whole = self.placed_model().bounds_of_all(trailer.map(|trailer| trailer.1));
        let size = s.size.map_or(whole.max - whole.min, Vec3::from_array).max(Vec3::splat(0.01));
        let [front, rear] = self.axles();
        let axles = mean(&front).zip(mean(&rear)).map(|(front, rear)| front.z - rear.z);
        let spread = |wheels: &[(Vec3, f32)]| {
            let x = wheels.iter().map(|(hub, _)| hub.x);
            (x.clone().fold(f32::NEG_INFINITY, f32::max) - x.fold(f32::INFINITY, f32::min)).max(0.0)
        };
        let trailer = trailer.map(|(trailer, node)| {
            let hitch = self.placed_model().origin(node).z;
            let end = hitch - self.placed_model().bounds_below(node, None).unwrap_or_default().min.z;
            types::Trailer { hitch, length: trailer.length, end: end.max(trailer.length) }
        });
        VehicleType {
            name: self.name.into(),
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
            class: s.class.clone(),
        }
    }
}

/// The middle of the hubs of wheels.
fn mean(wheels: &[(Vec3, f32)]) -> Option<Vec3> {
    (!wheels.is_empty()).then(|| wheels.iter().map(|(hub, _)| hub).sum::<Vec3>() / wheels.len() as f32)
}

/// Scale, rotation and translation of a place, and whether that is not all of it.
fn decomposed(place: &Affine3A) -> (Transform, bool) {
    let is_flat = |axis: &Vec3A| axis.length_squared() == 0.0;
    let axes = [place.matrix3.x_axis, place.matrix3.y_axis, place.matrix3.z_axis];
    let filled = Affine3A { matrix3: filled(axes), ..*place };
    let (mut scale, rotation, translation) = filled.to_scale_rotation_translation();
    axes.iter().zip(scale.as_mut()).filter(|(axis, _)| is_flat(axis)).for_each(|(_, scale)| *scale = 0.0);
    // Axes that lie in a plane are no rotation.
    let is_rotation = rotation.is_finite() && rotation.length_squared() > 0.0;
    let rotation = match rotation {
        _ if !is_rotation => Quat::IDENTITY,
        unit if unit.is_normalized() => unit,
        other => other.normalize(),
    };
    let transform = Transform { translation, rotation, scale };
    let again = transform.compute_affine();
    let error = (again.matrix3 - place.matrix3).abs();
    let error = error.x_axis.max(error.y_axis).max(error.z_axis).max_element();
    (transform, error > 1e-4 * scale.abs().max_element())
}

/// Axes of no length get that of 1 across the others: what is flat is turned some way all the same.
fn filled(mut axes: [Vec3A; 3]) -> Mat3A {
    for i in 0..3 {
        let (a, b) = (axes[(i + 1) % 3].normalize_or_zero(), axes[(i + 2) % 3].normalize_or_zero());
        if axes[i] == Vec3A::ZERO {
            let across = || (a + b).try_normalize().map_or(Vec3A::AXES[i], |along| along.any_orthonormal_vector());
            axes[i] = a.cross(b).try_normalize().unwrap_or_else(across);
        }
    }
    Mat3A::from_cols(axes[0], axes[1], axes[2])
}
