//! Colours of curves. A stage has the same colour in every frame, scene and session: it follows from its name alone.

use eframe::egui::{Color32, ecolor::Hsva};

/// Colours of the curves of a plot with fixed curves, on a dark ground.
pub(super) const CURVES: [Color32; 3] = [
    Color32::from_rgb(235, 235, 235),
    Color32::from_rgb(240, 120, 70),
    Color32::from_rgb(90, 170, 250),
];

/// The time of the whole frame.
pub(super) const FRAME: Color32 = CURVES[0];

/// Stages that often take long, which are seen together: far from each other.
const STAGES: [(&str, Color32); 13] = [
    ("explicit_substep", Color32::from_rgb(240, 120, 70)),
    ("spring_forces", Color32::from_rgb(240, 120, 150)),
    ("aerodynamic_forces", Color32::from_rgb(100, 220, 220)),
    ("contact_candidates", Color32::from_rgb(90, 170, 250)),
    ("contact_impulses", Color32::from_rgb(70, 110, 255)),
    ("contact_forces", Color32::from_rgb(140, 130, 255)),
    ("strain_limit", Color32::from_rgb(205, 130, 235)),
    ("collider_response", Color32::from_rgb(190, 150, 110)),
    ("measure", Color32::from_rgb(110, 210, 110)),
    ("implicit_assemble", Color32::from_rgb(240, 200, 70)),
    ("conjugate_gradient", Color32::from_rgb(255, 80, 130)),
    ("direct_solve", Color32::from_rgb(255, 170, 190)),
    ("semi_implicit_solve", Color32::from_rgb(190, 225, 60)),
];

/// The colour of a stage.
pub(super) fn stage_colour(name: &str) -> Color32 {
    if let Some((_, colour)) = STAGES.iter().find(|(stage, _)| *stage == name) {
        return *colour;
    }
    // FNV-1a (Fowler, Noll and Vo 1991).
    let hash = name
        .bytes()
        .fold(0x811c_9dc5_u32, |hash, byte| (hash ^ u32::from(byte)).wrapping_mul(0x0100_0193));
    let part = |shift: u32| (hash >> shift & 0xff) as f32 / 256.0;
    // Paler than those above.
    Hsva::new(part(0), 0.25 + 0.25 * part(8), 0.75 + 0.25 * part(16), 1.0).into()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn distance(a: Color32, b: Color32) -> f64 {
        let pairs = a.to_array().into_iter().zip(b.to_array());
        pairs.map(|(a, b)| (f64::from(a) - f64::from(b)).powi(2)).sum::<f64>().sqrt()
    }

    #[test]
    fn a_stage_has_one_colour_and_no_other_stage_has_it() {
        let stages = cloth_kernels::STAGES;
        for (number, stage) in stages.iter().enumerate() {
            let colour = stage_colour(stage.name);
            assert_eq!(colour, stage_colour(stage.name));
            for other in &stages[..number] {
                let apart = distance(colour, stage_colour(other.name));
                assert!(apart > 4.0, "{}, {}: {apart}", stage.name, other.name);
            }
        }
        // A value written down, so that no later version changes it unseen.
        assert_eq!(stage_colour("measure"), Color32::from_rgb(110, 210, 110));
    }

    #[test]
    fn stages_that_are_seen_together_are_far_from_each_other_and_from_the_ground() {
        for (number, (name, colour)) in STAGES.iter().enumerate() {
            assert!(distance(*colour, FRAME) > 60.0, "{name}");
            assert!(distance(*colour, Color32::from_gray(10)) > 150.0, "{name}");
            for (other, colour_other) in &STAGES[..number] {
                let apart = distance(*colour, *colour_other);
                assert!(apart > 45.0, "{name}, {other}: {apart}");
            }
        }
    }

    /// Names in the table are names of stages, but for those that backends fuse.
    #[test]
    fn the_table_names_stages() {
        for (name, _) in STAGES {
            let is_stage = cloth_kernels::STAGES.iter().any(|stage| stage.name == name);
            assert!(is_stage || name == "explicit_substep", "{name}");
        }
    }
}
