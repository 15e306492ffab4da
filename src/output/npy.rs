//! Arrays of NumPy (format versions 1 to 3): written as float32, read as float32 or float64.

/// First bytes of an array.
const MAGIC: &[u8] = b"\x93NUMPY";

/// Largest value of an array that is read, such as lux.
const LARGEST: f32 = 1e9;

/// Numbers in rows and columns.
#[derive(Clone, Debug, PartialEq)]
pub struct Array {
    /// Numbers of rows and columns.
    pub shape: [usize; 2],
    /// Values, row by row.
    pub values: Vec<f32>,
}

/// File that is no array of numbers in rows and columns.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct NotAnArray(String);

/// Encodes an array of rows and columns, row by row, as float32.
///
/// ```
/// use skyduct::output::npy::{decode, encode};
///
/// let bytes = encode([1, 2], [1.0, 2.0].into_iter());
/// assert_eq!((bytes.len(), &bytes[128..132]), (136, &1f32.to_le_bytes()[..]));
/// assert_eq!(decode(&bytes).unwrap().values, [1.0, 2.0]);
/// ```
pub fn encode([rows, columns]: [usize; 2], values: impl Iterator<Item = f32>) -> Vec<u8> {
    let header = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': ({rows}, {columns}), }}");
    // magic, version and length take 10 bytes; the header ends with a line feed at a multiple of 64
    let length = (10 + header.len() + 1).next_multiple_of(64) - 10;
    let mut bytes = [MAGIC, &[1, 0]].concat();
    bytes.extend(u16::try_from(length).unwrap_or(u16::MAX).to_le_bytes());
    bytes.extend(format!("{header:<width$}\n", width = length - 1).into_bytes());
    values.for_each(|value| bytes.extend(value.to_le_bytes()));
    bytes
}

/// Decodes an array of illuminances, as [`read`] does, whose values are within 0..1e9 or not a number, where there is none.
pub fn decode(bytes: &[u8]) -> Result<Array, NotAnArray> {
    let array = read(bytes)?;
    let is_refused = |value: &f32| !value.is_nan() && !(0.0..=LARGEST).contains(value);
    match array.values.iter().position(is_refused) {
        Some(place) => Err(NotAnArray(format!(
            "all numbers must be within 0..{LARGEST:e}, but that of row {} and column {}, counted from 0, is {}",
            place / array.shape[1],
            place % array.shape[1],
            array.values[place]
        ))),
        None => Ok(array),
    }
}

/// Reads an array of two dimensions in C order whose values are float32 or float64, little endian.
pub fn read(bytes: &[u8]) -> Result<Array, NotAnArray> {
    let fault = |detail: &str| NotAnArray(detail.to_owned());
    let cut = || fault("the file ends within its header");
    let rest = bytes.strip_prefix(MAGIC).ok_or_else(|| fault("the file must be an array of NumPy (.npy)"))?;
    let (version, rest) = rest.split_at_checked(2).ok_or_else(cut)?;
    let of_length = if version[0] == 1 { 2 } else { 4 };
    let (length, rest) = rest.split_at_checked(of_length).ok_or_else(cut)?;
    let length = length.iter().rev().fold(0, |length, byte| 256 * length + usize::from(*byte));
    let (header, data) = rest.split_at_checked(length).ok_or_else(cut)?;
    let header = std::str::from_utf8(header).map_err(|_| fault("the header must be text"))?;
    let size = match field(header, "descr") {
        Some(descr) if descr.starts_with("'<f4'") => 4,
        Some(descr) if descr.starts_with("'<f8'") => 8,
        _ => return Err(fault("the numbers must be float32 or float64, little endian")),
    };
    if !field(header, "fortran_order").is_some_and(|order| order.starts_with("False")) {
        return Err(fault("the array must be in C order: numpy.ascontiguousarray makes it so"));
    }
    let shape = field(header, "shape").and_then(|shape| shape.strip_prefix('(')?.split(')').next());
    let numbers: Option<Vec<usize>> = shape.map(|shape| {
        let parts = shape.split(',').map(str::trim).filter(|part| !part.is_empty());
        parts.map(|part| part.parse().unwrap_or(usize::MAX)).collect()
    });
    let Some([rows, columns]) = numbers.and_then(|numbers| <[usize; 2]>::try_from(numbers).ok()) else {
        return Err(fault("the array must have two dimensions"));
    };
    if rows.checked_mul(columns).and_then(|count| count.checked_mul(size)) != Some(data.len()) {
        return Err(NotAnArray(format!("an array of ({rows}, {columns}) must have as many numbers")));
    }
    let value = |bytes: &[u8]| match (<[u8; 4]>::try_from(bytes), <[u8; 8]>::try_from(bytes)) {
        (Ok(single), _) => f32::from_le_bytes(single),
        (_, Ok(double)) => f64::from_le_bytes(double) as f32,
        _ => f32::NAN,
    };
    Ok(Array { shape: [rows, columns], values: data.chunks_exact(size).map(value).collect() })
}

/// Returns what follows the name of a field in a header.
fn field<'a>(header: &'a str, name: &str) -> Option<&'a str> {
    let (_, after) = header.split_once(&format!("'{name}'"))?;
    Some(after.trim_start().strip_prefix(':')?.trim_start())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns a file with a header and these bytes, of a version.
    fn file(version: u8, header: &str, data: &[u8]) -> Vec<u8> {
        let length = (header.len() as u32).to_le_bytes();
        let length = if version == 1 { &length[..2] } else { &length[..] };
        [MAGIC, &[version, 0], length, header.as_bytes(), data].concat()
    }

    #[test]
    fn doubles_are_read_by_rows() {
        let data: Vec<u8> = (0..6).flat_map(|number| f64::from(number).to_le_bytes()).collect();
        let header = "{'descr': '<f8', 'fortran_order': False, 'shape': (2, 3), }\n";
        for version in [1, 2] {
            let found = decode(&file(version, header, &data)).unwrap();
            assert_eq!((found.shape, &found.values[3..]), ([2, 3], &[3.0, 4.0, 5.0][..]));
        }
    }

    #[test]
    fn faults_are_told() {
        let header = |descr: &str, order: &str, shape: &str| {
            format!("{{'descr': '{descr}', 'fortran_order': {order}, 'shape': {shape}, }}")
        };
        let one = 1f32.to_le_bytes();
        let told = |header: String, data: &[u8]| decode(&file(1, &header, data)).unwrap_err().to_string();
        assert!(told(header("<i4", "False", "(1, 1)"), &one).contains("float32"));
        assert!(told(header("<f4", "True", "(1, 1)"), &one).contains("C order"));
        assert!(told(header("<f4", "False", "(1,)"), &one).contains("two dimensions"));
        assert!(told(header("<f4", "False", "(1, 1, 1)"), &one).contains("two dimensions"));
        assert!(told(header("<f4", "False", "(2, 1)"), &one).contains("as many"));
        assert!(told(header("<f4", "False", "(99999999999999999999, 2)"), &one).contains("as many"));
        assert!(told(header("<f4", "False", "(1, 1)"), &f32::INFINITY.to_le_bytes()).contains("row 0 and column 0"));
        assert!(told(header("<f4", "False", "(1, 1)"), &(-1f32).to_le_bytes()).contains("-1"));
        let whole = encode([1, 1], std::iter::once(1.0));
        for length in 0..whole.len() {
            assert!(decode(&whole[..length]).is_err(), "{length}");
        }
        assert!(decode(&whole).is_ok());
        // of places without a value
        assert!(decode(&encode([1, 1], std::iter::once(f32::NAN))).is_ok());
    }
}
