// NUMERICS section 10: sums of twice the precision, each the unevaluated sum of two numbers (Knuth
// 1969, "The Art of Computer Programming" 2, section 4.2.2), in a tree of fixed shape.

const MEASURE_THREADS: u32 = 256u;
// vec4 numbers that one set of partial results takes.
const MEASURE_WORDS: u32 = 8u;
const NO_PARTICLE: u32 = 0xffffffffu;

struct Sum {
    high: vec4f,
    low: vec4f,
}

struct Extremes {
    strain_max: f32,
    strain_particle: u32,
    penetration: f32,
    non_finite: u32,
    contacts: u32,
}

fn sum_add(a: Sum, b: Sum) -> Sum {
    let high = a.high + b.high;
    let from_b = high - a.high;
    let lost = (a.high - (high - from_b)) + (b.high - from_b);
    return Sum(high, (a.low + b.low) + lost);
}

// At equal strains the earlier particle counts.
fn extremes_merge(a: Extremes, b: Extremes) -> Extremes {
    var merged = a;
    if b.strain_max > a.strain_max
        || (b.strain_max == a.strain_max && b.strain_particle < a.strain_particle) {
        merged.strain_max = b.strain_max;
        merged.strain_particle = b.strain_particle;
    }
    merged.penetration = max(a.penetration, b.penetration);
    merged.non_finite = min(a.non_finite, b.non_finite);
    merged.contacts = a.contacts + b.contacts;
    return merged;
}

fn extremes_none() -> Extremes {
    return Extremes(-1.0, NO_PARTICLE, 0.0, NO_PARTICLE, 0u);
}

var<workgroup> tree: array<Sum, MEASURE_THREADS>;
var<workgroup> extremes_tree: array<Extremes, MEASURE_THREADS>;

// The sum over all threads of a workgroup, in thread 0.
fn tree_sum(thread: u32, own: Sum) -> Sum {
    workgroupBarrier();
    tree[thread] = own;
    for (var half = MEASURE_THREADS / 2u; half > 0u; half /= 2u) {
        workgroupBarrier();
        if thread < half {
            tree[thread] = sum_add(tree[thread], tree[thread + half]);
        }
    }
    return tree[thread];
}

fn tree_extremes(thread: u32, own: Extremes) -> Extremes {
    workgroupBarrier();
    extremes_tree[thread] = own;
    for (var half = MEASURE_THREADS / 2u; half > 0u; half /= 2u) {
        workgroupBarrier();
        if thread < half {
            extremes_tree[thread] = extremes_merge(
                extremes_tree[thread],
                extremes_tree[thread + half],
            );
        }
    }
    return extremes_tree[thread];
}
