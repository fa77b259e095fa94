// Copies the finished picture of the limb into the window.

struct Corner {
    @builtin(position) position: vec4f,
    @location(0) uv: vec2f,
};

@group(0) @binding(0) var picture: texture_2d<f32>;

@vertex
fn vs(@builtin(vertex_index) i: u32) -> Corner {
    let u = vec2f(f32((i << 1u) & 2u), f32(i & 2u));
    return Corner(vec4f(u * vec2f(2.0, -2.0) + vec2f(-1.0, 1.0), 0.0, 1.0), u);
}

// Pixel by pixel: the picture is as large as its place.
@fragment
fn fs(c: Corner) -> @location(0) vec4f {
    let size = vec2i(textureDimensions(picture));
    let pixel = clamp(vec2i(c.uv * vec2f(size)), vec2i(0), size - 1);
    return textureLoad(picture, pixel, 0);
}
