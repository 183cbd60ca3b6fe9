//! Blocks in memory: those that were fetched or read from the disk last, of all objects.

use bytes::Bytes;
use std::{
    collections::{HashMap, VecDeque},
    sync::{LazyLock, Mutex, MutexGuard, PoisonError},
};

/// Most bytes of blocks in memory.
pub const MOST: usize = 64 << 20;

/// An object's number and the number of its block.
type Key = (u64, u64);

#[derive(Default)]
pub struct Held {
    blocks: HashMap<Key, Bytes>,
    /// Oldest first.
    order: VecDeque<Key>,
    bytes: usize,
}

/// The blocks that this process holds.
pub fn held() -> MutexGuard<'static, Held> {
    static HELD: LazyLock<Mutex<Held>> = LazyLock::new(Mutex::default);
    HELD.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Held {
    pub fn get(&self, key: Key) -> Option<Bytes> {
        self.blocks.get(&key).cloned()
    }

    pub fn put(&mut self, key: Key, block: Bytes) {
        self.remove(key);
        self.bytes += block.len();
        self.blocks.insert(key, block);
        self.order.push_back(key);
        while self.bytes > MOST
            && let Some(oldest) = self.order.pop_front()
        {
            self.remove(oldest);
        }
    }

    pub fn remove(&mut self, key: Key) {
        if let Some(old) = self.blocks.remove(&key) {
            self.bytes -= old.len();
            self.order.retain(|listed| *listed != key);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_oldest_go_first() {
        let mut held = Held::default();
        let block = Bytes::from(vec![0; MOST / 4]);
        for number in 0..4 {
            held.put((1, number), block.clone());
        }
        held.put((1, 0), block.clone());
        held.put((2, 0), block.clone());
        assert!(held.get((1, 1)).is_none() && held.get((1, 0)).is_some());
        held.remove((1, 2));
        held.put((2, 1), block);
        assert!([(1, 0), (1, 3), (2, 0), (2, 1)].into_iter().all(|key| held.get(key).is_some()));
        assert_eq!(held.bytes, MOST);
    }
}
