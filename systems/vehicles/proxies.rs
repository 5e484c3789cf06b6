//! Proxies of vehicles: what is drawn in the place of a type's parts where the vehicle is small in the picture.
//!
//! A vehicle has a [proxy](crate::assets::proxy), and so has its trailer, which swings. A proxy hangs from the largest
//! part that does not move and has its place. Parts in the same place go by the same sphere, bit for bit. Spheres of the
//! others enclose it wherever they are turned to: they are drawn until the proxy is, and a little longer. Lamps stay,
//! whose light is seen from afar, and so does what is not opaque.

use super::parts::{Drawn, Movement, Part};
use crate::assets::library::Library;
use crate::assets::material::{AlphaMode, Map, Material, MaterialId, Shading};
use crate::assets::mesh::{Mesh, MeshId};
use crate::assets::proxy::{Member, join, subdivided};
use crate::assets::technique::Technique;
use crate::assets::texels::Texture;
use crate::space::bounds::Sphere;
use glam::{Affine3A, Vec3, Vec4};
use std::collections::BTreeMap;

/// Texels along a side of maps whose colours vertices get.
const MOST_TEXELS: u32 = 256;
/// Edges of meshes are split for their colours where they are longer than this part of the largest part's diameter.
const LONGEST_EDGE: f32 = 1.0 / 48.0;
/// Room for rounding where a part does not have the proxy's place, as a part of lengths.
const ROOM: f32 = 1e-3;
/// Metres that springs move wheels from their places at rest, at most.
const SPRINGS: f32 = 0.5;

/// Gives the parts of a type proxies, and their meshes an end to their levels.
pub fn add_proxies(parts: &mut [Part], library: &mut Library) {
    let trailers = (0..parts.len()).filter(|&part| parts[part].movement == Some(Movement::Trailer)).map(Some);
    for base in std::iter::once(None).chain(trailers.collect::<Vec<_>>()) {
        add_proxy(parts, base, library);
    }
}

/// A part that a proxy is drawn in the place of.
struct Replaced {
    part: usize,
    mesh: MeshId,
    material: MaterialId,
    /// Its place at rest below the base.
    base_from_part: Affine3A,
    /// It, or a part that it hangs from, moves against the base: the highest one's origin, in the base's space, and the
    /// longest way from there to the origin of its mesh, metres.
    moved: Option<(Vec3, f32)>,
}

/// The proxy of what hangs from a base, the vehicle or its trailer.
fn add_proxy(parts: &mut [Part], base: Option<usize>, library: &mut Library) {
    let replaced: Vec<Replaced> =
        (0..parts.len()).filter_map(|part| Replaced::of(parts, part, base, library)).collect();
    let triangles = |replaced: &Replaced| library.mesh(replaced.mesh).map_or(0, |entry| entry.mesh.triangle_count());
    let still = replaced.iter().filter(|replaced| replaced.moved.is_none());
    let Some(anchor) = still.max_by_key(|still| (triangles(still), std::cmp::Reverse(still.part))) else { return };
    let (anchor_part, anchor_from_base) = (anchor.part, anchor.base_from_part.inverse());
    let diameter = library.mesh(anchor.mesh).map_or(0.0, |entry| 2.0 * entry.bounds.radius);
    let mut surfaces = Surfaces::default();
    let members: Vec<Member> = replaced
        .iter()
        .filter_map(|replaced| {
            let proxy_from_mesh = anchor_from_base * replaced.base_from_part;
            let scale = Sphere { center: Vec3::ZERO, radius: 1.0 }.transformed(&proxy_from_mesh).radius;
            let drawn = &library.mesh(replaced.mesh)?.mesh;
            let (triangles, mesh) = (drawn.triangle_count(), subdivided(drawn, LONGEST_EDGE * diameter / scale));
            let painted = &parts[replaced.part].painted;
            let (surface, colors) = surfaces.add(library, &mesh, replaced.material, painted)?;
            Some(Member { mesh, triangles, proxy_from_mesh, colors, surface })
        })
        .collect();
    let Some(proxy) = join(&members, surfaces.0.len()) else { return };
    let (bounds, error) = (proxy.bounds, proxy.error);
    let ends = Ends { bounds, error, anchor: anchor.base_from_part };
    let mut of_meshes: BTreeMap<MeshId, (Vec<usize>, Sphere, f32)> = BTreeMap::new();
    for replaced in &replaced {
        let (sphere, error) = ends.of(replaced);
        let of_mesh = of_meshes.entry(replaced.mesh).or_insert((Vec::new(), sphere, error));
        of_mesh.0.push(replaced.part);
        of_mesh.1 = enclosing(of_mesh.1, sphere);
        of_mesh.2 = of_mesh.2.max(error);
    }
    for (mesh, (users, sphere, error)) in of_meshes {
        let is_used_else = parts
            .iter()
            .enumerate()
            .any(|(i, part)| part.drawn.is_some_and(|(own, _)| own == mesh) && !users.contains(&i));
        let entry = library.mesh(mesh);
        let own = match entry.filter(|entry| is_used_else || entry.ends_at.is_some()).map(|entry| entry.mesh.clone()) {
            Some(copy) => library.add_mesh(copy),
            None => mesh,
        };
        library.end_levels(own, sphere, error);
        for user in users {
            parts[user].drawn = parts[user].drawn.map(|(_, material)| (own, material));
        }
    }
    let drawn = surfaces.0.into_iter().zip(proxy.surfaces).filter(|(_, entry)| entry.is_drawn());
    let drawn: Vec<Drawn> = drawn.map(|(surface, entry)| surface.drawn(library, entry)).collect();
    parts[anchor_part].proxies = drawn;
}

impl Replaced {
    /// `None` for a part that is not drawn, that a proxy does not show, or that hangs from another base.
    fn of(parts: &[Part], part: usize, base: Option<usize>, library: &Library) -> Option<Self> {
        let own = parts.get(part)?;
        let (mesh, material) = own.drawn.filter(|_| own.lamp.is_none())?;
        let shown = library.material(material)?;
        let is_plain = shown.alpha == AlphaMode::Opaque
            && shown.shading != Shading::Unlit
            && shown.emissive_factor == Vec3::ZERO
            && shown.environment_map.is_none();
        if !is_plain || library.mesh(mesh)?.mesh.indices.is_empty() {
            return None;
        }
        let (mut base_from_part, mut moved, mut above) = (Affine3A::IDENTITY, None, Some(part));
        while above != base {
            let part = parts.get(above?)?;
            if part.movement == Some(Movement::Trailer) {
                return None;
            }
            if part.movement.is_some() {
                let reach = match moved {
                    Some((at, reach)) => Vec3::length(at) + reach,
                    None => base_from_part.translation.length(),
                };
                moved = Some((Vec3::ZERO, reach));
            }
            let parent_from_part = part.rest.compute_affine();
            let scale = part.rest.scale.abs().max_element();
            moved = moved.map(|(at, reach)| (parent_from_part.transform_point3(at), reach * scale));
            base_from_part = parent_from_part * base_from_part;
            above = part.parent;
        }
        Some(Self { part, mesh, material, base_from_part, moved })
    }
}

/// The end of the levels of parts that a proxy replaces.
struct Ends {
    /// In the space of the part that it hangs from.
    bounds: Sphere,
    /// Metres in that space.
    error: f32,
    /// The place of that part, below the base.
    anchor: Affine3A,
}

impl Ends {
    /// The sphere by which a part chooses its levels, and the error where they end; its mesh's space.
    fn of(&self, replaced: &Replaced) -> (Sphere, f32) {
        if replaced.moved.is_none() && replaced.base_from_part == self.anchor {
            return (self.bounds, self.error);
        }
        let of_base = self.bounds.transformed(&self.anchor);
        let scale = |place: &Affine3A| Sphere { center: Vec3::ZERO, radius: 1.0 }.transformed(place).radius;
        let part_from_base = replaced.base_from_part.inverse();
        let sphere = match replaced.moved {
            None => of_base.transformed(&part_from_base),
            Some((pivot, reach)) => {
                let radius = of_base.radius + pivot.distance(of_base.center) + reach + SPRINGS;
                Sphere { center: Vec3::ZERO, radius: radius * scale(&part_from_base) }
            }
        };
        let error = self.error * scale(&self.anchor) / scale(&replaced.base_from_part).max(f32::MIN_POSITIVE);
        (Sphere { radius: sphere.radius * (1.0 + ROOM), ..sphere }, error * (1.0 + ROOM))
    }
}

/// A sphere around two.
fn enclosing(a: Sphere, b: Sphere) -> Sphere {
    if a == b { a } else { Sphere { radius: a.radius.max(a.center.distance(b.center) + b.radius), ..a } }
}

/// Materials of a proxy.
#[derive(Default)]
struct Surfaces(Vec<Surface>);

/// Members with one material in the proxy: those that are painted alike, or all that are not painted.
struct Surface {
    painted: Vec<MaterialId>,
    /// Sums of its members' numbers, by the areas of their meshes.
    area: f32,
    sum: Material,
    /// By area.
    shadings: Vec<(Shading, f32)>,
}

impl Surfaces {
    /// The surface of a mesh with a material, and the colours of the mesh's vertices; `None` for one without triangles.
    fn add(
        &mut self,
        library: &Library,
        mesh: &Mesh,
        material: MaterialId,
        painted: &[MaterialId],
    ) -> Option<(usize, Vec<Vec3>)> {
        let material = library.material(material)?;
        let place = self.0.iter().position(|surface| surface.painted == painted).unwrap_or_else(|| {
            self.0.push(Surface::new(painted));
            self.0.len() - 1
        });
        let of_vertices = |map: Option<Map>| -> Vec<Vec4> {
            let texture = map.and_then(|map| Some((map, Texture::new(library.image(map.image)?, MOST_TEXELS)?)));
            let Some((map, texture)) = texture else { return vec![Vec4::ONE; mesh.positions.len()] };
            let set = &mesh.uvs[usize::from(map.uv_set == 1 && !mesh.uvs[1].is_empty())];
            let texel = |uv| texture.sample(map.image_from_mesh_uv.transform_point2(uv), &map.sampler);
            let mut texels: Vec<Vec4> = set.iter().map(|&uv| texel(uv)).collect();
            texels.iter_mut().filter(|texel| !texel.is_finite()).for_each(|texel| *texel = Vec4::ONE);
            texels.resize(mesh.positions.len(), Vec4::ONE);
            texels
        };
        let mean = |map: Option<Map>| {
            let texels = of_vertices(map);
            texels.iter().sum::<Vec4>() / texels.len().max(1) as f32
        };
        let (specular, metal_rough) = (mean(material.specular_map), mean(material.metallic_roughness_map));
        let surface = &mut self.0[place];
        let area = area(mesh);
        surface.area += area;
        let sum = &mut surface.sum;
        sum.specular_factor += material.specular_factor * specular.truncate() * area;
        sum.specular_strength += material.specular_strength * specular.w * area;
        sum.shininess += material.shininess * area;
        sum.glossiness += material.glossiness * specular.w * area;
        sum.metallic += material.metallic * metal_rough.z * area;
        sum.roughness += material.roughness * metal_rough.y * area;
        match surface.shadings.iter_mut().find(|(shading, _)| *shading == material.shading) {
            Some((_, known)) => *known += area,
            None => surface.shadings.push((material.shading, area)),
        }
        // Paints have their factors in their materials.
        let factor = if painted.is_empty() { material.base_factor.truncate() } else { Vec3::ONE };
        let colored = |(i, texel): (usize, Vec4)| {
            let own = mesh.colors.get(i).map_or(Vec3::ONE, |color| color.truncate());
            (texel.truncate() * factor * own).clamp(Vec3::ZERO, Vec3::ONE)
        };
        Some((place, of_vertices(material.base_map).into_iter().enumerate().map(colored).collect()))
    }
}

impl Surface {
    fn new(painted: &[MaterialId]) -> Self {
        let none = Material {
            specular_factor: Vec3::ZERO,
            specular_strength: 0.0,
            shininess: 0.0,
            glossiness: 0.0,
            metallic: 0.0,
            roughness: 0.0,
            ..Material::default()
        };
        Self { painted: painted.to_vec(), area: 0.0, sum: none, shadings: Vec::new() }
    }

    /// Adds its mesh and its materials to the library.
    fn drawn(self, library: &mut Library, entry: crate::assets::mesh::MeshEntry) -> Drawn {
        let Self { painted, area, sum, shadings } = self;
        let shading = shadings.into_iter().max_by(|a, b| a.1.total_cmp(&b.1)).map_or(Shading::default(), |most| most.0);
        let share = if area > 0.0 { area.recip() } else { 0.0 };
        let plain = Material {
            name: "proxy".into(),
            shading,
            technique: Technique::Off,
            specular_factor: sum.specular_factor * share,
            specular_strength: sum.specular_strength * share,
            shininess: sum.shininess * share,
            glossiness: sum.glossiness * share,
            metallic: sum.metallic * share,
            roughness: sum.roughness * share,
            ..Material::new(shading)
        };
        let in_paint = |paint: &MaterialId, library: &mut Library| {
            let base_factor = library.material(*paint).map_or(Vec4::ONE, |paint| paint.base_factor);
            library.add_material(Material { base_factor, ..plain.clone() })
        };
        let painted: Vec<MaterialId> = painted.iter().map(|paint| in_paint(paint, library)).collect();
        let material = match painted.first() {
            Some(&first) => first,
            None => library.add_material(Material { base_factor: Vec4::ONE, ..plain }),
        };
        Drawn { mesh: library.add_entry(entry), material, painted }
    }
}

/// Square metres of a mesh.
fn area(mesh: &Mesh) -> f32 {
    let triangles = mesh.indices.as_chunks::<3>().0.iter();
    let corners = triangles.map(|triangle| triangle.map(|index| mesh.positions.get(index as usize).copied()));
    let area = |[a, b, c]: [Option<Vec3>; 3]| Some((b? - a?).cross(c? - a?).length() / 2.0);
    corners.filter_map(area).sum()
}
