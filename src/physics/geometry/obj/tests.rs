//! Lines of OBJ files, as programs write them and as they should not be.

use super::*;
use crate::geometry::Dropped;

fn parse(text: &str) -> Result<TriangleMesh, ObjError> {
    parse_obj(text.as_bytes(), ObjLimits::default())
}

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

#[test]
fn materials_by_name_without_a_library() {
    let text = format!(
        "\u{feff}# a comment\nmtllib ../../etc/passwd\n{SQUARE}f 1 2 3\n  usemtl\tthe pipe #1 \no a\nf -4//1 -2/7/2 -1 # last\r\nusemtl dome\ng b\nv 0 0 1 0.5 0.5 0.5\nv 0 0 3 1.5\nf 1 2 5\nf 1 2 6\nusemtl the pipe #1\nf 2 3 5\n"
    );
    let mesh = parse(&text).unwrap();
    assert_eq!(mesh.materials, ["", "the pipe #1", "dome"]);
    assert_eq!(mesh.triangle_materials, [0, 1, 2, 2, 1]);
    assert_eq!(mesh.triangles[1].map(|k| mesh.positions[k as usize].y), [0.0, 1.0, 1.0]);
    assert_eq!(mesh.bounds().unwrap().1, DVec3::new(1.0, 1.0, 2.0));
}

#[test]
fn polygons_become_triangles_and_degenerate_ones_go() {
    let clean = parse(&format!("{SQUARE}f 1 2 3 4\n")).unwrap();
    assert_eq!(clean.triangles.len(), 2);
    let text =
        format!("{SQUARE}v 1 0 0\nv 0.5 0 0\nf 1 1 2\nf 1 6 2\nf 1 2 3 4\nf 3 2 1\nf 4 3 1\nf 1 5 3\nl 1 2 3\np 1\n");
    let mesh = parse(&text).unwrap();
    assert_eq!(mesh.dropped, Dropped { without_area: 2, repeated: 3 });
    assert_eq!(TriangleMesh { dropped: Dropped::default(), ..mesh }, clean);
    // a sliver of aspect 1e6 is a triangle
    assert_eq!(parse("v 0 0 0\nv 1 0 0\nv 0.5 1e-6 0\nf 1 2 3\n").unwrap().triangles.len(), 1);
    // concave: an L of area 3
    let text = "v 2 0 0\nv 2 1 0\nv 1 1 0\nv 1 2 0\nv 0 2 0\nv 0 0 0\nf 1 2 3 4 5 6\nf 1 2 3\n";
    let mesh = parse(text).unwrap();
    let area = |triangle: &[u32; 3]| {
        let [a, b, c] = triangle.map(|k| mesh.positions[k as usize]);
        0.5 * (b - a).cross(c - a).length()
    };
    assert!((mesh.triangles.iter().take(4).map(area).sum::<f64>() - 3.0).abs() < 1e-12);
}

#[test]
fn errors_name_their_line() {
    let cases = [
        ("", 1, "without any face"),
        ("v 0 0 0\n", 1, "without any face"),
        ("v 0 0 0\n\n", 2, "without any face"),
        ("v 0 0\n", 1, "three coordinates"),
        ("v 0 0 nan\n", 1, "finite"),
        ("v 0 0 0\nv 0 inf 0\n", 2, "finite"),
        ("v 0 0 1e400\n", 1, "finite"),
        ("v 0 0 zero\n", 1, "not a number"),
        ("v 1 1 1 0\n", 1, "weight"),
        ("v 1e300 1 1 1e-300\n", 1, "weight"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n", 4, "out of range"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\n\nf 0 1 2\n", 5, "counted from 1"),
        ("v 0 0 0\nf -2 1 1\n", 2, "out of range"),
        ("v 0 0 0\nf 1 1 99999999999999999999\n", 2, "not an index"),
        ("v 0 0 0\nf -9223372036854775808 1 1\n", 2, "out of range"),
        ("v 0 0 0\nf 1 1\n", 2, "at least 3"),
        ("v 0 0 0\nf 1/x 1 1\n", 2, "not an index"),
        ("v 0 0 0\nf 1/1/1/1 1 1\n", 2, "at most three"),
        ("v 0 0 0\nf /1 1 1\n", 2, "without a position"),
        ("v 0 0 0\nv 1 0 0\nf 1 \\\n 2 \\\n\nv 0 zero 0\n", 3, "at least 3"),
        ("v 0 0 \\\n0\nv 0 0\n", 3, "three coordinates"),
        ("v 0 0 0\r\nv 0 \\\r\n0 0\r\nv 0 zero 0\r\n", 4, "not a number"),
        ("v 0 0 0\rv 0 0 0\r\rv 0 zero 0", 4, "not a number"),
        ("v 0 0 0\nf 1 \\", 2, "at least 3"),
        ("# c:\\models\\\nv 0 zero 0", 2, "not a number"),
        ("#\\\nv 0 zero 0", 2, "not a number"),
        ("\\\nv\\\n0 zero 0", 1, "not a number"),
        ("usemtl\nf 1 2 3\n", 2, "out of range"),
        ("v 0 0 0\nf 1 1 1\n", 2, "has an area"),
        ("v 0 0 0\nf 1 0/a 1\n", 2, "not an index"),
        ("v 0 0 0\nf 1// 1 1\nv x 0 0\n", 3, "not a number"),
    ];
    for (text, line, detail) in cases {
        let error = parse(text).unwrap_err();
        assert_eq!(error.line, line, "{text:?}: {error}");
        assert!(error.detail.contains(detail), "{text:?}: {error}");
    }
}

/// Returns the square in the notation of other programs.
fn square(parts: [&str; 4]) -> String {
    let [comment, name, wrapped, end] = parts;
    let text = format!("{comment}\n{SQUARE}usemtl {name}\nf 1 2 {wrapped} 3 4 # last\n");
    text.replace('\n', end)
}

#[test]
fn lines_of_other_programs() {
    let plain = parse(&square(["#", "a", "", "\n"])).unwrap();
    assert_eq!((plain.triangles.len(), plain.materials.as_slice()), (2, &["a".to_owned()][..]));
    for end in ["\n", "\r\n", "\r"] {
        for wrapped in ["", "\\\n", "\\\n \\ \n\\\n", "\\ # a\n"] {
            for comment in ["#", "# c:\\", "vn 0 0 \\\n f 1"] {
                let text = square([comment, "a", wrapped, end]);
                assert_eq!(parse(&text).as_ref(), Ok(&plain), "{text:?}");
            }
        }
    }
    // each line with an end of its own
    let mixed = square(["#", "a", "\\\n", "\n"]).replacen('\n', "\r", 2).replacen("1 0\n", "1 0\r\n", 2);
    assert_eq!(parse(&mixed).as_ref(), Ok(&plain), "{mixed:?}");
    // names may continue on the next line, too
    assert_eq!(parse(&square(["#", "a \\\n  b", "", "\n"])).unwrap().materials, ["a b"]);
}

#[test]
fn encodings() {
    let text = square(["# \u{e9}\u{1f600}", "\u{e9}\u{4e2d}\u{1f600}", "\\\n", "\r\n"]);
    let plain = parse(&text).unwrap();
    assert_eq!(plain.materials, ["\u{e9}\u{4e2d}\u{1f600}"]);
    for mark in ["", "\u{feff}"] {
        let text = format!("{mark}{text}");
        let [mut little, mut big] = [Vec::new(), Vec::new()];
        for unit in text.encode_utf16() {
            little.extend(unit.to_le_bytes());
            big.extend(unit.to_be_bytes());
        }
        for bytes in [text.as_bytes(), &little, &big] {
            assert_eq!(parse_obj(bytes, ObjLimits::default()).as_ref(), Ok(&plain), "{bytes:?}");
        }
        let wide: Vec<u8> = text.chars().flat_map(|c| u32::from(c).to_le_bytes()).collect();
        let error = parse_obj(&wide, ObjLimits::default()).unwrap_err();
        assert!(error.detail.contains("UTF-32"), "{error}");
    }
    let error = parse_obj(b"\x1f\x8b\x08\0", ObjLimits::default()).unwrap_err();
    assert!(error.detail.contains("gzip"), "{error}");
}

/// Reads the largest number of groups that a file has bytes for, and switches back to faces without a material.
#[test]
fn switches_without_a_name_and_many_groups() {
    let groups: String = (0..30_000).map(|k| format!("o {k}\ng {k}\nusemtl {}\n", k % 2)).collect();
    let text = format!("{SQUARE}f 1 2 3\n{groups}f 1 2 4\nusemtl\nf 2 3 4\nusemtl  \nusemtl 0\nf 1 3 4\nusemtl\n");
    let mesh = parse(&text).unwrap();
    assert_eq!(mesh.materials, ["", "1", "0"]);
    assert_eq!(mesh.triangle_materials, [0, 1, 0, 2]);
    let named = parse(&format!("{SQUARE}usemtl a\nf 1 2 3\nusemtl\n")).unwrap();
    assert_eq!(named.materials, ["a"]);
}

#[test]
fn limits_hold() {
    let limits =
        ObjLimits { bytes: 1000, line_bytes: 100, vertices: 6, triangles: 4, materials: 1, name_bytes: 5, looks: 12 };
    let error = |text: String| parse_obj(text.as_bytes(), limits).unwrap_err();
    assert!(error("#\n".repeat(501)).detail.contains("1000 bytes"));
    assert_eq!(error(format!("v 0 0 0\n#{}", "x".repeat(100))).line, 2);
    assert_eq!(error(format!("{SQUARE}f 1 2 3 4\nf 1 2 3 4\nf 1 2 3\n")).line, 7);
    assert_eq!(error(format!("o a\n{}", "v 0 0\\\n".repeat(20))).line, 2);
    assert_eq!(error("usemtl a\nusemtl a\nusemtl b\n".to_owned()).line, 3);
    assert_eq!(error("\nusemtl long names\n".to_owned()).line, 2);
    assert_eq!(error(SQUARE.repeat(2)).line, 7);
    let notched = "v 2 0 0\nv 2 1 0\nv 1 1 0\nv 1 2 0\nv 0 2 0\nv 0 0 0\nf 1 2 3 4 5 6\n";
    let costly = error(notched.to_owned());
    assert_eq!(costly.line, 7, "{costly}");
}

#[test]
fn a_reader_that_is_stopped_names_its_line() {
    let text = format!("{SQUARE}{}", "f 1 2 3 4\n".repeat(3000));
    let error = parse_obj_until(text.as_bytes(), ObjLimits::default(), &AtomicBool::new(true)).unwrap_err();
    assert_eq!(error, ObjError { line: 1, detail: STOPPED.to_owned() });
}
