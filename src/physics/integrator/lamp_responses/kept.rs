//! Replicates of the responses of rooms that the process keeps, by what they depend on.
//!
//! A kept replicate is the one that would be computed anew: what is kept changes times, never a bit.

use std::collections::{HashMap, VecDeque};
use std::fmt::{self, Debug, Write};
use std::hash::{BuildHasher, Hasher, RandomState};
use std::sync::{Arc, LazyLock, Mutex, MutexGuard, PoisonError};

use super::replicate::RoomPass;

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

/// Everything that is kept.
#[derive(Default)]
struct Memory {
    /// The room that was asked for last is the last.
    rooms: VecDeque<(Content, Passes)>,
    bytes: usize,
}

/// Replicates of one room with their bytes, by their numbers.
type Passes = HashMap<u64, (Arc<RoomPass>, usize)>;

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
        memory().get(self.0, pass)
    }

    /// Keeps a replicate of `bytes`, unless it alone is too large; other rooms make way for it.
    pub fn put(&self, pass: u64, replicate: &Arc<RoomPass>, bytes: usize) {
        memory().put(self.0, pass, replicate, bytes);
    }
}

/// Forgets every room.
pub fn forget_all() {
    *memory() = Memory::default();
}

fn memory() -> MutexGuard<'static, Memory> {
    // never left half changed: a panic elsewhere does not matter
    MEMORY.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Memory {
    fn get(&mut self, content: Content, pass: u64) -> Option<Arc<RoomPass>> {
        let room = self.take(content)?;
        let found = room.get(&pass).map(|(kept, _)| kept.clone());
        self.rooms.push_back((content, room));
        found
    }

    fn put(&mut self, content: Content, pass: u64, replicate: &Arc<RoomPass>, bytes: usize) {
        let mut room = self.take(content).unwrap_or_default();
        let is_new = !room.contains_key(&pass);
        while is_new
            && self.bytes + bytes > MOST_BYTES
            && let Some((_, other)) = self.rooms.pop_front()
        {
            self.bytes -= other.values().map(|(_, bytes)| bytes).sum::<usize>();
        }
        if is_new && self.bytes + bytes <= MOST_BYTES {
            room.insert(pass, (replicate.clone(), bytes));
            self.bytes += bytes;
        }
        self.rooms.push_back((content, room));
    }

    /// Takes a room out of the line.
    fn take(&mut self, content: Content) -> Option<Passes> {
        let place = self.rooms.iter().position(|(other, _)| *other == content)?;
        self.rooms.remove(place).map(|(_, room)| room)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::guide::RayCount;

    fn replicate() -> Arc<RoomPass> {
        Arc::new(RoomPass { grids: Vec::new(), rays: RayCount::default() })
    }

    #[test]
    fn equal_content_is_equal_and_other_is_not() {
        assert_eq!(Content::of(&(0.1, "a")), Content::of(&(0.1, "a")));
        assert_ne!(Content::of(&(0.1, "a")), Content::of(&(0.1 + 2e-17, "a")));
        assert_ne!(Content::of(&["a", "b"]), Content::of(&["ab"]));
    }

    /// A third of the memory each: the room that nobody has asked for makes way, and what does not fit at all is not kept.
    #[test]
    fn the_room_that_was_asked_for_longest_ago_makes_way() {
        let mut memory = Memory::default();
        let [a, b, c, d] = [1, 2, 3, 4].map(|number| Content([number; 2]));
        let third = MOST_BYTES / 3;
        for (content, pass) in [(a, 0), (b, 0), (c, 5)] {
            memory.put(content, pass, &replicate(), third);
        }
        assert!(memory.get(a, 0).is_some() && memory.get(a, 1).is_none());
        memory.put(d, 0, &replicate(), third);
        assert!(memory.get(b, 0).is_none() && memory.get(a, 0).is_some() && memory.get(c, 5).is_some());
        assert_eq!(memory.bytes, 3 * third);
        memory.put(d, 0, &replicate(), third);
        assert_eq!(memory.bytes, 3 * third, "the same once more");
        memory.put(d, 1, &replicate(), MOST_BYTES);
        assert!(memory.get(d, 1).is_none() && memory.get(d, 0).is_some() && memory.bytes == third);
    }
}
