//! What must hold of whatever a reader says: numbers that are finite, or words that fit on a screen.

use hapdef::io::mesh_file::LoadedMesh;
use hapdef::live::{Input, LiveUpdate};
use hapdef::study::Data;

/// A screen, as terminals open.
pub const LINES: usize = 24;
pub const CHARACTERS: usize = 2000;

/// How values print that nobody has put into words.
const DUMPS: [&str; 7] = [
    "Some(", "Err(", "Error(", "Error {", "Kind {", "panicked", ".rs:",
];

/// Whether a refusal may be shown to a person: something is said, on one screen, with nothing in it that a
/// terminal would obey, no value of the program's own printed raw, and no bytes of the file outside quotation
/// marks.
///
/// # Errors
/// What is wrong with it.
pub fn message(said: &str) -> Result<(), String> {
    let wrong = |what: &str| Err(format!("the message {what}: {said:?}"));
    if said.trim().is_empty() {
        return Err("no message".into());
    }
    if said.lines().count() > LINES || said.chars().count() > CHARACTERS {
        return wrong("is longer than a screen");
    }
    if said.chars().any(|c| c.is_control() && c != '\n') {
        return wrong("has control characters");
    }
    let own = own_words(said);
    if own.contains('\u{fffd}') {
        return wrong("echoes bytes of the file");
    }
    if DUMPS.iter().any(|dump| own.contains(dump)) {
        return wrong("shows a value of the program's own");
    }
    Ok(())
}

/// A message without what it quotes: words between quotation marks, and lines of the file beside a ruler.
fn own_words(said: &str) -> String {
    let unruled = |line: &&str| {
        let line = line
            .trim_start()
            .trim_start_matches(|c: char| c.is_ascii_digit());
        !line.trim_start().starts_with('|')
    };
    let mut own = String::new();
    for line in said.lines().filter(unruled) {
        let mut closing = None;
        for c in line.chars() {
            match (closing, c) {
                (Some(mark), c) if c == mark => closing = None,
                (Some(_), _) => {}
                (None, '“') => closing = Some('”'),
                (None, '"' | '`') => closing = Some(c),
                (None, c) => own.push(c),
            }
        }
        own.push('\n');
    }
    own
}

/// A message without its numbers and quotations: the same for all messages of one kind.
pub fn shape(said: &str) -> String {
    let mut shape = String::new();
    let mut in_number = false;
    for c in own_words(said).trim().chars() {
        let digit = c.is_ascii_digit();
        if digit && !in_number {
            shape.push('#');
        } else if !digit {
            shape.push(if c == '\n' { ' ' } else { c });
        }
        in_number = digit;
    }
    shape
}

/// Whether what was accepted is a surface: everything that the rest of the program relies on.
///
/// # Errors
/// What is not.
pub fn surface(loaded: &LoadedMesh) -> Result<(), String> {
    let mesh = &loaded.mesh;
    if mesh.triangles().is_empty() {
        return Err("no triangle".into());
    }
    if let Some(p) = mesh.positions().iter().find(|p| !p.is_finite()) {
        return Err(format!("a vertex at {p}"));
    }
    let vertices = mesh.positions().len();
    triangles(loaded)?;
    for edge in mesh.edges() {
        if edge.a >= edge.b || edge.triangles.is_empty() {
            return Err(format!("{edge:?}"));
        }
    }
    if loaded.groups.values().any(|mask| mask.len() != vertices) {
        return Err("a group of another size".into());
    }
    match mesh.volume() {
        Some(volume) if volume.nodes.iter().any(|p| !p.is_finite()) => {
            Err("a node that is not finite".into())
        }
        _ => Ok(()),
    }
}

fn triangles(loaded: &LoadedMesh) -> Result<(), String> {
    let mesh = &loaded.mesh;
    let vertices = mesh.positions().len() as u32;
    let mut used = vec![false; vertices as usize];
    for (t, tri) in (0..).zip(mesh.triangles()) {
        let repeated = tri[0] == tri[1] || tri[1] == tri[2] || tri[2] == tri[0];
        if repeated || tri.iter().any(|&v| v >= vertices) {
            return Err(format!("triangle {tri:?} of {vertices} vertices"));
        }
        for &v in tri {
            used[v as usize] = true;
        }
        let normal = mesh.facet_normal(t);
        let unit = (normal.length() - 1.0).abs() <= 1e-6;
        if !unit || mesh.facet_area(t) <= 0.0 {
            return Err(format!("triangle {t} has normal {normal}"));
        }
    }
    if used.iter().all(|&u| u) {
        Ok(())
    } else {
        Err("a vertex without a triangle".into())
    }
}

/// Whether numbers are finite, and as many as belong together.
///
/// # Errors
/// What is not.
pub fn dataset(data: &Data) -> Result<(), String> {
    let (sites, touches) = (data.x.rows(), data.x.columns());
    let fits = |count: usize| count == 0 || count == sites;
    if sites == 0 || touches == 0 || data.targets.len() != touches {
        return Err(format!(
            "{sites} sites × {touches} touches, {} targets",
            data.targets.len()
        ));
    }
    if !fits(data.positions.len()) || !fits(data.costs.len()) {
        return Err("places or costs for another number of sites".into());
    }
    let positions = data.positions.iter().flat_map(|&p| <[f64; 3]>::from(p));
    let all = (data.x.values().iter().copied())
        .chain(data.targets.iter().flatten().copied())
        .chain(positions)
        .chain(data.costs.iter().copied());
    finite(all)
}

/// Whether a board's words are what the rest may rely on.
///
/// # Errors
/// What is not.
pub fn input(input: &Input) -> Result<(), String> {
    match input {
        Input::Sample(sample) => {
            let count = sample.counts.len();
            if count == 0 || count > hapdef::wire::MOST_CHANNELS {
                return Err(format!("a sample of {count} channels"));
            }
            finite(sample.counts.iter().copied())
        }
        Input::Log { text, .. } if text.len() > 1024 => {
            Err(format!("a board's text of {} bytes", text.len()))
        }
        _ => Ok(()),
    }
}

/// Whether what is said of a sample is finite.
///
/// # Errors
/// What is not.
pub fn update(update: &LiveUpdate) -> Result<(), String> {
    finite(update.strain.iter().flatten().copied())?;
    if let Some(c) = &update.contact {
        let place = c.position.to_array().into_iter().chain(c.normal.to_array());
        finite(place.chain([c.force, c.force_deviation, c.region.radius]))?;
    }
    Ok(())
}

/// # Errors
/// The first number that is not finite.
pub fn finite(numbers: impl IntoIterator<Item = f64>) -> Result<(), String> {
    match numbers
        .into_iter()
        .enumerate()
        .find(|(_, x)| !x.is_finite())
    {
        Some((k, x)) => Err(format!("number {k} is {x}")),
        None => Ok(()),
    }
}
