//! glTF materials: metallic-roughness, specular-glossiness and unlit.

use super::textures::{Images, Info, Source, Texture, texture};
use crate::import::gltf::document::data::{Document, name_or};
use crate::import::gltf::report::Report;
use glam::{Vec3, Vec4};
use gltf::json::validation::Checked;
use systems::assets::{AlphaMode, ImageKind, Map, Material, Shading};

/// Material of primitives without one (glTF 2.0, section 3.7.2.1).
pub fn default_material() -> Material {
    Material {
        name: "glTF default".into(),
        shading: Shading::MetallicRoughness,
        specular_factor: Vec3::ONE,
        ..Material::default()
    }
}

/// The textures that a material names, whether it is drawn with them or not.
pub fn textures<'a>(material: &gltf::Material<'a>) -> Vec<Info<'a>> {
    let metallic_roughness = material.pbr_metallic_roughness();
    let mut infos = vec![
        material.normal_texture().map(Info::from),
        material.occlusion_texture().map(Info::from),
        material.emissive_texture().map(Info::from),
        metallic_roughness.base_color_texture().map(Info::from),
        metallic_roughness.metallic_roughness_texture().map(Info::from),
    ];
    if let Some(extension) = material.pbr_specular_glossiness() {
        infos.push(extension.diffuse_texture().map(Info::from));
        infos.push(extension.specular_glossiness_texture().map(Info::from));
    }
    if let Some(extension) = material.specular() {
        infos.push(extension.specular_texture().map(Info::from));
        infos.push(extension.specular_color_texture().map(Info::from));
    }
    infos.into_iter().flatten().collect()
}

/// Reads a material; the images of its maps are requests. `faded`: whether any of its vertices has an alpha of its own.
pub fn read(
    document: &Document,
    gltf: &gltf::Material,
    faded: bool,
    images: &mut Images,
    report: &mut Report,
) -> Material {
    let Some(id) = gltf.index() else { return default_material() };
    let mut reader = Reader { document, images, report, faded, needed: true, place: format!("materials[{id}]") };
    let mut material = Material {
        name: name_or(gltf.name(), || format!("material {id}")),
        alpha: match document.json().materials[id].alpha_mode {
            Checked::Valid(gltf::material::AlphaMode::Mask) => AlphaMode::Mask,
            Checked::Valid(gltf::material::AlphaMode::Blend) => AlphaMode::Blend,
            _ => AlphaMode::Opaque,
        },
        alpha_cutoff: gltf.alpha_cutoff().unwrap_or(0.5),
        double_sided: gltf.double_sided(),
        normal_scale: gltf.normal_texture().map_or(1.0, |texture| texture.scale()),
        normal_map: reader.map(gltf.normal_texture(), "normalTexture", ImageKind::Normal),
        occlusion_strength: gltf.occlusion_texture().map_or(1.0, |texture| texture.strength()),
        occlusion_map: reader.map(gltf.occlusion_texture(), "occlusionTexture", ImageKind::Data),
        emissive_factor: Vec3::from_array(gltf.emissive_factor()) * gltf.emissive_strength().unwrap_or(1.0),
        emissive_map: reader.map(gltf.emissive_texture(), "emissiveTexture", ImageKind::Color),
        ..default_material()
    };
    match gltf.pbr_specular_glossiness() {
        Some(extension) if !gltf.unlit() => reader.specular_glossiness(&extension, &mut material),
        _ => reader.metallic_roughness(&gltf.pbr_metallic_roughness(), &mut material),
    }
    if gltf.unlit() {
        material.shading = Shading::Unlit;
    } else if let (Shading::MetallicRoughness, Some(extension)) = (material.shading, gltf.specular()) {
        reader.specular(&extension, &mut material);
    }
    material
}

struct Reader<'a> {
    document: &'a Document,
    images: &'a mut Images,
    report: &'a mut Report,
    faded: bool,
    /// A map that cannot be decoded refuses the file.
    needed: bool,
    place: String,
}

impl Reader<'_> {
    fn texture<'b>(&mut self, info: Option<impl Into<Info<'b>>>, key: &str) -> Option<Texture> {
        texture(self.document, info?.into(), &format!("{}.{key}", self.place), self.report)
    }

    fn map<'b>(&mut self, info: Option<impl Into<Info<'b>>>, key: &str, kind: ImageKind) -> Option<Map> {
        let texture = self.texture(info, key)?;
        Some(texture.map(self.images.request(Source::Plain(texture.image, kind), self.needed)))
    }

    /// Kind of a base map, by the use of its alpha. Where vertices fade a mask, the texels' alpha alone decides
    /// nothing.
    fn base_kind(&self, material: &Material) -> ImageKind {
        match material.alpha {
            AlphaMode::Opaque => ImageKind::Color,
            AlphaMode::Mask if !self.faded => ImageKind::masked(material.alpha_cutoff, material.base_factor.w),
            AlphaMode::Blend | AlphaMode::Mask => ImageKind::Blended,
        }
    }

    fn metallic_roughness(&mut self, gltf: &gltf::material::PbrMetallicRoughness, material: &mut Material) {
        material.base_factor = Vec4::from_array(gltf.base_color_factor());
        let kind = self.base_kind(material);
        material.base_map = self.map(gltf.base_color_texture(), "baseColorTexture", kind);
        material.metallic = gltf.metallic_factor();
        material.roughness = gltf.roughness_factor();
        let texture = gltf.metallic_roughness_texture();
        material.metallic_roughness_map = self.map(texture, "metallicRoughnessTexture", ImageKind::Data);
    }

    /// KHR_materials_pbrSpecularGlossiness: one image holds sRGB specular colour and linear glossiness.
    fn specular_glossiness(&mut self, gltf: &gltf::material::PbrSpecularGlossiness, material: &mut Material) {
        self.needed = self.document.requires("KHR_materials_pbrSpecularGlossiness");
        material.shading = Shading::SpecularGlossiness;
        material.base_factor = Vec4::from_array(gltf.diffuse_factor());
        let kind = self.base_kind(material);
        material.base_map = self.map(gltf.diffuse_texture(), "diffuseTexture", kind);
        material.specular_factor = Vec3::from_array(gltf.specular_factor());
        material.glossiness = gltf.glossiness_factor();
        let texture = gltf.specular_glossiness_texture();
        material.specular_map = self.map(texture, "specularGlossinessTexture", ImageKind::Color);
    }

    /// KHR_materials_specular: strength in the alpha of one texture, colour in another; together they are one map.
    fn specular(&mut self, gltf: &gltf::material::Specular, material: &mut Material) {
        self.needed = self.document.requires("KHR_materials_specular");
        material.specular_strength = gltf.specular_factor();
        material.specular_factor = Vec3::from_array(gltf.specular_color_factor());
        self.place += ".extensions.KHR_materials_specular";
        let color = self.texture(gltf.specular_color_texture(), "specularColorTexture");
        let strength = self.texture(gltf.specular_texture(), "specularTexture");
        let Some(shown) = color.or(strength) else { return };
        if strength.is_some_and(|s| (s.uv_set, s.image_from_mesh_uv) != (shown.uv_set, shown.image_from_mesh_uv)) {
            let place = format!("{}.specularTexture", self.place);
            self.report.warn(place, "drawn with the UVs of specularColorTexture");
        }
        let (color, strength) = (color.map(|t| t.image), strength.map(|t| t.image));
        let source = match (color, strength) {
            (Some(color), Some(strength)) if color == strength => Source::Plain(color, ImageKind::Color),
            _ => Source::Specular { color, strength },
        };
        material.specular_map = Some(shown.map(self.images.request(source, self.needed)));
    }
}
