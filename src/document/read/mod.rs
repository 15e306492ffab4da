//! Reading of a document: text to values ([`json`]), values to typed data with all structural errors at once ([`shape`]), and
//! objects of several kinds ([`tagged`]); [`one_or_three`] reads a number or a list of three.
//!
//! An error of a deserializer is a [`fault`]: a place and a message. A valid value replaces one that is missing or of a wrong
//! type ([`stand_in`]), so that the rest can be read and checked, too.

pub mod fault;
pub mod json;
pub mod one_or_three;
pub mod pointer;
pub mod shape;
pub mod stand_in;
pub mod tagged;
