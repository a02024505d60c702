// NUMERICS section 5, conjugate gradient: the error in the norm of the energy, estimated from what iterations take away of its square.

const ENERGY_TERMS: u32 = 64u;
const ENERGY_TAIL_MIN: u32 = 4u;

fn energy_sum(first: u32, end: u32) -> f32 {
    var sum = 0.0;
    for (var k = first; k < end; k += 1u) {
        sum += solve.energy_sums[k / 4u][k % 4u];
    }
    return sum;
}

// Adds the term alpha gamma of an iteration, by one thread; the estimate, negative before there were enough iterations.
fn energy_add(term: f32) -> f32 {
    var filled = solve.energy_filled;
    if filled == 0u || solve.energy_last == solve.energy_stride {
        if filled == ENERGY_TERMS {
            for (var pair = 0u; pair < ENERGY_TERMS / 2u; pair += 1u) {
                let sum = energy_sum(2u * pair, 2u * pair + 2u);
                solve.energy_sums[pair / 4u][pair % 4u] = sum;
            }
            filled = ENERGY_TERMS / 2u;
            solve.energy_stride *= 2u;
        }
        solve.energy_sums[filled / 4u][filled % 4u] = 0.0;
        filled += 1u;
        solve.energy_filled = filled;
        solve.energy_last = 0u;
    }
    solve.energy_sums[(filled - 1u) / 4u][(filled - 1u) % 4u] += term;
    solve.energy_last += 1u;
    let tail = max((filled + 3u) / 4u, ENERGY_TAIL_MIN);
    if filled <= tail {
        return -1.0;
    }
    let share = energy_sum(filled - tail, filled) / (max(solve.energy_before, 0.0) + energy_sum(0u, filled));
    if share >= 0.0 {
        return sqrt(share);
    }
    return -1.0;
}
