//! Ratio of the stiffness of inertia to the stiffness of a body in a scene.

use super::{FramedScene, Scene, instants, trace};
use flexbody_base::error::Result;
use flexbody_body::flex_body::FlexBody;
use flexbody_linalg::context::Context;

/// Returns the largest ratio of the stiffness of inertia to the stiffness against any deformation of `body`
/// during the motion of `scene`: an upper bound over the directions of spin and acceleration. Returns
/// `None` if the body has no stiffness of inertia.
///
/// The bound at one time is |omega|^2 s_w + |omega'| s_alpha + |a| s_a with the shares s of
/// [`InertiaShares`](flexbody_body::invariants::InertiaShares) and a = V' + omega x V - g.
///
/// # Errors
/// The errors of [`simulate`](super::simulate).
pub fn inertia_share(body: &FlexBody, scene: &Scene, context: &Context<'_>) -> Result<Option<f64>> {
    let framed = FramedScene::new(body, scene)?;
    let Some(inertia) = framed.body.inertia_stiffness() else { return Ok(None) };
    let stiffness = framed.body.invariants().modal_stiffness();
    let Some(shares) = inertia.shares(stiffness.as_ref()) else { return Ok(None) };
    let (motion, _) = trace(body, scene, &context.without_listener())?;
    let seen = instants(body, scene, &motion.time)?;
    let at = seen.iter().map(|now| {
        let acceleration = now.velocity_rate + now.omega.cross(&now.velocity) - now.gravity;
        now.omega.norm_squared() * shares.spin_squared
            + now.omega_rate.norm() * shares.angular_acceleration
            + acceleration.norm() * shares.acceleration
    });
    Ok(Some(at.fold(0.0, f64::max)))
}
