//! Owner of jobs, sets of jobs and uploads.

/// Owner of jobs, sets of jobs and uploads, by a short name. There is one, the default, until clients have keys.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Owner(String);

impl Owner {
    /// Makes the owner with this name.
    pub fn new(name: &str) -> Self {
        Self(name.to_owned())
    }

    /// Returns the name, as databases have it.
    pub fn name(&self) -> &str {
        &self.0
    }
}

impl Default for Owner {
    /// Returns the owner of everything that is posted without a key; rows from before there were owners are theirs.
    fn default() -> Self {
        Self::new("default")
    }
}
