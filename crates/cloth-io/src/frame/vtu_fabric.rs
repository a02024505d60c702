//! Strain and stress of the triangles of fabric as arrays of the cells of a VTU file.
//!
//! `green_strain` and `second_piola_stress` are in the frame of the pattern, which stays with the cloth: 1 is the warp, 2 the weft. Where these point in space, and how long a
//! metre of thread has become, say `warp` and `weft`. `cauchy_stress` has the axes of the scene, so that ParaView makes principal stresses and their directions of it.

use std::io::{self, Write};

use cloth_core::TriangleStrain;

use super::vtk_array::ArrayWriter;
use super::{Frame, Topology};

/// What a cell that is not of fabric has: no number, which ParaView leaves uncoloured, as zero would be a measure.
const NONE: f64 = f64::NAN;

/// The measures of each cell.
pub(super) struct FabricCells {
    /// E11, E22, E12, dimensionless.
    strain: Vec<[f64; 3]>,
    /// S11, S22, S12 \[N/m\].
    stress: Vec<[f64; 3]>,
    /// The larger one first, lengths over those at rest.
    stretches: Vec<[f64; 2]>,
    /// f_u and f_v \[m/m\].
    threads: [Vec<[f64; 3]>; 2],
    /// In the order of VTK: XX, YY, ZZ, XY, YZ, XZ \[N/m\].
    cauchy: Vec<[f64; 6]>,
}

impl FabricCells {
    /// The measures of `frame` for so many cells, of which the triangles of cloths are the first ones, in their order; `None` without fabric.
    pub(super) fn of(topology: &Topology, frame: &Frame<'_>, cells: usize) -> Option<Self> {
        if topology.gauge.is_empty() {
            return None;
        }
        let vectors = || vec![[NONE; 3]; cells];
        let mut all = Self {
            strain: vectors(),
            stress: vectors(),
            stretches: vec![[NONE; 2]; cells],
            threads: [vectors(), vectors()],
            cauchy: vec![[NONE; 6]; cells],
        };
        for found in topology.gauge.measure(frame.positions) {
            let cell = found.triangle as usize;
            all.strain[cell] = found.strain;
            all.stress[cell] = found.stress;
            all.stretches[cell] = found.stretches;
            for (of_cells, thread) in all.threads.iter_mut().zip(found.threads) {
                of_cells[cell] = thread;
            }
            all.cauchy[cell] = cauchy(&found);
        }
        Some(all)
    }

    pub(super) fn write<W: Write>(&self, arrays: &mut ArrayWriter<W>) -> io::Result<()> {
        let Self { strain, stress, stretches, threads: [warp, weft], cauchy } = self;
        arrays.floats("green_strain", ["E11 warp", "E22 weft", "E12 shear"], strain)?;
        let names = ["S11 warp [N/m]", "S22 weft [N/m]", "S12 shear [N/m]"];
        arrays.floats("second_piola_stress", names, stress)?;
        arrays.floats("principal_stretch", ["larger", "smaller"], stretches)?;
        arrays.floats("warp", ["X", "Y", "Z"], warp)?;
        arrays.floats("weft", ["X", "Y", "Z"], weft)?;
        arrays.floats("cauchy_stress", ["XX", "YY", "ZZ", "XY", "YZ", "XZ"], cauchy)
    }
}

/// Force per width as it is now, F S F^T over the share by which the area has grown, along the axes of the scene \[N/m\]: XX, YY, ZZ, XY, YZ, XZ.
fn cauchy(triangle: &TriangleStrain) -> [f64; 6] {
    let TriangleStrain { threads: [u, v], stress: [along, across, shear], stretches, .. } =
        *triangle;
    let grown = stretches[0] * stretches[1];
    if grown <= 0.0 {
        // A triangle without area has no width.
        return [NONE; 6];
    }
    [[0, 0], [1, 1], [2, 2], [0, 1], [1, 2], [0, 2]].map(|[i, j]| {
        let sheared = shear * (u[i] * v[j] + v[i] * u[j]);
        (along * u[i] * u[j] + across * v[i] * v[j] + sheared) / grown
    })
}
