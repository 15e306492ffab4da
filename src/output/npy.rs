//! Arrays of NumPy (format version 1.0).

/// First bytes of an array, and its version.
const MAGIC: &[u8] = b"\x93NUMPY\x01\x00";

/// Encodes an array of rows and columns, row by row, as float32.
///
/// ```
/// let bytes = skyduct::output::npy::encode([1, 2], [1.0, 2.0].into_iter());
/// assert_eq!((bytes.len(), &bytes[128..132]), (136, &1f32.to_le_bytes()[..]));
/// ```
pub fn encode([rows, columns]: [usize; 2], values: impl Iterator<Item = f32>) -> Vec<u8> {
    let header = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': ({rows}, {columns}), }}");
    // magic, version and length take 10 bytes; the header ends with a line feed at a multiple of 64
    let length = (10 + header.len() + 1).next_multiple_of(64) - 10;
    let mut bytes = MAGIC.to_vec();
    bytes.extend(u16::try_from(length).unwrap_or(u16::MAX).to_le_bytes());
    bytes.extend(format!("{header:<width$}\n", width = length - 1).into_bytes());
    values.for_each(|value| bytes.extend(value.to_le_bytes()));
    bytes
}

/// Decodes the values of an array that [`encode`] made; an error for anything else.
pub fn decode(bytes: &[u8]) -> Result<Vec<f32>, String> {
    let values = || {
        let (length, rest) = bytes.strip_prefix(MAGIC)?.split_first_chunk()?;
        rest.get(usize::from(u16::from_le_bytes(*length))..)
    };
    let (chunks, rest) = values().ok_or("is no array of NumPy")?.as_chunks();
    if !rest.is_empty() {
        return Err("ends within a number".to_owned());
    }
    Ok(chunks.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arrays_are_read_as_they_were_written() {
        let values = [0.0, 1.5, -2.25, f32::MAX, 1e-30, 7.0];
        let bytes = encode([3, 2], values.into_iter());
        assert_eq!(decode(&bytes), Ok(values.to_vec()));
        assert!(
            decode(&bytes[..bytes.len() - 1]).is_err() && decode(b"\x93NUMPY").is_err() && decode(b"text").is_err()
        );
    }
}
