//! Parameters to paste into ROS 2: those of `diff_drive_controller` (ros2_controllers), under its own key names.

use crate::calibrate::{Estimate, Score};
use crate::odometry::OdometryParameters;

/// Variance of what a planar odometry does not observe: z, roll, pitch, as the controller's examples have it.
const UNOBSERVED: f64 = 1e6;

/// A YAML file with the multipliers of `estimate` on what the robot believed, and the pose covariance that the
/// residuals of `score` leave.
pub fn diff_drive_controller(
    method: &str,
    believed: &OdometryParameters,
    estimate: &Estimate,
    score: &Score,
) -> String {
    let correction = estimate.correction();
    let (left, right) = correction.wheel_factors();
    let nominal_radius = 0.5 * (believed.left_wheel_radius + believed.right_wheel_radius);
    // YAML 1.1 takes a number without a point for text.
    let variance = |value: f64| format!("{value:.3e}");
    let position = 0.5 * score.position_rmse_after * score.position_rmse_after;
    let heading = if score.heading_rmse_after.is_nan() { UNOBSERVED } else { score.heading_rmse_after.powi(2) };
    let (position, heading) = (variance(position), variance(heading));
    let not_fixed = estimate.not_fixed.map_or(String::new(), |words| format!("# Not fixed by the data: {words}\n"));
    format!(
        "# Found by treadmark {version}, method {method}.\n\
         {not_fixed}\
         # The multipliers are on these nominal values, which stay as they are:\n\
         #   wheel_separation: {track:?}\n\
         #   wheel_radius: {nominal_radius:?}\n\
         diff_drive_controller:\n\
         \x20 ros__parameters:\n\
         \x20   wheel_separation_multiplier: {e_b:?}\n\
         \x20   left_wheel_radius_multiplier: {left:?}\n\
         \x20   right_wheel_radius_multiplier: {right:?}\n\
         \x20   # x, y, z, roll, pitch, yaw: the variance of end poses about their prediction\n\
         \x20   pose_covariance_diagonal: [{position}, {position}, {u:?}, {u:?}, {u:?}, {heading}]\n",
        version = env!("CARGO_PKG_VERSION"),
        track = believed.track_width,
        e_b = correction.track_ratio,
        left = left * believed.left_wheel_radius / nominal_radius,
        right = right * believed.right_wheel_radius / nominal_radius,
        u = UNOBSERVED,
    )
}
