//! Real sets of textures through the map tools' functions and every technique.

use crate::common::bumps::{Stage, difference};
use crate::common::{self, prelude::*};
use relief::tools::maps::files::Bits;
use relief::tools::maps::preview::add_map;
use relief::tools::maps::{
    HeightOptions, HorizonOptions, NormalOptions, Raster, Relief, files, height_from_color, horizon_from_height,
    normal_from_height, offset_from_height,
};

/// Base colour, and the height map if the set has one; deep: black is high.
const SETS: [(&str, Option<(&str, bool)>); 5] = [
    ("brick-panda3d/brick-c.jpg", None),
    ("brick-tga-osg/rockwall.png", None),
    ("cobble-learnwgpu/cobble-diffuse.png", None),
    ("layingrock-panda3d/layingrock-c.jpg", Some(("layingrock-panda3d/layingrock-h.jpg", false))),
    ("parallax-cube-bevy/cube_color.png", Some(("parallax-cube-bevy/cube_depth.png", true))),
];

fn quiet(_: usize, _: usize) {}

#[test]
fn real_sets_go_through_every_tool_and_technique() {
    let Some(data) = common::test_data() else { return };
    for (color, height) in SETS {
        let Some(mut stage) = Stage::new((160, 120)) else { return };
        stage.three_lights();
        let textures = data.join("textures");
        let base = files::read_color(&textures.join(color)).expect("a colour map");
        let mut heights = match height {
            Some((file, _)) => files::read_grey(&textures.join(file), None).expect("a height map"),
            None => height_from_color(&base, &HeightOptions::default(), &quiet),
        };
        if height.is_some_and(|(_, deep)| deep) {
            heights.values.iter_mut().for_each(|h| *h = 1.0 - *h);
        }
        let material = material(&mut stage, &base, &heights);
        let (mesh, at) = Stage::facing(Vec2::splat(2.0));
        stage.spawn(mesh, material, Transform::from_rotation(Quat::from_rotation_x(-0.7)) * at);
        stage.headless.settings.technique = Some(Technique::Off);
        let smooth = stage.picture();
        for (name, technique) in Technique::ALL {
            stage.headless.settings.technique = Some(technique);
            let picture = stage.picture();
            if let Some(folder) = std::env::var_os("RELIEF_KEEP_PICTURES") {
                let set = color.split('/').next().expect("a folder");
                picture.save(std::path::Path::new(&folder).join(format!("{set}_{name}.png"))).expect("saved");
            }
            assert!(stage.linear().iter().all(|p| p.is_finite()), "{color}: {name}");
            let (_, changed) = difference(&smooth, &picture, 6);
            assert!(technique == Technique::Off || changed > 400, "{color}: {name} changes {changed} pixels");
        }
    }
}

fn material(stage: &mut Stage, base: &Raster, heights: &Raster) -> Material {
    let mut library = stage.simulation.world.resource_mut::<Library>();
    let relief = Relief { height_scale: 0.05, ..Relief::default() };
    let options = NormalOptions { relief, ..NormalOptions::default() };
    let horizon = horizon_from_height(heights, &HorizonOptions { relief, max_distance: None }, &quiet);
    let mut add =
        |name, kind, map: &Raster| -> Option<Map> { Some(add_map(&mut library, name, kind, map, Bits::Sixteen)) };
    Material {
        base_map: add("base", ImageKind::Color, base),
        height_map: add("height", ImageKind::Data, heights),
        normal_map: add("normal", ImageKind::Normal, &normal_from_height(heights, &options, &quiet)),
        offset_map: add("offset", ImageKind::Data, &offset_from_height(heights, &options, &quiet)),
        horizon_maps: [add("horizon 0", ImageKind::Data, &horizon[0]), add("horizon 1", ImageKind::Data, &horizon[1])],
        environment_map: add("around", ImageKind::Color, base),
        height_scale_uv: relief.height_scale,
        emboss_step_texels: 3.0,
        specular_factor: Vec3::splat(0.3),
        ..Material::default()
    }
}
