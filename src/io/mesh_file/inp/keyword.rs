//! The lines of an input file that say something, and its keyword lines taken apart.

use std::borrow::Cow;

/// A keyword with its options.
pub struct Keyword {
    /// In capitals.
    pub name: String,
    /// Number of its line.
    pub line: usize,
    options: Vec<(String, String)>,
}

impl Keyword {
    /// Of a line, stars and all.
    #[must_use]
    pub fn of(text: &str, line: usize) -> Self {
        let mut words = text.trim_start_matches('*').split(',').map(str::trim);
        let name: Vec<&str> = words
            .next()
            .unwrap_or_default()
            .split_whitespace()
            .collect();
        let option = |word: &str| match word.split_once('=') {
            Some((key, value)) => {
                let value = value.trim().trim_matches('"');
                (key.trim().to_uppercase(), value.to_owned())
            }
            None => (word.to_uppercase(), String::new()),
        };
        Self {
            name: name.join(" ").to_uppercase(),
            line,
            options: words.filter(|w| !w.is_empty()).map(option).collect(),
        }
    }

    /// The value of an option, empty where it has none; nothing where the option is not there.
    #[must_use]
    pub fn option(&self, key: &str) -> Option<&str> {
        let found = self.options.iter().find(|(k, _)| k == key);
        found.map(|(_, value)| value.as_str())
    }

    /// The value of an option that must be there.
    ///
    /// # Errors
    /// A message naming the line.
    pub fn required(&self, key: &str) -> Result<&str, String> {
        let missing = || format!("line {}: *{} has no {key}=", self.line, self.name);
        self.option(key)
            .filter(|v| !v.is_empty())
            .ok_or_else(missing)
    }
}

/// Lines with their numbers, without empty ones and comments. A keyword line that ends in a comma goes on in the
/// next one.
pub fn statements(text: &str) -> impl Iterator<Item = (usize, Cow<'_, str>)> {
    let trimmed = text.lines().zip(1..).map(|(line, row)| (row, line.trim()));
    let mut lines = trimmed
        .filter(|(_, line)| !line.is_empty() && !line.starts_with("**"))
        .peekable();
    std::iter::from_fn(move || {
        let (row, line) = lines.next()?;
        let mut whole = Cow::Borrowed(line);
        while whole.starts_with('*') && whole.ends_with(',') {
            let option = lines.next_if(|(_, l)| l.starts_with(|c: char| c.is_alphabetic()));
            let Some((_, more)) = option else { break };
            whole.to_mut().push_str(more);
        }
        Some((row, whole))
    })
}

/// The values of a line; a comma may follow the last.
pub(super) fn values(words: &str) -> impl Iterator<Item = &str> {
    let words = words.strip_suffix(',').unwrap_or(words);
    words.split(',').map(str::trim)
}
