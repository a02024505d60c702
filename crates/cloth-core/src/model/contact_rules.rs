//! Where contact of triangles is not as the contact of all cloths says: rules for objects, maps over the vertices of a cloth.

use super::{Model, ModelBuilder};
use crate::{
    ModelError,
    error::{not_negative, positive},
};

/// How two objects touch. It changes forces alone: whatever they are, no object goes through another one.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ContactRule {
    /// Names of cloths or colliders, which may be the same cloth; one name is for the contact of that object with all.
    pub between: Vec<String>,
    /// Distance at which forces begin \[m\].
    pub distance: Option<f64>,
    /// Coulomb friction coefficient.
    pub friction: Option<f64>,
    /// Whether they push each other apart and rub; `false` leaves the proof that they do not intersect, and nothing else.
    pub without_forces: bool,
}

/// Factors of contact at the vertices of a cloth: a pair has the mean of the distances of both sides, and the product of their frictions.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ContactMap {
    /// Name of the cloth.
    pub cloth: String,
    /// Of the distance, for each vertex; empty for 1 everywhere.
    pub distance: Vec<f64>,
    /// Of the friction.
    pub friction: Vec<f64>,
}

/// The rules and maps of a model, by numbers.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct ContactRules {
    pub(crate) rules: Vec<ObjectRule>,
    /// Factors of distance and friction of every particle; empty where there is no map.
    pub(crate) distances: Vec<f64>,
    pub(crate) frictions: Vec<f64>,
}

/// A [`ContactRule`] by the numbers of cloths, and colliders behind them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ObjectRule {
    /// The second one may be any.
    between: (u32, Option<u32>),
    distance: Option<f64>,
    friction: Option<f64>,
    without_forces: bool,
}

impl ObjectRule {
    /// Whether it is about these two.
    fn is_about(&self, a: u32, b: u32) -> bool {
        let (first, second) = self.between;
        let takes = |a, b| first == a && second.is_none_or(|second| second == b);
        takes(a, b) || takes(b, a)
    }
}

impl ModelBuilder {
    /// Adds a rule for the contact of two objects, or of one with all, after those before it: the last one that is about a pair and says
    /// something of it counts.
    #[must_use]
    pub fn contact_rule(mut self, rule: ContactRule) -> Self {
        self.contact_rules.push(rule);
        self
    }

    /// Adds a map of contact over the vertices of a cloth.
    #[must_use]
    pub fn contact_map(mut self, map: ContactMap) -> Self {
        self.contact_maps.push(map);
        self
    }
}

impl ContactRules {
    /// Those of a model with these rules and maps.
    ///
    /// # Errors
    /// A name of nothing, numbers below zero, a map of another length than its cloth, contact that is not of triangles.
    pub(super) fn new(
        model: &Model,
        rules: &[ContactRule],
        maps: &[ContactMap],
    ) -> Result<Self, ModelError> {
        if rules.is_empty() && maps.is_empty() {
            return Ok(Self::default());
        }
        if !model.has_triangle_contact() {
            return Err(ModelError::ContactRulesOfPoints);
        }
        let cloths = model.cloths().iter().map(|cloth| cloth.name.as_str());
        let names: Vec<&str> =
            cloths.chain(model.colliders().iter().map(|collider| collider.name.as_str())).collect();
        let mut found = Self::default();
        for (number, rule) in rules.iter().enumerate() {
            let find = |name: &str| match names.iter().position(|known| *known == name) {
                Some(object) => Ok(object as u32),
                None => Err(ModelError::ContactOfNothing { rule: number, object: name.to_owned() }),
            };
            let (first, second) = match rule.between.as_slice() {
                [first] => (first, None),
                [first, second] => (first, Some(second)),
                others => {
                    let objects = others.len();
                    return Err(ModelError::ContactBetween { rule: number, objects });
                }
            };
            let of = |what: &str| format!("{what} of rule {number} of contact");
            let distance = rule.distance.map(|distance| positive(|| of("distance"), distance));
            let friction = rule.friction.map(|friction| not_negative(|| of("friction"), friction));
            found.rules.push(ObjectRule {
                between: (find(first)?, second.map(|name| find(name)).transpose()?),
                distance: distance.transpose()?,
                friction: friction.transpose()?,
                without_forces: rule.without_forces,
            });
        }
        for map in maps {
            let Some(cloth) = model.cloths().iter().find(|cloth| cloth.name == map.cloth) else {
                return Err(ModelError::ContactMapOfNothing { cloth: map.cloth.clone() });
            };
            let range = cloth.particles.start as usize..cloth.particles.end as usize;
            for (what, values, all) in [
                ("distance", &map.distance, &mut found.distances),
                ("friction", &map.friction, &mut found.frictions),
            ] {
                if values.is_empty() {
                    continue;
                }
                let of = || format!("the map of {what} in the contact of cloth {:?}", map.cloth);
                if values.len() != range.len() {
                    let [expected, found] = [range.len(), values.len()];
                    return Err(ModelError::ContactMapLength { what: of(), expected, found });
                }
                for &value in values {
                    match what {
                        "distance" => positive(of, value)?,
                        _ => not_negative(of, value)?,
                    };
                }
                all.resize(model.particle_count(), 1.0);
                all[range.clone()].copy_from_slice(values);
            }
        }
        Ok(found)
    }

    /// What the rules make of the distance at which forces between two objects begin, and of their friction.
    pub(crate) fn applied(
        &self,
        (a, b): (u32, u32),
        (distance, friction): (f64, f64),
    ) -> (f64, f64) {
        let mut found = (distance, friction, false);
        for rule in self.rules.iter().filter(|rule| rule.is_about(a, b)) {
            found.0 = rule.distance.unwrap_or(found.0);
            found.1 = rule.friction.unwrap_or(found.1);
            found.2 = rule.without_forces;
        }
        if found.2 { (0.0, 0.0) } else { (found.0, found.1) }
    }

    /// The largest distance at which forces begin, `distance` without rules and maps \[m\].
    pub(crate) fn reach(&self, distance: f64) -> f64 {
        let of_rules = self.rules.iter().filter_map(|rule| rule.distance).fold(distance, f64::max);
        self.distances.iter().fold(1.0, |factor: f64, of| factor.max(*of)) * of_rules
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        Collider, ColliderShape, ContactResponse, Pose, SelfContact,
        contact::{BodyMotion, Candidate, ContactSurface},
        example::sheet_cloth,
    };

    const DISTANCE: f64 = 0.004;

    /// Two sheets, the second one 3 mm above the first, and a ball.
    fn builder() -> ModelBuilder {
        let mut above = sheet_cloth("above", 3, f64::INFINITY);
        if let crate::Geometry::Grid(patch) = &mut above.geometry {
            patch.origin[2] += 0.003;
        }
        let collider = |name: &str, shape| Collider {
            name: name.into(),
            shape,
            pose: Pose { translation: [0.0, 0.0, -5.0], ..Pose::default() },
            friction: 0.2,
            restitution: 0.0,
        };
        let response = ContactResponse::Triangles { friction: 0.3 };
        ModelBuilder::new()
            .cloth(sheet_cloth("below", 3, f64::INFINITY))
            .cloth(above)
            .collider(collider("ball", ColliderShape::Sphere { radius: 0.1 }))
            .collider(collider("floor", ColliderShape::Plane))
            .self_contact(SelfContact { distance: DISTANCE, response })
    }

    fn rule(between: &[&str]) -> ContactRule {
        let between = between.iter().map(|name| (*name).to_owned()).collect();
        ContactRule { between, ..ContactRule::default() }
    }

    /// Reach and friction of the contact of the particle in the middle of the upper sheet with the lower one, if there is any.
    fn contact(builder: ModelBuilder) -> Option<(f64, f64)> {
        let model = builder.build().unwrap();
        let surface = ContactSurface::new(&model, model.self_contact().unwrap());
        let middle = model.cloths()[1].particles.start + 4;
        let found = (0..model.cloths()[0].triangles.end).find_map(|triangle| {
            surface.contact(Candidate::VertexTriangle([middle, triangle]), |i| {
                let [x, y, z] = model.positions()[i as usize];
                // Not above a vertex or an edge.
                if i == middle { [x + 0.004, y + 0.003, z] } else { [x, y, z] }
            })
        });
        found.map(|stencil| (stencil.reach, stencil.friction))
    }

    #[test]
    fn the_last_rule_about_a_pair_counts() {
        assert_eq!(contact(builder()), Some((DISTANCE, 0.3)));
        let rough = ContactRule { friction: Some(0.9), ..rule(&["above"]) };
        let near = ContactRule { distance: Some(0.0035), ..rule(&["above", "below"]) };
        let of_ball = ContactRule { friction: Some(0.1), ..rule(&["ball", "below"]) };
        let all = builder().contact_rule(rough.clone()).contact_rule(near).contact_rule(of_ball);
        assert_eq!(contact(all), Some((0.0035, 0.9)));
        let smooth = ContactRule { friction: Some(0.0), ..rule(&["below", "above"]) };
        assert_eq!(
            contact(builder().contact_rule(rough).contact_rule(smooth)),
            Some((DISTANCE, 0.0))
        );
        let nearer = ContactRule { distance: Some(0.002), ..rule(&["below"]) };
        assert_eq!(contact(builder().contact_rule(nearer)), None, "2 mm do not reach 3 mm");
    }

    /// The vertex in the middle of the upper sheet, 1 mm above the floor, as far as `start` says.
    fn on_the_floor(builder: ModelBuilder, start: f64) -> Vec<(f64, f64, f64)> {
        let model = builder.build().unwrap();
        let surface = ContactSurface::new(&model, model.self_contact().unwrap());
        let middle = model.cloths()[1].particles.start + 4;
        let bodies = BodyMotion::<f64>::new(&model);
        let at = |height: f64| {
            let (bodies, model) = (&bodies, &model);
            move |i: u32| match i.checked_sub(model.particle_count() as u32) {
                Some(node) => bodies.start()[node as usize],
                None if i == middle => [0.7, -0.4, -5.0 + height],
                None => model.positions()[i as usize],
            }
        };
        let mut found = Vec::new();
        surface.plane_contacts(at(1e-3), at(start), &mut found);
        let all = found.iter().flatten().map(|stencil| {
            assert_eq!(stencil.particles[0], middle);
            // The place of the plane that the weights say is below the vertex.
            let [x, y, z] = stencil.relative(at(1e-3));
            assert!(x.abs() < 1e-12 && y.abs() < 1e-12 && (z - stencil.gap).abs() < 1e-12);
            assert_eq!(stencil.normal, [0.0, 0.0, 1.0]);
            (stencil.gap, stencil.reach, stencil.friction)
        });
        all.collect()
    }

    #[test]
    fn a_vertex_touches_a_plane_at_half_of_the_distance() {
        let near = |found: &[(f64, f64, f64)], expected: (f64, f64)| {
            let &[(gap, reach, friction)] = found else { panic!("{found:?}") };
            let apart = [gap - 1e-3, reach - expected.0, friction - expected.1];
            assert!(apart.iter().all(|apart| apart.abs() < 1e-12), "{found:?}");
        };
        near(&on_the_floor(builder(), 2e-3), (0.5 * DISTANCE, 0.2));
        let smooth = ContactRule { friction: Some(0.0), ..rule(&["floor"]) };
        let far = ContactRule { distance: Some(0.003), ..rule(&["floor", "above"]) };
        near(&on_the_floor(builder().contact_rule(smooth).contact_rule(far), 2e-3), (0.003, 0.0));
        let without = ContactRule { without_forces: true, ..rule(&["floor"]) };
        assert_eq!(on_the_floor(builder().contact_rule(without), 2e-3), []);
        assert_eq!(on_the_floor(builder(), -1e-3), [], "what was below is for others to take out");
    }

    #[test]
    fn a_pair_without_forces_has_none_until_a_later_rule() {
        let without = ContactRule { without_forces: true, ..rule(&["above"]) };
        assert_eq!(contact(builder().contact_rule(without.clone())), None);
        let with = rule(&["above", "below"]);
        assert!(contact(builder().contact_rule(without).contact_rule(with)).is_some());
    }

    #[test]
    fn maps_scale_distances_by_their_mean_and_frictions_by_their_product() {
        let map = |cloth: &str, distance: f64, friction: f64| ContactMap {
            cloth: cloth.into(),
            distance: vec![distance; 9],
            friction: vec![friction; 9],
        };
        let (reach, friction) = contact(
            builder().contact_map(map("above", 1.5, 0.5)).contact_map(map("below", 0.9, 3.0)),
        )
        .unwrap();
        assert!((reach - 1.2 * DISTANCE).abs() < 1e-12, "{reach}");
        assert!((friction - 1.5 * 0.3).abs() < 1e-12, "{friction}");
    }

    #[test]
    fn what_makes_no_sense_is_refused_by_name() {
        let refused = |builder: ModelBuilder| builder.build().unwrap_err().to_string();
        for (rule, words) in [
            (rule(&["abve"]), "\"abve\""),
            (rule(&[]), "one or two"),
            (rule(&["above", "below", "ball"]), "one or two"),
            (ContactRule { friction: Some(-0.1), ..rule(&["above"]) }, "friction"),
            (ContactRule { distance: Some(f64::NAN), ..rule(&["above"]) }, "distance"),
        ] {
            let error = refused(builder().contact_rule(rule));
            assert!(error.contains(words), "{error}");
        }
        let map = |distance| ContactMap { cloth: "above".into(), distance, friction: Vec::new() };
        assert!(refused(builder().contact_map(map(vec![1.0; 8]))).contains("8 values for 9"));
        assert!(refused(builder().contact_map(map(vec![0.0; 9]))).contains("map of distance"));
        let response = ContactResponse::Penalty { stiffness: 10.0, damping: 0.0 };
        let points = builder().self_contact(SelfContact { distance: DISTANCE, response });
        assert!(refused(points.contact_rule(rule(&["above"]))).contains("triangles"));
    }
}
