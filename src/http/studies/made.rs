//! Files of studies that were made for readers, and the tags by which readers recognise what they already have.

use std::collections::{HashMap, VecDeque};
use std::sync::{Arc, Mutex, PoisonError};

use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use bytes::Bytes;
use uuid::Uuid;

use crate::http::content::none_match;
use crate::http::problem::Problem;
use crate::queue::store::*;

/// Largest number of bytes of made files that are kept; the newest one is kept in any case.
const MOST_KEPT_BYTES: usize = 32 << 20;

/// Cache of files that were made, the newest last, with locks for making more.
pub struct StudyFiles {
    /// Lock held while the results of a study are compared with its reference.
    pub evaluating: tokio::sync::Mutex<()>,
    /// Lock held while a file is made of films, which are large: one file at a time.
    making: Arc<tokio::sync::Mutex<()>>,
    kept: Arc<Mutex<VecDeque<Kept>>>,
    /// Id of this process, a part of all tags: another process may make a different file of the same jobs.
    process: Uuid,
}

struct Kept {
    tag: String,
    bytes: Bytes,
}

impl Default for StudyFiles {
    fn default() -> Self {
        Self {
            evaluating: tokio::sync::Mutex::default(),
            making: Arc::default(),
            kept: Arc::default(),
            process: Uuid::now_v7(),
        }
    }
}

impl StudyFiles {
    /// Computes the tag of a file of a study from the present state of its jobs, before the file is made.
    pub fn tag(&self, study: &JobSet, heads: &HashMap<Uuid, JobHead>, of: &str) -> String {
        let mut hasher = blake3::Hasher::new();
        hasher.update(self.process.as_bytes()).update(study.id.as_bytes());
        for member in &study.members {
            let state = heads.get(&member.job).map(|head| (head.status, head.stopped_by));
            hasher.update(format!("{state:?}").as_bytes());
        }
        hasher.update(of.as_bytes()).finalize().to_hex().to_string()
    }

    /// Returns the file with this tag, as it was made before, or made by `make` off the async threads. One file is made at a time.
    /// Readers that wait for the same file share it, and a file that was begun is kept even if its reader disconnects.
    pub async fn get_or_make(
        &self,
        tag: String,
        make: impl FnOnce() -> Result<Vec<u8>, Problem> + Send + 'static,
    ) -> Result<Bytes, Problem> {
        if let Some(bytes) = found(&self.kept, &tag) {
            return Ok(bytes);
        }
        let turn = self.making.clone().lock_owned().await;
        if let Some(bytes) = found(&self.kept, &tag) {
            return Ok(bytes);
        }
        let kept = self.kept.clone();
        let made = tokio::task::spawn_blocking(move || {
            let _turn = turn;
            let bytes = Bytes::from(make()?);
            keep(&kept, Kept { tag, bytes: bytes.clone() });
            Ok(bytes)
        });
        made.await.map_err(|error| Problem::failed("making a file of a study panicked", &error))?
    }
}

fn found(kept: &Mutex<VecDeque<Kept>>, tag: &str) -> Option<Bytes> {
    let kept = kept.lock().unwrap_or_else(PoisonError::into_inner);
    kept.iter().find(|kept| kept.tag == tag).map(|kept| kept.bytes.clone())
}

fn keep(kept: &Mutex<VecDeque<Kept>>, new: Kept) {
    let mut kept = kept.lock().unwrap_or_else(PoisonError::into_inner);
    kept.push_back(new);
    while kept.len() > 1 && kept.iter().map(|kept| kept.bytes.len()).sum::<usize>() > MOST_KEPT_BYTES {
        kept.pop_front();
    }
}

/// Answers 304 to a client that already has the version named by `etag` (quotes included); `None` for all others.
pub fn unchanged(headers: &HeaderMap, etag: &str) -> Option<Response> {
    none_match(headers, etag).then(|| tagged(StatusCode::NOT_MODIFIED.into_response(), etag))
}

/// Adds the tag (quotes included) to an answer.
pub fn tagged(mut answer: Response, etag: &str) -> Response {
    if let Ok(etag) = HeaderValue::try_from(etag) {
        answer.headers_mut().insert(header::ETAG, etag);
        answer.headers_mut().insert(header::CACHE_CONTROL, HeaderValue::from_static("no-cache"));
    }
    answer
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::*;

    /// Simultaneous readers share one made file, one file is made at a time, and no more bytes are kept than allowed.
    #[tokio::test(flavor = "multi_thread", worker_threads = 2)]
    async fn files_are_made_once_and_one_at_a_time() {
        let files = StudyFiles::default();
        let [made, running] = [(); 2].map(|()| Arc::new(AtomicUsize::new(0)));
        let read = |number: usize, length: usize| {
            let (made, running) = (made.clone(), running.clone());
            files.get_or_make(format!("tag {number}"), move || {
                assert_eq!(running.fetch_add(1, Ordering::SeqCst), 0);
                std::thread::sleep(std::time::Duration::from_millis(5));
                running.fetch_sub(1, Ordering::SeqCst);
                made.fetch_add(1, Ordering::SeqCst);
                Ok(vec![number as u8; length])
            })
        };
        let all = futures::future::join_all((0..24).map(|reader| read(reader % 2, 9))).await;
        assert!(all.iter().enumerate().all(|(reader, bytes)| bytes.as_ref().unwrap()[..] == [(reader % 2) as u8; 9]));
        assert_eq!(made.load(Ordering::SeqCst), 2);
        read(2, MOST_KEPT_BYTES + 1).await.unwrap();
        assert_eq!(files.kept.lock().unwrap().len(), 1);
        read(2, 0).await.unwrap();
        read(1, 9).await.unwrap();
        assert_eq!(made.load(Ordering::SeqCst), 4, "the large one was kept, and took the others' place");
    }
}
