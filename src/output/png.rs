//! PNG files, and the tone mapping of luminance images.

use super::{Image, OutputError, Raster, percentile};

/// Value on the display of the log-average luminance (Reinhard et al. 2002, "key").
const KEY: f64 = 0.18;

/// Lower bound of the exposed luminance that is shown white.
const LEAST_WHITE: f64 = 0.5;

/// Exposed luminance that is shown white where the exposure is given: 44 times that of middle grey.
const FIXED_WHITE: f64 = 8.0;

/// Fraction of the brightest luminance below which pixels are left out of the log-average, so that a black frame does not set the exposure.
const DARKEST_COUNTED: f64 = 1e-4;

/// Encodes an sRGB picture as a PNG file.
pub fn encode(raster: &Raster) -> Result<Vec<u8>, OutputError> {
    encode_with_origin(raster, "")
}

/// Encodes an sRGB picture as a PNG file, with the program and document that it is made by as its `Software`, if they are not empty.
pub fn encode_with_origin(raster: &Raster, origin: &str) -> Result<Vec<u8>, OutputError> {
    let failed = |error: png::EncodingError| OutputError::Png(error.to_string());
    let side = |side: usize| u32::try_from(side).map_err(|error| OutputError::Png(error.to_string()));
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, side(raster.width)?, side(raster.height)?);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    // a tenth of the time of the usual level, for files that are some tenths larger
    encoder.set_compression(png::Compression::Fast);
    encoder.set_source_srgb(png::SrgbRenderingIntent::RelativeColorimetric);
    if !origin.is_empty() {
        encoder.add_itxt_chunk("Software".to_owned(), origin.to_owned()).map_err(failed)?;
    }
    let mut writer = encoder.write_header().map_err(failed)?;
    writer.write_image_data(&raster.pixels).map_err(failed)?;
    writer.finish().map_err(failed)?;
    Ok(bytes)
}

/// Reads the picture from a file that [`encode`] wrote.
pub fn decode(bytes: &[u8]) -> Result<Raster, OutputError> {
    let failed = |error: png::DecodingError| OutputError::Png(error.to_string());
    let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().map_err(failed)?;
    let size = reader.output_buffer_size().ok_or_else(|| OutputError::Png("the picture is too large".to_owned()))?;
    let mut pixels = vec![0; size];
    let frame = reader.next_frame(&mut pixels).map_err(failed)?;
    pixels.truncate(frame.buffer_size());
    let (width, height) = (frame.width as usize, frame.height as usize);
    if frame.color_type != png::ColorType::Rgb || pixels.len() != 3 * width * height {
        return Err(OutputError::Size { values: pixels.len(), width, height, channels: 3 });
    }
    Ok(Raster { width, height, pixels })
}

/// Renders a luminance image in sRGB as an eye adapted to it would see it.
pub fn tone_mapped(image: Image) -> Result<Raster, OutputError> {
    ToneMapping::of(image)?.apply(image)
}

/// Global tone mapping operator of Reinhard et al. 2002 (equation 4), adapted to one image.
///
/// The log-average luminance is exposed to 18 %, and the brightest half percent of the pixels above zero goes to white; the ratios of the
/// channels are kept. Black stays black, infinite values are white, and not-a-number is magenta.
#[derive(Clone, Copy, Debug)]
pub struct ToneMapping {
    /// Exposure: factor per cd/m2.
    exposure: f64,
    /// Exposed luminance that is shown white.
    white: f64,
}

impl ToneMapping {
    /// Adapts the operator to an image; fails if the number of values does not match its size.
    pub fn of(image: Image) -> Result<Self, OutputError> {
        image.check()?;
        let luminances = image.luminances();
        let lit = || luminances.iter().copied().filter(|y| y.is_finite() && *y > 0.0);
        let brightest = percentile(lit(), 0.995).unwrap_or(1.0);
        let counted = || lit().filter(|y| *y >= DARKEST_COUNTED * brightest);
        let number = counted().count().max(1) as f64;
        let log_average = libm::exp(counted().map(libm::log).sum::<f64>() / number);
        let exposure = KEY / log_average;
        // never below about three times the average, so that an even image is not stretched to white
        Ok(Self { exposure, white: (exposure * brightest).max(LEAST_WHITE) })
    }

    /// Returns the operator adapted to a given luminance in cd/m2 (> 0), which is shown as middle grey, so that several images get the same
    /// exposure. White is 44 times as bright.
    pub fn adapted_to(adaptation_cd_m2: f64) -> Self {
        Self { exposure: KEY / adaptation_cd_m2, white: FIXED_WHITE }
    }

    /// Returns the luminance in cd/m2 that is shown as middle grey.
    pub fn adaptation_cd_m2(&self) -> f64 {
        KEY / self.exposure
    }

    /// Renders an image, the one adapted to or another, as seen by an eye with this adaptation.
    pub fn apply(&self, image: Image) -> Result<Raster, OutputError> {
        image.check()?;
        let Self { exposure, white } = self;
        let luminances = image.luminances();
        let [width, height] = image.size_px;
        let mut raster = Raster::filled(width, height, [0; 3]);
        for ((pixel, channels), y) in
            raster.pixels.chunks_exact_mut(3).zip(image.values.chunks_exact(image.channels)).zip(&luminances)
        {
            let exposed = exposure * y;
            // (1 + L / white^2) / (1 + L), written so that an L of any size stays finite
            let compression = 1.0 / (1.0 + exposed) + exposed / (1.0 + exposed) / (white * white);
            for (index, byte) in pixel.iter_mut().enumerate() {
                let channel = channels.get(index).unwrap_or(&channels[0]);
                *byte = if y.is_nan() || channel.is_nan() {
                    if index == 1 { 0 } else { 255 }
                } else if y.is_infinite() {
                    255
                } else {
                    srgb_byte(exposure * channel * compression)
                };
            }
        }
        Ok(raster)
    }
}

/// Encodes linear light as an sRGB byte (IEC 61966-2-1), clipped to 0..1.
pub fn srgb_byte(linear: f64) -> u8 {
    let linear = linear.clamp(0.0, 1.0);
    let encoded = if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * libm::pow(linear, 1.0 / 2.4) - 0.055 };
    (255.0 * encoded).round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map(values: &[f64]) -> Vec<u8> {
        tone_mapped(Image { size_px: [values.len(), 1], channels: 1, values }).unwrap().pixels
    }

    #[test]
    fn defined_for_every_number() {
        assert_eq!(map(&[0.0; 4]), [0; 12]);
        assert_eq!(map(&[f64::NAN]), [255, 0, 255]);
        let pixels = map(&[f64::INFINITY, 1e300, 1e-300, -1.0, 100.0, f64::NEG_INFINITY]);
        assert_eq!(pixels[..3], [255; 3]);
        assert_eq!(pixels[9..12], [0; 3]);
        // an even image is a middle grey at any level: L (1 + L / white^2) / (1 + L)
        let grey = srgb_byte(KEY * (1.0 + KEY / (LEAST_WHITE * LEAST_WHITE)) / (1.0 + KEY));
        for level in [1e-9, 1.0, 2e9] {
            assert_eq!(map(&[level; 9]), [grey; 27], "{level}");
        }
    }

    #[test]
    fn a_given_exposure_shows_equal_luminances_alike() {
        let dark = Image { size_px: [2, 1], channels: 1, values: &[10.0, 20.0] };
        let bright = Image { size_px: [2, 1], channels: 1, values: &[20.0, 5000.0] };
        let tone = ToneMapping::adapted_to(20.0);
        assert!((tone.adaptation_cd_m2() - 20.0).abs() < 1e-12);
        assert_eq!(tone.apply(dark).unwrap().get(1, 0), tone.apply(bright).unwrap().get(0, 0));
        assert!((ToneMapping::of(dark).unwrap().adaptation_cd_m2() - 200f64.sqrt()).abs() < 1e-9);
    }

    #[test]
    fn brighter_stays_brighter() {
        let values: Vec<f64> = (0..200).map(|k| 1e-2 * 1.06f64.powi(k)).collect();
        let bytes = map(&values);
        assert!(bytes.windows(4).all(|window| window[3] >= window[0]));
        assert_eq!(bytes[599], 255);
    }

    #[test]
    fn colours_keep_their_ratio() {
        let values = [0.5, 0.25, 0.125, 0.5, 0.25, 0.125];
        let raster = tone_mapped(Image { size_px: [2, 1], channels: 3, values: &values }).unwrap();
        let linear = |byte: u8| ((f64::from(byte) / 255.0 + 0.055) / 1.055).powf(2.4);
        let [r, g, b] = raster.get(0, 0).map(linear);
        // half a step of 8 bits at these levels is below 2 %
        assert!((r / g - 2.0).abs() < 0.04 && (g / b - 2.0).abs() < 0.04, "{r} {g} {b}");
    }

    #[test]
    fn files_read_back() {
        let mut raster = Raster::filled(5, 3, [1, 2, 3]);
        raster.set(4, 2, [9, 8, 7]);
        let bytes = encode(&raster).unwrap();
        let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut pixels).unwrap();
        assert_eq!((info.width, info.height), (5, 3));
        assert_eq!(pixels, raster.pixels);
        assert!(tone_mapped(Image { size_px: [2, 2], channels: 1, values: &[0.0; 3] }).is_err());
    }
}
