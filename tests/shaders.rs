//! The shaders by themselves: every module is valid, and its structs lie in memory as the Rust ones that fill them do.

use relief::renderer::{CullBatchRecord, CullDrawRecord, CullRecord, shaders};
use std::mem::offset_of;
use systems::draw_list::*;
use wgpu::naga;

fn parse(source: &str) -> naga::Module {
    naga::front::wgsl::parse_str(source).unwrap_or_else(|e| panic!("{}", e.emit_to_string(source)))
}

#[test]
fn every_shader_is_valid() {
    let mut failures = Vec::new();
    for (name, source) in shaders::ALL {
        let module = parse(source);
        let flags = naga::valid::ValidationFlags::all();
        let mut validator = naga::valid::Validator::new(flags, naga::valid::Capabilities::empty());
        if let Err(e) = validator.validate(&module) {
            failures.push(format!("{name}: {}", e.emit_to_string(source)));
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

/// Name and offset of every member of a WGSL struct, and the struct's size.
fn layout(module: &naga::Module, wanted: &str) -> (Vec<(String, usize)>, usize) {
    let found = module.types.iter().find(|(_, ty)| ty.name.as_deref() == Some(wanted));
    let Some((_, naga::Type { inner: naga::TypeInner::Struct { members, span }, .. })) = found else {
        panic!("no struct {wanted} in types.wgsl");
    };
    let members = members.iter().map(|m| (m.name.clone().unwrap_or_default(), m.offset as usize)).collect();
    (members, *span as usize)
}

/// Compares name and offset of every member, and the size.
macro_rules! assert_mirrored {
    ($module:expr, $wgsl:literal, $rust:ident { $($field:ident),+ $(,)? }) => {{
        // Names every field of the Rust struct: one that is added there and not here does not compile.
        let $rust { $($field: _),+ } = $rust::default();
        let rust = vec![$((stringify!($field).to_owned(), offset_of!($rust, $field))),+];
        let (wgsl, size) = layout($module, $wgsl);
        assert_eq!(wgsl, rust, "members of {}", $wgsl);
        assert_eq!(size, size_of::<$rust>(), "size of {}", $wgsl);
    }};
}

#[test]
fn shader_structs_mirror_the_draw_list() {
    let module = parse(shaders::FORWARD);
    assert_mirrored!(
        &module,
        "View",
        ViewRecord {
            clip_from_world,
            world_from_clip,
            eye,
            parallel,
            toward_eye,
            exposure,
            ambient,
            picked_entity,
            zenith,
            pad0,
            horizon,
            pad1,
            ground,
            pad2,
        }
    );
    assert_mirrored!(
        &module,
        "Instance",
        InstanceRecord {
            world_from_object,
            lights,
            material,
            weights,
            entity,
            remainder_ambient,
            reaching,
            remainder_direction,
            dropped,
            remainder_sides,
            pad0,
        }
    );
    assert_mirrored!(
        &module,
        "Light",
        LightRecord {
            position,
            kind,
            direction,
            inverse_range_squared,
            color,
            exponent,
            attenuation,
            cos_outer,
            ambient,
            cos_inner,
        }
    );
    assert_mirrored!(
        &module,
        "Material",
        MaterialRecord {
            base_factor,
            specular_factor,
            shininess,
            emissive_factor,
            normal_scale,
            metallic,
            roughness,
            occlusion_strength,
            alpha_cutoff,
            glossiness,
            specular_strength,
            height_scale_uv,
            second_uvs,
            layers,
            pad0,
            image_from_mesh_uv,
            offsets,
        }
    );
}

#[test]
fn the_structs_of_culling_mirror_the_renderers() {
    let module = parse(shaders::CULL);
    assert_mirrored!(
        &module,
        "Cull",
        CullRecord { planes, page_count, entry_count, draw_count, occlusion, size, pyramid_levels, allowed_error }
    );
    assert_mirrored!(&module, "CullBatch", CullBatchRecord { center, radius, errors });
    assert_mirrored!(&module, "CullDraw", CullDrawRecord { level, first_entry, end_entry, first_visible });
}

/// Constants that stand for the same on both sides.
#[test]
fn shader_constants_are_those_of_the_draw_list() {
    let module = parse(shaders::FORWARD);
    let constant = |name: &str| {
        let found = module.constants.iter().find(|(_, c)| c.name.as_deref() == Some(name));
        let (_, constant) = found.unwrap_or_else(|| panic!("no constant {name}"));
        match module.global_expressions[constant.init] {
            naga::Expression::Literal(naga::Literal::U32(v)) => v,
            naga::Expression::Literal(naga::Literal::AbstractInt(v)) => v as u32,
            naga::Expression::Literal(naga::Literal::I32(v)) => v as u32,
            ref other => panic!("{name} is {other:?}"),
        }
    };
    use relief::renderer::DebugView;
    use systems::library::{AlphaMode, Shading, Technique};
    let pairs = [
        ("LIGHT_POINT", LightRecord::POINT),
        ("LIGHT_SPOT_EXPONENT", LightRecord::SPOT_EXPONENT),
        ("LIGHT_SPOT_CONE", LightRecord::SPOT_CONE),
        ("LIGHT_DIRECTIONAL", LightRecord::DIRECTIONAL),
        ("LIGHT_OFF", LightRecord::OFF),
        ("NO_LIGHT", NO_LIGHT),
        ("MAP_BASE", MapSlot::Base as u32),
        ("MAP_NORMAL", MapSlot::Normal as u32),
        ("MAP_SPECULAR", MapSlot::Specular as u32),
        ("MAP_METALLIC_ROUGHNESS", MapSlot::MetallicRoughness as u32),
        ("MAP_OCCLUSION", MapSlot::Occlusion as u32),
        ("MAP_EMISSIVE", MapSlot::Emissive as u32),
        ("MAP_HEIGHT", MapSlot::Height as u32),
        ("TECHNIQUE_OFF", Technique::Off as u32),
        ("TECHNIQUE_NORMAL", Technique::Normal as u32),
        ("TECHNIQUE_PERTURBED_NORMAL", Technique::PerturbedNormal as u32),
        ("SHADING_PHONG", Shading::Phong as u32),
        ("SHADING_BLINN", Shading::Blinn as u32),
        ("SHADING_METALLIC_ROUGHNESS", Shading::MetallicRoughness as u32),
        ("SHADING_SPECULAR_GLOSSINESS", Shading::SpecularGlossiness as u32),
        ("SHADING_UNLIT", Shading::Unlit as u32),
        ("ALPHA_OPAQUE", AlphaMode::Opaque as u32),
        ("ALPHA_MASK", AlphaMode::Mask as u32),
        ("ALPHA_BLEND", AlphaMode::Blend as u32),
        ("DEBUG_BASE", DebugView::Base as u32),
        ("DEBUG_NORMAL", DebugView::Normal as u32),
        ("DEBUG_TANGENT", DebugView::Tangent as u32),
        ("DEBUG_LIGHT_COUNT", DebugView::LightCount as u32),
        ("DEBUG_THREE_LIGHTS", DebugView::ThreeLights as u32),
        ("DEBUG_ERROR_BOUND", DebugView::ErrorBound as u32),
    ];
    for (name, value) in pairs {
        assert_eq!(constant(name), value, "{name}");
    }
}
