//! Elements of XML: left out, doubled, moved, put into each other.

use std::ops::Range;

use fastrand::Rng;

use super::{LENGTH, any, changes, times};

/// A text with some changes to its elements.
pub(crate) fn changed(rng: &mut Rng, text: &str) -> String {
    let mut text = text.to_owned();
    for _ in 0..changes(rng) {
        let elements = elements(&text);
        if elements.is_empty() {
            break;
        }
        let element = any(rng, &elements).clone();
        let content = text[element.clone()].to_owned();
        match rng.u8(..4) {
            0 => text.replace_range(element, ""),
            1 => {
                let copies = times(rng).min(LENGTH / content.len()) + 1;
                text.replace_range(element, &content.repeat(copies));
            }
            2 => {
                let at = any(rng, &elements).start;
                text.insert_str(at, &content);
            }
            _ => {
                // Around itself: levels that nobody expects.
                let end = content.find('>').map_or(content.len(), |end| end + 1);
                let (open, _) = content.split_at(end);
                let name: String =
                    open[1..].chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
                let open = open.replace("/>", ">");
                let levels = times(rng).min(LENGTH / (open.len() + name.len() + 3)).min(200);
                let close = format!("</{name}>").repeat(levels);
                text.replace_range(element, &[open.repeat(levels), content, close].concat());
            }
        }
    }
    text
}

/// Where elements are, from the `<` of their beginning to the `>` of their end.
fn elements(text: &str) -> Vec<Range<usize>> {
    let mut found = Vec::new();
    let mut open = Vec::new();
    for (start, _) in text.match_indices('<') {
        let Some(end) = text[start..].find('>').map(|end| start + end + 1) else { break };
        let tag = &text[start..end];
        if tag.starts_with("<!") || tag.starts_with("<?") {
            continue;
        }
        if tag.starts_with("</") {
            found.extend(open.pop().map(|start| start..end));
        } else if tag.ends_with("/>") {
            found.push(start..end);
        } else {
            open.push(start);
        }
    }
    found
}
