//! The views: the limb in space and, beside it, laid flat.

use egui::{Pos2, Rect, Role, Sense, Ui, WidgetInfo};

use super::ask::Ask;
use super::scene::PartScene;
use super::tools;
use super::view::Pane;

/// Share of the width that the unrolled view takes.
const BESIDE: f32 = 0.42;

/// The views, where they lie, once what the pointer does in them was taken in.
pub fn show(scene: &mut PartScene, ui: &mut Ui, ask: &mut Ask<'_>) -> Vec<(Pane, Rect)> {
    ask.view.hover = None;
    scene.stand_upright(ask.session, ask.view);
    let all = ui.available_rect_before_wrap();
    let beside = if ask.view.unrolled_shown { BESIDE } else { 0.0 };
    let split = all.right() - beside * all.width();
    let limb = Rect::from_min_max(all.min, Pos2::new(split, all.bottom()));
    pane(scene, ui, ask, Pane::Limb, limb);
    let mut panes = vec![(Pane::Limb, limb)];
    if ask.view.unrolled_shown {
        let flat = Rect::from_min_max(Pos2::new(split, all.top()), all.max);
        pane(scene, ui, ask, Pane::Unrolled, flat);
        panes.push((Pane::Unrolled, flat));
    }
    ui.advance_cursor_after_rect(all);
    panes
}

/// Takes in what the pointer does in a view.
fn pane(scene: &PartScene, ui: &mut Ui, ask: &mut Ask<'_>, pane: Pane, rect: Rect) {
    let name = match pane {
        Pane::Limb => "3D view",
        Pane::Unrolled => "Unrolled view",
    };
    let response = ui.interact(rect, ui.scope_id().with(name), Sense::click_and_drag());
    response.widget_info(|| WidgetInfo::labeled(Role::Canvas, true, name));
    match pane {
        Pane::Limb => ask.view.rect = rect,
        Pane::Unrolled => {
            ask.view.flat_rect = rect;
            if ask.view.flat.1 == 0.0 {
                scene.show_all_flat(ask.view);
            }
        }
    }
    tools::navigate(ask.view, ui, &response, pane);
    tools::use_tool(scene, ask, ui, &response, pane);
}
