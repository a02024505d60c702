//! Named fabrics with measured values.

use super::{Aerodynamics, BendModel, Mass, Material, SpringCoefficients};

/// A fabric by name.
///
/// The values were measured by Wang, O'Brien and Ramamoorthi (2011), "Data-driven elastic models
/// for cloth: modeling and measurement", ACM Transactions on Graphics 30(4), article 71: mass per
/// area, and at small strain the tensile stiffness of weft and warp, the shear stiffness and the
/// bending stiffness of the weft. The thickness is nominal; they did not measure it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MaterialPreset {
    /// Name by which scenes refer to it.
    pub name: &'static str,
    /// The fabric that was measured.
    pub fabric: &'static str,
    /// Mass per area \[kg/m^2\].
    pub mass_per_area: f64,
    /// Tensile stiffness of weft and warp \[N/m\].
    pub tensile: [f64; 2],
    /// Shear stiffness \[N/m\].
    pub shear: f64,
    /// Bending stiffness \[N m\].
    pub bending: f64,
    /// Nominal thickness \[m\].
    pub thickness: f64,
}

impl MaterialPreset {
    /// A T-shirt.
    pub const JERSEY: Self = Self {
        name: "jersey",
        fabric: "gray interlock, 60 % cotton 40 % polyester (T-shirt)",
        mass_per_area: 0.187,
        tensile: [16.593_832, 34.477_123],
        shear: 36.860_302,
        bending: 23.191_698e-6,
        thickness: 0.8e-3,
    };

    /// Underwear.
    pub const RIB_KNIT: Self = Self {
        name: "rib-knit",
        fabric: "ivory rib knit, 95 % cotton 5 % spandex (underwear)",
        mass_per_area: 0.276,
        tensile: [42.871_021, 65.166_023],
        shear: 83.175_644,
        bending: 46.237_591e-6,
        thickness: 1.0e-3,
    };

    /// A jacket.
    pub const PONTE_ROMA: Self = Self {
        name: "ponte-roma",
        fabric: "camel ponte roma, 60 % polyester 40 % rayon (jacket)",
        mass_per_area: 0.284,
        tensile: [31.146_198, 44.028_667],
        shear: 31.896_357,
        bending: 36.348_366e-6,
        thickness: 1.0e-3,
    };

    /// A light jacket.
    pub const JET_SET: Self = Self {
        name: "jet-set",
        fabric: "tango red jet set, 100 % polyester (light jacket)",
        mass_per_area: 0.113,
        tensile: [43.067_627, 171.424_835],
        shear: 14.314_7,
        bending: 14.293_814e-6,
        thickness: 0.3e-3,
    };

    /// Jeans.
    pub const DENIM: Self = Self {
        name: "denim",
        fabric: "11 oz black denim, 99 % cotton 1 % spandex (jeans)",
        mass_per_area: 0.324,
        tensile: [205.352_005, 1_013.886_29],
        shear: 53.387_184,
        bending: 64.196_457e-6,
        thickness: 0.8e-3,
    };

    /// All fabrics.
    pub const ALL: [Self; 5] =
        [Self::JERSEY, Self::RIB_KNIT, Self::PONTE_ROMA, Self::JET_SET, Self::DENIM];

    /// The fabric called `name`.
    #[must_use]
    pub fn find(name: &str) -> Option<&'static Self> {
        Self::ALL.iter().find(|preset| preset.name == name)
    }

    /// Spring coefficients for a patch whose particles are `spacing` \[m\] apart (for a triangle
    /// mesh: its mean edge length).
    ///
    /// On a square lattice a stretch spring carries the tension of a strip one spacing wide over
    /// one spacing of length, so its stiffness is the tensile stiffness itself (the mean of weft
    /// and warp, as all stretch springs of a cloth are alike); the two diagonals of a cell
    /// together carry its shear, so each has the shear stiffness. Bend springs resist curvature
    /// only to second order and cannot reproduce a bending stiffness B; B / spacing^2 gives them
    /// its order of magnitude. To reproduce it, set
    /// [`bend_model`](Material::bend_model) to immediate buckling with rigidity B spacing / 2, and a
    /// bend stiffness of 20 B / spacing^2 or more, below which the springs buckle late or never.
    #[must_use]
    pub fn material(&self, spacing: f64) -> Material {
        let particle_mass = self.mass_per_area * spacing * spacing;
        let coefficients =
            |stiffness| SpringCoefficients::with_usual_damping(stiffness, particle_mass);
        Material {
            mass: Mass::PerArea(self.mass_per_area),
            stretch: coefficients(0.5 * (self.tensile[0] + self.tensile[1])),
            shear: coefficients(self.shear),
            bend: coefficients(self.bending / (spacing * spacing)),
            bend_model: BendModel::Linear,
            aerodynamics: Aerodynamics::default(),
            thickness: self.thickness,
        }
    }
}
