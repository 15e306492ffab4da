//! OpenEXR files (the only user of exr).

use std::io::Cursor;

use exr::prelude::{AnyChannel, AnyChannels, Encoding, FlatSamples, Layer, LayerAttributes, Text, WritableImage};

use super::{Image, OutputError};

/// An image as an EXR file of 32-bit floats, top row first.
///
/// Channels: `Y` in cd/m2, or linear Rec.709 `R`, `G`, `B` (their Y in cd/m2); `standard_error` of Y in cd/m2; `samples`,
/// the number of passes behind each pixel. Numbers are written as they are, infinite and not-a-number included.
/// `comments` goes into the header.
pub fn encode(image: Image, standard_error: &[f64], samples: f64, comments: &str) -> Result<Vec<u8>, OutputError> {
    image.check()?;
    let [width, height] = image.size_px;
    if standard_error.len() != width * height {
        return Err(OutputError::Size { values: standard_error.len(), width, height, channels: 1 });
    }
    let channel = |name: &str, values: Vec<f32>| AnyChannel::new(Text::from(name), FlatSamples::F32(values));
    let names: &[&str] = if image.channels == 3 { &["R", "G", "B"] } else { &["Y"] };
    let colours = names.iter().enumerate().map(|(index, name)| {
        channel(name, image.values.iter().skip(index).step_by(image.channels).map(|value| *value as f32).collect())
    });
    let others = [
        channel("standard_error", standard_error.iter().map(|value| *value as f32).collect()),
        channel("samples", vec![samples as f32; width * height]),
    ];
    let attributes = LayerAttributes {
        software_name: Some(Text::from(concat!("skyduct ", env!("CARGO_PKG_VERSION")))),
        comments: Text::new_or_none(comments),
        ..LayerAttributes::default()
    };
    let channels = AnyChannels::sort(colours.chain(others).collect());
    let layer = Layer::new((width, height), attributes, Encoding::FAST_LOSSLESS, channels);
    let mut bytes = Cursor::new(Vec::new());
    // its own thread pool per file would compete with the passes
    let write = exr::prelude::Image::from_layer(layer);
    write.write().non_parallel().to_buffered(&mut bytes).map_err(|error| OutputError::Exr(error.to_string()))?;
    Ok(bytes.into_inner())
}

#[cfg(test)]
mod tests {
    use super::*;
    use exr::prelude::{ReadChannels, ReadLayers, read};

    #[test]
    fn floats_come_back_as_they_were() {
        let values: Vec<f64> = (0..6).flat_map(|k| [f64::from(k), 1.3e9, -0.5]).collect();
        let errors = [f64::INFINITY, f64::NAN, 0.25, 1.0, 2.0, 3.0];
        let image = Image { size_px: [3, 2], channels: 3, values: &values };
        let bytes = encode(image, &errors, 64.0, "a note").unwrap();
        let read = read().no_deep_data().largest_resolution_level().all_channels().first_valid_layer().all_attributes();
        let read = read.non_parallel().from_buffered(Cursor::new(bytes)).unwrap().layer_data;
        let names: Vec<_> = read.channel_data.list.iter().map(|channel| channel.name.to_string()).collect();
        assert_eq!(names, ["B", "G", "R", "samples", "standard_error"]);
        let values: Vec<Vec<f32>> =
            read.channel_data.list.iter().map(|channel| channel.sample_data.values_as_f32().collect()).collect();
        assert_eq!(values[2], [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]);
        assert_eq!(values[1], [1.3e9; 6]);
        assert_eq!(values[3], [64.0; 6]);
        assert!(values[4][0].is_infinite() && values[4][1].is_nan());
        assert_eq!(values[4][2..], [0.25, 1.0, 2.0, 3.0]);
    }

    #[test]
    fn wrong_sizes_are_refused() {
        let image = Image { size_px: [2, 2], channels: 1, values: &[0.0; 4] };
        assert!(encode(image, &[0.0; 3], 1.0, "").is_err());
        assert!(encode(image, &[0.0; 4], 1.0, "").is_ok());
        assert!(encode(Image { size_px: [0, 0], channels: 1, values: &[] }, &[], 1.0, "").is_err());
    }
}
