//! Planes: what a certificate moves stays outside of them (NUMERICS §15).

use super::super::{ContactSurface, plane::Frame, plus};
use crate::{Model, Real};

/// The half spaces that colliders are.
#[derive(Clone, Debug, Default)]
pub(super) struct HalfSpaces {
    /// The nodes of each.
    nodes: Vec<[u32; 3]>,
    /// Whether cloth stays outside though a body can move no further then: it is stopped by whoever asks for its impulses.
    pub(super) stop_bodies: bool,
    /// Whether cloth goes inside where it could not make way otherwise.
    pub(super) give_way: bool,
}

/// Where half spaces are at the start and at the end of ways.
pub(super) struct Outside<T> {
    frames: Vec<[Frame<T>; 2]>,
    /// Where what moves is to stay, if it was as far out at the start \[m\].
    height: T,
}

impl HalfSpaces {
    pub(super) fn new(model: &Model, surface: &ContactSurface) -> Self {
        let nodes = surface.bodies().iter().filter_map(|body| body.plane()).collect();
        Self { nodes, stop_bodies: model.collider_impulses(), give_way: false }
    }

    pub(super) const fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// Whether something free was stopped inside of one, deeper than it was at the start: between that and what moves into it.
    pub(super) fn are_entered<T: Real>(
        &self,
        start: &[[T; 3]],
        wanted: &[[T; 3]],
        end: &[[T; 3]],
        (delta, is_held): (T, &impl Fn(u32) -> bool),
    ) -> bool {
        if self.is_empty() {
            return false;
        }
        // Where something was put outside it is outside to rounding.
        let outside = self.outside(start, end, T::ZERO);
        let slack = T::from_f64(0.25) * delta;
        let ends = wanted.iter().zip(end).enumerate();
        let mut stopped = ends.filter(|(i, (wanted, end))| wanted != end && !is_held(*i as u32));
        stopped.any(|(i, (_, end))| outside.depth(start[i], *end) > slack)
    }

    /// Where they are on ways of all particles and nodes.
    pub(super) fn outside<T: Real>(
        &self,
        start: &[[T; 3]],
        end: &[[T; 3]],
        height: T,
    ) -> Outside<T> {
        let nodes = if self.give_way { &[] } else { &*self.nodes };
        let frame = |nodes: &[u32; 3]| {
            [start, end].map(|places| Frame::new(*nodes, |node| places[node as usize]))
        };
        Outside { frames: nodes.iter().map(frame).collect(), height }
    }
}

impl<T: Real> Outside<T> {
    /// How much lower `end` is than it may be.
    fn depth(&self, start: [T; 3], end: [T; 3]) -> T {
        let depths = self
            .frames
            .iter()
            .map(|[before, now]| before.height(start).minimum(self.height) - now.height(end));
        depths.fold(T::ZERO, T::maximum)
    }

    /// The nearest place to `end` that is not inside of a half space, or no further than `start` was; `None` if that is `end`.
    pub(super) fn moved(&self, start: [T; 3], end: [T; 3]) -> Option<[T; 3]> {
        let mut place = end;
        for [before, now] in &self.frames {
            let least = before.height(start).minimum(self.height);
            let height = now.height(place);
            if height < least {
                place = plus(place, least - height, now.normal);
            }
        }
        (place != end).then_some(place)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plane(height: f64) -> Frame<f64> {
        let nodes = [[0.0, 0.0, height], [1.0, 0.0, height], [0.0, 1.0, height]];
        Frame::new([0, 1, 2], |node| nodes[node as usize])
    }

    #[test]
    fn what_was_outside_stays_so_and_what_was_inside_goes_no_deeper() {
        let outside = Outside { frames: vec![[plane(0.0), plane(0.1)]], height: 1e-3 };
        let moved = |from: f64, to: f64| {
            outside.moved([0.3, 0.2, from], [0.4, 0.2, to]).map_or(to, |place| place[2])
        };
        assert!((moved(0.5, 0.3) - 0.3).abs() < 1e-12);
        assert!((moved(0.5, -0.3) - 0.101).abs() < 1e-12);
        assert!((moved(5e-4, 0.1) - 0.1005).abs() < 1e-12);
        assert!((moved(-0.2, -0.3) + 0.1).abs() < 1e-12);
        assert!((moved(-0.2, 0.0) - 0.0).abs() < 1e-12);
        let depth = |from: f64, to: f64| outside.depth([0.3, 0.2, from], [0.4, 0.2, to]);
        assert!((depth(0.5, 0.05) - 0.051).abs() < 1e-12 && depth(0.5, 0.2) == 0.0);
    }
}
