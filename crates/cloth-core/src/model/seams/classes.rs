//! Sets of vertices that are one.

/// A partition of vertices; each class is named by its smallest.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct VertexClasses {
    smaller: Vec<u32>,
}

impl VertexClasses {
    /// Each vertex alone.
    #[must_use]
    pub fn new(count: usize) -> Self {
        Self { smaller: (0..count as u32).collect() }
    }

    /// The smallest vertex of the class of `vertex`.
    #[must_use]
    pub fn of(&self, mut vertex: u32) -> u32 {
        // Entries point downwards, so that this ends.
        while self.smaller[vertex as usize] != vertex {
            vertex = self.smaller[vertex as usize];
        }
        vertex
    }

    /// Makes one class of those of two vertices.
    pub fn join(&mut self, a: u32, b: u32) {
        let [a, b] = [self.of(a), self.of(b)];
        self.smaller[a.max(b) as usize] = a.min(b);
        // Short ways keep long seams fast.
        for vertex in [a, b] {
            self.smaller[vertex as usize] = a.min(b);
        }
    }

    /// The class of each vertex.
    #[must_use]
    pub fn all(&self) -> Vec<u32> {
        (0..self.smaller.len() as u32).map(|vertex| self.of(vertex)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chains_become_one_class_with_the_smallest_name() {
        let mut classes = VertexClasses::new(6);
        classes.join(5, 3);
        classes.join(3, 4);
        classes.join(4, 1);
        assert_eq!(classes.all(), [0, 1, 2, 1, 1, 1]);
    }
}
