// The limb: lit from the eye and from above, coloured by its material, its feasible region or a field.

struct Scene {
    matrix: mat4x4f,
    eye: vec4f,        // towards the eye, relative units
    target_scale: vec4f, // xyz: target (m), w: 1 / distance
    deform: vec4f,     // x: exaggeration, y: 1 when a field is shown, z: 1 when the region is shown
    section: vec4f,    // what lies on the positive side of this plane is cut away, relative units
    // x: how much a wall in front covers, y: 1 when the first layer marks what is blind, z: how much an edge covers
    look: vec4f,
    up: vec4f,         // xyz: up, w: the stretch above which lengths are marked as off, 0 for none
};

@group(0) @binding(0) var<uniform> scene: Scene;
@group(0) @binding(1) var map: texture_2d<f32>;
@group(0) @binding(2) var map_sampler: sampler;

struct Vertex {
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    @location(2) displacement: vec3f,
    @location(3) value: f32,
    @location(4) region: vec4f,
    @location(5) stretch: f32,
};

struct Fragment {
    @builtin(position) clip: vec4f,
    @location(0) world: vec3f,
    @location(1) normal: vec3f,
    @location(2) value: f32,
    @location(3) region: vec4f,
    @location(4) stretch: f32,
};

fn placed(v: Vertex) -> Fragment {
    let p = v.position + v.displacement * scene.deform.x;
    let local = (p - scene.target_scale.xyz) * scene.target_scale.w;
    return Fragment(scene.matrix * vec4f(local, 1.0), local, v.normal, v.value, v.region, v.stretch);
}

@vertex
fn vs(v: Vertex) -> Fragment {
    return placed(v);
}

fn colour(f: Fragment, front: bool) -> vec3f {
    let to_eye = normalize(scene.eye.xyz - f.world);
    var n = normalize(f.normal);
    if (dot(n, to_eye) < 0.0) { n = -n; }
    let headlight = max(dot(n, to_eye), 0.0);
    let sky = 0.5 + 0.5 * dot(n, scene.up.xyz);
    let light = 0.34 + 0.50 * headlight + 0.16 * sky;

    var base = select(vec3f(0.62, 0.59, 0.55), vec3f(0.86, 0.87, 0.89), front);
    if (scene.deform.z > 0.5) {
        // Layers over each other: where gauges may go, touches come, the part is held, gauges must not go.
        let weight = smoothstep(vec4f(0.35), vec4f(0.65), f.region);
        base = mix(base, select(vec3f(0.30, 0.55, 0.50), vec3f(0.42, 0.75, 0.68), front), weight.x);
        base = mix(base, select(vec3f(0.33, 0.40, 0.62), vec3f(0.50, 0.60, 0.90), front), 0.7 * weight.y);
        base = mix(base, select(vec3f(0.58, 0.50, 0.22), vec3f(0.86, 0.74, 0.34), front), weight.z);
        base = mix(base, select(vec3f(0.62, 0.34, 0.28), vec3f(0.86, 0.45, 0.36), front), weight.w);
    }
    if (scene.deform.y > 0.5) {
        let color = textureSampleLevel(map, map_sampler, vec2f(clamp(f.value, 0.0, 1.0), 0.5), 0.0).rgb;
        base = select(color * 0.72, color, front);
    }
    if (scene.look.y > 0.5) {
        // Grey stripes, which no colour of a map looks like.
        let stripe = step(0.5, fract((f.world.x + f.world.y + f.world.z) * 36.0));
        let grey = mix(vec3f(0.48), vec3f(0.70), stripe);
        base = mix(base, select(grey * 0.72, grey, front), smoothstep(0.35, 0.65, f.region.x));
    }
    if (scene.up.w > 0.0 && f.stretch > scene.up.w) {
        // Thin dark lines the other way: what colours the place stays to be seen.
        let line = step(0.82, fract((f.world.x - f.world.y) * 24.0));
        base = mix(base, vec3f(0.12), 0.55 * line);
    }
    let shine = select(0.0, 0.06 * pow(headlight, 40.0), front);
    return base * light + shine;
}

// Already encoded for the screen: the window blends in gamma space.
@fragment
fn fs(f: Fragment, @builtin(front_facing) front: bool) -> @location(0) vec4f {
    if (dot(scene.section, vec4f(f.world, 1.0)) > 0.0) { discard; }
    return vec4f(colour(f, front), 1.0);
}

// Rims and sharp edges, a little nearer to the eye than the walls that they bound.
@vertex
fn vs_edge(v: Vertex) -> Fragment {
    var f = placed(v);
    f.clip.z -= 0.000015 * f.clip.w;
    return f;
}

@fragment
fn fs_edge(f: Fragment) -> @location(0) vec4f {
    if (dot(scene.section, vec4f(f.world, 1.0)) > 0.0) { discard; }
    return vec4f(vec3f(0.03), 1.0) * scene.look.z;
}

// A wall in front of what is behind it, colour times cover.
@fragment
fn fs_ghost(f: Fragment, @builtin(front_facing) front: bool) -> @location(0) vec4f {
    if (dot(scene.section, vec4f(f.world, 1.0)) > 0.0) { discard; }
    return vec4f(colour(f, front) * scene.look.x, scene.look.x);
}
