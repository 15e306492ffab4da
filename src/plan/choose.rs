//! From effects to methods.

use crate::integrator::Method;

/// Which method computes the grids and which the views; `None` where the job has no such output.
#[derive(Clone, Debug)]
pub struct Methods {
    pub grids: Option<MethodChoice>,
    pub views: Option<MethodChoice>,
}

#[derive(Clone, Debug)]
pub struct MethodChoice {
    pub method: Method,
    pub reason: String,
}
