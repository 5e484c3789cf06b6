// Specular antialiasing: a pixel shows normals that differ, those of bumps that a mip level averages away and those of a
// curved mesh. Its highlight is the mean of theirs: about that of their mean normal, wider and less bright.

override SPECULAR_AA: bool = false;

// The variance of a place within a pixel, in pixels, along one axis: that of a uniform distribution of width 1.
const PIXEL_VARIANCE: f32 = 0.0833333;
// A bound of `curved_slopes`: at silhouettes the differences go on beyond the edge (the κ of Tokuyoshi and Kaplanyan).
const MOST_CURVED: f32 = 0.18;

// The variance of the slopes that a normal map's texel is the mean of, the sum of both axes'. Its alpha is 1 − sin θ
// where all normals lean by θ from their mean (`spread` in systems/assets/image.rs has others); slopes are tan θ times
// the material's scale.
fn averaged_slopes(alpha: f32, scale: f32) -> f32 {
    let sine = min(1.0 - alpha, 0.99);
    return sine * sine * scale * scale / (1.0 - sine * sine);
}

// The variance of a curved surface's slopes within a pixel, from the change of its normal to the next pixels (Tokuyoshi,
// Kaplanyan: "Improved Geometric Specular Antialiasing", I3D 2019, with a pixel's box for their Gaussian, which is
// wider: it answers flicker, this the mean over the pixel).
fn curved_slopes(normal: vec3f) -> f32 {
    let n = normalize(normal);
    let dx = dpdx(n);
    let dy = dpdy(n);
    return min(PIXEL_VARIANCE * (dot(dx, dx) + dot(dy, dy)), MOST_CURVED);
}

// The surface as a pixel shows it whose slopes have these variances, of bumps and of the mesh. Toksvig: "Mipmapping
// Normal Maps", Journal of Graphics Tools, 2005, for the classic models; widths as variances of slopes, which add up,
// are those of Olano, Baker: "LEAN Mapping", I3D 2010.
fn widened(of_one_normal: Surface, bumps: f32, curved: f32) -> Surface {
    var surface = of_one_normal;
    let slopes = bumps + curved;
    // The mean of unit normals is shorter by this, and n·l is linear. Of a curved mesh it is nearly 1, and left out:
    // where maps are flat, all techniques give one picture.
    surface.diffuse_scale = inverseSqrt(1.0 + bumps);
    let gloss = surface.gloss;
    if is_ggx() {
        // α² is twice the variance along an axis. Visibility stays: bumps do not hide each other.
        let width = min(gloss * gloss + slopes, 1.0);
        surface.highlight_scale = gloss * gloss / width;
        surface.gloss = sqrt(width);
        return surface;
    }
    // A lobe (n·h)^s is as wide as a Gaussian of variance 1/s along each axis.
    var wider = 1.0 + gloss * 0.5 * slopes;
    if SHADING == SHADING_PHONG && !is_dot3() {
        // The reflected ray turns twice as far as the normal, across its plane 2 n·v times as far.
        let n_v = dot(surface.normal, surface.toward_eye);
        let turned = gloss * 2.0 * slopes;
        wider = sqrt((1.0 + turned) * (1.0 + turned * n_v * n_v));
    }
    surface.gloss = gloss / wider;
    surface.highlight_scale = (1.0 + surface.gloss) / (1.0 + gloss);
    return surface;
}
