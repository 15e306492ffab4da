//! Checkpoints: estimates as bytes, bit-exact.

use crate::estimate::Estimate;

/// First bytes of a checkpoint; the last of them is the number of its layout.
const MAGIC: [u8; 8] = *b"skyduct\x08";

/// Length in bytes of the hash at the end, over all before it: magic, passes, photons, rays, lost rays, number of values, and the values.
const HASH_LEN: usize = 32;

/// Encodes an estimate as little-endian words behind a header, with the BLAKE3 hash of both at the end.
pub fn encode(estimate: &Estimate) -> Vec<u8> {
    let mut values = Vec::new();
    estimate.clone().for_each_value(&mut |value| values.push(*value));
    let mut bytes = Vec::with_capacity(MAGIC.len() + 40 + 8 * values.len() + HASH_LEN);
    bytes.extend(MAGIC);
    for word in [estimate.passes, estimate.photons, estimate.rays, estimate.lost_rays, values.len() as u64] {
        bytes.extend(word.to_le_bytes());
    }
    for value in values {
        bytes.extend(value.to_le_bytes());
    }
    let hash = blake3::hash(&bytes);
    bytes.extend(hash.as_bytes());
    bytes
}

/// Decodes an estimate with the shape of `empty`; an error says in one sentence what is wrong with the bytes.
pub fn decode(empty: Estimate, bytes: &[u8]) -> Result<Estimate, String> {
    let split = bytes.len().checked_sub(HASH_LEN).ok_or("the checkpoint ends too early")?;
    let (content, hash) = bytes.split_at(split);
    if blake3::hash(content).as_bytes() != hash {
        return Err("the checkpoint is damaged: its hash does not match".into());
    }
    let content = content.strip_prefix(&MAGIC).ok_or("not a checkpoint of this version of skyduct")?;
    let mut words = content.chunks_exact(8).map(|word| word.try_into().map(u64::from_le_bytes).unwrap_or_default());
    let mut next = || words.next().ok_or_else(|| "the checkpoint ends too early".to_string());
    let (passes, photons, rays, lost_rays, count) = (next()?, next()?, next()?, next()?, next()?);
    let mut estimate = Estimate { passes, photons, rays, lost_rays, ..empty };
    let mut values = Vec::with_capacity(count as usize);
    for _ in 0..count {
        values.push(f64::from_bits(next()?));
    }
    let mut expected = 0;
    estimate.for_each_value(&mut |value| {
        *value = values.get(expected).copied().unwrap_or(f64::NAN);
        expected += 1;
    });
    if expected != values.len() || next().is_ok() {
        return Err(format!("the checkpoint has {count} values, but the job has {expected}"));
    }
    Ok(estimate)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimate::{FilmEstimate, GridEstimate};

    fn estimate() -> Estimate {
        let mut estimate = Estimate {
            passes: 3,
            photons: u64::MAX,
            grids: vec![GridEstimate::empty(4)],
            views: vec![FilmEstimate::empty([9, 3], 3)],
            ..Estimate::default()
        };
        let mut value = 0.1;
        estimate.for_each_value(&mut |slot| {
            value = (value * 7.3_f64).fract();
            *slot = value;
        });
        estimate
    }

    fn shape() -> Estimate {
        let mut empty = estimate();
        empty.for_each_value(&mut |slot| *slot = 0.0);
        empty
    }

    #[test]
    fn round_trip_is_bit_exact() {
        let decoded = decode(shape(), &encode(&estimate())).unwrap();
        assert_eq!(encode(&decoded), encode(&estimate()));
    }

    #[test]
    fn damage_is_found() {
        let bytes = encode(&estimate());
        for at in [0, 9, 40, bytes.len() - 1] {
            let mut damaged = bytes.clone();
            damaged[at] ^= 1;
            assert!(decode(shape(), &damaged).is_err());
        }
        assert!(decode(shape(), &bytes[..20]).is_err());
        assert!(decode(Estimate::default(), &bytes).unwrap_err().contains("values"));
    }
}
