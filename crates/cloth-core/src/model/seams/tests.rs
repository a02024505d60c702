//! What seams become that are welded in parts.

use super::{Seam, Welding};
use crate::{
    Cloth, GridPatch, Meshing, ModelBuilder, RestSource,
    fabric::{BendingSheet, FabricSheet, TensileSheet},
};

/// A square of fabric of 2 x 2 vertices.
fn square(name: &str) -> Cloth {
    let sheet = FabricSheet {
        area_density: 0.15,
        tensile: [Some(TensileSheet::Slope(800.0)), Some(TensileSheet::Slope(300.0))],
        shear: Some(40.0),
        bending: [Some(BendingSheet::Rigidity(1e-5)), None, None],
        ..FabricSheet::default()
    };
    let (fabric, _) = sheet.fit(name).unwrap();
    let mesh = GridPatch::new([2, 2], 0.05).mesh(Meshing::Alternating);
    Cloth::fabric_mesh(name, mesh, fabric, RestSource::Pattern { scale: 1.0 })
}

fn seam(cloths: [&str; 2], stitches: [[u32; 2]; 2]) -> Seam {
    Seam {
        name: cloths.concat(),
        cloths: cloths.map(Into::into),
        stitches: stitches.to_vec(),
        stiffness: 100.0,
        damping: None,
        closing: [0.0, 1.0],
        weld: true,
        ties: Vec::new(),
        strength: None,
    }
}

/// Four pieces meet at a corner. Two of its stitches are welded, so that the two others are between the same two vertices.
#[test]
fn open_stitches_of_two_seams_may_come_to_be_one() {
    let seams = [
        seam(["a", "b"], [[3, 2], [1, 0]]),
        seam(["c", "d"], [[3, 2], [1, 0]]),
        seam(["a", "c"], [[3, 1], [2, 0]]),
        seam(["b", "d"], [[2, 0], [3, 1]]),
    ];
    let pieces = ["a", "b", "c", "d"].map(square);
    let builder = pieces.into_iter().fold(ModelBuilder::new(), ModelBuilder::cloth);
    let builder = seams.iter().cloned().fold(builder, ModelBuilder::seam);
    let before = builder.clone().build().unwrap();
    // Open are those of the corner between a and c, and between b and d.
    let of = |ends: [u32; 2]| before.seams().stitches().iter().position(|s| *s == ends).unwrap();
    let mut open = [of([3, 9]), of([6, 12])].map(|stitch| stitch as u32);
    open.sort_unstable();
    let weld = builder.weld(Welding { sews: true, open: &open, torn: &[] }).unwrap().unwrap();
    assert_eq!(weld.map[3], weld.map[6]);
    assert_eq!(weld.map[9], weld.map[12]);
    let ends = [weld.map[3], weld.map[9]];
    assert_eq!(weld.model.seams().stitches(), [[ends[0].min(ends[1]), ends[0].max(ends[1])]]);
}
