//! What a method found.

use crate::odometry::OdometryCorrection;

/// One corrected quantity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parameter {
    /// Best value; where the data do not fix it, the one that was assumed.
    pub value: f64,
    /// 1 σ; infinite where the data do not fix it, NaN where the method cannot tell.
    pub std_dev: f64,
}

/// Corrections to what the robot believed, with their uncertainty.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimate {
    /// E_d = D_R/D_L, true over believed.
    pub diameter_ratio: Parameter,
    /// E_b = b_true/b_believed.
    pub track_ratio: Parameter,
    /// E_s = D_mean,true/D_mean,believed.
    pub distance_scale: Parameter,
    /// Covariance of (E_d, E_b, E_s) over what the data fix; `None` where the method has none.
    pub covariance: Option<[[f64; 3]; 3]>,
    /// What the data do not fix, in plain words; `None` where they fix all three.
    pub not_fixed: Option<&'static str>,
}

/// Square end points close wherever the scale is: they fix E_b/E_s.
pub(super) const SCALE_NOT_FIXED: &str =
    "E_s against E_b: closed runs fix only their ratio; a tape-measured straight parts them";

impl Estimate {
    /// The values alone.
    pub fn correction(&self) -> OdometryCorrection {
        OdometryCorrection {
            diameter_ratio: self.diameter_ratio.value,
            track_ratio: self.track_ratio.value,
            distance_scale: self.distance_scale.value,
        }
    }

    /// Values of a closed form, their σ still to be found. Without a measured scale, E_s is assumed and E_b hangs on it.
    pub(super) fn of_values(diameter_ratio: f64, track_ratio: f64, distance_scale: Option<f64>) -> Estimate {
        let unknown = |value| Parameter { value, std_dev: f64::NAN };
        let assumed = |value| Parameter { value, std_dev: f64::INFINITY };
        match distance_scale {
            Some(scale) => Estimate {
                diameter_ratio: unknown(diameter_ratio),
                track_ratio: unknown(track_ratio),
                distance_scale: unknown(scale),
                covariance: None,
                not_fixed: None,
            },
            None => Estimate {
                diameter_ratio: unknown(diameter_ratio),
                track_ratio: assumed(track_ratio),
                distance_scale: assumed(1.0),
                covariance: None,
                not_fixed: Some(SCALE_NOT_FIXED),
            },
        }
    }
}
