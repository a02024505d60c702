//! Dust that shows in pictures how the fields of a scene move the air.

use std::{
    collections::VecDeque,
    sync::{Arc, Mutex, PoisonError},
};

use cloth_core::FieldProgram;
use cloth_io::{PictureDust, PictureGrain};
use cloth_scene::{CompiledScene, SceneDust};

/// Mass of a grain \[kg\].
const MASS: f64 = 1e-6;
/// Longest step of its motion \[s\].
const STEP: f64 = 1.0 / 120.0;
/// Change of velocity that shows how a force brakes \[m/s\].
const PROBE: f64 = 0.01;
/// Most steps in a frame.
const STEP_LIMIT: usize = 64;
/// For how long the shutter of the camera is open, if frames are not shorter \[s\]: the length of streaks.
const SHUTTER: f64 = 1.0 / 60.0;
/// Opacity of a grain in the middle of its life.
const OPACITY: f64 = 0.45;
/// Memory for frames that are kept, as threads and viewers ask for them in no order \[byte\].
const KEPT_BYTES: usize = 32 << 20;

/// The dust of `scene` in every frame; clear air if it has none.
pub(crate) fn picture_dust(scene: &CompiledScene) -> PictureDust {
    let Some(dust) = scene.view.as_ref().and_then(|view| view.dust) else {
        return PictureDust::default();
    };
    let programs = scene.model.field_programs().cloned().collect();
    let air = Air::new(programs, dust, scene.frames_per_second);
    let cloud = Mutex::new(Cloud::new(&air, 0));
    let rate = scene.frames_per_second;
    PictureDust::moving(move |time| {
        let frame = (time * rate).round().max(0.0) as u64;
        // A cloud that somebody left in a panic is whole: frames are added when they are done.
        let mut cloud = cloud.lock().unwrap_or_else(PoisonError::into_inner);
        cloud.grains(&air, frame).as_ref().clone()
    })
}

/// What moves the grains.
struct Air {
    programs: Vec<Arc<FieldProgram>>,
    dust: SceneDust,
    /// Frames in the life of a grain.
    period: u64,
    /// Steps in a frame, and how many of them, at its end, the shutter is open.
    steps: usize,
    open: usize,
    /// Time of a frame \[s\].
    frame_time: f64,
}

impl Air {
    fn new(programs: Vec<Arc<FieldProgram>>, dust: SceneDust, rate: f64) -> Self {
        let frame_time = rate.recip();
        let steps = ((frame_time / STEP).ceil() as usize).clamp(1, STEP_LIMIT);
        let open = (steps as f64 * (SHUTTER / frame_time).min(1.0)).ceil() as usize;
        let period = (dust.lifetime * rate).round().max(1.0) as u64;
        Self { programs, dust, period, steps, open, frame_time }
    }

    /// Frames since the latest birth of a grain, and how often it was born before. Births are spread over time
    /// evenly.
    fn age(&self, grain: usize, frame: u64) -> (u64, u64) {
        const GOLDEN: f64 = 0.618_033_988_749_894_9;
        let phase = (grain as f64 * GOLDEN).fract();
        let since = frame + (phase * self.period as f64) as u64;
        (since % self.period, since / self.period)
    }

    /// Where a grain begins \[m\].
    fn birthplace(&self, grain: usize, births: u64) -> [f64; 3] {
        let SceneDust { min, max, .. } = self.dust;
        let mut state = (grain as u64) << 32 ^ births;
        std::array::from_fn(|axis| min[axis] + uniform(&mut state) * (max[axis] - min[axis]))
    }

    /// Moves a grain by one step: the midpoint method.
    fn advance(&self, grain: &mut Grain, index: usize, time: f64) {
        let step = self.frame_time / self.steps as f64;
        let velocity = self.velocity(grain.place, grain.velocity, time, index);
        let middle = std::array::from_fn(|k| grain.place[k] + 0.5 * step * velocity[k]);
        grain.velocity = self.velocity(middle, velocity, time + 0.5 * step, index);
        grain.place = std::array::from_fn(|k| grain.place[k] + step * grain.velocity[k]);
    }

    /// The velocity of the air \[m/s\]: the one at which no force is left, by a step of Newton's method, axis by
    /// axis, from a velocity `near` it. Forces that do not brake carry nothing.
    fn velocity(&self, place: [f64; 3], near: [f64; 3], time: f64, grain: usize) -> [f64; 3] {
        let step = self.frame_time / self.steps as f64;
        let force = |velocity: [f64; 3]| {
            self.programs.iter().fold([0.0; 3], |sum, program| {
                let part = program.evaluate(place, velocity, time, MASS, grain, step);
                std::array::from_fn(|axis| sum[axis] + part[axis])
            })
        };
        let (here, beyond) = (force(near), force(near.map(|x| x + PROBE)));
        std::array::from_fn(|axis| {
            let braking = (here[axis] - beyond[axis]) / PROBE;
            if braking > 0.0 { near[axis] + here[axis] / braking } else { 0.0 }
        })
    }
}

/// A number from 0 up to 1: SplitMix64 (Steele, Lea and Flood 2014).
fn uniform(state: &mut u64) -> f64 {
    *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let mut mixed = *state;
    mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    mixed ^= mixed >> 31;
    (mixed >> 11) as f64 / (1u64 << 53) as f64
}

#[derive(Clone, Copy)]
struct Grain {
    place: [f64; 3],
    velocity: [f64; 3],
    /// Where it was when the shutter opened \[m\].
    before: [f64; 3],
}

impl Grain {
    fn born(place: [f64; 3]) -> Self {
        Self { place, velocity: [0.0; 3], before: place }
    }
}

/// All grains at one frame, and pictures of those before.
struct Cloud {
    frame: u64,
    grains: Vec<Grain>,
    /// The first frame at which all grains are where they should be.
    valid: u64,
    /// Pictures up to `frame`, the last one that of it.
    kept: VecDeque<Arc<Vec<PictureGrain>>>,
}

impl Cloud {
    /// Begins at `frame`; grains that were born before are right after their next birth.
    fn new(air: &Air, frame: u64) -> Self {
        let born = |grain| Grain::born(air.birthplace(grain, air.age(grain, frame).1));
        let grains = (0..air.dust.count as usize).map(born).collect();
        let valid = if frame == 0 { 0 } else { frame + air.period };
        let mut cloud = Self { frame, grains, valid, kept: VecDeque::new() };
        cloud.keep(air);
        cloud
    }

    /// The grains at `frame`. They do not depend on what was asked before.
    fn grains(&mut self, air: &Air, frame: u64) -> Arc<Vec<PictureGrain>> {
        let oldest = self.frame + 1 - self.kept.len() as u64;
        // Every grain is born once in a period.
        let begin = frame.saturating_sub(air.period);
        if frame < oldest || begin > self.frame {
            *self = Self::new(air, begin);
        }
        while self.frame < frame {
            self.advance(air);
        }
        let back = (self.frame - frame) as usize;
        let number = self.kept.len().checked_sub(1 + back);
        number.and_then(|number| self.kept.get(number)).cloned().unwrap_or_default()
    }

    fn advance(&mut self, air: &Air) {
        let start = self.frame as f64 * air.frame_time;
        self.frame += 1;
        for (index, grain) in self.grains.iter_mut().enumerate() {
            let (age, births) = air.age(index, self.frame);
            if age == 0 {
                *grain = Grain::born(air.birthplace(index, births));
                continue;
            }
            for step in 0..air.steps {
                if step + air.open == air.steps {
                    grain.before = grain.place;
                }
                let time = start + step as f64 / air.steps as f64 * air.frame_time;
                air.advance(grain, index, time);
            }
        }
        self.keep(air);
    }

    /// Keeps the picture of the present frame, and no more than there is room for.
    fn keep(&mut self, air: &Air) {
        if self.frame < self.valid {
            return;
        }
        let seen = |(index, grain): (usize, &Grain)| {
            let life = air.age(index, self.frame).0 as f64 / air.period as f64;
            // It comes and goes softly.
            let opacity = OPACITY * (life / 0.1).min((1.0 - life) / 0.3).min(1.0);
            PictureGrain { from: grain.before, to: grain.place, opacity }
        };
        let grains: Vec<_> = self.grains.iter().enumerate().map(seen).collect();
        let limit = (KEPT_BYTES / (grains.len() * size_of::<PictureGrain>()).max(1)).max(4);
        self.kept.push_back(Arc::new(grains));
        while self.kept.len() > limit {
            self.kept.pop_front();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DUST: SceneDust =
        SceneDust { count: 50, min: [-1.0, -1.0, 0.0], max: [1.0, 1.0, 0.2], lifetime: 1.0 };

    fn air(source: &str) -> Air {
        Air::new(vec![Arc::new(FieldProgram::compile(source).unwrap())], DUST, 25.0)
    }

    #[test]
    fn dust_does_not_depend_on_what_was_asked_before() {
        let air = air("5 * m * (vec3(sin(t), x.z, 1) - v)");
        let mut forward = Cloud::new(&air, 0);
        let all: Vec<_> = (0..90).map(|frame| forward.grains(&air, frame)).collect();
        let mut other = Cloud::new(&air, 0);
        for frame in [70, 89, 3, 60, 59, 0, 40, 39, 88] {
            assert_eq!(other.grains(&air, frame), all[frame as usize], "frame {frame}");
            // As if there were room for one alone.
            other.kept.drain(..other.kept.len() - 1);
        }
        assert_ne!(all[40], all[41]);
    }

    #[test]
    fn grains_go_with_the_air() {
        let air = air("7 * m * (vec3(2, 0, 0) - v)");
        let mut cloud = Cloud::new(&air, 0);
        let open = air.open as f64 / air.steps as f64 / 25.0;
        let grains = cloud.grains(&air, 20);
        for grain in grains.iter().filter(|grain| grain.opacity > 0.0) {
            let moved: [f64; 3] = std::array::from_fn(|axis| grain.to[axis] - grain.from[axis]);
            assert!((moved[0] - 2.0 * open).abs() < 1e-9, "{moved:?}");
            assert!(moved[1].abs() + moved[2].abs() < 1e-9, "{moved:?}");
            assert!((0.0..0.2).contains(&grain.to[2]));
        }
    }

    /// Around an axis they stay at their distance from it, which Euler's method would not give.
    #[test]
    fn grains_go_in_circles() {
        let air = air("7 * m * (10 * cross(vec3(0, 0, 1), x) - v)");
        let mut cloud = Cloud::new(&air, 0);
        let start = cloud.grains.clone();
        for _ in 0..4 {
            cloud.advance(&air);
        }
        let distance = |place: [f64; 3]| place[0].hypot(place[1]);
        for (index, (before, after)) in start.iter().zip(&cloud.grains).enumerate() {
            if air.age(index, cloud.frame).0 > 4 {
                let (before, after) = (distance(before.place), distance(after.place));
                assert!((after / before - 1.0).abs() < 1e-3, "{before} {after}");
            }
        }
    }

    #[test]
    fn forces_that_do_not_brake_carry_nothing() {
        let air = air("m * vec3(3, 0, 0)");
        let mut cloud = Cloud::new(&air, 0);
        assert!(cloud.grains(&air, 9).iter().all(|grain| grain.from == grain.to));
    }

    #[test]
    fn grains_that_are_thrown_far_away_come_back_and_stay_numbers() {
        let air = air("7 * m * (1e6 * x - v)");
        let mut cloud = Cloud::new(&air, 0);
        let grains = cloud.grains(&air, 60);
        assert!(grains.iter().all(|grain| grain.to.iter().all(|x| x.is_finite())));
        let near = grains.iter().filter(|grain| grain.to.iter().all(|x| x.abs() < 10.0)).count();
        assert!((1..grains.len() / 2).contains(&near), "{near}");
    }
}
