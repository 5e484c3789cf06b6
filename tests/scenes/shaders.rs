//! The shaders by themselves: every module is valid, and its structs lie in memory as the Rust ones that fill them do.
//! Their constants are compared in src/renderer/gpu/shaders.rs, where the renderer's own can be seen.

use crate::common::{self, prelude::*};
use bevy_ecs::entity::Entity;
use relief::renderer::{CullBatchRecord, CullDrawRecord, CullRecord, shaders};
use std::mem::offset_of;
use systems::draw::*;
use systems::lights::{LightRecord, MOST_LIGHTS, NO_LIGHT, PackedLight, Selection};
use wgpu::naga;
use wgpu::util::DeviceExt;

fn parse(source: &str) -> naga::Module {
    naga::front::wgsl::parse_str(source).unwrap_or_else(|e| panic!("{}", e.emit_to_string(source)))
}

#[test]
fn every_shader_is_valid() {
    let mut failures = Vec::new();
    for (name, source) in shaders::ALL {
        let module = parse(source);
        let flags = naga::valid::ValidationFlags::all();
        // Only in the debug view of cells: what colours each sample of a pixel by itself.
        let capabilities = naga::valid::Capabilities::MULTISAMPLED_SHADING;
        let mut validator = naga::valid::Validator::new(flags, capabilities);
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
            clip_from_eye,
            eye_from_clip,
            eye,
            parallel,
            toward_eye,
            exposure,
            ambient,
            picked_entity,
            zenith,
            shadow_records,
            horizon,
            level_error,
            ground,
            shadow_side,
        }
    );
    assert_mirrored!(
        &module,
        "Sky",
        SkyRecord {
            harmonics,
            ground,
            unit,
            sun,
            sun_radiance,
            moon,
            moon_radiance,
            up,
            pad0,
            openness_origin,
            movers_first,
            openness_bricks,
            movers_cell,
            movers_origin,
            movers_cells,
        }
    );
    assert_mirrored!(
        &module,
        "PackedInstance",
        InstanceRecord {
            world_from_object,
            lights,
            material,
            residual,
            last_side_and_dropped,
            residual_unit,
            reaching_or_list,
            entity,
        }
    );
    assert_mirrored!(
        &module,
        "PackedLight",
        PackedLight { position, inverse_range_squared, words, attenuation, size, ambient, pad0 }
    );
    assert_mirrored!(
        &module,
        "Material",
        MaterialRecord {
            base_factor,
            specular_factor,
            shininess,
            layers,
            normal_scale,
            emissive_factor,
            alpha_cutoff,
            metallic,
            roughness,
            occlusion_strength,
            specular_strength,
            glossiness,
            height_scale_uv,
            height_rest,
            second_uvs,
            emboss_step_texels,
            self_shadow,
            pad0,
            pad1,
            offset_matrix,
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
        CullRecord {
            planes,
            page_count,
            entry_count,
            draw_count,
            occlusion,
            size,
            pyramid_levels,
            allowed_error,
            samples,
            vertex_rounding,
            late_offset,
            pad0
        }
    );
    assert_mirrored!(
        &module,
        "CullBatch",
        CullBatchRecord { center, radius, half_extents, pad0, level_center, level_radius, errors }
    );
    assert_mirrored!(&module, "CullDraw", CullDrawRecord { level, first_entry, end_entry, first_visible });
}

/// Records that a `load_…` function gathers from a table equal those put there: every field in its place.
#[test]
fn records_come_out_of_their_tables_as_they_went_in() {
    let Some(gpu) = common::gpu() else { return };
    check_table(&gpu, 0, "PackedInstance", "load_packed_instance", size_of::<InstanceRecord>());
    check_table(&gpu, 1, "PackedLight", "load_packed_light", size_of::<PackedLight>());
    check_table(&gpu, 2, "Material", "load_material", size_of::<MaterialRecord>());
}

/// Fills a table with numbers, loads a record by its function, and compares the bytes; room between fields stays 0.
fn check_table(gpu: &Gpu, table: usize, kind: &str, load: &str, size: usize) {
    const RECORD: u32 = 229;
    let types = include_str!("../../shaders/types.wgsl");
    let source = format!(
        "{types}
        @group(1) @binding(0) var<storage, read_write> loaded: {kind};
        @compute @workgroup_size(1) fn main() {{ loaded = {load}({RECORD}u); }}"
    );
    // Each value another one.
    let values: Vec<u32> = (0..4096 * 2 * 4).map(|i| 0x3f00_0000 + i).collect();
    let found = run(gpu, table, source, &values, size);
    let first = RECORD as usize * size / 4;
    for (place, (&found, &expected)) in found.iter().zip(&values[first..]).enumerate() {
        assert!(found == expected || found == 0, "value {place} of {kind}: {found:#x}, not {expected:#x}");
    }
    let room = found.iter().filter(|&&value| value == 0).count();
    assert!(room <= 2, "{room} values of {kind} are not loaded");
}

/// Lights of an object's record equal those of its selection, but for rounding.
#[test]
fn lights_come_out_of_an_objects_record_nearly_as_they_went_in() {
    let Some(gpu) = common::gpu() else { return };
    let most = MOST_LIGHTS as u32 - 1;
    let selections = [
        Selection::default(),
        Selection {
            lights: [most, 0, NO_LIGHT],
            weights: [1.0, 0.3337, 0.0],
            residual_ambient: Vec3::new(0.25, 1e-5, 0.125),
            residual_direction: Vec3::new(-0.2, 0.1, -0.0),
            residual_sides: Vec3::new(0.2, 0.11, 0.05),
            dropped: 0.777,
            reaching: 100_000,
        },
        // A sun or two left out, and hardly anything.
        Selection { residual_ambient: Vec3::new(3e5, 2e5, 1e5), dropped: 1e6, ..Selection::default() },
        Selection { residual_direction: Vec3::new(1e-12, -3e-12, 2e-12), dropped: 1e-9, ..Selection::default() },
        Selection { residual_sides: Vec3::splat(1e-35), ..Selection::default() },
    ];
    let source = format!(
        "{}
        @group(1) @binding(0) var<storage, read_write> loaded: array<u32, {}>;
        @compute @workgroup_size(1) fn main() {{
            for (var i = 0u; i < {}u; i++) {{
                let o = load_instance(i);
                var all = array<u32, 19>(o.lights[0], o.lights[1], o.lights[2], o.material, o.entity, o.reaching,
                    bitcast<u32>(o.weights[0]), bitcast<u32>(o.weights[1]), bitcast<u32>(o.weights[2]),
                    bitcast<u32>(o.residual_ambient.x), bitcast<u32>(o.residual_ambient.y),
                    bitcast<u32>(o.residual_ambient.z), bitcast<u32>(o.residual_direction.x),
                    bitcast<u32>(o.residual_direction.y), bitcast<u32>(o.residual_direction.z),
                    bitcast<u32>(o.residual_sides.x), bitcast<u32>(o.residual_sides.y),
                    bitcast<u32>(o.residual_sides.z), bitcast<u32>(o.dropped));
                for (var k = 0u; k < 19u; k++) {{ loaded[i * 19u + k] = all[k]; }}
            }}
        }}",
        include_str!("../../shaders/types.wgsl"),
        19 * selections.len(),
        selections.len()
    );
    let entity = Entity::from_raw_u32(70_000).expect("an index");
    let record = |s: &Selection| {
        InstanceRecord::new(entity, &Affine3A::IDENTITY, MaterialId::from_slot(9), &SelectedLights::pack(s))
    };
    let records: Vec<InstanceRecord> = selections.iter().map(record).collect();
    let mut values: Vec<u32> = bytemuck::cast_slice(&records).to_vec();
    values.resize(4096 * 2 * 4, 0);
    let found = run(&gpu, 0, source, &values, 4 * 19 * selections.len());
    for (s, found) in selections.iter().zip(found.chunks_exact(19)) {
        let [a, b, c] = s.lights;
        assert_eq!(found[..6], [a, b, c, 9, 70_000, s.reaching]);
        let (weights, rest) = found[6..].split_at(3);
        for (&found, weight) in weights.iter().zip(s.weights) {
            // Half a step of 1/1023.
            assert!((f32::from_bits(found) - weight).abs() < 0.000_5, "{} for {weight}", f32::from_bits(found));
        }
        assert_eq!(f32::from_bits(weights[0]), s.weights[0], "1 and 0 are exact");
        let residual = [s.residual_ambient, s.residual_direction, s.residual_sides].map(|v| v.to_array()).concat();
        let largest = residual.iter().fold(0.0f32, |largest, v| largest.max(v.abs()));
        for (&found, v) in rest.iter().zip(&residual) {
            // Half a step of 1/32767 of the largest, 1/65534, rounded a few times.
            let off = (f32::from_bits(found) - v).abs();
            assert!(off <= largest / 65_000.0 || largest < 1e-30 && off < 1e-30, "{} for {v}", f32::from_bits(found));
        }
        // 8 bits: half a step is 1/256 at the most.
        assert!((f32::from_bits(rest[9]) - s.dropped).abs() <= s.dropped / 250.0);
    }
}

/// Shaders compute with the lights that the search scores.
#[test]
fn lights_come_out_of_their_table_as_the_search_has_them() {
    let Some(gpu) = common::gpu() else { return };
    let spot = LightRecord {
        position: [1.5, -2.0, 1e6],
        kind: LightRecord::SPOT_CONE,
        color: [3.1, 0.7, -0.51],
        inverse_range_squared: 0.01,
        attenuation: [1.0, 0.5, 0.25],
        exponent_or_cone_slope: 7.3,
        direction: Vec3::new(0.48, -0.6, -0.64).into(),
        versine_outer: 0.21,
        ambient: [0.1, 0.2, 0.3],
        size: 0.0,
    };
    let lights = [
        spot,
        LightRecord { direction: Vec3::new(-0.6, 0.48, -0.64).into(), color: [1e9, 1e8, 0.0], ..spot },
        LightRecord { direction: [0.0, 0.0, -1.0], versine_outer: 6e-7, exponent_or_cone_slope: 1e12, ..spot },
        LightRecord { kind: LightRecord::SPOT_EXPONENT, exponent_or_cone_slope: 128.0, ..spot },
        LightRecord { kind: LightRecord::POINT, color: [1e-9, 2e-9, -1e-12], ..spot },
        LightRecord { kind: LightRecord::DIRECTIONAL, position: [0.0, 0.8, 0.6], ..spot },
        LightRecord { kind: LightRecord::OFF, ..LightRecord::default() },
    ]
    .map(|light| light.packed());
    let source = format!(
        "{}
        @group(1) @binding(0) var<storage, read_write> loaded: array<vec4f, {}>;
        @compute @workgroup_size(1) fn main() {{
            for (var i = 0u; i < {}u; i++) {{
                let o = load_light(i);
                loaded[5u * i] = vec4f(o.position, f32(o.kind));
                loaded[5u * i + 1u] = vec4f(o.color, o.inverse_range_squared);
                loaded[5u * i + 2u] = vec4f(o.attenuation, o.exponent_or_cone_slope);
                loaded[5u * i + 3u] = vec4f(o.direction, o.versine_outer);
                loaded[5u * i + 4u] = vec4f(o.ambient, 0.0);
            }}
        }}",
        include_str!("../../shaders/types.wgsl"),
        5 * lights.len(),
        lights.len()
    );
    let mut values: Vec<u32> = bytemuck::cast_slice(&lights).to_vec();
    values.resize(4096 * 2 * 4, 0);
    let found = run(&gpu, 1, source, &values, 5 * 16 * lights.len());
    for (light, found) in lights.iter().zip(found.chunks_exact(20)) {
        let light = light.unpacked();
        let mut found: Vec<f32> = found.iter().map(|&bits| f32::from_bits(bits)).collect();
        assert_eq!(found[3], light.kind as f32);
        let has_cone = [LightRecord::SPOT_CONE, LightRecord::SPOT_EXPONENT].contains(&light.kind);
        if !has_cone {
            // Not read: they have no cones.
            found[11..=15].fill(0.0);
        }
        let expected = [
            &light.position[..],
            &[light.kind as f32],
            &light.color,
            &[light.inverse_range_squared],
            &light.attenuation,
            &[if has_cone { light.exponent_or_cone_slope } else { 0.0 }],
            &if has_cone { light.direction } else { [0.0; 3] },
            &[if has_cone { light.versine_outer } else { 0.0 }],
            &light.ambient,
        ]
        .concat();
        for (place, (found, expected)) in found.iter().zip(&expected).enumerate() {
            // Quotients are within 2.5 units in the last place (WGSL, 15.7.4), products within a half; a direction has
            // an inverse root of 2 and a few sums of numbers below 1.
            let bound = expected.abs() * 6e-7 + if (12..15).contains(&place) { 6e-7 } else { 0.0 };
            assert!((found - expected).abs() <= bound, "value {place} of {light:?}: {found}");
        }
    }
}

/// Runs a shader with `values` in a table of two rows, the others empty; what it leaves in the binding for that, `size`
/// bytes. Tables by their number: instances, lights, materials.
fn run(gpu: &Gpu, table: usize, source: String, values: &[u32], size: usize) -> Vec<u32> {
    let device = &gpu.device;
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some("reads a table"),
        source: wgpu::ShaderSource::Wgsl(source.into()),
    });
    let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some("reads a table"),
        layout: None,
        module: &module,
        entry_point: Some("main"),
        compilation_options: wgpu::PipelineCompilationOptions::default(),
        cache: None,
    });
    // The table begins in the row of its number plus one.
    let mut starts = [0; 4];
    starts[table] = 4096 * (table as u32 + 1);
    let starts = device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
        label: Some("starts"),
        contents: bytemuck::bytes_of(&starts),
        usage: wgpu::BufferUsages::UNIFORM,
    });
    let extent = wgpu::Extent3d { width: 4096, height: 2, depth_or_array_layers: 1 };
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: Some("tables"),
        size: wgpu::Extent3d { height: 5, ..extent },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba32Uint,
        usage: wgpu::TextureUsages::STORAGE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    });
    let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(4096 * 16), rows_per_image: None };
    let mut place = texture.as_image_copy();
    place.origin.y = table as u32 + 1;
    gpu.queue.write_texture(place, bytemuck::cast_slice(values), layout, extent);
    let buffer = |usage| {
        device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: size as u64,
            usage,
            mapped_at_creation: false,
        })
    };
    let loaded = buffer(wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC);
    let back = buffer(wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST);
    let group = |index, resources: Vec<(u32, wgpu::BindingResource<'_>)>| {
        let layout = &pipeline.get_bind_group_layout(index);
        let entries = resources.into_iter().map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource });
        let entries = &entries.collect::<Vec<_>>();
        device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout, entries })
    };
    let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
    let tables = vec![(1, wgpu::BindingResource::TextureView(&view)), (2, starts.as_entire_binding())];
    let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    {
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
        pass.set_pipeline(&pipeline);
        pass.set_bind_group(0, &group(0, tables), &[]);
        pass.set_bind_group(1, &group(1, vec![(0, loaded.as_entire_binding())]), &[]);
        pass.dispatch_workgroups(1, 1, 1);
    }
    encoder.copy_buffer_to_buffer(&loaded, 0, &back, 0, size as u64);
    encoder.map_buffer_on_submit(&back, wgpu::MapMode::Read, .., |mapped| mapped.expect("mapped"));
    gpu.queue.submit([encoder.finish()]);
    device.poll(wgpu::PollType::wait_indefinitely()).expect("the device is alive");
    let mapped = back.slice(..).get_mapped_range().expect("mapped");
    bytemuck::cast_slice(&mapped).to_vec()
}
