//! Pictures side by side, each with its title above.

use super::Raster;
use super::raster::LETTER_PX;

const PAPER: [u8; 3] = [255, 255, 255];
const INK: [u8; 3] = [20, 20, 20];

/// Gap between pictures and around them.
const GAP_PX: usize = 12;

/// Rows of at most `columns` titled pictures; titles longer than their picture make its column wider.
pub fn montage(pictures: &[(String, Raster)], columns: usize) -> Raster {
    let columns = columns.clamp(1, pictures.len().max(1));
    let title_height = LETTER_PX + GAP_PX / 2;
    let wide = |(title, picture): &(String, Raster)| picture.width.max(title.len() * LETTER_PX);
    let width = pictures.iter().map(wide).max().unwrap_or(1);
    let height = pictures.iter().map(|(_, picture)| picture.height).max().unwrap_or(1) + title_height;
    let rows = pictures.len().div_ceil(columns).max(1);
    let mut whole = Raster::filled(columns * (width + GAP_PX) + GAP_PX, rows * (height + GAP_PX) + GAP_PX, PAPER);
    for (index, (title, picture)) in pictures.iter().enumerate() {
        let (x, y) = (GAP_PX + index % columns * (width + GAP_PX), GAP_PX + index / columns * (height + GAP_PX));
        whole.write(x, y, title, INK);
        whole.draw(x, y + title_height, picture);
    }
    whole
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_picture_has_its_place() {
        let tile = |title: &str, colour| (title.to_owned(), Raster::filled(40, 30, colour));
        let whole = montage(&[tile("a", [1; 3]), tile("b", [2; 3]), tile("long title", [3; 3])], 2);
        assert_eq!((whole.width, whole.height), (2 * 160 + 3 * 12, 2 * (30 + 22) + 3 * 12));
        assert_eq!([whole.get(12, 34), whole.get(184, 34), whole.get(51, 34 + 64 + 29)], [[1; 3], [2; 3], [3; 3]]);
        assert_eq!(whole.get(52, 34), PAPER);
        assert!((12..28).any(|x| (12..28).any(|y| whole.get(x, y) == INK)));
        assert_eq!(montage(&[], 3).width, 1 + 2 * 12);
    }
}
