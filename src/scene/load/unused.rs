//! What a file holds that has no effect: told in one line.

use std::fmt::{self, Display};

/// Kinds of things that a file holds and that have no effect, counted.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Unused(Vec<String>);

/// Kinds that are named; more are counted.
const MOST: usize = 16;

/// Characters of a name that are shown.
const LONGEST: usize = 60;

impl Unused {
    /// Adds so many things, none if there are none: `2 animations`.
    pub(in crate::scene) fn add(&mut self, number: usize, what: &str) {
        if number > 0 {
            self.0.push(counted(number, what));
        }
    }

    /// Adds what so many things have and make no use of: `COLOR_0 of 2 meshes`.
    pub(super) fn add_of(&mut self, name: &str, number: usize, what: &str) {
        self.name(&format!("{} of {}", shown(name), counted(number, what)));
    }

    /// Adds something that has a name.
    pub(super) fn name(&mut self, name: &str) {
        self.0.push(shown(name));
    }

    /// Whether everything has an effect.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

/// `no effect: 2 animations, COLOR_0 of 1 mesh`
impl Display for Unused {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let named = &self.0[..self.0.len().min(MOST)];
        write!(f, "no effect: {}", named.join(", "))?;
        match self.0.len() - named.len() {
            0 => Ok(()),
            more => write!(f, ", and {more} more"),
        }
    }
}

/// `1 mesh`, `2 meshes`; a name of several words is counted by the first.
pub(in crate::scene) fn counted(number: usize, what: &str) -> String {
    if number == 1 {
        return format!("1 {what}");
    }
    let end = what.find(' ').unwrap_or(what.len());
    let (noun, rest) = what.split_at(end);
    match noun.strip_suffix("ex") {
        Some(stem) => format!("{number} {stem}ices{rest}"),
        None if noun.ends_with('h') => format!("{number} {noun}es{rest}"),
        None => format!("{number} {noun}s{rest}"),
    }
}

/// A name from a file as a message can hold it.
fn shown(name: &str) -> String {
    let mut characters = name.escape_debug();
    let mut shown: String = characters.by_ref().take(LONGEST).collect();
    if characters.next().is_some() {
        shown += "...";
    }
    shown
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn things_are_counted_and_names_are_cut() {
        let mut unused = Unused::default();
        unused.add(0, "camera");
        assert!(unused.is_empty());
        unused.add(2, "animation");
        unused.add_of("COLOR_0", 1, "mesh");
        unused.add(2, "mesh of points");
        unused.add_of("colours", 3, "vertex");
        unused.name("a\u{1b}b");
        let told = "no effect: 2 animations, COLOR_0 of 1 mesh, 2 meshes of points, colours of 3 vertices, a\\u{1b}b";
        assert_eq!(unused.to_string(), told);
        for _ in 0..100 {
            unused.name(&"long ".repeat(100));
        }
        let told = unused.to_string();
        assert!(
            told.len() < 1200 && told.ends_with("..., and 89 more"),
            "{told}"
        );
    }
}
