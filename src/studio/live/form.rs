//! Settings of the live stage.

use egui::{ComboBox, DragValue, RichText, TextEdit, Ui};

use super::super::form::{choice, number, percentage, rows};
use super::super::{Command, Studio, theme};
use crate::board::{ChannelFault, Illness};
use crate::link::{PortInfo, State, ports};
use crate::live::Estimator;
use crate::project::{FORCE_OFF, LiveKeys, PLACE_OFF};
use crate::session::{LEAST_KNOWN, WANTED_KNOWN};

/// What is typed at the live stage.
#[derive(Default)]
pub(in super::super) struct LiveForm {
    port: String,
    ports: Vec<PortInfo>,
    pub record_to: String,
}

impl Studio {
    pub(in super::super) fn live_form(&mut self, ui: &mut Ui) {
        self.board_form(ui);
        if self.session.live.is_connected() {
            self.connected_form(ui);
        }
        let gauges = self.session.document.state.project.selection.sites.len();
        let live = &mut self.session.document.state.project.live;
        rows(ui, "Measurement", |ui| measurement(ui, live));
        ui.collapsing("Channels of the gauges", |ui| channels(ui, live, gauges));
        ui.collapsing("Known touches", |ui| self.known_form(ui));
    }

    fn board_form(&mut self, ui: &mut Ui) {
        let mut connect = false;
        rows(ui, "Board", |ui| {
            let name = ui.label("Port");
            ui.horizontal(|ui| {
                let field = TextEdit::singleline(&mut self.live_form.port)
                    .desired_width(130.0)
                    .hint_text("port, host:port or file");
                let field = ui.add(field).labelled_by(name.id);
                connect |= field.lost_focus() && ui.input(|i| i.key_pressed(egui::Key::Enter));
                self.port_list(ui);
            });
            ui.end_row();
            let name = ui.label("Baud");
            ui.add(
                DragValue::new(&mut self.session.desk.baud)
                    .range(300..=4_000_000)
                    .speed(100.0),
            )
            .labelled_by(name.id)
            .on_hover_text("Native USB does not care");
            ui.end_row();
            ui.label("");
            connect |= ui
                .add_enabled(
                    !self.live_form.port.trim().is_empty(),
                    egui::Button::new("Connect"),
                )
                .on_hover_text(
                    "Listen to the board at this port, or replay this recording (.hapdrec)",
                )
                .clicked();
            ui.end_row();
        });
        if connect {
            let port = self.live_form.port.clone();
            self.session.connect(&port);
        }
        self.button(ui, Command::SimulatedBoard);
        self.button(ui, Command::Disconnect);
        self.state_lines(ui);
    }

    fn port_list(&mut self, ui: &mut Ui) {
        let shown = ComboBox::from_id_salt("ports")
            .selected_text("")
            .width(20.0);
        let answer = shown.show_ui(ui, |ui| {
            if self.live_form.ports.is_empty() {
                ui.weak("No port was found");
            }
            for port in &self.live_form.ports {
                let text = format!("{}  {}", port.path, port.product);
                let text = if port.likely {
                    RichText::new(text).strong()
                } else {
                    RichText::new(text)
                };
                if ui
                    .selectable_label(self.live_form.port == port.path, text)
                    .clicked()
                {
                    self.live_form.port.clone_from(&port.path);
                }
            }
        });
        let opened = answer
            .response
            .accessible_name("Ports")
            .on_hover_text("Ports of this machine, the likeliest board first");
        if opened.clicked() {
            self.live_form.ports = ports();
        }
    }

    fn state_lines(&self, ui: &mut Ui) {
        let (text, colour) = self.live_in_words();
        let text = RichText::new(text);
        ui.label(match colour {
            Some(colour) => text.color(colour),
            None => text,
        });
        let said = self.session.live.look(|feed| {
            let hello = feed.hello.as_ref()?;
            Some(format!(
                "{}, {} channels of {} bits, gain {}",
                hello.name,
                hello.channels,
                hello.bits,
                hello.gain_milli / 1000
            ))
        });
        if let Some(said) = said.flatten() {
            ui.add(egui::Label::new(RichText::new(said).weak()).wrap());
        }
    }

    /// How the connection stands.
    pub(in super::super) fn live_in_words(&self) -> (String, Option<egui::Color32>) {
        if self.session.live.is_preparing() {
            return ("Making the model of the gauges …".into(), None);
        }
        let (state, taring, tared, trouble) = self
            .session
            .live
            .look(|f| (f.state.clone(), f.taring, f.tared, f.trouble.clone()))
            .unwrap_or_default();
        if let Some(why) = trouble.filter(|_| matches!(state, Some(State::Waiting | State::Silent)))
        {
            return (format!("Not understood: {why}"), Some(theme::ERROR));
        }
        match state {
            None => ("Not connected".into(), None),
            Some(State::Waiting) => ("Waiting for the board".into(), None),
            Some(State::Live) if taring => ("Taring: do not touch".into(), Some(theme::TOUCHED)),
            Some(State::Live) if !tared => ("Live, not tared".into(), Some(theme::STALE)),
            Some(State::Live) => ("Live".into(), None),
            Some(State::Silent) => ("The board has fallen silent".into(), Some(theme::ERROR)),
            Some(State::Gone) => (
                "Unplugged: waiting for the board".into(),
                Some(theme::ERROR),
            ),
            Some(State::Ended) => ("The recording is over".into(), None),
        }
    }

    fn connected_form(&mut self, ui: &mut Ui) {
        ui.add_space(4.0);
        ui.horizontal(|ui| {
            self.button(ui, Command::Tare);
            if self.session.live.simulated_board().is_some() {
                self.faults(ui);
            }
        });
        let mut estimator = self.session.desk.estimator;
        rows(ui, "Touch", |ui| {
            let help = "Model matching needs no training and says how sure it is; the others learn from the model first";
            choice(
                ui,
                "Estimator",
                &mut estimator,
                &Estimator::ALL,
                Estimator::label,
                help,
            );
            ui.label("");
            ui.checkbox(&mut self.session.desk.compare, "Compare all")
                .on_hover_text("Show what the others say too");
            ui.end_row();
        });
        if estimator != self.session.desk.estimator {
            self.session.show_estimator(estimator);
        }
        self.recording_form(ui);
    }

    fn faults(&mut self, ui: &mut Ui) {
        let Some(hosted) = self.session.live.simulated_board() else {
            return;
        };
        let now = hosted.seconds();
        ui.menu_button("Faults", |ui| {
            let Ok(mut board) = hosted.board.lock() else {
                return;
            };
            let faults = board.faults_mut();
            if ui.button("Unplug for 2 s").clicked() {
                faults.unplugged.push((now, now + 2.0));
                ui.close();
            }
            for (name, illness) in [
                ("Gauge 1 dies", Illness::Dead),
                ("Gauge 2 sticks", Illness::Stuck),
                ("Gauge 3 saturates", Illness::Saturated),
                ("Gauge 4 gets noisy", Illness::Noisy),
            ] {
                if ui.button(name).clicked() {
                    let channel = illness as usize;
                    faults.channels.push(ChannelFault {
                        channel,
                        illness,
                        from_s: now,
                        until_s: f64::INFINITY,
                    });
                    ui.close();
                }
            }
            if ui.button("All gauges recover").clicked() {
                faults.channels.clear();
                ui.close();
            }
        })
        .response
        .on_hover_text("What goes wrong at the simulated board");
    }

    fn recording_form(&mut self, ui: &mut Ui) {
        let recording = self.session.live.look(|f| f.recording.clone()).flatten();
        rows(ui, "Recording", |ui| {
            let name = ui.label("File");
            let field = TextEdit::singleline(&mut self.live_form.record_to)
                .desired_width(150.0)
                .hint_text("touches.hapdrec");
            ui.add(field).labelled_by(name.id);
            ui.end_row();
        });
        ui.horizontal(|ui| {
            let name = if recording.is_some() { "Stop recording" } else { "Record" };
            if ui.button(name).on_hover_text(Command::Record.tooltip()).clicked() {
                self.session.toggle_recording(&self.live_form.record_to);
            }
            let last = self.session.live.recorded.clone().filter(|_| recording.is_none());
            let table = egui::Button::new("Write a table");
            let help = "The last recording as .csv beside it: counts, touches, and the truth of a simulated board";
            if ui.add_enabled(last.is_some(), table).on_hover_text(help).clicked()
                && let Some(path) = last
            {
                self.session.write_table(&path);
            }
        });
        if let Some(recording) = recording {
            let text = format!(
                "{}: {} samples, {:.0} kB",
                recording.path.display(),
                recording.samples,
                recording.bytes as f64 / 1e3
            );
            ui.add(egui::Label::new(RichText::new(text).small()).wrap());
        }
    }

    fn known_form(&mut self, ui: &mut Ui) {
        ui.add(egui::Label::new("Press where the limb shows a cross, as hard as it says here, and take it. The gauges then show how they are really glued.").wrap());
        rows(ui, "Next touch", |ui| {
            number(
                ui,
                "Force",
                &mut self.session.desk.known_force_n,
                0.1..=100.0,
                0.1,
                " N",
                "That the next known touch is pressed with",
            );
            let hand = &mut self.session.document.state.project.calibration;
            number(
                ui,
                "Place off",
                &mut hand.place_mm,
                PLACE_OFF,
                0.01,
                " mm",
                "How far beside its place a known touch is pressed, in any direction (standard deviation)",
            );
            number(
                ui,
                "Force off",
                &mut hand.force_percent,
                FORCE_OFF,
                0.05,
                " %",
                "How much too hard or too soft a known touch is pressed (standard deviation)",
            );
        });
        let (count, connected) = (
            self.session.live.known_touches(),
            self.session.live.is_connected(),
        );
        ui.label(format!("{count} known touches of {WANTED_KNOWN}"));
        ui.horizontal(|ui| {
            let (waiting, _) = self.session.live.is_gathering();
            if ui
                .add_enabled(connected && !waiting, egui::Button::new("Take this press"))
                .clicked()
            {
                self.session.take_known();
            }
            if ui
                .add_enabled(
                    connected && count >= LEAST_KNOWN,
                    egui::Button::new("Calibrate"),
                )
                .clicked()
            {
                self.session.start_calibration();
            }
        });
        if self.session.live.simulated_board().is_some() {
            let help = "The next touches of the simulated board, whose places and forces are known";
            let (_, waiting) = self.session.live.is_gathering();
            if ui
                .add_enabled(
                    !waiting,
                    egui::Button::new("Calibrate from the simulated board"),
                )
                .on_hover_text(help)
                .clicked()
            {
                self.session.calibrate_from_board();
            }
        }
        let live = &mut self.session.document.state.project.live;
        if !live.glued.is_empty() {
            ui.label(format!(
                "Calibrated: still off by about {:.1} %",
                100.0 * live.model_error
            ));
            if ui.button("Forget the calibration").clicked() {
                live.forget();
            }
        }
    }
}

fn measurement(ui: &mut Ui, live: &mut LiveKeys) {
    number(
        ui,
        "Gauge factor",
        &mut live.gauge_factor,
        0.1..=500.0,
        0.01,
        "",
        "Relative change of resistance over strain",
    );
    let mut arms = f64::from(live.active_arms);
    number(
        ui,
        "Active arms",
        &mut arms,
        1.0..=4.0,
        0.1,
        "",
        "Of each bridge, that the strain changes; a gauge with a dummy is 1",
    );
    live.active_arms = arms.round() as u8;
    percentage(
        ui,
        "Model error",
        &mut live.model_error,
        0.0..=100.0,
        "What the model is off by beside gluing, over the reading, where its elements leave less; a calibration finds it",
    );
    number(
        ui,
        "Stiffness off",
        &mut live.stiffness_percent,
        0.0..=50.0,
        0.1,
        " %",
        "How far off the part's stiffness is (standard deviation): forces are off by it, no places",
    );
    number(
        ui,
        "Largest force",
        &mut live.largest_force_n,
        0.1..=1e4,
        0.5,
        " N",
        "Nobody presses harder",
    );
    number(
        ui,
        "Drift",
        &mut live.drift_s,
        0.0..=1e4,
        0.5,
        " s",
        "Time in which the rest follows what is read without a touch; 0: never",
    );
}

fn channels(ui: &mut Ui, live: &mut LiveKeys, gauges: usize) {
    let mut channels = if live.channels.len() == gauges {
        live.channels.clone()
    } else {
        (0..gauges).collect()
    };
    let before = channels.clone();
    egui::Grid::new("channels").num_columns(4).show(ui, |ui| {
        for (k, channel) in channels.iter_mut().enumerate() {
            let name = ui.label(format!("Gauge {}", k + 1));
            ui.add(
                DragValue::new(channel)
                    .range(0..=crate::wire::MOST_CHANNELS - 1)
                    .prefix("channel "),
            )
            .labelled_by(name.id)
            .on_hover_text("Of the board, from 0");
            if k % 2 == 1 {
                ui.end_row();
            }
        }
    });
    if channels != before {
        live.channels = channels;
    }
    if let Some((first, second, channel)) = live.shared_channel() {
        let text = format!(
            "Gauges {} and {} are both on channel {channel}",
            first + 1,
            second + 1
        );
        ui.colored_label(theme::ERROR, text);
    }
}
