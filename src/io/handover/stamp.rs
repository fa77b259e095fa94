//! Which run each file belongs to, in the file itself: files of two runs must not be glued and soldered together.

use std::path::Path;

/// A file with its run in it: a column of a table, a comment in a source, the end of the header of a piece to print.
/// Documents and scenes are written with it.
pub(super) fn of_run(name: &str, bytes: Vec<u8>, run: &str) -> Vec<u8> {
    let ending = Path::new(name).extension().and_then(|e| e.to_str());
    let text = |with: fn(&str, &str) -> String| match std::str::from_utf8(&bytes) {
        Ok(text) => with(text, run).into_bytes(),
        Err(_) => bytes.clone(),
    };
    match ending {
        Some("csv") => text(column),
        Some("h") => text(|text, run| format!("/* Of run {run}. */\n{text}")),
        Some("urdf") => text(comment),
        Some("stl") => header(bytes, run),
        _ => bytes,
    }
}

/// No cell of the tables here has lines of its own.
fn column(table: &str, run: &str) -> String {
    let cells = std::iter::once("run").chain(std::iter::repeat(run));
    let rows = table.lines().zip(cells);
    let rows: Vec<String> = rows.map(|(row, cell)| format!("{row},{cell}")).collect();
    rows.join("\n") + "\n"
}

/// Nothing may stand before the declaration of XML.
fn comment(document: &str, run: &str) -> String {
    let (declaration, rest) = document.split_once('\n').unwrap_or((document, ""));
    format!("{declaration}\n<!-- Of run {run}. -->\n{rest}")
}

fn header(mut stl: Vec<u8>, run: &str) -> Vec<u8> {
    const HEADER: usize = 80;
    let words = format!(", run {run}");
    let used = stl.iter().take(HEADER).rposition(|&b| b != b' ');
    let from = used.map_or(0, |last| last + 1);
    if from + words.len() <= HEADER && stl.len() >= HEADER {
        stl[from..from + words.len()].copy_from_slice(words.as_bytes());
    }
    stl
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_of_file_names_its_run() {
        let said = |name: &str, text: &str| {
            String::from_utf8(of_run(name, text.into(), "0123abcd")).unwrap()
        };
        assert_eq!(
            said("a.csv", "x,y\n1,2\n3,\"4,5\"\n"),
            "x,y,run\n1,2,0123abcd\n3,\"4,5\",0123abcd\n"
        );
        assert_eq!(said("a.h", "#if\n"), "/* Of run 0123abcd. */\n#if\n");
        assert_eq!(
            said("a.urdf", "<?xml?>\n<robot/>\n"),
            "<?xml?>\n<!-- Of run 0123abcd. -->\n<robot/>\n"
        );
        let stl = said("jig/a.stl", &format!("{:80}rest", "HapDef, mm: ring"));
        assert_eq!(stl.len(), 84);
        assert!(
            stl.starts_with("HapDef, mm: ring, run 0123abcd   "),
            "{stl}"
        );
    }
}
