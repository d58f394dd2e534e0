//! Frequency response of a body over a band, compared with that of its model.

use super::Complex;
use super::band::Frequency;
use super::densities::SpectralDensities;
use super::direct::{DirectSolution, DirectSolver};
use super::ends::{BaseMotion, Output, ResponseEnds, Target};
use super::errors::{At, Compared, PairErrors};
use super::framed_body::{FramedBody, Read, numbered, reduced_sum};
use super::modal_sum::ModalSum;
use super::model_response::ModelResponse;
use super::place::{Direction, Place};
use super::random::{RandomResponse, RandomStudy, input_names};
use super::settings::ResponseSettings;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_base::units::UnitSystem;
use flexbody_body::flex_body::FlexBody;
use flexbody_linalg::context::Context;
use flexbody_linalg::parallel;
use flexbody_linalg::ties::first_largest;
use flexbody_model::FeModel;
use nalgebra::DMatrix;

/// Transfer functions over a band.
#[derive(Debug, Clone, PartialEq)]
pub struct Response {
    /// Name of the body.
    pub name: String,
    /// Units of body and model.
    pub units: UnitSystem,
    /// Number of modes of the body.
    pub modes: usize,
    /// True if the modes are damped.
    pub damped: bool,
    /// True if the excitation is the acceleration of an interface.
    pub by_base: bool,
    /// Frequencies in hertz, ascending.
    pub frequencies: Vec<f64>,
    /// Pairs of a loaded and a measured place.
    pub pairs: Vec<Pair>,
    /// Number of natural frequencies of the body in the band.
    pub body_modes_in_band: usize,
    /// Work on the equations of all nodes; `None` without a model, and then no error is known.
    pub solved: Option<Solved>,
    /// Effect of the rigid interfaces of the body; the compared model has these interfaces too. `None` without rigid
    /// interfaces.
    pub coupling: Option<CouplingEffect>,
    /// Root mean squares under random excitation; `None` without spectral densities.
    pub random: Option<RandomResponse>,
    /// Warning about the modes of a body alone that leave out much of the deformation which the acceleration of its base
    /// causes; with a model the error is measured.
    pub diagnostics: Vec<Diagnostic>,
}

/// Effect of rigid interfaces on a frequency response.
#[derive(Debug, Clone, PartialEq)]
pub struct CouplingEffect {
    /// Names of the interfaces that no mode of the body deforms.
    pub interfaces: Vec<String>,
    /// Largest relative difference between the model under the coupling and the model with deformable interfaces, over
    /// all pairs; `None` if no frequency could be solved for both.
    pub largest: Option<At>,
}

/// Work on the equations of all nodes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Solved {
    /// Number of rows of the matrices.
    pub rows: usize,
    /// Number of frequencies at which the equations were solved.
    pub solves: usize,
    /// Multiplications and additions of one factorisation.
    pub flops: f64,
    /// Number of flexible natural frequencies of the model in the band, from the signs of the pivots at its ends.
    pub modes_in_band: usize,
}

/// Transfer functions from one place to another.
#[derive(Debug, Clone, PartialEq)]
pub struct Pair {
    /// Place of the forces or accelerations.
    pub from: Place,
    /// Place of the displacements, or a recovery.
    pub to: Target,
    /// Transfer functions from every direction at the one place to every direction or row at the other.
    pub functions: Vec<Function>,
    /// Errors of the reduced response; `None` without a model.
    pub errors: Option<PairErrors>,
}

/// Transfer function: displacement per force, rotation per force, and so on, in the units of the body and radians; rows of
/// recoveries in their units.
#[derive(Debug, Clone, PartialEq)]
pub struct Function {
    /// Direction of the force or torque, or of the acceleration.
    pub from: Direction,
    /// Direction of the displacement or rotation, or the row of a recovery.
    pub to: Output,
    /// Response of the reduced body at every frequency.
    pub reduced: Vec<Complex<f64>>,
    /// Response of all nodes at every frequency; `None` where their equations were not solved.
    pub full: Vec<Option<Complex<f64>>>,
}

impl Function {
    /// Returns the kind of function: `displacement per force`, `row per angular acceleration`, and so on.
    ///
    /// * `by_base`: true if the excitation is an acceleration.
    pub fn kind(&self, by_base: bool) -> String {
        let read = match &self.to {
            Output::Direction(direction) if direction.turns() => "rotation",
            Output::Direction(_) => "displacement",
            Output::Row(_) => "row",
        };
        let excited = match (by_base, self.from.turns()) {
            (false, false) => "force",
            (false, true) => "torque",
            (true, false) => "acceleration",
            (true, true) => "angular acceleration",
        };
        format!("{read} per {excited}")
    }
}

impl Response {
    /// Returns true if no error exceeds the tolerance, or if no error is known.
    pub fn holds(&self, tolerance: f64) -> bool {
        let errors = self.pairs.iter().filter_map(|pair| pair.errors.as_ref());
        let of_pairs = errors.filter_map(|errors| errors.worst).all(|worst| worst.value <= tolerance);
        of_pairs && self.random.as_ref().is_none_or(|random| random.worst_error() <= tolerance)
    }
}

/// Computes the transfer functions of `body` over a band: displacements, rotations and rows of recoveries for unit forces
/// and torques, along the axes of the model, H(w) = L'(K + i w D - w^2 M)^-1 B. With the `model` that the body was made of,
/// the equations of all its nodes are also solved at some of the frequencies, with the damping of the body: D = M Psi C
/// Psi'M. For a base, the forces are those that move the interface as prescribed: H (-w^2 H_a)^-1 with the response H_a of
/// the interface.
///
/// # Errors
/// [`PlaceUnknown`](Code::PlaceUnknown) for a place or row that the body does not have;
/// [`BodyIncomparable`](Code::BodyIncomparable) for a body of another model; failures of the solutions.
pub fn respond(
    model: Option<&FeModel>,
    body: &FlexBody,
    ends: &ResponseEnds<'_>,
    settings: &ResponseSettings,
    context: &Context<'_>,
) -> Result<Response> {
    let framed = FramedBody::new(body, settings, ends.from)?;
    let (body, dimension) = (&framed.damped, body.dimension());
    let read = Read::new(&framed.at_centre, ends)?;
    let damping = framed.damping();
    let reduced = reduced_sum(&framed.at_centre, &read, damping.clone(), framed.lag)?;
    let known = match model {
        Some(model) => Some(ModelResponse::new(model, &framed, &read, damping.as_ref(), context)?),
        None => None,
    };
    // Frequencies cluster at the resonances of the best sum at hand.
    let best = known.as_ref().and_then(|known| known.enriched.as_ref()).unwrap_or(&reduced);
    let resonances = framed.resonances(best);
    let solves = if known.is_some() { settings.solves } else { 0 };
    let frequencies = settings.band.frequencies(settings.points, solves, &resonances);
    let blocks = blocks(ends, &read, dimension);
    // Evaluate the curves, then solve the equations of all nodes, also where the estimate is critical.
    let mut curves = Curves::new(&reduced, known.as_ref(), frequencies, read.base.clone(), body.units());
    if let Some(known) = &known {
        curves.solve_more(&blocks, settings.tolerance, solves.div_ceil(4));
        curves.solve(known, body.units(), context)?;
    }
    let random = match ends.densities {
        None => None,
        Some(path) => {
            context.phase("random vibration");
            let inputs = input_names(ends.from.places(), dimension);
            let densities = &SpectralDensities::read(path, &inputs)?;
            let band = settings.band;
            let (known, resonances) = (known.as_ref(), &resonances[..]);
            let (framed, read, reduced) = (&framed, &read, &reduced);
            let study = RandomStudy { framed, read, reduced, known, densities, inputs, band, resonances };
            Some(study.run()?)
        }
    };
    let [low, high] = settings.band.ends();
    let in_band = |f: &f64| *f >= low && *f <= high;
    let diagnostics =
        if model.is_none() { framed.unresolved.clone().into_iter().collect() } else { Vec::new() };
    Ok(Response {
        random,
        diagnostics,
        name: body.description().name.clone(),
        units: body.units().clone(),
        modes: body.n_modes(),
        damped: damping.is_some(),
        by_base: read.base.is_some(),
        pairs: blocks.iter().map(|block| curves.pair(block, settings.tolerance)).collect(),
        body_modes_in_band: body.frequencies_hz().iter().filter(|f| in_band(f)).count(),
        solved: known.as_ref().map(|known| curves.solved(known, low)),
        coupling: known.as_ref().and_then(|known| curves.coupling_effect(known, &blocks, settings.tolerance)),
        frequencies: curves.frequencies.iter().map(|f| f.hertz).collect(),
    })
}

/// Responses between all places at every frequency.
struct Curves {
    frequencies: Vec<Frequency>,
    base: Option<BaseMotion>,
    reduced: Vec<DMatrix<Complex<f64>>>,
    /// Enriched responses; empty without a model.
    enriched: Vec<DMatrix<Complex<f64>>>,
    full: Vec<Option<DirectSolution>>,
    /// Solutions of the model with deformable interfaces; all `None` if no interface of the body is rigid.
    deforming: Vec<Option<DirectSolution>>,
    flops: f64,
}

impl Curves {
    /// Evaluates the modal responses; the equations of all nodes are not solved here.
    fn new(
        reduced: &ModalSum,
        known: Option<&ModelResponse<'_>>,
        frequencies: Vec<Frequency>,
        base: Option<BaseMotion>,
        units: &UnitSystem,
    ) -> Self {
        let response = |sum: &ModalSum, f: &Frequency| {
            let omega = units.eigenvalue_of(f.hertz).sqrt();
            applied(base.as_ref(), omega, sum.at(omega))
        };
        let responses = |sum: &ModalSum| parallel::map(&frequencies, |f| response(sum, f));
        let own = responses(reduced);
        let enriched = match known {
            Some(known) => known.enriched.as_ref().map_or_else(|| own.clone(), responses),
            None => Vec::new(),
        };
        let [full, deforming] = [0; 2].map(|_| frequencies.iter().map(|_| None).collect());
        Self { frequencies, base, reduced: own, enriched, full, deforming, flops: 0.0 }
    }

    /// Marks for solution the frequencies where the estimated error of a block is largest and where it first exceeds
    /// the tolerance, at most `most` of them, so that reported errors are measured there.
    fn solve_more(&mut self, blocks: &[(&Place, Target, Block)], tolerance: f64, most: usize) {
        let mut found = Vec::new();
        for errors in blocks.iter().filter_map(|(_, _, block)| self.errors(block, tolerance)) {
            let estimated = &errors.estimated;
            let first = estimated.iter().position(|error| *error > tolerance);
            let largest = (0..estimated.len()).filter(|&i| estimated[i].is_finite());
            found.extend(first_largest(largest, |&i| estimated[i]));
            found.extend(first);
        }
        let mut marked = 0;
        for i in found {
            if marked < most && !self.frequencies[i].solved {
                self.frequencies[i].solved = true;
                marked += 1;
            }
        }
    }

    /// Solves the equations of all nodes, with the couplings of the body and, if these make an interface rigid,
    /// without.
    fn solve(&mut self, known: &ModelResponse<'_>, units: &UnitSystem, context: &Context<'_>) -> Result<()> {
        context.phase("equations of all nodes");
        let deforming = known.deforming();
        let studies = if deforming.is_some() { 2 } else { 1 };
        let count = studies * self.frequencies.iter().filter(|f| f.solved).count();
        let solver = known.direct_solver(&known.nodal.model, count)?;
        self.flops = solver.flops();
        let part = |from: f64| move |done: f64| context.fraction((from + done) / studies as f64);
        self.full = self.solutions(&solver, units, &part(0.0))?;
        if let Some(model) = &deforming {
            context.phase("equations of all nodes, interfaces that deform");
            self.deforming = self.solutions(&known.direct_solver(model, count)?, units, &part(1.0))?;
        }
        Ok(())
    }

    /// Returns the solutions at the marked frequencies. A solution that is too inaccurate, near a natural frequency, is
    /// left out. If all are, the error is returned.
    ///
    /// * `done`: called with the completed part, from 0 to 1.
    fn solutions(
        &self,
        solver: &DirectSolver<'_>,
        units: &UnitSystem,
        done: &dyn Fn(f64),
    ) -> Result<Vec<Option<DirectSolution>>> {
        let mut solutions: Vec<Option<DirectSolution>> = self.frequencies.iter().map(|_| None).collect();
        let (count, mut failed) = (self.frequencies.len() as f64, None);
        for (i, frequency) in self.frequencies.iter().enumerate().filter(|(_, f)| f.solved) {
            let omega = units.eigenvalue_of(frequency.hertz).sqrt();
            match solver.at(omega) {
                Ok(DirectSolution { response, modes_below }) => {
                    let response = applied(self.base.as_ref(), omega, response);
                    solutions[i] = Some(DirectSolution { response, modes_below });
                }
                Err(error) if error.has(Code::FactorizationFailed) => failed = Some(error),
                Err(error) => return Err(error),
            }
            done((i + 1) as f64 / count);
        }
        match failed {
            Some(error) if solutions.iter().all(Option::is_none) => Err(error),
            _ => Ok(solutions),
        }
    }

    /// Returns the difference between the model under the couplings of the body and the model with deformable
    /// interfaces.
    fn coupling_effect(
        &self,
        known: &ModelResponse<'_>,
        blocks: &[(&Place, Target, Block)],
        tolerance: f64,
    ) -> Option<CouplingEffect> {
        let interfaces = known.nodal.model.rigid_interfaces();
        if interfaces.is_empty() {
            return None;
        }
        let of_block = |(_, _, block): &(&Place, Target, Block)| {
            // Frequencies that were solved for both models.
            let both = self.full.iter().zip(&self.deforming).enumerate();
            let both: Vec<_> = both
                .filter_map(|(i, (coupled, deforming))| {
                    let [coupled, deforming] = [coupled.as_ref()?, deforming.as_ref()?];
                    Some((
                        self.frequencies[i].hertz,
                        block.of(&coupled.response),
                        block.of(&deforming.response),
                    ))
                })
                .collect();
            let compared: Vec<Compared<'_>> = both
                .iter()
                .map(|(hertz, coupled, deforming)| Compared {
                    hertz: *hertz,
                    reduced: coupled,
                    enriched: coupled,
                    full: Some(deforming),
                })
                .collect();
            PairErrors::new(&compared, tolerance).largest
        };
        let largest = first_largest(blocks.iter().filter_map(of_block), |one| one.value);
        Some(CouplingEffect { interfaces, largest })
    }

    fn solved(&self, known: &ModelResponse<'_>, low: f64) -> Solved {
        let mut below = self.full.iter().flatten().map(|solution| solution.modes_below);
        let first = below.next().unwrap_or(0);
        let last = below.next_back().unwrap_or(first);
        Solved {
            rows: known.nodal.model.pencil().n(),
            solves: self.full.iter().flatten().count(),
            flops: self.flops,
            // Modes below the low end of the band are not in the band.
            modes_in_band: if low > 0.0 { last.saturating_sub(first) } else { last },
        }
    }

    fn pair(&self, (from, to, block): &(&Place, Target, Block), tolerance: f64) -> Pair {
        Pair {
            from: (*from).clone(),
            to: to.clone(),
            functions: self.functions(block),
            errors: self.errors(block, tolerance),
        }
    }

    fn functions(&self, block: &Block) -> Vec<Function> {
        let mut functions = Vec::new();
        for &(column, from) in &block.columns {
            for (row, to) in &block.rows {
                let row = *row;
                let entry = |s: &Option<DirectSolution>| s.as_ref().map(|s| s.response[(row, column)]);
                functions.push(Function {
                    from,
                    to: to.clone(),
                    reduced: self.reduced.iter().map(|h| h[(row, column)]).collect(),
                    full: self.full.iter().map(entry).collect(),
                });
            }
        }
        functions
    }

    fn errors(&self, block: &Block, tolerance: f64) -> Option<PairErrors> {
        if self.enriched.is_empty() {
            return None;
        }
        let blocks = |all: &[DMatrix<Complex<f64>>]| all.iter().map(|h| block.of(h)).collect::<Vec<_>>();
        let (reduced, enriched) = (blocks(&self.reduced), blocks(&self.enriched));
        let full: Vec<_> = self.full.iter().map(|s| s.as_ref().map(|s| block.of(&s.response))).collect();
        let compared: Vec<Compared<'_>> = (0..reduced.len())
            .map(|i| Compared {
                hertz: self.frequencies[i].hertz,
                reduced: &reduced[i],
                enriched: &enriched[i],
                full: full[i].as_ref(),
            })
            .collect();
        Some(PairErrors::new(&compared, tolerance))
    }
}

/// Returns the blocks from each place to each other and to each recovery. Forces and torques, displacements and rotations
/// are in separate blocks.
fn blocks<'p>(ends: &ResponseEnds<'p>, read: &Read<'_>, dimension: usize) -> Vec<(&'p Place, Target, Block)> {
    // Outputs of every target, numbered over all: places, the moving interface, recoveries.
    let mut targets: Vec<(Target, Vec<(usize, Output)>)> = Vec::new();
    for (place, directions) in numbered(&read.to, dimension).take(ends.to.len()) {
        for turns in [false, true] {
            let of_kind = directions.iter().filter(|(_, direction)| direction.turns() == turns);
            let outputs = of_kind.map(|(at, direction)| (*at, Output::Direction(*direction))).collect();
            targets.push((Target::Place(place.clone()), outputs));
        }
    }
    let mut next: usize = read.to.iter().map(|place| place.directions_of(dimension).len()).sum();
    for one in &read.rows {
        let outputs =
            one.labels().enumerate().map(|(at, row)| (next + at, Output::Row(row.clone()))).collect();
        next += one.rows.len();
        targets.push((Target::Recovery(one.recovery.name.clone()), outputs));
    }
    let mut blocks = Vec::new();
    for (source, columns) in numbered(ends.from.places(), dimension) {
        for turns in [false, true] {
            let columns: Vec<_> = columns.iter().copied().filter(|(_, d)| d.turns() == turns).collect();
            for (target, rows) in targets.iter().filter(|(_, rows)| !columns.is_empty() && !rows.is_empty()) {
                let block = Block { columns: columns.clone(), rows: rows.clone() };
                blocks.push((source, target.clone(), block));
            }
        }
    }
    blocks
}

/// Returns the response to accelerations of a moving interface, or the response to forces as it is.
fn applied(base: Option<&BaseMotion>, omega: f64, response: DMatrix<Complex<f64>>) -> DMatrix<Complex<f64>> {
    match base {
        Some(base) => base.applied(omega, &response),
        None => response,
    }
}

/// Rows and columns of a pair of places, with their directions.
struct Block {
    rows: Vec<(usize, Output)>,
    columns: Vec<(usize, Direction)>,
}

impl Block {
    fn of(&self, response: &DMatrix<Complex<f64>>) -> DMatrix<Complex<f64>> {
        DMatrix::from_fn(self.rows.len(), self.columns.len(), |o, i| {
            response[(self.rows[o].0, self.columns[i].0)]
        })
    }
}
