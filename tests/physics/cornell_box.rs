//! The Cornell box (scene S4) by SPPM against means of 8 x 8 pixel blocks by a public path tracer and light tracer.

use crate::reference;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use crate::documents::Folder;
use skyduct::document::{JobDocument, to_scene};
use skyduct::integrator::Integrator;
use skyduct::integrator::sppm::{Settings, Sppm};
use skyduct::optics::spectrum::REC709_LUMINANCE;
use skyduct::plan::{self, EffectRequests, Effects};
use skyduct::statistics::Moments;

/// Blocks along each side of the image, and pixels of ours along each side of a block.
const BLOCKS: usize = 32;
const PIXELS: usize = 4;
const PASSES: u64 = 64;

/// Every block's luminance within 5 combined standard errors (with 63 degrees of freedom, a false alarm in 1024 blocks has
/// a probability of 0.5 %), SPPM's estimated bias included; the mean of each
/// channel within 4 standard errors and the 0.13 % by which the reference's own renderers differ.
#[test]
fn agrees_with_the_reference() {
    let mut document = reference::json("scenes/S4.json");
    document["views"][0]["size_px"] = serde_json::json!([BLOCKS * PIXELS, BLOCKS * PIXELS]);
    let document = JobDocument::parse(document.to_string().as_bytes()).unwrap();
    let (scene, ..) = to_scene(&document, &Folder).unwrap();
    let kernel = plan::compile(&scene, &Effects::of(&scene, &EffectRequests::new())).unwrap();
    let method = Sppm::<3>::new(Arc::new(kernel), &[], &scene.views, &Settings::default(), 1);

    let mut luminance = vec![Moments::default(); BLOCKS * BLOCKS];
    let mut bias = luminance.clone();
    let mut channels = [Moments::default(); 3];
    for pass in 0..PASSES {
        let pass = method.pass(pass, &AtomicBool::new(false)).unwrap();
        let view = &pass.views[0];
        let (mut y, mut b, mut rgb) = (vec![0.0; BLOCKS * BLOCKS], vec![0.0; BLOCKS * BLOCKS], [0.0; 3]);
        for (pixel, of_pixel) in view.luminance.chunks_exact(3).enumerate() {
            let (column, row) = (pixel % (BLOCKS * PIXELS), pixel / (BLOCKS * PIXELS));
            let block = row / PIXELS * BLOCKS + column / PIXELS;
            let share = 1.0 / (PIXELS * PIXELS) as f64;
            for channel in 0..3 {
                y[block] += REC709_LUMINANCE[channel] * of_pixel[channel] * share;
                rgb[channel] += of_pixel[channel] / (view.luminance.len() / 3) as f64;
            }
            b[block] += view.bias[pixel] * share;
        }
        luminance.iter_mut().zip(y).for_each(|(moments, value)| moments.push(value));
        bias.iter_mut().zip(b).for_each(|(moments, value)| moments.push(value));
        channels.iter_mut().zip(rgb).for_each(|(moments, value)| moments.push(value));
        assert!(pass.account.ledger.relative_closure_error().abs() < 1e-9);
    }

    let truth = reference::json("scenes/S4.blocks.reference.json");
    let block_of = |key: &str, block: usize| -> [f64; 3] {
        let value = &truth[key][block / BLOCKS][block % BLOCKS];
        std::array::from_fn(|channel| value[channel].as_f64().unwrap())
    };
    let weighted = |rgb: [f64; 3]| (0..3).map(|c| REC709_LUMINANCE[c] * rgb[c]).sum::<f64>();
    let (mut worst, mut squares, mut lit) = ((0.0, 0), 0.0, 0);
    for block in 0..BLOCKS * BLOCKS {
        // the channels' errors in one path are fully correlated
        let (expected, expected_error) =
            (weighted(block_of("rgb", block)), weighted(block_of("standard_error", block)));
        let found = &luminance[block];
        let bias = (bias[block].mean.powi(2) - bias[block].variance_of_mean()).max(0.0);
        let error = (found.variance_of_mean() + bias + expected_error.powi(2)).sqrt();
        let z = (found.mean - expected).abs() / error;
        if expected > 0.0 {
            (squares, lit) = (squares + z * z, lit + 1);
        }
        if z > worst.0 {
            worst = (z, block);
        }
    }
    println!(
        "worst z {:.2} in block {}, rms z {:.2} over {lit} blocks",
        worst.0,
        worst.1,
        (squares / f64::from(lit)).sqrt()
    );
    for channel in 0..3 {
        let expected = truth["mean_rgb"][channel].as_f64().unwrap();
        let (mean, error) = (channels[channel].mean, channels[channel].standard_error());
        println!("channel {channel}: {mean:.6} +- {error:.6}, reference {expected:.6}");
        assert!((mean - expected).abs() < 4.0 * error + 0.0013 * expected && error < 0.005 * expected);
    }
    assert!(lit == 900 && worst.0 < 5.0);
}
