//! Jobs whose events are followed live: one reader per job, whatever the number of streams.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use axum::response::sse::Event as SseEvent;
use serde::Deserialize;
use tokio::sync::broadcast;
use uuid::Uuid;

use crate::http::event_schemas::ImageEvent;
use crate::job::events::{EventData, Image};
use crate::job::store::{Event, is_final_event};

/// Events read at once: what one stream costs in memory while it catches up.
pub const EVENTS_AT_ONCE: u32 = 64;

/// News that the reader of a job sends to its streams.
pub struct News {
    /// Id of the last event before this one: who has that has missed nothing.
    pub previous: i64,
    /// `None` tells where the reader begins.
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

/// The jobs that somebody watches now.
#[derive(Default)]
pub struct WatchedJobs {
    readers: Mutex<HashMap<Uuid, broadcast::Sender<Arc<News>>>>,
}

impl WatchedJobs {
    /// Number of jobs that have a reader.
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
