//! Settings of the live stage.

use egui::{ComboBox, DragValue, RichText, TextEdit, Ui};

use super::super::action::{BoardAction, FileAction};
use super::super::ask::Ask;
use super::super::commands::UiCommand;
use super::super::form::{choice, number, percentage, rows};
use super::super::learned::estimator_shown;
use super::super::theme;
use super::super::words::live_in_words;
use super::known::known_form;
use crate::board::Illness;
use crate::link::{PortInfo, ports};
use crate::live::ShownEstimator;
use crate::project::LiveKeys;
use crate::session::{Desk, Mishap, Task, USUAL_ADDRESS};

/// What is typed at the live stage.
#[derive(Default)]
pub struct LiveForm {
    port: String,
    ports: Vec<PortInfo>,
    estimator: String,
    pub record_to: String,
    serve_at: String,
}

/// The settings.
pub fn live_form(ask: &mut Ask<'_>, form: &mut LiveForm, ui: &mut Ui) {
    board_form(ask, form, ui);
    if ask.session.live.is_connected() {
        connected_form(ask, form, ui);
    }
    ui.collapsing("Learned from presses", |ui| estimator_form(ask, form, ui));
    let gauges = ask.project().selection.sites.len();
    ask.edit(|project| {
        let live = &mut project.live;
        rows(ui, "Measurement", |ui| measurement(ui, live));
        ui.collapsing("Channels of the gauges", |ui| channels(ui, live, gauges));
    });
    ui.collapsing("Known touches", |ui| known_form(ask, ui));
    let live = &ask.session.live;
    if live.is_connected() || live.served_at.is_some() {
        ui.collapsing("Messages for robots", |ui| messages_form(ask, form, ui));
    }
}

fn board_form(ask: &mut Ask<'_>, form: &mut LiveForm, ui: &mut Ui) {
    let mut connect = false;
    rows(ui, "Board", |ui| {
        let name = ui.label("Port");
        ui.horizontal(|ui| {
            let field = TextEdit::singleline(&mut form.port)
                .desired_width(130.0)
                .hint_text("port, host:port or file");
            let field = ui.add(field).labelled_by(name.id);
            connect |= field.lost_focus() && ui.input(|i| i.key_pressed(egui::Key::Enter));
            port_list(form, ui);
        });
        ui.end_row();
        let name = ui.label("Baud");
        ask.edit_desk(|desk| {
            ui.add(
                DragValue::new(&mut desk.baud)
                    .range(300..=4_000_000)
                    .speed(100.0),
            )
            .labelled_by(name.id)
            .on_hover_text("Native USB does not care");
        });
        ui.end_row();
        ui.label("");
        connect |= ui
            .add_enabled(!form.port.trim().is_empty(), egui::Button::new("Connect"))
            .on_hover_text("Listen to the board at this port, or replay this recording (.hapdrec)")
            .clicked();
        ui.end_row();
    });
    if connect {
        ask.act(BoardAction::Connect(form.port.clone()));
    }
    ask.button(ui, UiCommand::SimulatedBoard);
    ask.button(ui, UiCommand::Disconnect);
    state_lines(ask, ui);
}

fn port_list(form: &mut LiveForm, ui: &mut Ui) {
    let shown = ComboBox::from_id_salt("ports")
        .selected_text("")
        .width(20.0);
    let answer = shown.show_ui(ui, |ui| {
        if form.ports.is_empty() {
            ui.weak("No port was found");
        }
        for port in &form.ports {
            let text = format!("{}  {}", port.path, port.product);
            let text = if port.likely {
                RichText::new(text).strong()
            } else {
                RichText::new(text)
            };
            if ui.selectable_label(form.port == port.path, text).clicked() {
                form.port.clone_from(&port.path);
            }
        }
    });
    let opened = answer
        .response
        .accessible_name("Ports")
        .on_hover_text("Ports of this machine, the likeliest board first");
    if opened.clicked() {
        form.ports = ports();
    }
}

fn state_lines(ask: &Ask<'_>, ui: &mut Ui) {
    let (text, colour) = live_in_words(ask.session);
    let text = RichText::new(text);
    ui.label(match colour {
        Some(colour) => text.color(colour),
        None => text,
    });
    let said = ask.session.live.look(|feed| {
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

fn connected_form(ask: &mut Ask<'_>, form: &mut LiveForm, ui: &mut Ui) {
    ui.add_space(4.0);
    ui.horizontal(|ui| {
        ask.button(ui, UiCommand::Tare);
        if ask.session.live.simulated_board().is_some() {
            faults(ask, ui);
        }
    });
    let learned = ask.session.learns_alone();
    ask.edit_desk(|desk| rows(ui, "Touch", |ui| estimators(ui, desk, learned)));
    if let Some(learnt) = ask.session.learnt() {
        let name = learnt.path.file_name().unwrap_or_default();
        let text = format!("Goes by {}", name.to_string_lossy());
        ui.add(egui::Label::new(RichText::new(text).weak()).wrap());
    }
    recording_form(ask, form, ui);
}

/// A file that live touch goes by instead of the project's model.
fn estimator_form(ask: &mut Ask<'_>, form: &mut LiveForm, ui: &mut Ui) {
    let name = ui.label("Estimator's file");
    ui.horizontal(|ui| {
        let field = TextEdit::singleline(&mut form.estimator)
            .desired_width(160.0)
            .hint_text("path of a .hapdtouch");
        let field = ui.add(field).labelled_by(name.id);
        let entered = field.lost_focus() && ui.input(|i| i.key_pressed(egui::Key::Enter));
        let named = !form.estimator.trim().is_empty();
        let help = "Go by what was learned from presses: at the stage “Bench”, or by hapdef train";
        let open = ui.add_enabled(named, egui::Button::new("Open estimator"));
        if (open.on_hover_text(help).clicked() || entered) && named {
            ask.act(FileAction::OpenEstimator(form.estimator.trim().into()));
        }
    });
    let Some(learnt) = ask.session.learnt() else {
        ui.weak("Touches are found by the project's model");
        return;
    };
    estimator_shown(ui, learnt);
    let help = "Go by the project's model, as its known touches have calibrated it";
    if ui.button("Close estimator").on_hover_text(help).clicked() {
        ask.act(BoardAction::CloseEstimator);
    }
}

fn estimators(ui: &mut Ui, desk: &mut Desk, learned: bool) {
    let all = if learned {
        &ShownEstimator::ALL[..]
    } else {
        &ShownEstimator::ALL[..3]
    };
    choice(
        ui,
        "Estimator",
        &mut desk.estimator,
        all,
        ShownEstimator::label,
        "Model matching needs no training and says how sure it is; the others learn from the model first",
    );
    ui.label("");
    ui.checkbox(&mut desk.compare, "Compare all")
        .on_hover_text("Show what the others say too");
    ui.end_row();
}

fn faults(ask: &mut Ask<'_>, ui: &mut Ui) {
    ui.menu_button("Faults", |ui| {
        for (name, mishap) in [
            ("Unplug for 2 s", Mishap::Unplugged),
            ("Gauge 1 dies", Mishap::Ill(Illness::Dead)),
            ("Gauge 2 sticks", Mishap::Ill(Illness::Stuck)),
            ("Gauge 3 saturates", Mishap::Ill(Illness::Saturated)),
            ("Gauge 4 gets noisy", Mishap::Ill(Illness::Noisy)),
            ("All gauges recover", Mishap::Recovery),
        ] {
            if ui.button(name).clicked() {
                ask.act(BoardAction::Mishap(mishap));
                ui.close();
            }
        }
    })
    .response
    .on_hover_text("What goes wrong at the simulated board");
}

fn recording_form(ask: &mut Ask<'_>, form: &mut LiveForm, ui: &mut Ui) {
    let recording = ask.session.live.look(|f| f.recording.clone()).flatten();
    rows(ui, "Recording", |ui| {
        let name = ui.label("File");
        let field = TextEdit::singleline(&mut form.record_to)
            .desired_width(150.0)
            .hint_text("touches.hapdrec");
        ui.add(field).labelled_by(name.id);
        ui.end_row();
    });
    ui.horizontal(|ui| {
        let name = if recording.is_some() { "Stop recording" } else { "Record" };
        if ui.button(name).on_hover_text(UiCommand::Record.tooltip()).clicked() {
            ask.act(BoardAction::ToggleRecording(form.record_to.clone()));
        }
        let last = ask.session.live.recorded.clone().filter(|_| recording.is_none());
        let table = egui::Button::new("Write a table");
        let help = "The last recording as .csv beside it: counts, touches, and the truth of a simulated board";
        let free = last.is_some() && !ask.session.jobs.runs(Task::Table);
        if ui.add_enabled(free, table).on_hover_text(help).clicked()
            && let Some(path) = last
        {
            ask.act(FileAction::WriteTable(path));
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

/// Touches for robots and their tools.
fn messages_form(ask: &mut Ask<'_>, form: &mut LiveForm, ui: &mut Ui) {
    let rows = egui::Grid::new("messages").num_columns(2);
    rows.spacing([10.0, 5.0]).show(ui, |ui| {
        let name = ui.label("Foxglove");
        let served = ask.session.live.served_at;
        ui.horizontal(|ui| {
            let field = TextEdit::singleline(&mut form.serve_at)
                .desired_width(105.0)
                .hint_text(USUAL_ADDRESS);
            // The name of a host may take a while to be looked up.
            let serves = served.is_some() || ask.session.jobs.runs(Task::Serve);
            ui.add_enabled(!serves, field).labelled_by(name.id);
            let (label, action) = if serves {
                ("Stop serving", BoardAction::StopServing)
            } else {
                ("Serve", BoardAction::Serve(form.serve_at.clone()))
            };
            let help =
                "Touches as they come, to Foxglove and others that speak its WebSocket protocol";
            if ui.button(label).on_hover_text(help).clicked() {
                ask.act(action);
            }
        });
        ui.end_row();
        let busy = ask.session.live.look(|f| f.recording.is_some()) == Some(true)
            || ask.session.jobs.runs(Task::Messages);
        let last = ask.session.live.recorded.clone().filter(|_| !busy);
        ui.label("");
        let help = "The touches of the last recording as messages of ROS (.mcap) beside it, for Foxglove and other readers";
        let button = egui::Button::new("Write messages");
        if ui
            .add_enabled(last.is_some(), button)
            .on_hover_text(help)
            .clicked()
            && let Some(path) = last
        {
            ask.act(FileAction::WriteMessages(path));
        }
        ui.end_row();
    });
}

fn measurement(ui: &mut Ui, live: &mut LiveKeys) {
    number(
        ui,
        "Gauge factor",
        &mut live.gauge_factor,
        LiveKeys::gauge_factor(),
        0.01,
    );
    let mut arms = f64::from(live.active_arms);
    number(ui, "Active arms", &mut arms, LiveKeys::active_arms(), 0.1);
    live.active_arms = arms.round() as u8;
    percentage(
        ui,
        "Model error",
        &mut live.model_error,
        LiveKeys::model_error(),
    );
    number(
        ui,
        "Stiffness off",
        &mut live.stiffness_percent,
        LiveKeys::stiffness_percent(),
        0.1,
    );
    number(
        ui,
        "Pushed aside",
        &mut live.friction_percent,
        LiveKeys::friction_percent(),
        0.5,
    );
    number(
        ui,
        "Largest force",
        &mut live.largest_force_n,
        LiveKeys::largest_force_n(),
        0.5,
    );
    number(ui, "Drift", &mut live.drift_s, LiveKeys::drift_s(), 0.5);
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
                    .range(LiveKeys::channels().counts())
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
