//! `contact_forces` and `contact_linearise` (NUMERICS §15): what a contact does.

use crate::{Integrator, Model, NewtonStart, Real, SolverConfig};

use super::{ContactStencil, along_plane, dot, plus};

/// Stiffness of a contact, relative to its mass over the square of the time step, where its force is computed at the start of a
/// substep. The force is sixteen times as stiff at most: all contacts together take half of what is stable.
const EXPLICIT_STIFFNESS: f64 = 1.0 / 32.0;

/// Below this share of tau the force is a line there.
const EXPLICIT_LINE: f64 = 0.25;

/// Damping of a contact, relative to its mass over the time step, along the normal and along the plane: another half.
const EXPLICIT_DAMPING: f64 = 0.25;

/// What parts is pushed no faster than overlap is gone in this time \[s\], where force is computed at the start of a substep: a contact would
/// give all back that it has taken up.
const RECOVERY_TIME: f64 = 0.01;

/// The same stiffness where it is part of the matrix.
const IMPLICIT_STIFFNESS: f64 = 30.0;

/// The same share where force is part of the matrix: it may rise further before the certificate has to stop what is pulled over an edge.
const IMPLICIT_LINE: f64 = 1.0 / 16.0;

/// Longest time that a rigid body waits for the reaction of the cloth \[s\]. A body on a cloth is a mass on a
/// spring, and a force that comes late feeds its swing: this is a small part of its period.
pub const EXCHANGE_INTERVAL: f64 = 2e-3;

/// In what time overlap with bodies follows its load where some of them are moved by cloth \[s\]. A weight is many times as heavy as the cloth below it, which
/// alone takes nothing from its swing: it would tremble for seconds.
const SETTLING_TIME: f64 = 4e-3;

/// Largest stiffness in a matrix \[N/m\]: with more, iterations of the linear solver multiply.
const STIFFNESS_MAX: f64 = 200.0;

/// What contact of triangles may add to the eigenvalues of h^2 K + 2 h C by M where its force is computed at the start of a substep
/// (NUMERICS §15).
pub(crate) const EXPLICIT_EIGENVALUE: f64 = 16.0 * EXPLICIT_STIFFNESS + 2.0 * EXPLICIT_DAMPING;

/// The law of contact in a substep.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactLaw<T> {
    is_implicit: bool,
    length: T,
    /// Least stiffness in a matrix \[N/m\]: that of open stitches, or they would pull cloth through all of the force.
    least: T,
    /// The time step that stiffness is for: a shorter substep at the end of a frame must not change it, or what rests is thrown up.
    time_step: T,
    /// That of contact with bodies.
    body_time_step: T,
    /// In what time overlap with bodies follows its load \[s\]; 0 if at once.
    settling: T,
}

/// What a contact does to its first point, and minus that to its second.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactAction<T> {
    /// Force along the normal \[N\].
    pub normal_force: T,
    /// What bounds the slip that friction remembers \[N\]: that force, or in explicit steps and where bodies sway what the overlap gives if that is more. The force of what
    /// trembles comes and goes, and what sticks must not let go in between.
    pub grip: T,
    /// Force of friction \[N\].
    pub friction: [T; 3],
    /// Both together \[N\].
    pub force: [T; 3],
    /// Stiffness along the plane \[N/m\].
    pub tangential_stiffness: T,
    /// h^2 times the derivative of minus the force by the relative place: xx, yy, zz, xy, xz, yz \[kg\]; zero where force is
    /// computed at the start of a substep.
    pub rows: [T; 6],
    /// Whether both points stick to each other.
    pub sticks: bool,
}

impl<T: Real> ContactLaw<T> {
    /// The law for a substep of `length` \[s\] of a model.
    #[must_use]
    pub fn of(model: &Model, config: &SolverConfig, length: f64) -> Self {
        let least = T::from_f64(model.seam_stiffness());
        let law = Self { least, ..Self::new(&config.integrator, length, config.time_step) };
        if !law.is_implicit || !model.has_moved_bodies() {
            return law;
        }
        // As stiff in a frame of one part as in one of many: what rests stays where it is.
        let body_time_step = T::from_f64(config.time_step.min(EXCHANGE_INTERVAL));
        Self { body_time_step, settling: T::from_f64(SETTLING_TIME), ..law }
    }

    /// The law for a substep of `length` \[s\] where most are `time_step` \[s\] long, without open seams.
    #[must_use]
    pub fn new(integrator: &Integrator, length: f64, time_step: f64) -> Self {
        Self {
            least: T::ZERO,
            is_implicit: matches!(integrator, Integrator::Implicit(_)),
            length: T::from_f64(length),
            time_step: T::from_f64(time_step.max(length)),
            body_time_step: T::from_f64(time_step.max(length)),
            settling: T::ZERO,
        }
    }

    /// Whether what a contact does depends on how many there are of its particles.
    pub(super) const fn shares_particles(&self) -> bool {
        !self.is_implicit
    }

    /// Length of the substep \[s\].
    pub(super) const fn length(&self) -> T {
        self.length
    }

    /// The force of a contact whose mass is `mass` \[kg\], that of 1 / sum w^2 / m, shared by `crowd` contacts of one particle.
    ///
    /// `velocity` \[m/s\] is that of the first point past the second, `slip` \[m\] the displacement along the plane from where both
    /// stick. `start` says whether they are those at the start of a substep or of an iterate at its end, `with_body` whether a point is one of a body.
    #[inline(always)]
    #[must_use]
    pub fn action(
        &self,
        stencil: &ContactStencil<T>,
        (mass, crowd): (T, u32),
        (velocity, slip): ([T; 3], [T; 3]),
        (start, with_body): (NewtonStart, bool),
    ) -> ContactAction<T> {
        let h = self.length;
        let crowd = T::from_f64(f64::from(crowd));
        let (time_step, settling) = match with_body {
            true => (self.body_time_step, self.settling),
            false => (self.time_step, T::ZERO),
        };
        let inertia = mass / time_step;
        let stiffness = if self.is_implicit {
            let stiffness = T::from_f64(IMPLICIT_STIFFNESS) * (inertia / time_step);
            // What nothing moves needs none.
            let least = if inertia > T::ZERO { self.least } else { T::ZERO };
            stiffness.maximum(least).minimum(T::from_f64(STIFFNESS_MAX))
        } else {
            T::from_f64(EXPLICIT_STIFFNESS) * (inertia / time_step) / crowd
        };
        let line = if self.is_implicit { IMPLICIT_LINE } else { EXPLICIT_LINE };
        let [elastic, slope] = normal_force(stiffness, line, stencil.reach, stencil.gap);
        let parting = dot(stencil.normal, velocity);
        let across = along_plane(velocity, stencil.normal);
        if self.is_implicit {
            let law = (stiffness, elastic, slope, settling);
            self.implicit(stencil, law, (parting, across, slip), start)
        } else {
            let damping = T::from_f64(EXPLICIT_DAMPING) * inertia / crowd;
            let mut push = (elastic - damping * parting).maximum(T::ZERO);
            if parting > T::ZERO {
                let overlap = (stencil.reach - stencil.gap).maximum(T::ZERO);
                let left = overlap / T::from_f64(RECOVERY_TIME) - parting;
                push = push.minimum((mass / h / crowd) * left.maximum(T::ZERO));
            }
            let trial = plus(slip.map(|s| stiffness * s), damping, across);
            let [_, share, sticks] = cone(stencil.friction, push, trial);
            let friction = trial.map(|t| -(share * t));
            ContactAction {
                normal_force: push,
                grip: push.maximum(elastic),
                friction,
                force: plus(friction, push, stencil.normal),
                tangential_stiffness: stiffness,
                rows: [T::ZERO; 6],
                sticks: sticks == T::ONE,
            }
        }
    }

    #[inline(always)]
    fn implicit(
        &self,
        stencil: &ContactStencil<T>,
        (stiffness, elastic, slope, settling): (T, T, T, T),
        (parting, across, slip): (T, [T; 3], [T; 3]),
        start: NewtonStart,
    ) -> ContactAction<T> {
        let h = self.length;
        // What grows meets more force, what shrinks less: none to twice that of the overlap.
        let viscous = (settling * slope * parting).minimum(elastic).maximum(-elastic);
        let push = elastic - viscous;
        let follows = T::ONE + settling / h;
        let normal_stiffness = if viscous > -elastic { slope * follows } else { slope + slope };
        // What sways must not let go of what it sticks to in between.
        let held = if settling > T::ZERO { elastic } else { T::ZERO };
        let lead = plus(slip, settling, across);
        let (ahead, push_end) = match start {
            NewtonStart::StepStart => (plus(lead, h, across), push - slope * (h * parting)),
            NewtonStart::Iterate => (lead, push),
        };
        if push_end <= T::ZERO {
            // It parts by itself: rows would hold it back.
            return ContactAction {
                normal_force: T::ZERO,
                grip: held,
                friction: [T::ZERO; 3],
                force: [T::ZERO; 3],
                tangential_stiffness: stiffness,
                rows: [T::ZERO; 6],
                sticks: false,
            };
        }
        let limited = push_end.minimum(push + push);
        let [limit, share, sticks] = cone(stencil.friction, limited, ahead.map(|s| stiffness * s));
        let [square, h_square] = [dot(ahead, ahead), h * h];
        let sticks = sticks == T::ONE;
        let normal = stencil.normal;
        let (friction, across_stiffness, along) = if sticks {
            (lead.map(|s| -(stiffness * s)), follows * stiffness, T::ZERO)
        } else {
            let stiffness_left = if square > T::ZERO { limit / square.sqrt() } else { T::ZERO };
            let inverse = if square > T::ZERO { T::ONE / square } else { T::ZERO };
            let across_stiffness = follows * stiffness_left;
            (
                ahead.map(|s| -(share * (stiffness * s))),
                across_stiffness,
                across_stiffness * inverse,
            )
        };
        let (a, b, c) = (
            h_square * (normal_stiffness - across_stiffness),
            h_square * across_stiffness,
            h_square * along,
        );
        let entry = |i: usize, j: usize| a * (normal[i] * normal[j]) - c * (ahead[i] * ahead[j]);
        ContactAction {
            normal_force: push,
            grip: push.maximum(held),
            friction,
            force: plus(friction, push, normal),
            tangential_stiffness: stiffness,
            rows: [
                b + entry(0, 0),
                b + entry(1, 1),
                b + entry(2, 2),
                entry(0, 1),
                entry(0, 2),
                entry(1, 2),
            ],
            sticks,
        }
    }
}

impl<T: Real> ContactAction<T> {
    /// What is left of a slip \[m\] of a contact once friction has given way: no more than the cone holds.
    #[inline(always)]
    #[must_use]
    pub fn slip_left(&self, stencil: &ContactStencil<T>, slip: [T; 3]) -> [T; 3] {
        let trial = slip.map(|s| self.tangential_stiffness * s);
        let [_, share, _] = cone(stencil.friction, self.grip, trial);
        slip.map(|s| share * s)
    }
}

/// The limit of friction \[N\], the share of a trial force that it leaves, and 1 if that is all of it.
#[inline(always)]
fn cone<T: Real>(friction: T, push: T, trial: [T; 3]) -> [T; 3] {
    let limit = friction * push;
    let size = dot(trial, trial).sqrt();
    if size <= limit { [limit, T::ONE, T::ONE] } else { [limit, limit / size, T::ZERO] }
}

/// The force that pushes apart \[N\] and minus its derivative by the gap: k (r - d) down to d = tau = r / 2, k tau^2 / d down to a share
/// of tau, `line`, and a line below that.
#[inline(always)]
fn normal_force<T: Real>(stiffness: T, line: f64, reach: T, gap: T) -> [T; 2] {
    let tau = T::from_f64(0.5) * reach;
    let low = T::from_f64(line) * tau;
    if gap >= tau {
        return [stiffness * (reach - gap).maximum(T::ZERO), stiffness];
    }
    if gap >= low {
        let force = stiffness * tau * tau / gap;
        return [force, force / gap];
    }
    let rise = T::from_f64(1.0 / line);
    let slope = rise * rise * stiffness;
    [rise * stiffness * tau + slope * (low - gap), slope]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The force of a contact of 10 mg that overlaps by .2 mm of 1 mm, at a speed of parting, in a substep of 1 ms.
    fn explicit_push(parting: f64) -> f64 {
        let law = ContactLaw::<f64>::new(&Integrator::Explicit, 1e-3, 1e-3);
        let stencil = ContactStencil {
            key: crate::contact::ContactKey {
                kind: crate::contact::ContactKind::VertexFace,
                first: 0,
                second: 0,
            },
            particles: [0, 1, 2, 3],
            weights: [1.0, -0.5, -0.25, -0.25],
            normal: [0.0, 0.0, 1.0],
            gap: 0.8e-3,
            reach: 1e-3,
            friction: 0.0,
        };
        let motion = ([0.0, 0.0, parting], [0.0; 3]);
        law.action(&stencil, (1e-5, 1), motion, (NewtonStart::StepStart, false)).normal_force
    }

    #[test]
    fn what_parts_faster_than_overlap_recovers_is_not_pushed() {
        // k (r - d) at rest, and a damper while both approach.
        let rest = 1e-5 / 32.0 / 1e-6 * 0.2e-3;
        assert!((explicit_push(0.0) - rest).abs() < 1e-12);
        let approach = rest + 0.25 * 1e-5 / 1e-3 * 0.1;
        assert!((explicit_push(-0.1) - approach).abs() < 1e-12);
        // .2 mm in 10 ms.
        assert!(explicit_push(0.019) > 0.0 && explicit_push(0.021) == 0.0);
    }

    /// The force of an implicit contact with a body \[N\] that overlaps by .2 mm of 1 mm at a speed of parting, and its stiffness with that of the time step \[N/m\].
    fn settling_push(parting: f64) -> [f64; 2] {
        let mut law = ContactLaw::<f64>::new(&Integrator::Implicit(Default::default()), 2e-3, 1e-2);
        (law.body_time_step, law.settling) = (2e-3, SETTLING_TIME);
        let stencil = ContactStencil { gap: 0.8e-3, reach: 1e-3, ..ContactStencil::NONE };
        let stencil = ContactStencil { normal: [0.0, 0.0, 1.0], ..stencil };
        let motion = ([0.0, 0.0, parting], [0.0; 3]);
        let action = law.action(&stencil, (1e-5, 1), motion, (NewtonStart::Iterate, true));
        [action.normal_force, action.rows[2] / (2e-3 * 2e-3)]
    }

    #[test]
    fn overlap_with_bodies_follows_its_load() {
        let stiffness = IMPLICIT_STIFFNESS * 1e-5 / (2e-3 * 2e-3);
        let rest = stiffness * 0.2e-3;
        let near = |found: f64, expected: f64| (found - expected).abs() < 1e-9 * stiffness;
        let [push, rows] = settling_push(0.0);
        assert!(near(push, rest) && near(rows, 3.0 * stiffness), "{push} {rows}");
        // 4 ms at 1 cm/s are 40 um.
        assert!(
            near(settling_push(-0.01)[0], 1.2 * rest) && near(settling_push(0.01)[0], 0.8 * rest)
        );
        // At most twice as much, and it does not pull.
        assert!(
            near(settling_push(-1.0)[0], 2.0 * rest)
                && near(settling_push(-1.0)[1], 2.0 * stiffness)
        );
        assert_eq!(settling_push(0.06), [0.0; 2]);
    }

    #[test]
    fn the_force_has_no_step_and_no_kink() {
        let (k, r) = (3.0, 2e-3);
        for line in [EXPLICIT_LINE, IMPLICIT_LINE] {
            let force = |gap: f64| normal_force(k, line, r, gap);
            for gap in [r, 0.5 * r, 0.5 * line * r] {
                let [above, slope_above] = force(gap * (1.0 + 1e-9));
                let [below, slope_below] = force(gap * (1.0 - 1e-9));
                assert!((above - below).abs() < 1e-7 * k * r, "{gap}");
                let kink = (slope_above - slope_below).abs();
                assert!(kink < 1e-6 * slope_below, "{gap}");
            }
            for gap in [1.7e-3, 0.7e-3, 0.3e-3, 1e-4, 2e-5] {
                let difference = force(gap - 1e-9)[0] - force(gap + 1e-9)[0];
                let slope = force(gap)[1];
                assert!((difference / 2e-9 - slope).abs() < 1e-4 * slope, "{gap}");
            }
        }
    }
}
