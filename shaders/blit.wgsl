// Copies the finished picture of the limb into the window.

struct Corner {
    @builtin(position) position: vec4f,
    @location(0) uv: vec2f,
};

@group(0) @binding(0) var picture: texture_2d<f32>;
@group(0) @binding(1) var picture_sampler: sampler;

@vertex
fn vs(@builtin(vertex_index) i: u32) -> Corner {
    let u = vec2f(f32((i << 1u) & 2u), f32(i & 2u));
    return Corner(vec4f(u * vec2f(2.0, -2.0) + vec2f(-1.0, 1.0), 0.0, 1.0), u);
}

@fragment
fn fs(c: Corner) -> @location(0) vec4f {
    return textureSample(picture, picture_sampler, c.uv);
}
