//! The lines of a deck: commands with their fields, assignments, and lines of numbers.

use std::collections::HashMap;
use std::iter::Peekable;

use crate::io::mesh_file::words::{at, fortran};
use crate::plain::quote;

/// What a line, or a part of it between `$`, says.
pub enum Statement<'t> {
    Command(DeckCommand<'t>),
    /// A parameter and what it is set to.
    Set(String, &'t str),
    /// Numbers of a block whose command was not read.
    Numbers,
}

/// A command with its fields.
pub struct DeckCommand<'t> {
    /// In capitals.
    pub name: String,
    pub line: usize,
    /// What follows the name, whole.
    pub text: &'t str,
}

impl<'t> DeckCommand<'t> {
    /// Its name, to stand in a message: bytes behind the letters that tell it from others may be anything.
    #[must_use]
    pub fn title(&self) -> String {
        let usual = |c: char| c.is_ascii_alphanumeric() || "/*_%".contains(c);
        if self.name.chars().all(usual) && self.name.len() <= 32 {
            self.name.clone()
        } else {
            quote(&self.name)
        }
    }

    /// What tells it from others: Ansys reads four letters, after a slash or a star.
    #[must_use]
    pub fn key(&self) -> &str {
        let mark = usize::from(self.name.starts_with(['/', '*']));
        let end = self.name.char_indices().nth(mark + 4);
        end.map_or(self.name.as_str(), |(at, _)| &self.name[..at])
    }

    /// Field `k` after the name, empty where it is not there.
    #[must_use]
    pub fn field(&self, k: usize) -> &'t str {
        self.text.split(',').nth(k).unwrap_or_default().trim()
    }

    /// Field `k` in capitals.
    #[must_use]
    pub fn label(&self, k: usize) -> String {
        self.field(k).to_uppercase()
    }

    #[must_use]
    pub fn fields(&self) -> usize {
        self.text.split(',').count()
    }
}

/// Takes a line apart; `number` is its own. Comments are nothing.
#[must_use]
pub fn statements(line: &str, number: usize) -> Vec<Statement<'_>> {
    let line = line.trim();
    if ["/COM", "/TITLE", "C***"]
        .iter()
        .any(|name| begins(line, name))
    {
        return command(line, number).into_iter().collect();
    }
    let line = line.split('!').next().unwrap_or_default();
    if line.contains('\'') {
        // Dollars in paths part nothing.
        return statement(line, number).into_iter().collect();
    }
    let parts = line.split('$');
    parts.filter_map(|part| statement(part, number)).collect()
}

fn begins(line: &str, name: &str) -> bool {
    let start = line.get(..name.len());
    start.is_some_and(|start| start.eq_ignore_ascii_case(name))
}

fn statement(text: &str, line: usize) -> Option<Statement<'_>> {
    let text = text.trim();
    let first = text.chars().next()?;
    if first.is_ascii_digit() || "+-.(".contains(first) {
        return Some(Statement::Numbers);
    }
    if let Some((name, value)) = text.split_once('=') {
        // Also an element of an array.
        let name = name.split('(').next().unwrap_or_default().trim();
        let is_name = |c: char| c.is_alphanumeric() || c == '_';
        if !name.is_empty() && name.chars().all(is_name) {
            return Some(Statement::Set(name.to_uppercase(), value.trim()));
        }
    }
    command(text, line)
}

fn command(text: &str, line: usize) -> Option<Statement<'_>> {
    let ends = |c: char| c == ',' || c.is_whitespace();
    let end = text.find(ends).unwrap_or(text.len());
    let rest = text[end..].trim_start();
    let command = DeckCommand {
        name: text[..end].to_uppercase(),
        line,
        text: rest.strip_prefix(',').unwrap_or(rest),
    };
    (!command.name.is_empty()).then_some(Statement::Command(command))
}

/// The lines of a file, with their numbers.
pub struct DeckLines<'t>(Peekable<std::iter::Zip<std::ops::RangeFrom<usize>, std::str::Lines<'t>>>);

impl<'t> DeckLines<'t> {
    #[must_use]
    pub fn of(text: &'t str) -> Self {
        Self((1..).zip(text.lines()).peekable())
    }

    /// The next line, which stays the next one.
    pub fn peek(&mut self) -> Option<(usize, &'t str)> {
        self.0.peek().copied()
    }

    /// The next line of a block; nothing at its end, and before a line that is not one of numbers.
    pub fn next_of_block(&mut self) -> Option<(usize, &'t str)> {
        let of_block = |&(_, line): &(usize, &str)| {
            let first = line.trim_start().chars().next();
            first.is_none_or(|c| c.is_ascii_digit() || "+-.".contains(c))
        };
        self.0.next_if(of_block)
    }
}

impl<'t> Iterator for DeckLines<'t> {
    type Item = (usize, &'t str);

    fn next(&mut self) -> Option<Self::Item> {
        self.0.next()
    }
}

/// Parameters that are plain numbers.
#[derive(Default)]
pub struct Parameters(HashMap<String, f64>);

impl Parameters {
    /// Sets one, in capitals; what is no plain number is not known any more.
    pub fn set(&mut self, name: &str, value: &str) {
        match self.value(value) {
            Some(value) => self.0.insert(name.to_owned(), value),
            None => self.0.remove(name),
        };
    }

    /// A number, or a parameter that is one.
    #[must_use]
    pub fn value(&self, word: &str) -> Option<f64> {
        let number = fortran(word, 0).ok();
        number.or_else(|| self.0.get(&word.to_uppercase()).copied())
    }

    /// Field `k` of a command as a number; nothing where it is empty.
    ///
    /// # Errors
    /// A message naming the line of what is neither a number nor a known parameter.
    pub fn number(&self, command: &DeckCommand, k: usize) -> Result<Option<f64>, String> {
        let word = command.field(k);
        if word.is_empty() {
            return Ok(None);
        }
        let unknown = || {
            let what = "is neither a number nor a parameter that is one up to here";
            at(command.line, &format!("{} {what}", quote(word)))
        };
        self.value(word).map(Some).ok_or_else(unknown)
    }

    /// As [`Self::number`], of a whole number from zero on.
    ///
    /// # Errors
    /// Also for one that is not whole.
    pub fn whole(&self, command: &DeckCommand, k: usize) -> Result<Option<u64>, String> {
        /// All below are whole in a double.
        const MOST: f64 = 9e15;
        match self.number(command, k)? {
            None => Ok(None),
            Some(x) if x.fract() == 0.0 && (0.0..MOST).contains(&x) => Ok(Some(x as u64)),
            Some(_) => Err(at(
                command.line,
                &format!("{} is no whole number", quote(command.field(k))),
            )),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn one(line: &str) -> DeckCommand<'_> {
        match statements(line, 3).pop() {
            Some(Statement::Command(command)) => command,
            _ => panic!("{line}"),
        }
    }

    #[test]
    fn commands_are_taken_apart() {
        let command = one("  nblock,3,,24512 ! nodes");
        assert_eq!((command.name.as_str(), command.key()), ("NBLOCK", "NBLO"));
        assert_eq!((command.field(0), command.field(1)), ("3", ""));
        assert_eq!((command.field(2), command.field(7)), ("24512", ""));
        assert_eq!(command.title(), "NBLOCK");
        let odd = one("nblock\u{fffd}\u{1b}[2J,3");
        assert_eq!(odd.key(), "NBLO");
        assert!(
            odd.title().starts_with('“') && !odd.title().contains('\u{1b}'),
            "{}",
            odd.title()
        );
        assert_eq!(one("*get, _X, node").key(), "*GET");
        assert_eq!(one("/PREP7").key(), "/PREP");
        assert_eq!(one("/com, costs $5 ! or so").text, " costs $5 ! or so");
        assert_eq!(statements("et,1,187 $ mat,2 $", 1).len(), 2);
        assert!(statements("! nothing", 1).is_empty());
        assert!(matches!(statements("  12 13", 1)[..], [Statement::Numbers]));
    }

    #[test]
    fn parameters_are_numbers() {
        let mut known = Parameters::default();
        for (line, value) in [("tid=4", Some(4.0)), ("Size(1,0,1) = 2.5D-3", Some(2.5e-3))] {
            let Some(Statement::Set(name, text)) = statements(line, 1).pop() else {
                panic!("{line}");
            };
            known.set(&name, text);
            assert_eq!(known.value(&name), value);
        }
        assert_eq!(known.whole(&one("et,TID,187"), 0), Ok(Some(4)));
        assert_eq!(known.whole(&one("et,,187"), 0), Ok(None));
        assert!(known.whole(&one("et,size,187"), 0).is_err());
        let said = known.whole(&one("et,other,187"), 0).unwrap_err();
        assert!(said.starts_with("line 3: “other”"), "{said}");
    }
}
