//! The preconditioner against dense matrices, and what must hold of it whatever the matrix.

use super::*;
use crate::{
    Cloth, Geometry, Mass, MaterialPreset, Model, ModelBuilder, NetworkSpring, Real, SpringClass,
    SpringNetwork,
};

/// A small generator of numbers in \[-1, 1\], the same on every run.
struct Numbers(u64);

impl Numbers {
    const fn new(seed: u64) -> Self {
        Self(seed)
    }

    fn next(&mut self) -> f64 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    fn index(&mut self, count: usize) -> usize {
        ((0.5 * self.next() + 0.5) * count as f64) as usize % count
    }

    fn vector(&mut self) -> [f64; 3] {
        [self.next(), self.next(), self.next()]
    }
}

/// Random pairs.
fn random_pairs(count: usize, wanted: usize, numbers: &mut Numbers) -> Vec<[u32; 2]> {
    let mut pairs = Vec::new();
    while count > 1 && pairs.len() < wanted {
        let [a, b] = [numbers.index(count) as u32, numbers.index(count) as u32];
        if a != b {
            pairs.push([a.min(b), a.max(b)]);
        }
    }
    pairs
}

/// Springs g I + u u^T between points, some of them contacts, under random filters.
struct RandomRows {
    positions: Vec<[f64; 3]>,
    masses: Vec<f64>,
    filters: Vec<Option<Block>>,
    /// For each particle its partners.
    rows: Vec<Vec<(usize, Block, Coupling)>>,
}

impl Rows for RandomRows {
    fn base(&self, particle: usize) -> Block {
        diagonal(self.masses[particle])
    }

    fn filter(&self, particle: usize) -> Option<Block> {
        self.filters[particle]
    }

    fn position(&self, particle: usize) -> [f64; 3] {
        self.positions[particle]
    }

    fn row(&self, particle: usize, visit: &mut impl FnMut(usize, Block, Coupling)) {
        self.rows[particle].iter().for_each(|&(j, block, coupling)| visit(j, block, coupling));
    }
}

fn diagonal(entry: f64) -> Block {
    std::array::from_fn(|row| std::array::from_fn(|k| if row == k { entry } else { 0.0 }))
}

/// What a random matrix is like.
#[derive(Clone, Copy, Debug)]
struct Case {
    count: usize,
    springs: usize,
    /// Stiffness by decades, and decades of masses.
    stiffness: f64,
    masses: f64,
    seed: u64,
}

impl RandomRows {
    fn new(case: Case, pairs: &[[u32; 2]]) -> Self {
        let numbers = &mut Numbers::new(case.seed);
        let positions: Vec<_> = (0..case.count)
            .map(|i| {
                let [x, y, z] = numbers.vector();
                [i as f64 + 0.3 * x, (i % 7) as f64 + 0.3 * y, 0.3 * z]
            })
            .collect();
        let masses =
            (0..case.count).map(|_| 10_f64.powf(0.5 * case.masses * numbers.next())).collect();
        let filters = (0..case.count)
            .map(|_| match numbers.index(12) {
                0 => Some(diagonal(0.0)),
                1 => {
                    let normal = numbers.vector();
                    let square: f64 = normal.iter().map(|n| n * n).sum();
                    let one = diagonal(1.0);
                    Some(std::array::from_fn(|r| {
                        std::array::from_fn(|c| one[r][c] - normal[r] * normal[c] / square)
                    }))
                }
                _ => None,
            })
            .collect();
        let mut rows = vec![Vec::new(); case.count];
        for (number, &[i, j]) in pairs.iter().enumerate() {
            let [i, j] = [i as usize, j as usize];
            let u = numbers.vector().map(|u| u * 10_f64.powf(0.5 * case.stiffness));
            let g = numbers.next().max(0.0);
            let block: Block = std::array::from_fn(|r| {
                std::array::from_fn(|c| -(u[r] * u[c] + if r == c { g } else { 0.0 }))
            });
            let coupling = if number % 5 == 4 { Coupling::Contact } else { Coupling::Elastic };
            rows[i].push((j, block, coupling));
            rows[j].push((i, block, coupling));
        }
        Self { positions, masses, filters, rows }
    }

    /// S A S x.
    fn apply(&self, x: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let times = |block: &Block, x: [f64; 3]| block.map(|row| dot3(row, x));
        let free = |i: usize, x: [f64; 3]| self.filters[i].map_or(x, |filter| times(&filter, x));
        (0..x.len())
            .map(|i| {
                let own = free(i, x[i]);
                let mut sum = own.map(|x| self.masses[i] * x);
                for (j, block, _) in &self.rows[i] {
                    let other = free(*j, x[*j]);
                    let difference = std::array::from_fn(|k| other[k] - own[k]);
                    let force = times(block, difference);
                    (0..3).for_each(|k| sum[k] += force[k]);
                }
                free(i, sum)
            })
            .collect()
    }

    /// The inverse of the block S D S + tr(D) (I - S) of a particle, made safe as `block` makes it, times x.
    fn own_solve<T: Real>(&self, i: usize, x: [f64; 3]) -> [f64; 3] {
        let mut block = diagonal(self.masses[i]);
        for (_, other, _) in &self.rows[i] {
            diagonal_subtract(&mut block, other);
        }
        if let Some(filter) = &self.filters[i] {
            let outside = block[0][0] + block[1][1] + block[2][2];
            block = product(&product(filter, &block), filter);
            for (row, (entries, filter)) in block.iter_mut().zip(filter).enumerate() {
                for (column, (entry, filter)) in entries.iter_mut().zip(filter).enumerate() {
                    *entry += outside * (f64::from(u8::from(row == column)) - filter);
                }
            }
        }
        let safety = 4.0 * T::EPSILON.to_f64() * (block[0][0] + block[1][1] + block[2][2]);
        // Rows of L^-1, with which the inverse of L L^T is positive whatever rounding does.
        let (mut factor, mut rows) = ([[0.0; 3]; 3], [[0.0; 3]; 3]);
        for k in 0..3 {
            for l in 0..k {
                let known: f64 = (0..l).map(|m| factor[k][m] * factor[l][m]).sum();
                factor[k][l] = (block[k][l] - known) / factor[l][l];
            }
            let known: f64 = (0..k).map(|m| factor[k][m] * factor[k][m]).sum();
            factor[k][k] = (block[k][k] + safety - known).max(safety).max(1e-30).sqrt();
            for l in 0..=k {
                let known: f64 = (l..k).map(|m| factor[k][m] * rows[m][l]).sum();
                rows[k][l] = (f64::from(u8::from(k == l)) - known) / factor[k][k];
            }
        }
        let products = rows.map(|row| dot3(row, x));
        std::array::from_fn(|k| (0..3).map(|row| rows[row][k] * products[row]).sum())
    }

    fn filtered(&self, x: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let free = |(x, filter): (&[f64; 3], &Option<Block>)| {
            filter.map_or(*x, |filter| filter.map(|row| dot3(row, *x)))
        };
        x.iter().zip(&self.filters).map(free).collect()
    }
}

fn product(a: &Block, b: &Block) -> Block {
    let entry = |row: usize, column: usize| (0..3).map(|k| a[row][k] * b[k][column]).sum::<f64>();
    std::array::from_fn(|row| std::array::from_fn(|column| entry(row, column)))
}

fn dot3(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn dot(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    a.iter().zip(b).map(|(a, b)| dot3(*a, *b)).sum()
}

/// A model of these springs, for its groups.
fn model(count: usize, pairs: &[[u32; 2]]) -> Model {
    let springs = pairs
        .iter()
        .map(|&particles| NetworkSpring {
            particles,
            class: SpringClass::Stretch,
            rest_length: Some(1.0),
            coefficients: None,
        })
        .collect();
    let positions = (0..count).map(|i| [i as f64, (i % 7) as f64, 0.0]).collect();
    let mut material = MaterialPreset::ALL[0].material(1.0);
    material.mass = Mass::PerParticle(1.0);
    let cloth = Cloth {
        name: "net".into(),
        geometry: Geometry::Network(SpringNetwork { positions, springs }),
        material: material.into(),
        pins: vec![],
        velocity: [0.0; 3],
    };
    ModelBuilder::new().cloth(cloth).build().unwrap()
}

/// Springs between particles that are near by their numbers, and some far ones.
fn pairs(case: Case, numbers: &mut Numbers) -> Vec<[u32; 2]> {
    let mut pairs = random_pairs(case.count, case.springs / 8, numbers);
    for _ in 0..case.springs {
        let i = numbers.index(case.count);
        let j = (i + 1 + numbers.index(9)).min(case.count - 1);
        if i < j {
            pairs.push([i as u32, j as u32]);
        }
    }
    pairs.sort_unstable();
    pairs.dedup();
    pairs
}

fn built(case: Case) -> (Schwarz, RandomRows) {
    let pairs = pairs(case, &mut Numbers::new(case.seed + 1));
    let rows = RandomRows::new(case, &pairs);
    let mut schwarz = Schwarz::new(GroupHierarchy::new(&model(case.count, &pairs)));
    schwarz.build(&rows, pulp::Arch::new());
    (schwarz, rows)
}

/// P^-1 x: what the levels above find in this precision, and the inverse blocks of particles.
fn applied<T: Real>(schwarz: &Schwarz, rows: &RandomRows, x: &[[f64; 3]]) -> Vec<[f64; 3]> {
    let moved = schwarz.apply(|i| x[i].map(T::from_f64), pulp::Arch::new());
    let of = |i: usize| {
        let moved = schwarz.moved::<T>(i, &moved).map(T::to_f64);
        let own = rows.own_solve::<T>(i, x[i]);
        std::array::from_fn(|axis| own[axis] + moved[axis])
    };
    (0..x.len()).map(of).collect()
}

#[test]
fn coarse_matrices_have_the_energy_of_what_they_move() {
    let case = Case { count: 5000, springs: 20_000, stiffness: 3.0, masses: 2.0, seed: 5 };
    let (schwarz, rows) = built(case);
    assert!(schwarz.levels.len() > 1);
    let matrix = schwarz.levels[0].matrix();
    let mut numbers = Numbers::new(9);
    for _ in 0..5 {
        let coarse: Vec<f64> = (0..6 * matrix.len()).map(|_| numbers.next()).collect();
        let moved: Vec<[f64; 3]> = (0..case.count)
            .map(|i| {
                let at = 6 * schwarz.group_of[i] as usize;
                schwarz.prolongation_of(i).map(|row| (0..6).map(|k| row[k] * coarse[at + k]).sum())
            })
            .collect();
        let expected = dot(&moved, &rows.apply(&moved));
        let mut image = vec![0.0; coarse.len()];
        matrix.apply(&coarse, &mut image, pulp::Arch::new());
        let found: f64 = coarse.iter().zip(&image).map(|(a, b)| a * b).sum();
        assert!((found - expected).abs() < 1e-5 * expected, "{found} {expected}");
    }
}

/// 10,000 systems: 2,500 in double and single precision, with their own filters and with others, stiffness and masses over ten decades.
#[test]
fn it_is_symmetric_and_positive_and_stays_so_when_it_is_stale() {
    let mut numbers = Numbers::new(77);
    for seed in 0..2500 {
        let count = 1 + numbers.index(if seed % 250 == 0 { 4000 } else { 120 });
        let case = Case {
            count,
            springs: numbers.index(5 * count),
            stiffness: 5.0 + 5.0 * numbers.next(),
            masses: 5.0 + 5.0 * numbers.next(),
            seed,
        };
        symmetric_positive::<f64>(case, 1e-9, &mut numbers);
        symmetric_positive::<f32>(case, 1e-3, &mut numbers);
    }
}

fn symmetric_positive<T: Real>(case: Case, tolerance: f64, numbers: &mut Numbers) {
    let (schwarz, rows) = built(case);
    for _ in 0..2 {
        let mut random = || -> Vec<[f64; 3]> {
            let x: Vec<_> = (0..case.count).map(|_| numbers.vector()).collect();
            rows.filtered(&x)
        };
        let [x, y] = [random(), random()];
        let [mx, my] = [&x, &y].map(|v| rows.filtered(&applied::<T>(&schwarz, &rows, v)));
        let [xx, yy, xy, yx] = [dot(&x, &mx), dot(&y, &my), dot(&x, &my), dot(&y, &mx)];
        if dot(&x, &x) > 0.0 {
            assert!(xx > 0.0 && yy > 0.0 && xx.is_finite(), "{case:?}: {xx} {yy}");
        }
        let scale = (xx * yy).sqrt();
        assert!((xy - yx).abs() <= tolerance * scale, "{case:?}: {xy} {yx} {scale}");
        // Stale: of other filters.
        let others = RandomRows::new(Case { seed: case.seed + 9, ..case }, &[]);
        let z = others.filtered(&x);
        let mz = others.filtered(&applied::<T>(&schwarz, &rows, &z));
        assert!(dot(&z, &z) == 0.0 || dot(&z, &mz) > 0.0, "{case:?}");
    }
}

/// Contacts with colliders come and go: what is built for other filters is what is built from nothing. Without that, rigid motions of
/// before take more iterations.
#[test]
fn other_filters_make_other_motions() {
    let case = Case { count: 3000, springs: 12_000, stiffness: 4.0, masses: 1.0, seed: 21 };
    let (mut schwarz, mut rows) = built(case);
    let arch = pulp::Arch::new();
    assert!(!schwarz.update(&rows, arch), "nothing has changed");
    let turned = RandomRows::new(Case { seed: 22, ..case }, &[]).filters;
    let changed = |i: usize| (500..1500).contains(&i);
    for (i, filter) in turned.into_iter().enumerate().filter(|&(i, _)| changed(i)) {
        rows.filters[i] = filter;
    }
    let stale = iterations(&rows, &schwarz);
    assert!(schwarz.update(&rows, arch) && !schwarz.update(&rows, arch));
    let updated = iterations(&rows, &schwarz);
    let mut numbers = Numbers::new(6);
    let x: Vec<_> = (0..case.count).map(|_| numbers.vector()).collect();
    let found = applied::<f64>(&schwarz, &rows, &x);
    schwarz.build(&rows, arch);
    assert!(found == applied::<f64>(&schwarz, &rows, &x), "the same bits");
    println!("stale {stale}, updated {updated}");
    assert!(updated < stale, "{updated} {stale}");
}

#[test]
fn filters_are_projectors() {
    let case = Case { count: 100, springs: 0, stiffness: 1.0, masses: 1.0, seed: 8 };
    for filter in RandomRows::new(case, &[]).filters.iter().flatten() {
        let square = product(filter, filter);
        for (a, b) in square.as_flattened().iter().zip(filter.as_flattened()) {
            assert!((a - b).abs() < 1e-12);
        }
    }
}

/// Sheets on top of each other, 24 x 24 particles each, springs along both directions and contacts between them.
fn stack(layers: usize) -> (RandomRows, Vec<[u32; 2]>) {
    const SIDE: usize = 24;
    let count = layers * SIDE * SIDE;
    let place = |i: usize| [i % SIDE, i / SIDE % SIDE, i / (SIDE * SIDE)];
    let positions = (0..count).map(|i| place(i).map(|k| k as f64)).collect();
    let mut rows = RandomRows {
        positions,
        masses: vec![1.0; count],
        filters: vec![None; count],
        rows: vec![Vec::new(); count],
    };
    let mut pairs = Vec::new();
    for i in 0..count {
        let [x, y, z] = place(i);
        let mut join = |j: usize, u: [f64; 3], g: f64, coupling| {
            let block: Block = std::array::from_fn(|r| {
                std::array::from_fn(|c| -(u[r] * u[c] + if r == c { g } else { 0.0 }))
            });
            rows.rows[i].push((j, block, coupling));
            rows.rows[j].push((i, block, coupling));
            if coupling == Coupling::Elastic {
                pairs.push([i as u32, j as u32]);
            }
        };
        if x + 1 < SIDE {
            join(i + 1, [100.0, 0.0, 0.0], 1.0, Coupling::Elastic);
        }
        if y + 1 < SIDE {
            join(i + SIDE, [0.0, 100.0, 0.0], 1.0, Coupling::Elastic);
        }
        if z + 1 < layers {
            join(i + SIDE * SIDE, [0.0, 0.0, 300.0], 0.0, Coupling::Contact);
        }
    }
    (rows, pairs)
}

/// Iterations after which the negative control has shown what it is to show.
const ITERATIONS_MAX: usize = 6_000;

/// Iterations of conjugate gradients to a residual of a thousandth.
fn iterations(rows: &RandomRows, schwarz: &Schwarz) -> usize {
    let mut numbers = Numbers::new(11);
    let r: Vec<[f64; 3]> = (0..rows.masses.len()).map(|_| numbers.vector()).collect();
    let mut r = rows.filtered(&r);
    let start = dot(&r, &r);
    let mut c = rows.filtered(&applied::<f64>(schwarz, rows, &r));
    let mut p = c.clone();
    let mut gamma = dot(&r, &c);
    let combine = |to: &mut Vec<[f64; 3]>, scale: [f64; 2], from: &[[f64; 3]]| {
        for (to, from) in to.iter_mut().zip(from) {
            (0..3).for_each(|k| to[k] = scale[0] * to[k] + scale[1] * from[k]);
        }
    };
    for iteration in 1..ITERATIONS_MAX {
        let q = rows.apply(&p);
        let alpha = gamma / dot(&p, &q);
        combine(&mut r, [1.0, -alpha], &q);
        if dot(&r, &r) <= 1e-6 * start {
            return iteration;
        }
        c = rows.filtered(&applied::<f64>(schwarz, rows, &r));
        let next = dot(&r, &c);
        combine(&mut p, [next / gamma, 1.0], &c);
        gamma = next;
    }
    ITERATIONS_MAX
}

/// The negative control of the coarse matrices. Contacts here are nine times as stiff as springs, which no group of one layer knows
/// anything of: 1,004 iterations with them in the coarse matrices, more than the cap without.
#[test]
fn contacts_belong_to_coarse_matrices() {
    let (rows, pairs) = stack(6);
    let hierarchy = GroupHierarchy::new(&model(rows.masses.len(), &pairs));
    let mut schwarz = Schwarz::new(hierarchy);
    schwarz.build(&rows, pulp::Arch::new());
    let with = iterations(&rows, &schwarz);
    let elastic: Couplings = |coupling| coupling == Coupling::Elastic;
    schwarz.build_with(&rows, elastic, pulp::Arch::new());
    let without = iterations(&rows, &schwarz);
    println!("with contacts {with}, without {without}");
    assert!(with < 1100 && without > 5 * with, "{with} {without}");
}
