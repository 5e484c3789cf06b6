// From the HDR target to the screen. The target's format encodes to sRGB.

@group(0) @binding(0) var hdr: texture_2d<f32>;
@group(0) @binding(1) var hdr_samples: texture_multisampled_2d<f32>;
@group(0) @binding(2) var hdr_layers: texture_2d_array<f32>;

@vertex
fn vs_tonemap(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    return vec4f(f32(index & 1u) * 4.0 - 1.0, f32(index >> 1u) * 4.0 - 1.0, 0.0, 1.0);
}

@fragment
fn fs_tonemap(@builtin(position) position: vec4f) -> @location(0) vec4f {
    return vec4f(tone_mapped(textureLoad(hdr, vec2i(position.xy), 0).rgb), 1.0);
}

// Of several views of one size, one below the other.
@fragment
fn fs_tonemap_layers(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let pixel = vec2u(position.xy);
    let height = textureDimensions(hdr_layers).y;
    let linear = textureLoad(hdr_layers, vec2u(pixel.x, pixel.y % height), pixel.y / height, 0).rgb;
    return vec4f(tone_mapped(linear), 1.0);
}

// The mean of what each sample would be shown as. So an edge shows how much of the pixel is covered, however bright it
// is. The curve of the mean would show a lamp's edge as bright as the lamp: a quarter of 16 is still beyond white.
@fragment
fn fs_tonemap_multisampled(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let pixel = vec2i(position.xy);
    let samples = textureNumSamples(hdr_samples);
    let first = textureLoad(hdr_samples, pixel, 0).rgb;
    var differ = false;
    for (var i = 1u; i < samples; i++) {
        differ |= any(textureLoad(hdr_samples, pixel, i).rgb != first);
    }
    // Within a face all samples are the same colour, and the first curve is the mean. Asked at the end, as software
    // drivers go through a loop's body before they leave it.
    let count = select(1u, samples, differ);
    var sum = vec3f(0.0);
    var i = 0u;
    loop {
        sum += tone_mapped(textureLoad(hdr_samples, pixel, i).rgb);
        i++;
        continuing {
            break if i >= count;
        }
    }
    return vec4f(sum / f32(count), 1.0);
}
