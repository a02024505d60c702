// NUMERICS sections 11 and 12: triangles of fabric.

// ELEMENT_WORDS entries for each triangle: its corners and fabric; D_m^-1 by rows; area, damping of bending; then, for each of the nine folds of its patch
// [rad], the three numbers [J^(1/2)] half the sum of whose squares is the energy.
@group(0) @binding(61) var<storage, read> fabric_elements: array<vec4<u32>>;
// Three entries for each fabric: the tensile curves of warp and weft with c and G behind them; the damping of stretching and how threads jam:
// the strain at which they begin to, that from there to the largest one, the coefficient of the stress [N/m].
@group(0) @binding(62) var<storage, read> fabric_laws: array<vec4f>;

const ELEMENT_WORDS: u32 = 12u;
const ELEMENT_INVERSE: u32 = 1u;
const ELEMENT_AREA: u32 = 2u;
const ELEMENT_FOLDS: u32 = 3u;

// The corners, fabric and rest state of a triangle.
struct Membrane {
    particles: vec3<u32>,
    fabric: u32,
    // Rows of D_m^-1 [1/m]: (p, q).
    inverse: vec4f,
    area: f32,
}

fn membrane_of(number: u32) -> Membrane {
    let at = number * ELEMENT_WORDS;
    return Membrane(
        fabric_elements[at].xyz,
        fabric_elements[at].w,
        bitcast<vec4f>(fabric_elements[at + ELEMENT_INVERSE]),
        bitcast<f32>(fabric_elements[at + ELEMENT_AREA].x),
    );
}
