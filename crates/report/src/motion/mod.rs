//! Reports of motions: simulations, frequency responses, recovered rows and their largest values.

mod envelope;
#[cfg(feature = "response")]
mod random;
mod recovered;
#[cfg(feature = "response")]
mod response;
mod simulation;

pub use envelope::{EnvelopeFacts, EnvelopeKind, read_envelope};
pub use recovered::{RecoveredFacts, channels_csv, recovered_csv};
#[cfg(feature = "response")]
pub use response::{ResponseFacts, response_csv};
pub use simulation::{SimulationFacts, simulation_csv};
