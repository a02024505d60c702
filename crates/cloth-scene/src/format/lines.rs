//! From byte offsets to lines and columns.

/// Characters are counted ahead up to every multiple of this many bytes, so that a position on a line of
/// megabytes costs no more than one on a short line.
const STRIDE: usize = 1024;

/// Where the lines of a text start.
pub(crate) struct Lines<'a> {
    text: &'a str,
    starts: Vec<usize>,
    /// Characters that begin before each multiple of the stride.
    characters: Vec<usize>,
}

impl<'a> Lines<'a> {
    /// All of it.
    pub(crate) const fn text(&self) -> &'a str {
        self.text
    }

    pub(crate) fn new(text: &'a str) -> Self {
        let after_breaks = text.match_indices('\n').map(|(offset, _)| offset + 1);
        let mut characters = Vec::with_capacity(text.len() / STRIDE + 2);
        let mut before = 0;
        for piece in text.as_bytes().chunks(STRIDE) {
            characters.push(before);
            before += begun(piece);
        }
        characters.push(before);
        Self { text, starts: std::iter::once(0).chain(after_breaks).collect(), characters }
    }

    /// Line and column of a byte, both from 1; the column counts characters.
    pub(crate) fn position(&self, offset: usize) -> (u32, u32) {
        let line = self.starts.partition_point(|&start| start <= offset).max(1);
        let start = self.starts[line - 1];
        let column = if offset <= self.text.len() {
            self.characters_before(offset) - self.characters_before(start)
        } else {
            offset - start
        };
        (saturate(line), saturate(column + 1))
    }

    fn characters_before(&self, offset: usize) -> usize {
        let piece = offset / STRIDE;
        let rest = self.text.as_bytes().get(piece * STRIDE..offset).unwrap_or_default();
        self.characters.get(piece).copied().unwrap_or_default() + begun(rest)
    }
}

/// Characters that begin in these bytes of UTF-8.
fn begun(bytes: &[u8]) -> usize {
    bytes.iter().filter(|&&byte| byte & 0xc0 != 0x80).count()
}

fn saturate(number: usize) -> u32 {
    u32::try_from(number).unwrap_or(u32::MAX)
}

#[cfg(test)]
mod tests {
    use super::Lines;

    #[test]
    fn columns_count_characters() {
        let lines = Lines::new("a\nöö = 1\n");
        assert_eq!(lines.position(0), (1, 1));
        assert_eq!(lines.position(2), (2, 1));
        assert_eq!(lines.position(7), (2, 4));
        assert_eq!(lines.position(999), (3, 989), "past the end, not a panic");
    }

    #[test]
    fn columns_of_long_lines_are_those_that_counting_gives() {
        let text = format!("{}\n{}", "aö€".repeat(700), "xü".repeat(2000));
        let lines = Lines::new(&text);
        for (offset, _) in text.char_indices().step_by(97) {
            let before = &text[..offset];
            let line = before.matches('\n').count() as u32 + 1;
            let column = before.rsplit('\n').next().unwrap().chars().count() as u32 + 1;
            assert_eq!(lines.position(offset), (line, column), "byte {offset}");
        }
    }
}
