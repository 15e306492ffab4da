//! Pictures side by side, each with its title above.

use super::words::{LINE_PX, width_px, write};
use crate::output::{OutputError, Raster};

const PAPER: [u8; 3] = [255, 255, 255];

/// Gap between pictures and around them in pixels.
const GAP_PX: usize = 12;

/// Arranges titled pictures in rows of at most `columns`; the widest picture or title determines the width of all columns.
pub fn montage(pictures: &[(String, Raster)], columns: usize) -> Result<Raster, OutputError> {
    let columns = columns.clamp(1, pictures.len().max(1));
    let title_height = LINE_PX + GAP_PX / 2;
    let wide = |(title, picture): &(String, Raster)| picture.width.max(width_px(title));
    let width = pictures.iter().map(wide).max().unwrap_or(1);
    let height = pictures.iter().map(|(_, picture)| picture.height).max().unwrap_or(1) + title_height;
    let rows = pictures.len().div_ceil(columns).max(1);
    let mut whole = Raster::filled(columns * (width + GAP_PX) + GAP_PX, rows * (height + GAP_PX) + GAP_PX, PAPER);
    for (index, (title, picture)) in pictures.iter().enumerate() {
        let (x, y) = (GAP_PX + index % columns * (width + GAP_PX), GAP_PX + index / columns * (height + GAP_PX));
        write(&mut whole, x, y, title)?;
        whole.draw(x, y + title_height, picture);
    }
    Ok(whole)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_picture_has_its_place() {
        let tile = |title: &str, colour| (title.to_owned(), Raster::filled(40, 30, colour));
        let titles = ["a", "b", "a title that is longer than its picture"];
        let tiles = [tile(titles[0], [1; 3]), tile(titles[1], [2; 3]), tile(titles[2], [3; 3])];
        let whole = montage(&tiles, 2).unwrap();
        let (wide, high) = (width_px(titles[2]), 30 + LINE_PX + GAP_PX / 2);
        assert_eq!((whole.width, whole.height), (2 * wide + 3 * GAP_PX, 2 * high + 3 * GAP_PX));
        let top = GAP_PX + LINE_PX + GAP_PX / 2;
        let next = GAP_PX + wide + GAP_PX;
        assert_eq!([whole.get(GAP_PX, top), whole.get(next, top)], [[1; 3], [2; 3]]);
        assert_eq!(whole.get(GAP_PX + 39, top + high + GAP_PX + 29), [3; 3]);
        assert_eq!(whole.get(GAP_PX + 40, top), PAPER);
        assert_eq!(montage(&[], 3).unwrap().width, 1 + 2 * GAP_PX);
    }
}
