//! The line that an error of the model is about.

use cloth_core::{ModelError, fabric::FabricError};

use crate::{Scene, SceneError};

/// Adds the place to an error of the model. The model knows nothing of files, but its messages name
/// the owner and the quantity; the key that fits these words best is where the writer has to look.
pub(super) fn place(scene: &Scene, source: ModelError) -> SceneError {
    let message = source.to_string();
    let table = table(scene, &message);
    let key = match &source {
        ModelError::NonFinite { what, .. }
        | ModelError::NotPositive { what, .. }
        | ModelError::Negative { what, .. }
        | ModelError::OutOfRange { what, .. } => key(scene, &table, what),
        ModelError::PinOutOfRange { .. } => format!("{table}.pins"),
        ModelError::NameTaken { .. } => format!("{table}.name"),
        ModelError::Fabric(error) => match **error {
            FabricError::Coupling { .. }
            | FabricError::BiasRigidity { .. }
            | FabricError::TensileCurve { .. } => format!("{table}.material"),
            _ => format!("{table}.pattern"),
        },
        ModelError::Seam(_) => table.clone(),
        ModelError::ContactOfNothing { .. } | ModelError::ContactBetween { .. } => {
            format!("{table}.between")
        }
        ModelError::PatternMissing { .. } => format!("{table}.pattern.from"),
        _ => format!("{table}.geometry"),
    };
    SceneError::Model { place: scene.origin.place(&key), source }
}

/// The same where seams join what is right by itself.
pub(super) fn sewn(scene: &Scene, source: ModelError) -> SceneError {
    let ModelError::EdgeInconsistent { .. } = &source else { return place(scene, source) };
    let table = table(scene, &source.to_string());
    let key = format!("{table}.geometry");
    let problem = format!(
        "`{key}`: seams join the outer side of one piece to the inner side of another: turn one of them around, as the back of a shirt is, by \
         `rotation = {{ axis = [0, 0, 1], degrees = 180 }}`, which also puts its left edge where the right one was"
    );
    SceneError::Value { place: scene.origin.place(&key), problem }
}

/// The table of the scene that `message` is about.
fn table(scene: &Scene, message: &str) -> String {
    let rules = scene.contact.as_ref().map_or(0, |contact| contact.rules.len());
    if let Some(rule) = (0..rules).find(|i| message.contains(&format!("rule {i} of contact"))) {
        return format!("contact.rule[{rule}]");
    }
    // The later of two things with the same name is the one to rename, so look from the end.
    let cloth = scene.cloths.iter().rposition(|cloth| {
        let name = &cloth.name;
        message.contains(&format!("cloth {name:?}"))
            || message.contains(&format!("cloths are called {name:?}"))
    });
    let collider = scene.colliders.iter().rposition(|collider| {
        let name = &collider.name;
        message.contains(&format!("collider {name:?}"))
            || message.contains(&format!("colliders are called {name:?}"))
    });
    let rigid = scene.rigids.iter().rposition(|rigid| {
        let name = &rigid.name;
        message.contains(&format!("collider {name:?}"))
            || message.contains(&format!("colliders are called {name:?}"))
    });
    if let Some(index) = rigid {
        return format!("rigid[{index}]");
    }
    let seam = scene.seams.iter().rposition(|seam| {
        let name = &seam.name;
        message.contains(&format!("seam {name:?}"))
            || message.contains(&format!("seams are called {name:?}"))
    });
    if let Some(index) = seam {
        return format!("seam[{index}]");
    }
    let attachment = scene.attachments.iter().rposition(|attachment| {
        let name = &attachment.name;
        message.contains(&format!("seam {name:?}"))
            || message.contains(&format!("seams are called {name:?}"))
    });
    if let Some(index) = attachment {
        return format!("attachment[{index}]");
    }
    let elastic = scene.elastics.iter().rposition(|band| {
        let name = &band.name;
        message.contains(&format!("seam {name:?}"))
            || message.contains(&format!("seams are called {name:?}"))
    });
    if let Some(index) = elastic {
        return format!("elastic[{index}]");
    }
    let field = (0..scene.fields.len()).find(|i| message.contains(&format!("of field {i} ")));
    match (cloth, collider, field) {
        (Some(index), ..) => format!("cloth[{index}]"),
        (_, Some(index), _) => format!("collider[{index}]"),
        (.., Some(index)) => format!("field[{index}]"),
        _ => [
            ("gravity", "gravity"),
            ("self-contact", "contact"),
            ("the air", "wind"),
            ("wind", "wind"),
            ("gust", "wind.gust"),
            ("time step", "simulation"),
            ("strain", "simulation"),
        ]
        .into_iter()
        .find_map(|(word, table)| message.contains(word).then_some(table))
        .unwrap_or_default()
        .to_owned(),
    }
}

/// The key of `table` whose words are all in `what`, the one with most of them; the table itself if
/// there is none.
fn key(scene: &Scene, table: &str, what: &str) -> String {
    // Keys have plurals where messages speak of one.
    let in_what = |part: &&str| {
        what.split(' ').any(|word| word == *part || part.strip_suffix('s') == Some(word))
    };
    let words_in_what = |segment: &str| segment.split('_').filter(in_what).count();
    scene
        .origin
        .places
        .keys()
        .filter_map(|key| {
            let inner = key.strip_prefix(table)?.strip_prefix('.')?;
            let leaf = inner.rsplit('.').next()?;
            let whole = words_in_what(leaf) == leaf.split('_').count();
            let score: usize = inner.split('.').map(words_in_what).sum();
            // Among equals the shorter key, then the alphabet, so that the answer never varies.
            whole.then_some((score, std::cmp::Reverse((key.len(), key))))
        })
        .max()
        .map_or_else(|| table.to_owned(), |(_, std::cmp::Reverse((_, key)))| key.clone())
}
