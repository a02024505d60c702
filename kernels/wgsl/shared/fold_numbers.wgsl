// How far each fold is from rest [rad] and how fast it folds [rad/s], with a last one that never does; what patches ask of their folds [N m], in the order
// in which `fold_tables` has these; a zero; of what the derivatives of each fold consist, eight numbers, with those of a last one.
@group(0) @binding(82) var<storage, read_write> fold_numbers: array<f32>;
