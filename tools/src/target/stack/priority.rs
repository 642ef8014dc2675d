//! Reads the priorities of handlers, which determine which handlers can interrupt each other.
//!
//! Handlers of one priority cannot (ARMv7-M Architecture Reference Manual, B1.5.4). An image lists its priorities in
//! a section that is not loaded: for each task the vector number and the priority, one byte each, higher is more
//! urgent. A handler that is not listed may interrupt everything.

use super::StackError;
use std::collections::{BTreeMap, BTreeSet};

pub const SECTION: &str = ".priorities";

#[derive(Debug, Default)]
pub struct Vectors {
    /// Address of the handler of each exception number, if the vector points to a function.
    pub handlers: Vec<Option<u32>>,
    pub priorities: BTreeMap<usize, u8>,
}

/// Handlers that cannot interrupt each other, with their priority if it is known.
pub type Group = (Option<u8>, BTreeSet<u32>);

impl Vectors {
    pub fn prioritise(&mut self, section: &[u8]) -> Result<(), StackError> {
        let refused = || StackError::Format(format!("{SECTION} is no list of vectors and priorities"));
        let (entries, []) = section.as_chunks::<2>() else { return Err(refused()) };
        for [number, priority] in entries {
            if self.priorities.insert((*number).into(), *priority).is_some() {
                return Err(refused());
            }
        }
        Ok(())
    }

    /// Returns the groups, most urgent first: one for each handler without a priority, then one for each priority.
    pub fn groups(&self, reset: u32) -> Vec<Group> {
        let (mut known, mut unknown) = (BTreeMap::<u8, BTreeSet<u32>>::new(), BTreeSet::new());
        for (number, handler) in self.handlers.iter().enumerate() {
            let Some(handler) = handler.filter(|handler| *handler != reset) else { continue };
            match self.priorities.get(&number) {
                Some(priority) => known.entry(*priority).or_default().insert(handler),
                None => unknown.insert(handler),
            };
        }
        let unknown = unknown.into_iter().map(|handler| (None, BTreeSet::from([handler])));
        unknown.chain(known.into_iter().rev().map(|(priority, group)| (Some(priority), group))).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RESET: u32 = 0x100;

    fn vectors(section: &[u8]) -> Vectors {
        // Stack, reset, a fault, two interrupts, a free vector, and the fault's again.
        let handlers = vec![None, Some(RESET), Some(0x200), Some(0x300), Some(0x400), None, Some(0x200)];
        let mut vectors = Vectors { handlers, ..Vectors::default() };
        vectors.prioritise(section).unwrap();
        vectors
    }

    fn group(priority: Option<u8>, handlers: &[u32]) -> Group {
        (priority, handlers.iter().copied().collect())
    }

    #[test]
    fn without_priorities_each_handler_is_alone() {
        let alone = [group(None, &[0x200]), group(None, &[0x300]), group(None, &[0x400])];
        assert_eq!(vectors(&[]).groups(RESET), alone);
    }

    #[test]
    fn equal_priorities_are_one_group() {
        let expected = [group(None, &[0x200]), group(Some(4), &[0x300, 0x400])];
        assert_eq!(vectors(&[3, 4, 4, 4]).groups(RESET), expected);
        let expected = [group(None, &[0x200]), group(Some(4), &[0x400]), group(Some(1), &[0x300])];
        assert_eq!(vectors(&[3, 1, 4, 4]).groups(RESET), expected);
    }

    #[test]
    fn a_list_that_is_none_is_refused() {
        let mut vectors = Vectors::default();
        assert!(vectors.prioritise(&[3, 4, 4]).is_err());
        assert!(vectors.prioritise(&[3, 4, 3, 1]).is_err());
    }
}
