//! Plan of a room with the map of a grid: colours, isolines, the room's outline, tubes and an arrow to north.

use glam::DVec2;

use super::axes::{self, Axes, Axis, beyond_ends, ticks_in};
use super::colour::{BLACK, Colour, WHITE};
use super::drawing::{Anchor, Drawing, Line, Type};
use super::heading::Heading;
use super::isolines::isolines;
use super::labels::{Taken, half_size};
use super::letters;
use super::outline::{Outline, Rectangle};
use super::plan_cells::{Cells, GridValues, NO_VALUE, draw_lines, label_lines};
use super::room_plan::{RoomPlan, draw_north};
use super::scale::{BAR_WIDTH, ColourScale, LABEL_WIDTH};
use super::ticks::{Steps, significant};
use crate::output::OutputError;

/// Largest width and height of the room in a figure, in pixels.
const MOST: DVec2 = DVec2::new(560.0, 620.0);

/// Smallest width of the plan in pixels, because headings need some width.
const LEAST_WIDTH: f64 = 330.0;

/// Height of the arrow to north above the colour bar, in pixels.
const NORTH_HEIGHT: f64 = 64.0;

/// Space for the lengths of walls above and to the right of the plan, in pixels.
const LENGTHS: f64 = 16.0;

/// Height of the legend of the least and the greatest value below the axes, in pixels.
const LEGEND_HEIGHT: f64 = 22.0;

/// Half the width of the marks of the least and the greatest value, in pixels.
const MARK: f64 = 5.5;

/// Smallest cell in which its value is written, in pixels.
const LEAST_NUMBERED: DVec2 = DVec2::new(20.0, 11.0);

/// Radius of the disc of a point, in pixels.
const POINT_RADIUS: f64 = 6.0;

/// Title of the upright axis.
const HEIGHT_TITLE: &str = "y in metres";

/// Largest number of points with numbers beside them.
const MOST_NUMBERED: usize = 100;

/// Display of the values in cells as numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Numbers {
    /// Colours and isolines alone.
    Hidden,
    /// Value of each cell, where there is room.
    Shown,
}

/// Plan of a room with the map of a grid.
#[derive(Clone, Debug, PartialEq)]
pub struct PlanMap {
    /// Title and lines above the figure.
    pub heading: Heading,
    /// Plan of the room.
    pub room: RoomPlan,
    /// Values of the grid.
    pub grid: GridValues,
    /// Colour scale of the values.
    pub scale: ColourScale,
    /// Unit of the values.
    pub unit: &'static str,
    /// Values of the isolines.
    pub levels: Vec<f64>,
    /// Display of the values in cells as numbers.
    pub numbers: Numbers,
}

impl PlanMap {
    /// Draws the figure; an error if the number of values is not that of the cells.
    pub fn draw(&self) -> Result<Drawing, OutputError> {
        let [low, high] = self.room.bounds();
        let room = (high - low).max(DVec2::splat(1e-3));
        let scale = (MOST / room).min_element();
        let plan = room * scale;
        let aside = 0.5 * (LEAST_WIDTH - plan.x).max(0.0);
        let left = axes::LEFT + aside;
        let bar_left = left + plan.x + LENGTHS + 26.0 + aside;
        let width = bar_left + BAR_WIDTH + LABEL_WIDTH;
        let beside = beyond_ends(HEIGHT_TITLE, plan.y);
        let top = self.heading.height(width) + LENGTHS + 8.0 + beside;
        let within = Rectangle { from: DVec2::new(left, top), to: DVec2::new(left, top) + plan };
        let size = DVec2::new(width, within.to.y.max(top + 240.0) + axes::BELOW + LEGEND_HEIGHT + 4.0);
        let mut drawing = Drawing::new(size, self.heading.title.as_str());
        let axis = |title: &str, from: f64, metres: f64| {
            Axis::linear(title, [from, from + metres], ticks_in(metres * scale), Steps::Decimal)
        };
        let axes = Axes { within, x: axis("x in metres", low.x, room.x), y: axis(HEIGHT_TITLE, low.y, room.y) };
        axes.draw(&mut drawing);
        let cells = self.grid.cells_in(&axes);
        let has_numbers = self.numbers == Numbers::Shown && cells.size().cmpge(LEAST_NUMBERED).all();
        let smooth = if has_numbers { self.grid.clone() } else { self.grid.refined() };
        let colours = smooth.colours(&self.scale)?;
        if self.grid.points.is_empty() {
            match has_numbers {
                true => drawing.picture(cells.place, colours),
                false => drawing.smooth_picture(cells.place, colours),
            }
            cells.hatch(&mut drawing, |cell| !self.grid.values[cell].is_finite() && !self.grid.is_outside(cell));
            cells.clear(&mut drawing, |cell| self.grid.is_outside(cell));
        }
        // cells at the walls may reach beyond the room, with the ends of hatches
        let covered =
            Rectangle { from: within.from.min(cells.place.from) - 1.0, to: within.to.max(cells.place.to) + 1.0 };
        self.room.cover_outside(&mut drawing, &axes, covered);
        axes.draw_frame(&mut drawing);
        self.heading.draw(&mut drawing);
        self.room.draw_objects_and_tubes(&mut drawing, &axes);
        self.room.draw_outline(&mut drawing, &axes);
        let fine = smooth.cells_in(&axes);
        let mut taken = Taken::default();
        self.room.draw_lengths(&mut drawing, &axes, &mut taken);
        if !self.grid.points.is_empty() {
            self.room.take_tubes(&axes, &mut taken);
            self.draw_points(&mut drawing, &axes, &mut taken);
            self.room.draw_tube_numbers(&mut drawing, &axes, &mut taken);
        } else if has_numbers {
            self.draw_numbers(&mut drawing, &cells);
        } else {
            let lines = isolines(smooth.cells, &smooth.values, &self.levels)?;
            draw_lines(&mut drawing, &fine, &lines);
            self.room.take_tubes(&axes, &mut taken);
            self.room.take_partitions(&axes, &mut taken);
            self.draw_extremes(&mut drawing, &cells, &mut taken);
            self.room.draw_tube_numbers(&mut drawing, &axes, &mut taken);
            label_lines(&mut drawing, &fine, &lines, &mut taken);
        }
        let bar = Rectangle::new(
            bar_left,
            top + NORTH_HEIGHT + 24.0,
            bar_left + BAR_WIDTH,
            within.to.y.min(top + 460.0).max(top + 240.0),
        );
        self.scale.draw(&mut drawing, bar, self.unit);
        draw_north(&mut drawing, DVec2::new(bar_left + 22.0, top + 0.5 * NORTH_HEIGHT), self.room.rotation_deg);
        Ok(drawing)
    }

    /// Draws discs in the colours of the values at points; where these are few, with their numbers counted from 1, and below with their values
    /// if these are wanted.
    fn draw_points(&self, drawing: &mut Drawing, axes: &Axes, taken: &mut Taken) {
        let are_few = self.grid.points.len() <= MOST_NUMBERED;
        let look = Type::new(11.0, BLACK).rimmed(WHITE);
        for (index, (point, value)) in self.grid.points.iter().zip(&self.grid.values).enumerate() {
            let [red, green, blue] = if value.is_finite() { self.scale.colour(*value) } else { NO_VALUE };
            let at = axes.at(point.x, point.y);
            if !axes.within.contains(at) {
                continue;
            }
            let disc = Outline::circle(at, POINT_RADIUS);
            drawing.filled_line(disc, Colour::Fixed([red, green, blue]), Line::new(BLACK, 1.0));
            taken.add(Rectangle { from: at - POINT_RADIUS, to: at + POINT_RADIUS });
            if !are_few {
                continue;
            }
            let mut write = |text: &str, sides: [DVec2; 4]| {
                let aside = half_size(text, look) + POINT_RADIUS + 1.0;
                taken.write(drawing, &axes.within, (text, look), sides.map(|side| at + side * aside).into_iter());
            };
            if self.numbers == Numbers::Shown && value.is_finite() {
                write(&significant(*value, 3), [DVec2::Y, DVec2::NEG_Y, DVec2::X, DVec2::NEG_X]);
            }
            let number = format!("no. {}", index + 1);
            write(&number, [DVec2::X, DVec2::NEG_X, DVec2::NEG_Y, DVec2::Y]);
        }
    }

    /// Marks the least and the greatest value, and writes both below the axes.
    fn draw_extremes(&self, drawing: &mut Drawing, cells: &Cells, taken: &mut Taken) {
        let finite = || self.grid.values.iter().copied().enumerate().filter(|(_, value)| value.is_finite());
        let greatest = finite().max_by(|a, b| a.1.total_cmp(&b.1));
        let least = finite().min_by(|a, b| a.1.total_cmp(&b.1));
        let mut legend = DVec2::new(cells.axes_left, drawing.size.y - 0.5 * LEGEND_HEIGHT - 2.0);
        let marked = [("maximum", greatest, -1.0), ("minimum", least, 1.0)];
        for (name, (cell, value), down) in marked.into_iter().filter_map(|(name, cell, down)| Some((name, cell?, down)))
        {
            let columns = self.grid.cells[0];
            let at = cells.at(DVec2::new((cell % columns) as f64 + 0.5, (cell / columns) as f64 + 0.5));
            for place in [at, legend + MARK] {
                let corners = [DVec2::new(-MARK, -MARK), DVec2::new(MARK, -MARK), DVec2::new(0.0, MARK)];
                let mark = Outline::polygon(corners.map(|corner| place + DVec2::new(1.0, down) * corner));
                drawing.line(mark.clone(), Line::new(WHITE, 3.0));
                drawing.fill(mark, BLACK, 1.0);
            }
            taken.add(Rectangle { from: at - MARK, to: at + MARK });
            let text = format!("{name} {} {}", significant(value, 3), self.unit);
            legend.x += 2.0 * MARK + 6.0;
            drawing.text_centred(legend + DVec2::new(0.0, MARK), text.as_str(), Type::new(12.0, Colour::Ink));
            legend.x += letters::width(&text, 12.0) + 24.0;
        }
    }

    fn draw_numbers(&self, drawing: &mut Drawing, cells: &Cells) {
        let columns = self.grid.cells[0];
        let size = (0.3 * cells.size().x).min(0.6 * cells.size().y).clamp(6.0, 11.0);
        for (cell, value) in self.grid.values.iter().enumerate() {
            let at = cells.at(DVec2::new((cell % columns) as f64 + 0.5, (cell / columns) as f64 + 0.5));
            let [red, green, blue] = self.scale.colour(*value).map(f64::from);
            // dark on light and light on dark
            let ink = if 0.3 * red + 0.59 * green + 0.11 * blue > 140.0 { BLACK } else { WHITE };
            if !value.is_finite() {
                continue;
            }
            let text = significant(*value, 3);
            drawing.text_centred(at, text, Type::new(size, ink).anchored(Anchor::Middle));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::figure::drawing::{Direction, Item, Words};
    use crate::figure::scale::Palette;
    use crate::figure::svg::svg;
    use crate::geometry::OpeningFrame;
    use crate::scene::OpeningShape;

    fn map(cells: [usize; 2], numbers: Numbers) -> PlanMap {
        let [columns, rows] = cells;
        let value = |cell: usize| {
            let at = DVec2::new((cell % columns) as f64 + 0.5, (cell / columns) as f64 + 0.5);
            let at = at / DVec2::new(columns as f64, rows as f64) - 0.5;
            600.0 * libm::exp(-6.0 * at.length_squared())
        };
        let values: Vec<f64> = (0..columns * rows).map(value).collect();
        PlanMap {
            heading: Heading { title: "floor".to_owned(), lines: vec!["mean 211 lx".to_owned()], ..Heading::default() },
            room: RoomPlan {
                rings: vec![[(0.0, 0.0), (4.0, 0.0), (4.0, 6.0), (0.0, 6.0)].map(DVec2::from).to_vec()],
                rotation_deg: 20.0,
                tubes: vec![(
                    OpeningFrame::level(DVec2::new(2.0, 3.0).extend(2.5)),
                    OpeningShape::Disc { radius: 0.175 },
                )],
                objects: vec![[(0.2, 4.0), (1.8, 4.0), (1.8, 5.8), (0.2, 5.8)].map(DVec2::from).to_vec()],
            },
            grid: GridValues {
                cells,
                from_m: DVec2::ZERO,
                to_m: DVec2::new(4.0, 6.0),
                values,
                points: Vec::new(),
                outside: Vec::new(),
            },
            scale: ColourScale::from_zero(600.0, Palette::Viridis),
            unit: "lx",
            levels: vec![100.0, 200.0, 300.0, 500.0],
            numbers,
        }
    }

    #[test]
    fn a_plan_names_its_lines_ticks_and_marks() {
        let drawing = map([16, 24], Numbers::Hidden).draw().unwrap();
        let texts: Vec<&str> = drawing.texts().collect();
        for text in [
            "floor",
            "mean 211 lx",
            "x in metres",
            "tube 1",
            "4 m",
            "6 m",
            "lx",
            "N",
            "0",
            "100",
            "200",
            "300",
            "500",
            "600",
        ] {
            assert!(texts.contains(&text), "{text}: {texts:?}");
        }
        assert!(texts.iter().any(|text| text.starts_with("maximum 59")), "{texts:?}");
        // on the bar, and on a line
        assert_eq!(texts.iter().filter(|text| **text == "300").count(), 2, "{texts:?}");
    }

    /// No label of any of these plans covers another one.
    #[test]
    fn labels_cover_nothing() {
        for (columns, tubes, rings) in [(16, 1, 1), (16, 5, 2), (40, 40, 2), (3, 300, 1)] {
            let mut map = map([columns, 24], Numbers::Hidden);
            let place = |tube: usize| DVec2::new(0.2 + 0.37 * (tube % 10) as f64, 0.3 + 0.19 * (tube / 10) as f64);
            map.room.tubes = (0..tubes)
                .map(|tube| (OpeningFrame::level(place(tube).extend(2.5)), OpeningShape::Disc { radius: 0.08 }))
                .collect();
            let l = [(0.0, 0.0), (4.0, 0.0), (4.0, 5.6), (3.6, 5.6), (3.6, 5.8), (2.0, 5.8), (2.0, 6.0), (0.0, 6.0)];
            if rings > 1 {
                map.room.rings = vec![l.map(DVec2::from).to_vec()];
            }
            map.levels = (1..30).map(|level| 20.0 * f64::from(level)).collect();
            let drawing = map.draw().unwrap();
            let labels = drawing.items.iter().filter_map(|item| match item {
                Item::Words(words) => Some(region(words)),
                Item::Shape(_) | Item::Picture(_) => None,
            });
            let labels: Vec<Rectangle> = labels.collect();
            let meet = |a: &Rectangle, b: &Rectangle| a.from.cmplt(b.to).all() && b.from.cmplt(a.to).all();
            for (index, label) in labels.iter().enumerate() {
                assert!(!labels[..index].iter().any(|other| meet(label, other)), "{label:?}");
            }
            assert!(labels.len() > 20);
        }
    }

    /// Labels of lines stand where a partition would be, but not where one is.
    #[test]
    fn labels_keep_clear_of_partitions() {
        let on_line = |x: f64, is_there: bool| {
            let mut map = map([40, 40], Numbers::Hidden);
            map.room.objects = if is_there { vec![vec![DVec2::new(x, 0.0), DVec2::new(x, 6.0)]] } else { Vec::new() };
            map.levels = (1..30).map(|level| 20.0 * f64::from(level)).collect();
            let drawing = map.draw().unwrap();
            let words = || {
                drawing.items.iter().filter_map(|item| match item {
                    Item::Words(words) => Some(words),
                    Item::Shape(_) | Item::Picture(_) => None,
                })
            };
            let middle = |words: &Words| words.at.x + 0.5 * words.width;
            let [one, two] = ["1", "2"].map(|tick| words().find(|words| words.text == tick).map(middle).unwrap());
            let at = one + (two - one) * (x - 1.0);
            let labels = words().filter(|words| words.text.parse::<f64>().is_ok_and(|level| level >= 20.0)).map(region);
            labels.filter(|label| label.from.x < at && at < label.to.x).count()
        };
        let places = [0.8, 1.2, 1.6, 2.4, 2.8, 3.2];
        assert!(places.iter().any(|x| on_line(*x, false) > 0));
        assert!(places.iter().all(|x| on_line(*x, true) == 0));
    }

    /// Returns the rectangle of the capitals of a text.
    fn region(words: &Words) -> Rectangle {
        let high = letters::CAPITAL_HEIGHT * words.size;
        match words.direction {
            Direction::Level => Rectangle::new(words.at.x, words.at.y - high, words.at.x + words.width, words.at.y),
            Direction::Upwards => Rectangle::new(words.at.x - high, words.at.y - words.width, words.at.x, words.at.y),
        }
    }

    #[test]
    fn cells_have_their_numbers_where_there_is_room() {
        let texts = |cells| map(cells, Numbers::Shown).draw().unwrap().texts().count();
        assert!(texts([16, 24]) > 16 * 24);
        assert!(texts([160, 240]) < 100);
    }

    /// Cells that reach beyond the walls do not widen the frame, and cover neither heading nor scale.
    #[test]
    fn cells_beyond_the_walls_are_cut() {
        let drawn = |to_m: DVec2| {
            let mut map = map([16, 24], Numbers::Hidden);
            map.grid.to_m = to_m;
            map.draw().unwrap()
        };
        let [whole, cut] = [DVec2::new(4.0, 6.0), DVec2::new(4.2, 6.2)].map(drawn);
        assert_eq!(whole.size, cut.size);
        let kind = |item: &Item| match item {
            Item::Words(_) => "words",
            Item::Shape(_) => "shape",
            Item::Picture(_) => "picture",
        };
        let kinds: Vec<&str> = cut.items.iter().map(kind).collect();
        let picture = kinds.iter().position(|kind| *kind == "picture").unwrap();
        let title = cut.items.iter().position(|item| matches!(item, Item::Words(words) if words.text == "floor"));
        assert!(title.unwrap() > picture + 1);
    }

    /// Cells in solids are hatched, those outside of the room or too near a wall are left empty.
    #[test]
    fn cells_near_walls_are_empty() {
        let hatched = |outside: Vec<bool>| {
            let mut map = map([16, 24], Numbers::Hidden);
            for cell in 0..16 {
                map.grid.values[cell] = f64::NAN;
            }
            map.grid.outside = outside;
            let drawing = map.draw().unwrap();
            let shapes = drawing.items.iter().filter_map(|item| match item {
                Item::Shape(shape) => Some(shape.outline.0.len()),
                Item::Words(_) | Item::Picture(_) => None,
            });
            // a diagonal has a start and an end, a rectangle four corners and a close
            shapes.fold((0, 0), |(lines, cells), parts| {
                (lines + usize::from(parts == 32), cells + usize::from(parts == 80))
            })
        };
        assert_eq!([hatched(Vec::new()), hatched((0..384).map(|cell| cell < 16).collect())], [(1, 0), (0, 1)]);
    }

    /// An L-shaped plan covers the cells outside, and points are drawn as discs with their values.
    #[test]
    fn plans_of_other_shapes_and_points() {
        let mut map = map([4, 6], Numbers::Shown);
        let l = [(0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (2.0, 3.0), (2.0, 6.0), (0.0, 6.0)];
        map.room.rings =
            vec![l.map(DVec2::from).to_vec(), [(0.5, 0.5), (1.0, 1.0), (1.0, 0.5)].map(DVec2::from).to_vec()];
        map.grid.values[23] = f64::NAN;
        let drawing = map.draw().unwrap();
        let svg = svg(&drawing).unwrap();
        assert!(!svg.contains("NaN"));
        map.grid = GridValues {
            cells: [2, 1],
            points: vec![DVec2::ONE, DVec2::splat(2.0)],
            values: vec![250.0, f64::NAN],
            ..map.grid
        };
        let texts: Vec<String> = map.draw().unwrap().texts().map(str::to_owned).collect();
        assert!(texts.contains(&"250".to_owned()), "{texts:?}");
    }

    #[test]
    fn drawn_for_every_shape_and_number() {
        for cells in [[1, 1], [1, 300], [300, 1]] {
            let mut map = map(cells, Numbers::Hidden);
            map.grid.values.iter_mut().step_by(3).for_each(|value| *value = f64::NAN);
            let svg = svg(&map.draw().unwrap()).unwrap();
            assert!(!svg.contains("NaN") && !svg.contains("inf"));
        }
        let mut short = map([2, 2], Numbers::Hidden);
        short.grid.values.pop();
        assert!(short.draw().is_err());
        let mut narrow = map([2, 2], Numbers::Hidden);
        narrow.room.rings = RoomPlan::rectangle(DVec2::ZERO, DVec2::new(0.5, 80.0)).rings;
        narrow.grid.to_m = DVec2::new(0.5, 80.0);
        assert!(narrow.draw().unwrap().size.x < 700.0);
    }
}
