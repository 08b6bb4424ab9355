//! An index over triangles for lanes: eight boxes a node, up to eight triangles a leaf, each number in a row of its own.
//!
//! Everything is in f32 and errs outwards: a box holds its triangles whatever was rounded. What is found here is a
//! candidate that f64 decides about.

use fearless_simd::f32x8;
use fearless_simd::{Simd, prelude::*};

/// Children of a node and triangles of a leaf.
pub(crate) const WIDTH: usize = 8;

/// Levels of nodes at most that the builder makes: below its `SORTED` parts are halved by number.
pub(crate) const DEEPEST: usize = 20;

/// Most entries that a walk through the index holds: seven siblings on each of the levels that the builder allows.
const STACK: usize = (WIDTH - 1) * DEEPEST + 1;

/// Eight boxes and what is in them.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub(crate) struct Node {
    /// By axis: the low sides and the high sides. A child that is none has them exchanged, far apart.
    pub(crate) bounds: [[[f32; WIDTH]; 2]; 3],
    pub(crate) children: [Child; WIDTH],
}

/// A node or a leaf by its number; a leaf also has its number of triangles.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Child(u32);

/// Up to eight triangles.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub(crate) struct Leaf {
    /// By corner and axis.
    pub(crate) corners: [[[f32; WIDTH]; 3]; 3],
    /// Their numbers in the mesh.
    pub(crate) triangles: [u32; WIDTH],
}

/// The index.
pub(crate) struct Wide {
    pub(crate) nodes: Vec<Node>,
    pub(crate) leaves: Vec<Leaf>,
    /// Greatest coordinate of a vertex, whatever its sign: the measure of all rounding.
    pub(crate) reach: f32,
}

/// Bits of a child's number.
const NUMBER_BITS: u32 = 28;

impl Child {
    /// No child: behind a box that nothing meets.
    pub(crate) const NONE: Self = Self(0);

    pub(crate) fn node(number: usize) -> Self {
        Self(narrow(number))
    }

    pub(crate) fn leaf(number: usize, count: usize) -> Self {
        debug_assert!((1..=WIDTH).contains(&count));
        Self(1 << 31 | narrow(count - 1) << NUMBER_BITS | narrow(number))
    }

    pub(crate) fn is_leaf(self) -> bool {
        self.0 >> 31 == 1
    }

    pub(crate) fn number(self) -> usize {
        (self.0 & ((1 << NUMBER_BITS) - 1)) as usize
    }

    /// Triangles of a leaf.
    pub(crate) fn count(self) -> usize {
        (self.0 >> NUMBER_BITS & 7) as usize + 1
    }
}

/// A number of triangles is less than 2²⁸: their vertices alone would fill a gigabyte.
fn narrow(number: usize) -> u32 {
    let number = u32::try_from(number).unwrap_or(u32::MAX);
    assert!(number < 1 << NUMBER_BITS, "more than 268 million triangles");
    number
}

impl Node {
    /// Without children.
    pub(crate) fn empty() -> Self {
        // Finite, so that a product with zero is none that is not a number.
        const FAR: f32 = 1e30;
        Self {
            bounds: [[[FAR; WIDTH], [-FAR; WIDTH]]; 3],
            children: [Child::NONE; WIDTH],
        }
    }
}

/// What is still to be looked into, the nearest on top.
pub(crate) struct Walk {
    stack: [Entry; STACK],
    height: usize,
}

/// A node or a leaf, and a way that is shorter than that to it.
type Entry = (f32, Child);

impl Walk {
    #[inline(always)]
    pub(crate) fn new() -> Self {
        Self {
            stack: [(f32::INFINITY, Child::NONE); STACK],
            height: 0,
        }
    }

    /// The root; nothing else is left.
    #[inline(always)]
    pub(crate) fn start(&mut self) -> Child {
        self.height = 0;
        Child::node(0)
    }

    /// The nearest thing before `limit` that is left.
    #[inline(always)]
    pub(crate) fn next(&mut self, limit: f32) -> Option<Child> {
        loop {
            self.height = self.height.checked_sub(1)?;
            let (near, child) = self.stack[self.height];
            if near <= limit {
                return Some(child);
            }
        }
    }

    /// The nearest of the children that are met; the others are left for later.
    #[inline(always)]
    pub(crate) fn enter<S: Simd>(&mut self, node: &Node, mut met: u32, near: f32x8<S>) -> Option<Child> {
        const LANE: usize = WIDTH - 1;
        if met == 0 {
            return None;
        }
        // Most nodes have one.
        if met & (met - 1) == 0 {
            return Some(node.children[met.trailing_zeros() as usize & LANE]);
        }
        let mut nears = [0.0; WIDTH];
        near.store_slice(&mut nears);
        let mut take = || {
            let lane = met.trailing_zeros() as usize & LANE;
            met &= met - 1;
            ((nears[lane], node.children[lane]), met == 0)
        };
        let (mut nearest, _) = take();
        let bottom = self.height;
        loop {
            let (mut entry, last) = take();
            if entry.0 < nearest.0 {
                std::mem::swap(&mut entry, &mut nearest);
            }
            let mut place = self.height;
            while place > bottom && self.stack[place - 1].0 < entry.0 {
                self.stack[place] = self.stack[place - 1];
                place -= 1;
            }
            self.stack[place] = entry;
            self.height += 1;
            if last {
                return Some(nearest.1);
            }
        }
    }
}
