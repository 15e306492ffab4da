//! Jobs whose events are followed live, with one reader per job, whatever the number of streams.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use axum::response::sse::Event as SseEvent;
use serde::Deserialize;
use tokio::sync::broadcast;
use uuid::Uuid;

use crate::http::event_schemas::ImageEvent;
use crate::queue::events::{EventData, Image};
use crate::queue::store::{Event, is_final_event};

/// Number of events read at once, which bounds the memory of a stream that catches up.
pub const EVENTS_AT_ONCE: u32 = 64;

/// Message from the reader of a job to the job's streams.
pub struct News {
    /// Id of the last event before this one: a stream that has sent that one has missed nothing.
    pub previous: i64,
    /// New event; `None` in the first message, which says only where the reader begins.
    pub event: Option<SentEvent>,
}

/// An event in the form in which it is sent.
#[derive(Clone)]
pub struct SentEvent {
    pub seq: i64,
    /// True if no event comes after it.
    pub is_final: bool,
    pub text: SseEvent,
}

/// Jobs that have open streams now.
#[derive(Default)]
pub struct WatchedJobs {
    readers: Mutex<HashMap<Uuid, broadcast::Sender<Arc<News>>>>,
}

impl WatchedJobs {
    /// Returns the number of jobs that have a reader.
    pub fn count(&self) -> usize {
        self.lock().len()
    }

    pub(super) fn lock(&self) -> MutexGuard<'_, HashMap<Uuid, broadcast::Sender<Arc<News>>>> {
        // a map of senders is never left half changed
        self.readers.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl SentEvent {
    pub fn new(job: Uuid, event: &Event) -> Self {
        let mut data = event.data.clone();
        if event.name == Image::NAME
            && let Ok(image) = Image::deserialize(&event.data)
            && let Ok(told) = serde_json::to_value(ImageEvent::new(job, image))
        {
            data = told;
        }
        let text = SseEvent::default().id(event.seq.to_string()).event(&event.name).data(data.to_string());
        Self { seq: event.seq, is_final: is_final_event(&event.name), text }
    }
}
