// NUMERICS section 5, `schwarz`: the solution of the last level, of which the level below takes its share. One workgroup.
//!include model call solve schwarz

const TEAM: u32 = 128u;
const UNKNOWNS: u32 = 384u;

//!include schwarz_factor schwarz_prolong

@compute @workgroup_size(TEAM)
fn main(@builtin(local_invocation_index) thread: u32) {
    if schwarz_rests(thread) {
        return;
    }
    let level = schwarz_level(call.level);
    let size = NODE * level.count;
    for (var k = thread; k < UNKNOWNS; k += TEAM) {
        var value = 0.0;
        if k < size {
            value = schwarz_number(level.scale + k) * schwarz_vectors[level.right_side + k];
        }
        scaled[k] = value;
    }
    factor_products(thread, level.factors, size);
    for (var k = thread; k < size; k += TEAM) {
        let value = schwarz_number(level.scale + k) * factor_column(k, level.factors, size);
        schwarz_vectors[level.second + k] = value;
        scaled[k] = value;
    }
    if call.level > 0u {
        schwarz_prolong(schwarz_level(call.level - 1u), thread, 0u, level.count);
    }
}
