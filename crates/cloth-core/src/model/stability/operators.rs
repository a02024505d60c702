//! The matrices h^2 K + 2 h C of a model, by its masses (NUMERICS §4).

use glam::DVec3;

use super::{
    super::fabric_matrix::ScalarEntry,
    fabric::{AnyFabric, FabricAtStart},
};

use crate::{ContactResponse, Model, SpringKind};

/// How fast cloth may move through the air beside the wind \[m/s\].
const OWN_SPEED: f64 = 10.0;

/// Layers of cloth that a particle may lie between.
const LAYERS: f64 = 2.0;

/// Partners that a layer has at least: one whose particles lie between those of the other brings two close to
/// the normal at a time.
const LAYER_PARTNERS_MIN: f64 = 2.0;

/// What of a model the matrices hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Coefficients {
    /// All of it.
    All,
    /// Contact, drag and air: neither springs nor fabric.
    WithoutSprings,
}

/// The matrix that no shape of the cloth exceeds: one number for each particle, as springs and dampers act in all
/// directions alike. A spring of any length l has the matrix T' n n^T + T/l (1 - n n^T), and both T' and T/l are at most
/// its largest T'.
pub(super) struct AnyShape<'a> {
    model: &'a Model,
    roots: Vec<f64>,
    /// By kind of springs; empty if these are left out.
    kinds: Vec<ScalarEntry>,
    /// Triangles of fabric, unless these are left out.
    fabric: Option<AnyFabric>,
    /// Of each particle for itself.
    own: Vec<ScalarEntry>,
    /// Damping \[N s/m\] of each triangle by the air, for the mean of its corners.
    triangles: Vec<f64>,
    /// Entries for one h.
    weights: Vec<f64>,
    scaled: Vec<f64>,
}

impl<'a> AnyShape<'a> {
    pub(super) fn new(model: &'a Model, coefficients: Coefficients) -> Self {
        let drag = model.drag_rate().into_iter().fold(0.0, f64::max);
        let contact = contact(model);
        let own = model
            .masses()
            .iter()
            .map(|mass| ScalarEntry { damping: contact.damping + drag * mass, ..contact });
        let kind = |kind: &SpringKind| ScalarEntry {
            stiffness: kind.stiffness_max(),
            damping: kind.damping,
        };
        let kinds = match coefficients {
            Coefficients::All => model.springs().kinds().iter().map(kind).collect(),
            Coefficients::WithoutSprings => Vec::new(),
        };
        Self {
            roots: roots(model),
            weights: vec![0.0; kinds.len()],
            fabric: match coefficients {
                Coefficients::All => Some(AnyFabric::new(model)),
                Coefficients::WithoutSprings => None,
            },
            kinds,
            own: own.collect(),
            triangles: air(model),
            scaled: vec![0.0; model.particle_count()],
            model,
        }
    }

    /// y = (h^2 K + 2 h C) x, between the square roots of the masses.
    pub(super) fn apply(&mut self, h: f64, x: &[f64], y: &mut [f64]) {
        for (scaled, (x, root)) in self.scaled.iter_mut().zip(x.iter().zip(&self.roots)) {
            *scaled = x * root;
        }
        let scaled = &self.scaled;
        for (y, (own, x)) in y.iter_mut().zip(self.own.iter().zip(scaled)) {
            *y = own.at(h) * x;
        }
        self.weights.iter_mut().zip(&self.kinds).for_each(|(weight, kind)| *weight = kind.at(h));
        if !self.kinds.is_empty() {
            let springs = self.model.springs();
            for i in 0..scaled.len() {
                let mut sum = 0.0;
                for spring in springs.row(i) {
                    let j = springs.columns()[spring] as usize;
                    let kind = springs.kind_indices()[spring] as usize;
                    let force = self.weights[kind] * (scaled[i] - scaled[j]);
                    sum += force;
                    y[j] -= force;
                }
                y[i] += sum;
            }
        }
        if let Some(fabric) = &mut self.fabric {
            fabric.add(h, scaled, y);
        }
        for (corners, damping) in self.model.triangles().iter().zip(&self.triangles) {
            // A third of the force for each corner, from the mean velocity of the three.
            let corners = corners.map(|corner| corner as usize);
            let sum: f64 = corners.iter().map(|&corner| scaled[corner]).sum();
            let force = 2.0 * h * damping * sum / 9.0;
            corners.iter().for_each(|&corner| y[corner] += force);
        }
        y.iter_mut().zip(&self.roots).for_each(|(y, root)| *y *= root);
    }
}

/// The matrix of the springs, dampers and drag in the shape at the start.
pub(super) struct RestShape<'a> {
    model: &'a Model,
    roots: Vec<f64>,
    kinds: Vec<ScalarEntry>,
    fabric: FabricAtStart<'a>,
    weights: Vec<f64>,
    scaled: Vec<DVec3>,
}

impl<'a> RestShape<'a> {
    pub(super) fn new(model: &'a Model) -> Self {
        let kind =
            |kind: &SpringKind| ScalarEntry { stiffness: kind.stiffness, damping: kind.damping };
        let kinds: Vec<ScalarEntry> = model.springs().kinds().iter().map(kind).collect();
        Self {
            roots: roots(model),
            weights: vec![0.0; kinds.len()],
            fabric: FabricAtStart::new(model.elements(), model.positions()),
            kinds,
            scaled: vec![DVec3::ZERO; model.particle_count()],
            model,
        }
    }

    /// y = (h^2 K + 2 h C) x, between the square roots of the masses; three numbers for each particle.
    pub(super) fn apply(&mut self, h: f64, x: &[f64], y: &mut [f64]) {
        let drag = DVec3::from(self.model.drag_rate()) * (2.0 * h);
        let vectors = x.chunks_exact(3).map(DVec3::from_slice).zip(&self.roots);
        for (scaled, (x, root)) in self.scaled.iter_mut().zip(vectors) {
            *scaled = x * *root;
        }
        self.weights.iter_mut().zip(&self.kinds).for_each(|(weight, kind)| *weight = kind.at(h));
        let scaled = &self.scaled;
        for (y, x) in y.chunks_exact_mut(3).zip(x.chunks_exact(3)) {
            (drag * DVec3::from_slice(x)).write_to_slice(y);
        }
        let springs = self.model.springs();
        let positions = self.model.positions();
        for (i, (own, root)) in scaled.iter().zip(&self.roots).enumerate() {
            let mut sum = DVec3::ZERO;
            for spring in springs.row(i) {
                let j = springs.columns()[spring] as usize;
                let kind = springs.kind_indices()[spring] as usize;
                let difference = DVec3::from(positions[j]) - DVec3::from(positions[i]);
                let direction = difference.normalize_or(DVec3::X);
                let stretch = direction.dot(*own - scaled[j]);
                let force = direction * (self.weights[kind] * stretch);
                sum += force;
                let other = &mut y[3 * j..3 * j + 3];
                (DVec3::from_slice(other) - force * self.roots[j]).write_to_slice(other);
            }
            let own = &mut y[3 * i..3 * i + 3];
            (DVec3::from_slice(own) + sum * *root).write_to_slice(own);
        }
        let roots = &self.roots;
        let at = |particle: u32| scaled[particle as usize].to_array();
        self.fabric.add(h, at, |particle, force| {
            let i = particle as usize;
            let own = &mut y[3 * i..3 * i + 3];
            (DVec3::from_slice(own) + DVec3::from(force) * roots[i]).write_to_slice(own);
        });
    }
}

fn roots(model: &Model) -> Vec<f64> {
    model.masses().iter().map(|mass| mass.sqrt().recip()).collect()
}

/// What contact by penalty adds for a particle: (a - b)^2 <= 2 a^2 + 2 b^2 for each pair, so that twice the coefficients
/// of all its partners bound it, whoever they are.
fn contact(model: &Model) -> ScalarEntry {
    let Some(contact) = model.self_contact() else { return ScalarEntry::default() };
    let ContactResponse::Penalty { stiffness, damping } = contact.response else {
        return ScalarEntry::default();
    };
    let doubled = 2.0 * contact_partners(model, contact.distance);
    ScalarEntry { stiffness: doubled * stiffness, damping: doubled * damping }
}

/// Partners that a particle may have: those of two layers, each as dense as cloth is at rest, and neighbours that
/// are closer than the distance already.
fn contact_partners(model: &Model, distance: f64) -> f64 {
    let positions = model.positions();
    let mut close = vec![0_u32; model.particle_count()];
    let springs = model.springs().iter().map(|spring| spring.particles);
    for pair in springs.chain(model.elements().edges().iter().copied()) {
        let [i, j] = pair.map(|particle| particle as usize);
        if DVec3::from(positions[i]).distance((positions[j]).into()) < distance {
            close[i] += 1;
            close[j] += 1;
        }
    }
    let joined = f64::from(close.into_iter().max().unwrap_or(0));
    let disc = std::f64::consts::PI * distance * distance;
    let density = model.cloths().iter().map(|cloth| {
        let triangles =
            &model.triangles()[cloth.triangles.start as usize..cloth.triangles.end as usize];
        let area: f64 = triangles.iter().map(|triangle| area(model, *triangle)).sum();
        if area > 0.0 { cloth.particles.len() as f64 / area } else { 0.0 }
    });
    let layer = density.fold(0.0, f64::max) * disc;
    LAYERS * layer.max(joined + 1.0).max(LAYER_PARTNERS_MIN) + joined
}

/// Damping of each triangle by the air: the largest eigenvalue of the derivative of its force by the velocity, which is
/// rho A max(C_p, C_f) |u| at most.
fn air(model: &Model) -> Vec<f64> {
    let Some(air) = model.air() else { return Vec::new() };
    let gust = air.gust.map_or(0.0, |gust| gust.amplitude);
    let speed = DVec3::from(air.wind_velocity).length() * (1.0 + gust) + OWN_SPEED;
    let damping = |cloth: &crate::ClothRange| {
        let coefficient = cloth.aerodynamics.pressure.max(cloth.aerodynamics.friction);
        let triangles = cloth.triangles.start as usize..cloth.triangles.end as usize;
        let of =
            move |triangle: &[u32; 3]| air.density * area(model, *triangle) * coefficient * speed;
        model.triangles()[triangles].iter().map(of).collect::<Vec<f64>>()
    };
    model.cloths().iter().flat_map(damping).collect()
}

/// Area of a triangle at rest \[m^2\].
fn area(model: &Model, triangle: [u32; 3]) -> f64 {
    let [a, b, c] = triangle.map(|corner| DVec3::from(model.positions()[corner as usize]));
    0.5 * (b - a).cross(c - a).length()
}
