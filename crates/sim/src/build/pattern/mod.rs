//! Expands patterns into facets: rings, mirror images, lists of copies.

use crate::scene::facet::bent;
use crate::scene::{Exchange, Facet, Pattern, Scene};
use catoptric_model::ScanGeometry;
use catoptric_model::place::{KeyPath, Problem, Segment, nearest};

/// A scene with its patterns expanded, and the origin of its facets.
#[derive(Debug, Clone, PartialEq)]
pub struct Expanded {
    /// The scene, with a facet for every copy.
    pub scene: Scene,
    /// Number of facets drawn in the scene itself.
    pub drawn: usize,
    /// The pattern that made each of the facets after those.
    pub made_by: Vec<usize>,
}

impl Expanded {
    /// The pattern that made the facet to which a path leads, and the name of the copy.
    pub fn origin(&self, path: &KeyPath) -> Option<(KeyPath, &str)> {
        let [Segment::Key(a), Segment::Key(b), Segment::Index(i), ..] = path.0.as_slice() else {
            return None;
        };
        if (a.as_str(), b.as_str()) != ("superstructure", "facet") {
            return None;
        }
        let pattern = *self.made_by.get(i.checked_sub(self.drawn)?)?;
        let name = &self.scene.superstructure.facet.get(*i)?.name;
        Some((pattern_path(pattern), name))
    }
}

/// Expands the patterns into facets, in order; a pattern may copy what an earlier one made.
///
/// # Errors
/// A pattern of a facet that does not exist; a list of names whose length differs from the number of copies.
pub fn expand(scene: &Scene) -> Result<Expanded, Vec<Problem>> {
    let mut scene = scene.clone();
    let patterns = std::mem::take(&mut scene.superstructure.pattern);
    let drawn = scene.superstructure.facet.len();
    // Of a scanner that cannot be, whoever checks the scene says so.
    let scan = scene.scanner.scan().unwrap_or_default();
    let (mut made_by, mut problems) = (Vec::new(), Vec::new());
    for (number, pattern) in patterns.iter().enumerate() {
        match copies(&scene.superstructure.facet, pattern, &scan, &pattern_path(number)) {
            Ok(copies) => {
                made_by.extend(std::iter::repeat_n(number, copies.len()));
                scene.superstructure.facet.extend(copies);
            }
            Err(problem) => problems.push(problem),
        }
    }
    if problems.is_empty() {
        Ok(Expanded {
            scene,
            drawn,
            made_by,
        })
    } else {
        Err(problems)
    }
}

fn pattern_path(number: usize) -> KeyPath {
    KeyPath::of("superstructure").key("pattern").index(number)
}

fn copies(
    facets: &[Facet],
    pattern: &Pattern,
    scan: &ScanGeometry,
    path: &KeyPath,
) -> Result<Vec<Facet>, Problem> {
    match pattern {
        Pattern::Ring(ring) => {
            let original = find(facets, &ring.of, &path.key("ring").key("of"))?;
            let step = ring.step_deg.unwrap_or(360.0 / f64::from(ring.count));
            let copy = |k: u32| {
                let name = format!("{}-{}", original.name, k + 1);
                turned(original, name, f64::from(k) * step, scan)
            };
            Ok((1..ring.count).map(copy).collect())
        }
        Pattern::MirrorImage(image) => {
            let path = path.key("mirror_image");
            let count = image.of.len();
            if let Some(names) = image.names.as_ref().filter(|n| n.len() != count) {
                let key = path.key("names");
                return Err(Problem {
                    message: format!("`{key}` lists {} names for {count} images", names.len()),
                    path: key,
                    help: Some("name every image, or omit `names`".to_owned()),
                });
            }
            let one = |(i, of): (usize, &String)| {
                let original = find(facets, of, &path.key("of").index(i))?;
                let given = image.names.as_ref().and_then(|n| n.get(i)).cloned();
                let name = given.unwrap_or_else(|| format!("{of}-image"));
                Ok(mirrored(original, name, &image.across, scan))
            };
            image.of.iter().enumerate().map(one).collect()
        }
        Pattern::List(list) => {
            let original = find(facets, &list.of, &path.key("list").key("of"))?;
            let one = |c: &crate::scene::FacetCopy| {
                let image = mirrored(original, c.name.clone(), &c.across, scan);
                turned(&image, c.name.clone(), c.turn_deg, scan)
            };
            Ok(list.copy.iter().map(one).collect())
        }
    }
}

fn find<'a>(facets: &'a [Facet], name: &str, path: &KeyPath) -> Result<&'a Facet, Problem> {
    facets.iter().find(|f| f.name == name).ok_or_else(|| {
        let help = match nearest(name, facets.iter().map(|f| f.name.as_str())) {
            Some(near) => format!("did you mean {near:?}?"),
            None => "a pattern copies facets of the scene or of an earlier pattern".to_owned(),
        };
        Problem {
            path: path.clone(),
            message: format!("`{path}` is {name:?}, but no facet before this pattern has that name"),
            help: Some(help),
        }
    })
}

/// A facet seen in a mirror, or in two one after the other.
pub fn mirrored(facet: &Facet, name: String, across: &[Exchange], scan: &ScanGeometry) -> Facet {
    let mut image = Facet {
        name,
        ..facet.clone()
    };
    for exchange in across {
        let was = image.clone();
        image.shape.exchange(*exchange, scan);
        image.carry_curve(&was, scan, &bent::image(*exchange));
    }
    image
}

/// A facet turned about the scanner's axis, counter-clockwise, by an angle in degrees.
pub fn turned(facet: &Facet, name: String, turn_deg: f64, scan: &ScanGeometry) -> Facet {
    let mut copy = Facet {
        name,
        ..facet.clone()
    };
    copy.shape.turn(turn_deg, scan);
    copy.carry_curve(facet, scan, &bent::turn(turn_deg));
    copy
}

#[cfg(test)]
mod tests;
