// Everything of which the blocks of fabric consist. Four vectors for each triangle: f_u with A G behind it; f_v; A psi_u'', A c, A psi_v''; A S+, times
// what they are multiplied by in the matrix [kg m^2]. Then four for each fold, one for each vertex [kg^(1/2)]: the block of two vertices is the product of
// theirs.
@group(0) @binding(65) var<storage, read_write> fabric_tangents: array<vec4f>;
