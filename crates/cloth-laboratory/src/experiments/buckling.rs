//! Strips that stand or are held on edge, until they are too long or too heavy.
//!
//! A step of [`Statics`](crate::statics::Statics) leaves out what makes a compressed piece unstable. A small bend that is left to such steps
//! shrinks from one to the next if the piece is stable and grows if it is not; at the critical load it stays as it is.

use cloth_core::{
    Result,
    fabric::{BendingRigidity, Fabric, TensileCurve},
};

use super::{Experiment, GRAVITY, STIFF, meshes, stiff_fabric};
use crate::{
    Laboratory, MeshKind, Outcome,
    meshes::Strip,
    statics::{Settling, Statics},
};

pub(super) const SELF_BUCKLING: Experiment = Experiment {
    name: "self-buckling",
    title: "A strip that is clamped upright at its lower end: the largest rho g L^3 / B with which it stands",
    source: "7.8373 (Greenhill 1881)",
    control: STIFF,
    run: self_buckling,
};

pub(super) const LATERAL_BUCKLING: Experiment = Experiment {
    name: "lateral-buckling",
    title: "A narrow strip that is clamped level and on edge: the largest rho g L^3 / B with which it does not tilt",
    source: "12.8538 (2 / (1 + nu))^1/2 (Romero et al. 2021), nu by the ratio of twist and bending, over (1 - d / L)^3: a clamp keeps the end \
             flat, and twist begins d = width ((1 + nu) / 24)^1/2 behind it (Vlasov 1961)",
    control: STIFF,
    run: lateral_buckling,
};

const DENSITY: f64 = 0.2;

/// Steps in which a bend takes the shape that grows most.
const STEPS: u32 = 80;

/// Length of a step \[s\]: the mass holds the strip back by next to nothing.
const LENGTH: f64 = 10.0;

fn self_buckling(laboratory: &Laboratory<'_>) -> Result<Outcome> {
    let mut outcome = Outcome::default();
    for (kind, cells) in meshes(laboratory, [20, 40]) {
        let strip = Column {
            size: [0.1, 0.02],
            cells: [cells, cells / 5],
            kind,
            gravity: [-GRAVITY, 0.0, 0.0],
            fabric: |rigidity| Fabric {
                warp: TensileCurve::linear(2e4),
                ..stiff_fabric(DENSITY, rigidity)
            },
        };
        let measured = strip.critical(laboratory, 7.8373)?;
        outcome.value("critical load", (kind, cells), "", measured, [7.8373, 0.02]);
    }
    Ok(outcome)
}

fn lateral_buckling(laboratory: &Laboratory<'_>) -> Result<Outcome> {
    let mut outcome = Outcome::default();
    // A column takes what makes its fabric as a function, which can hold no Poisson ratio of its own.
    const FABRICS: [(f64, FabricOf); 2] =
        [(0.0, |rigidity| on_edge(rigidity, 0.0)), (0.35, |rigidity| on_edge(rigidity, 0.35))];
    for (nu, fabric) in FABRICS {
        for (kind, cells) in meshes(laboratory, [40, 80]) {
            let strip = Column {
                size: [0.3, 0.015],
                cells: [cells, cells / 10],
                kind,
                gravity: [0.0, -GRAVITY, 0.0],
                fabric,
            };
            let behind = strip.size[1] * ((1.0 + nu) / 24.0).sqrt();
            let thin = 12.8538 * (2.0 / (1.0 + nu)).sqrt();
            let expected = thin * (1.0 - behind / strip.size[0]).powi(-3);
            let measured = strip.critical(laboratory, expected)?;
            outcome.value(format!("nu = {nu}"), (kind, cells), "", measured, [expected, 0.05]);
        }
    }
    Ok(outcome)
}

/// Stiff in the plane, with D66 = B / (2 (1 + nu)).
fn on_edge(rigidity: f64, nu: f64) -> Fabric {
    let twist = 0.5 / (1.0 + nu);
    let bias = Some(4.0 * rigidity / (2.0 + 1.0 / twist));
    Fabric {
        warp: TensileCurve::linear(4e4),
        weft: TensileCurve::linear(4e4),
        shear: 2e4,
        bending: BendingRigidity { warp: rigidity, weft: rigidity, bias },
        ..stiff_fabric(DENSITY, rigidity)
    }
}

/// The fabric of a rigidity \[N m\].
type FabricOf = fn(f64) -> Fabric;

/// A strip that is clamped at one end and compressed by its weight.
struct Column {
    size: [f64; 2],
    cells: [u32; 2],
    kind: MeshKind,
    gravity: [f64; 3],
    fabric: FabricOf,
}

impl Column {
    /// rho g L^3 / B at which a bend neither grows nor shrinks, by secants from a guess.
    fn critical(&self, laboratory: &Laboratory<'_>, guess: f64) -> Result<f64> {
        let mut load = guess;
        let mut growth = self.growth(laboratory, load)?;
        let mut next = load / growth;
        for _ in 0..2 {
            let at_next = self.growth(laboratory, next)?;
            let slope = (at_next - growth) / (next - load);
            (load, growth) = (next, at_next);
            if slope.is_finite() && slope > 0.0 {
                next = load + (1.0 - growth) / slope;
            }
        }
        Ok(next)
    }

    /// By how much a bend grows in a step.
    fn growth(&self, laboratory: &Laboratory<'_>, load: f64) -> Result<f64> {
        let rigidity = DENSITY * GRAVITY * self.size[0].powi(3) / load;
        let strip = Strip::clamped(self.size, self.cells, (self.kind, 0.0));
        let cell = strip.cell();
        let model = laboratory
            .model(strip.mesh(), (self.fabric)(rigidity), self.gravity, |x| x[0] < 1.01 * cell)?;
        let mut statics = Statics::new(laboratory, &model)?;
        if !statics.settle(&Settling::of(laboratory))? {
            return Ok(f64::NAN);
        }
        let height = |x: [f64; 3]| 1e-4 * (x[0] - cell).max(0.0).powi(2) / self.size[0];
        let rest = model.positions();
        statics.place(|i, x| [x[0], x[1], height(rest[i])]);
        let mut growth = f64::NAN;
        for _ in 0..STEPS {
            let Some(step) = statics.step(LENGTH)? else { return Ok(f64::NAN) };
            let square =
                |z: &dyn Fn(usize) -> f64| (0..step.len()).map(|i| z(i) * z(i)).sum::<f64>();
            let before = square(&|i| statics.positions()[i][2]);
            let after = square(&|i| statics.positions()[i][2] + step[i][2]);
            growth = (after / before).sqrt();
            // Back to the size that it had, so that it stays small.
            statics.place(|i, x| [x[0], x[1], (x[2] + step[i][2]) / growth]);
        }
        Ok(growth)
    }
}
