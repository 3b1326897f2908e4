//! A rubber tyre: what it is made of, and the closed forms that follow from it.

/// A rubber tyre on a rigid rim.
///
/// Vertically a spring and a damper; along and across the patch, bristles of rubber that stick until friction gives
/// way ([`crate::world`] holds the patch). Fair starts for small rubber wheels: slip stiffness 15 N a newton of load
/// and unit slip; μ 0.8.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tyre {
    /// Unloaded radius \[m\].
    pub free_radius: f64,
    /// Width of the patch \[m\].
    pub width: f64,
    /// k_z, load over squash \[N/m\].
    pub vertical_stiffness: f64,
    /// c_z \[N s/m\].
    pub vertical_damping: f64,
    /// Force over load at unit slip, in the limit of small slip \[–\].
    pub slip_stiffness: f64,
    /// μ_x, along the rolling direction \[–\].
    pub friction_along: f64,
    /// μ_y, across it \[–\].
    pub friction_across: f64,
}

impl Tyre {
    /// δ = N/k_z: how far `load` \[N\] presses the tyre in \[m\].
    pub fn squash(&self, load: f64) -> f64 {
        load / self.vertical_stiffness
    }

    /// a = √(2Rδ): half the length of the patch \[m\] at `squash` \[m\], that of a circle cut by a plane (to first order
    /// in δ/R).
    pub fn contact_half_length(&self, squash: f64) -> f64 {
        (2.0 * self.free_radius * squash).sqrt()
    }

    /// R_e = R − δ/3: travel a radian of free rolling \[m\] at `squash` \[m\].
    ///
    /// While a piece of tread is in the patch the rim turns by 2φ with sin φ = a/R, and the wheel travels the chord
    /// 2a = 2R sin φ; so R_e = R sin φ/φ ≈ R(1 − φ²/6) = R − δ/3, the usual approximation for a tyre whose belt is soft
    /// [Pacejka, *Tyre and Vehicle Dynamics*, ch. 1.2]. It lies between the loaded radius R − δ and the free one.
    pub fn rolling_radius(&self, squash: f64) -> f64 {
        self.free_radius - squash / 3.0
    }

    /// Stiffness of the bristles, shear traction over deflection \[N/m³\].
    ///
    /// A bristle that entered the patch a distance s ago is deflected by slip · s, so the slip stiffness of the whole patch
    /// is C = k w (2a)²/2 = 4 k w R δ. With C = `slip_stiffness` · k_z δ this is the same k at every load.
    pub fn bristle_stiffness(&self) -> f64 {
        self.slip_stiffness * self.vertical_stiffness / (4.0 * self.width * self.free_radius)
    }
}
