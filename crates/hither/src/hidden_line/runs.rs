//! Which things hang together: disjoint sets of numbers, each known by its first member.

/// Numbers `0..count`, some of which have been joined.
pub(super) struct Runs {
    /// Nearer to the first of the run, or that.
    parent: Vec<u32>,
}

impl Runs {
    /// Each number by itself.
    pub fn new(count: usize) -> Runs {
        Runs { parent: (0..count as u32).collect() }
    }

    /// The first of those that hang together with this one.
    pub fn first(&mut self, mut of: u32) -> u32 {
        while self.parent[of as usize] != of {
            self.parent[of as usize] = self.parent[self.parent[of as usize] as usize];
            of = self.parent[of as usize];
        }
        of
    }

    /// Lets two hang together.
    pub fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.first(a), self.first(b));
        self.parent[a.max(b) as usize] = a.min(b);
    }

    /// The first of the run of every number.
    pub fn firsts(mut self) -> Vec<u32> {
        for t in 0..self.parent.len() as u32 {
            self.parent[t as usize] = self.first(t);
        }
        self.parent
    }
}
