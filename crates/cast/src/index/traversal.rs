//! The one traversal of the index: by a packet or a single ray, over the surfaces of a world or the triangles of a mesh.

use crate::index::wide::{Child, DEEPEST, Node, WIDTH};
use fearless_simd::{Simd, f32x8, prelude::*};

/// Maximum number of entries on the stack: seven siblings on each level.
const STACK: usize = (WIDTH - 1) * DEEPEST + 1;

/// The stack of a traversal: nodes and leaves that are still to be visited, the nearest on top. It can be used again.
pub(crate) struct Traversal {
    stack: [Entry; STACK],
    height: usize,
}

/// A node or a leaf, with a lower bound on the distance to it.
type Entry = (f32, Child);

impl Traversal {
    #[inline(always)]
    pub(crate) fn new() -> Self {
        Self {
            stack: [(f32::INFINITY, Child::NONE); STACK],
            height: 0,
        }
    }

    /// Visits the leaves whose boxes are hit within `limit`, roughly from near to far. `boxes` returns which children of a
    /// node are hit within a limit, and lower bounds on the distances to them; `visit` takes a leaf and returns the limit
    /// from there on.
    #[inline(always)]
    pub(crate) fn run<S: Simd>(
        &mut self,
        nodes: &[Node],
        mut limit: f32,
        boxes: impl Fn(&Node, f32) -> (u32, f32x8<S>),
        mut visit: impl FnMut(Child) -> f32,
    ) {
        self.height = 0;
        let mut next = Some(Child::node(0));
        while let Some(child) = next {
            let mut nearer = None;
            if child.is_leaf() {
                limit = visit(child);
            } else {
                let node = &nodes[child.number()];
                let (hit, near) = boxes(node, limit);
                nearer = self.enter(node, hit, near);
            }
            next = nearer.or_else(|| self.pop(limit));
        }
    }

    /// Pops the nearest entry that is within `limit`.
    #[inline(always)]
    fn pop(&mut self, limit: f32) -> Option<Child> {
        loop {
            self.height = self.height.checked_sub(1)?;
            let (near, child) = self.stack[self.height];
            if near <= limit {
                return Some(child);
            }
        }
    }

    /// Returns the nearest of the children hit, and pushes the others.
    #[inline(always)]
    fn enter<S: Simd>(&mut self, node: &Node, mut hit: u32, near: f32x8<S>) -> Option<Child> {
        const LANE: usize = WIDTH - 1;
        hit &= node.used;
        if hit == 0 {
            return None;
        }
        // The usual case: a single child is hit.
        if hit & (hit - 1) == 0 {
            return Some(node.children[hit.trailing_zeros() as usize & LANE]);
        }
        let mut nears = [0.0; WIDTH];
        near.store_slice(&mut nears);
        let mut take = || {
            let lane = hit.trailing_zeros() as usize & LANE;
            hit &= hit - 1;
            ((nears[lane], node.children[lane]), hit == 0)
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
