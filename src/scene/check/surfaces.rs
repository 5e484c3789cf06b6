//! Materials and meshes.

use super::walk::{Check, SIZES};
use crate::scene::format::surfaces::{Material, MeshSource, Sampler, Uv};
use crate::scene::text::faults::unknown;
use systems::assets::color_text::BRIGHTEST;

/// Segments of a procedural mesh in one direction.
const MOST_SEGMENTS: u32 = 1024;

impl<'a> Check<'a> {
    pub fn material(&mut self, m: &'a Material) {
        self.sampler(m.sampler);
        self.uv(m.uv);
        self.color("base_factor", m.base_factor, BRIGHTEST);
        if let Some(color) = m.specular_factor {
            self.color("specular_factor", color, BRIGHTEST);
        }
        self.color("emissive_factor", m.emissive_factor, BRIGHTEST);
        self.number("normal_scale", m.normal_scale, -100.0, 100.0);
        self.number("shininess", m.shininess, 0.0, 1e5);
        self.number("height_scale_uv", m.height_scale_uv, 0.0, 10.0);
        self.number("height_rest", m.height_rest, 0.0, 1.0);
        self.number("emboss_step_texels", m.emboss_step_texels, 0.0, 100.0);
        self.number("self_shadow", m.self_shadow, 0.0, 1.0);
        self.numbers("offset_matrix", m.offset_matrix.as_flattened(), -10.0, 10.0);
        for (name, value) in [
            ("alpha_cutoff", m.alpha_cutoff),
            ("base_alpha", m.base_alpha),
            ("specular_strength", m.specular_strength),
            ("glossiness", m.glossiness),
            ("metallic", m.metallic),
            ("roughness", m.roughness),
            ("occlusion_strength", m.occlusion_strength),
        ] {
            self.number(name, value, 0.0, 1.0);
        }
        if m.horizon_map_0.is_some() != m.horizon_map_1.is_some() {
            let missing = if m.horizon_map_0.is_some() { "horizon_map_1" } else { "horizon_map_0" };
            self.fault(format_args!("missing {missing}: each of the two horizon maps has four directions"));
        }
        for (name, map) in m.maps() {
            let Some(map) = map else { continue };
            self.field(name, |c| {
                c.sampler(map.sampler.unwrap_or_default());
                c.uv(map.uv.unwrap_or_default());
            });
        }
    }

    fn sampler(&mut self, s: Sampler) {
        if s.wrap.is_some() && (s.wrap_u.is_some() || s.wrap_v.is_some()) {
            self.field("sampler", |c| c.fault("expected either wrap, or wrap_u and wrap_v"));
        }
    }

    fn uv(&mut self, uv: Uv) {
        self.field("uv", |c| {
            c.numbers("scale", &uv.scale, -1e4, 1e4);
            c.numbers("offset", &uv.offset, -1e4, 1e4);
            c.number("rotation_degrees", uv.rotation_degrees, -1e6, 1e6);
            c.count("set", uv.set, 0, 1);
        });
    }

    pub fn mesh(&mut self, mesh: &'a MeshSource) {
        let size = |c: &mut Self, name, value| c.number(name, value, SIZES.0, SIZES.1);
        match mesh {
            MeshSource::Plane(m) => {
                self.numbers("size", &m.size, SIZES.0, SIZES.1);
                if m.segments.iter().any(|s| !(1..=MOST_SEGMENTS).contains(s)) {
                    let message = format!("expected counts from 1 to {MOST_SEGMENTS}, found {:?}", m.segments);
                    self.field("segments", |c| c.fault(message));
                }
                self.tiling(m.uv_scale, m.tile_metres);
            }
            MeshSource::Cube(m) => {
                self.scale("size", m.size, false);
                self.tiling(m.uv_scale, m.tile_metres);
            }
            MeshSource::Sphere(m) => {
                size(self, "radius", m.radius);
                self.count("segments", m.segments, 3, MOST_SEGMENTS);
                self.count("rings", m.rings, 2, MOST_SEGMENTS);
                self.tiling(m.uv_scale, None);
            }
            MeshSource::Torus(m) => {
                size(self, "major", m.major);
                size(self, "minor", m.minor);
                self.count("segments", m.segments, 3, MOST_SEGMENTS);
                self.count("sides", m.sides, 3, MOST_SEGMENTS);
                self.tiling(m.uv_scale, None);
            }
            MeshSource::Cylinder(m) => {
                size(self, "radius", m.radius);
                size(self, "height", m.height);
                self.count("segments", m.segments, 3, MOST_SEGMENTS);
                self.tiling(m.uv_scale, None);
            }
            MeshSource::Model(m) => {
                let (Some(node), Some(model)) = (&m.node, self.files.model(&m.file)) else { return };
                if !model.nodes.iter().any(|n| n.name == *node) {
                    let message = unknown("node", node, model.nodes.iter().map(|n| n.name.as_str()));
                    self.field("node", |c| c.fault(message));
                }
            }
        }
    }

    fn tiling(&mut self, uv_scale: [f32; 2], tile_metres: Option<f32>) {
        self.numbers("uv_scale", &uv_scale, -1e4, 1e4);
        if let Some(metres) = tile_metres {
            self.number("tile_metres", metres, 1e-3, 1e6);
        }
    }
}
