// Cells of space in a table of fixed size. Three neighbours along x lie side by side in it; which
// row they are in is hashed, and particles of other cells that end up there are told apart by their
// distance.

fn cell_coordinate(position: f32) -> i32 {
    let cell = floor(position * contact.cells_per_metre);
    // Beyond this floating point numbers are far coarser than cells. Equal ones stay equal, and no
    // two others are near each other.
    if abs(cell) < 1073741824.0 {
        return i32(cell);
    }
    return bitcast<i32>(cell);
}

fn cell_of(position: vec3f) -> vec3<i32> {
    return vec3<i32>(
        cell_coordinate(position.x),
        cell_coordinate(position.y),
        cell_coordinate(position.z),
    );
}

// Place of a cell in the table. Multipliers after Teschner et al. (2003), "Optimized spatial hashing
// for collision detection of deformable objects".
fn cell_place(cell: vec3<i32>) -> u32 {
    let row = (bitcast<u32>(cell.y) * 19349663u) ^ (bitcast<u32>(cell.z) * 83492791u);
    let mixed = row ^ (row >> 15u);
    return (mixed + bitcast<u32>(cell.x)) & contact.cell_mask;
}
