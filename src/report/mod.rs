//! Results → text and JSON. Every number that a command prints comes from here, in one wording.

pub mod check;
pub mod json;
pub mod text;
