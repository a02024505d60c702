//! What seams become that are welded in parts.

use super::{Pulls, Seam, Stitching, Welding, stitching::WIDE};
use crate::{
    Cloth, GridPatch, Meshing, ModelBuilder, RestSource, TextureMap, TriangleMesh, example::fabric,
};

/// Four pieces of fabric of 2 x 2 vertices, beside and behind each other, in one cloth.
fn pieces() -> Cloth {
    let piece = GridPatch::new([2, 2], 0.05).mesh(Meshing::Alternating);
    let (mut mesh, mut pattern) = (TriangleMesh::default(), TextureMap::default());
    for place in [[0.0, 0.0], [0.06, 0.0], [0.0, 0.06], [0.06, 0.06]] {
        let first = mesh.positions.len() as u32;
        let moved = |[x, y, z]: &[f64; 3]| [x + place[0], y + place[1], *z];
        mesh.positions.extend(piece.positions.iter().map(moved));
        pattern.coordinates.extend(piece.positions.iter().map(|[x, y, _]| [*x, *y]));
        mesh.triangles.extend(piece.triangles.iter().map(|t| t.map(|vertex| first + vertex)));
    }
    pattern.triangles.clone_from(&mesh.triangles);
    mesh.texture = Some(pattern);
    Cloth::fabric_mesh("shirt", mesh, fabric(f64::INFINITY), RestSource::Pattern { scale: 1.0 })
}

/// Four pieces meet at a corner. Two of its stitches are welded, so that the two others are between the same two vertices.
#[test]
fn open_stitches_of_two_seams_may_come_to_be_one() {
    let seams = [
        ("left to right in front", [[1, 4], [3, 6]]),
        ("left to right behind", [[9, 12], [11, 14]]),
        ("front to back on the left", [[2, 8], [3, 9]]),
        ("front to back on the right", [[6, 12], [7, 13]]),
    ];
    let seams = seams
        .map(|(name, stitches)| Seam { weld: true, ..Seam::new(name, "shirt", stitches.to_vec()) });
    let builder = ModelBuilder::new().cloth(pieces());
    let builder = seams.into_iter().fold(builder, ModelBuilder::seam);
    let before = builder.clone().build().unwrap();
    // Open are those of the corner between front and back.
    let of = |ends: [u32; 2]| before.seams().stitches().iter().position(|s| *s == ends).unwrap();
    let mut open = [of([3, 9]), of([6, 12])].map(|stitch| stitch as u32);
    open.sort_unstable();
    let weld = builder.weld(Welding { sews: true, open: &open, torn: &[] }).unwrap().unwrap();
    assert_eq!(weld.map[3], weld.map[6]);
    assert_eq!(weld.map[9], weld.map[12]);
    let ends = [weld.map[3], weld.map[9]];
    assert_eq!(weld.model.seams().stitches(), [[ends[0].min(ends[1]), ends[0].max(ends[1])]]);
}

/// What is near is left as it is, and what is wide is drawn in as if that were its length.
#[test]
fn late_stitches_beside_welded_ones_pull_by_what_they_are_too_wide() {
    let seam = Seam::new("seam", "shirt", vec![[1, 4], [3, 6]]);
    let model = ModelBuilder::new().cloth(pieces()).seam(seam).build().unwrap();
    let widths = [WIDE, WIDE / 2.0];
    let force = |pulls, stitch: usize, width: f64| {
        let sewn = model.sewn_at(&Stitching { time: 9.0, pulls, widths: &widths, torn: &[] });
        let kind = &sewn.springs.kinds()[sewn.seams.kinds[stitch].kind as usize];
        kind.stiffness * (width - kind.rest_length)
    };
    let is_near = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-9;
    let soft = force(Pulls::None, 0, WIDE);
    assert!(is_near(force(Pulls::All, 0, WIDE), 100.0 * soft));
    assert!(is_near(force(Pulls::Wide, 0, WIDE), soft), "goes on from what is near");
    let beyond = |pulls| force(pulls, 0, 2.0 * WIDE) - force(pulls, 0, WIDE);
    assert!(is_near(beyond(Pulls::Wide), beyond(Pulls::All)));
    assert!(is_near(force(Pulls::Wide, 1, WIDE), force(Pulls::None, 1, WIDE)));
}
