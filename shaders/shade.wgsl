// What light does around the limb once it is drawn: less of it in corners, and a soft shadow on the floor below.
//
// The corners go by what is near in the picture itself (M. McGuire, M. Mara, D. Luebke, Scalable ambient obscurance,
// High-Performance Graphics 2012), so that any mesh does, moved or cut. They are looked for at every second pixel each way: light
// changes slowly over a wall, and a software adapter has to do it too.

struct Shade {
    inverse: mat4x4f,   // from clip space to relative units
    eye: vec4f,         // xyz: the eye (relative units), w: pixels of one unit at the distance one
    ambient: vec4f,     // x: how far off walls take light (relative units), y: how much of it, z: light on the floor,
                        // w: no more pixels are looked over than these
    background: vec4f,  // premultiplied with alpha
    floor_middle: vec4f, // xyz: its middle (relative units), w: how dark its shadow is
    floor_right: vec4f, // xyz: along its map, a unit over half of its side
    floor_front: vec4f, // xyz: to its front, w: how many places around a pixel are looked at
    up: vec4f,
};

@group(0) @binding(0) var<uniform> shade: Shade;
@group(0) @binding(1) var depth: texture_depth_multisampled_2d;
@group(0) @binding(2) var lit: texture_2d<f32>;
@group(0) @binding(3) var obscurance: texture_2d<f32>;
@group(0) @binding(4) var floor_map: texture_2d<f32>;
@group(0) @binding(5) var floor_sampler: sampler;

@vertex
fn vs(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {
    let u = vec2f(f32((i << 1u) & 2u), f32(i & 2u));
    return vec4f(u * vec2f(2.0, -2.0) + vec2f(-1.0, 1.0), 0.0, 1.0);
}

fn clamped(pixel: vec2i) -> vec2i {
    return clamp(pixel, vec2i(0), vec2i(textureDimensions(depth)) - 1);
}

// What is seen at a pixel that has a depth.
fn seen(pixel: vec2i, at: f32) -> vec3f {
    let size = vec2f(textureDimensions(depth));
    let clip = vec2f(2.0, -2.0) * (vec2f(pixel) + 0.5) / size + vec2f(-1.0, 1.0);
    let p = shade.inverse * vec4f(clip, at, 1.0);
    return p.xyz / p.w;
}

fn seen_at(pixel: vec2i) -> vec3f {
    let inside = clamped(pixel);
    return seen(inside, textureLoad(depth, inside, 0));
}

// The shorter of the ways to both neighbours: the other one may lead over an edge.
fn shorter(a: vec3f, b: vec3f) -> vec3f {
    return select(b, a, dot(a, a) < dot(b, b));
}

fn distance_of(at: f32) -> f32 {
    // Of the camera's near and far planes, 0.02 and 20.
    return 0.4 / (20.0 - 19.98 * at);
}

// How much light is left, and how far away that is.
@fragment
fn fs_obscurance(@builtin(position) place: vec4f) -> @location(0) vec4f {
    let half = vec2i(place.xy);
    let pixel = clamped(2 * half);
    let own = textureLoad(depth, pixel, 0);
    if (own >= 1.0) { return vec4f(1.0, 20.0, 0.0, 1.0); }
    let p = seen(pixel, own);
    let across = shorter(p - seen_at(pixel - vec2i(1, 0)), seen_at(pixel + vec2i(1, 0)) - p);
    let along = shorter(p - seen_at(pixel - vec2i(0, 1)), seen_at(pixel + vec2i(0, 1)) - p);
    var n = normalize(cross(across, along));
    let to_eye = shade.eye.xyz - p;
    if (dot(n, to_eye) < 0.0) { n = -n; }

    let radius = shade.ambient.x;
    let reach = clamp(radius * shade.eye.w / length(to_eye), 4.0, shade.ambient.w);
    // Each of four neighbours looks between what the others look at; their mean has no pattern.
    let quarter = f32((half.x & 1) + 2 * (half.y & 1)) / 4.0;
    let taps = i32(shade.floor_front.w);
    var sum = 0.0;
    for (var k = 0; k < taps; k++) {
        let share = (f32(k) + quarter + 0.125) / f32(taps);
        let angle = 2.3999632 * (f32(k) + f32(taps) * quarter * 4.0);
        let way = vec2i(round(reach * sqrt(share) * vec2f(cos(angle), sin(angle))));
        let v = seen_at(pixel + way) - p;
        let vv = dot(v, v) / (radius * radius);
        // What lies in the wall's own plane, as coarse facets make it, takes nothing.
        let vn = dot(v, n) / radius - 0.04;
        let near = max(1.0 - vv, 0.0);
        sum += near * near * near * max(vn / (0.02 + vv), 0.0);
    }
    let left = max(1.0 - shade.ambient.y * sum * 4.0 / f32(taps), 0.0);
    return vec4f(left, distance_of(own), 0.0, 1.0);
}

// The mean of the four that are nearest to a pixel, not over edges.
fn light_left(pixel: vec2i) -> f32 {
    if (shade.ambient.y <= 0.0) { return 1.0; }
    let own = distance_of(textureLoad(depth, pixel, 0));
    let most = vec2i(textureDimensions(obscurance)) - 1;
    let first = (pixel - 1) / 2;
    var sum = vec2f(0.0);
    for (var k = 0; k < 4; k++) {
        let other = textureLoad(obscurance, clamp(first + vec2i(k & 1, k >> 1), vec2i(0), most), 0).xy;
        let weight = select(0.0, 1.0, abs(other.y - own) < max(0.25 * shade.ambient.x, 0.002));
        sum += vec2f(other.x, 1.0) * weight;
    }
    return select(sum.x / sum.y, 1.0, sum.y < 0.5);
}

// How much of the light the part takes from the floor, and how much falls there.
fn floor_at(pixel: vec2i) -> vec2f {
    if (shade.floor_middle.w <= 0.0) { return vec2f(0.0); }
    let way = seen(pixel, 0.5) - shade.eye.xyz;
    let above = dot(shade.eye.xyz - shade.floor_middle.xyz, shade.up.xyz);
    let down = -dot(way, shade.up.xyz);
    if (above <= 0.0 || down <= 0.0) { return vec2f(0.0); }
    let off = shade.eye.xyz + way * (above / down) - shade.floor_middle.xyz;
    let at = vec2f(dot(off, shade.floor_right.xyz), dot(off, shade.floor_front.xyz));
    if (max(abs(at.x), abs(at.y)) >= 1.0) { return vec2f(0.0); }
    let dark = textureSampleLevel(floor_map, floor_sampler, 0.5 + 0.5 * at, 0.0).x;
    return vec2f(dark * shade.floor_middle.w, shade.ambient.z * (1.0 - smoothstep(0.0, 1.0, length(at))));
}

// The limb was drawn over nothing: its alpha is how much of a pixel it covers.
@fragment
fn fs_finish(@builtin(position) place: vec4f) -> @location(0) vec4f {
    let pixel = vec2i(place.xy);
    let limb = textureLoad(lit, pixel, 0);
    var left = 1.0;
    if (limb.a > 0.0) { left = light_left(pixel); }
    let free = 1.0 - limb.a;
    var ground = vec2f(0.0);
    if (free > 0.0) { ground = floor_at(pixel); }
    let behind = shade.background * free;
    let colour = limb.rgb * left + (behind.rgb + free * ground.y) * (1.0 - ground.x);
    // Over nothing the shadow is a layer of its own.
    return vec4f(colour, limb.a + behind.a + free * (1.0 - shade.background.a) * ground.x);
}
