//! Energy that electric light saves by dimming: an upper estimate, of one zone with one ideal sensor that sees the mean illuminance.

use super::Value;
use super::points::Illuminances;

/// Electric light of a zone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dimming {
    /// Illuminance in lux that daylight and electric light give together, > 0.
    pub setpoint_lux: f64,
    /// Power in W/m2 at full light.
    pub power_w_m2: f64,
    /// Smallest fraction of the power.
    pub least_power: f64,
    /// Smallest fraction of the light, below 1.
    pub least_light: f64,
    /// True if the light is off when daylight suffices.
    pub switches_off: bool,
}

impl Default for Dimming {
    fn default() -> Self {
        Self { setpoint_lux: 500.0, power_w_m2: 6.0, least_power: 0.1, least_light: 0.1, switches_off: false }
    }
}

/// Energy of a zone over a year, in kWh.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Energy {
    /// Energy without dimming.
    pub full_kwh: f64,
    /// Energy that dimming saves.
    pub saved_kwh: Value,
    /// Energy that lamps would save whose power is in proportion to their light, down to nothing.
    pub saved_at_most_kwh: Value,
}

impl Dimming {
    /// Computes the fraction of the power at an illuminance by daylight.
    pub fn power_fraction(&self, lux: f64) -> f64 {
        let need = self.need(lux);
        if self.switches_off && need == 0.0 {
            return 0.0;
        }
        let rise = (need - self.least_light) / (1.0 - self.least_light);
        (self.least_power + (1.0 - self.least_power) * rise).max(self.least_power)
    }

    /// Computes the energies of a zone of `area_m2` over occupied records of `hours` each, from the mean illuminance in it.
    pub fn energy(&self, mean: &Illuminances, area_m2: f64, hours: f64) -> Energy {
        let full_kwh = 1e-3 * area_m2 * self.power_w_m2 * hours * mean.records as f64;
        let dark = mean.records.saturating_sub(mean.lit_lux.len()) as f64;
        let saved = |fraction: &dyn Fn(f64) -> f64| {
            let used =
                mean.sum_over_lit(fraction).plus(dark * fraction(0.0)).times(full_kwh / mean.records.max(1) as f64);
            Value { value: full_kwh - used.value, ..used }
        };
        let saved_kwh = saved(&|lux| self.power_fraction(lux));
        let at_most = saved(&|lux| self.need(lux));
        // each takes off what noise adds to it, which is different for the two
        let at_most = Value { value: at_most.value.max(saved_kwh.value), ..at_most };
        Energy { full_kwh, saved_kwh, saved_at_most_kwh: at_most }
    }

    fn need(&self, lux: f64) -> f64 {
        (1.0 - lux / self.setpoint_lux).clamp(0.0, 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Checks a dark, a half lit and a bright record of a zone of 10 m2 with 6 W/m2, by hand.
    #[test]
    fn lamps_follow_the_daylight() {
        let dimming = Dimming::default();
        let year = Illuminances { lit_lux: vec![250.0, 500.0], records: 3, ..Illuminances::default() };
        let energy = dimming.energy(&year, 10.0, 0.5);
        assert!((energy.full_kwh - 0.09).abs() < 1e-15);
        // power 1, 0.1 + 0.9 x 0.4 / 0.9 = 0.5, and 0.1
        assert!((energy.saved_kwh.value - 0.03 * 1.4).abs() < 1e-12, "{energy:?}");
        assert!((energy.saved_at_most_kwh.value - 0.03 * 1.5).abs() < 1e-12);
        // noise about as large as the light, beside the kinks of both curves
        let noisy =
            Illuminances { lit_lux: vec![440.0], noise_lux: vec![300.0], records: 1, ..Illuminances::default() };
        let energy = dimming.energy(&noisy, 10.0, 1.0);
        assert!(energy.saved_at_most_kwh.value >= energy.saved_kwh.value, "{energy:?}");
        let off = Dimming { switches_off: true, ..dimming };
        assert_eq!([off.power_fraction(500.0), dimming.power_fraction(500.0)], [0.0, 0.1]);
        assert_eq!(dimming.power_fraction(470.0), 0.1);
    }
}
