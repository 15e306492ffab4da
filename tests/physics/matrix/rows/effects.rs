//! Effects that are switched off are left out by every method.

use skyduct::plan::EffectKind;
use skyduct::scene::EstimateKind::CellAverage;
use skyduct::scene::Tube;

use super::super::row::Row;
use crate::scenes::{bent, clear, domed, furnished, lambertian};

fn matt() -> [Tube; 2] {
    [bent(lambertian(0.5, 0.4)), domed(lambertian(0.6, 0.2))]
}

fn with_clear() -> [Tube; 2] {
    [bent(lambertian(0.5, 0.4)), bent(clear())]
}

pub fn no_interreflection_cells() -> Row {
    Row::new(furnished(matt(), CellAverage)).without(EffectKind::Interreflection)
}

pub fn no_guide_return_cells() -> Row {
    Row::new(furnished(matt(), CellAverage)).without(EffectKind::GuideReturn)
}

pub fn no_guide_return_clear_cells() -> Row {
    Row::new(furnished(with_clear(), CellAverage)).without(EffectKind::GuideReturn)
}

pub fn no_objects_cells() -> Row {
    Row::new(furnished(with_clear(), CellAverage)).without(EffectKind::Objects)
}
