//! Pictures of light: how lamps and suns, their shadows and all bump techniques light a surface. What is here passes on
//! every driver.

#[path = "../common/mod.rs"]
mod common;
mod light_pictures;
mod many_lights;
mod oracle;
mod popping;
mod shadow_maps;
mod shadow_updates;
mod sun_shadows;
mod technique_sets;
mod technique_symmetries;
mod techniques;
