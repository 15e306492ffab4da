//! Light outdoors in sentences: how much the sky and the sun give, and where these levels come from.

use serde::Deserialize;
use serde_json::Value;

use crate::document::provenance::{BeamSource, SunProvenance, ZenithFormulaName, ZenithProvenance};
use crate::figure::ticks::significant;

/// Tells the level of the sky; `None` without a sky. `provenance` is that of a job as the service returns it.
pub fn sky(provenance: &Value) -> Option<String> {
    let of = ZenithProvenance::deserialize(&provenance["zenith"]).ok()?;
    if of.horizontal_illuminance_lux <= 0.0 {
        return Some("The sky is dark.".to_owned());
    }
    let [lux, zenith] = [of.horizontal_illuminance_lux, of.zenith_luminance_cd_m2].map(short);
    let mut sentences =
        vec![format!("Open level ground has {lux} lx of the sky, and the zenith {zenith} cd/m²: {}.", source(&of))];
    if let Some(ratio) = of.ratio_to_mean_overcast {
        let share = significant(ratio, 2);
        sentences.push(format!("That is {share} of the mean of measured overcast skies with the sun at this height."));
    }
    if let Some((clearness, brightness)) = of.clearness.zip(of.brightness) {
        let [clearness, brightness] = [clearness, brightness].map(short);
        sentences.push(format!(
            "The all-weather sky of Perez has a clearness of {clearness} and a brightness of {brightness}."
        ));
    }
    Some(sentences.join(" "))
}

/// Says where the level of a sky comes from.
fn source(of: &ZenithProvenance) -> String {
    let ratio =
        || of.dv_ev.map_or_else(String::new, |ratio| format!("{} of the light above the atmosphere", short(ratio)));
    match of.formula {
        ZenithFormulaName::GivenZenithLuminance => "the document gives the luminance of the zenith".to_owned(),
        ZenithFormulaName::GivenHorizontalIlluminance => "the document gives the illuminance".to_owned(),
        ZenithFormulaName::GivenDvEv => format!("the document gives {}", ratio()),
        ZenithFormulaName::DvEv => format!("typical of this type of sky, {}", ratio()),
        ZenithFormulaName::LuminousTurbidity => {
            format!("by {}", of.luminous_turbidity.map_or_else(|| "the turbidity of the air".to_owned(), turbidity))
        }
        ZenithFormulaName::IesHorizontalIlluminance => "by the formula of the IES".to_owned(),
        ZenithFormulaName::LuminousEfficacy => "from the diffuse irradiance and its luminous efficacy".to_owned(),
    }
}

/// Tells position and beam of the sun; `None` where it does not shine.
pub fn sun(provenance: &Value) -> Option<String> {
    let of = SunProvenance::deserialize(&provenance["sun"]).ok().filter(|sun| sun.on)?;
    let place = of.position_deg().map_or_else(String::new, |[altitude, azimuth]| {
        let [altitude, azimuth] = [altitude, azimuth].map(short);
        format!("The sun stands {altitude}° high at an azimuth of {azimuth}°. ")
    });
    let [facing, level] = [of.normal_illuminance_lux, of.horizontal_illuminance_lux].map(short);
    let source = match of.source {
        BeamSource::Given => ": the document gives it".to_owned(),
        BeamSource::SunlessType => String::new(),
        BeamSource::Turbidity { luminous_turbidity } => format!(": by {}", turbidity(luminous_turbidity)),
        BeamSource::Ies { extinction } => {
            format!(": by the formula of the IES, with an extinction of {}", short(extinction))
        }
        BeamSource::LuminousEfficacy => ": from the direct irradiance and its luminous efficacy".to_owned(),
    };
    Some(format!("{place}Its beam gives {facing} lx to what faces it and {level} lx to open level ground{source}."))
}

fn turbidity(of: f64) -> String {
    format!("a luminous turbidity of the air of {}", short(of))
}

/// Writes a number with three digits.
fn short(value: f64) -> String {
    significant(value, 3)
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    #[test]
    fn levels_are_told_in_sentences() {
        let zenith = json!({ "formula": "dv_ev", "dv_ev": 0.15, "zenith_luminance_cd_m2": 4058.6,
                             "horizontal_illuminance_lux": 11242.2, "ratio_to_mean_overcast": 0.9319 });
        let sun = json!({ "on": true, "source": { "kind": "turbidity", "luminous_turbidity": 3.0 }, "normal_illuminance_lux": 81234.0,
                          "horizontal_illuminance_lux": 48857.0, "altitude_deg": 34.069, "azimuth_deg": 174.757 });
        let provenance = json!({ "zenith": zenith, "sun": sun });
        assert_eq!(
            super::sky(&provenance).unwrap(),
            "Open level ground has 11\u{a0}200 lx of the sky, and the zenith 4060 cd/m²: typical of this type of sky, 0.150 of the light \
             above the atmosphere. That is 0.93 of the mean of measured overcast skies with the sun at this height."
        );
        assert_eq!(
            super::sun(&provenance).unwrap(),
            "The sun stands 34.1° high at an azimuth of 175°. Its beam gives 81\u{a0}200 lx to what faces it and 48\u{a0}900 lx to open \
             level ground: by a luminous turbidity of the air of 3.00."
        );
    }

    #[test]
    fn a_sun_that_does_not_shine_and_a_room_without_a_sky_are_not_told() {
        let sun = json!({ "on": false, "source": { "kind": "sunless_type" }, "normal_illuminance_lux": 0.0, "horizontal_illuminance_lux": 0.0,
                          "altitude_deg": 34.0, "azimuth_deg": 170.0 });
        assert_eq!(super::sun(&json!({ "zenith": null, "sun": sun })), None);
        assert_eq!(super::sky(&json!({ "zenith": null, "sun": null })), None);
    }
}
