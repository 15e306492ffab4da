//! Job documents: what is accepted, what is refused and with which words.

#[path = "../shared/schema.rs"]
mod schema;

mod contract;
mod document;
mod hints;
mod sky;
