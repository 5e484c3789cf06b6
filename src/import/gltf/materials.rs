//! glTF materials: metallic-roughness, specular-glossiness and unlit.

use super::document::{Document, name_or, real, vec3, vec4};
use super::report::Report;
use super::textures::{Images, Source, texture};
use glam::{Vec3, Vec4};
use serde_json::Value;
use systems::images::ImageKind;
use systems::library::{AlphaMode, Map, Material, Shading};

/// What a primitive without a material is drawn with (glTF 2.0, section 3.7.2.1).
pub fn default_material() -> Material {
    Material {
        name: "glTF default".into(),
        shading: Shading::MetallicRoughness,
        specular_factor: Vec3::ONE,
        ..Material::default()
    }
}

/// Reads a material; the images of its maps are requests.
pub fn read(document: &Document, id: usize, images: &mut Images, report: &mut Report) -> Material {
    let place = format!("materials[{id}]");
    let json = &document.root["materials"][id];
    let extension = |name: &str| json["extensions"].get(name);
    let mut reader = Reader { document, images, report, place };
    let mut material = Material {
        name: name_or(json, || format!("material {id}")),
        alpha: match json["alphaMode"].as_str() {
            Some("MASK") => AlphaMode::Mask,
            Some("BLEND") => AlphaMode::Blend,
            _ => AlphaMode::Opaque,
        },
        alpha_cutoff: real(json, "alphaCutoff", 0.5),
        double_sided: json["doubleSided"].as_bool().unwrap_or(false),
        normal_scale: real(&json["normalTexture"], "scale", 1.0),
        normal_map: reader.map(json, "normalTexture", ImageKind::Normal),
        occlusion_strength: real(&json["occlusionTexture"], "strength", 1.0),
        occlusion_map: reader.map(json, "occlusionTexture", ImageKind::Data),
        emissive_factor: vec3(json, "emissiveFactor", Vec3::ZERO)
            * extension("KHR_materials_emissive_strength").map_or(1.0, |e| real(e, "emissiveStrength", 1.0)),
        emissive_map: reader.map(json, "emissiveTexture", ImageKind::Color),
        ..default_material()
    };
    match extension("KHR_materials_pbrSpecularGlossiness") {
        Some(extension) if json["extensions"].get("KHR_materials_unlit").is_none() => {
            reader.specular_glossiness(extension, &mut material);
        }
        _ => reader.metallic_roughness(&json["pbrMetallicRoughness"], &mut material),
    }
    if extension("KHR_materials_unlit").is_some() {
        material.shading = Shading::Unlit;
    } else if let (Shading::MetallicRoughness, Some(extension)) =
        (material.shading, extension("KHR_materials_specular"))
    {
        reader.specular(extension, &mut material);
    }
    material
}

struct Reader<'a> {
    document: &'a Document,
    images: &'a mut Images,
    report: &'a mut Report,
    place: String,
}

impl Reader<'_> {
    fn map(&mut self, holder: &Value, key: &str, kind: ImageKind) -> Option<Map> {
        let texture = texture(self.document, holder, key, &self.place, self.report)?;
        Some(texture.map(self.images.request(Source::Plain(texture.image, kind))))
    }

    fn metallic_roughness(&mut self, json: &Value, material: &mut Material) {
        material.base_factor = vec4(json, "baseColorFactor", Vec4::ONE);
        material.base_map = self.map(json, "baseColorTexture", ImageKind::Color);
        material.metallic = real(json, "metallicFactor", 1.0);
        material.roughness = real(json, "roughnessFactor", 1.0);
        material.metallic_roughness_map = self.map(json, "metallicRoughnessTexture", ImageKind::Data);
    }

    /// KHR_materials_pbrSpecularGlossiness: one image holds sRGB specular colour and linear glossiness.
    fn specular_glossiness(&mut self, json: &Value, material: &mut Material) {
        material.shading = Shading::SpecularGlossiness;
        material.base_factor = vec4(json, "diffuseFactor", Vec4::ONE);
        material.base_map = self.map(json, "diffuseTexture", ImageKind::Color);
        material.specular_factor = vec3(json, "specularFactor", Vec3::ONE);
        material.glossiness = real(json, "glossinessFactor", 1.0);
        material.specular_map = self.map(json, "specularGlossinessTexture", ImageKind::Color);
    }

    /// KHR_materials_specular: strength in the alpha of one texture, colour in another; together they are one map.
    fn specular(&mut self, json: &Value, material: &mut Material) {
        material.specular_strength = real(json, "specularFactor", 1.0);
        material.specular_factor = vec3(json, "specularColorFactor", Vec3::ONE);
        let place = format!("{}.extensions.KHR_materials_specular", self.place);
        let color = texture(self.document, json, "specularColorTexture", &place, self.report);
        let strength = texture(self.document, json, "specularTexture", &place, self.report);
        let Some(shown) = color.or(strength) else { return };
        if strength.is_some_and(|s| (s.uv_set, s.image_from_mesh_uv) != (shown.uv_set, shown.image_from_mesh_uv)) {
            self.report.warn(format!("{place}.specularTexture"), "drawn with the UVs of specularColorTexture");
        }
        let (color, strength) = (color.map(|t| t.image), strength.map(|t| t.image));
        let source = match (color, strength) {
            (Some(color), Some(strength)) if color == strength => Source::Plain(color, ImageKind::Color),
            _ => Source::Specular { color, strength },
        };
        material.specular_map = Some(shown.map(self.images.request(source)));
    }
}
