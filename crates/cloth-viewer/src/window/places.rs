//! Where the widgets of the panel are, for scripts that drive the window with a mouse.

use std::collections::BTreeMap;

use eframe::egui::{Context, Id, Rect, Response};

/// Name and place of what was marked in this picture.
type Places = BTreeMap<&'static str, Rect>;

fn id() -> Id {
    Id::unique("places of widgets")
}

/// Notes where a widget is, if it has a name.
pub(super) fn mark(name: &'static str, response: &Response) {
    if name.is_empty() {
        return;
    }
    response.ctx.data_mut(|data| {
        let places: &mut Places = data.get_temp_mut_or_default(id());
        places.insert(name, response.rect);
    });
}

/// Left, top, right and lower edge of each widget that was noted since the last call \[point\].
pub(super) fn take(context: &Context) -> BTreeMap<&'static str, [f32; 4]> {
    let places: Option<Places> = context.data_mut(|data| data.remove_temp(id()));
    let edges = |rect: Rect| [rect.min.x, rect.min.y, rect.max.x, rect.max.y];
    places.unwrap_or_default().into_iter().map(|(name, rect)| (name, edges(rect))).collect()
}
