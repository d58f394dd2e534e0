//! Command `response`.

use super::{error, findings};
use crate::outputs::{Output, Outputs, Values};
use crate::subject::Subject;
use flexbody_base::error::Result;
use flexbody_body::invariants::{BodyFrame, FrameChoice};
use flexbody_linalg::context::Context;
use flexbody_motion::scene::Point;
use flexbody_study::response::{
    Band, Complex, Excitation, Function, Place, ResponseEnds, ResponseSettings, respond,
};

/// Damping ratio for a body without damping, which keeps responses at resonances finite.
const RATIO: f64 = 0.02;

/// Factor of the allowed difference: at a resonance with a damping ratio of 2 % the response differs by 50
/// times the difference of the frequency.
const STEEP: f64 = 50.0;

/// Returns the response at the tip to forces at a node.
pub fn response(subject: &Subject) -> Result<Outputs> {
    let (model, body) = (subject.model()?, subject.body()?);
    // The same band in every frame: in that of an interface the frequencies are others.
    let free = Subject { frame: FrameChoice::Mean(BodyFrame::Com), stored: false, ..subject.clone() };
    let hertz = free.body()?.frequencies_hz();
    let [first, third] = [hertz[0], hertz[hertz.len().min(3) - 1]];
    let settings = ResponseSettings {
        band: Band::new(0.3 * first, 1.2 * third).expect("a band"),
        points: 40,
        solves: 8,
        damping: Some(RATIO.into()),
        replaces_damping: true,
        tolerance: ResponseSettings::TOLERANCE,
    };
    let place = |point: &Point| vec![Place { point: point.clone(), directions: Vec::new() }];
    let [from, to] = [&subject.scene.watched[0], &Point::Interface("tip".to_owned())];
    let (from, to) = (Excitation::Forces(place(from)), place(to));
    let ends = ResponseEnds { from: &from, to: &to, rows: &[], densities: None };
    let response = respond(Some(&model), &body, &ends, &settings, &Context::QUIET)?;
    let mut outputs = Outputs { times: Vec::new(), all: findings(&[]) };
    for pair in &response.pairs {
        let norm = |of: &dyn Fn(&Function, usize) -> Option<Complex<f64>>| -> Vec<f64> {
            let at = |i: usize| {
                pair.functions
                    .iter()
                    .filter_map(|function| of(function, i))
                    .map(|h| h.norm_sqr())
                    .sum::<f64>()
                    .sqrt()
            };
            (0..response.frequencies.len()).map(at).collect()
        };
        for (name, values) in [
            ("response of the body", norm(&|function, i| Some(function.reduced[i]))),
            ("response of the model", norm(&|function, i| function.full[i])),
        ] {
            let output = error(name, Vec::new());
            outputs.all.push(Output {
                unit: [0, -1, 2],
                values: Values::Numbers(values),
                least: 0.0,
                slack: STEEP,
                ..output
            });
        }
        let errors = pair.errors.iter().flat_map(|errors| errors.worst).map(|at| at.value);
        outputs.all.push(error("errors of the response", errors.collect()));
    }
    Ok(outputs)
}
