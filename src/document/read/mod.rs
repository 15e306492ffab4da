//! Reading a document: text to values ([`json`]), values to typed data with all errors of shape at once ([`shape`]), objects
//! of several kinds ([`tagged`]).
//!
//! What a deserializer finds is a [`fault`]: a place and a message. A good value takes the place of what is missing or of a
//! wrong type ([`stand_in`]), so that the rest can be read and judged, too.

pub mod fault;
pub mod json;
pub mod pointer;
pub mod shape;
pub mod stand_in;
pub mod tagged;
