// `membrane_forces` of one triangle.
fn membrane_element(number: u32) {
    let triangle = membrane_of(number);
    let f = positions_deformation(triangle);
    let response = fabric_response(triangle.fabric, green_strain(f));
    var stress = response.stress;
    if response.damping > 0.0 {
        let rate = green_strain_rate(f, velocities_deformation(triangle));
        stress = fma(vec3f(response.damping), viscous_stress(response, rate), stress);
    }
    membrane_store(number, membrane_pull(f, stress, triangle.inverse, triangle.area));
}
