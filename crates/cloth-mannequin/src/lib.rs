//! A mannequin of given measures, as a tailor's shop has one, which takes poses.
//!
//! Its parts are stacks of sections (`stack`), joined by smooth unions to one field of distances (`body`). A tape is laid around that field, and the
//! sections are scaled until it reads what was asked. The surface of the field becomes triangles (`surface`, `flips`), and each vertex follows
//! the joints that it is beyond (`skin`). All is of double precision but the first samples, and in a fixed order: the same measures give the same bits.
//!
//! It stands with its soles on z = 0 and looks along -y, so that its left is at positive x; its arms hang 45 degrees from the vertical. Lengths are in
//! metres, angles in degrees.
//!
//! ```
//! use cloth_mannequin::{Mannequin, Measures, Pose, Swing};
//!
//! let measures = Measures { chest: 1.0, ..Measures::of_height(1.8) };
//! let mannequin = Mannequin::new(&measures, 0.03)?;
//! let arms_up = Pose { shoulders: [Swing { raise: 90.0, forwards: 0.0 }; 2], ..Pose::default() };
//! assert_eq!(mannequin.posed(&arms_up).len(), mannequin.positions().len());
//! # Ok::<(), cloth_mannequin::MannequinError>(())
//! ```

mod body;
mod flips;
mod measures;
mod pose;
mod skin;
mod stack;
mod surface;
mod tape;

use glam::DVec3;

use body::Body;
use skin::Skin;

pub use measures::{EDGE, MannequinError, Measures};
pub use pose::{Pose, Swing};
pub use tape::girth;

/// A closed mesh of a body, and how it moves.
#[derive(Clone, Debug)]
pub struct Mannequin {
    positions: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    skin: Skin,
}

impl Mannequin {
    /// The mannequin of these measures, with edges of about `edge` \[m\].
    ///
    /// # Errors
    /// A [`MannequinError`] for measures that no adult has, or an edge too long for fingers or too short for memory.
    pub fn new(measures: &Measures, edge: f64) -> Result<Self, MannequinError> {
        measures.check()?;
        measures::edge_check(edge)?;
        let body = Body::new(measures);
        let (positions, triangles) = surface::surface(&body, edge);
        let skin = Skin::new(&body, &positions);
        Ok(Self { positions, triangles, skin })
    }

    /// The vertices in the pose at rest \[m\].
    #[must_use]
    pub fn positions(&self) -> Vec<[f64; 3]> {
        self.positions.iter().map(DVec3::to_array).collect()
    }

    /// The vertices of each triangle, counter-clockwise from outside.
    #[must_use]
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// The vertices in another pose \[m\].
    #[must_use]
    pub fn posed(&self, pose: &Pose) -> Vec<[f64; 3]> {
        let rotations = self.skin.rotations(pose);
        let vertices = self.positions.iter().enumerate();
        vertices.map(|(vertex, &at)| self.skin.posed(vertex, at, &rotations).to_array()).collect()
    }

    /// About as many vertices as the mesh of these measures would have, for who has to know before it is made.
    #[must_use]
    pub fn vertices_about(measures: &Measures, edge: f64) -> u64 {
        // Skin of 1.7 square metres, in triangles of equal sides.
        let usual = Measures::of_height(measures.height);
        let stout = (measures.chest + measures.hips) / (usual.chest + usual.hips);
        let area = 0.575 * measures.height * measures.height * stout;
        (area / (0.866 * edge * edge)) as u64
    }
}
