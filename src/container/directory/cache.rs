//! The directory pages that were used last.

use std::collections::HashMap;

/// Most directory pages in memory. With 512 records of about 80 bytes, that is 20 MiB.
const MOST: usize = 512;

/// A level, and a directory page of it.
type Key = (usize, u32);

/// A cache of directory pages.
pub struct Cache<T> {
    /// With the time of their last use.
    held: HashMap<Key, (T, u64)>,
    time: u64,
}

impl<T> Default for Cache<T> {
    fn default() -> Self {
        Self { held: HashMap::new(), time: 0 }
    }
}

impl<T: Clone> Cache<T> {
    pub fn has(&self, key: Key) -> bool {
        self.held.contains_key(&key)
    }

    pub fn get(&mut self, key: Key) -> Option<T> {
        self.time += 1;
        let (page, used) = self.held.get_mut(&key)?;
        *used = self.time;
        Some(page.clone())
    }

    /// Adds a page. If there is no room for it, the one that was not used for longest goes.
    pub fn put(&mut self, key: Key, page: T) {
        self.time += 1;
        if self.held.len() >= MOST && !self.held.contains_key(&key) {
            let oldest = self.held.iter().min_by_key(|(_, (_, used))| *used);
            if let Some(oldest) = oldest.map(|(key, _)| *key) {
                self.held.remove(&oldest);
            }
        }
        self.held.insert(key, (page, self.time));
    }

    #[cfg(test)]
    pub fn len(&self) -> usize {
        self.held.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_unused_for_longest_goes() {
        let mut cache = Cache::default();
        (0..MOST as u32).for_each(|number| cache.put((0, number), number));
        assert_eq!(cache.get((0, 0)), Some(0));
        cache.put((1, 0), 7);
        assert_eq!(cache.len(), MOST);
        assert!(cache.has((0, 0)) && !cache.has((0, 1)) && cache.has((1, 0)));
    }
}
