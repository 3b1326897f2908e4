//! The contact patch of a rubber tyre: bristles that stick, stretch, slide, and are carried through the patch.
//!
//! Kalker's simplified theory in transient form (FASTSIM's bristles with a time of their own), which is Pacejka's brush
//! model with turn slip [Kalker, *Vehicle System Dynamics* 11 (1982) 1–13; Pacejka, *Tyre and Vehicle Dynamics*, ch. 3]:
//!
//! - The patch is 2a × w, a = √(2Rδ); pressure p ∝ 1 − (ξ/a)² along it, even across.
//! - A bristle at (ξ, η) slips over the ground with v = v_patch + ω_n × r, turn slip included.
//! - ∂u/∂t = −v + V_roll ∂u/∂ξ for its deflection u, and u = 0 where rubber enters. Rolling backwards it enters at the
//!   other end; standing still it is not carried at all.
//! - The traction k·u is cut back to the friction ellipse with half axes μ_x p, μ_y p, along its normal there: a bristle
//!   that slides with s dissipates the most that it can, f = −p (μ_x² s_x, μ_y² s_y)/√(μ_x² s_x² + μ_y² s_y²). On a circle
//!   this is the radial return, f against s; on an ellipse a radial return would leave b_eff/b = 1 + (l/b)² whatever
//!   μ_y/μ_x, where it is 1 + (μ_y/μ_x)² (l/b)².
//!
//! The motion handed in is that of the middle of the step, as the engine's leapfrog has it, so that bristles that stick are
//! stretched to second order in the step. Bristles that slide are turned to the slip's direction by the return at the step's
//! end, a backward Euler step of their relaxation, which lags by half a step; they get the slip half a step ahead, carried on
//! by its last change, which takes away that lag's first order. What is left is first order still, and small: transport and
//! the vertical damper are backward differences. Sticking bristles must not lead: on a light robot it would be a stiff spring's.
//!
//! Transport is upwind and implicit in time, so that it is stable at any speed; its steady state has the full brush
//! model's force at small slip exactly, by the choice of k, and at full sliding exactly. Known differences from a real
//! tyre: no carcass bending, no camber thrust, friction that does not fall with sliding speed, no rolling resistance.
//!
//! Validated by `analytic::patch_*` (brush theory, passivity) and `analytic::spin_*` (effective track).

use crate::scene::Tyre;
use wide::f64x4;

/// Cells along the patch.
pub const CELLS_ALONG: usize = 8;
/// Cells across the patch.
pub const CELLS_ACROSS: usize = 4;

/// Time over which a bristle's own motion is damped \[s\]: it lets a parked robot come to rest, and is nothing in steady
/// rolling or sliding.
pub const BRISTLE_DAMPING: f64 = 1.0e-3;

/// What counts as no load \[N\]: a limit has to be divided by.
const NO_LOAD: f64 = 1e-9;

/// Share of the load on one cell of each row along the patch: the integral of the parabola over it, over the width.
const LOAD_SHARE: [f64; CELLS_ALONG] = {
    let mut share = [0.0; CELLS_ALONG];
    let n = CELLS_ALONG as f64;
    let mut i = 0;
    while i < CELLS_ALONG {
        // ∫ ¾(1 − s²) ds from s0 to s1, s = ξ/a.
        let s0 = 2.0 * i as f64 / n - 1.0;
        let s1 = s0 + 2.0 / n;
        share[i] = 0.75 * ((s1 - s0) - (s1 * s1 * s1 - s0 * s0 * s0) / 3.0) / CELLS_ACROSS as f64;
        i += 1;
    }
    share
};

/// One over each.
const PER_LOAD_SHARE: [f64; CELLS_ALONG] = {
    let mut per = LOAD_SHARE;
    let mut i = 0;
    while i < CELLS_ALONG {
        per[i] = 1.0 / LOAD_SHARE[i];
        i += 1;
    }
    per
};

/// Cells of a row across the patch, which are independent of each other and go side by side in the processor's lanes.
/// Lane by lane these are IEEE operations: the bits are the same whatever the processor's lanes are.
type Row = f64x4;

/// Steps of the search for the nearest point of an ellipse: from 10 % outside, as a step leaves it, two reach 10⁻⁹.
const SEARCH_STEPS: usize = 3;

/// A friction limit: half axes of an ellipse, each as its inverse.
#[derive(Clone, Copy)]
struct Limit {
    inverse_along: f64,
    inverse_across: f64,
    /// (μ_y/μ_x)²
    ratio_squared: f64,
}

impl Limit {
    /// Square of how far forces (f, g) reach to the limit: above 1 outside.
    #[inline(always)]
    fn saturation(&self, f: Row, g: Row) -> Row {
        let (f, g) = (f * self.inverse_along, g * self.inverse_across);
        f * f + g * g
    }

    /// Factors on forces (f, g) along and across that bring them into the limit: 1 inside. `ELLIPSE` is whether the two
    /// half axes differ.
    #[inline(always)]
    fn back<const ELLIPSE: bool>(&self, f: Row, g: Row) -> [Row; 2] {
        // Without branches, so that the lanes go together: what is inside is divided by 1.
        let inside = |saturation: Row| saturation.fast_max(Row::ONE);
        if !ELLIPSE {
            let back = Row::ONE / inside(self.saturation(f, g)).sqrt();
            return [back, back];
        }
        // The nearest point is (f/(1 + λ), g k²/(k² + λ)) with λ ≥ 0 such that it lies on the ellipse; one over the root of
        // its saturation is concave in λ and nearly straight, so that Newton's steps come from below and are few.
        let k2 = Row::splat(self.ratio_squared);
        let (x, y) = (f * self.inverse_along, g * self.inverse_across);
        let (x, y) = (x * x, y * y);
        let mut lambda = Row::ZERO;
        for _ in 0..SEARCH_STEPS {
            let (p, q) = (Row::ONE / (Row::ONE + lambda), k2 / (k2 + lambda));
            let (of_x, of_y) = (x * p * p, y * q * q);
            let saturation = inside(of_x + of_y);
            // Where both are 0 there is nothing to bring back.
            let slope = (of_x * p + of_y * q / k2).fast_max(Row::splat(f64::MIN_POSITIVE));
            lambda += saturation * (saturation.sqrt() - Row::ONE) / slope;
        }
        let (p, q) = (Row::ONE / (Row::ONE + lambda), k2 / (k2 + lambda));
        let rest = Row::ONE / inside(x * p * p + y * q * q).sqrt();
        [p * rest, q * rest]
    }
}

/// The bristles of one patch.
#[derive(Debug, Clone)]
pub struct Patch {
    /// Deflection along of each cell, rearmost row first \[m\].
    along: [Row; CELLS_ALONG],
    /// Deflection across \[m\].
    across: [Row; CELLS_ALONG],
    /// Forces of the last step, as [`Patch::forces`] hands them out \[N\].
    force_along: [Row; CELLS_ALONG],
    force_across: [Row; CELLS_ALONG],
    /// a of the last step \[m\].
    half_length: f64,
    /// Motion in the last step; `None` where the tyre has just touched.
    before: Option<PatchMotion>,
}

/// How a patch moves over the ground.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PatchMotion {
    /// Velocity of unstrained tread over the ground at the patch centre, along: V_x − Ω R_e \[m/s\].
    pub slip_along: f64,
    /// To the left: V_y \[m/s\].
    pub slip_across: f64,
    /// Rotation about the ground's normal, ω_n \[rad/s\].
    pub spin: f64,
    /// Speed at which tread is carried through the patch, Ω R_e, positive rolling forward \[m/s\].
    pub rolling: f64,
}

/// Force and moment of the ground on the tyre at the patch centre.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PatchForce {
    /// \[N\]
    pub along: f64,
    /// To the left \[N\].
    pub across: f64,
    /// About the ground's normal \[N m\].
    pub moment: f64,
}

impl Default for Patch {
    fn default() -> Self {
        let still = [Row::ZERO; CELLS_ALONG];
        Patch { along: still, across: still, force_along: still, force_across: still, half_length: 0.0, before: None }
    }
}

impl Patch {
    /// Carries the bristles on by `dt` \[s\] under `load` \[N\] at `squash` δ \[m\], on ground whose grip is `grip` times
    /// that of the tyre's stated friction.
    pub fn advance(
        &mut self,
        tyre: &Tyre,
        load: f64,
        squash: f64,
        grip: f64,
        motion: &PatchMotion,
        dt: f64,
    ) -> PatchForce {
        // Two versions, so that the common circle pays nothing for the ellipse.
        if tyre.friction_along == tyre.friction_across {
            self.carry::<false>(tyre, load, squash, grip, motion, dt)
        } else {
            self.carry::<true>(tyre, load, squash, grip, motion, dt)
        }
    }

    fn carry<const ELLIPSE: bool>(
        &mut self,
        tyre: &Tyre,
        load: f64,
        squash: f64,
        grip: f64,
        motion: &PatchMotion,
        dt: f64,
    ) -> PatchForce {
        let a = tyre.contact_half_length(squash);
        self.half_length = a;
        let cell_length = 2.0 * a / CELLS_ALONG as f64;
        let cell_width = tyre.width / CELLS_ACROSS as f64;
        // Upwind cells read the deflection at their leaving edge: n/(n+1) keeps the whole patch's slip stiffness exact.
        let upwind = CELLS_ALONG as f64 / (CELLS_ALONG + 1) as f64;
        let stiffness = tyre.bristle_stiffness() * upwind * cell_length * cell_width;
        let damping = BRISTLE_DAMPING / dt;
        let carried = motion.rolling.abs() * dt / cell_length;
        let keep = 1.0 / (1.0 + carried);
        let passed_on = carried * keep;
        let forward = motion.rolling >= 0.0;
        let before = self.before.replace(*motion).unwrap_or(*motion);
        // Way that half of the slip's change since the last step makes in this one, at the centre, and a metre beside it.
        let ahead = |now: f64, before: f64| 0.5 * (now - before) * dt * keep;
        let ahead_across = ahead(motion.slip_across, before.slip_across);
        let ahead_turn = ahead(motion.spin, before.spin);
        let eta = Row::from(std::array::from_fn(|j| cell_width * (j as f64 - 0.5 * (CELLS_ACROSS - 1) as f64)));
        let ahead_along = Row::splat(ahead(motion.slip_along, before.slip_along)) - eta * ahead_turn;
        let way_along = (Row::splat(motion.slip_along) - eta * motion.spin) * dt;
        let inverse = 1.0 / (grip * load).max(NO_LOAD);
        let (inverse_along, inverse_across) = (inverse / tyre.friction_along, inverse / tyre.friction_across);
        let ratio_squared = if ELLIPSE { (tyre.friction_across / tyre.friction_along).powi(2) } else { 1.0 };

        let (mut force_along, mut force_across, mut moment) = (Row::ZERO, Row::ZERO, Row::ZERO);
        let (mut entering_along, mut entering_across) = (Row::ZERO, Row::ZERO);
        for step in 0..CELLS_ALONG {
            let i = if forward { CELLS_ALONG - 1 - step } else { step };
            let xi = a * ((2 * i + 1) as f64 / CELLS_ALONG as f64 - 1.0);
            let of_force = Limit {
                inverse_along: inverse_along * PER_LOAD_SHARE[i],
                inverse_across: inverse_across * PER_LOAD_SHARE[i],
                ratio_squared,
            };
            // The same limit for a deflection.
            let of_stretch = Limit {
                inverse_along: stiffness * of_force.inverse_along,
                inverse_across: stiffness * of_force.inverse_across,
                ratio_squared,
            };
            let way_across = (motion.slip_across + motion.spin * xi) * dt;
            let (old_along, old_across) = (self.along[i], self.across[i]);
            let mut u = (old_along - way_along) * keep + entering_along;
            let mut v = (old_across - way_across) * keep + entering_across;
            // Back to the friction ellipse, for those that slide, which meet the slip half a step ahead.
            let slides = of_stretch.saturation(u, v).simd_gt(Row::ONE);
            if slides.any() {
                u -= slides & ahead_along;
                v -= slides & Row::splat(ahead_across + ahead_turn * xi);
                let [back_along, back_across] = of_stretch.back::<ELLIPSE>(u, v);
                u *= back_along;
                v *= back_across;
            }
            (entering_along, entering_across) = (u * passed_on, v * passed_on);
            (self.along[i], self.across[i]) = (u, v);
            // Damping of the bristle's own motion, again inside the ellipse.
            let mut f = (u + (u - old_along) * damping) * stiffness;
            let mut g = (v + (v - old_across) * damping) * stiffness;
            if of_force.saturation(f, g).simd_gt(Row::ONE).any() {
                let [back_along, back_across] = of_force.back::<ELLIPSE>(f, g);
                f *= back_along;
                g *= back_across;
            }
            (self.force_along[i], self.force_across[i]) = (f, g);
            force_along += f;
            force_across += g;
            moment += g * xi - f * eta;
        }
        let sum = |lanes: Row| lanes.to_array().iter().sum::<f64>();
        PatchForce { along: sum(force_along), across: sum(force_across), moment: sum(moment) }
    }

    /// Lifts the tyre off the ground: bristles spring back.
    pub fn release(&mut self) {
        *self = Patch::default();
    }

    /// a of the last step \[m\].
    pub fn half_length(&self) -> f64 {
        self.half_length
    }

    /// Shear traction (along, across) on the tyre of each cell in the last step \[Pa\].
    pub fn tractions(&self, tyre: &Tyre) -> [[[f64; 2]; CELLS_ACROSS]; CELLS_ALONG] {
        let area = 2.0 * self.half_length * tyre.width / (CELLS_ALONG * CELLS_ACROSS) as f64;
        let per_area = if area > 0.0 { 1.0 / area } else { 0.0 };
        std::array::from_fn(|i| {
            let (along, across) = (self.force_along[i].to_array(), self.force_across[i].to_array());
            std::array::from_fn(|j| [along[j] * per_area, across[j] * per_area])
        })
    }
}
