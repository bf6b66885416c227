//! What is wrong with a shot file's values, at their place in it.

use scatter_core::ModelError;

use super::document::Document;
use crate::error::{Checked, Fault};
use crate::limits::MAX_COORDINATE;

/// An error unless every number is finite and at most [`MAX_COORDINATE`]: products of several must stay in range.
pub(super) fn sane(document: &Document<'_>, key: &str, values: &[f64]) -> Checked<()> {
    match values.iter().find(|value| !(value.abs() <= MAX_COORDINATE)) {
        None => Ok(()),
        Some(value) => {
            let cure = format!("give finite numbers of at most {MAX_COORDINATE:e}");
            Err(Fault::invalid(document.place(key), format!("the value {value}"), cure))
        }
    }
}

/// The model's error at the key that it names, which may stand below `key`.
pub(super) fn model_fault(document: &Document<'_>, key: &str, error: &ModelError) -> Fault {
    let text = error.to_string();
    let first_word = text.split([' ', ':', '[']).next().unwrap_or_default();
    // The model says `light.direction`, the file perhaps `lights[2].direction`.
    let field = first_word.rsplit_once('.').map_or("", |(_, field)| field);
    let place =
        if field.is_empty() { document.place(key) } else { document.place(&format!("{key}.{field}")) };
    fault_at(place, error)
}

/// The model's error at a place that is known already.
pub(super) fn fault_at(place: String, error: &ModelError) -> Fault {
    let text = error.to_string();
    let (problem, cure) = text.rsplit_once("; ").unwrap_or((&text, "correct it"));
    // `camera.up: it is …`: the place says that already.
    let said = problem.split_once(": ").filter(|(field, _)| !field.is_empty() && place.ends_with(field));
    Fault::invalid(place.clone(), said.map_or(problem, |(_, problem)| problem), cure)
}
