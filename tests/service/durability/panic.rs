//! A render that panics ends, and tells.

use std::sync::mpsc;

use crate::common::{PATIENCE, small_job};
use skyduct::document::NoFiles;
use skyduct::engine::cancel::Stop;
use skyduct::engine::passes::SoFar;
use skyduct::engine::progress::PassReport;
use skyduct::engine::spent::Spent;
use skyduct::present::prepared::prepare;

#[test]
fn a_panic_in_a_pass_does_not_hang_it() {
    let (sender, receiver) = mpsc::channel();
    std::thread::spawn(move || {
        let prepared = prepare(small_job().to_string().as_bytes(), &NoFiles).unwrap();
        let (mut estimate, mut spent) = (prepared.empty_estimate(), Spent::NOTHING);
        let chunk = std::panic::AssertUnwindSafe(|| {
            let mut heard = |_: &PassReport, _: SoFar<'_>| panic!("in the middle of a job");
            let stop = Stop::default();
            stop.within(60.0, || prepared.render_pass(&mut estimate, &mut spent, &stop, &mut heard))
        });
        sender.send(std::panic::catch_unwind(chunk).is_err()).unwrap();
    });
    assert_eq!(receiver.recv_timeout(PATIENCE), Ok(true), "the panic comes out");
}
