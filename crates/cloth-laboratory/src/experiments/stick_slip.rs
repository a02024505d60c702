//! A strip that is pushed onto the ground until its end slips.

use std::sync::Arc;

use cloth_core::{
    Aerodynamics, Cloth, Collider, ColliderShape, ContactResponse, Control, Error, FabricMaterial,
    Field, Frame, Geometry, ImplicitSettings, Integrator, Model, ModelBuilder, PinAction,
    PinControl, Pose, RestSource, Result, SelfContact, Solver, SolverConfig, State,
    fabric::{Fabric, USUAL_DAMPING},
};

use super::{Experiment, stiff_fabric};
use crate::{
    Curve, CurveStyle, Flaw, Laboratory, MeshKind, Outcome, Plot, meshes::Strip,
    theory::pushed::PushedStrip,
};

pub(super) const STICK_SLIP: Experiment = Experiment {
    name: "stick-slip",
    title: "A strip without weight is clamped upright and pushed onto rough ground: the share of its length by which it is shortened when its end \
            slips. (With a friction of .4 and more it would have to pass below the ground before.)",
    source: "the elastica of Sano et al. 2017, clamped and hinged, when the force of the ground leaves the cone of friction; .047, .155 and .271 \
             (Romero et al. 2021)",
    control: Flaw { fabric: None, pattern_growth: 0.0, is_damped: false, slipperiness: 0.1 },
    run,
};

const FRICTIONS: [f64; 3] = [0.1, 0.2, 0.3];
/// Length beyond the clamp \[m\].
const LENGTH: f64 = 0.2;
/// Cells along it.
const CELLS: [u32; 2] = [40, 80];
/// Distance at which contact between cloths begins \[m\], with the ground at half of it.
const DISTANCE: f64 = 2e-3;
/// Rigidity \[N m\], mass per area \[kg/m^2\], and resistance of the air \[1/s\].
const RIGIDITY: f64 = 4e-4;
const DENSITY: f64 = 1.0;
const DRAG: f64 = 8.0;
/// Length of a step \[s\].
const STEP: f64 = 1.0 / 120.0;
/// Steps in which the strip comes to stand, and in which it is pushed down.
const STEPS: [u32; 2] = [60, 600];
/// Shares of the shortening of theory from which, and to which it is pushed.
const SHARES: [f64; 2] = [0.7, 1.2];
/// What has moved farther slips, over the length.
const SLIP: f64 = 1e-3;

fn run(laboratory: &Laboratory<'_>) -> Result<Outcome> {
    let mut outcome = Outcome::default();
    let mut curves = Vec::new();
    for (kind, cells) in super::meshes(laboratory, CELLS) {
        let mut curve = Curve { name: format!("{} {cells}", kind.name()), ..Curve::default() };
        for friction in FRICTIONS {
            let expected = PushedStrip::slips_at(friction);
            let found = Pushed { kind, cells, friction }.slips_at(laboratory, expected)?;
            let name = format!("friction {friction}");
            outcome.value(name, (kind, cells), "", found, [expected, 0.05]);
            curve.points.push([friction, found]);
        }
        curves.push(curve);
    }
    let theory = PushedStrip::until(0.32);
    let points = theory.iter().map(|at| [at.slope(), at.shortening]).collect();
    curves.insert(0, Curve { name: "theory".into(), style: CurveStyle::Line, points });
    outcome.plots.push(Plot {
        title: "How far a strip is pushed down before its end slips".into(),
        axes: ["friction".into(), "shortening".into()],
        curves,
        ..Plot::default()
    });
    Ok(outcome)
}

/// A strip on the ground.
struct Pushed {
    kind: MeshKind,
    cells: u32,
    friction: f64,
}

impl Pushed {
    /// The shortening at which it slips, near to what is expected.
    fn slips_at(&self, laboratory: &Laboratory<'_>, expected: f64) -> Result<f64> {
        let config = SolverConfig {
            precision: laboratory.precision,
            time_step: STEP,
            integrator: Integrator::Implicit(ImplicitSettings::default()),
            ..SolverConfig::default()
        };
        let model = self.model(laboratory, SHARES[0] * expected)?;
        let mut solver = laboratory.backend.create_solver(Arc::clone(&model), &config)?;
        let starts: Vec<_> =
            model.pins().iter().map(|&pin| (pin, model.positions()[pin as usize])).collect();
        // The clamp is in the middle between its rows.
        let middle =
            |z: fn(f64, f64) -> f64, start| starts.iter().map(|(_, at)| at[2]).fold(start, z);
        let clamp = 0.5 * (middle(f64::min, f64::MAX) + middle(f64::max, f64::MIN));
        let mut end = End::of(&model, self.cells);
        for _ in 0..STEPS[0] {
            solver.advance(Frame { duration: STEP })?;
        }
        let stands = end.place(solver.as_mut())?;
        let way = (SHARES[1] - SHARES[0]) * expected * LENGTH / f64::from(STEPS[1]);
        for step in 1..=STEPS[1] {
            let down = f64::from(step) * way;
            let pins = starts.iter().map(|&(particle, [x, y, z])| PinControl {
                particle,
                action: PinAction::MoveTo([x, y, z - down]),
            });
            solver.set_control(&Control { pins: pins.collect(), ..Control::default() })?;
            solver.advance(Frame { duration: STEP })?;
            let at = end.place(solver.as_mut())?;
            if (at[0] - stands[0]).abs() > SLIP * LENGTH {
                return Ok(1.0 - (clamp - down - at[1]) / LENGTH);
            }
        }
        Ok(f64::NAN)
    }

    /// It as the elastica of this shortening.
    fn model(&self, laboratory: &Laboratory<'_>, shortening: f64) -> Result<Arc<Model>> {
        let width = 2.0 * LENGTH / f64::from(self.cells);
        let strip = Strip::clamped([LENGTH, width], [self.cells, 2], (self.kind, 0.0));
        let mut mesh = strip.mesh();
        let cell = strip.cell();
        let pins = (0..).zip(&mesh.positions).filter(|(_, x)| x[0] < 1.01 * cell);
        let pins = pins.map(|(particle, _)| particle).collect();
        let theory = PushedStrip::until(shortening);
        let places = theory.last().map(PushedStrip::places).unwrap_or_default();
        let height = LENGTH * places.last().map_or(1.0, |end| end[1]) + 0.5 * DISTANCE;
        for x in &mut mesh.positions {
            let along = x[0] - 0.5 * cell;
            let [across, below] = match along <= 0.51 * cell {
                true => [0.0, along],
                false => between(&places, along / LENGTH).map(|place| LENGTH * place),
            };
            *x = [across, x[1], height - below];
        }
        let fabric = Fabric {
            thickness: DISTANCE,
            damping: USUAL_DAMPING,
            ..stiff_fabric(DENSITY, RIGIDITY)
        };
        let material = FabricMaterial {
            fabric,
            rest: RestSource::Pattern { scale: 1.0 },
            aerodynamics: Aerodynamics::default(),
            imperfection: 0.0,
        };
        let ground = Collider {
            name: "ground".into(),
            shape: ColliderShape::Plane,
            pose: Pose::default(),
            friction: self.friction * (1.0 - laboratory.flaw.slipperiness),
            restitution: 0.0,
        };
        let model = ModelBuilder::new()
            .gravity([0.0; 3])
            .field(Field::Drag { rate: [DRAG; 3] })
            .cloth(Cloth {
                name: "strip".into(),
                geometry: Geometry::Mesh(mesh),
                material: material.into(),
                pins,
                velocity: [0.0; 3],
            })
            .collider(ground)
            .self_contact(SelfContact {
                distance: DISTANCE,
                response: ContactResponse::Triangles { friction: 0.0 },
            })
            .build();
        Ok(Arc::new(model.map_err(Error::Invalid)?))
    }
}

/// A place at a share of the way along places at equal distances.
fn between(places: &[[f64; 2]], share: f64) -> [f64; 2] {
    let at = share.clamp(0.0, 1.0) * (places.len() - 1) as f64;
    let first = (at as usize).min(places.len() - 2);
    let rest = at - first as f64;
    std::array::from_fn(|k| places[first][k] + rest * (places[first + 1][k] - places[first][k]))
}

/// The end of a strip that stands on the ground.
struct End {
    particles: Vec<usize>,
    state: State,
}

impl End {
    /// The last column of a strip with so many cells along it.
    fn of(model: &Model, cells: u32) -> Self {
        let columns = cells as usize + 1;
        let particles = (0..model.particle_count()).filter(|i| i % columns == columns - 1);
        Self { particles: particles.collect(), state: State::default() }
    }

    /// Where it is, across and above the ground.
    fn place(&mut self, solver: &mut dyn Solver) -> Result<[f64; 2]> {
        solver.synchronize()?;
        solver.download(&mut self.state)?;
        let count = self.particles.len() as f64;
        let mean = |axis: usize| {
            self.particles.iter().map(|&i| self.state.positions[i][axis]).sum::<f64>() / count
        };
        Ok([mean(0), mean(2)])
    }
}
