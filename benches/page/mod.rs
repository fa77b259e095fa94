//! The tables of `RESULTS.md` that benchmarks write into files of their own. Each stands there between
//! `<!-- NAME: from FILE, by … -->` and `<!-- end of NAME -->`; what stands around them is written by people.

const PAGE: &str = "RESULTS.md";

/// Puts what the files hold now between their marks.
pub fn remake() {
    let page = std::fs::read_to_string(PAGE).expect("RESULTS.md is here");
    let read = |file: &str| std::fs::read_to_string(file).ok();
    std::fs::write(PAGE, remade(&page, &read)).expect("RESULTS.md can be written");
}

/// The page with each file between its marks; as it was where there is no such file.
pub fn remade(page: &str, read: &dyn Fn(&str) -> Option<String>) -> String {
    let mut new = String::new();
    let mut rest = page;
    while let Some((before, (head, name, file))) = next_mark(rest) {
        let body = &rest[before + head.len()..];
        let end = format!("<!-- end of {name} -->");
        let length = body
            .find(&end)
            .unwrap_or_else(|| panic!("{PAGE}: {end} is missing"));
        new.push_str(&rest[..before]);
        new.push_str(head);
        match read(file) {
            Some(text) => new.extend(["\n\n", text.trim(), "\n\n"]),
            None => new.push_str(&body[..length]),
        }
        rest = &body[length..];
    }
    new + rest
}

/// Where the next mark begins, with its text, its name and its file.
fn next_mark(page: &str) -> Option<(usize, (&str, &str, &str))> {
    page.match_indices("<!-- ").find_map(|(at, _)| {
        let head = &page[at..at + page[at..].find("-->")? + 3];
        let (name, from) = head.strip_prefix("<!-- ")?.split_once(": from ")?;
        let (file, _) = from.split_once(',')?;
        Some((at, (head, name, file)))
    })
}
