//! Over the views: tools and what they need, what colours the limb, and how it is looked at.

mod expected;

use egui::{DragValue, Ui};

use super::ask::Ask;
use super::commands::UiCommand;
use super::scene::PartScene;
use super::view::{Field, SectionPlane, Tool};
use crate::document::Layer;
use crate::mesh::stance::Direction;
use crate::render::camera::Preset;
use expected::expected_lines;

/// The side of the part that a section cuts away.
fn side_name(side: Direction) -> &'static str {
    match side {
        Direction::Front => "Front",
        Direction::Right => "Right",
        Direction::Up => "Top",
    }
}

/// What a stroke is repeated from and to.
fn mirror_name(across: Option<Direction>) -> &'static str {
    match across {
        None => "No mirror",
        Some(Direction::Front) => "Front–back",
        Some(Direction::Right) => "Left–right",
        Some(Direction::Up) => "Up–down",
    }
}

/// Two rows that stay as high as they are, whatever is chosen in them.
pub fn toolbar(ask: &mut Ask<'_>, scene: &PartScene, ui: &mut Ui) {
    egui::Frame::new()
        .fill(ui.visuals().panel_fill)
        .inner_margin(egui::Margin::symmetric(8, 5))
        .show(ui, |ui| {
            ui.set_min_width(ui.available_width());
            ui.spacing_mut().item_spacing.y = 4.0;
            ui.horizontal_wrapped(|ui| {
                for tool in Tool::ALL {
                    ask.toggle(ui, UiCommand::Tool(tool));
                }
                ui.separator();
                field_controls(ask, scene, ui);
            });
            ui.horizontal_wrapped(|ui| {
                for command in [
                    UiCommand::SeeThrough,
                    UiCommand::Section,
                    UiCommand::Unrolled,
                    UiCommand::Jig,
                ] {
                    ask.toggle(ui, command);
                }
                ui.separator();
                for preset in Preset::ALL {
                    ask.toggle(ui, UiCommand::Look(preset));
                }
                ask.toggle(ui, UiCommand::Frame);
            });
        });
}

/// What the chosen tool and the section need, over the view: nothing moves when it comes and goes.
pub fn options(ask: &mut Ask<'_>, scene: &PartScene, ui: &Ui, view: egui::Rect) {
    let has = ask.view.section.is_some()
        || ask.view.tool.paints()
        || ask.view.ranges.of(ask.view.field).is_some()
        || ask.view.tool == Tool::Gauges
        || ask.view.field == Field::Expected;
    ask.view.covered = egui::Rect::NOTHING;
    if !has {
        return;
    }
    // In a layer of its own: what is pressed there is not pressed on the limb beneath.
    let id = egui::Id::unique("tool options");
    let area = egui::Area::new(id)
        .order(egui::Order::Middle)
        .fixed_pos(view.left_top() + egui::vec2(10.0, 10.0));
    let shown = area.show(ui.ctx(), |ui| {
        let fill = ui.visuals().panel_fill.gamma_multiply(0.92);
        egui::Frame::new()
            .fill(fill)
            .corner_radius(6.0)
            .inner_margin(8.0)
            .show(ui, |ui| {
                ui.set_max_width(190.0);
                paint_controls(ask, ui);
                gauge_controls(ask, ui);
                if ask.view.tool == Tool::Gauges || ask.view.field == Field::Expected {
                    expected_lines(ask, ui);
                }
                section_controls(ask, scene, ui);
                range_controls(ask, ui);
            });
    });
    ask.view.covered = shown.response.rect;
}

fn gauge_controls(ask: &mut Ask<'_>, ui: &mut Ui) {
    if ask.view.tool != Tool::Gauges {
        return;
    }
    let all = ask.project().selection.sites.len();
    ui.label(format!("{all} gauges, {} picked", ask.view.picked.len()));
    ui.horizontal(|ui| {
        ask.toggle(ui, UiCommand::Pin);
        ask.toggle(ui, UiCommand::RemoveGauges);
    });
    ui.horizontal(|ui| {
        ask.toggle(ui, UiCommand::AddHelpful);
        ask.toggle(ui, UiCommand::FindSpare);
    });
}

fn paint_controls(ask: &mut Ask<'_>, ui: &mut Ui) {
    if !ask.view.tool.paints() {
        return;
    }
    egui::ComboBox::new("layer", "")
        .selected_text(ask.view.layer.name())
        .width(96.0)
        .show_ui(ui, |ui| {
            let solid = ask.session.document.is_solid();
            for layer in Layer::ALL.into_iter().filter(|l| solid || !l.is_face()) {
                let chosen = &mut ask.view.layer;
                if ui.selectable_value(chosen, layer, layer.name()).clicked() {
                    ask.view.show_layer();
                }
            }
        })
        .response
        .on_hover_text("What is painted: where gauges may go, where they must not, what is held, where touches come, and where they come often")
        .accessible_name("Layer");
    if ask.view.tool.is_brush() {
        let mut mm = ask.view.brush * 1000.0;
        ui.add(
            DragValue::new(&mut mm)
                .range(0.5..=500.0)
                .speed(0.1)
                .fixed_decimals(1)
                .prefix("Radius ")
                .suffix(" mm"),
        )
        .on_hover_text("Of the brush over the surface ([ and ], or the wheel with Shift)")
        .accessible_name("Radius of the brush");
        ask.view.brush = mm / 1000.0;
        mirror_control(ask, ui);
    }
    ui.horizontal_wrapped(|ui| {
        for command in [
            UiCommand::FillPaint,
            UiCommand::InvertPaint,
            UiCommand::GrowPaint,
            UiCommand::ShrinkPaint,
            UiCommand::ClearPaint,
        ] {
            ask.toggle(ui, command);
        }
    });
}

fn mirror_control(ask: &mut Ask<'_>, ui: &mut Ui) {
    let options = std::iter::once(None).chain(Direction::ALL.map(Some));
    egui::ComboBox::new("mirror", "")
        .selected_text(mirror_name(ask.view.mirror))
        .width(80.0)
        .show_ui(ui, |ui| {
            for option in options {
                ui.selectable_value(&mut ask.view.mirror, option, mirror_name(option));
            }
        })
        .response
        .on_hover_text(
            "Repeat each stroke on the other side of the part's middle, as the part stands",
        )
        .accessible_name("Mirror");
}

fn field_controls(ask: &mut Ask<'_>, scene: &PartScene, ui: &mut Ui) {
    egui::ComboBox::new("field", "")
        .selected_text(ask.view.field.name())
        .width(128.0)
        .height(400.0)
        .show_ui(ui, |ui| {
            for field in Field::ALL {
                ui.selectable_value(&mut ask.view.field, field, field.name());
            }
        })
        .response
        .on_hover_text("What colours the limb")
        .accessible_name("Field");
    let shown = scene.built.as_ref().and_then(|b| b.legend.clone());
    let Some(legend) = shown else {
        return;
    };
    let field = ask.view.field;
    let mut fixed = ask.view.ranges.of(field).is_some();
    let tick = ui
        .add(egui::Button::selectable(fixed, "Fixed range"))
        .on_hover_text("Keep the range of the colours whatever the values are");
    if tick.clicked() {
        fixed = !fixed;
        let range = fixed.then_some((legend.low, legend.high));
        ask.view.ranges.set(field, range);
    }
}

fn range_controls(ask: &mut Ask<'_>, ui: &mut Ui) {
    let field = ask.view.field;
    let Some((mut low, mut high)) = ask.view.ranges.of(field) else {
        return;
    };
    let speed = 0.005 * (high - low).abs().max(1e-9);
    ui.horizontal(|ui| {
        ui.label("Range");
        ui.add(DragValue::new(&mut low).speed(speed).max_decimals(3))
            .accessible_name("Lowest value of the colours");
        ui.label("to");
        ui.add(DragValue::new(&mut high).speed(speed).max_decimals(3))
            .accessible_name("Highest value of the colours");
    });
    ask.view.ranges.set(field, Some((low, high)));
}

fn section_controls(ask: &mut Ask<'_>, scene: &PartScene, ui: &mut Ui) {
    let around = scene.around;
    let Some(section) = &mut ask.view.section else {
        return;
    };
    ui.horizontal_wrapped(|ui| {
        ui.label("Cut away");
        for side in Direction::ALL {
            let name = side_name(side);
            let button = ui
                .add(egui::Button::selectable(section.side == side, name))
                .accessible_name(format!("Cut away: {}", name.to_lowercase()));
            if button.clicked() {
                *section = SectionPlane::halving(&around, side, section.flip);
            }
        }
        let flip = ui
            .add(egui::Button::selectable(section.flip, "Flip"))
            .on_hover_text("Cut away the other side")
            .accessible_name("Flip the section");
        if flip.clicked() {
            section.flip = !section.flip;
        }
    });
    let [low, high] = around.span(section.side);
    let mut mm = section.offset * 1000.0;
    ui.spacing_mut().slider_width = 110.0;
    ui.add(
        egui::Slider::new(&mut mm, low * 1000.0..=high * 1000.0)
            .suffix(" mm")
            .fixed_decimals(1),
    )
    .on_hover_text("Where it is cut")
    .accessible_name("Place of the section");
    section.offset = mm / 1000.0;
}
