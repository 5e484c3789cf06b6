//! The shader sources, joined. WGSL has no imports; each module is types, then what it needs, in one string.

macro_rules! shader {
    ($($file:literal),+) => { concat!($(include_str!(concat!("../../../shaders/", $file)), "\n"),+) };
}

/// `$shadows`: what says which lights are seen.
macro_rules! forward {
    ($shadows:literal) => {
        shader!(
            "types.wgsl",
            "sky.wgsl",
            "openness.wgsl",
            "bump.wgsl",
            "bumped.wgsl",
            "height_field.wgsl",
            "emboss.wgsl",
            "dot3.wgsl",
            "environment_bump.wgsl",
            "lighting.wgsl",
            "specular_aa.wgsl",
            "debug.wgsl",
            $shadows,
            "forward.wgsl"
        )
    };
}

/// Objects: colour, and the outputs beside it.
pub const FORWARD: &str = forward!("unshadowed.wgsl");

/// The same with shadow maps.
pub const FORWARD_SHADOWED: &str = forward!("shadows.wgsl");

/// The same with shadows that were found by rays.
pub const FORWARD_TRACED: &str = forward!("traced_shadows.wgsl");

/// Casters into shadow maps.
pub const SHADOW_PASS: &str = shader!("types.wgsl", "shadow_pass.wgsl");

/// The sky behind everything.
pub const SKY: &str = shader!("types.wgsl", "sky.wgsl", "sky_pass.wgsl");

/// Culling of a view's objects.
pub const CULL: &str = shader!("types.wgsl", "cull.wgsl");

/// The debug view of cells.
pub const CELLS: &str = shader!("types.wgsl", "cells.wgsl");

/// The farthest depths, for finding what is hidden.
pub const PYRAMID: &str = shader!("pyramid.wgsl");

/// Records into a table.
pub const SCATTER: &str = shader!("scatter.wgsl");

/// Packing of what views show into arrays.
pub const PACK: &str = shader!("pack.wgsl");

/// HDR to screen.
pub const TONE_MAP: &str = shader!("tone.wgsl", "tonemap.wgsl");

/// Every module with its name, for the tests that validate them.
pub const ALL: [(&str, &str); 11] = [
    ("forward", FORWARD),
    ("forward with shadow maps", FORWARD_SHADOWED),
    ("forward with traced shadows", FORWARD_TRACED),
    ("shadow pass", SHADOW_PASS),
    ("sky", SKY),
    ("cull", CULL),
    ("cells", CELLS),
    ("pyramid", PYRAMID),
    ("scatter", SCATTER),
    ("pack", PACK),
    ("tonemap", TONE_MAP),
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::renderer::culling::cull::Phase;
    use crate::renderer::culling::{cpu_culling, cull, pyramid};
    use crate::renderer::passes::emboss::EmbossPass;
    use crate::renderer::passes::pack;
    use crate::renderer::passes::pass::{Attached, Pass};
    use crate::renderer::passes::pipelines::object_constants;
    use crate::renderer::plan::settings::{DebugView, HeatScale};
    use crate::renderer::resources::{scatter, sky, tables};
    use crate::renderer::shadows::{lamp_layers, shadow_layers, sun_levels, traced};
    use std::collections::{BTreeMap, BTreeSet};
    use systems::assets::{AlphaMode, MapSlot, Shading, Technique};
    use systems::cells::Sight;
    use systems::draw::{InstanceRecord, MaterialRecord, Movers, PAGE_SLOTS, PipelineKey, ToneMap};
    use systems::lights::{LightListPage, LightLists, LightRecord, NO_LIGHT, PackedLight};
    use systems::weather::SkyMap;
    use systems::weather::openness::{Openness, Room};
    use wgpu::naga;

    /// Constants that stand for the same in shaders and in Rust, with what Rust has. A name is in here more than once
    /// where several of Rust's are its twins.
    fn pairs() -> Vec<(String, f64)> {
        let number = |name, value: u32| (name, f64::from(value));
        let legend = |view: DebugView| {
            let ticks = view.heat_scale().expect("a heat map").ticks;
            ticks.iter().map(|tick| tick.parse::<f64>().expect("a number")).collect::<Vec<_>>()
        };
        let (counts, bounds) = (legend(DebugView::LightCount), legend(DebugView::ErrorBound));
        let step_of = |pass: EmbossPass| pass.constants().0;
        let techniques = Technique::ALL.map(|(name, technique)| (constant("TECHNIQUE", name), technique as u32));
        let tone_maps = ToneMap::ALL.map(|(name, map)| (constant("TONE_MAP", name), map as u32));
        // Shaders have no name for the lit picture.
        let views = DebugView::ALL.into_iter().filter(|(_, view)| *view != DebugView::Off);
        let views = views.map(|(name, view)| (constant("DEBUG", name), view as u32));
        let lights = LightRecord::KINDS.map(|(name, kind)| (constant("LIGHT", name), kind));
        let listed = techniques
            .into_iter()
            .chain(tone_maps)
            .chain(views)
            .chain(lights)
            .map(|(name, value)| (name, f64::from(value)));
        let others = [
            number("PAGE_SLOTS", PAGE_SLOTS),
            number("ROW", cull::ROW),
            number("ROW", scatter::ROW),
            number("ROW", pack::ROW),
            ("EARLY", Phase::Early.bit()),
            ("LATE", Phase::Late.bit()),
            number("SLICES", cull::SLICES),
            number("COARSE", cpu_culling::COARSE),
            number("TOGETHER", cull::TOGETHER),
            number("BLOCK", cull::BLOCK),
            number("MOST_PLANES", Sight::MOST as u32),
            ("END_OF_CELL", Sight::CELL.into()),
            ("END_OF_WINDOW", Sight::WINDOW.into()),
            ("END_OF_OUTSIDE", Sight::OUTSIDE.into()),
            ("END_OF_SIGHT", Sight::END.into()),
            ("TABLE_WIDTH", tables::TABLE_WIDTH as f64),
            ("INSTANCE_TEXELS", size_of::<InstanceRecord>() as f64 / 16.0),
            ("MATERIAL_TEXELS", size_of::<MaterialRecord>() as f64 / 16.0),
            ("LIGHT_TEXELS", size_of::<PackedLight>() as f64 / 16.0),
            ("LIST_TEXELS", size_of::<LightListPage>() as f64 / 16.0),
            number("LISTED", LightLists::LISTED),
            number("ANOTHER_SURFACE", traced::ANOTHER_SURFACE),
            number("NO_LIGHT", NO_LIGHT),
            number("LAYER_BITS", u8::MAX.into()),
            ("WIDEST", f64::from(shadow_layers::WIDEST_FILTER) - 0.5),
            ("SHADOW_GUTTER", lamp_layers::GUTTER.into()),
            ("FIRST_TEXEL", sun_levels::FIRST_TEXEL.into()),
            ("SUN_DEPTH", sun_levels::DEPTH.into()),
            ("LEVEL_USED", sun_levels::LOOKED_UP[1].into()),
            ("LEVEL_ALONE", (2.0 * sun_levels::LOOKED_UP[0] / sun_levels::LOOKED_UP[1]).into()),
            number("MAP_BASE", MapSlot::Base as u32),
            number("MAP_NORMAL", MapSlot::Normal as u32),
            number("MAP_SPECULAR", MapSlot::Specular as u32),
            number("MAP_METALLIC_ROUGHNESS", MapSlot::MetallicRoughness as u32),
            number("MAP_OCCLUSION", MapSlot::Occlusion as u32),
            number("MAP_EMISSIVE", MapSlot::Emissive as u32),
            number("MAP_HEIGHT", MapSlot::Height as u32),
            number("MAP_HORIZON_0", MapSlot::Horizon0 as u32),
            number("MAP_HORIZON_1", MapSlot::Horizon1 as u32),
            number("MAP_OFFSET", MapSlot::Offset as u32),
            number("MAP_ENVIRONMENT", MapSlot::Environment as u32),
            number("SHADING_PHONG", Shading::Phong as u32),
            number("SHADING_BLINN", Shading::Blinn as u32),
            number("SHADING_METALLIC_ROUGHNESS", Shading::MetallicRoughness as u32),
            number("SHADING_SPECULAR_GLOSSINESS", Shading::SpecularGlossiness as u32),
            number("SHADING_UNLIT", Shading::Unlit as u32),
            number("ALPHA_OPAQUE", AlphaMode::Opaque as u32),
            number("ALPHA_MASK", AlphaMode::Mask as u32),
            number("ALPHA_BLEND", AlphaMode::Blend as u32),
            number("EMBOSS_HEIGHT", step_of(EmbossPass::Height { light: 2 })),
            number("EMBOSS_SHIFTED", step_of(EmbossPass::Shifted { light: 2 })),
            number("EMBOSS_DIFFUSE", step_of(EmbossPass::Diffuse { light: 2 })),
            number("EMBOSS_CLAMPED", step_of(EmbossPass::Clamped)),
            number("EMBOSS_COLORED", step_of(EmbossPass::Colored { light: 2 })),
            number("EMBOSS_OPAQUE", step_of(EmbossPass::Opaque)),
            number("SKY_LEVELS", SkyMap::LEVELS as u32),
            ("OPENNESS_SPACING", Openness::SPACING.into()),
            number("OPENNESS_CORNERS", Openness::CORNERS),
            ("OPENNESS_OFFSET", Openness::OFFSET.into()),
            ("ROOM_MARGIN", Room::INSET.into()),
            number("MOVERS_WIDTH", sky::MOVERS_WIDTH),
            ("MOVERS_REACH", Movers::REACH.into()),
            ("HEAT_NONE", f64::from(HeatScale::NONE.x)),
            ("HEAT_NONE", f64::from(HeatScale::NONE.y)),
            ("HEAT_NONE", f64::from(HeatScale::NONE.z)),
            // Ticks are powers of two and of ten, whose logarithms need not be whole to the last bit.
            ("LIGHT_COUNT_DOUBLINGS", (counts[counts.len() - 1] / counts[0]).log2().round()),
            ("ERROR_BOUND_FIRST_DECADE", bounds[0].log10().round()),
            ("ERROR_BOUND_DECADES", (bounds[bounds.len() - 1] / bounds[0]).log10().round()),
        ];
        let others = others.map(|(name, value)| (name.to_owned(), value));
        listed.chain(others).collect()
    }

    /// A shader's name for an entry of a list.
    fn constant(list: &str, name: &str) -> String {
        format!("{list}_{}", name.to_uppercase())
    }

    /// Constants that only shaders have, and why.
    const SHADERS_OWN: [(&str, &str); 32] = [
        (
            "SKY_HEMISPHERE",
            "a layer of a texture that src/renderer/resources/sky.rs fills; tests/pictures/sky.rs sees both",
        ),
        ("SKY_SPHERE", "the same"),
        ("BOUNCE", "an albedo that stands for all that hides the sky"),
        ("NOT_PACKED", "a value of the batch's record"),
        ("COLOR_WORDS", "follows from the bytes of a colour"),
        ("INFINITE", "the standard's bits of a float"),
        ("OUTLINE_AHEAD", "how outlines of portals look"),
        ("OUTLINE_HALF_WIDTH", "the same"),
        ("STEEPEST", "a bound of the look-up"),
        ("SQUARE", "how the look-up's filter blurs"),
        ("NARROWEST", "a bound of the look-up's filter"),
        ("LIKELY", "a bound of the look-up's filter"),
        ("LEVEL_MASK", "a bit of `visibility`, which no other program reads"),
        ("IN_VIEW", "a bit of `visibility`"),
        ("SEEN", "a bit of `visibility`"),
        ("SLICE_SHIFT", "a bit of `visibility`"),
        ("NO_SLICE", "what a function returns"),
        ("LOOKERS", "follows from PAGE_SLOTS and TOGETHER"),
        ("SLOTS_EACH", "follows from PAGE_SLOTS and LOOKERS"),
        ("SAMPLES_X", "the standard's; tests/pictures/culling.rs compares pictures"),
        ("SAMPLES_Y", "the standard's; tests/pictures/culling.rs compares pictures"),
        ("MOST_POINTS", "how long a shader looks"),
        ("SCANNERS", "a size of workgroups; its product with SHARE is BLOCK"),
        ("SHARE", "its product with SCANNERS is BLOCK"),
        ("EMBOSS_FULL_COSINE", "a part of the technique's formula"),
        ("LEAST_COSINE", "a part of the techniques' formulas"),
        ("MOST_STEPS", "how far a ray is followed"),
        ("MOST_SHADOW_STEPS", "how far a ray is followed"),
        ("HORIZON_SOFTNESS", "a part of the techniques' formulas"),
        ("PIXEL_VARIANCE", "a part of the formula of specular antialiasing"),
        ("MOST_CURVED", "a part of the formula of specular antialiasing"),
        ("PI", "π"),
    ];

    fn parse((name, source): (&str, &str)) -> naga::Module {
        naga::front::wgsl::parse_str(source).unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string(source)))
    }

    /// Names that the shaders declare with `const` or `override`.
    fn declared(keyword: &str) -> BTreeSet<&'static str> {
        let name = |line: &'static str| {
            let rest = line.strip_prefix(keyword)?.strip_prefix(' ')?;
            Some(rest.split([':', ' ', '=']).next().unwrap_or_default())
        };
        ALL.iter().flat_map(|(_, source)| source.lines().filter_map(name)).collect()
    }

    /// A constant's value; of a vector with equal components, theirs.
    fn value(module: &naga::Module, expression: naga::Handle<naga::Expression>) -> Option<f64> {
        use naga::Literal;
        match module.global_expressions[expression] {
            naga::Expression::Literal(Literal::U32(value)) => Some(value.into()),
            naga::Expression::Literal(Literal::I32(value)) => Some(value.into()),
            naga::Expression::Literal(Literal::F32(value)) => Some(value.into()),
            naga::Expression::Constant(constant) => value(module, module.constants[constant].init),
            naga::Expression::Splat { value: all, .. } => value(module, all),
            naga::Expression::Compose { ref components, .. } => {
                let first = value(module, *components.first()?)?;
                components.iter().all(|&component| value(module, component) == Some(first)).then_some(first)
            }
            _ => None,
        }
    }

    /// Every value that a name has in any module: those of an inexact type (no suffix, no type) are not among them.
    fn values() -> BTreeMap<String, Vec<f64>> {
        let mut values = BTreeMap::<String, Vec<f64>>::new();
        for module in ALL.map(parse) {
            for (_, constant) in module.constants.iter() {
                if let (Some(name), Some(value)) = (&constant.name, value(&module, constant.init)) {
                    values.entry(name.clone()).or_default().push(value);
                }
            }
        }
        values
    }

    #[test]
    fn constants_are_the_same_in_shaders_and_in_rust() {
        let values = values();
        for (name, expected) in pairs() {
            let found = values.get(&name).unwrap_or_else(|| panic!("no {name} with a type and a value in the shaders"));
            assert!(found.iter().all(|&value| value == expected), "{name}: {found:?} in shaders, {expected} in Rust");
        }
    }

    #[test]
    fn every_constant_of_the_shaders_is_compared_or_has_a_reason() {
        let pairs = pairs();
        let compared: BTreeSet<&str> = pairs.iter().map(|(name, _)| &**name).collect();
        let own: BTreeSet<&str> = SHADERS_OWN.into_iter().map(|(name, _)| name).collect();
        assert!(compared.is_disjoint(&own));
        let other = &declared("const") ^ &(&compared | &own);
        assert!(other.is_empty(), "neither compared nor listed with a reason, or no longer there: {other:?}");
    }

    #[test]
    fn every_override_of_the_shaders_is_set() {
        let of_objects =
            object_constants(Pass::Outputs(Attached::default()), PipelineKey::default()).map(|(name, _)| name);
        // By `Culling::new` and `Culling::make_for_cells`, `CellPipelines::new`, `Scatter::make` and
        // `Pipelines::tone_map`.
        let others = ["CELLS", "OPACITY", "PHASE", "TEXELS", "TONE_MAP"];
        let set: BTreeSet<&str> = of_objects.into_iter().chain(others).collect();
        let other = &declared("override") ^ &set;
        assert!(other.is_empty(), "not set, or no longer there: {other:?}");
        let of_forward: BTreeSet<String> =
            parse(("forward", FORWARD)).overrides.iter().filter_map(|(_, found)| found.name.clone()).collect();
        assert_eq!(of_forward, of_objects.map(String::from).into());
    }

    #[test]
    fn workgroups_take_as_much_as_is_dispatched_for() {
        let sizes = [
            ("cull", CULL, "cull", [PAGE_SLOTS, 1, 1]),
            ("cull", CULL, "occlude", [PAGE_SLOTS, 1, 1]),
            ("cull", CULL, "count", [PAGE_SLOTS, 1, 1]),
            ("cull", CULL, "scatter", [PAGE_SLOTS, 1, 1]),
            ("cull", CULL, "finish", [cull::DRAWS_TOGETHER, 1, 1]),
            ("scatter", SCATTER, "scatter", [scatter::TEXELS_TOGETHER, 1, 1]),
            ("pack", PACK, "pack", [pack::TOGETHER, 1, 1]),
            ("pyramid", PYRAMID, "from_single", [pyramid::SIDE, pyramid::SIDE, 1]),
            ("pyramid", PYRAMID, "from_multisampled", [pyramid::SIDE, pyramid::SIDE, 1]),
            ("pyramid", PYRAMID, "from_finer", [pyramid::SIDE, pyramid::SIDE, 1]),
        ];
        for (name, source, entry, size) in sizes {
            let module = parse((name, source));
            let found = module.entry_points.iter().find(|point| point.name == entry).expect("an entry point");
            assert_eq!(found.workgroup_size, size, "{name}: {entry}");
        }
    }
}
