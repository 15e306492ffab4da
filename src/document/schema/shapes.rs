//! Named schemas of numbers, for use as `#[schema(value_type = ...)]`.

use std::ops::{Bound, RangeInclusive};

use utoipa::openapi::RefOr;
use utoipa::openapi::schema::{ArrayBuilder, KnownFormat, ObjectBuilder, OneOfBuilder, Schema, SchemaFormat, Type};
use utoipa::{PartialSchema, ToSchema};

use crate::document::limits::{
    ALBEDO, CELLS, COORDINATE_M, EXITS, LIGHT, MESH_OFFSET, MESH_POSITION_M, OBSTRUCTION_SIZE_M, PIXELS_OF_AN_EDGE,
    RATIO, ROOM_EDGE_M, Range, SCATTERING_PER_SR, SIZE_M, TABLE_ANGLE_DEG, THRESHOLD_LUX, within,
};

/// Defines unit-like types, each of which stands for a schema in `#[schema(value_type = ...)]`.
macro_rules! named {
    ($($name:ident: $schema:expr;)*) => {$(
        pub struct $name;

        impl PartialSchema for $name {
            fn schema() -> RefOr<Schema> {
                RefOr::from($schema)
            }
        }

        impl ToSchema for $name {}
    )*};
}

named! {
    Vector: array(3, number(COORDINATE_M)).description(Some("x, y and z."));
    PlanePoint: array(2, number(COORDINATE_M)).description(Some("x and y in metres."));
    SensorPlace: array(6, number(COORDINATE_M))
        .description(Some("x, y and z in metres, and the direction that the sensor faces."));
    PlaneOffset: array(2, number(COORDINATE_M)).description(Some("East and north in metres."));
    RoomSize: array(3, number(ROOM_EDGE_M)).description(Some("Extent along x, y and z in metres."));
    HorizonPoint: array(2, number(within(-180.0, 360.0))).description(Some("Azimuth and altitude in degrees."));
    ObstructionSize: array(3, number(OBSTRUCTION_SIZE_M)).description(Some("Extent along x, y and z in metres."));
    MeshOffset: array(3, number(MESH_OFFSET)).description(Some("x, y and z in the file's units."));
    MeshPosition: array(3, number(MESH_POSITION_M)).description(Some("x, y and z in metres."));
    BoxSize: array(3, number(SIZE_M)).description(Some("Extent along x, y and z in metres."));
    CellCounts: array(2, integer(CELLS)).description(Some("Number of cells along x and y."));
    PixelCounts: array(2, integer(PIXELS_OF_AN_EDGE)).description(Some("Width and height in pixels."));
    Threshold: number(THRESHOLD_LUX).description(Some("In lux."));
    UsefulLimits: array(3, number(THRESHOLD_LUX)).description(Some("Ascending, in lux."));
    MonthlyFactors: array(12, number(RATIO)).description(Some("January first."));
    IsOccupied: integer(0..=1).description(Some("1 for an occupied hour."));
    TableAngle: number(TABLE_ANGLE_DEG).description(Some("In degrees from the normal."));
    ScatteringRow: ArrayBuilder::new()
        .items(number(SCATTERING_PER_SR))
        .min_items(Some(*EXITS.start()))
        .max_items(Some(*EXITS.end()))
        .description(Some("A value for each angle of exit, in 1/sr."));
    Albedo: one_or_rgb(|| number(ALBEDO))
        .description(Some("A reflectance below 1: one photopic number, or linear Rec.709 `[r, g, b]`."));
    Luminance: one_or_rgb(|| number(LIGHT))
        .description(Some("In cd/m2: one photopic number, or linear Rec.709 `[r, g, b]`."));
}

/// Returns the schema of a number within its range.
pub fn number(range: Range) -> ObjectBuilder {
    let number =
        ObjectBuilder::new().schema_type(Type::Number).format(Some(SchemaFormat::KnownFormat(KnownFormat::Double)));
    let number = match range.lowest {
        Bound::Included(lowest) => number.minimum(Some(lowest)),
        Bound::Excluded(lowest) => number.exclusive_minimum(Some(lowest)),
        Bound::Unbounded => number,
    };
    match range.highest {
        Bound::Included(highest) => number.maximum(Some(highest)),
        Bound::Excluded(highest) => number.exclusive_maximum(Some(highest)),
        Bound::Unbounded => number,
    }
}

fn integer(bounds: RangeInclusive<u32>) -> ObjectBuilder {
    ObjectBuilder::new().schema_type(Type::Integer).minimum(Some(*bounds.start())).maximum(Some(*bounds.end()))
}

/// Returns the schema of a list of this length.
pub fn array(length: usize, item: ObjectBuilder) -> ArrayBuilder {
    ArrayBuilder::new().items(item).min_items(Some(length)).max_items(Some(length))
}

/// Returns the schema of one number for all light, or one for each channel.
pub fn one_or_rgb(channel: impl Fn() -> ObjectBuilder) -> OneOfBuilder {
    let rgb = array(3, channel()).description(Some("Linear Rec.709 red, green, blue."));
    OneOfBuilder::new().item(channel().description(Some("The same for all light."))).item(rgb)
}
