//! NUMERICS §6, `torque_correct`: angular momentum of pieces that nothing holds.

use cloth_core::Real;
use pulp::NullaryFnOnce;
use rayon::prelude::*;

use super::inertia;
use crate::{
    memory::{BLOCK, LANES, Lanes, VectorField},
    vector::{cross, sub},
};

/// Pieces of two particles and more; single ones have no angular momentum.
#[derive(Debug)]
pub(crate) struct FreePieces {
    /// Particles of each, ascending.
    pieces: Vec<Vec<u32>>,
    /// Blocks of the particles of each piece, one after the other.
    blocks: Vec<Block>,
    /// Which piece each particle belongs to, [`NONE`] for those in none.
    piece_of: Vec<u32>,
    is_free: Vec<bool>,
    sums: Vec<Sums>,
    turns: Vec<Turn>,
}

const NONE: u32 = u32::MAX;

/// A run of the particles of a piece, the unit of the sums.
#[derive(Clone, Copy, Debug)]
struct Block {
    piece: usize,
    start: usize,
}

/// Sums over particles, d = x - (position of the first particle of the piece), p = m y - h f.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    mass: f64,
    /// m d
    first: [f64; 3],
    /// m d d^T: xx, yy, zz, xy, yz, zx
    second: [f64; 6],
    /// p
    impulse: [f64; 3],
    /// d x p
    angular: [f64; 3],
}

/// The rotation to be taken back: rate \[rad/s\], and centre \[m\], seen from a place in the piece so
/// that far from the origin no digits are lost.
#[derive(Clone, Copy, Debug, Default)]
struct Turn {
    origin: [f64; 3],
    centre: [f64; 3],
    rate: [f64; 3],
}

/// What the correction reads.
pub(crate) struct TorqueTerms<'a, T> {
    /// Masses \[kg\].
    pub(crate) mass: &'a [T],
    /// Positions \[m\].
    pub(crate) position: &'a VectorField<T>,
    /// All forces \[N\].
    pub(crate) force: &'a VectorField<T>,
    /// Length of the substep \[s\].
    pub(crate) length: T,
}

impl FreePieces {
    pub(crate) fn new(mut pieces: Vec<Vec<u32>>, count: usize) -> Self {
        pieces.retain(|piece| piece.len() > 1);
        let mut piece_of = vec![NONE; count];
        let mut blocks = Vec::new();
        for (number, piece) in pieces.iter().enumerate() {
            piece.iter().for_each(|&particle| piece_of[particle as usize] = number as u32);
            let starts = (0..piece.len()).step_by(BLOCK);
            blocks.extend(starts.map(|start| Block { piece: number, start }));
        }
        Self {
            sums: vec![Sums::default(); blocks.len()],
            turns: vec![Turn::default(); pieces.len()],
            is_free: vec![false; pieces.len()],
            pieces,
            blocks,
            piece_of,
        }
    }

    /// Takes note of the particles held at present.
    pub(crate) fn held_update(&mut self, is_held: impl Fn(usize) -> bool) {
        for (is_free, piece) in self.is_free.iter_mut().zip(&self.pieces) {
            *is_free = !piece.iter().any(|&particle| is_held(particle as usize));
        }
    }
}

impl<T: Real> TorqueTerms<'_, T> {
    /// Takes the angular momentum that `solution` has beyond that of the forces out of it.
    pub(crate) fn correct(
        &self,
        free: &mut FreePieces,
        solution: &mut VectorField<T>,
        arch: pulp::Arch,
    ) {
        let FreePieces { pieces, blocks, piece_of, is_free, sums, turns } = free;
        if !is_free.contains(&true) {
            return;
        }
        let reading = &*solution;
        sums.par_iter_mut().zip(&*blocks).for_each(|(sums, block)| {
            if is_free[block.piece] {
                let piece = &pieces[block.piece];
                let particles = &piece[block.start..piece.len().min(block.start + BLOCK)];
                let origin = self.position.get(piece[0] as usize);
                let task = BlockTask { terms: self, solution: reading, particles, origin };
                *sums = arch.dispatch(task);
            }
        });
        let mut rest = blocks.iter().zip(&*sums).peekable();
        for (number, turn) in turns.iter_mut().enumerate() {
            let mut total = Sums::default();
            while let Some((_, sums)) = rest.next_if(|(block, _)| block.piece == number) {
                total.add(sums);
            }
            let origin = self.position.get(pieces[number][0] as usize).map(T::to_f64);
            *turn = if is_free[number] { total.turn(origin) } else { Turn::default() };
        }
        let turns = &*turns;
        solution.chunks_mut(BLOCK).zip(piece_of.par_chunks(BLOCK)).enumerate().for_each(
            |(block, (chunk, piece_of))| {
                let start = block * BLOCK;
                arch.dispatch(TurnTask { position: self.position, turns, piece_of, start, chunk });
            },
        );
    }
}

impl Sums {
    fn add(&mut self, other: &Self) {
        self.mass += other.mass;
        for k in 0..3 {
            self.first[k] += other.first[k];
            self.impulse[k] += other.impulse[k];
            self.angular[k] += other.angular[k];
        }
        for k in 0..6 {
            self.second[k] += other.second[k];
        }
    }

    /// I^-1 dL about the centre of mass.
    fn turn(&self, origin: [f64; 3]) -> Turn {
        let centre = self.first.map(|first| first / self.mass);
        let moved = cross(centre, self.impulse);
        let momentum = sub(self.angular, moved);
        let [xx, yy, zz, xy, yz, zx] = self.second;
        let about = |second: f64, a: usize, b: usize| second - self.mass * centre[a] * centre[b];
        let [xx, yy, zz] = [about(xx, 0, 0), about(yy, 1, 1), about(zz, 2, 2)];
        let [xy, yz, zx] = [about(xy, 0, 1), about(yz, 1, 2), about(zx, 2, 0)];
        let tensor = [[yy + zz, -xy, -zx], [-xy, zz + xx, -yz], [-zx, -yz, xx + yy]];
        Turn { origin, centre, rate: inertia::rate(tensor, momentum) }
    }
}

/// The sums of a block, compiled for each instruction set.
struct BlockTask<'a, T> {
    terms: &'a TorqueTerms<'a, T>,
    solution: &'a VectorField<T>,
    particles: &'a [u32],
    origin: [T; 3],
}

impl<T: Real> NullaryFnOnce for BlockTask<'_, T> {
    type Output = Sums;

    #[inline(always)]
    fn call(self) -> Sums {
        let mut sums = [[0.0; LANES]; 16];
        for particles in self.particles.chunks(LANES) {
            self.packet(particles, &mut sums);
        }
        let sum = |number: usize| sums[number].iter().sum::<f64>();
        Sums {
            mass: sum(0),
            first: [sum(1), sum(2), sum(3)],
            second: std::array::from_fn(|k| sum(4 + k)),
            impulse: [sum(10), sum(11), sum(12)],
            angular: [sum(13), sum(14), sum(15)],
        }
    }
}

impl<T: Real> BlockTask<'_, T> {
    #[inline(always)]
    fn packet(&self, particles: &[u32], sums: &mut [Lanes<f64>; 16]) {
        let mut mass = [0.0; LANES];
        let mut offset = [[0.0; LANES]; 3];
        let mut impulse = [[0.0; LANES]; 3];
        let length = self.terms.length.to_f64();
        // Lanes without a particle have no mass and no impulse.
        for (lane, &particle) in particles.iter().enumerate() {
            let particle = particle as usize;
            mass[lane] = self.terms.mass[particle].to_f64();
            let position = self.terms.position.get(particle);
            let force = self.terms.force.get(particle);
            let change = self.solution.get(particle);
            for axis in 0..3 {
                offset[axis][lane] = position[axis].to_f64() - self.origin[axis].to_f64();
                impulse[axis][lane] =
                    mass[lane] * change[axis].to_f64() - length * force[axis].to_f64();
            }
        }
        let [x, y, z] = &offset;
        let [p, q, r] = &impulse;
        for lane in 0..LANES {
            let m = mass[lane];
            let [mx, my, mz] = [m * x[lane], m * y[lane], m * z[lane]];
            let terms = [
                m,
                mx,
                my,
                mz,
                mx * x[lane],
                my * y[lane],
                mz * z[lane],
                mx * y[lane],
                my * z[lane],
                mz * x[lane],
                p[lane],
                q[lane],
                r[lane],
                y[lane] * r[lane] - z[lane] * q[lane],
                z[lane] * p[lane] - x[lane] * r[lane],
                x[lane] * q[lane] - y[lane] * p[lane],
            ];
            for (sums, term) in sums.iter_mut().zip(terms) {
                sums[lane] += term;
            }
        }
    }
}

/// Takes rotations out of a run of particles, compiled for each instruction set.
struct TurnTask<'a, T> {
    position: &'a VectorField<T>,
    turns: &'a [Turn],
    piece_of: &'a [u32],
    start: usize,
    chunk: [&'a mut [T]; 3],
}

impl<T: Real> NullaryFnOnce for TurnTask<'_, T> {
    type Output = ();

    #[inline(always)]
    fn call(mut self) {
        // Runs of particles of one piece.
        let mut local = 0;
        for run in self.piece_of.chunk_by(|a, b| a == b) {
            if let Some(turn) = self.turns.get(run[0] as usize) {
                self.run(turn, local..local + run.len());
            }
            local += run.len();
        }
    }
}

impl<T: Real> TurnTask<'_, T> {
    #[inline(always)]
    fn run(&mut self, turn: &Turn, run: std::ops::Range<usize>) {
        let margin = self.position.margin() + self.start;
        let [x, y, z] = self.position.padded().map(|c| &c[margin + run.start..margin + run.end]);
        let [u, v, w] = &mut self.chunk;
        let (u, v, w) = (&mut u[run.clone()], &mut v[run.clone()], &mut w[run]);
        for ((((x, y), z), u), (v, w)) in x.iter().zip(y).zip(z).zip(u).zip(v.iter_mut().zip(w)) {
            let offset = sub(sub([*x, *y, *z].map(T::to_f64), turn.origin), turn.centre);
            let [a, b, c] = cross(turn.rate, offset);
            *u = T::from_f64(u.to_f64() - a);
            *v = T::from_f64(v.to_f64() - b);
            *w = T::from_f64(w.to_f64() - c);
        }
    }
}
