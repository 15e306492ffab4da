//! Decoding of text files in UTF-8 or UTF-16.

use std::borrow::Cow;

/// Returns the bytes of a text as UTF-8 without a byte order mark; or the reason why they are no text, worded to follow "it" or "the file".
///
/// UTF-16 is recognised by its byte order mark or by zeros between the first characters. Invalid UTF-16 becomes U+FFFD; invalid UTF-8 is
/// left as it is.
pub fn utf8(bytes: &[u8]) -> Result<Cow<'_, [u8]>, &'static str> {
    match bytes {
        [0xef, 0xbb, 0xbf, rest @ ..] => Ok(Cow::Borrowed(rest)),
        [0xff, 0xfe, 0, 0, ..] | [0, 0, 0xfe, 0xff, ..] | [1..=255, 0, 0, 0, ..] | [0, 0, 0, 1..=255, ..] => {
            Err("is in UTF-32: save it as UTF-8")
        }
        [0xff, 0xfe, rest @ ..] => Ok(utf16(rest, u16::from_le_bytes)),
        [0xfe, 0xff, rest @ ..] => Ok(utf16(rest, u16::from_be_bytes)),
        [1..=255, 0, 1..=255, 0, ..] => Ok(utf16(bytes, u16::from_le_bytes)),
        [0, 1..=255, 0, 1..=255, ..] => Ok(utf16(bytes, u16::from_be_bytes)),
        [0x1f, 0x8b, ..] => Err("is compressed (gzip): unpack it first"),
        [b'P', b'K', 3, 4, ..] => Err("is an archive (ZIP): unpack it first"),
        _ => Ok(Cow::Borrowed(bytes)),
    }
}

fn utf16(bytes: &[u8], unit: fn([u8; 2]) -> u16) -> Cow<'static, [u8]> {
    let (pairs, half) = bytes.as_chunks::<2>();
    let decoded = char::decode_utf16(pairs.iter().map(|pair| unit(*pair)));
    let mut text: String = decoded.map(|character| character.unwrap_or(char::REPLACEMENT_CHARACTER)).collect();
    if !half.is_empty() {
        text.push(char::REPLACEMENT_CHARACTER);
    }
    Cow::Owned(text.into_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn broken_utf_16_is_told_by_its_characters() {
        assert_eq!(utf8(b"\xff\xfea\0\0\xd8b\0c").as_deref(), Ok("a\u{fffd}b\u{fffd}".as_bytes()));
        assert_eq!(utf8(b"\xfe\xff").as_deref(), Ok(&b""[..]));
        for text in [&b""[..], b"\0", b"a", b"a\0", b"\xff", b"{}"] {
            assert_eq!(utf8(text).as_deref(), Ok(text));
        }
    }
}
