//! Textures of glTF materials.

use crate::common::prelude::*;
use crate::support::*;
use base64::Engine;

#[test]
fn specular_textures_are_combined_into_one() {
    let png = |rgba: [u8; 4], side: u32| {
        let mut bytes = std::io::Cursor::new(Vec::new());
        image::RgbaImage::from_pixel(side, side, image::Rgba(rgba))
            .write_to(&mut bytes, image::ImageFormat::Png)
            .unwrap();
        let data = base64::engine::general_purpose::STANDARD.encode(bytes.into_inner());
        json!({ "uri": format!("data:image/png;base64,{data}") })
    };
    let (_, library) = with_triangle(|d| {
        d["images"] = json!([png([200, 100, 50, 7], 2), png([1, 2, 3, 90], 4)]);
        d["textures"] = json!([{ "source": 0 }, { "source": 1 }]);
        let uvs = push_floats(d, &[0.0; 6], "VEC2");
        d["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = json!(uvs);
        d["meshes"][0]["primitives"][0]["material"] = json!(0);
        d["extensionsUsed"] = json!(["KHR_materials_specular"]);
        let extension = json!({ "specularColorTexture": { "index": 0 }, "specularTexture": { "index": 1 } });
        d["materials"] = json!([{ "extensions": { "KHR_materials_specular": extension } }]);
    })
    .unwrap();
    let map = material(&library, "material 0").specular_map.unwrap();
    let image = library.image(map.image).unwrap();
    assert_eq!((image.width, image.kind), (4, ImageKind::Color));
    assert_eq!(image.levels[0][..4], [200, 100, 50, 90]);
}

#[test]
fn an_image_of_an_extension_that_cannot_be_decoded_gives_way_to_the_source() {
    let webp = uri_of(BROKEN_WEBP);
    let mut dds = vec![0u8; 148];
    dds[..8].copy_from_slice(b"DDS \x7c\0\0\0");
    (dds[12], dds[16], dds[80]) = (4, 4, 4);
    // BC6H.
    dds[84..88].copy_from_slice(b"DX10");
    dds[128] = 95;
    let load = |extensions: &[(&str, Value)], required: bool| {
        with_triangle(|d| {
            d["images"] = json!([png_of([0, 200, 0])]);
            d["textures"] = json!([{ "source": 0, "extensions": {} }]);
            for (name, image) in extensions {
                let id = push(d, "images", image.clone());
                d["textures"][0]["extensions"][*name] = json!({ "source": id });
            }
            let names: Vec<&str> = extensions.iter().map(|(name, _)| *name).collect();
            d["extensionsUsed"] = json!(names);
            if required {
                d["extensionsRequired"] = json!(names);
            }
            d["materials"] = json!([{ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } }]);
            d["meshes"][0]["primitives"][0]["material"] = json!(0);
        })
    };
    let gone = json!({ "uri": "gone.webp" });
    for extensions in [
        vec![("EXT_texture_webp", webp.clone())],
        vec![("EXT_texture_webp", gone)],
        vec![("MSFT_texture_dds", uri_of(&dds))],
        vec![("EXT_texture_webp", webp.clone()), ("MSFT_texture_dds", uri_of(&dds))],
    ] {
        let (model, library) = load(&extensions, false).unwrap();
        let map = material(&library, "material 0").base_map.unwrap();
        assert_eq!(library.image(map.image).unwrap().levels[0][..4], [0, 200, 0, 255]);
        let said = model.warnings.iter().filter(|w| w.message.contains("the source beside it is drawn")).count();
        assert_eq!(said, extensions.len(), "{:?}", model.warnings);
        assert!(load(&extensions, true).is_err(), "a file that requires the extension cannot do without");
    }
    // One that can be decoded is preferred.
    let (_, library) = load(&[("EXT_texture_webp", png_of([1, 2, 3]))], false).unwrap();
    let map = material(&library, "material 0").base_map.unwrap();
    assert_eq!(library.image(map.image).unwrap().levels[0][..3], [1, 2, 3]);
}

/// A WebP file with a sound header and nothing after it.
const BROKEN_WEBP: &[u8] = b"RIFF\x10\0\0\0WEBPVP8 \0\0\0\0";

/// Two materials with textures of one broken image: each draws its own source.
#[test]
fn textures_with_the_same_broken_image_keep_their_own_sources() {
    let (model, library) = with_triangle(|d| {
        d["images"] = json!([uri_of(BROKEN_WEBP), png_of([200, 0, 0]), png_of([0, 0, 200])]);
        let webp = json!({ "EXT_texture_webp": { "source": 0 } });
        d["textures"] = json!([{ "source": 1, "extensions": webp }, { "source": 2, "extensions": webp }]);
        d["extensionsUsed"] = json!(["EXT_texture_webp"]);
        let material = |id: usize| json!({ "pbrMetallicRoughness": { "baseColorTexture": { "index": id } } });
        d["materials"] = json!([material(0), material(1)]);
        let mut primitives = [d["meshes"][0]["primitives"][0].clone(), d["meshes"][0]["primitives"][0].clone()];
        (primitives[0]["material"], primitives[1]["material"]) = (json!(0), json!(1));
        d["meshes"][0]["primitives"] = json!(primitives);
    })
    .unwrap();
    let first =
        |name: &str| library.image(material(&library, name).base_map.unwrap().image).unwrap().levels[0][..3].to_vec();
    assert_eq!([first("material 0"), first("material 1")], [[200, 0, 0], [0, 0, 200]]);
    let said = model.warnings.iter().filter(|w| w.message.contains("the source beside it is drawn")).count();
    assert_eq!(said, 1, "one image is broken: {:?}", model.warnings);
}

#[test]
fn a_damaged_image_of_an_optional_extension_is_left_out_by_its_name() {
    let mut png = std::io::Cursor::new(Vec::new());
    let noise = image::RgbImage::from_fn(32, 32, |x, y| image::Rgb([x as u8 * 7, y as u8 * 5, (x * y) as u8]));
    noise.write_to(&mut png, image::ImageFormat::Png).unwrap();
    let cut = &png.get_ref()[..png.get_ref().len() / 2];
    let load = |extension: &str, textures: Value, core: Value, required: bool| {
        with_triangle(|d| {
            d["images"] = json!([uri_of(cut), png_of([10, 20, 30])]);
            d["textures"] = json!([{ "source": 0 }, { "source": 1 }]);
            d["extensionsUsed"] = json!([extension]);
            if required {
                d["extensionsRequired"] = json!([extension]);
            }
            d["materials"] = json!([core]);
            d["materials"][0]["extensions"] = json!({ extension: textures });
            d["meshes"][0]["primitives"][0]["material"] = json!(0);
        })
    };
    let index = |id: usize| json!({ "index": id });
    let base = || json!({ "pbrMetallicRoughness": { "baseColorTexture": index(1) } });
    let glossiness = "KHR_materials_pbrSpecularGlossiness";
    for (extension, textures) in [
        ("KHR_materials_specular", json!({ "specularColorTexture": index(0) })),
        ("KHR_materials_specular", json!({ "specularTexture": index(0) })),
        ("KHR_materials_specular", json!({ "specularColorTexture": index(0), "specularTexture": index(0) })),
        (glossiness, json!({ "diffuseTexture": index(1), "specularGlossinessTexture": index(0) })),
    ] {
        let (model, library) = load(extension, textures.clone(), base(), false).unwrap();
        let read = material(&library, "material 0");
        assert!(read.specular_map.is_none() && read.base_map.is_some(), "{extension} {textures}");
        let said: Vec<_> = model.warnings.iter().filter(|w| w.message.ends_with("drawn without it")).collect();
        assert!(said.len() == 1 && said[0].place == "images[0]", "{extension}: {:?}", model.warnings);
        assert!(load(extension, textures, base(), true).is_err(), "the file requires {extension}");
    }
    // What the core draws with refuses the file, also where an extension names it, too.
    let core = json!({ "emissiveTexture": index(0) });
    let both = load("KHR_materials_specular", json!({ "specularColorTexture": index(0) }), core, false);
    assert!(both.unwrap_err().to_string().contains("images[0]"));
    // Of two images one may be left.
    let textures = json!({ "specularColorTexture": index(0), "specularTexture": index(1) });
    let (_, library) = load("KHR_materials_specular", textures, base(), false).unwrap();
    let map = material(&library, "material 0").specular_map.unwrap();
    assert_eq!(library.image(map.image).unwrap().levels[0][..4], [255; 4], "white, with the alpha of the other");
}

#[test]
fn base_maps_are_of_the_kind_that_their_alpha_asks_for() {
    let kind = |mode: &str, base_alpha: f32, vertex_alpha: f32, alpha: u8| {
        let (_, library) = with_triangle(|d| {
            let mut bytes = std::io::Cursor::new(Vec::new());
            let image = image::RgbaImage::from_pixel(4, 4, image::Rgba([9, 9, 9, alpha]));
            image.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
            d["images"] = json!([uri_of(&bytes.into_inner())]);
            d["textures"] = json!([{ "source": 0 }]);
            let base = json!({ "baseColorTexture": { "index": 0 }, "baseColorFactor": [1, 1, 1, base_alpha] });
            d["materials"] = json!([{ "alphaMode": mode, "alphaCutoff": 0.2, "pbrMetallicRoughness": base }]);
            let vec4 = json!({ "componentType": 5126, "count": 3, "type": "VEC4" });
            let colors = push_accessor(d, &floats(&[1.0, 1.0, 1.0, vertex_alpha].repeat(3)), vec4);
            let primitive = &mut d["meshes"][0]["primitives"][0];
            (primitive["material"], primitive["attributes"]["COLOR_0"]) = (json!(0), json!(colors));
        })
        .unwrap();
        library.image(material(&library, "material 0").base_map.unwrap().image).unwrap().kind
    };
    assert_eq!(kind("OPAQUE", 1.0, 1.0, 100), ImageKind::Color);
    assert_eq!(kind("BLEND", 1.0, 1.0, 100), ImageKind::Blended);
    assert_eq!(kind("MASK", 1.0, 1.0, 100), ImageKind::Masked { least: 51 });
    // Half of the texel's alpha is compared.
    assert_eq!(kind("MASK", 0.5, 1.0, 100), ImageKind::Masked { least: 102 });
    // Vertices have a say in what passes.
    assert_eq!(kind("MASK", 1.0, 0.5, 100), ImageKind::Blended);
    // Nothing is hidden.
    assert_eq!([kind("BLEND", 1.0, 1.0, 255), kind("MASK", 1.0, 1.0, 255)], [ImageKind::Color; 2]);
}
