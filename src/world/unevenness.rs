//! The uneven floor: a motion of the ground under the tyres that encoders cannot see.
//!
//! Proportional to the body's own motion, so that it is the same at any step: a random walk of heading with distance and
//! with turning on the spot, and a scale of distance, as [`Scatter`] states them.

use crate::geometry::Twist2;
use crate::scene::Scatter;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::f64::consts::FRAC_PI_2;

/// Distance over which the floor keeps its curvature \[m\].
const DISTANCE_BIN: f64 = 0.05;
/// Turn over which the floor keeps its effect on turning \[rad\].
const TURN_BIN: f64 = 0.05;

#[derive(Clone)]
pub(super) struct Unevenness {
    rng: ChaCha8Rng,
    scatter: Scatter,
    /// Half the track, to tell turning on the spot from driving an arc \[m\].
    half_track: f64,
    /// Of distance, relative.
    stretch: f64,
    /// Heading a metre, in this bin of distance \[rad/m\].
    curvature: f64,
    /// Heading a radian turned on the spot, in this bin of turn.
    turn_error: f64,
    distance: f64,
    turned: f64,
}

impl Unevenness {
    /// The floor of one run; `None` for an even one.
    pub(super) fn new(scatter: Scatter, half_track: f64, mut rng: ChaCha8Rng) -> Option<Unevenness> {
        if scatter == Scatter::NONE {
            return None;
        }
        let stretch = scatter.distance * normal(&mut rng);
        let mut floor = Unevenness {
            rng,
            scatter,
            half_track,
            stretch,
            curvature: 0.0,
            turn_error: 0.0,
            distance: 0.0,
            turned: 0.0,
        };
        floor.draw_curvature();
        floor.draw_turn_error();
        Some(floor)
    }

    /// The twist of the floor under a robot that moves with `body`, for a step of `dt` \[s\].
    pub(super) fn twist(&mut self, body: Twist2, dt: f64) -> Twist2 {
        let on_the_spot = (body.yaw_rate.abs() - body.forward.abs() / self.half_track).max(0.0);
        self.distance += body.forward.abs() * dt;
        if self.distance >= DISTANCE_BIN {
            self.distance -= DISTANCE_BIN;
            self.draw_curvature();
        }
        self.turned += on_the_spot * dt;
        if self.turned >= TURN_BIN {
            self.turned -= TURN_BIN;
            self.draw_turn_error();
        }
        Twist2 {
            forward: self.stretch * body.forward,
            left: 0.0,
            yaw_rate: self.curvature * body.forward.abs() + self.turn_error * on_the_spot,
        }
    }

    /// σ√d over a bin of length d is a curvature of σ/√d.
    fn draw_curvature(&mut self) {
        self.curvature = self.scatter.heading_per_sqrt_metre / DISTANCE_BIN.sqrt() * normal(&mut self.rng);
    }

    /// σ a quarter turn is σ/√(π/2) a √rad.
    fn draw_turn_error(&mut self) {
        let per_sqrt_radian = self.scatter.heading_per_corner / FRAC_PI_2.sqrt();
        self.turn_error = per_sqrt_radian / TURN_BIN.sqrt() * normal(&mut self.rng);
    }
}

fn normal(rng: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(rng)
}
