//! Meshes that techniques are compared on.

use crate::name::{self, named};
use glam::{UVec2, Vec2};
use systems::assets::{Mesh, shapes};

/// Triangles of the displaced figure, at the most.
const MOST_TRIANGLES: f32 = 2.1e6;

named! {
    /// Mesh that is bumped.
    pub enum BaseMesh {
        /// One quad of 2 m
        Plane = "plane",
        /// 1.8 m wide, of 32 × 16 quads
        Sphere = "sphere",
        /// 2.08 m wide, of 48 × 24 quads
        Torus = "torus",
    }
}

impl serde::Serialize for BaseMesh {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(name::of(&Self::ALL, *self))
    }
}

impl BaseMesh {
    /// Repetitions of the image along U and V: texels are about square.
    pub fn repeats(self) -> Vec2 {
        match self {
            Self::Plane => Vec2::ONE,
            Self::Sphere | Self::Torus => Vec2::new(4.0, 2.0),
        }
    }

    fn mesh(self, quads: UVec2) -> Mesh {
        let mesh = match self {
            Self::Plane => shapes::plane(Vec2::splat(2.0), quads),
            Self::Sphere => shapes::sphere(0.9, quads.x, quads.y),
            Self::Torus => shapes::torus(0.72, 0.32, quads.x, quads.y),
        };
        shapes::with_uv_scale(mesh, self.repeats())
    }

    /// Coarse mesh that techniques are drawn on.
    pub fn coarse(self) -> Mesh {
        self.mesh(match self {
            Self::Plane => UVec2::ONE,
            Self::Sphere => UVec2::new(32, 16),
            Self::Torus => UVec2::new(48, 24),
        })
    }

    /// Two quads for each texel each way, so that a vertex is in the middle of every texel; fewer where that were too
    /// many.
    pub fn fine(self, texels: (usize, usize)) -> Mesh {
        let wanted = self.repeats() * Vec2::new(texels.0 as f32, texels.1 as f32) * 2.0;
        let scale = (MOST_TRIANGLES / (2.0 * wanted.x * wanted.y)).sqrt().min(1.0);
        self.mesh((wanted * scale).round().as_uvec2())
    }
}
