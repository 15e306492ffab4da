//! Results of a job from the files that it keeps when it has ended.

use std::collections::HashMap;
use std::sync::Arc;

use bytes::Bytes;

use super::kept_moments::moments_of_npy;
use super::{Found, ResultReader, failed};
use crate::annual::metrics::Value;
use crate::document::DocumentErrors;
use crate::document::result::tube_report::TubeReport;
use crate::document::result::{GridResult, SurfacesResult, TubeResult};
use crate::output::exr::{self, ViewImage};
use crate::output::{Raster, png};
use crate::present::annual::JobYear;
use crate::present::cache::Cache;
use crate::present::outputs::{Annual, Format, Output};
use crate::present::prepared::Prepared;
use crate::present::subject::Subject;

/// Years of jobs that have ended, by the key of [`Kept::years`], for the next files of these jobs.
pub type MadeYears = Cache<String, Found<Arc<JobYear>>>;

/// Largest number of bytes of the years of ended jobs that are kept.
const MOST_BYTES_OF_YEARS: usize = 128 << 20;

/// Returns a cache of the years of ended jobs.
pub fn made_years() -> MadeYears {
    MadeYears::new(MOST_BYTES_OF_YEARS, |made| match made {
        Ok(Some(year)) => year.bytes(),
        _ => 0,
    })
}

/// Results of a job that has ended, from the files that are kept of it. Of a job that has not begun there are none.
pub struct Kept {
    /// Description of the job.
    pub subject: Arc<Subject>,
    /// Kept files by name, as far as they were read.
    pub files: HashMap<String, Bytes>,
    /// Fluxes of the tubes, from the job's summary.
    pub tubes: Vec<TubeResult>,
    /// Prepares the job anew, for reports on its tubes.
    pub prepare: Box<dyn Fn() -> Result<Prepared, DocumentErrors> + Send>,
    /// Year of the job where it is known: nothing is read for it.
    pub year: Option<Arc<JobYear>>,
    /// Years of jobs that have ended, with the key of this job; `None` where no second file is asked for.
    pub years: Option<(Arc<MadeYears>, String)>,
}

impl Kept {
    fn read<T>(&self, output: Output, read: impl FnOnce(&[u8]) -> Result<T, String>) -> Found<T> {
        let name = output.file();
        self.files.get(&name).map(|bytes| read(bytes)).transpose().map_err(|error| failed(&name, error))
    }

    fn computed_year(&self) -> Found<Arc<JobYear>> {
        let document = self.subject.document.as_ref().filter(|document| document.annual.is_some());
        let Some(document) = document else { return Ok(None) };
        let grids = document.grids.iter().map(|grid| self.grid(&grid.name)).collect::<Result<Vec<_>, _>>()?;
        if grids.iter().any(Option::is_none) {
            return Ok(None);
        }
        let prepared = (self.prepare)().map_err(|errors| failed("annual", errors))?;
        prepared.year(0, || {
            let with_moments = |grid: GridResult| Ok((self.moments(&grid.name)?.unwrap_or_default(), grid));
            let grids = grids.into_iter().flatten().map(with_moments);
            grids.map(|found| found.map(|(moments, grid)| (grid, moments))).collect()
        })
    }
}

impl ResultReader for Kept {
    fn subject(&self) -> &Arc<Subject> {
        &self.subject
    }

    fn grid(&self, name: &str) -> Found<GridResult> {
        let read = |bytes: &[u8]| serde_json::from_slice(bytes).map_err(|error| error.to_string());
        self.read(Output::Grid(name.to_owned(), Format::Json), read)
    }

    fn surfaces(&self) -> Found<SurfacesResult> {
        let read = |bytes: &[u8]| serde_json::from_slice(bytes).map_err(|error| error.to_string());
        self.read(Output::Surfaces(Format::Json), read)
    }

    fn view(&self, name: &str) -> Found<ViewImage> {
        let read = |bytes: &[u8]| exr::decode(bytes).map_err(|error| error.to_string());
        self.read(Output::View(name.to_owned(), Format::Exr), read)
    }

    fn view_with_sources(&self, name: &str) -> Found<ViewImage> {
        self.view(name)
    }

    fn picture(&self, name: &str) -> Found<Raster> {
        let read = |bytes: &[u8]| png::decode(bytes).map_err(|error| error.to_string());
        self.read(Output::View(name.to_owned(), Format::Png), read)
    }

    fn tube(&self, number: usize) -> Found<TubeReport> {
        let Some(flux) = self.tubes.get(number) else { return Ok(None) };
        let prepared = (self.prepare)().map_err(|errors| failed(&format!("tubes/{number}"), errors))?;
        Ok(Some(prepared.tube_report(number, *flux)))
    }

    fn year(&self) -> Found<Arc<JobYear>> {
        if self.year.is_some() {
            return Ok(self.year.clone());
        }
        let Some((years, key)) = &self.years else { return self.computed_year() };
        let year = years.get(key.clone(), || self.computed_year());
        if !matches!(year, Ok(Some(_))) {
            years.forget(key);
        }
        year
    }

    fn moments(&self, name: &str) -> Found<Vec<Value>> {
        self.read(Output::Annual(Annual::Moments(name.to_owned()), Format::Npy), moments_of_npy)
    }
}
