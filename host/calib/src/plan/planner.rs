//! From shells to a plan: every shell by itself, on all cores; then the choice of poses, the tours and the moves between shells.

use std::sync::{Mutex, PoisonError};

use ballbar::{JointVector, Measurement, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use thiserror::Error;

use super::cause::Cause;
use super::cell::{Cell, Margins, Pace};
use super::choice::{in_one_piece, most_telling};
use super::cores::on_all_cores;
use super::fixtures::FixturesOverlap;
use super::grid::Grid;
use super::growth::{FAMILIES, Wanted, families};
use super::optimal::d_optimal;
use super::posture::{Hindrance, Shell};
use super::progress::{Ongoing, Stage, Tell};
use super::quality::{Expectation, Quality, Unfit};
use super::shell::{ShellRoads, Stop, TOURS};
use super::transfer;
use crate::model::{Bar, Dataset, PairingId, PoseRow, Rig, Robot};
use crate::plan::{BarAt, PlanRow, RowKind, RowMargins};
use crate::units::{mm_from_m, tidy};

/// What to plan.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct PlanOptions {
    /// Pairings, in the order in which they are measured.
    pub pairings: Vec<PairingId>,
    /// The bar's lengths at mid travel, metres; all pairings are measured with one before the next.
    pub bars_m: Vec<f64>,
    /// The bar's travel from end to end, metres.
    pub travel_m: f64,
    /// Points of each shell.
    pub grid: Grid,
    /// Poses of each shell: where part of the grid cannot be measured, longitudes between the others make up for it.
    pub poses_per_shell: usize,
    /// Choose so many poses, those that identify best, instead of all points.
    pub optimal: Option<usize>,
    /// What has to be left.
    pub margins: Margins,
    /// How fast the robot goes.
    pub pace: Pace,
    /// The same seed gives the same plan.
    pub seed: u64,
}

impl PlanOptions {
    /// So many poses on each shell (90 are usual), for each of the bar's lengths, with the usual latitudes of 15° to 75°, margins and pace.
    /// `pairings` are of the rig that is planned for ([`Rig::all_pairings`]); what is to be otherwise is set in its field.
    pub fn new(pairings: Vec<PairingId>, bar: &Bar, poses_per_shell: usize) -> Self {
        const LATITUDES_DEG: [f64; 5] = [15.0, 30.0, 45.0, 60.0, 75.0];
        Self {
            pairings,
            bars_m: bar.lengths_m.clone(),
            travel_m: bar.travel_m,
            grid: Grid::of(&LATITUDES_DEG, poses_per_shell),
            poses_per_shell,
            optimal: None,
            margins: Margins::default(),
            pace: Pace::default(),
            seed: 0,
        }
    }
}

/// Why there is no plan.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum PlanError {
    /// The rig cannot be as it is described.
    #[error(transparent)]
    Overlap(#[from] FixturesOverlap),
    /// No point of a shell can be measured.
    #[error("pairing {pairing}, bar {bar_mm} mm: none of {points} points can be measured: {}", counted(.hindrances))]
    OutOfReach {
        /// `chuck:sphere`.
        pairing: String,
        /// Radius of the shell, millimetres.
        bar_mm: f64,
        /// Points tried.
        points: usize,
        /// What hindered, with counts.
        hindrances: Vec<(Hindrance, usize)>,
        /// Most of it.
        cause: Cause,
    },
    /// More poses are to be chosen than there are.
    #[error("{wanted} poses wanted: only {found} poses were found to choose from")]
    TooFewToChoose {
        /// Poses asked for.
        wanted: usize,
        /// Poses found.
        found: usize,
    },
    /// Fewer poses are to be chosen than there are parameters.
    #[error("{wanted} poses wanted: these pairings tell {parameters} parameters, expected more poses than parameters")]
    FewerThanParameters {
        /// Poses asked for.
        wanted: usize,
        /// Parameters that can be told.
        parameters: usize,
    },
}

/// Each with its count.
fn counted(hindrances: &[(Hindrance, usize)]) -> String {
    hindrances.iter().map(|(hindrance, count)| format!("{hindrance} {count}")).collect::<Vec<_>>().join(", ")
}

/// One shell of a plan.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ShellSummary {
    /// Which chuck and sphere.
    pub pairing: PairingId,
    /// Length of the bar at mid travel, metres.
    pub bar_m: f64,
    /// Points of the grid, and of those between.
    pub points: usize,
    /// Points for which a posture and a way to it were found.
    pub reached: usize,
    /// Poses that the plan measures.
    pub measured: usize,
    /// Via points while the bar is attached.
    pub vias: usize,
    /// Why the other points were not reached, and how many.
    pub hindrances: Vec<(Hindrance, usize)>,
    /// Moving and standing still, seconds.
    pub duration_s: f64,
    /// The arm gets to the shell's first pose, without the bar, by ways that were found clear.
    pub is_approach_clear: bool,
}

/// Chosen poses beside the latitude-longitude grid.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Comparison {
    /// Poses to choose from.
    pub pool: usize,
    /// The chosen ones.
    pub chosen: Quality,
    /// As many of the grid, evenly taken; `None` when they do not tell all parameters.
    pub grid_of_same_size: Option<Quality>,
    /// The whole grid.
    pub grid: Option<Quality>,
}

/// Poses and via points in order.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Plan {
    /// The rows; the robot goes from each to the next by joint interpolation.
    pub rows: Vec<PlanRow>,
    /// The shells, in order.
    pub shells: Vec<ShellSummary>,
    /// What the measured poses will tell.
    pub expectation: Expectation,
    /// How well; `None` when there is nothing to tell.
    pub quality: Option<Quality>,
    /// Why a fit to them could not be trusted.
    pub unfit: Option<Unfit>,
    /// Of a choice of poses.
    pub comparison: Option<Comparison>,
    /// From the first row to the last, standing still included, attaching the bar not; seconds.
    pub duration_s: f64,
    /// Whether branches of the inverse kinematics came from a closed form.
    pub is_closed_form: bool,
}

impl Plan {
    /// The poses to measure, as if each had been measured without an error.
    pub fn as_dataset(&self, rig: &Rig) -> Dataset {
        let measured = self.rows.iter().filter(|row| row.kind == RowKind::Measure);
        let pose = |(i, row): (usize, &PlanRow)| {
            let measurement = Measurement::new(rig.pairing(row.pairing), row.q, row.bar.map_or(row.bar_m, |bar| bar.length_m));
            let number = i + 1;
            PoseRow { bar_m: Some(row.bar_m), line: number, number, ..PoseRow::of(row.pairing, measurement) }
        };
        Dataset { rows: measured.enumerate().map(pose).collect(), files: vec!["plan".to_owned()] }
    }
}

/// Plans, and tells of all stages but that of [`super::check()`].
///
/// ```
/// use ballbar_calib::designs;
/// use ballbar_calib::model::PairingId;
/// use ballbar_calib::plan::{Cell, CheckedPlan, PlanOptions, plan};
///
/// let (robot, rig) = (designs::puma560(), designs::triangles());
/// let bar = rig.bar.as_ref().ok_or("no bar")?;
/// let pairings = vec![PairingId { chuck: 0, sphere: 0 }];
/// let options = PlanOptions { bars_m: vec![0.46], ..PlanOptions::new(pairings, bar, 10) };
/// let plan = plan(&robot, &rig, &options, &|_| ())?;
/// assert!(plan.shells[0].measured > 5);
///
/// // What moves a robot takes a plan that was looked at in fine steps.
/// let cell = Cell::new(&robot, &rig, options.travel_m, options.margins, options.pace)?;
/// let checked = CheckedPlan::new(&cell, &plan.rows)?;
/// assert_eq!(checked.rows().len(), plan.rows.len());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`PlanError`] when fixtures overlap, a shell cannot be reached, or `optimal` asks for what cannot be.
///
/// # Panics
/// When a pairing is none of the rig's.
pub fn plan(robot: &Robot, rig: &Rig, options: &PlanOptions, tell: &Tell<'_>) -> Result<Plan, PlanError> {
    let cell = Cell::new(robot, rig, options.travel_m, options.margins, options.pace)?;
    let mut roads = all_roads(&cell, options, tell);
    for road in &roads {
        if road.nodes.is_empty() {
            return Err(out_of_reach(&cell, road));
        }
    }
    let grid: Vec<Vec<usize>> = roads.iter().map(ShellRoads::one_per_crossing).collect();
    let choosing = Ongoing::begin(Stage::Choice, 1, tell);
    let (chosen, comparison) = match options.optimal {
        Some(wanted) => {
            let (chosen, comparison) = choose(&cell, &roads, &grid, wanted)?;
            (chosen, Some(comparison))
        }
        None => (grid.clone(), None),
    };
    choosing.tick(1);
    let tours = all_tours(&cell, &mut roads, &chosen, tell);

    let mut plan = assemble(&cell, &roads, &grid, tours, options.seed, tell);
    plan.comparison = comparison;
    Ok(plan)
}

fn all_roads(cell: &Cell<'_>, options: &PlanOptions, tell: &Tell<'_>) -> Vec<ShellRoads> {
    /// Postures at each point, for a choice to have a choice.
    const CHOICES_PER_CROSSING: usize = 3;
    let per_crossing = if options.optimal.is_some() { CHOICES_PER_CROSSING } else { 1 };
    let wanted = Wanted { crossings: options.poses_per_shell, per_crossing };
    let bars = options.bars_m.iter();
    let shells: Vec<Shell> = bars
        .flat_map(|&bar_m| options.pairings.iter().map(move |&id| (bar_m, id)))
        .map(|(bar_m, id)| Shell { id, pairing: cell.rig.pairing(id), bar_m })
        .collect();
    let ticks = FAMILIES * options.grid.crossings().len();
    let progress = Ongoing::begin(Stage::Postures, shells.len() * ticks, tell);
    let all = on_all_cores(shells.len(), |i| {
        let mut rng = ChaCha8Rng::seed_from_u64(options.seed);
        rng.set_stream(i as u64);
        families(cell, shells[i], &options.grid, wanted, &mut rng, &progress.part(ticks))
    });
    most_telling(cell.chain().parameter_count(), in_one_piece(cell, all, options.seed, tell))
}

fn all_tours(cell: &Cell<'_>, roads: &mut [ShellRoads], chosen: &[Vec<usize>], tell: &Tell<'_>) -> Vec<Vec<Stop>> {
    let progress = Ongoing::begin(Stage::Tours, roads.len() * TOURS, tell);
    let each: Vec<Mutex<&mut ShellRoads>> = roads.iter_mut().map(Mutex::new).collect();
    on_all_cores(each.len(), |i| {
        let mut road = each[i].lock().unwrap_or_else(PoisonError::into_inner);
        road.tour(cell, &chosen[i], &progress.part(TOURS))
    })
}

fn out_of_reach(cell: &Cell<'_>, road: &ShellRoads) -> PlanError {
    PlanError::OutOfReach {
        pairing: cell.rig.pairing_name(road.shell.id),
        bar_mm: tidy(mm_from_m(road.shell.bar_m)),
        points: road.crossings.len(),
        hindrances: road.hindrance_counts(),
        cause: Cause::of(cell, road),
    }
}

/// D-optimal nodes of each shell, and how they compare with the grid's.
fn choose(
    cell: &Cell<'_>,
    roads: &[ShellRoads],
    grid: &[Vec<usize>],
    wanted: usize,
) -> Result<(Vec<Vec<usize>>, Comparison), PlanError> {
    let is_measurable = |&(shell, node): &(usize, usize)| roads[shell].nodes[node].crossing.is_some();
    let nodes = roads.iter().enumerate().flat_map(|(shell, road)| (0..road.nodes.len()).map(move |node| (shell, node)));
    let pool: Vec<(usize, usize)> = nodes.filter(is_measurable).collect();
    if wanted > pool.len() {
        return Err(PlanError::TooFewToChoose { wanted, found: pool.len() });
    }
    let (chain, limits) = (cell.chain(), &cell.robot.limits);
    let measured = |nodes: &[(usize, usize)]| -> Vec<Measurement<f64>> {
        nodes.iter().map(|&(shell, node)| measurement(&roads[shell].shell, &roads[shell].nodes[node].q)).collect()
    };
    let subset = Expectation::new(chain, &measured(&pool), limits).identified;
    if wanted <= subset.len() {
        return Err(PlanError::FewerThanParameters { wanted, parameters: subset.len() });
    }
    let row = |&(shell, node): &(usize, usize)| -> Vec<f64> {
        subset.iter().map(|&column| roads[shell].nodes[node].row[column]).collect()
    };
    let rows: Vec<Vec<f64>> = pool.iter().map(row).collect();
    let best: Vec<(usize, usize)> = d_optimal(&rows, wanted).into_iter().map(|i| pool[i]).collect();

    let whole: Vec<(usize, usize)> =
        grid.iter().enumerate().flat_map(|(shell, nodes)| nodes.iter().map(move |&node| (shell, node))).collect();
    let even: Vec<(usize, usize)> =
        (0..wanted.min(whole.len())).map(|i| whole[i * whole.len() / wanted.min(whole.len())]).collect();
    let quality = |nodes: &[(usize, usize)]| Quality::new(chain, &measured(nodes), limits, &subset);
    let chosen = quality(&best).ok_or(PlanError::FewerThanParameters { wanted, parameters: subset.len() })?;
    let comparison = Comparison { pool: pool.len(), chosen, grid_of_same_size: quality(&even), grid: quality(&whole) };
    let by_shell = |shell: usize| best.iter().filter(|(other, _)| *other == shell).map(|(_, node)| *node).collect();
    Ok(((0..roads.len()).map(by_shell).collect(), comparison))
}

fn measurement(shell: &Shell, q: &JointVector<f64>) -> Measurement<f64> {
    Measurement::new(shell.pairing, *q, shell.bar_m)
}

/// Rows in order, with the moves between shells, and what is to be said of them.
fn assemble(
    cell: &Cell<'_>,
    roads: &[ShellRoads],
    grid: &[Vec<usize>],
    tours: Vec<Vec<Stop>>,
    seed: u64,
    tell: &Tell<'_>,
) -> Plan {
    let progress = Ongoing::begin(Stage::Moves, roads.len(), tell);
    let mut rows: Vec<PlanRow> = Vec::new();
    let mut shells = Vec::new();
    let mut measurements = Vec::new();
    for ((road, reached), tour) in roads.iter().zip(grid).zip(tours) {
        let mut stops: Vec<(RowKind, JointVector<f64>)> = tour
            .iter()
            .map(|stop| match stop {
                Stop::Via(q) => (RowKind::Via, *q),
                Stop::Measure(node) => (RowKind::Measure, road.nodes[*node].q),
            })
            .collect();
        let last = rows.last().map(|row| row.q).filter(|_| !stops.is_empty());
        // Either end of the tour may be its beginning.
        if let (Some(last), Some((_, first)), Some((_, end))) = (last, stops.first(), stops.last())
            && cell.seconds(&last, end) < cell.seconds(&last, first)
        {
            stops.reverse();
        }
        let approach = last.map(|last| {
            let mut poses: Vec<&mut JointVector<f64>> = stops.iter_mut().map(|(_, q)| q).collect();
            transfer::approach(cell, &last, &mut poses, seed)
        });
        let free = approach.clone().flatten().unwrap_or_default();
        rows.extend(free.iter().map(|q| row(cell, &road.shell, RowKind::Via, q, false)));
        let measured = stops.iter().filter(|(kind, _)| *kind == RowKind::Measure);
        measurements.extend(measured.clone().map(|(_, q)| measurement(&road.shell, q)));
        let pieces = stops.windows(2).map(|pair| cell.seconds(&pair[0].1, &pair[1].1));
        shells.push(ShellSummary {
            pairing: road.shell.id,
            bar_m: road.shell.bar_m,
            points: road.crossings.len(),
            reached: reached.len(),
            measured: measured.clone().count(),
            vias: stops.len() - measured.clone().count(),
            hindrances: road.hindrance_counts(),
            duration_s: pieces.sum::<f64>() + cell.pace.settle_s * measured.count() as f64,
            is_approach_clear: approach.is_none_or(|found| found.is_some()),
        });
        rows.extend(stops.iter().map(|(kind, q)| row(cell, &road.shell, *kind, q, true)));
        progress.tick(1);
    }
    let moves_s: f64 = rows.windows(2).map(|pair| cell.seconds(&pair[0].q, &pair[1].q)).sum();
    let expectation = Expectation::new(cell.chain(), &measurements, &cell.robot.limits);
    let quality = Quality::new(cell.chain(), &measurements, &cell.robot.limits, &expectation.identified);
    Plan {
        duration_s: moves_s + cell.pace.settle_s * measurements.len() as f64,
        rows,
        shells,
        unfit: Unfit::of(cell.chain(), &cell.robot.limits, measurements.len(), &expectation, quality.as_ref()),
        expectation,
        quality,
        comparison: None,
        is_closed_form: cell.inverse.is_closed_form(),
    }
}

fn row(cell: &Cell<'_>, shell: &Shell, kind: RowKind, q: &JointVector<f64>, is_attached: bool) -> PlanRow {
    let posture = cell.posture(q);
    let bar_m: Vector3<f64> = posture.point_in_base(&shell.pairing.sphere_tool_m) - shell.pairing.chuck_base_m;
    let limits = cell.limit_margin(q);
    let nearest = cell.nearest(&posture, is_attached.then_some(shell.id));
    PlanRow {
        kind,
        pairing: shell.id,
        bar_m: shell.bar_m,
        q: *q,
        bar: is_attached.then(|| BarAt::along(&bar_m)),
        margins: Some(RowMargins {
            travel_m: is_attached.then(|| cell.travel_margin_m(q, &shell.pairing, shell.bar_m)),
            clearance_m: nearest.gap_m,
            nearest: nearest.contact.to_string(),
            limit_rad: limits.turn_rad,
            limit_m: limits.slide_m,
            singularity: cell.singularity(&posture),
        }),
        line: 0,
    }
}
