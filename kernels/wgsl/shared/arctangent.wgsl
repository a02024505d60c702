// NUMERICS section 12: the angle of a direction, of division, products and sums alone. Angles are two numbers, the second of which is what
// the rounding of the first leaves.

const PI: f32 = 3.14159274;
const PI_REST: f32 = -8.74227766e-08;
const HALF_PI: f32 = 1.57079637;
const HALF_PI_REST: f32 = -4.37113883e-08;
const QUARTER_PI: f32 = 0.785398185;
const QUARTER_PI_REST: f32 = -2.18556941e-08;
// atan(1/2)
const HALF_SLOPE: f32 = 0.463647604;
const HALF_SLOPE_REST: f32 = 5.01215869e-09;

// Angle of (x, y) in [-pi, pi]; 0 for x = y = 0. Zeros have no sign.
fn arctangent2(y: f32, x: f32) -> f32 {
    let steep = abs(y) > abs(x);
    let small = select(abs(y), abs(x), steep);
    let large = select(abs(x), abs(y), steep);
    var over = small - large;
    var under = small + large;
    var base = vec2f(QUARTER_PI, QUARTER_PI_REST);
    if small <= 0.4375 * large {
        over = small;
        under = large;
        base = vec2f(0.0);
    } else if small <= 0.6875 * large {
        over = fma(2.0, small, -large);
        under = fma(2.0, large, small);
        base = vec2f(HALF_SLOPE, HALF_SLOPE_REST);
    }
    var r = 0.0;
    if under != 0.0 {
        r = over / under;
    }
    let z = r * r;
    var p = fma(z, 6.1687607318e-2, -1.0648017377e-1);
    p = fma(z, p, 1.4253635705e-1);
    p = fma(z, p, -1.9999158382e-1);
    p = fma(z, p, 3.3333328366e-1);
    let within = base.x + (fma(-r, z * p, r) + base.y);
    var turn = vec2f(0.0);
    if steep {
        turn = vec2f(HALF_PI, HALF_PI_REST);
    } else if x < 0.0 {
        turn = vec2f(PI, PI_REST);
    }
    let angle = turn.x + (select(within, -within, steep != (x < 0.0)) + turn.y);
    return select(angle, -angle, y < 0.0);
}
