pub fn convergence_svg(_: &[crate::job::run::PassReport]) -> String { unimplemented!() }
