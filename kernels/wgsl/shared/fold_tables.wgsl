// Folds, each once, numbers of one meaning side by side for all of them: the ends of its edge, and the third corners of both triangles; the angle at rest
// [rad]; what stands in the matrix for stiffness [N m] and damping [N m s]; FOLD_PLACES_MAX places in `fold_numbers` of what patches ask of it, that of a
// zero behind the last one. Then for all patches the first of their folds, the second ones and so on.
@group(0) @binding(81) var<storage, read> fold_tables: array<u32>;

const FOLD_PLACES_MAX: u32 = 6u;

fn fold_vertices(number: u32) -> vec4<u32> {
    let n = model.fold_count;
    return vec4<u32>(fold_tables[number], fold_tables[n + number], fold_tables[2u * n + number], fold_tables[3u * n + number]);
}

fn fold_rest(number: u32) -> f32 {
    return bitcast<f32>(fold_tables[4u * model.fold_count + number]);
}

fn fold_stiffness(number: u32) -> f32 {
    return bitcast<f32>(fold_tables[5u * model.fold_count + number]);
}

fn fold_damping(number: u32) -> f32 {
    return bitcast<f32>(fold_tables[6u * model.fold_count + number]);
}

fn fold_place(number: u32, k: u32) -> u32 {
    return fold_tables[(7u + k) * model.fold_count + number];
}

fn patch_fold(number: u32, k: u32) -> u32 {
    return fold_tables[(7u + FOLD_PLACES_MAX) * model.fold_count + k * model.element_count + number];
}
