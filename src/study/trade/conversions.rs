//! Bodies that the settings of a conversion make of one model.

use super::Source;
use crate::base::diagnostic::{Code, Diagnostic};
use crate::base::error::Result;
use crate::base::progress::Watch;
use crate::body::basis::{BasisChoice, FreeSurface, Loads, ModeSettings};
use crate::body::convert::{ConvertSettings, Lumping, convert};
use crate::model::FeModel;
use crate::numerics::eigen::{Accuracy, Wanted};
use std::time::Instant;

/// Every conversion of a study, the reference first, and what was said about that.
///
/// The reference has twice as many `modes` and residual vectors of spin and interfaces. Beside it stand `modes`, their half and their
/// quarter with residual vectors and without, and `modes` at the other levels of accuracy. Each is timed.
///
/// # Errors
/// Those of [`convert`]. Accuracy `certified` is left out where it does not cover the model.
pub fn conversions(
    model: &FeModel,
    modes: usize,
    memory: Option<u64>,
    longest: Option<f64>,
    watch: Watch<'_>,
) -> Result<(Vec<Source>, Vec<Diagnostic>)> {
    let mut loads = vec![Loads::Centrifugal];
    if !model.interfaces().is_empty() {
        loads.push(Loads::Interfaces);
    }
    let made = |count: usize,
                residual: bool,
                accuracy: Accuracy,
                lumped: Vec<Lumping>|
     -> Result<(Source, Vec<Diagnostic>)> {
        let residual_vectors = if residual { loads.clone() } else { Vec::new() };
        let settings = ConvertSettings {
            modes: ModeSettings {
                wanted: Wanted::Lowest(count),
                accuracy,
                memory,
                longest,
                ..ModeSettings::default()
            },
            basis: BasisChoice::Free(FreeSurface { residual_vectors }),
            lumped,
            ..ConvertSettings::default()
        };
        let start = Instant::now();
        let conversion = convert(model, &settings, watch)?;
        let seconds = start.elapsed().as_secs_f64();
        let mut name = format!("{count} free mode{}", if count == 1 { "" } else { "s" });
        if residual {
            name.push_str(", residual vectors");
        }
        if accuracy != Accuracy::Standard {
            name.push_str(&format!(", {}", accuracy.name()));
        }
        Ok((Source::new(name, conversion.body, Some(seconds))?, conversion.diagnostics))
    };
    let lumped = ConvertSettings::default().lumped;
    let (reference, diagnostics) = made(modes.saturating_mul(2), true, Accuracy::Standard, lumped)?;
    let mut wanted = vec![(modes, false, Accuracy::Fast), (modes, false, Accuracy::Certified)];
    for part in [1, 2, 4] {
        let count = (modes / part).max(1);
        wanted.extend([true, false].map(|residual| (count, residual, Accuracy::Standard)));
    }
    let mut sources = vec![reference];
    for (at, &(count, residual, accuracy)) in wanted.iter().enumerate() {
        if wanted[..at].contains(&(count, residual, accuracy)) {
            continue;
        }
        let source = match made(count, residual, accuracy, Vec::new()) {
            Ok((source, _)) => source,
            Err(error) if accuracy == Accuracy::Certified && error.diagnostics()[0].code() == Code::Usage => {
                continue;
            }
            Err(error) => return Err(error),
        };
        let beside = source.beside(sources[0].body(), model);
        sources.push(beside.expect("bodies that were made of the model"));
    }
    Ok((sources, diagnostics))
}
