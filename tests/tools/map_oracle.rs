//! The map tools against an independent implementation in Python, `tests/python/maps.py`.
//!
//! They must agree to less than a thousandth of a step of 8 bits on made-up maps and on real ones.

use crate::common::{self, prelude::*};
use relief::tools::maps::files;
use relief::tools::maps::{
    Edges, Filter, HeightOptions, HorizonOptions, NormalOptions, Polish, Raster, Relief, SpecularModel,
    SpecularOptions, height_from_color, horizon_from_height, normal_from_height, offset_from_height, specular_from,
};

/// 65 roundings of 2⁻²⁴.
const TOLERANCE: f32 = 0.001 / 255.0;

/// Calls of the tools: inputs for both sides, and our results.
#[derive(Default)]
struct Jobs {
    list: Vec<Value>,
    inputs: Vec<Vec<f32>>,
    ours: Vec<Vec<f32>>,
}

impl Jobs {
    fn add(&mut self, tool: &str, input: &Raster, options: Value, ours: Vec<f32>) {
        let number = self.list.len();
        self.list.push(json!({
            "tool": tool, "options": options, "shape": [input.height, input.width, input.channels],
            "input": format!("{number}.in"), "output": format!("{number}.out"),
        }));
        self.inputs.push(input.values.clone());
        self.ours.push(ours);
    }

    /// Runs them in Python and compares.
    fn compare(&self) {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = |name: String| folder.path().join(name);
        fs::write(path("jobs.json".into()), Value::from(self.list.clone()).to_string()).expect("written");
        for (number, values) in self.inputs.iter().enumerate() {
            let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
            fs::write(path(format!("{number}.in")), bytes).expect("written");
        }
        if common::python("maps.py", &["numpy"], &[folder.path().as_os_str()]).is_none() {
            return;
        }
        for (number, (job, ours)) in self.list.iter().zip(&self.ours).enumerate() {
            let bytes = fs::read(path(format!("{number}.out"))).expect("computed");
            let theirs = bytes.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]));
            assert_eq!(theirs.len(), ours.len(), "{job}");
            let far = theirs.zip(ours).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
            assert!(far <= TOLERANCE, "{far} apart: {job}");
        }
    }
}

fn edges_name(edges: Edges) -> &'static str {
    if edges == Edges::Wrap { "wrap" } else { "clamp" }
}

fn add_height_tools(jobs: &mut Jobs, heights: &Raster, relief: Relief) {
    let Relief { height_scale, edges, invert } = relief;
    for (filter, name) in [(Filter::Central, "central"), (Filter::Sobel, "sobel"), (Filter::Scharr, "scharr")] {
        let options = NormalOptions { relief, filter, strength: 1.7, flip_green: invert };
        let said = json!({
            "height_scale": height_scale, "edges": edges_name(edges), "invert": invert, "filter": name,
            "strength": 1.7f32, "flip_green": invert,
        });
        jobs.add("normal", heights, said.clone(), normal_from_height(heights, &options, &|_, _| {}).values);
        jobs.add("offset", heights, said, offset_from_height(heights, &options, &|_, _| {}).values);
    }
    for max_distance in [None, Some(9)] {
        let [first, second] = horizon_from_height(heights, &HorizonOptions { relief, max_distance }, &|_, _| {});
        let texels = first.values.chunks_exact(4).zip(second.values.chunks_exact(4));
        let ours = texels.flat_map(|(a, b)| [a, b].concat()).collect();
        let said = json!({
            "height_scale": height_scale, "edges": edges_name(edges), "invert": invert, "max_distance": max_distance,
        });
        jobs.add("horizon", heights, said, ours);
    }
}

fn add_height_guesses(jobs: &mut Jobs, color: &Raster) {
    for (edges, invert) in [(Edges::Wrap, false), (Edges::Clamp, true)] {
        for (remove_shading, blur, sharpen, contrast) in
            [(0.0, 0.0, 0.0, 1.0), (5.0, 0.7, 0.0, 2.0), (0.0, 0.0, 1.5, 0.5)]
        {
            let options = HeightOptions { remove_shading, blur, sharpen, contrast, invert, edges };
            let said = json!({
                "remove_shading": remove_shading, "blur": blur, "sharpen": sharpen, "contrast": contrast,
                "invert": invert, "edges": edges_name(edges),
            });
            jobs.add("height", color, said, height_from_color(color, &options, &|_, _| {}).values);
        }
    }
}

/// One channel of an image of several.
fn channels(of: &Raster, which: std::ops::Range<usize>) -> Raster {
    let values = of.values.chunks_exact(of.channels).flat_map(|texel| texel[which.clone()].to_vec()).collect();
    Raster { channels: which.len(), values, ..*of }
}

/// `image`: gloss or roughness, base colour, metallic.
fn add_speculars(jobs: &mut Jobs, image: &Raster) {
    let (polish, base, metallic) = (channels(image, 0..1), channels(image, 1..4), channels(image, 4..5));
    for (from, from_name) in [(Polish::Gloss, "gloss"), (Polish::Roughness, "roughness")] {
        for (model, model_name) in
            [(SpecularModel::Phong, "phong"), (SpecularModel::SpecularGlossiness, "specular_glossiness")]
        {
            let options = SpecularOptions { from, model, dielectric: 0.04, metal: Some((&base, &metallic)) };
            let said = json!({ "from": from_name, "model": model_name, "dielectric": 0.04f32 });
            jobs.add("specular", image, said, specular_from(&polish, &options, &|_, _| {}).values);
        }
    }
}

/// Values without a pattern, the same every time.
fn noise(width: usize, height: usize, channels: usize) -> Raster {
    let mut state = 1u32;
    let mut next = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as f32 / (1 << 24) as f32
    };
    Raster { width, height, channels, values: (0..width * height * channels).map(|_| next()).collect() }
}

#[test]
fn made_up_maps_come_out_as_in_python() {
    let mut jobs = Jobs::default();
    for (width, height) in [(16, 16), (24, 10), (7, 13), (1, 5)] {
        for (height_scale, edges, invert) in [(0.02, Edges::Wrap, false), (0.3, Edges::Clamp, true)] {
            add_height_tools(&mut jobs, &noise(width, height, 1), Relief { height_scale, edges, invert });
        }
    }
    add_height_guesses(&mut jobs, &noise(40, 23, 3));
    add_speculars(&mut jobs, &noise(20, 20, 5));
    jobs.compare();
}

#[test]
fn real_maps_come_out_as_in_python() {
    let Some(data) = common::test_data() else { return };
    let mut jobs = Jobs::default();
    let textures = data.join("textures");
    let heights = files::read_grey(&textures.join("layingrock-panda3d/layingrock-h.jpg"), None).expect("a height map");
    add_height_tools(&mut jobs, &heights, Relief { height_scale: 0.05, edges: Edges::Wrap, invert: true });
    let color = files::read_color(&textures.join("brick-tga-osg/rockwall.png")).expect("a colour map");
    add_height_guesses(&mut jobs, &color);
    jobs.compare();
}
