//! Replicates of the responses of rooms that the process keeps, by what they depend on.
//!
//! A kept replicate is the one that would be computed anew: what is kept changes times, never a bit.

use std::collections::{HashMap, VecDeque};
use std::fmt::{self, Debug, Write};
use std::hash::{BuildHasher, Hasher, RandomState};
use std::sync::{Arc, LazyLock, Mutex, PoisonError};

use super::room::RoomPass;

/// Bytes of all replicates together, of all rooms.
const MOST_BYTES: usize = 128 << 20;

/// What a room's replicates depend on, as two hashes with secrets of the process.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Content([u64; 2]);

/// The secrets: nobody can make two rooms fall together on purpose.
static SECRETS: LazyLock<[RandomState; 2]> = LazyLock::new(|| [RandomState::new(), RandomState::new()]);

impl Content {
    /// The content of something whose derived text tells everything: no field is forgotten, and numbers are written in digits
    /// that read back exactly.
    pub fn of(everything: &impl Debug) -> Self {
        struct Hashing([<RandomState as BuildHasher>::Hasher; 2]);
        impl Write for Hashing {
            fn write_str(&mut self, text: &str) -> fmt::Result {
                self.0.iter_mut().for_each(|hasher| hasher.write(text.as_bytes()));
                Ok(())
            }
        }
        let [first, second] = &*SECRETS;
        let mut hashing = Hashing([first.build_hasher(), second.build_hasher()]);
        let written = write!(hashing, "{everything:?}");
        debug_assert!(written.is_ok(), "hashing cannot fail");
        Self(hashing.0.map(|hasher| hasher.finish()))
    }
}

/// Everything that is kept, the room that was asked for last at the end.
#[derive(Default)]
struct Memory {
    rooms: VecDeque<(Content, HashMap<u64, (Arc<RoomPass>, usize)>)>,
    bytes: usize,
}

static MEMORY: LazyLock<Mutex<Memory>> = LazyLock::new(Mutex::default);

/// The replicates of one room.
#[derive(Debug)]
pub struct Kept(Content);

impl Kept {
    /// Those of the room with this content.
    pub fn of(content: Content) -> Self {
        Self(content)
    }

    /// A replicate, if it is kept.
    pub fn get(&self, pass: u64) -> Option<Arc<RoomPass>> {
        let mut memory = memory();
        let place = memory.rooms.iter().position(|(content, _)| *content == self.0)?;
        let room = memory.rooms.remove(place)?;
        let found = room.1.get(&pass).map(|(kept, _)| kept.clone());
        memory.rooms.push_back(room);
        found
    }

    /// Keeps a replicate of `bytes`; other rooms make way for it, and where it alone is too large it is not kept.
    pub fn put(&self, pass: u64, replicate: &Arc<RoomPass>, bytes: usize) {
        let mut memory = memory();
        let memory = &mut *memory;
        let place = memory.rooms.iter().position(|(content, _)| *content == self.0);
        let mut room = place.and_then(|place| memory.rooms.remove(place)).unwrap_or((self.0, HashMap::new()));
        while memory.bytes + bytes > MOST_BYTES
            && let Some((_, other)) = memory.rooms.pop_front()
        {
            memory.bytes -= other.values().map(|(_, bytes)| bytes).sum::<usize>();
        }
        if memory.bytes + bytes <= MOST_BYTES && room.1.insert(pass, (replicate.clone(), bytes)).is_none() {
            memory.bytes += bytes;
        }
        memory.rooms.push_back(room);
    }
}

/// Forgets every room.
pub fn forget_all() {
    *memory() = Memory::default();
}

fn memory() -> std::sync::MutexGuard<'static, Memory> {
    // never left half changed: a panic elsewhere does not matter
    MEMORY.lock().unwrap_or_else(PoisonError::into_inner)
}
