//! The stress matrix: techniques × extremes (MODEL.md's extremes, what engines hand over, the laws, the rules of the
//! house). A cell is a number within its tolerance, a number of a mode that promises none ([`Contender::no_promise`]), a reason
//! given before any work, or a failure; every image keeps its technique's bound of memory.
//!
//! Expected values are closed forms: published ones, formulas, and the brute-force image of
//! [`texel_cells`](crate::texel_cells), which judges shadow-map truth to rounding and every technique by what its finest
//! rung promises. Rows are [`rows`], tolerances [`row`], the judge [`judge`].

pub mod cell;
pub mod document;
pub mod judge;
pub mod row;
pub mod rows;
pub mod scenes;
pub mod table;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Instant;

use scatter_core::{Frame, RenderError, ScatterImage, SceneFacts, parallel};

use crate::checks::counting_allocator::bytes_of_this_thread;
use crate::checks::refusal::agreement;
use crate::contender::Contender;
use crate::scenario::Scenario;
use crate::texel_cells::Expected;
use crate::tolerance::Tolerances;
use cell::{Cell, Miss};
use judge::{Limit, NoPromise, errors, from_errors, judged, unpromised};
use row::{Expectation, ImageTrial, Law, Relation, StressRow, Trial};

/// A row that was run.
#[derive(Debug, Clone)]
pub struct StressResult {
    /// The heading that it stands under.
    pub group: &'static str,
    /// What it is.
    pub name: String,
    /// `[width, height]` of the image; `[0, 0]` without one.
    pub size: [u32; 2],
    /// Texels along a side of the shadow map.
    pub map_side: u32,
    /// One cell a contender, with its time \[ms\].
    pub cells: Vec<(Cell, f64)>,
}

impl StressResult {
    /// Whether any cell is a failure.
    pub fn has_failed(&self) -> bool {
        self.cells.iter().any(|(cell, _)| cell.has_failed())
    }
}

/// Runs one row for all contenders.
pub fn run(row: StressRow, contenders: &[Contender<'_>]) -> StressResult {
    let StressRow { group, name, trial } = row;
    let (mut size, mut map_side) = ([0; 2], 0);
    let expected = match &trial {
        Trial::Image(trial) => {
            (size, map_side) = (trial.scenario.size(), trial.scenario.map_side());
            Some(expected_of(trial))
        }
        Trial::Relation(relation) => {
            (size, map_side) = (relation.second.size(), relation.second.map_side());
            Some(relation.second.expected())
        }
        _ => None,
    };
    let cells = contenders
        .iter()
        .map(|contender| {
            let start = Instant::now();
            // A technique that panics is a failure of its cell, not of the matrix.
            let cell =
                catch_unwind(AssertUnwindSafe(|| cell_of((group, &trial), expected.as_ref(), contender)));
            let cell = cell.unwrap_or_else(|panic| Cell::fault(format!("panics: {}", message(&*panic))));
            (cell, start.elapsed().as_secs_f64() * 1e3)
        })
        .collect();
    StressResult { group, name, size, map_side, cells }
}

fn message(panic: &(dyn std::any::Any + Send)) -> &str {
    let text = panic.downcast_ref::<String>().map(String::as_str);
    text.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("no message")
}

fn expected_of(trial: &ImageTrial) -> Expected {
    let mut expected = trial.scenario.expected();
    if let Expectation::Value(value) = trial.expectation {
        expected.radiance.fill([value; 3]);
    }
    expected
}

fn cell_of((group, trial): (&str, &Trial), expected: Option<&Expected>, contender: &Contender<'_>) -> Cell {
    match (trial, expected) {
        (Trial::Image(trial), Some(expected)) => image_cell((group, trial), expected, contender),
        (Trial::Relation(relation), Some(expected)) => relation_cell(relation, expected, contender),
        (Trial::Refusal { input, names }, _) => match input() {
            Err(error) if error.to_string().contains(names) => Cell::Refused(error.to_string()),
            Err(error) => Cell::fault(format!("the message does not name {names}: {error}")),
            Ok(()) => Cell::fault("is accepted"),
        },
        (Trial::House(rule), _) => rule.run(contender),
        (Trial::Broken(error), _) => Cell::fault(format!("the row's own input is refused: {error}")),
        (Trial::Image(_) | Trial::Relation(_), None) => Cell::fault("the row has no expectation"),
    }
}

fn image_cell((group, trial): (&str, &ImageTrial), expected: &Expected, contender: &Contender<'_>) -> Cell {
    let scenario = &trial.scenario;
    let tolerances = match Tolerances::built_in() {
        Ok(tolerances) => tolerances,
        Err(error) => return Cell::fault(error.to_string()),
    };
    let limit = if contender.is_reference() {
        Limit::Largest(trial.reference_tolerance)
    } else {
        let own = tolerances.stress_limit(contender.id(), group).filter(|_| !is_plain(scenario));
        own.map_or_else(
            || Limit::of_technique(!is_plain(scenario), 1, trial.reference_tolerance),
            Limit::Film,
        )
    };
    let (size, input) = (scenario.size(), trial.reference_tolerance);
    let may_be_brighter = tolerances.may_be_brighter(contender.id(), group);
    match (render(contender, scenario), no_promise(contender, scenario, expected)) {
        (Ok(image), None) => judged(&image, size, expected, limit, input),
        (Ok(image), Some(why)) => {
            unpromised(&image, size, expected, (limit, input), NoPromise { why, may_be_brighter })
        }
        (Err(cell), _) => cell,
    }
}

/// Whether nothing is between light and air: then there is nothing but a closed form to be computed.
fn is_plain(scenario: &Scenario) -> bool {
    !scenario.casts_shadow() && scenario.glass.is_none() && scenario.smoke.is_none()
}

/// Why an image is held to no error. Where all is lit, or nothing is, there is nothing to be off by: that is held to in every mode.
fn no_promise(contender: &Contender<'_>, scenario: &Scenario, expected: &Expected) -> Option<String> {
    if is_plain(scenario) || expected.is_even() {
        return None;
    }
    scenario.with_frame(|frame| contender.no_promise(&SceneFacts::of(frame))).ok().flatten()
}

/// The image of a scenario, or the cell of what went otherwise.
fn render(contender: &Contender<'_>, scenario: &Scenario) -> Result<ScatterImage, Cell> {
    let rendered = scenario.with_frame(|frame| render_frame(contender, frame));
    rendered.unwrap_or_else(|error| Err(Cell::fault(format!("the row's own input is refused: {error}"))))
}

fn render_frame(contender: &Contender<'_>, frame: &Frame<'_>) -> Result<ScatterImage, Cell> {
    let facts = SceneFacts::of(frame);
    let unfit = |error| Cell::fault(format!("cannot be configured: {error}"));
    let mut instance = contender.instance(&facts).map_err(unfit)?;
    let most = contender.most_bytes(frame, &facts, parallel::worker_count()).map_err(unfit)?;
    if let Err(unsupported) = instance.supports(frame) {
        return Err(match agreement(instance.as_mut(), frame) {
            Ok(()) => Cell::Unsupported(unsupported.reason.into()),
            Err(fault) => Cell::fault(fault),
        });
    }
    let mut image = ScatterImage::new();
    let before = bytes_of_this_thread();
    match instance.render(frame, &mut image) {
        Ok(stats) => {
            if stats.memory_bytes > most {
                return Err(Cell::fault(format!("holds {} bytes, at most {most}", stats.memory_bytes)));
            }
            // Asked for in all, which a list that grows does twice; and the image is new.
            let [width, height] = frame.size().map(u64::from);
            let asked = bytes_of_this_thread().zip(before).map_or(0, |(after, before)| after - before);
            if asked > 2 * most + IMAGE_BYTES * width * height {
                return Err(Cell::fault(format!("asks for {asked} bytes, may hold {most}")));
            }
            Ok(image)
        }
        Err(RenderError::Unsupported(unsupported)) => Err(Cell::fault(format!(
            "supports() says yes and render() says unsupported: {}",
            unsupported.reason
        ))),
        Err(error) => Err(Cell::fault(error.to_string())),
    }
}

/// Bytes a pixel of a [`ScatterImage`]: radiance and transmittance.
const IMAGE_BYTES: u64 = 24;

fn relation_cell(relation: &Relation, expected: &Expected, contender: &Contender<'_>) -> Cell {
    let Relation { first, second, law, factor, reference_tolerance } = relation;
    let (first, second_image) = match (render(contender, first), render(contender, second)) {
        (Ok(first), Ok(second)) => (first, second),
        // Where one of them is not supported there is nothing to hold against the other.
        (Err(Cell::Unsupported(reason)), _) | (_, Err(Cell::Unsupported(reason))) => {
            return Cell::Unsupported(reason);
        }
        (Err(cell), _) | (_, Err(cell)) => return cell,
    };
    let [width, height] = first.size();
    let source = |x: u32| if *law == Law::Mirrored { width - 1 - x } else { x };
    let bound: Vec<[f64; 3]> = (0..height)
        .flat_map(|y| (0..width).map(move |x| (x, y)))
        .map(|(x, y)| first.at(source(x), y).map(|value| factor * f64::from(value)))
        .collect();
    let size_of = |error: f64| if *law == Law::NotBrighter { error.max(0.0) } else { error.abs() };
    let limit = if contender.is_reference() {
        Limit::Largest(*reference_tolerance)
    } else {
        Limit::of_technique(second.casts_shadow(), 2, *reference_tolerance)
    };
    // A longer or less occluded ray's own unoccluded value is the larger one; either bounds the promise.
    let cell = from_errors(
        &errors(second_image.inscattered(), &bound, &expected.scale, size_of),
        second.size(),
        limit,
    );
    match (cell, no_promise(contender, second, expected)) {
        // Scaling and motion change no choice; a reflection may turn the surface between texels, and what is interpolated may
        // grow where something is taken away.
        (Cell::Ok { error } | Cell::Fail(Miss { error, .. }), Some(why)) if *law != Law::Same => {
            Cell::Unpromised { error, level: limit.share(), why }
        }
        (cell, _) => cell,
    }
}
