// What a stretched triangle puts at its corners.
fn membrane_store(number: u32, pull: Pull) {
    fabric_vector_set(3u * number, -(pull.second + pull.third));
    fabric_vector_set(3u * number + 1u, pull.second);
    fabric_vector_set(3u * number + 2u, pull.third);
}
