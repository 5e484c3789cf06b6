//! Shadows: which lights have layers of the shadow maps, what casts into these, when they are drawn; and shadows that
//! rays found. May use `plan`, `gpu`, `resources` and `passes`.

pub(crate) mod lamp_layers;
pub(crate) mod layer_casters;
pub(crate) mod layer_light;
pub(crate) mod layer_set;
pub(crate) mod shadow;
pub(crate) mod shadow_layers;
pub(crate) mod shadow_maps;
pub(crate) mod shadow_pass;
pub(crate) mod sides;
pub(crate) mod sun_levels;
pub(crate) mod traced;
pub(crate) mod visible_casters;
