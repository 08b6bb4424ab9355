//! An eight-wide BVH for SIMD: eight child boxes per node, up to eight triangles per leaf, as structures of arrays.
//!
//! Everything is in f32 and rounded outward: a box contains its triangles in spite of rounding. A hit found here is a
//! candidate, decided in f64.

/// Children per node and triangles per leaf.
pub(crate) const WIDTH: usize = 8;

/// Maximum depth that the builder reaches: below its `SORTED` levels, parts are halved by count.
pub(crate) const DEEPEST: usize = 20;

/// Eight child boxes and the children.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub(crate) struct Node {
    /// By axis: the low sides and the high sides. An empty slot has them inverted and far apart, so it is never hit.
    pub(crate) bounds: [[[f32; WIDTH]; 2]; 3],
    pub(crate) children: [Child; WIDTH],
    /// Bits of the slots that have a child: coordinates near the end of f32 make empty ones seem hit.
    pub(crate) used: u32,
}

/// Index of a node or of a leaf; for a leaf, also its number of triangles.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Child(u32);

/// Up to eight triangles.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub(crate) struct Leaf {
    /// By corner and axis.
    pub(crate) corners: [[[f32; WIDTH]; 3]; 3],
    /// Their indices in the mesh.
    pub(crate) triangles: [u32; WIDTH],
}

/// The hierarchy.
pub(crate) struct WideBvh {
    pub(crate) nodes: Vec<Node>,
    pub(crate) leaves: Vec<Leaf>,
    /// Largest absolute coordinate of a vertex: all rounding errors scale with it.
    pub(crate) reach: f32,
}

/// Bits of a child's index.
const NUMBER_BITS: u32 = 28;

impl Child {
    /// An empty slot: its box is never hit.
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

    /// Returns the number of triangles of a leaf.
    pub(crate) fn count(self) -> usize {
        (self.0 >> NUMBER_BITS & 7) as usize + 1
    }
}

/// Triangle counts are below 2²⁸: their vertices alone would fill a gigabyte.
fn narrow(number: usize) -> u32 {
    let number = u32::try_from(number).unwrap_or(u32::MAX);
    assert!(number < 1 << NUMBER_BITS, "more than 268 million triangles");
    number
}

impl Node {
    /// A node without children.
    pub(crate) fn empty() -> Self {
        // Finite, so that a product with zero is not NaN.
        const FAR: f32 = 1e30;
        Self {
            bounds: [[[FAR; WIDTH], [-FAR; WIDTH]]; 3],
            children: [Child::NONE; WIDTH],
            used: 0,
        }
    }
}
