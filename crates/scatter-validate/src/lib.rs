//! The judge: closed forms, error figures, the technique × shot matrix and its report.
pub mod closed_form;
pub mod figures;
