//! Lights as people describe them: in scene files, in Python, in the window.

use super::components::{Light, LightKind};
use crate::assets::color::linear_from_kelvin;
use crate::assets::color_text::{BRIGHTEST, Color};
use crate::describe::angle::degrees;
use crate::describe::check::Described;
use crate::describe::fault::{Fault, Trail};
use crate::describe::infinite;
use crate::describe::schema::of_other_kinds;
use crate::space::transform::FARTHEST;
use glam::Vec3;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Serialize, Serializer};
use serde_json::{Map, Value, json};
use std::borrow::Cow;

/// Half angles of cones that are not said: degrees.
const CUTOFF_DEGREES: f32 = 45.0;
/// Part of a cone that is full of light, where that is not said.
const FULL: f32 = 0.8;
/// Temperatures whose colours [`linear_from_kelvin`] knows.
const COLDEST: u32 = 1667;
const HOTTEST: u32 = 25_000;

/// A light by its kind.
#[derive(Serialize, Deserialize, JsonSchema, Clone, PartialEq, Debug)]
#[serde(rename_all = "snake_case")]
pub enum LightDescription {
    /// In all directions from a point.
    Point(LightFields),
    /// A cone from a point: by `cutoff_degrees` with `exponent`, or by `outer_degrees` with `inner_degrees`.
    Spot(LightFields),
    /// Parallel light, as the sun's.
    Directional(LightFields),
}

/// Fields of lights. An intensity of 1 at attenuation 1 lights a white surface that faces the light to a radiance of 1.
#[derive(Serialize, Deserialize, JsonSchema, Clone, PartialEq, Debug)]
#[serde(default, deny_unknown_fields)]
pub struct LightFields {
    /// Switched on.
    pub on: bool,
    /// Colour.
    pub color: Color,
    /// Temperature of the black body that has its colour, instead of `color`. Read: none if no black body has it.
    #[schemars(range(min = COLDEST, max = HOTTEST), extend("unit" = "K"))]
    pub temperature_kelvin: Option<u32>,
    /// Times the colour.
    #[schemars(range(min = 0.0, max = BRIGHTEST))]
    pub intensity: f32,
    /// Distance at which it has faded to nothing.
    #[serde(with = "infinite")]
    #[schemars(with = "Option<f32>", range(min = 0.001, max = FARTHEST))]
    #[schemars(extend("infinite" = true, "unit" = "m", "kinds" = ["point", "spot"]))]
    pub range: f32,
    /// Coefficients of 1 / (constant + linear·d + quadratic·d²).
    #[schemars(extend("minimum" = 0, "maximum" = 1_000_000, "kinds" = ["point", "spot"]))]
    pub attenuation: Attenuation,
    /// Light that reaches every side of a surface, attenuated like the rest.
    pub ambient: Color,
    /// Casts shadows, if it is among the most important lights for a picture.
    pub shadows: bool,
    /// Distance within which nothing casts a shadow, such as the glass of its lamp.
    #[schemars(range(min = 0.001, max = FARTHEST), extend("unit" = "m", "kinds" = ["point", "spot"]))]
    pub shadow_near: f32,
    /// Radius of the ball that shines, by which shadows have penumbrae; 0: hard edges.
    #[schemars(range(min = 0.0, max = Light::MOST_RADIUS), extend("unit" = "m", "kinds" = ["point", "spot"]))]
    pub radius: f32,
    /// Half angle of a cone, beyond which there is no light.
    #[schemars(range(min = 0.05, max = 85.0), extend("unit" = "°", "kinds" = ["spot"]))]
    pub cutoff_degrees: Option<f32>,
    /// Power of the angle's cosine; 0: an even, hard-edged cone.
    #[schemars(range(min = 0.0, max = 10000.0), extend("kinds" = ["spot"]))]
    pub exponent: Option<f32>,
    /// Half angle of a cone, beyond which there is no light.
    #[schemars(range(min = 0.05, max = 85.0), extend("unit" = "°", "kinds" = ["spot"]))]
    pub outer_degrees: Option<f32>,
    /// Half angle within which the light is full; by default 0.8 of the outer. A smooth step lies between the two.
    #[schemars(range(min = 0.0, max = 85.0), extend("unit" = "°", "kinds" = ["spot"]))]
    pub inner_degrees: Option<f32>,
    /// Angular diameter, by which shadows have penumbrae; 0: hard edges.
    #[schemars(range(min = 0.0, max = Light::MOST_DEGREES), extend("unit" = "°", "kinds" = ["directional"]))]
    pub angle_degrees: f32,
}

impl Default for LightFields {
    fn default() -> Self {
        let light = Light::point(1.0, f32::INFINITY);
        Self {
            color: Color::linear(light.color),
            temperature_kelvin: None,
            intensity: light.intensity,
            range: light.range,
            attenuation: Attenuation(light.attenuation),
            ambient: Color::linear(light.ambient),
            on: light.enabled,
            shadows: light.shadows,
            shadow_near: light.shadow_near,
            radius: light.radius,
            cutoff_degrees: None,
            exponent: None,
            outer_degrees: None,
            inner_degrees: None,
            angle_degrees: Light::SUN_DEGREES,
        }
    }
}

impl LightFields {
    /// Linear RGB: the colour, or that of a black body of the same brightest component.
    fn rgb(&self) -> Vec3 {
        let color = self.color.rgb();
        let body = self.temperature_kelvin.and_then(black_body);
        body.map_or(color, |body| body * color.max_element())
    }
}

impl LightDescription {
    /// Fields of whichever kind it is.
    pub fn fields(&self) -> &LightFields {
        match self {
            Self::Point(fields) | Self::Spot(fields) | Self::Directional(fields) => fields,
        }
    }

    /// The same kind of light with edited fields. Of colour and temperature, the one that was edited counts.
    ///
    /// # Errors
    /// A field that cannot be read, or no fields at all.
    pub fn edited(&self, fields: Value) -> Result<Self, serde_json::Error> {
        let mut fields: Map<_, _> = serde_json::from_value(fields)?;
        let before = serde_json::to_value(self.fields())?;
        if fields.get("color") != before.get("color") {
            fields.insert("temperature_kelvin".into(), Value::Null);
        } else if fields.get("temperature_kelvin") != before.get("temperature_kelvin") {
            // A light of no colour has that of the temperature itself.
            let brightest = Some(self.fields().color.rgb().max_element()).filter(|most| *most > 0.0).unwrap_or(1.0);
            fields.insert("color".into(), vec![brightest; 3].into());
        }
        let kind = Light::from(self).kind.name();
        serde_json::from_value(json!({ kind: fields }))
    }
}

fn black_body(kelvin: u32) -> Option<Vec3> {
    linear_from_kelvin(kelvin as f32)
}

/// Temperature of the black body of exactly this colour. The hotter, the less red.
fn temperature(color: Vec3) -> Option<u32> {
    let brightest = color.max_element();
    let without_red = |color: Vec3| (color.y + color.z) / color.x;
    let (mut least, mut most) = (COLDEST, HOTTEST);
    while least < most {
        let middle = least.midpoint(most);
        if black_body(middle).is_some_and(|body| without_red(body) < without_red(color)) {
            least = middle + 1;
        } else {
            most = middle;
        }
    }
    // The ratio of a colour that is scaled is rounded, and may belong to a neighbour.
    let is_it = |kelvin: &u32| black_body(*kelvin).is_some_and(|body| body * brightest == color);
    (least - 1..=least + 1).find(is_it).filter(|_| brightest > 0.0)
}

impl Described for LightFields {}

impl Described for LightDescription {
    fn check_whole(&self) -> Vec<Fault> {
        let (at, fields) = (Trail::default(), self.fields());
        let mut faults = of_other_kinds(Light::from(self).kind.name(), "light", fields);
        let color = fields.color.rgb();
        if fields.temperature_kelvin.is_some() && ![Vec3::splat(color.x), fields.rgb()].contains(&color) {
            faults.push(at.field("temperature_kelvin").fault("expected either color or temperature_kelvin"));
        }
        if fields.attenuation.0.element_sum() <= 0.0 {
            faults.push(at.field("attenuation").fault("expected at least one of the three to be more than 0"));
        }
        if let Self::Spot(LightFields { cutoff_degrees, exponent, outer_degrees, inner_degrees, .. }) = self {
            let classic = cutoff_degrees.is_some() || exponent.is_some();
            let cone = outer_degrees.is_some() || inner_degrees.is_some();
            if classic == cone || (classic && cutoff_degrees.is_none()) || (cone && outer_degrees.is_none()) {
                let message = "expected either cutoff_degrees (and exponent) or outer_degrees (and inner_degrees)";
                faults.push(at.fault(message));
            }
            if let (Some(inner), Some(outer)) = (inner_degrees, outer_degrees)
                && inner > outer
            {
                let message = format!("expected a number from 0 to {outer}, found {inner}");
                faults.push(at.field("inner_degrees").fault(message));
            }
        }
        faults
    }
}

impl From<&LightDescription> for Light {
    fn from(description: &LightDescription) -> Self {
        let fields = description.fields();
        let (kind, own) = match description {
            LightDescription::Point(_) => (LightKind::Point, Self::point(fields.intensity, fields.range)),
            LightDescription::Spot(_) => (cone(fields), Self::point(fields.intensity, fields.range)),
            LightDescription::Directional(_) => (LightKind::Directional, Self::directional(fields.intensity)),
        };
        let light = Self {
            kind,
            color: fields.rgb(),
            ambient: fields.ambient.rgb(),
            enabled: fields.on,
            shadows: fields.shadows,
            ..own
        };
        match kind {
            LightKind::Directional => Self { angle: fields.angle_degrees.to_radians(), ..light },
            LightKind::Point | LightKind::Spot { .. } => Self {
                attenuation: fields.attenuation.0,
                shadow_near: fields.shadow_near,
                radius: fields.radius,
                ..light
            },
        }
    }
}

fn cone(fields: &LightFields) -> LightKind {
    match (fields.cutoff_degrees, fields.outer_degrees) {
        (None, Some(outer)) => LightKind::Spot {
            outer: outer.to_radians(),
            inner: Some(fields.inner_degrees.unwrap_or(outer * FULL).to_radians()),
            exponent: 0.0,
        },
        (cutoff, _) => LightKind::Spot {
            outer: cutoff.unwrap_or(CUTOFF_DEGREES).to_radians(),
            inner: None,
            exponent: fields.exponent.unwrap_or(0.0),
        },
    }
}

impl From<&Light> for LightDescription {
    fn from(light: &Light) -> Self {
        let fields = LightFields {
            color: Color::linear(light.color),
            temperature_kelvin: temperature(light.color),
            intensity: light.intensity,
            ambient: Color::linear(light.ambient),
            on: light.enabled,
            shadows: light.shadows,
            ..LightFields::default()
        };
        let local = LightFields {
            range: light.range,
            attenuation: Attenuation(light.attenuation),
            shadow_near: light.shadow_near,
            radius: light.radius,
            ..fields.clone()
        };
        match light.kind {
            LightKind::Point => Self::Point(local),
            LightKind::Spot { outer, inner: Some(inner), .. } => Self::Spot(LightFields {
                outer_degrees: Some(degrees(outer)),
                inner_degrees: Some(degrees(inner)),
                ..local
            }),
            LightKind::Spot { outer, inner: None, exponent } => {
                Self::Spot(LightFields { cutoff_degrees: Some(degrees(outer)), exponent: Some(exponent), ..local })
            }
            LightKind::Directional => Self::Directional(LightFields { angle_degrees: degrees(light.angle), ..fields }),
        }
    }
}

/// Constant, linear and quadratic; or `inverse_square`.
#[derive(Deserialize, Clone, Copy, Debug, PartialEq)]
#[serde(from = "AttenuationText")]
pub struct Attenuation(pub Vec3);

#[derive(Deserialize)]
#[serde(untagged, expecting = "expected (constant, linear, quadratic) or inverse_square")]
enum AttenuationText {
    Classic([f32; 3]),
    Named(NamedAttenuation),
}

#[derive(Deserialize)]
#[serde(rename_all = "snake_case")]
enum NamedAttenuation {
    InverseSquare,
}

impl From<AttenuationText> for Attenuation {
    fn from(text: AttenuationText) -> Self {
        Self(match text {
            AttenuationText::Classic(coefficients) => Vec3::from_array(coefficients),
            AttenuationText::Named(NamedAttenuation::InverseSquare) => Light::INVERSE_SQUARE,
        })
    }
}

impl Serialize for Attenuation {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.0.to_array().serialize(serializer)
    }
}

impl JsonSchema for Attenuation {
    fn schema_name() -> Cow<'static, str> {
        "Attenuation".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "anyOf": [
                { "type": "array", "items": { "type": "number" }, "minItems": 3, "maxItems": 3 },
                { "const": "inverse_square" },
            ],
            "expected": "three numbers or \"inverse_square\"",
            "see": "(constant, linear, quadratic), or `inverse_square`",
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::describe::check::check;

    fn described(text: &str) -> LightDescription {
        serde_json::from_str(text).expect("a light")
    }

    #[test]
    fn a_light_is_described_as_it_was() {
        for text in [
            r##"{"point": {"color": "#ffcc88", "range": 7, "attenuation": "inverse_square", "radius": 0.1}}"##,
            r#"{"spot": {"outer_degrees": 30, "shadows": true, "intensity": 8}}"#,
            r#"{"spot": {"cutoff_degrees": 35, "exponent": 8, "on": false}}"#,
            r#"{"directional": {"angle_degrees": 2, "ambient": [0.1, 0, 0]}}"#,
            r#"{"point": {"color": [0.3, 0.3, 0.3], "temperature_kelvin": 2700}}"#,
        ] {
            let light = Light::from(&described(text));
            let again = Light::from(&LightDescription::from(&light));
            assert_eq!(again, light, "{text}");
            assert_eq!(check(&LightDescription::from(&light)), Ok(()), "{text}");
        }
    }

    #[test]
    fn a_temperature_is_a_colour_and_is_read_back_of_it() {
        let scaled = |text: &str| Light::from(&described(text)).color;
        assert_eq!(
            scaled(r#"{"spot": {"temperature_kelvin": 2700}}"#),
            Light::point(1.0, 1.0).with_kelvin(2700.0).color
        );
        let half = linear_from_kelvin(9000.0).expect("in range") * 0.5;
        assert_eq!(scaled(r#"{"point": {"temperature_kelvin": 9000, "color": [0.5, 0.5, 0.5]}}"#), half);
        for kelvin in COLDEST..=HOTTEST {
            for brightest in [0.1, 1.0, 300.7] {
                let light = Light::point(1.0, 1.0).with_color(black_body(kelvin).expect("in range") * brightest);
                assert_eq!(LightDescription::from(&light).fields().temperature_kelvin, Some(kelvin), "{brightest}");
            }
        }
        for color in [Vec3::ONE, Vec3::ZERO, Vec3::X, -Vec3::ONE, Vec3::NAN, Vec3::new(1.0, 0.6, 0.3)] {
            assert_eq!(temperature(color), None, "{color}");
        }
    }

    #[test]
    fn of_colour_and_temperature_the_edited_one_counts() {
        let warm = described(r#"{"point": {"color": {"kelvin": 2700}, "intensity": 3}}"#);
        let edited = |name: &str, value: Value| {
            let described = LightDescription::from(&Light::from(&warm));
            let mut fields = serde_json::to_value(described.fields()).expect("fields");
            fields[name] = value;
            let edited = described.edited(fields).expect("a light");
            assert_eq!(check(&edited), Ok(()), "{name}");
            Light::from(&edited)
        };
        let before = Light::from(&warm);
        assert_eq!(edited("temperature_kelvin", json!(5000)), before.clone().with_kelvin(5000.0));
        assert_eq!(edited("temperature_kelvin", Value::Null), before.clone().with_color(Vec3::ONE));
        assert_eq!(edited("color", json!("#f00")), before.clone().with_color(Vec3::X));
        assert_eq!(edited("intensity", json!(4)), Light { intensity: 4.0, ..before });
    }

    #[test]
    fn faults_are_named() {
        for (text, expected) in [
            (r#"{"point": {"range": 0}}"#, "range: expected a number from 0.001 to 10000000, found 0"),
            (r##"{"point": {"color": "#red"}}"##, "color: expected a colour like srgb(\"#ffcc88\") or srgb(\"#fc8\")"),
            (r#"{"point": {"color": [0, -1, 0]}}"#, "color[1]: expected a number from 0 to 1000000000, found -1"),
            (
                r#"{"point": {"temperature_kelvin": 1000}}"#,
                "temperature_kelvin: expected a whole number from 1667 to 25000, found 1000",
            ),
            (
                r#"{"point": {"color": [1, 0, 0], "temperature_kelvin": 2700}}"#,
                "temperature_kelvin: expected either color or temperature_kelvin",
            ),
            (r#"{"directional": {"range": 5}}"#, "range: a directional light has none; only point and spot have it"),
            (
                r#"{"spot": {"outer_degrees": 20, "inner_degrees": 30}}"#,
                "inner_degrees: expected a number from 0 to 20, found 30",
            ),
            (
                r#"{"point": {"attenuation": [0, 0, 0]}}"#,
                "attenuation: expected at least one of the three to be more than 0",
            ),
        ] {
            assert_eq!(check(&described(text)).expect_err(text).to_string(), expected);
        }
    }
}
