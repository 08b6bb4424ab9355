//! Top-down construction of the index by the binned surface area heuristic (SAH).
//!
//! The probability that a ray hits a box is proportional to the box's surface area, so the cost of a split is the sum of
//! area × leaves over its two sides (Wald, "On fast Construction of SAH-based Bounding Volume Hierarchies", 2007). A node
//! splits its largest part until it has eight. The result is the same on any number of threads.

use crate::index::wide::{Child, Leaf, Node, WIDTH, WideBvh};
use crate::rounding::{ROUNDING, downwards, rounded, upwards};
use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

/// Levels built by SAH. Below them, parts are halved by count regardless of cost, which bounds the depth: 2²⁸ triangles
/// are 2²⁵ leaves, nine more levels.
const SORTED: usize = 10;

const BINS: usize = 16;

/// Minimum number of triangles worth a separate task.
const PARALLEL: usize = 4096;

/// A bounding box in f32.
#[derive(Debug, Clone, Copy)]
struct Bounds {
    low: [f32; 4],
    high: [f32; 4],
}

/// A triangle or box to be sorted into the index.
#[derive(Debug, Clone, Copy)]
struct Item {
    low: [f32; 3],
    number: u32,
    high: [f32; 3],
}

/// A range of the sorted items, with their bounding box.
#[derive(Debug, Clone, Copy)]
struct Part {
    first: usize,
    count: usize,
    bounds: Bounds,
}

/// For each axis, the items binned by their centers.
#[derive(Clone, Copy)]
struct Bins {
    bounds: [[Bounds; BINS]; 3],
    counts: [[u32; BINS]; 3],
}

/// Mapping from centers to bins.
struct Scale {
    low: [f32; 3],
    factor: [f32; 3],
}

impl Bounds {
    const NOTHING: Self = Self {
        low: [f32::INFINITY; 4],
        high: [f32::NEG_INFINITY; 4],
    };

    fn add(&mut self, other: &Self) {
        for k in 0..4 {
            self.low[k] = self.low[k].min(other.low[k]);
            self.high[k] = self.high[k].max(other.high[k]);
        }
    }

    fn with(mut self, other: &Self) -> Self {
        self.add(other);
        self
    }

    /// Returns half the surface area; 0 for an empty box.
    fn area(&self) -> f32 {
        let [x, y, z, _] = std::array::from_fn::<_, 4, _>(|k| (self.high[k] - self.low[k]).max(0.0));
        x * y + y * z + z * x
    }
}

impl Item {
    /// The item between two corners; `reach` is the largest coordinate of all.
    fn new(number: usize, low: &Vector3<f64>, high: &Vector3<f64>, reach: f32) -> Self {
        // Exceeds the error of the decision in f64.
        let slack = reach * ROUNDING;
        Self {
            low: std::array::from_fn(|k| downwards(low[k]) - slack),
            // Indices of triangles are below 2²⁸.
            #[allow(clippy::cast_possible_truncation)]
            number: number as u32,
            high: std::array::from_fn(|k| upwards(high[k]) + slack),
        }
    }

    fn bounds(&self) -> Bounds {
        let ([a, b, c], [d, e, f]) = (self.low, self.high);
        Bounds {
            low: [a, b, c, 0.0],
            high: [d, e, f, 0.0],
        }
    }

    /// Returns twice the center.
    fn middle(&self, axis: usize) -> f32 {
        self.low[axis] + self.high[axis]
    }
}

impl Scale {
    fn new(items: &[Item]) -> Self {
        let of_some = |items: &[Item]| {
            items.iter().fold(Bounds::NOTHING, |mut all, item| {
                let [x, y, z] = std::array::from_fn(|k| item.middle(k));
                let middle = [x, y, z, 0.0];
                all.add(&Bounds {
                    low: middle,
                    high: middle,
                });
                all
            })
        };
        let all = over(items, of_some, |a, b| a.with(&b));
        let (low, high) = (all.low, all.high);
        Self {
            low: std::array::from_fn(|k| low[k]),
            factor: std::array::from_fn(|k| {
                let factor = BINS as f32 * (1.0 - f32::EPSILON) / (high[k] - low[k]);
                if factor.is_finite() { factor } else { 0.0 }
            }),
        }
    }

    /// Returns the bin of an item, by truncation of a number between 0 and the number of bins.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    fn bin(&self, item: &Item, axis: usize) -> usize {
        (((item.middle(axis) - self.low[axis]) * self.factor[axis]) as usize).min(BINS - 1)
    }
}

impl Bins {
    const NOTHING: Self = Self {
        bounds: [[Bounds::NOTHING; BINS]; 3],
        counts: [[0; BINS]; 3],
    };

    fn of(items: &[Item], scale: &Scale) -> Self {
        let mut bins = Self::NOTHING;
        for item in items {
            let bounds = item.bounds();
            for axis in 0..3 {
                let bin = scale.bin(item, axis);
                bins.bounds[axis][bin].add(&bounds);
                bins.counts[axis][bin] += 1;
            }
        }
        bins
    }

    fn with(mut self, other: &Self) -> Self {
        for axis in 0..3 {
            for bin in 0..BINS {
                self.bounds[axis][bin].add(&other.bounds[axis][bin]);
                self.counts[axis][bin] += other.counts[axis][bin];
            }
        }
        self
    }

    /// Returns the split of minimum cost: the axis, the first bin of the right side, and the two boxes.
    // A bin indexes three arrays.
    #[allow(clippy::needless_range_loop)]
    fn best(&self, scale: &Scale) -> Option<(usize, usize, [Bounds; 2])> {
        let mut best = None;
        let mut least = f32::INFINITY;
        for axis in (0..3).filter(|axis| scale.factor[*axis] > 0.0) {
            let mut right = [(0.0, 0, Bounds::NOTHING); BINS];
            let (mut bounds, mut count) = (Bounds::NOTHING, 0);
            for bin in (1..BINS).rev() {
                bounds.add(&self.bounds[axis][bin]);
                count += self.counts[axis][bin];
                right[bin] = (bounds.area() * leaves(count), count, bounds);
            }
            let (mut bounds, mut count) = (Bounds::NOTHING, 0);
            for bin in 1..BINS {
                bounds.add(&self.bounds[axis][bin - 1]);
                count += self.counts[axis][bin - 1];
                let (cost, others, beyond) = right[bin];
                let cost = cost + bounds.area() * leaves(count);
                if count > 0 && others > 0 && cost < least {
                    least = cost;
                    best = Some((axis, bin, [bounds, beyond]));
                }
            }
        }
        best
    }
}

/// Returns the number of leaves that `count` triangles need.
fn leaves(count: u32) -> f32 {
    (count as usize).div_ceil(WIDTH) as f32
}

/// Reduces all items, in parallel if there are many; for the callers, the order of reduction does not matter.
fn over<T: Send>(items: &[Item], of_some: impl Fn(&[Item]) -> T + Sync, join: impl Fn(T, T) -> T) -> T {
    if items.len() <= 4 * PARALLEL {
        return of_some(items);
    }
    let (a, b) = items.split_at(items.len() / 2);
    let (a, b) = rayon::join(|| of_some(a), || of_some(b));
    join(a, b)
}

impl WideBvh {
    /// Builds the index over triangles; vertices are in meters.
    pub(crate) fn new(vertices: &[Point3<f64>], triangles: &[[u32; 3]]) -> Self {
        index(vertices, triangles)
    }
}

/// Builds the index over triangles.
fn index(vertices: &[Point3<f64>], triangles: &[[u32; 3]]) -> WideBvh {
    let reach = upwards(vertices.iter().fold(0.0, |reach, v| v.coords.amax().max(reach)));
    let item = |(number, corners): (usize, &[u32; 3])| {
        let [a, b, c] = corners.map(|v| vertices[v as usize].coords);
        Item::new(number, &a.inf(&b).inf(&c), &a.sup(&b).sup(&c), reach)
    };
    let mut items: Vec<Item> = triangles.par_iter().enumerate().map(item).collect();
    let mut nodes = sorted(&mut items, WIDTH);
    // So far, a leaf's index is that of its first item.
    let mut found = Vec::new();
    for child in nodes.iter_mut().flat_map(|node: &mut Node| &mut node.children) {
        if child.is_leaf() {
            let (first, count) = (child.number(), child.count());
            *child = Child::leaf(found.len(), count);
            found.push((first, count));
        }
    }
    // From here on, only the order of the items is needed.
    let numbers: Vec<u32> = items.iter().map(|item| item.number).collect();
    drop(items);
    let leaf = |&(first, count): &(usize, usize)| {
        let mut leaf = Leaf {
            corners: [[[0.0; WIDTH]; 3]; 3],
            triangles: [u32::MAX; WIDTH],
        };
        for (lane, &number) in numbers[first..first + count].iter().enumerate() {
            leaf.triangles[lane] = number;
            for (corner, &vertex) in leaf.corners.iter_mut().zip(&triangles[number as usize]) {
                for (row, coordinate) in corner.iter_mut().zip(vertices[vertex as usize].iter()) {
                    row[lane] = rounded(*coordinate);
                }
            }
        }
        leaf
    };
    let leaves = found.par_iter().map(leaf).collect();
    WideBvh { nodes, leaves, reach }
}

/// Builds the nodes over boxes, each given by its lowest and highest corner; a leaf's index is that of its box.
pub(crate) fn over_boxes(boxes: &[(Vector3<f64>, Vector3<f64>)], reach: f32) -> Vec<Node> {
    let item =
        |(number, (low, high)): (usize, &(Vector3<f64>, Vector3<f64>))| Item::new(number, low, high, reach);
    let mut items: Vec<Item> = boxes.iter().enumerate().map(item).collect();
    let mut nodes = sorted(&mut items, 1);
    for child in nodes.iter_mut().flat_map(|node| &mut node.children) {
        if child.is_leaf() {
            *child = Child::leaf(items[child.number()].number as usize, 1);
        }
    }
    nodes
}

/// Sorts the items and builds the nodes over them. A leaf has at most `leaf` items, and the index of its first item.
fn sorted(items: &mut [Item], leaf: usize) -> Vec<Node> {
    let bounds = over(
        items,
        |items| items.iter().fold(Bounds::NOTHING, |all, i| all.with(&i.bounds())),
        |a, b| a.with(&b),
    );
    let all = Part {
        first: 0,
        count: items.len(),
        bounds,
    };
    if items.is_empty() {
        return vec![Node::empty()];
    }
    let mut nodes = Vec::new();
    node(items, all, (0, leaf), &mut nodes);
    nodes.shrink_to_fit();
    nodes
}

/// Appends the node of a part and all nodes below it; `items` are those of the part, `leaf` is the maximum per leaf.
fn node(items: &mut [Item], part: Part, (level, leaf): (usize, usize), nodes: &mut Vec<Node>) {
    let mut parts = vec![part];
    while parts.len() < WIDTH {
        // The largest part that does not fit in a leaf.
        let splittable = parts.iter().enumerate().filter(|(_, p)| p.count > leaf);
        let greatest = splittable.max_by(|(_, a), (_, b)| {
            if level < SORTED {
                a.bounds.area().total_cmp(&b.bounds.area())
            } else {
                a.count.cmp(&b.count)
            }
        });
        let Some((greatest, &whole)) = greatest else { break };
        let start = whole.first - part.first;
        let [left, right] = split(&mut items[start..start + whole.count], whole, level);
        parts[greatest] = left;
        parts.insert(greatest + 1, right);
    }
    let own = nodes.len();
    nodes.push(Node::empty());
    let mut rest = items;
    let mut slices = Vec::with_capacity(parts.len());
    for part in &parts {
        let (slice, others) = rest.split_at_mut(part.count);
        slices.push((slice, *part));
        rest = others;
    }
    let below = |nodes: &mut Vec<Node>, slice: &mut [Item], part: Part| {
        if part.count <= leaf {
            return Child::leaf(part.first, part.count);
        }
        let number = nodes.len();
        node(slice, part, (level + 1, leaf), nodes);
        Child::node(number)
    };
    let children: Vec<Child> = if part.count > PARALLEL {
        let branches: Vec<(Child, Vec<Node>)> = slices
            .into_par_iter()
            .map(|(slice, part)| {
                let mut nodes = Vec::new();
                (below(&mut nodes, slice, part), nodes)
            })
            .collect();
        nodes.reserve_exact(branches.iter().map(|(_, branch)| branch.len()).sum());
        let append = |(child, branch): (Child, Vec<Node>)| {
            let base = nodes.len();
            let moved = |c: Child| {
                if c.is_leaf() || c == Child::NONE {
                    c
                } else {
                    Child::node(c.number() + base)
                }
            };
            nodes.extend(branch.into_iter().map(|node| Node {
                children: node.children.map(moved),
                ..node
            }));
            if child.is_leaf() { child } else { Child::node(base) }
        };
        branches.into_iter().map(append).collect()
    } else {
        slices
            .into_iter()
            .map(|(slice, part)| below(nodes, slice, part))
            .collect()
    };
    let node = &mut nodes[own];
    for (lane, (child, part)) in children.into_iter().zip(&parts).enumerate() {
        node.children[lane] = child;
        node.used |= 1 << lane;
        for axis in 0..3 {
            node.bounds[axis][0][lane] = part.bounds.low[axis];
            node.bounds[axis][1][lane] = part.bounds.high[axis];
        }
    }
}

/// Splits a part into two, sorting its items.
fn split(items: &mut [Item], part: Part, level: usize) -> [Part; 2] {
    let halves = |count: usize, [left, right]: [Bounds; 2]| {
        [
            Part {
                first: part.first,
                count,
                bounds: left,
            },
            Part {
                first: part.first + count,
                count: part.count - count,
                bounds: right,
            },
        ]
    };
    if level < SORTED {
        let scale = Scale::new(items);
        let bins = over(items, |items| Bins::of(items, &scale), |a, b| a.with(&b));
        if let Some((axis, bin, bounds)) = bins.best(&scale) {
            let count = partition(items, |item| scale.bin(item, axis) < bin);
            return halves(count, bounds);
        }
    }
    let middle = items.len() / 2;
    let around = |items: &[Item]| items.iter().fold(Bounds::NOTHING, |all, i| all.with(&i.bounds()));
    halves(middle, [around(&items[..middle]), around(&items[middle..])])
}

/// Moves the items that fit to the front and returns their number.
fn partition(items: &mut [Item], fits: impl Fn(&Item) -> bool) -> usize {
    let (mut low, mut high) = (0, items.len());
    loop {
        while low < high && fits(&items[low]) {
            low += 1;
        }
        while low < high && !fits(&items[high - 1]) {
            high -= 1;
        }
        if low >= high {
            return low;
        }
        items.swap(low, high - 1);
        low += 1;
        high -= 1;
    }
}
