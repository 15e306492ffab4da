//! Arrays of NumPy (format version 1.0): float32 in C order, little endian.

/// Writes an array of this shape.
pub fn write(shape: &[usize], values: impl IntoIterator<Item = f32>) -> Vec<u8> {
    let shape: Vec<String> = shape.iter().map(usize::to_string).collect();
    let header = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': ({}), }}", shape.join(", "));
    // magic, version and length take 10 bytes; the header ends with a line feed at a multiple of 64
    let length = (10 + header.len() + 1).next_multiple_of(64) - 10;
    let mut bytes = MAGIC.to_vec();
    bytes.extend(u16::try_from(length).unwrap_or(u16::MAX).to_le_bytes());
    bytes.extend(format!("{header:<width$}\n", width = length - 1).into_bytes());
    bytes.extend(values.into_iter().flat_map(f32::to_le_bytes));
    bytes
}

const MAGIC: &[u8] = b"\x93NUMPY\x01\x00";

/// Reads the values of an array that [`write`] wrote; an error for anything else.
pub fn read(bytes: &[u8]) -> Result<Vec<f32>, String> {
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
        let bytes = write(&[3, 2], values);
        assert_eq!(bytes.len(), 128 + 4 * values.len());
        assert_eq!(read(&bytes), Ok(values.to_vec()));
        assert!(read(&bytes[..bytes.len() - 1]).is_err() && read(b"\x93NUMPY").is_err() && read(b"text").is_err());
    }
}
