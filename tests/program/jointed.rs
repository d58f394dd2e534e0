//! Bodies and joints of `examples/joints`, integrated with error control.

#[allow(dead_code, unused_imports)] // some steps of the examples are unused
#[path = "../../examples/joints/mod.rs"]
mod joints;

use flexbody_motion::integration::{Explicit, Failure, System};
#[allow(unused_imports)] // not every test binary joins bodies
pub use joints::{Assembly, End, Joint, Start};

/// Reference scales of the errors.
pub struct Scales {
    pub length: f64,
    pub rate: f64,
}

/// An assembly with the reference scales of its errors.
pub struct Jointed<'a> {
    pub assembly: Assembly<'a>,
    pub scales: Scales,
}

impl<'a> Jointed<'a> {
    /// Integrates from 0 to the last of the `instants` and calls the observer with the state at each.
    pub fn run(
        &mut self,
        y: &mut [f64],
        instants: &[f64],
        tolerance: f64,
        mut look: impl FnMut(&Assembly<'a>, usize, &[f64]),
    ) {
        let longest = instants.last().copied().unwrap_or(0.0);
        let mut method = Explicit::new(y.len(), tolerance, longest);
        let mut time = 0.0;
        for (at, &instant) in instants.iter().enumerate() {
            while time < instant {
                time = method.step(self, time, y, instant).expect("a step");
            }
            look(&self.assembly, at, y);
        }
    }
}

impl System for Jointed<'_> {
    fn dimension(&self) -> usize {
        self.assembly.dimension()
    }

    fn rates(&mut self, _: f64, y: &[f64], rates: &mut [f64]) -> Result<(), Failure> {
        let found = self.assembly.rates(y).map_err(|reason| Failure::Rates { reason })?;
        rates.copy_from_slice(&found.state);
        Ok(())
    }

    fn scales(&self, _: &[f64], scales: &mut [f64]) {
        let Scales { length, rate } = self.scales;
        for (body, equations) in self.assembly.bodies.iter().enumerate() {
            let (first, nf) = (self.assembly.first(body), equations.n_modes());
            let amplitude = length * self.assembly.masses[body].sqrt();
            let own = &mut scales[first..first + 7 + nf + equations.n_velocities()];
            own[..3].fill(length);
            own[3..7].fill(1.0);
            own[7..7 + nf].fill(amplitude);
            own[7 + nf..10 + nf].fill(length * rate);
            own[10 + nf..13 + nf].fill(rate);
            own[13 + nf..].fill(amplitude * rate);
        }
    }

    /// Projects the state onto the constraints.
    fn settle(&self, y: &mut [f64]) {
        self.assembly.settle(y).expect("independent joints");
    }
}
