//! What a floor does to the engine's own contacts: it moves under them, and grips more here than there.
//!
//! The counterpart for rigid cylinders of what `wheel` does for patches, by the engine's way to modify contacts.

use super::ground::Ground;
use super::wheel::FloorMotion;
use rapier3d::prelude::{ContactModificationContext, PhysicsHooks};

/// The ground as rigid cylinders meet it in one step.
pub(super) struct CarriedContacts<'w> {
    pub ground: &'w Ground,
    pub motion: FloorMotion,
}

impl PhysicsHooks for CarriedContacts<'_> {
    fn modify_solver_contacts(&self, context: &mut ContactModificationContext) {
        // What is no body's is ground. The engine wants the velocity of the second side over the first.
        let (ground, sign) = match (context.rigid_body1, context.rigid_body2) {
            (None, Some(_)) => (context.collider1, 1.0),
            (Some(_), None) => (context.collider2, -1.0),
            _ => return,
        };
        let piece = context.colliders[ground].user_data as usize;
        let Some(contacts) = context.rigid_mut() else { return };
        let mut grip = 0.0;
        for contact in contacts.solver_contacts.iter_mut() {
            let point = if sign > 0.0 { contact.anchor1 } else { contact.anchor2 };
            contact.tangent_velocity = self.motion.velocity_at(point) * sign;
            grip += self.ground.grip_ratio_at(piece, point);
        }
        // One friction a manifold: the mean of its points.
        *contacts.friction *= grip / contacts.solver_contacts.len().max(1) as f64;
    }
}
