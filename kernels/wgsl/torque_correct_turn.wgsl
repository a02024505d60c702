// NUMERICS section 6, torque_correct, second pass: the rotation of each free piece.
//!include model motion measure_sum piece

// An axis has no inertia if it has less than this share of the largest one.
const SHARE_MIN: f32 = 1e-6;

// The angular velocity of a body with this inertia tensor and angular momentum, by elimination with diagonal
// pivots. Without inertia about an axis all particles lie on it: the component along it is zero.
fn rate_of(tensor: mat3x3f, momentum: vec3f) -> vec3f {
    var matrix = tensor;
    var right_side = momentum;
    var order = vec3<u32>(0u, 1u, 2u);
    let largest = max(max(tensor[0].x, tensor[1].y), tensor[2].z);
    var rank = 0u;
    for (; rank < 3u; rank += 1u) {
        var pivot = rank;
        for (var k = rank; k < 3u; k += 1u) {
            if matrix[order[k]][order[k]] > matrix[order[pivot]][order[pivot]] {
                pivot = k;
            }
        }
        let p = order[pivot];
        order[pivot] = order[rank];
        order[rank] = p;
        if matrix[p][p] <= SHARE_MIN * largest {
            break;
        }
        for (var i = rank + 1u; i < 3u; i += 1u) {
            let row = order[i];
            let factor = matrix[row][p] / matrix[p][p];
            for (var j = rank + 1u; j < 3u; j += 1u) {
                let column = order[j];
                matrix[row][column] -= factor * matrix[p][column];
            }
            right_side[row] -= factor * right_side[p];
        }
    }
    var result = vec3f(0.0);
    for (var left = rank; left > 0u; left -= 1u) {
        let p = order[left - 1u];
        var known = 0.0;
        for (var k = left; k < rank; k += 1u) {
            known += matrix[p][order[k]] * result[order[k]];
        }
        result[p] = (right_side[p] - known) / matrix[p][p];
    }
    return result;
}

fn partial(at: u32) -> Sum {
    return Sum(piece_partials[at], piece_partials[at + 1u]);
}

@compute @workgroup_size(MEASURE_THREADS)
fn main(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    let number = workgroup.x + workgroup.y * groups.x;
    let is_piece = number < arrayLength(&piece_rows);
    let blocks = piece_rows[select(0u, number, is_piece)];
    let zero = Sum(vec4f(0.0), vec4f(0.0));
    var first = zero;
    var second = zero;
    var mixed = zero;
    var angular = zero;
    for (var block = blocks.x + thread; block < blocks.y; block += MEASURE_THREADS) {
        let at = block * PIECE_WORDS;
        first = sum_add(first, partial(at));
        second = sum_add(second, partial(at + 2u));
        mixed = sum_add(mixed, partial(at + 4u));
        angular = sum_add(angular, partial(at + 6u));
    }
    first = tree_sum(thread, first);
    second = tree_sum(thread, second);
    mixed = tree_sum(thread, mixed);
    angular = tree_sum(thread, angular);
    if thread == 0u && is_piece {
        let moments = first.high + first.low;
        let squares = second.high + second.low;
        let products = mixed.high + mixed.low;
        let turning = angular.high + angular.low;
        let mass = moments.w;
        let centre = moments.xyz / mass;
        let impulse = vec3f(squares.w, products.w, turning.w);
        let momentum = turning.xyz - cross_product(centre, impulse);
        // About the centre of mass.
        let square = squares.xyz - mass * centre * centre;
        let product = products.xyz - mass * centre * centre.yzx;
        let tensor = mat3x3f(
            vec3f(square.y + square.z, -product.x, -product.z),
            vec3f(-product.x, square.z + square.x, -product.y),
            vec3f(-product.z, -product.y, square.x + square.y),
        );
        let origin = position_in[piece_particles[piece_blocks[blocks.x].y]].xyz;
        piece_turns[number] = Turn(origin, 0.0, centre, 0.0, rate_of(tensor, momentum), 0.0);
    }
}
