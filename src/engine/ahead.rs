//! Passes that are computed ahead of their turn, by whoever is free. Their results are kept one by one, exactly, and not as sums: the job's
//! estimate takes them in the order of their numbers, so that it has the same bits wherever they were computed.

use std::ops::Range;
use std::time::{Duration, Instant};

use bytes::{Buf, Bytes};

use super::cancel::Stop;
use super::integrators::Results;
use super::prepare::RenderJob;
use super::spent::{Clocks, Spent};
use crate::estimate::Estimate;
use crate::estimate::stopping::{Wanted, next_judgement};
use crate::integrator::Pass;
use crate::integrator::pass_words::Words;
use crate::integrator::photon_map::progressive::Carried;

/// First bytes of stored outcomes; the last of them is the number of their layout.
const MAGIC: [u8; 8] = *b"skyahea\x01";

/// Bytes that the results of one range may take, unless one pass takes more.
const MOST_BYTES: u64 = 64 << 20;

/// Passes that may be computed ahead of their turn.
#[derive(Clone, Debug, PartialEq)]
pub struct RangeAhead {
    /// Numbers of the passes, from 0.
    pub passes: Range<u64>,
    /// Outputs that they compute: all that may still be wanted when their turn comes.
    pub wanted: Wanted,
}

/// Outcome of one pass that was computed ahead.
pub struct Outcome {
    pub(super) results: Results,
    pub(super) spent: Spent,
}

/// Outcomes of a range of passes as bytes.
pub struct Outcomes {
    /// Numbers of the passes that were computed: all of the range, or the first of them.
    pub passes: Range<u64>,
    /// Outcomes in their order, for [`stored_outcomes`].
    pub bytes: Bytes,
}

impl RenderJob {
    /// True if no pass depends on what earlier ones left, so that passes can be computed in any order.
    pub fn passes_are_independent(&self) -> bool {
        self.engine().passes_are_independent()
    }

    /// Returns the next `count` ranges of passes after the one that the next pass of an estimate lies in, none where passes depend on each
    /// other. `bytes` is the size of the stored estimate, which takes at least as much as the results of a pass.
    pub fn ranges_ahead(&self, merged: &Estimate, bytes: u64, count: usize) -> Vec<RangeAhead> {
        if count == 0 || !self.passes_are_independent() {
            return Vec::new();
        }
        let wanted = self.wanted_after(merged);
        let most = (MOST_BYTES / bytes.max(1)).max(1);
        let next = |range: &Range<u64>| Some(range.end..range_end(range.end, most).min(self.stop.max_passes));
        std::iter::successors(Some(merged.passes..range_end(merged.passes, most)), next)
            .skip(1)
            .take(count)
            .filter(|passes| !passes.is_empty())
            .map(|passes| RangeAhead { passes, wanted })
            .collect()
    }

    /// Computes the passes of a range on the current rayon pool, until it has taken the time `most`, but at least one; `None` where `stop`
    /// ended it.
    pub fn compute_ahead(&self, range: &RangeAhead, stop: &Stop, most: Duration) -> Option<Outcomes> {
        let engine = self.engine();
        let (begun, mut passes) = (Instant::now(), range.passes.start..range.passes.start);
        let mut writer = Writer(MAGIC.to_vec());
        while passes.end < range.passes.end && (passes.is_empty() || begun.elapsed() < most) {
            let clocks = Clocks::start();
            let results = engine.results(passes.end, &Carried::default(), range.wanted, stop.flag())?;
            Outcome { results, spent: clocks.spent() }.each_word(&mut writer);
            passes.end += 1;
        }
        Some(Outcomes { passes, bytes: writer.0.into() })
    }
}

/// Returns the end of the range that a pass lies in. Each pass lies in one range, whoever asks: ranges end where the job is judged, and
/// before, at each `most` passes that are left to it.
fn range_end(pass: u64, most: u64) -> u64 {
    let judged = next_judgement(pass + 1);
    judged - (judged - pass - 1) / most * most
}

/// Reads stored outcomes in their order; those that are cut short or of another layout, and all after them, are left out.
pub fn stored_outcomes(mut bytes: Bytes) -> impl Iterator<Item = Outcome> {
    let is_known = bytes.starts_with(&MAGIC);
    bytes.advance(if is_known { MAGIC.len() } else { 0 });
    let mut reader = Reader { bytes, ended: !is_known };
    std::iter::from_fn(move || {
        let mut outcome = Outcome { results: Results::default(), spent: Spent::NOTHING };
        if !reader.ended {
            outcome.each_word(&mut reader);
        }
        (!reader.ended).then_some(outcome)
    })
}

impl Outcome {
    fn each_word(&mut self, words: &mut impl Words) {
        let Self { results: Results { grids, views }, spent: Spent { seconds, cpu_seconds } } = self;
        words.number(seconds);
        // not a number where it is not known
        let mut cpu = cpu_seconds.unwrap_or(f64::NAN);
        words.number(&mut cpu);
        *cpu_seconds = Some(cpu).filter(|cpu| !cpu.is_nan());
        for pass in [grids, views] {
            if words.length(usize::from(pass.is_some())) == 0 {
                *pass = None;
            } else {
                pass.get_or_insert_with(Pass::default).each_word(words);
            }
        }
    }
}

/// Writer of words.
struct Writer(Vec<u8>);

impl Words for Writer {
    fn word(&mut self, word: &mut u64) {
        self.0.extend(word.to_le_bytes());
    }

    fn length(&mut self, length: usize) -> usize {
        self.word(&mut (length as u64));
        length
    }
}

/// Reader of words; those after the end are 0.
struct Reader {
    bytes: Bytes,
    ended: bool,
}

impl Words for Reader {
    fn word(&mut self, word: &mut u64) {
        *word = self.bytes.try_get_u64_le().unwrap_or_else(|_| {
            self.ended = true;
            0
        });
    }

    fn length(&mut self, _: usize) -> usize {
        let mut length = 0;
        self.word(&mut length);
        match usize::try_from(length) {
            Ok(length) if length <= self.bytes.remaining() / 8 => length,
            _ => {
                self.ended = true;
                0
            }
        }
    }
}
