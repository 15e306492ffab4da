//! Reading and writing of OpenEXR files; no other module uses the `exr` crate.

use std::io::Cursor;

use exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, Layer, LayerAttributes, ReadChannels, ReadLayers, Text,
    WritableImage, read,
};

use super::seen::SeenView;
use super::smooth::smoothed;
use super::{Image, OutputError};
use crate::VERSION;

/// Layers of a view's file besides its colour channels.
#[derive(Clone, Copy, Debug)]
pub struct Layers<'a> {
    /// Standard error of the luminance in cd/m2.
    pub standard_error: &'a [f64],
    /// Number of passes that each pixel averages.
    pub samples: f64,
    /// True for pixels whose middle sees a light source, an opening, or out of the room.
    pub sources: &'a [bool],
}

/// An image read from a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Decoded {
    size_px: [usize; 2],
    channels: usize,
    values: Vec<f64>,
    standard_error: Vec<f64>,
    sources: Vec<bool>,
}

impl Decoded {
    /// Returns the image as it was written.
    pub fn image(&self) -> Image<'_> {
        Image { size_px: self.size_px, channels: self.channels, values: &self.values }
    }

    /// Returns the same image with values that are smoothed within their errors, for pictures.
    pub fn smoothed(self) -> Self {
        let values = smoothed(self.image(), &self.standard_error);
        Self { values, ..self }
    }

    /// Returns the luminances of the image and its mask of pixels that see sources.
    pub fn seen(&self) -> SeenView {
        SeenView { size_px: self.size_px, luminances: self.image().luminances(), sources: self.sources.clone() }
    }
}

/// Reads a file that [`encode`] wrote; the mask of sources is empty for older files without the layer `source`.
pub fn decode(bytes: &[u8]) -> Result<Decoded, OutputError> {
    let failed = |error: exr::error::Error| OutputError::Exr(error.to_string());
    let read = read().no_deep_data().largest_resolution_level().all_channels().first_valid_layer().all_attributes();
    let layer = read.non_parallel().from_buffered(Cursor::new(bytes)).map_err(failed)?.layer_data;
    let channel = |name: &str| {
        let found = layer.channel_data.list.iter().find(|channel| channel.name.eq(name));
        found.map(|channel| channel.sample_data.values_as_f32().collect::<Vec<f32>>())
    };
    let colours: Vec<Vec<f32>> = match channel("Y") {
        Some(luminance) => vec![luminance],
        None => ["R", "G", "B"].into_iter().filter_map(channel).collect(),
    };
    let size_px = [layer.size.width(), layer.size.height()];
    let pixels = colours.iter().map(Vec::len).min().unwrap_or(0);
    let values: Vec<f64> =
        (0..pixels).flat_map(|pixel| colours.iter().map(move |colour| f64::from(colour[pixel]))).collect();
    let sources = channel("source").map_or_else(Vec::new, |layer| layer.iter().map(|source| *source > 0.5).collect());
    let standard_error = channel("standard_error").unwrap_or_default().into_iter().map(f64::from).collect();
    let decoded = Decoded { size_px, channels: colours.len(), values, standard_error, sources };
    decoded.image().check()?;
    Ok(decoded)
}

/// Encodes an image as an EXR file of 32-bit floats, top row first.
///
/// Channels: `Y` in cd/m2, or linear Rec.709 `R`, `G`, `B` (their Y in cd/m2); `standard_error` of Y in cd/m2; `samples`, the number of
/// passes that each pixel averages; `source`, 1 for pixels whose middle sees a light source, an opening, or out of the room, else 0.
/// Numbers are written as they are, infinite and not-a-number included. `comments` goes into the header.
pub fn encode(image: Image, layers: Layers, comments: &str) -> Result<Vec<u8>, OutputError> {
    image.check()?;
    let [width, height] = image.size_px;
    let Layers { standard_error, samples, sources } = layers;
    if let Some(values) = [standard_error.len(), sources.len()].into_iter().find(|values| *values != width * height) {
        return Err(OutputError::Size { values, width, height, channels: 1 });
    }
    let channel = |name: &str, values: Vec<f32>| AnyChannel::new(Text::from(name), FlatSamples::F32(values));
    let names: &[&str] = if image.channels == 3 { &["R", "G", "B"] } else { &["Y"] };
    let colours = names.iter().enumerate().map(|(index, name)| {
        channel(name, image.values.iter().skip(index).step_by(image.channels).map(|value| *value as f32).collect())
    });
    let others = [
        channel("standard_error", standard_error.iter().map(|value| *value as f32).collect()),
        channel("samples", vec![samples as f32; width * height]),
        channel("source", sources.iter().map(|source| f32::from(u8::from(*source))).collect()),
    ];
    let attributes = LayerAttributes {
        software_name: Some(Text::from(format!("skyduct {VERSION}").as_str())),
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

    #[test]
    fn floats_come_back_as_they_were() {
        let values: Vec<f64> = (0..6).flat_map(|k| [f64::from(k), 1.3e9, -0.5]).collect();
        let errors = [f64::INFINITY, f64::NAN, 0.25, 1.0, 2.0, 3.0];
        let image = Image { size_px: [3, 2], channels: 3, values: &values };
        let sources = [false, true, false, false, false, true];
        let layers = Layers { standard_error: &errors, samples: 64.0, sources: &sources };
        let bytes = encode(image, layers, "a note").unwrap();
        let decoded = decode(&bytes).unwrap();
        assert_eq!((decoded.image().size_px, decoded.image().channels), ([3, 2], 3));
        assert_eq!(decoded.values[3..6], [1.0, 1.3e9, -0.5]);
        assert_eq!(decoded.seen().sources, sources);
        let read = read().no_deep_data().largest_resolution_level().all_channels().first_valid_layer().all_attributes();
        let read = read.non_parallel().from_buffered(Cursor::new(bytes)).unwrap().layer_data;
        let names: Vec<_> = read.channel_data.list.iter().map(|channel| channel.name.to_string()).collect();
        assert_eq!(names, ["B", "G", "R", "samples", "source", "standard_error"]);
        let values: Vec<Vec<f32>> =
            read.channel_data.list.iter().map(|channel| channel.sample_data.values_as_f32().collect()).collect();
        assert_eq!(values[2], [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]);
        assert_eq!(values[1], [1.3e9; 6]);
        assert_eq!(values[3], [64.0; 6]);
        assert!(values[5][0].is_infinite() && values[5][1].is_nan());
        assert_eq!(values[5][2..], [0.25, 1.0, 2.0, 3.0]);
    }

    #[test]
    fn wrong_sizes_are_refused() {
        let image = Image { size_px: [2, 2], channels: 1, values: &[0.0; 4] };
        let layers = Layers { standard_error: &[0.0; 4], samples: 1.0, sources: &[false; 4] };
        assert!(encode(image, layers, "").is_ok());
        assert!(encode(image, Layers { standard_error: &[0.0; 3], ..layers }, "").is_err());
        assert!(encode(image, Layers { sources: &[], ..layers }, "").is_err());
        assert!(encode(Image { size_px: [0, 0], channels: 1, values: &[] }, layers, "").is_err());
        assert!(decode(b"no file").is_err());
    }
}
