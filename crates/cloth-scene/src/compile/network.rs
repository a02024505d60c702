//! Networks of a scene: prototypes expanded over the grid.

use cloth_core::{NetworkSpring, SpringClass, SpringCoefficients, SpringNetwork};

use crate::{SceneError, SceneNetwork, SceneSpringClass};

use super::Check;

pub(super) fn compile(
    check: &Check<'_>,
    key: &str,
    network: &SceneNetwork,
) -> Result<SpringNetwork, SceneError> {
    let size = [network.width, network.height, network.depth];
    let places = size.iter().try_fold(1_u64, |product, &side| product.checked_mul(side.into()));
    let count = network.positions.len() as u64;
    if places.is_none_or(|places| places < count) {
        let [width, height, depth] = size;
        let problem = format!(
            "has {count} particles, but a grid of {width} x {height} x {depth} has fewer places"
        );
        return Err(check.error(key, &problem));
    }
    let mut springs = Vec::new();
    for (index, prototype) in network.prototypes.iter().enumerate() {
        let class = spring_class(prototype.class);
        let key = format!("{key}.prototype[{index}]");
        let coefficients = coefficients(check, &key, prototype.stiffness, prototype.damping)?;
        for particle in 0..count {
            for &offset in offsets(prototype.class) {
                let Some(neighbour) = neighbour(particle, offset, size).filter(|&n| n < count)
                else {
                    continue;
                };
                springs.push(NetworkSpring {
                    particles: [particle as u32, neighbour as u32],
                    class,
                    rest_length: prototype.length,
                    coefficients,
                });
            }
        }
    }
    for (index, joint) in network.joints.iter().enumerate() {
        let key = format!("{key}.joint[{index}]");
        for (name, particle) in [("from", joint.from), ("to", joint.to)] {
            if u64::from(particle) >= count {
                let problem = format!("is particle {particle}, but there are {count}");
                return Err(check.error(&format!("{key}.{name}"), &problem));
            }
        }
        if joint.from == joint.to {
            return Err(check.error(&key, "joins a particle to itself"));
        }
        springs.push(NetworkSpring {
            particles: [joint.from, joint.to],
            class: spring_class(joint.class),
            rest_length: joint.length,
            coefficients: coefficients(check, &key, joint.stiffness, joint.damping)?,
        });
    }
    Ok(SpringNetwork { positions: network.positions.clone(), springs })
}

fn coefficients(
    check: &Check<'_>,
    key: &str,
    stiffness: Option<f64>,
    damping: Option<f64>,
) -> Result<Option<SpringCoefficients>, SceneError> {
    match (stiffness, damping) {
        (Some(stiffness), damping) => {
            check.positive(&format!("{key}.stiffness"), stiffness)?;
            let damping = damping.unwrap_or_default();
            check.not_negative(&format!("{key}.damping"), damping)?;
            Ok(Some(SpringCoefficients { stiffness, damping }))
        }
        (None, Some(_)) => Err(check.error(key, "has a damping but no stiffness: give both")),
        (None, None) => Ok(None),
    }
}

const fn spring_class(class: SceneSpringClass) -> SpringClass {
    match class {
        SceneSpringClass::Stretch => SpringClass::Stretch,
        SceneSpringClass::Shear => SpringClass::Shear,
        SceneSpringClass::Bend => SpringClass::Bend,
    }
}

/// Half of the neighbours of a class; the other half are their negatives.
const fn offsets(class: SceneSpringClass) -> &'static [[i64; 3]] {
    match class {
        SceneSpringClass::Stretch => &[[1, 0, 0], [0, 1, 0], [0, 0, 1]],
        SceneSpringClass::Shear => {
            &[[1, 1, 0], [-1, 1, 0], [1, 0, 1], [-1, 0, 1], [0, 1, 1], [0, -1, 1]]
        }
        SceneSpringClass::Bend => &[[2, 0, 0], [0, 2, 0], [0, 0, 2]],
    }
}

/// The place `offset` away from a place of the grid, if the grid reaches that far.
fn neighbour(particle: u64, offset: [i64; 3], size: [u32; 3]) -> Option<u64> {
    let [width, height, depth] = size.map(i64::from);
    let particle = i64::try_from(particle).ok()?;
    let at = [particle % width, particle / width % height, particle / (width * height)];
    let [i, j, k]: [i64; 3] = std::array::from_fn(|axis| at[axis] + offset[axis]);
    let inside = (0..width).contains(&i) && (0..height).contains(&j) && (0..depth).contains(&k);
    inside.then(|| u64::try_from((k * height + j) * width + i).ok()).flatten()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbours_end_at_the_sides_of_the_grid() {
        let size = [3, 2, 2];
        assert_eq!(neighbour(0, [1, 0, 0], size), Some(1));
        assert_eq!(neighbour(2, [1, 0, 0], size), None);
        assert_eq!(neighbour(1, [-1, 1, 0], size), Some(3));
        assert_eq!(neighbour(0, [-1, 1, 0], size), None);
        assert_eq!(neighbour(5, [0, -1, 1], size), Some(8));
        assert_eq!(neighbour(8, [0, 0, 1], size), None);
    }
}
