//! Results of a pass as words of 64 bits, so that they can be stored and read again exactly.

use super::pass::{GridPass, Pass, PhotonCount, ViewPass};
use super::photon::energy_balance::{PhotonTotals, TubeFlux};
use crate::guide::RayCount;

/// Reader or writer of words. Each type goes through its words once, for both, so that they cannot disagree.
pub trait Words {
    /// Writes a word, or replaces it by the next one that is read.
    fn word(&mut self, word: &mut u64);
    /// Writes the length of a list, or returns the length that is read, which is not larger than the number of words that are left.
    fn length(&mut self, length: usize) -> usize;

    /// Writes or reads the bits of a number.
    fn number(&mut self, number: &mut f64) {
        let mut bits = number.to_bits();
        self.word(&mut bits);
        *number = f64::from_bits(bits);
    }
}

impl Pass {
    /// Goes through all words of the pass, except for the state that it carries to the next one: it is for passes that carry none.
    pub fn each_word(&mut self, words: &mut impl Words) {
        let Self { grids, views, totals, photons, carried: _ } = self;
        list(words, grids, GridPass::each_word);
        list(words, views, |view, words| {
            let ViewPass { luminance, bias, contrasts, rays } = view;
            [luminance, bias, contrasts, rays].into_iter().for_each(|values| numbers(words, values));
        });
        let PhotonTotals { energy, tubes, rays: RayCount { followed, lost }, not_finite } = totals;
        energy.values_mut().into_iter().for_each(|value| words.number(value));
        list(words, tubes, |tube, words| {
            let TubeFlux { at_collector, at_diffuser, into_room, evenly } = tube;
            [at_collector, at_diffuser, into_room, evenly].into_iter().for_each(|value| words.number(value));
        });
        [followed, lost, photons].into_iter().for_each(|word| words.word(word));
        optional(words, not_finite, |photon, words| words.word(photon));
    }
}

impl GridPass {
    fn each_word<W: Words>(&mut self, words: &mut W) {
        let Self {
            illuminance,
            bias,
            contrasts,
            residual,
            gathered,
            expected_spreads,
            is_part: _,
            photons,
            moments,
            companions,
        } = self;
        for values in [illuminance, bias, contrasts, residual, gathered, expected_spreads, moments] {
            numbers(words, values);
        }
        list(words, photons, |count, words| {
            let PhotonCount { found, one_lux, brightest_lux } = count;
            [found, one_lux, brightest_lux].into_iter().for_each(|value| words.number(value));
        });
        list(words, companions, Self::each_word);
    }
}

fn numbers(words: &mut impl Words, values: &mut Vec<f64>) {
    list(words, values, |value, words| words.number(value));
}

/// Goes through a list: its length, then its members.
fn list<W: Words, T: Default>(words: &mut W, members: &mut Vec<T>, mut each: impl FnMut(&mut T, &mut W)) {
    members.resize_with(words.length(members.len()), T::default);
    members.iter_mut().for_each(|member| each(member, words));
}

/// Goes through a value that may be absent, as a list of none or one.
fn optional<W: Words, T: Default>(words: &mut W, value: &mut Option<T>, each: impl FnMut(&mut T, &mut W)) {
    let mut members: Vec<T> = value.take().into_iter().collect();
    list(words, &mut members, each);
    *value = members.pop();
}
