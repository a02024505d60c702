//! Units of textile laboratories in SI units.

use std::f64::consts::PI;

/// Force of one gram \[N\], with standard gravity (ISO 80000-4).
pub const GRAM_FORCE: f64 = 9.806_65e-3;

/// Standard gravity \[m/s^2\].
pub const GRAVITY: f64 = 9.806_65;

/// 1 gf/cm \[N/m\]: forces per width, such as 2HG.
pub const GF_PER_CM: f64 = GRAM_FORCE / 1e-2;

/// 1 gf/(cm degree) \[N/m\]: shear stiffness G, 56.19 N/m for each radian.
pub const GF_PER_CM_DEGREE: f64 = GF_PER_CM * 180.0 / PI;

/// 1 gf cm^2/cm \[N m\]: bending rigidity B per width.
pub const GF_CM2_PER_CM: f64 = GRAM_FORCE * 1e-4 / 1e-2;

/// 1 gf cm/cm \[N\]: moment per width, such as 2HB.
pub const GF_CM_PER_CM: f64 = GRAM_FORCE;

/// 1 gf cm/cm^2 \[J/m^2\]: tensile energy WT.
pub const GF_CM_PER_CM2: f64 = GRAM_FORCE * 1e-2 / 1e-4;

/// 1 mg/cm^2 \[kg/m^2\].
pub const MG_PER_CM2: f64 = 1e-2;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_those_of_the_literature() {
        assert!((GF_PER_CM_DEGREE - 56.19).abs() < 0.005);
        assert!((GF_CM2_PER_CM - 9.807e-5).abs() < 1e-8);
        assert!((GF_CM_PER_CM2 - 0.981).abs() < 1e-3);
        assert!((500.0 * GF_PER_CM - 490.0).abs() < 0.5);
    }
}
