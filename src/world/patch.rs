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
//! exact to second order. Bristles that slide are turned to the slip's direction by the return at the step's end, a backward
//! Euler step of their relaxation, which lags by half a step; they get the slip half a step ahead, carried on by its last
//! change, which leaves second order. Sticking bristles must not: on a light robot the lead would be a stiff spring's.
//!
//! Transport is upwind and implicit in time, so that it is stable at any speed; its steady state has the full brush
//! model's force at small slip exactly, by the choice of k, and at full sliding exactly. Known differences from a real
//! tyre: no carcass bending, no camber thrust, friction that does not fall with sliding speed, no rolling resistance.
//!
//! Validated by `analytic::patch_*` (brush theory, passivity) and `analytic::spin_*` (effective track).

use crate::scene::Tyre;

/// Cells along the patch.
pub const CELLS_ALONG: usize = 8;
/// Cells across the patch.
pub const CELLS_ACROSS: usize = 4;

/// Time over which a bristle's own motion is damped \[s\]: it lets a parked robot come to rest, and is nothing in steady
/// rolling or sliding.
const BRISTLE_DAMPING: f64 = 1.0e-3;

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

type Row = [f64; CELLS_ACROSS];

/// Steps of the search for the nearest point of an ellipse: from 10 % outside, as a step leaves it, two reach 10⁻⁹.
const SEARCH_STEPS: usize = 3;

/// A friction limit: half axes of an ellipse, each as its inverse, 0 for no limit.
#[derive(Clone, Copy)]
struct Limit {
    inverse_along: f64,
    inverse_across: f64,
    /// (μ_y/μ_x)²
    ratio_squared: f64,
}

impl Limit {
    /// Square of how far a force (f, g) reaches to the limit: above 1 outside.
    #[inline(always)]
    fn saturation(&self, f: f64, g: f64) -> f64 {
        (f * self.inverse_along).powi(2) + (g * self.inverse_across).powi(2)
    }

    /// Factors on a force (f, g) along and across that bring it into the limit: 1 inside. `ELLIPSE` is whether the two
    /// half axes differ.
    #[inline(always)]
    fn back<const ELLIPSE: bool>(&self, f: f64, g: f64) -> [f64; 2] {
        let (x, y) = ((f * self.inverse_along).powi(2), (g * self.inverse_across).powi(2));
        let radial = |saturation: f64| if saturation > 1.0 { 1.0 / saturation.sqrt() } else { 1.0 };
        if !ELLIPSE {
            let back = radial(x + y);
            return [back, back];
        }
        // The nearest point is (f/(1 + λ), g k²/(k² + λ)) with λ ≥ 0 such that it lies on the ellipse; one over the root of
        // its saturation is concave in λ and nearly straight, so that Newton's steps come from below and are few.
        let k2 = self.ratio_squared;
        let mut lambda = 0.0;
        for _ in 0..SEARCH_STEPS {
            let (p, q) = (1.0 / (1.0 + lambda), k2 / (k2 + lambda));
            let (of_x, of_y) = (x * p * p, y * q * q);
            let saturation = (of_x + of_y).max(1.0);
            let slope = of_x * p + of_y * q / k2;
            lambda += if saturation > 1.0 { saturation * (saturation.sqrt() - 1.0) / slope } else { 0.0 };
        }
        let (p, q) = (1.0 / (1.0 + lambda), k2 / (k2 + lambda));
        let rest = radial(x * p * p + y * q * q);
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
        let still = [[0.0; CELLS_ACROSS]; CELLS_ALONG];
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
        let forward = motion.rolling >= 0.0;
        let before = self.before.replace(*motion).unwrap_or(*motion);
        // Way that half of the slip's change since the last step makes in this one, at the centre, and a metre beside it.
        let ahead = |now: f64, before: f64| 0.5 * (now - before) * dt * keep;
        let ahead_along = ahead(motion.slip_along, before.slip_along);
        let ahead_across = ahead(motion.slip_across, before.slip_across);
        let ahead_turn = ahead(motion.spin, before.spin);

        let mut force = PatchForce::default();
        let (mut entering_along, mut entering_across) = ([0.0; CELLS_ACROSS], [0.0; CELLS_ACROSS]);
        for step in 0..CELLS_ALONG {
            let i = if forward { CELLS_ALONG - 1 - step } else { step };
            let xi = a * ((2 * i + 1) as f64 / CELLS_ALONG as f64 - 1.0);
            let limit = grip * load * LOAD_SHARE[i];
            let (limit_along, limit_across) = (tyre.friction_along * limit, tyre.friction_across * limit);
            let (inverse_along, inverse_across) =
                if limit > 0.0 { (1.0 / limit_along, 1.0 / limit_across) } else { (0.0, 0.0) };
            let ratio_squared = (tyre.friction_across / tyre.friction_along).powi(2);
            let limit = Limit { inverse_along, inverse_across, ratio_squared };
            let slip_across = motion.slip_across + motion.spin * xi;
            for j in 0..CELLS_ACROSS {
                let eta = cell_width * (j as f64 - 0.5 * (CELLS_ACROSS - 1) as f64);
                let slip_along = motion.slip_along - motion.spin * eta;
                let (old_along, old_across) = (self.along[i][j], self.across[i][j]);
                let mut u = (old_along + carried * entering_along[j] - slip_along * dt) * keep;
                let mut v = (old_across + carried * entering_across[j] - slip_across * dt) * keep;
                // Back to the friction ellipse, for those that slide, which meet the slip half a step ahead.
                if limit.saturation(stiffness * u, stiffness * v) > 1.0 {
                    u -= ahead_along - ahead_turn * eta;
                    v -= ahead_across + ahead_turn * xi;
                    let [back_along, back_across] = limit.back::<ELLIPSE>(stiffness * u, stiffness * v);
                    u *= back_along;
                    v *= back_across;
                }
                // Damping of the bristle's own motion, again inside the ellipse.
                let mut f = stiffness * (u + damping * (u - old_along));
                let mut g = stiffness * (v + damping * (v - old_across));
                let [back_along, back_across] = limit.back::<ELLIPSE>(f, g);
                f *= back_along;
                g *= back_across;
                self.along[i][j] = u;
                self.across[i][j] = v;
                entering_along[j] = u;
                entering_across[j] = v;
                self.force_along[i][j] = f;
                self.force_across[i][j] = g;
                force.along += f;
                force.across += g;
                force.moment += g * xi - f * eta;
            }
        }
        force
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
            std::array::from_fn(|j| [self.force_along[i][j] * per_area, self.force_across[i][j] * per_area])
        })
    }
}
