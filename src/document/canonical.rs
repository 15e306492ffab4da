//! Canonical form of a document, of which hashes are taken.

use std::io::{self, BufWriter, Write};

use serde_json::Value;

/// Hashes a document: the hash is equal for documents that differ only in white space and in the order of fields.
pub fn canonical_hash(value: &Value) -> io::Result<String> {
    // many pieces are a byte or two
    let mut hashing = BufWriter::new(blake3::Hasher::new());
    write_canonical(value, &mut hashing)?;
    let hasher = hashing.into_inner().map_err(io::IntoInnerError::into_error)?;
    Ok(hasher.finalize().to_hex().to_string())
}

/// Writes a value in the form that is hashed.
pub fn write_canonical(value: &Value, out: &mut impl Write) -> io::Result<()> {
    match value {
        Value::Object(fields) => {
            writeln!(out, "object {}", fields.len())?;
            let mut sorted: Vec<_> = fields.iter().collect();
            sorted.sort_by_key(|(name, _)| *name);
            for (name, value) in sorted {
                write!(out, "{}\n{name}", name.len())?;
                write_canonical(value, out)?;
            }
            Ok(())
        }
        Value::Array(values) => {
            writeln!(out, "array {}", values.len())?;
            values.iter().try_for_each(|value| write_canonical(value, out))
        }
        leaf => {
            serde_json::to_writer(&mut *out, leaf)?;
            out.write_all(b"\n")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::document::read;

    fn hash(text: &str) -> String {
        canonical_hash(&read::json::value(text.as_bytes()).unwrap()).unwrap()
    }

    #[test]
    fn the_canonical_hash_sees_content_only() {
        let same =
            [r#"{"a":1,"b":[1,2.5,"x"]}"#, " { \"b\" : [1, 2.5, \"x\"],\n\"a\":1}", r#"{"a":1.0,"b":[1e0,2.50,"x"]}"#];
        assert!(same.iter().all(|text| hash(text) == hash(same[0])));
        let different = [
            r#"{"a":1,"b":[1,2.5]}"#,
            r#"{"a":1,"b":["1",2.5,"x"]}"#,
            r#"{"a":1,"b":[[1],2.5,"x"]}"#,
            r#"{"a":{"b":[1,2.5,"x"]}}"#,
            r#"[]"#,
            r#"{}"#,
            r#"null"#,
            r#""null""#,
        ];
        let mut hashes: Vec<String> = different.iter().chain(&same[..1]).map(|text| hash(text)).collect();
        hashes.sort();
        hashes.dedup();
        assert_eq!(hashes.len(), different.len() + 1);
        // hashes that earlier versions stored are compared with it
        assert_eq!(hash(same[0]), blake3::hash(b"object 2\n1\na1\n1\nbarray 3\n1\n2.5\n\"x\"\n").to_hex().to_string());
    }
}
