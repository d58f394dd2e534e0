//! Frequency response of a body over a band, compared with that of its model.

use super::Complex;
use super::band::{Band, Frequency, Resonance};
use super::direct::{DirectSolution, DirectSolver};
use super::errors::{At, Compared, PairErrors};
use super::modal_sum::{ModalSum, NodalModes};
use super::place::{Direction, Place, PlaceRows};
use faer::Mat;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_base::units::UnitSystem;
use flexbody_body::basis::{CoupledModel, rigid_modes};
use flexbody_body::flex_body::FlexBody;
use flexbody_linalg::context::Context;
use flexbody_linalg::{gram, largest, parallel, side_by_side};
use flexbody_model::{DampingRatios, FeModel};
use flexbody_motion::scene::Requirements;
use nalgebra::{DMatrix, Matrix6, Vector3};
use std::borrow::Cow;

/// Largest deviation from one of the modal masses (and relative modal stiffnesses) of a body in its own model. It
/// allows for arrays of 32 bits; a larger deviation means another model.
const MODAL_MASS: f64 = 1e-4;

/// Settings of a frequency response.
#[derive(Debug, Clone, PartialEq)]
pub struct ResponseSettings {
    /// Frequency band.
    pub band: Band,
    /// Approximate number of frequencies of the curves.
    pub points: usize,
    /// Approximate number of frequencies at which the equations of all nodes are solved.
    pub solves: usize,
    /// Damping ratios of the modes; `None` to use those of the body.
    pub damping: Option<DampingRatios>,
    /// True if `damping` replaces the damping of the body. If false, a body with damping is refused.
    pub replaces_damping: bool,
    /// Largest relative error that is accepted.
    pub tolerance: f64,
}

impl ResponseSettings {
    /// Default number of frequencies of the curves: more are not visible in a plot.
    pub const POINTS: usize = 400;
    /// Default number of frequencies at which the equations are solved: enough for two dozen resonances.
    pub const SOLVES: usize = 80;
    /// Default tolerance of the relative error: less than half a decibel.
    pub const TOLERANCE: f64 = 0.05;
}

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
    /// Place of the forces.
    pub from: Place,
    /// Place of the displacements.
    pub to: Place,
    /// Transfer functions from every direction at the one place to every direction at the other.
    pub functions: Vec<Function>,
    /// Errors of the reduced response; `None` without a model.
    pub errors: Option<PairErrors>,
}

/// Transfer function: displacement per force, rotation per force, and so on, in the units of the body and radians.
#[derive(Debug, Clone, PartialEq)]
pub struct Function {
    /// Direction of the force or torque.
    pub from: Direction,
    /// Direction of the displacement or rotation.
    pub to: Direction,
    /// Response of the reduced body at every frequency.
    pub reduced: Vec<Complex<f64>>,
    /// Response of all nodes at every frequency; `None` where their equations were not solved.
    pub full: Vec<Option<Complex<f64>>>,
}

impl Function {
    /// Returns the kind of function: `displacement per force`, `rotation per torque`, and so on.
    pub fn kind(&self) -> &'static str {
        match (self.to.turns(), self.from.turns()) {
            (false, false) => "displacement per force",
            (false, true) => "displacement per torque",
            (true, false) => "rotation per force",
            (true, true) => "rotation per torque",
        }
    }
}

impl Response {
    /// Returns true if no error exceeds the tolerance, or if no error is known.
    pub fn holds(&self, tolerance: f64) -> bool {
        let errors = self.pairs.iter().filter_map(|pair| pair.errors.as_ref());
        errors.filter_map(|errors| errors.worst).all(|worst| worst.value <= tolerance)
    }
}

/// Computes the receptances of `body` between places over a band: displacements and rotations for unit forces and
/// torques, along the axes of the model, H(w) = L'(K + i w D - w^2 M)^-1 B. With the `model` that the body was made of,
/// the equations of all its nodes are also solved at some of the frequencies, with the damping of the body: D = M Psi C
/// Psi'M.
///
/// # Errors
/// [`PlaceUnknown`](Code::PlaceUnknown) for a place that the body does not have;
/// [`BodyIncomparable`](Code::BodyIncomparable) for a body of another model; failures of the solutions.
pub fn respond(
    model: Option<&FeModel>,
    body: &FlexBody,
    from: &[Place],
    to: &[Place],
    settings: &ResponseSettings,
    context: &Context<'_>,
) -> Result<Response> {
    // Frames: mean axes uncouple rigid motion from the modes; places refer to the centre of mass.
    let mean = body.in_mean_axes()?;
    let body = &*damped(&mean, settings)?;
    let at_centre = body.in_model_axes(body.invariants().first_moment() / body.invariants().mass())?;
    let rows =
        |places: &[Place]| places.iter().map(|place| place.rows(&at_centre)).collect::<Result<Vec<_>>>();
    let damping = Some(body.damping()).filter(|c| c.norm_max() > 0.0);
    let reduced = reduced_sum(&at_centre, &rows(from)?, &rows(to)?, damping.clone());
    let known = match model {
        Some(model) => Some(ModelResponse::new(model, body, [from, to], damping.as_ref(), context)?),
        None => None,
    };
    // Frequencies cluster at the resonances of the best sum at hand.
    let resonances =
        known.as_ref().and_then(|known| known.enriched.as_ref()).unwrap_or(&reduced).resonances();
    let resonances: Vec<Resonance> = resonances.map(|found| in_hertz(body.units(), found)).collect();
    let solves = if known.is_some() { settings.solves } else { 0 };
    let frequencies = settings.band.frequencies(settings.points, solves, &resonances);
    let blocks = blocks(from, to, body.dimension());
    // Evaluate the curves, then solve the equations of all nodes, also where the estimate is critical.
    let mut curves = Curves::new(&reduced, known.as_ref(), frequencies, body.units());
    if let Some(known) = &known {
        curves.solve_more(&blocks, settings.tolerance, solves.div_ceil(4));
        curves.solve(known, body.units(), context)?;
    }
    let [low, high] = settings.band.ends();
    let in_band = |f: &f64| *f >= low && *f <= high;
    Ok(Response {
        name: body.source().name.clone(),
        units: body.units().clone(),
        modes: body.n_modes(),
        damped: damping.is_some(),
        pairs: blocks.iter().map(|block| curves.pair(block, settings.tolerance)).collect(),
        body_modes_in_band: body.frequencies_hz().iter().filter(|f| in_band(f)).count(),
        solved: known.as_ref().map(|known| curves.solved(known, low)),
        coupling: known.as_ref().and_then(|known| curves.coupling_effect(known, &blocks, settings.tolerance)),
        frequencies: curves.frequencies.iter().map(|f| f.hertz).collect(),
    })
}

/// Returns the body with the damping ratios of the settings, if they state any.
fn damped<'b>(body: &'b FlexBody, settings: &ResponseSettings) -> Result<Cow<'b, FlexBody>> {
    let ResponseSettings { damping, replaces_damping, .. } = settings;
    let stated = Requirements {
        damping: damping.clone(),
        replaces_damping: *replaces_damping,
        ..Requirements::default()
    };
    stated.damped(body, "--damping or the scene")
}

fn in_hertz(units: &UnitSystem, (square, ratio): (f64, f64)) -> Resonance {
    Resonance { hertz: units.frequency_of(square), ratio }
}

/// Returns the response of a body in a frame along the axes of the model about its centre of mass: rigid motion of the
/// undeformed body plus the modes, to which rigid motion does not couple at rest.
fn reduced_sum(body: &FlexBody, from: &[PlaceRows], to: &[PlaceRows], damping: Option<Mat<f64>>) -> ModalSum {
    let joined = |rows: &[PlaceRows], part: fn(&PlaceRows) -> &Mat<f64>| {
        side_by_side(&rows.iter().map(|place| part(place).as_ref()).collect::<Vec<_>>())
    };
    let (forces, motions) = (joined(from, |place| &place.rigid), joined(to, |place| &place.rigid));
    let compliance = rigid_compliance(body);
    let rigid = Mat::from_fn(motions.ncols(), forces.ncols(), |o, i| {
        let row = |k: usize| (0..6).map(|l| compliance[(k, l)] * forces[(l, i)]).sum::<f64>();
        (0..6).map(|k| motions[(k, o)] * row(k)).sum()
    });
    ModalSum {
        stiffness: body.modes().eigenvalue.clone(),
        mass: vec![1.0; body.n_modes()],
        damping,
        inputs: joined(from, |place| &place.modal),
        outputs: joined(to, |place| &place.modal),
        rigid,
    }
}

/// Returns the accelerations of the undeformed body for unit forces and torques about its centre of mass; for a plane
/// body, those in the plane.
fn rigid_compliance(body: &FlexBody) -> Matrix6<f64> {
    let (mass, inertia) = (body.invariants().mass(), body.invariants().inertia());
    let mut compliance = Matrix6::zeros();
    if body.dimension() == 2 {
        compliance.set_diagonal(&nalgebra::Vector6::new(1.0, 1.0, 0.0, 0.0, 0.0, 0.0).unscale(mass));
        compliance[(5, 5)] = 1.0 / inertia[(2, 2)];
        return compliance;
    }
    compliance.fixed_view_mut::<3, 3>(0, 0).set_diagonal(&Vector3::repeat(1.0 / mass));
    if let Some(inverse) = inertia.try_inverse() {
        compliance.fixed_view_mut::<3, 3>(3, 3).copy_from(&inverse);
    }
    compliance
}

/// Model of the body, with the enriched response that estimates the error.
struct ModelResponse<'m> {
    nodal: NodalModes<'m>,
    /// Response with static responses added to the modes, which estimates the error; `None` if the modes leave no
    /// unbalanced force.
    enriched: Option<ModalSum>,
    damping: Option<Mat<f64>>,
    context: Context<'m>,
}

impl<'m> ModelResponse<'m> {
    fn new(
        model: &'m FeModel,
        body: &FlexBody,
        [from, to]: [&[Place]; 2],
        damping: Option<&Mat<f64>>,
        context: &Context<'m>,
    ) -> Result<Self> {
        context.phase("estimate of the error");
        let nodal = nodal_modes(model, body, from, to)?;
        let enriched = nodal.enriched(body, damping)?;
        Ok(Self { nodal, enriched, damping: damping.cloned(), context: *context })
    }

    /// Prepares the equations of all nodes of `model`, with the couplings of the body or without, for `solves`
    /// frequencies.
    fn direct_solver<'s>(&'s self, model: &'s CoupledModel<'_>, solves: usize) -> Result<DirectSolver<'s>> {
        let NodalModes { inertial, loads, measured, .. } = &self.nodal;
        let damping = self.damping.as_ref().map(|c| (inertial, c));
        DirectSolver::new(model, [loads, measured], damping, solves, &self.context)
    }

    /// Returns the model with deformable interfaces; `None` if no interface of the body is rigid.
    fn deforming(&self) -> Option<CoupledModel<'m>> {
        let coupled = &self.nodal.model;
        (!coupled.rigid_interfaces().is_empty()).then(|| CoupledModel::uncoupled(coupled.model()))
    }
}

/// Expresses the body in the rows of the model that it was made of, and refuses a body of another model.
fn nodal_modes<'m>(
    model: &'m FeModel,
    body: &FlexBody,
    from: &[Place],
    to: &[Place],
) -> Result<NodalModes<'m>> {
    let foreign = |why: &str| {
        let message = format!("the body was not made from this model: {why}");
        let help = "give the model that the body was converted from";
        Diagnostic::new(Code::BodyIncomparable, message).with_help(help)
    };
    let vectors = body.vectors_of(model).ok_or_else(|| foreign("its matrix rows differ"))?;
    let pencil = model.pencil();
    // Modes of this model have modal mass 1 and modal stiffness lambda.
    let (inertial, elastic) = (pencil.apply_mass(vectors.as_ref()), pencil.apply_stiffness(vectors.as_ref()));
    let mass = gram(vectors.as_ref(), inertial.as_ref());
    let eigenvalue = &body.modes().eigenvalue;
    let stiffness = gram(vectors.as_ref(), elastic.as_ref());
    let apart = largest(
        (0..eigenvalue.len())
            .flat_map(|j| [(mass[(j, j)] - 1.0).abs(), (stiffness[(j, j)] / eigenvalue[j] - 1.0).abs()]),
    );
    if apart.is_nan() || apart > MODAL_MASS {
        let why = format!("modal masses or stiffnesses of its modes differ by up to {apart:.1e}");
        return Err(foreign(&why).into());
    }
    let unit_loads = |places: &[Place]| -> Result<Mat<f64>> {
        let loads = places.iter().map(|place| place.loads(model)).collect::<Result<Vec<_>>>()?;
        Ok(side_by_side(&loads.iter().map(|load| load.as_ref()).collect::<Vec<_>>()))
    };
    Ok(NodalModes {
        model: body.coupled_model(model, vectors.as_ref()),
        rigid: rigid_modes(model, &pencil)?,
        vectors,
        inertial,
        elastic,
        loads: unit_loads(from)?,
        measured: unit_loads(to)?,
    })
}

/// Responses between all places at every frequency.
struct Curves {
    frequencies: Vec<Frequency>,
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
        units: &UnitSystem,
    ) -> Self {
        let omega = |f: &Frequency| units.eigenvalue_of(f.hertz).sqrt();
        let responses = |sum: &ModalSum| parallel::map(&frequencies, |f| sum.at(omega(f)));
        let own = responses(reduced);
        let enriched = match known {
            Some(known) => known.enriched.as_ref().map_or_else(|| own.clone(), responses),
            None => Vec::new(),
        };
        let [full, deforming] = [0; 2].map(|_| frequencies.iter().map(|_| None).collect());
        Self { frequencies, reduced: own, enriched, full, deforming, flops: 0.0 }
    }

    /// Marks for solution the frequencies where the estimated error of a block is largest and where it first exceeds
    /// the tolerance, at most `most` of them, so that reported errors are measured there.
    fn solve_more(&mut self, blocks: &[(&Place, &Place, Block)], tolerance: f64, most: usize) {
        let mut found = Vec::new();
        for errors in blocks.iter().filter_map(|(_, _, block)| self.errors(block, tolerance)) {
            let estimated = &errors.estimated;
            let first = estimated.iter().position(|error| *error > tolerance);
            let largest = (0..estimated.len()).filter(|&i| estimated[i].is_finite());
            found.extend(largest.max_by(|&a, &b| estimated[a].total_cmp(&estimated[b])));
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
            match solver.at(units.eigenvalue_of(frequency.hertz).sqrt()) {
                Ok(solution) => solutions[i] = Some(solution),
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
        blocks: &[(&Place, &Place, Block)],
        tolerance: f64,
    ) -> Option<CouplingEffect> {
        let interfaces = known.nodal.model.rigid_interfaces();
        if interfaces.is_empty() {
            return None;
        }
        let of_block = |(_, _, block): &(&Place, &Place, Block)| {
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
        let largest = blocks.iter().filter_map(of_block).max_by(|a, b| a.value.total_cmp(&b.value));
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

    fn pair(&self, (from, to, block): &(&Place, &Place, Block), tolerance: f64) -> Pair {
        Pair {
            from: (*from).clone(),
            to: (*to).clone(),
            functions: self.functions(block),
            errors: self.errors(block, tolerance),
        }
    }

    fn functions(&self, block: &Block) -> Vec<Function> {
        let mut functions = Vec::new();
        for &(column, from) in &block.columns {
            for &(row, to) in &block.rows {
                let entry = |s: &Option<DirectSolution>| s.as_ref().map(|s| s.response[(row, column)]);
                functions.push(Function {
                    from,
                    to,
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

/// Returns every place with its directions, which are numbered over all places.
fn numbered(places: &[Place], dimension: usize) -> impl Iterator<Item = (&Place, Vec<(usize, Direction)>)> {
    let mut next = 0;
    places.iter().map(move |place| {
        let directions = place.directions_of(dimension).into_iter();
        let numbered = directions.map(|direction| {
            next += 1;
            (next - 1, direction)
        });
        (place, numbered.collect())
    })
}

/// Returns the blocks from each place to each other. Forces and torques, displacements and rotations are in separate
/// blocks.
fn blocks<'p>(from: &'p [Place], to: &'p [Place], dimension: usize) -> Vec<(&'p Place, &'p Place, Block)> {
    let mut blocks = Vec::new();
    for (source, columns) in numbered(from, dimension) {
        for (target, rows) in numbered(to, dimension) {
            for turns in [(false, false), (false, true), (true, false), (true, true)] {
                let kind_alone = |all: &[(usize, Direction)], turns: bool| {
                    all.iter().copied().filter(|(_, d)| d.turns() == turns).collect::<Vec<_>>()
                };
                let block =
                    Block { columns: kind_alone(&columns, turns.0), rows: kind_alone(&rows, turns.1) };
                if !block.columns.is_empty() && !block.rows.is_empty() {
                    blocks.push((source, target, block));
                }
            }
        }
    }
    blocks
}

/// Rows and columns of a pair of places, with their directions.
struct Block {
    rows: Vec<(usize, Direction)>,
    columns: Vec<(usize, Direction)>,
}

impl Block {
    fn of(&self, response: &DMatrix<Complex<f64>>) -> DMatrix<Complex<f64>> {
        DMatrix::from_fn(self.rows.len(), self.columns.len(), |o, i| {
            response[(self.rows[o].0, self.columns[i].0)]
        })
    }
}
