//! Signs of a player, drawn: fonts do not have them everywhere.

use eframe::egui::{Button, Color32, Painter, Rect, Response, Shape, Stroke, Ui, pos2, vec2};

/// What a button does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Icon {
    /// Back to the start: a bar and two triangles.
    Start,
    /// The frame before: a bar and a triangle.
    Back,
    Play,
    Pause,
    /// The next frame: a triangle and a bar.
    Next,
}

/// A button with a sign.
pub(super) fn icon_button(ui: &mut Ui, icon: Icon) -> Response {
    let response = ui.add(Button::new("").min_size(vec2(34.0, 24.0)));
    let colour = ui.style().interact(&response).text_color();
    let side = 11.0;
    let rect = Rect::from_center_size(response.rect.center(), vec2(side, side));
    draw(ui.painter(), icon, rect, colour);
    response
}

fn draw(painter: &Painter, icon: Icon, rect: Rect, colour: Color32) {
    // Parts of the square: from left to right.
    let bar = |from: f32, to: f32| {
        let x = |share: f32| rect.left() + share * rect.width();
        painter.rect_filled(
            Rect::from_min_max(pos2(x(from), rect.top()), pos2(x(to), rect.bottom())),
            0.0,
            colour,
        );
    };
    let triangle = |base: f32, tip: f32| {
        let x = |share: f32| rect.left() + share * rect.width();
        let mut points = vec![
            pos2(x(base), rect.top()),
            pos2(x(tip), rect.center().y),
            pos2(x(base), rect.bottom()),
        ];
        if tip < base {
            points.reverse();
        }
        painter.add(Shape::convex_polygon(points, colour, Stroke::NONE));
    };
    match icon {
        Icon::Start => {
            bar(-0.1, 0.08);
            triangle(0.6, 0.08);
            triangle(1.1, 0.58);
        }
        Icon::Back => {
            bar(0.05, 0.23);
            triangle(0.95, 0.23);
        }
        Icon::Play => triangle(0.1, 0.95),
        Icon::Pause => {
            bar(0.12, 0.38);
            bar(0.62, 0.88);
        }
        Icon::Next => {
            triangle(0.05, 0.77);
            bar(0.77, 0.95);
        }
    }
}
