//! What a piece of fabric answers to a strain that is the same everywhere.

use cloth_core::fabric::{Fabric, TensileCurve};

/// A symmetric tensor in the plane: xx, yy, xy.
pub(crate) type Plane = [f64; 3];

/// Stress of a tensile curve at a Green strain \[N/m\].
pub(crate) fn curve_stress(curve: &TensileCurve, strain: f64) -> f64 {
    let TensileCurve { linear, cubic, end } = *curve;
    let bent = if strain <= 0.0 {
        0.0
    } else if strain <= end {
        cubic * strain.powi(3)
    } else {
        cubic * (end.powi(3) + 3.0 * end.powi(2) * (strain - end))
    };
    linear * strain + bent
}

/// The tensor as seen along axes turned by `angle` \[rad\] counter-clockwise.
pub(crate) fn turned([xx, yy, xy]: Plane, angle: f64) -> Plane {
    let (s, c) = angle.sin_cos();
    [
        c * c * xx + s * s * yy + 2.0 * s * c * xy,
        s * s * xx + c * c * yy - 2.0 * s * c * xy,
        s * c * (yy - xx) + (c * c - s * s) * xy,
    ]
}

/// Second Piola stress \[N/m\] for a Green strain, both along a strip whose length makes `angle` with the warp \[rad\].
pub(crate) fn stress(fabric: &Fabric, strain: Plane, angle: f64) -> Plane {
    let [e11, e22, e12] = turned(strain, -angle);
    let along = [
        curve_stress(&fabric.warp, e11) + fabric.coupling * e22,
        curve_stress(&fabric.weft, e22) + fabric.coupling * e11,
        2.0 * fabric.shear * e12,
    ];
    turned(along, angle)
}

/// Green strain of an elongation.
pub(crate) fn green(elongation: f64) -> f64 {
    elongation + 0.5 * elongation * elongation
}

/// Strain and stress of a strip with free sides that is stretched along its length by the Green strain `along`: Newton's method for
/// S_yy = S_xy = 0.
pub(crate) fn uniaxial(fabric: &Fabric, along: f64, angle: f64) -> (Plane, Plane) {
    let mut strain = [along, 0.0, 0.0];
    for _ in 0..60 {
        let at =
            |dy: f64, dxy: f64| stress(fabric, [strain[0], strain[1] + dy, strain[2] + dxy], angle);
        let d = 1e-7;
        let [base, y, xy] = [at(0.0, 0.0), at(d, 0.0), at(0.0, d)];
        let [a, b] = [(y[1] - base[1]) / d, (xy[1] - base[1]) / d];
        let [c, e] = [(y[2] - base[2]) / d, (xy[2] - base[2]) / d];
        let determinant = a * e - b * c;
        strain[1] -= (e * base[1] - b * base[2]) / determinant;
        strain[2] -= (a * base[2] - c * base[1]) / determinant;
    }
    (strain, stress(fabric, strain, angle))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_strip_with_free_sides_has_stress_along_it_alone() {
        let fabric = crate::experiments::poplin();
        for angle in [0.0, 0.4, std::f64::consts::FRAC_PI_2] {
            let (strain, stress) = uniaxial(&fabric, 0.03, angle);
            assert!(stress[1].abs() < 1e-9 && stress[2].abs() < 1e-9, "{stress:?}");
            assert!(strain[1] < 0.0 && stress[0] > 0.0);
        }
        let turned_twice = turned(turned([1.0, 2.0, 0.3], 0.7), -0.7);
        assert!(turned_twice.iter().zip([1.0, 2.0, 0.3]).all(|(a, b)| (a - b).abs() < 1e-14));
    }
}
