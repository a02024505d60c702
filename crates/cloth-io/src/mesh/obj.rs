//! Wavefront OBJ.
//!
//! The reader is our own because pins refer to vertices by their index in the file: the OBJ crates
//! renumber vertices by first use and drop unused ones, or hold positions in single precision, or
//! refuse a file at the first statement that they do not know (sewing patterns carry such).

use cloth_core::{MeshStitch, TriangleMesh};

use super::assembly::{Corner, MeshAssembly};
use super::{MeshError, MeshPlace};

/// Reads an OBJ mesh from `bytes`; `file` is the name used in errors.
///
/// Polygons become fans of triangles. `o` and `g` statements become vertex groups of the vertices of
/// the faces (`f`), lines (`l`) and points (`p`) that follow them: a group that is to hold single
/// vertices lists them as points. Texture coordinates keep their own indices; they are left out
/// unless every corner of every face has one. Statements that describe neither positions, texture
/// coordinates, faces, groups nor stitches are skipped.
///
/// # Errors
///
/// [`MeshError`] with the line, see [`mesh_read`](crate::mesh_read).
pub fn mesh_read_obj(file: &str, bytes: &[u8]) -> Result<TriangleMesh, MeshError> {
    let mut reader = ObjReader::new(file);
    let mut joined = Vec::new();
    for (number, line) in bytes.split(|&byte| byte == b'\n').enumerate() {
        let line = line.strip_suffix(b"\r").unwrap_or(line);
        // A backslash at the end joins the line with the next one.
        if let Some(start) = line.strip_suffix(b"\\") {
            joined.extend_from_slice(start);
            joined.push(b' ');
            continue;
        }
        if joined.is_empty() {
            reader.statement(number + 1, line)?;
        } else {
            joined.extend_from_slice(line);
            reader.statement(number + 1, &std::mem::take(&mut joined))?;
        }
    }
    reader.statement(0, &joined)?;
    reader.assembly.finish(file)
}

/// Most names in one `g` statement: each of them holds every vertex of the faces that follow.
const GROUPS_MAX: usize = 64;

struct ObjReader<'file> {
    file: &'file str,
    assembly: MeshAssembly,
    /// Numbers of the names in force.
    object: Option<u32>,
    groups: Vec<u32>,
    corners: Vec<Corner>,
    /// Lines `seam` so far.
    seams: u32,
}

impl<'file> ObjReader<'file> {
    fn new(file: &'file str) -> Self {
        Self {
            file,
            assembly: MeshAssembly::new(MeshPlace::Line, 1),
            object: None,
            groups: Vec::new(),
            corners: Vec::new(),
            seams: 0,
        }
    }

    fn statement(&mut self, line: usize, bytes: &[u8]) -> Result<(), MeshError> {
        // Old exporters write names in other encodings; only names can be affected.
        let text = String::from_utf8_lossy(bytes);
        let text = text.split('#').next().unwrap_or_default();
        let mut words = text.split_whitespace();
        match words.next() {
            Some("v") => {
                let position = self.numbers::<3>(line, "a vertex position", 3, words)?;
                self.assembly.positions.push(position);
            }
            Some("vt") => {
                let coordinate = self.numbers::<2>(line, "a texture coordinate", 1, words)?;
                self.assembly.coordinates.push(coordinate);
            }
            Some("f") => self.face(line, words)?,
            Some("l" | "p") => self.members(line, words)?,
            Some("o") => {
                self.object = match words.next() {
                    Some(_) => Some(self.assembly.name(self.file, name_after(text, "o"))?),
                    None => None,
                };
                self.groups_begin();
            }
            Some("g") => {
                self.groups.clear();
                for (count, word) in words.enumerate() {
                    if count == GROUPS_MAX {
                        let problem = format!("a face is in more than {GROUPS_MAX} groups");
                        return Err(self.syntax(line, problem));
                    }
                    self.groups.push(self.assembly.name(self.file, word)?);
                }
                self.groups_begin();
            }
            Some("seam") => self.seams += 1,
            Some("stitch") => self.stitch(line, words)?,
            _ => {}
        }
        Ok(())
    }

    /// Reads `stitch vertex first second place`: unlike those of faces, the numbers of vertices count from 0. The vertex is sewn to the
    /// edge from the first to the second, at 0 to the first and at 1 to the second; with one number less, or two, to a vertex.
    fn stitch<'text>(
        &mut self,
        line: usize,
        words: impl Iterator<Item = &'text str>,
    ) -> Result<(), MeshError> {
        let words: Vec<&str> = words.collect();
        let bad = |word: &str| format!("`{word}` in a stitch is not a vertex, which count from 0");
        let vertex = |word: &str| -> Result<u32, MeshError> {
            let index: i64 = word.parse().map_err(|_| self.syntax(line, bad(word)))?;
            let count = self.assembly.positions.len();
            let found = u32::try_from(index).ok().filter(|&index| (index as usize) < count);
            found.ok_or_else(|| MeshError::Index {
                file: self.file.to_owned(),
                place: MeshPlace::Line(line),
                what: "vertex of a stitch (these count from 0)",
                index,
                count,
            })
        };
        let (vertex, edge, place) = match words[..] {
            [a, b] => (vertex(a)?, [vertex(b)?; 2], 0.0),
            [a, b, c, place] => {
                let place: f64 = place
                    .parse()
                    .ok()
                    .filter(|place| (0.0..=1.0).contains(place))
                    .ok_or_else(|| {
                        let problem =
                            format!("`{place}` in a stitch is no place on an edge, from 0 to 1");
                        self.syntax(line, problem)
                    })?;
                (vertex(a)?, [vertex(b)?, vertex(c)?], place)
            }
            _ => {
                let problem = "a stitch has two vertices, or a vertex, the two of an edge, and the place on it";
                return Err(self.syntax(line, problem.into()));
            }
        };
        let end = edge[usize::from(place > 0.5)];
        if edge.contains(&vertex) && (edge[0] == edge[1] || end == vertex) {
            let problem = format!("vertex {vertex} is stitched to itself: remove that line");
            return Err(self.syntax(line, problem));
        }
        let seam = self.seams.saturating_sub(1);
        self.assembly.stitches.push(MeshStitch { vertex, edge, place, seam });
        Ok(())
    }

    fn groups_begin(&mut self) {
        let mut names: Vec<u32> = self.object.iter().chain(&self.groups).copied().collect();
        names.sort_unstable();
        names.dedup();
        self.assembly.groups_begin(names);
    }

    /// Reads up to `N` numbers, at least `least`; missing ones are zero and further ones (a weight
    /// or a colour) are left.
    fn numbers<'text, const N: usize>(
        &self,
        line: usize,
        what: &str,
        least: usize,
        words: impl Iterator<Item = &'text str>,
    ) -> Result<[f64; N], MeshError> {
        let mut numbers = [0.0; N];
        let mut count = 0;
        for (slot, word) in numbers.iter_mut().zip(words) {
            *slot = word
                .parse()
                .map_err(|_| self.syntax(line, format!("`{word}` in {what} is not a number")))?;
            count += 1;
        }
        if count < least {
            let problem = format!("{what} needs {least} numbers but has {count}");
            return Err(self.syntax(line, problem));
        }
        Ok(numbers)
    }

    fn face<'text>(
        &mut self,
        line: usize,
        words: impl Iterator<Item = &'text str>,
    ) -> Result<(), MeshError> {
        let mut corners = std::mem::take(&mut self.corners);
        corners.clear();
        for word in words {
            corners.push(self.corner(line, word)?);
        }
        self.assembly.polygon(self.file, line, &corners)?;
        self.corners = corners;
        Ok(())
    }

    /// Takes the vertices of a line or of points into the groups in force.
    fn members<'text>(
        &mut self,
        line: usize,
        words: impl Iterator<Item = &'text str>,
    ) -> Result<(), MeshError> {
        for word in words {
            let corner = self.corner(line, word)?;
            self.assembly.member(self.file, line, corner.vertex)?;
        }
        Ok(())
    }

    /// Reads `v`, `v/vt`, `v//vn` or `v/vt/vn`.
    fn corner(&self, line: usize, word: &str) -> Result<Corner, MeshError> {
        let mut parts = word.split('/');
        let vertex = parts.next().unwrap_or_default();
        let vertex = self.index(line, word, vertex, self.assembly.positions.len(), "vertex")?;
        let texture = match parts.next() {
            None | Some("") => None,
            Some(part) => {
                let count = self.assembly.coordinates.len();
                Some(self.index(line, word, part, count, "texture coordinate")?)
            }
        };
        Ok(Corner { vertex, texture })
    }

    /// Turns an index of the file, one based or negative from the end, into a zero-based one.
    fn index(
        &self,
        line: usize,
        word: &str,
        part: &str,
        count: usize,
        what: &'static str,
    ) -> Result<i64, MeshError> {
        let index: i64 = part.parse().map_err(|_| {
            self.syntax(line, format!("`{word}` is not a face corner like 7 or 7/3 or 7/3/5"))
        })?;
        let zero_based = if index < 0 {
            i64::try_from(count).unwrap_or(i64::MAX).checked_add(index)
        } else {
            Some(index - 1)
        };
        zero_based.filter(|&index| index >= 0).ok_or_else(|| MeshError::Index {
            file: self.file.to_owned(),
            place: MeshPlace::Line(line),
            what,
            index,
            count,
        })
    }

    fn syntax(&self, line: usize, problem: String) -> MeshError {
        MeshError::Syntax { file: self.file.to_owned(), place: MeshPlace::Line(line), problem }
    }
}

/// The rest of the line after the keyword: object names may hold spaces.
fn name_after<'text>(text: &'text str, keyword: &str) -> &'text str {
    let text = text.trim();
    text.strip_prefix(keyword).unwrap_or(text).trim()
}
