//! The experiments, one module each.

mod bias;
mod buckling;
mod cantilever;
mod capstan;
mod drape;
mod elastica;
mod friction;
mod hanging;
mod invariance;
mod shear;
mod spin;
mod stick_slip;
mod tensile;

use cloth_core::{
    Result,
    fabric::{BendingRigidity, Fabric, InternalFriction, TensileCurve},
};

use crate::{Flaw, Laboratory, MeshKind, Outcome};

/// A test that a laboratory makes.
#[derive(Clone, Copy)]
pub struct Experiment {
    /// Name by which it is chosen.
    pub name: &'static str,
    /// What it is, in a sentence.
    pub title: &'static str,
    /// Where what is expected comes from.
    pub source: &'static str,
    /// A flaw of the laboratory that it must notice.
    pub control: Flaw,
    /// Runs it.
    pub run: fn(&Laboratory<'_>) -> Result<Outcome>,
}

/// All experiments.
pub const EXPERIMENTS: &[Experiment] = &[
    invariance::RIGID_MOTION,
    invariance::PATCH_TEST,
    tensile::STRIP_BIAXIAL,
    tensile::UNIAXIAL,
    shear::PICTURE_FRAME,
    hanging::HANGING,
    elastica::HEAVY_ELASTICA,
    bias::BIAS_STRIPS,
    cantilever::ASTM_D1388,
    buckling::SELF_BUCKLING,
    buckling::LATERAL_BUCKLING,
    drape::CUSICK,
    spin::FREE_SPIN,
    friction::FRICTION,
    capstan::CAPSTAN,
    stick_slip::STICK_SLIP,
];

/// Acceleration of gravity \[m/s^2\].
const GRAVITY: f64 = 9.81;

/// Kinds of meshes and numbers of cells to be tried: all kinds with each number, or with the first one alone.
fn meshes(laboratory: &Laboratory<'_>, cells: [u32; 2]) -> Vec<(MeshKind, u32)> {
    let cells = &cells[..if laboratory.is_full() { 2 } else { 1 }];
    MeshKind::ALL.iter().flat_map(|&kind| cells.iter().map(move |&cells| (kind, cells))).collect()
}

/// A flaw: a fabric is changed.
const fn changed(fabric: fn(&mut Fabric)) -> Flaw {
    Flaw { fabric: Some(fabric), pattern_growth: 0.0, is_damped: false, slipperiness: 0.0 }
}

/// A flaw: a fabric bends a tenth less.
const STIFF: Flaw = changed(|fabric| {
    let BendingRigidity { warp, weft, bias } = &mut fabric.bending;
    *warp *= 1.1;
    *weft *= 1.1;
    *bias = bias.map(|bias| 1.1 * bias);
});

/// A flaw: a fabric stretches a tenth less.
const TIGHT: Flaw = changed(|fabric| {
    for curve in [&mut fabric.warp, &mut fabric.weft] {
        curve.linear *= 1.1;
        curve.cubic *= 1.1;
    }
});

/// A woven fabric whose warp and weft are as different as they get.
pub(crate) fn poplin() -> Fabric {
    Fabric {
        area_density: 0.15,
        thickness: 0.3e-3,
        warp: TensileCurve { linear: 800.0, cubic: 2e5, end: 0.05 },
        weft: TensileCurve { linear: 300.0, cubic: 4e4, end: 0.1 },
        coupling: 90.0,
        shear: 40.0,
        bending: BendingRigidity { warp: 8e-6, weft: 4e-6, bias: Some(4e-6) },
        friction: InternalFriction::default(),
        damping: [0.0; 2],
        stretch_limit: f64::INFINITY,
    }
}

/// A fabric that hardly stretches, with the same rigidity in all directions \[N m\].
fn stiff_fabric(area_density: f64, rigidity: f64) -> Fabric {
    Fabric {
        area_density,
        thickness: 1e-3,
        warp: TensileCurve::linear(2e3),
        weft: TensileCurve::linear(2e3),
        coupling: 0.0,
        shear: 1e3,
        bending: BendingRigidity::isotropic(rigidity),
        friction: InternalFriction::default(),
        damping: [0.0; 2],
        stretch_limit: f64::INFINITY,
    }
}
