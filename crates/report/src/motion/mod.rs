//! Reports of motions: simulations, frequency responses, recovered rows and their largest values.

mod envelope;
mod random;
mod recovered;
mod response;
mod simulation;

pub use envelope::{EnvelopeFacts, EnvelopeKind, read_envelope};
pub use recovered::{RecoveredFacts, channels_csv, recovered_csv};
pub use response::{ResponseFacts, response_csv};
pub use simulation::{SimulationFacts, simulation_csv};
