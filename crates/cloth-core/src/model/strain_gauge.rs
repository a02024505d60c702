//! How far the triangles of fabric are stretched, and what that costs (NUMERICS §10).

use rayon::prelude::*;

use super::{ClothRange, FabricElements, FabricFold, FabricTriangle, Model};
use crate::fabric::{
    FOLDS, Fabric, hinge,
    membrane::{self, Law, RestState},
};

/// Triangles or folds in a task. Sums are over these first, so that they do not depend on the threads.
const TASK: usize = 4096;

/// The triangles of fabric of a model as far as strain and stress need them, for whoever has positions alone.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StrainGauge {
    laws: Vec<Law<f64>>,
    triangles: Vec<GaugeTriangle>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct GaugeTriangle {
    triangle: u32,
    particles: [u32; 3],
    fabric: u32,
    rest: RestState<f64>,
}

/// Strain and stress of one triangle. 1 is the warp, 2 the weft.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TriangleStrain {
    /// Index among the triangles of the model.
    pub triangle: u32,
    /// Its corners.
    pub particles: [u32; 3],
    /// Green strain E11, E22, E12, dimensionless.
    pub strain: [f64; 3],
    /// Second Piola stress S11, S22, S12 without that of dampers \[N/m\].
    pub stress: [f64; 3],
    /// Principal stretches, the larger one first: lengths over those at rest.
    pub stretches: [f64; 2],
    /// f_u and f_v: how long a metre of warp and of weft has become, and where it points \[m/m\].
    pub threads: [[f64; 3]; 2],
    /// Energy of stretch and shear \[J\].
    pub energy: f64,
    /// Area at rest \[m^2\].
    pub area: f64,
}

/// What of a triangle's strain a heat map shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum StrainMeasure {
    /// How far it is stretched: the larger principal stretch less 1, or 0.
    #[default]
    Stretch,
    /// |E11|, along the warp.
    Warp,
    /// |E22|, along the weft.
    Weft,
    /// |E12|, between them.
    Shear,
}

impl StrainMeasure {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Stretch, Self::Warp, Self::Weft, Self::Shear];

    /// What it is called, E11, E22 and E12 as components of the Green strain are.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Stretch => "stretch",
            Self::Warp => "E11",
            Self::Weft => "E22",
            Self::Shear => "E12",
        }
    }

    /// It of a triangle, not below 0.
    #[must_use]
    pub fn of(self, triangle: &TriangleStrain) -> f64 {
        match self {
            Self::Stretch => (triangle.stretches[0] - 1.0).max(0.0),
            Self::Warp => triangle.strain[0].abs(),
            Self::Weft => triangle.strain[1].abs(),
            Self::Shear => triangle.strain[2].abs(),
        }
    }
}

impl StrainGauge {
    /// The gauge of a model; empty for one without fabric.
    #[must_use]
    pub fn new(model: &Model) -> Self {
        let elements = model.elements();
        let laws = laws(elements);
        let mut own = elements.triangles().iter().peekable();
        let mut triangles = Vec::with_capacity(elements.triangles().len());
        for (number, particles) in model.triangles().iter().enumerate() {
            // Elements are in the order of the model's triangles, of which those of springs are not among them.
            if let Some(element) = own.next_if(|element| element.particles == *particles) {
                triangles.push(GaugeTriangle {
                    triangle: number as u32,
                    particles: element.particles,
                    fabric: element.fabric,
                    rest: element.rest,
                });
            }
        }
        Self { laws, triangles }
    }

    /// Whether there is nothing to measure.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.triangles.is_empty()
    }

    /// Whether it is of a model with so many particles and triangles, or of a smaller one.
    #[must_use]
    pub fn fits(&self, particles: usize, triangles: usize) -> bool {
        self.triangles.iter().all(|own| {
            (own.triangle as usize) < triangles
                && own.particles.iter().all(|&particle| (particle as usize) < particles)
        })
    }

    /// Strain and stress of all triangles of fabric at `positions` \[m\], one for each particle of the model; in the order of its triangles.
    pub fn measure<'a>(
        &'a self,
        positions: &'a [[f64; 3]],
    ) -> impl Iterator<Item = TriangleStrain> + 'a {
        let law = |own: &GaugeTriangle| &self.laws[own.fabric as usize];
        self.triangles.iter().map(move |own| own.strain(law(own), positions))
    }

    /// The larger principal stretch less 1 at each particle, that of the triangles around it by their areas; 0 where there is no fabric.
    #[must_use]
    pub fn at_particles(&self, positions: &[[f64; 3]]) -> Vec<f64> {
        let mut sums = vec![[0.0; 2]; positions.len()];
        for triangle in self.measure(positions) {
            for particle in triangle.particles {
                let [sum, area] = &mut sums[particle as usize];
                *sum += triangle.area * (triangle.stretches[0] - 1.0);
                *area += triangle.area;
            }
        }
        sums.into_iter().map(|[sum, area]| if area > 0.0 { sum / area } else { 0.0 }).collect()
    }
}

/// The laws of the fabrics of a model, which are valid.
fn laws(elements: &FabricElements) -> Vec<Law<f64>> {
    let law = |fabric: &Fabric| Law::new(fabric, "").ok();
    elements.fabrics().iter().filter_map(law).collect()
}

impl GaugeTriangle {
    fn strain(&self, law: &Law<f64>, positions: &[[f64; 3]]) -> TriangleStrain {
        let corners = self.particles.map(|particle| positions[particle as usize]);
        let threads = membrane::deformation(corners, &self.rest);
        let response = law.response(membrane::strain(threads));
        TriangleStrain {
            triangle: self.triangle,
            particles: self.particles,
            strain: response.strain,
            stress: response.stress,
            stretches: membrane::principal_stretches(response.strain),
            threads,
            energy: self.rest.area * response.energy,
            area: self.rest.area,
        }
    }
}

/// Energies and strains of all fabric of a model in one state, computed from positions, alike for all backends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FabricAudit {
    /// Energy of stretch and shear \[J\].
    pub energy_membrane: f64,
    /// Energy of folds \[J\].
    pub energy_bending: f64,
    /// Smallest and largest principal stretch.
    pub stretches: [f64; 2],
    /// The triangle of the model with the largest one.
    pub stretched_triangle: u32,
    /// Smallest and largest E11, E22 and E12.
    pub strains: [[f64; 2]; 3],
    /// Means of |E11|, |E22| and |E12| by area.
    pub strain_means: [f64; 3],
}

impl FabricAudit {
    /// That of no triangle.
    const NONE: Self = Self {
        energy_membrane: 0.0,
        energy_bending: 0.0,
        stretches: [f64::INFINITY, f64::NEG_INFINITY],
        stretched_triangle: 0,
        strains: [[f64::INFINITY, f64::NEG_INFINITY]; 3],
        strain_means: [0.0; 3],
    };

    /// Looks at `positions` \[m\], one for each particle of `model`; `None` if it has no fabric.
    #[must_use]
    pub fn new(model: &Model, positions: &[[f64; 3]]) -> Option<Self> {
        let elements = model.elements();
        let laws = laws(elements);
        let tasks = elements.triangles().par_chunks(TASK).enumerate();
        let parts: Vec<_> = tasks
            .map(|(task, triangles)| {
                let mut part = Part { audit: Self::NONE, area: 0.0 };
                for (own, number) in triangles.iter().zip((TASK * task) as u32..) {
                    let law = &laws[own.fabric as usize];
                    let own = GaugeTriangle {
                        triangle: number,
                        particles: own.particles,
                        fabric: own.fabric,
                        rest: own.rest,
                    };
                    part.add(&own.strain(law, positions));
                }
                part
            })
            .collect();
        let Part { mut audit, area } = parts.into_iter().reduce(Part::and)?;
        audit.energy_bending = bending_energy(elements, positions);
        audit.strain_means = audit.strain_means.map(|sum| sum / area);
        audit.stretched_triangle = model_triangle(model, audit.stretched_triangle as usize);
        Some(audit)
    }
}

/// An audit of some of the triangles, with sums for means, and their area.
struct Part {
    audit: FabricAudit,
    area: f64,
}

impl Part {
    fn add(&mut self, triangle: &TriangleStrain) {
        let Self { audit, area } = self;
        audit.energy_membrane += triangle.energy;
        let [larger, smaller] = triangle.stretches;
        audit.stretches[0] = audit.stretches[0].min(smaller);
        if larger > audit.stretches[1] {
            (audit.stretches[1], audit.stretched_triangle) = (larger, triangle.triangle);
        }
        for k in 0..3 {
            let strain = triangle.strain[k];
            let [least, largest] = audit.strains[k];
            audit.strains[k] = [least.min(strain), largest.max(strain)];
            audit.strain_means[k] += triangle.area * strain.abs();
        }
        *area += triangle.area;
    }

    fn and(self, Self { audit: other, area }: Self) -> Self {
        let Self { audit: mut all, area: before } = self;
        all.energy_membrane += other.energy_membrane;
        all.stretches[0] = all.stretches[0].min(other.stretches[0]);
        if other.stretches[1] > all.stretches[1] {
            all.stretches[1] = other.stretches[1];
            all.stretched_triangle = other.stretched_triangle;
        }
        for k in 0..3 {
            let ([least, largest], [low, high]) = (all.strains[k], other.strains[k]);
            all.strains[k] = [least.min(low), largest.max(high)];
            all.strain_means[k] += other.strain_means[k];
        }
        Self { audit: all, area: before + area }
    }
}

/// The place among the triangles of a model of one of those of fabric, which come in the same order.
fn model_triangle(model: &Model, element: usize) -> u32 {
    let mut own = model.elements().triangles()[..=element].iter().peekable();
    let mut last = 0;
    for (number, particles) in model.triangles().iter().enumerate() {
        if own.next_if(|own| own.particles == *particles).is_some() {
            last = number as u32;
        }
        if own.peek().is_none() {
            break;
        }
    }
    last
}

/// The energy of all folds \[J\]. Each is in the patches of up to six triangles: its angle is found once.
fn bending_energy(elements: &FabricElements, positions: &[[f64; 3]]) -> f64 {
    let difference = |fold: &FabricFold| {
        let angle = hinge::fold(fold.particles.map(|particle| positions[particle as usize])).angle;
        hinge::difference_of_angles(angle, fold.angle)
    };
    let mut differences = Vec::new();
    let folds = elements.folds().par_iter().with_min_len(TASK);
    folds.map(difference).collect_into_vec(&mut differences);
    let one = |(triangle, folds): (&FabricTriangle, &[u32; FOLDS])| {
        let difference = |fold: u32| differences.get(fold as usize).copied().unwrap_or_default();
        triangle.bending.energy(folds.map(difference))
    };
    let all = elements.triangles().par_chunks(TASK).zip(elements.patch_folds().par_chunks(TASK));
    let parts: Vec<f64> =
        all.map(|(triangles, folds)| triangles.iter().zip(folds).map(one).sum::<f64>()).collect();
    parts.into_iter().sum()
}

impl Model {
    /// Whether a cloth of this model is made of fabric.
    #[must_use]
    pub fn is_of_fabric(&self, cloth: &ClothRange) -> bool {
        let triangles = self.elements().triangles();
        let first = triangles.partition_point(|t| t.particles[0] < cloth.particles.start);
        triangles.get(first).is_some_and(|t| cloth.particles.contains(&t.particles[0]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        Cloth, ClothMaterial, GridPatch, MaterialPreset, ModelBuilder,
        fabric::{BendingSheet, FabricSheet, TensileSheet},
    };

    fn model() -> Model {
        let sheet = FabricSheet {
            area_density: 0.15,
            tensile: [Some(TensileSheet::Slope(800.0)), Some(TensileSheet::Slope(300.0))],
            shear: Some(40.0),
            bending: [Some(BendingSheet::Rigidity(1e-5)), None, None],
            ..FabricSheet::default()
        };
        let fabric = sheet.fit("sheet").unwrap().0;
        let patch = GridPatch::new([5, 4], 0.02);
        let springs = Cloth::grid("springs", patch, &MaterialPreset::DENIM);
        let mut flat = Cloth::fabric("fabric", patch, fabric);
        if let ClothMaterial::Fabric(material) = &mut flat.material {
            material.imperfection = 0.0;
        }
        ModelBuilder::new()
            .cloth(springs.clone())
            .cloth(flat)
            .cloth(Cloth { name: "more springs".into(), ..springs })
            .build()
            .unwrap()
    }

    #[test]
    fn a_uniform_stretch_is_what_it_is_everywhere() {
        let model = model();
        let cloths: Vec<bool> = model.cloths().iter().map(|c| model.is_of_fabric(c)).collect();
        assert_eq!(cloths, [false, true, false]);
        let [along, across] = [1.1, 0.95];
        let positions: Vec<[f64; 3]> =
            model.positions().iter().map(|&[x, y, z]| [along * x, across * y, z]).collect();
        let audit = FabricAudit::new(&model, &positions).unwrap();
        let [e11, e22] = [along, across].map(|s: f64| 0.5 * (s * s - 1.0));
        for (found, wanted) in audit.strains.into_iter().zip([e11, e22, 0.0]) {
            found.iter().for_each(|strain| assert!((strain - wanted).abs() < 1e-12));
        }
        assert!((audit.stretches[1] - along).abs() < 1e-12);
        assert!((audit.stretches[0] - across).abs() < 1e-12);
        let area = 0.08 * 0.06;
        let energy = area * 0.5 * (800.0 * e11 * e11 + 300.0 * e22 * e22);
        assert!((audit.energy_membrane / energy - 1.0).abs() < 1e-9);
        assert!(audit.energy_bending.abs() < 1e-20, "it is flat");
        let gauge = StrainGauge::new(&model);
        let triangles = model.cloths()[1].triangles.clone();
        assert!(gauge.measure(&positions).map(|t| t.triangle).eq(triangles));
        for found in gauge.measure(&positions) {
            assert!((found.stress[0] - 800.0 * e11).abs() < 1e-9);
            assert!((found.threads[0][0] - along).abs() < 1e-12);
        }
        let strains = gauge.at_particles(&positions);
        assert_eq!((strains[0], strains.len()), (0.0, 60));
        assert!((strains[25] - 0.1).abs() < 1e-12);
    }

    #[test]
    fn interactions_couple_as_many_particles_as_their_kind_says() {
        let model = model();
        let lists = model.interactions();
        assert_eq!(lists.lists().len(), 4, "springs, membrane, bending, folds");
        for list in lists.lists() {
            list.for_each(|particles| assert_eq!(particles.len(), list.kind().arity()));
        }
    }

    #[test]
    fn a_model_of_springs_has_no_audit_of_fabric() {
        let cloth = Cloth::grid("springs", GridPatch::new([5, 4], 0.02), &MaterialPreset::DENIM);
        let model = ModelBuilder::new().cloth(cloth).build().unwrap();
        assert_eq!(FabricAudit::new(&model, model.positions()), None);
        assert!(StrainGauge::new(&model).is_empty());
    }
}
