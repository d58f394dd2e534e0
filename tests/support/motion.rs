//! Motions of bodies by the library's integrators.

use flexbody::dynamics::{Balance, Configuration, EquationsOfMotion, Motion, Surroundings};
use flexbody::integration::{Explicit, Failure, Gauss, Method, System, integrate};

/// The states at the instants, the first of which is the start, with their balances.
pub fn run(
    equations: &EquationsOfMotion,
    surroundings: &dyn Surroundings,
    start: &Configuration,
    method: impl Fn(usize) -> Method,
    instants: &[f64],
    breaks: &[f64],
) -> (Vec<Configuration>, Vec<Balance>) {
    let (mut motion, mut state) = Motion::new(equations, surroundings, start);
    let mut observer = Motion::new(equations, surroundings, start).0;
    let (mut places, mut balances) = (Vec::new(), Vec::new());
    integrate(&mut method(motion.dimension()), &mut motion, &mut state, instants, breaks, |time, state| {
        places.push(observer.configuration(time, state)?);
        balances.push(observer.balance(time, state)?);
        Ok::<(), Failure>(())
    })
    .expect("a body that moves");
    (places, balances)
}

/// The method with error control.
pub fn adaptive(tolerance: f64) -> impl Fn(usize) -> Method {
    move |n| Method::Explicit(Explicit::new(n, tolerance, f64::MAX))
}

/// The method that conserves.
pub fn conserving(order: usize, step: f64) -> impl Fn(usize) -> Method {
    move |n| Method::Gauss { method: Gauss::new(n, order), step }
}
