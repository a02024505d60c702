// Of what the derivatives of folds consist, in `fold_numbers`.

fn fold_apexes_place(number: u32) -> u32 {
    return 2u * (model.fold_count + 1u) + 9u * model.element_count + 1u + 8u * number;
}

fn fold_apexes_set(number: u32, fold: Fold) {
    let at = fold_apexes_place(number);
    for (var axis = 0u; axis < 3u; axis += 1u) {
        fold_numbers[at + axis] = fold.apex[axis];
        fold_numbers[at + 3u + axis] = fold.beyond[axis];
    }
    fold_numbers[at + 6u] = fold.feet.x;
    fold_numbers[at + 7u] = fold.feet.y;
}

fn fold_apexes(number: u32) -> Fold {
    let at = fold_apexes_place(number);
    let apex = vec3f(fold_numbers[at], fold_numbers[at + 1u], fold_numbers[at + 2u]);
    let beyond = vec3f(fold_numbers[at + 3u], fold_numbers[at + 4u], fold_numbers[at + 5u]);
    return Fold(apex, beyond, vec2f(fold_numbers[at + 6u], fold_numbers[at + 7u]));
}
