// Light: a sun with a shadow map, the sky above, the ground below, a weak light at the eye.

@group(0) @binding(1) var shadow_map: texture_depth_2d;
@group(0) @binding(2) var shadow_sampler: sampler_comparison;

const SUN = vec3f(1.28, 1.23, 1.14);
const SKY = vec3f(0.44, 0.48, 0.55);
const GROUND = vec3f(0.16, 0.15, 0.14);
const FILL = vec3f(0.11, 0.12, 0.13);
const HORIZON = vec3f(0.855, 0.871, 0.888);
const ZENITH = vec3f(0.491, 0.578, 0.672);

// Share of the sun that reaches a point, from nine samples of the shadow map. The point is moved
// off its surface by a little more than a texel, so that a surface does not shade itself.
fn sunlight(world: vec3f, normal: vec3f) -> f32 {
    let point = world + normal * (2.5 * view.light.w);
    let clip = view.light_from_world * vec4f(point, 1.0);
    let place = clip.xy * vec2f(0.5, -0.5) + 0.5;
    if any(place < vec2f(0.0)) || any(place > vec2f(1.0)) || clip.z > 1.0 {
        return 1.0;
    }
    let texel = 1.0 / f32(textureDimensions(shadow_map).x);
    var sum = 0.0;
    for (var y = -1; y <= 1; y++) {
        for (var x = -1; x <= 1; x++) {
            let offset = vec2f(f32(x), f32(y)) * texel * 1.3;
            sum += textureSampleCompareLevel(shadow_map, shadow_sampler, place + offset, clip.z);
        }
    }
    return sum / 9.0;
}

// Colour of a matt surface in linear light; `normal` is on the side of the eye.
fn shade(albedo: vec3f, world: vec3f, normal: vec3f, gloss: f32) -> vec3f {
    let toward = normalize(view.eye.xyz - world);
    let sun = max(dot(normal, view.light.xyz), 0.0) * sunlight(world, normal);
    let up = 0.5 + 0.5 * normal.z;
    let half_way = normalize(toward + view.light.xyz);
    let shine = gloss * pow(max(dot(normal, half_way), 0.0), 24.0) * min(sun * 4.0, 1.0);
    let fill = FILL * max(dot(normal, toward), 0.0);
    return albedo * (SUN * sun + mix(GROUND, SKY, up) + fill) * 0.62 + vec3f(shine);
}

fn sky(direction: vec3f) -> vec3f {
    return mix(HORIZON, ZENITH, smoothstep(-0.1, 0.7, direction.z));
}

// Linear light to what screens and picture files hold.
fn encode(linear: vec3f) -> vec4f {
    let c = clamp(linear, vec3f(0.0), vec3f(1.0));
    let low = c * 12.92;
    let high = 1.055 * pow(c, vec3f(1.0 / 2.4)) - 0.055;
    return vec4f(select(high, low, c <= vec3f(0.0031308)), 1.0);
}
