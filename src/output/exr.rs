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

/// Image of a view with all layers of its file.
#[derive(Clone, Debug, PartialEq)]
pub struct ViewImage {
    /// Width and height in pixels.
    pub size_px: [usize; 2],
    /// Number of channels, 1 or 3.
    pub channels: usize,
    /// Pixel values in cd/m2, as [`Image`] has them.
    pub values: Vec<f64>,
    /// Standard error of the luminance of each pixel in cd/m2.
    pub standard_error: Vec<f64>,
    /// Number of passes that each pixel averages.
    pub samples: f64,
    /// True for pixels whose middle sees a light source, an opening, or out of the room; empty if not known.
    pub sources: Vec<bool>,
    /// Comments in the header of the file.
    pub comments: String,
}

impl ViewImage {
    /// Returns size and values.
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
pub fn decode(bytes: &[u8]) -> Result<ViewImage, OutputError> {
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
    let samples = channel("samples").and_then(|layer| layer.first().copied()).map_or(0.0, f64::from);
    let comments = layer.attributes.comments.as_ref().map(Text::to_string).unwrap_or_default();
    let view = ViewImage { size_px, channels: colours.len(), values, standard_error, samples, sources, comments };
    view.image().check()?;
    Ok(view)
}

/// Encodes an image as an EXR file of 32-bit floats, top row first.
///
/// Channels: `Y` in cd/m2, or linear Rec.709 `R`, `G`, `B` (their Y in cd/m2); `standard_error` of Y in cd/m2; `samples`, the number of
/// passes that each pixel averages; `source`, 1 for pixels whose middle sees a light source, an opening, or out of the room, else 0.
/// Numbers are written as they are, infinite and not-a-number included.
pub fn encode(view: &ViewImage) -> Result<Vec<u8>, OutputError> {
    let image = view.image();
    image.check()?;
    let [width, height] = image.size_px;
    let ViewImage { standard_error, samples, sources, comments, .. } = view;
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
        channel("samples", vec![*samples as f32; width * height]),
        channel("source", sources.iter().map(|source| f32::from(u8::from(*source))).collect()),
    ];
    let attributes = LayerAttributes {
        software_name: Some(Text::from(format!("skyduct {VERSION}").as_str())),
        comments: Text::new_or_none(comments.as_str()),
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
        let sources = vec![false, true, false, false, false, true];
        let standard_error = vec![f64::INFINITY, f64::NAN, 0.25, 1.0, 2.0, 3.0];
        let (size_px, comments) = ([3, 2], "a note".to_owned());
        let view = ViewImage { size_px, channels: 3, values, standard_error, samples: 64.0, sources, comments };
        let bytes = encode(&view).unwrap();
        let decoded = decode(&bytes).unwrap();
        assert_eq!((decoded.size_px, decoded.channels, decoded.samples), ([3, 2], 3, 64.0));
        assert_eq!(decoded.comments, "a note");
        assert_eq!((&decoded.values, decoded.seen().sources), (&view.values, view.sources));
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
        let (values, standard_error, sources) = (vec![0.0; 4], vec![0.0; 4], vec![false; 4]);
        let (size_px, comments) = ([2, 2], String::new());
        let view = ViewImage { size_px, channels: 1, values, standard_error, samples: 1.0, sources, comments };
        assert!(encode(&view).is_ok());
        assert!(encode(&ViewImage { standard_error: vec![0.0; 3], ..view.clone() }).is_err());
        assert!(encode(&ViewImage { sources: Vec::new(), ..view.clone() }).is_err());
        assert!(encode(&ViewImage { size_px: [0, 0], values: Vec::new(), ..view }).is_err());
        assert!(decode(b"no file").is_err());
    }
}
