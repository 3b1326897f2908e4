//! nalgebra (scene, estimation) ↔ glam (rapier, parry). The one place where they meet.

use crate::scene::Placement;
use nalgebra::{Matrix3, Point3, Quaternion, Translation3, UnitQuaternion, Vector3};
use rapier3d::math::{Matrix, Pose, Rotation, Vector};

pub(super) fn vector(v: Vector3<f64>) -> Vector {
    Vector::new(v.x, v.y, v.z)
}

pub(super) fn point(p: Point3<f64>) -> Vector {
    vector(p.coords)
}

pub(super) fn pose(placement: &Placement) -> Pose {
    let q = placement.rotation.coords;
    Pose::from_parts(vector(placement.translation.vector), Rotation::from_xyzw(q.x, q.y, q.z, q.w))
}

pub(super) fn placement(pose: &Pose) -> Placement {
    let (t, q) = (pose.translation, pose.rotation);
    Placement::from_parts(
        Translation3::new(t.x, t.y, t.z),
        UnitQuaternion::new_unchecked(Quaternion::new(q.w, q.x, q.y, q.z)),
    )
}

pub(super) fn matrix(m: &Matrix3<f64>) -> Matrix {
    Matrix::from_cols(vector(m.column(0).into()), vector(m.column(1).into()), vector(m.column(2).into()))
}
