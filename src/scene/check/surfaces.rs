//! Materials and meshes.

use super::walk::Check;
use crate::scene::format::surfaces::{Material, MeshSource, Sampler};
use crate::scene::text::faults::unknown;

impl<'a> Check<'a> {
    pub fn material(&mut self, m: &'a Material) {
        self.described(m);
        self.sampler(m.sampler);
        if m.horizon_map_0.is_some() != m.horizon_map_1.is_some() {
            let missing = if m.horizon_map_0.is_some() { "horizon_map_1" } else { "horizon_map_0" };
            self.fault(format_args!("missing {missing}: each of the two horizon maps has four directions"));
        }
        for (name, map) in m.maps() {
            let Some(map) = map else { continue };
            self.field(name, |c| c.sampler(map.sampler.unwrap_or_default()));
        }
    }

    fn sampler(&mut self, s: Sampler) {
        if s.wrap.is_some() && (s.wrap_u.is_some() || s.wrap_v.is_some()) {
            self.field("sampler", |c| c.fault("expected either wrap, or wrap_u and wrap_v"));
        }
    }

    pub fn mesh(&mut self, mesh: &'a MeshSource) {
        self.described(mesh);
        let MeshSource::Model(m) = mesh else { return };
        let (Some(node), Some(model)) = (&m.node, self.files.model(&m.file)) else { return };
        if !model.nodes.iter().any(|n| n.name == *node) {
            let message = unknown("node", node, model.nodes.iter().map(|n| n.name.as_str()));
            self.field("node", |c| c.fault(message));
        }
    }
}
