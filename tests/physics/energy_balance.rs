//! Energy balance of methods that follow no photon in the room: where a few photons end stands for all of the light.

use std::sync::atomic::AtomicBool;

use crate::scenes::{self, bent, domed, furnished, lambertian, traceable, with_sun};
use skyduct::integrator::Integrator;
use skyduct::integrator::method::{Computation, Described, Task};
use skyduct::integrator::photon::energy_balance::EnergyBalance;
use skyduct::integrator::two_stage;
use skyduct::scene::{EstimateKind, Scene, Transition, Tube};
use skyduct::statistics::Moments;

const PASSES: u64 = 96;

/// Entries of the energy balance as means over passes, each pass closed to rounding.
fn balance(method: &dyn Integrator) -> [Moments; 10] {
    let mut entries = [Moments::default(); 10];
    for pass in 0..PASSES {
        let pass = method.pass(pass, &AtomicBool::new(false)).unwrap();
        let mut energy: EnergyBalance = pass.totals.energy;
        assert!(energy.relative_closure_error().abs() < 1e-12, "{energy:?}");
        entries.iter_mut().zip(energy.values_mut()).for_each(|(moments, value)| moments.push(*value));
    }
    entries
}

fn built(scene: &Scene, settings: &dyn Described) -> Box<dyn Integrator> {
    let traceable = traceable(scene);
    let task = Task::whole(scene, &traceable);
    assert_eq!(settings.refuses(&task), None);
    match settings.build(&task, 3, 0.01) {
        Computation::Passes(integrator) => integrator,
        Computation::Solution(_) => panic!("it has passes"),
    }
}

/// Every entry is that of light tracing, within four combined standard errors: a bent tube whose diffuser reflects, one under a
/// dome that refracts, a box, gloss, and a luminaire that hangs in the room.
#[test]
fn every_entry_is_that_of_light_tracing() {
    compare_entries([bent(lambertian(0.5, 0.4)), domed(lambertian(0.6, 0.3))]);
}

/// Square closures below transitions that absorb do not change that.
#[test]
fn every_entry_of_squares_is_that_of_light_tracing() {
    let squared =
        |tube: Tube| Tube { transition: Some(Transition { side_m: 0.3, azimuth: 0.4, transmittance: 0.8 }), ..tube };
    compare_entries([squared(bent(lambertian(0.5, 0.4))), squared(domed(lambertian(0.6, 0.3)))]);
}

fn compare_entries(tubes: [Tube; 2]) {
    let mut scene = furnished(tubes, EstimateKind::Point);
    with_sun(&mut scene, 30_000.0, 50.0);
    scene.grids[0].cells = [1, 1];
    (scene.grids[0].x_m, scene.grids[0].y_m) = (vec![1.0], vec![1.0]);
    let stages =
        two_stage::Settings { photons_per_pass: Some(2048), samples_per_sensor: Some(1), ..Default::default() };
    let found = balance(built(&scene, &stages).as_ref());
    let truth = balance(&*scenes::light_tracing(&scene, 4096, 5));
    for (entry, (found, truth)) in found.iter().zip(&truth).enumerate() {
        let error = found.standard_error().hypot(truth.standard_error());
        let difference = (found.mean - truth.mean).abs();
        // the flux of luminaires is exact, but for rounding
        assert!(difference <= 4.0 * error + 1e-12 * truth.mean, "entry {entry}: {found:?} {truth:?}");
        assert!(error <= 0.02 * truth.mean.max(found.mean) || entry >= 8, "entry {entry}: {error}");
    }
    // light comes in by both ways, and room and diffusers absorb it
    assert!(found[0].mean > 0.0 && found[5].mean > 0.0 && found[6].mean > 0.0, "{found:?}");
}
