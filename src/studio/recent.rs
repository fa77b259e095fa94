//! Files that were open lately.

use std::fs;
use std::path::{Path, PathBuf};

use egui::Ui;

use super::action::WindowAction;
use super::ask::Ask;
use crate::io::atomic;

/// Files kept.
const MOST: usize = 10;
const FILE: &str = "recent.json";

/// The list, the latest first, and where it is kept between runs.
#[derive(Default)]
pub struct Recent {
    file: Option<PathBuf>,
    paths: Vec<PathBuf>,
}

impl Recent {
    /// As kept in a folder; empty where there is none yet.
    pub fn kept_in(home: &Path) -> Self {
        let file = home.join(FILE);
        let paths = fs::read(&file)
            .ok()
            .and_then(|bytes| serde_json::from_slice(&bytes).ok())
            .unwrap_or_default();
        Self {
            file: Some(file),
            paths,
        }
    }

    /// Puts a file first.
    pub fn push(&mut self, path: &Path) {
        let path = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
        self.paths.retain(|p| *p != path);
        self.paths.insert(0, path);
        self.paths.truncate(MOST);
        if let (Some(file), Ok(text)) = (&self.file, serde_json::to_vec(&self.paths)) {
            // A list of conveniences is not worth a complaint.
            let _ = file.parent().map(fs::create_dir_all);
            let _ = atomic::write(file, &text);
        }
    }

    /// The menu of them.
    pub fn menu(&self, ui: &mut Ui, ask: &mut Ask<'_>) {
        ui.menu_button("Open recent", |ui| {
            let mut any = false;
            for path in self.paths() {
                any = true;
                let name = path.file_name().unwrap_or_default().to_string_lossy();
                let entry = ui.button(&*name).on_hover_text(path.display().to_string());
                if entry.clicked() {
                    ask.act(WindowAction::OpenOrAsk(path.clone()));
                }
            }
            if !any {
                ui.weak("Nothing yet");
            }
        });
    }

    /// Those that are still there.
    pub fn paths(&self) -> impl Iterator<Item = &PathBuf> {
        self.paths.iter().filter(|p| p.exists())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_latest_comes_first_and_what_is_gone_is_left_out() {
        let home = tempfile::tempdir().unwrap();
        let file = |k: usize| home.path().join(format!("{k}.hapdef.toml"));
        let mut recent = Recent::kept_in(&home.path().join("config"));
        for k in 0..14 {
            fs::write(file(k), "").unwrap();
            recent.push(&file(k));
        }
        recent.push(&file(8));
        fs::remove_file(file(12)).unwrap();
        let again = Recent::kept_in(&home.path().join("config"));
        let names: Vec<String> = again
            .paths()
            .map(|p| {
                p.file_name()
                    .unwrap()
                    .to_string_lossy()
                    .replace(".hapdef.toml", "")
            })
            .collect();
        assert_eq!(names, ["8", "13", "11", "10", "9", "7", "6", "5", "4"]);
    }
}
