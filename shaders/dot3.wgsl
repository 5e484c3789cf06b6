// DOT3 bump mapping, as fixed-function hardware did it: light vectors per vertex in tangent space, packed into colours
// of 8 bits, interpolated and not made unit again, dotted with the normal map by a texture combiner whose result has 8
// bits.

struct Dot3Out {
    @invariant @builtin(position) clip_position: vec4f,
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    @location(2) tangent: vec4f,
    @location(3) uvs: vec4f,
    @location(4) color: vec4f,
    @location(5) @interpolate(flat) slot: u32,
    // To each of the object's lights, and halfway between that and the eye; tangent space, packed.
    @location(6) toward_0: vec3f,
    @location(7) toward_1: vec3f,
    @location(8) toward_2: vec3f,
    @location(9) halfway_0: vec3f,
    @location(10) halfway_1: vec3f,
    @location(11) halfway_2: vec3f,
}

fn quantized(v: vec3f) -> vec3f {
    return floor(saturate(v) * 255.0 + 0.5) / 255.0;
}

fn packed(unit: vec3f) -> vec3f {
    return quantized(unit * 0.5 + 0.5);
}

fn unpacked(color: vec3f) -> vec3f {
    return color * 2.0 - 1.0;
}

// The combiner's dot product of two unpacked colours.
fn combined(normal: vec3f, direction: vec3f) -> f32 {
    return quantized(vec3f(dot(normal, direction))).x;
}

fn in_frame(frame: Frame, v: vec3f) -> vec3f {
    return vec3f(dot(v, frame.tangent), dot(v, frame.bitangent), dot(v, frame.normal));
}

struct Dot3Vectors {
    toward: vec3f,
    halfway: vec3f,
}

fn dot3_vectors(slot: u32, position: vec3f, frame: Frame) -> Dot3Vectors {
    if slot == NO_LIGHT {
        return Dot3Vectors(vec3f(0.5), vec3f(0.5));
    }
    let toward = arriving(slot, position, view.eye).toward;
    let halfway = normalize(toward + toward_eye(position));
    return Dot3Vectors(packed(in_frame(frame, toward)), packed(in_frame(frame, halfway)));
}

@vertex
fn vs_dot3(in: VertexIn) -> Dot3Out {
    let vertex = transformed(in);
    let instance = load_instance(in.slot);
    var frame = tangent_frame(vertex.normal, vertex.tangent);
    if TRANSFORMED_UVS {
        frame = turned_frame(frame, load_material(instance.material).image_from_mesh_uv[MAP_NORMAL]);
    }
    let first = dot3_vectors(instance.lights[0], vertex.position, frame);
    let second = dot3_vectors(instance.lights[1], vertex.position, frame);
    let third = dot3_vectors(instance.lights[2], vertex.position, frame);
    return Dot3Out(
        vertex.clip_position,
        vertex.position,
        vertex.normal,
        vertex.tangent,
        vertex.uvs,
        vertex.color,
        vertex.slot,
        first.toward,
        second.toward,
        third.toward,
        first.halfway,
        second.halfway,
        third.halfway,
    );
}

// The interpolated vectors of this pixel; set by dot3_shaded before anything is lit.
var<private> interpolated: array<Dot3Vectors, 3>;

fn dot3_shaded(in: Dot3Out, front: bool) -> Shaded {
    interpolated[0] = Dot3Vectors(in.toward_0, in.halfway_0);
    interpolated[1] = Dot3Vectors(in.toward_1, in.halfway_1);
    interpolated[2] = Dot3Vectors(in.toward_2, in.halfway_2);
    let vertex = VertexOut(in.clip_position, in.position, in.normal, in.tangent, in.uvs, in.color, in.slot);
    return shaded(vertex, front);
}

@fragment
fn fs_dot3(in: Dot3Out, @builtin(front_facing) front: bool) -> @location(0) vec4f {
    return dot3_shaded(in, front).color;
}

@fragment
fn fs_dot3_with_outputs(in: Dot3Out, @builtin(front_facing) front: bool) -> ColorAndOutputs {
    return color_and_outputs(dot3_shaded(in, front));
}

// What the surface reflects of a light, whose number among the object's lights is `number`. `light` gives its colour:
// distance and cone count per pixel, as the attenuation maps of the time had it.
fn dot3_reflection(surface: Surface, bump: Bump, number: u32, slot: u32, light: Arriving) -> vec3f {
    var toward: vec3f;
    var halfway: vec3f;
    if TECHNIQUE == TECHNIQUE_DOT3_CONSTANT {
        // One vector for the whole object, the "texture factor", from its origin; as an object-space normal map has it.
        let rows = load_world_from_object(bump.slot);
        let origin = vec3f(rows[0].w, rows[1].w, rows[2].w) - view.eye;
        let direction = arriving(slot, origin, view.eye).toward;
        toward = unpacked(packed(direction));
        halfway = unpacked(packed(normalize(direction + toward_eye(origin))));
    } else if number >= 3u {
        // Beyond the three whose vectors are interpolated.
        toward = unpacked(packed(in_frame(bump.frame, light.toward)));
        halfway = unpacked(packed(in_frame(bump.frame, normalize(light.toward + surface.toward_eye))));
    } else {
        toward = unpacked(interpolated[number].toward);
        halfway = unpacked(interpolated[number].halfway);
    }
    let diffuse = combined(bump.packed_normal, toward);
    var exponent = surface.gloss;
    if is_ggx() {
        // The exponent whose highlight is as wide (Walter et al.: "Microfacet Models for Refraction", 2007).
        exponent = 2.0 / (surface.gloss * surface.gloss) - 2.0;
    }
    let cosine = combined(bump.packed_normal, halfway);
    let highlight = select(0.0, pow(max(cosine, 1e-10), exponent), diffuse > 0.0 && (cosine > 0.0 || exponent == 0.0));
    let matte = surface.diffuse * (diffuse * surface.diffuse_scale);
    return matte + surface.specular * (highlight * surface.highlight_scale);
}
