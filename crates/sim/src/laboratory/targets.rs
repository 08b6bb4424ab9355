//! Targets around the sensor: the room's walls, and a stretch's board.

use super::setup::Laboratory;
use crate::build::board::outline;
use crate::build::color::{self, Paint};
use crate::build::room;
use crate::error::SimError;
use crate::light::optics::{Role, Target};
use crate::scene::Scene;
use catoptric_cast::{Polygon, Shape};
use catoptric_model::Pose;
use nalgebra::{Point3, Vector3};

impl Laboratory {
    /// Walls, and the stretch's board at a given pose, in the sensor frame.
    pub(super) fn targets(
        &self,
        number: usize,
        room_from_board: Option<&Pose>,
    ) -> Result<Vec<Target>, SimError> {
        let sensor_from_room = self.room_from_sensor().inverse();
        let wall_paint = color::paint(&self.scene, &self.scene.room.color)?;
        let mut targets = wall_targets(&self.scene, &sensor_from_room, &wall_paint);
        if let (Some(board), Some(room_from_board)) = (self.board_of(number), room_from_board) {
            // The pose is that of the markers' plane; light hits the face.
            let front = Vector3::z() * (1e-3 * board.thickness_mm);
            let corners = outline(board)
                .corners()
                .map(|c| room_from_board * (c + front))
                .to_vec();
            if let Some(polygon) = placed(&sensor_from_room, corners) {
                targets.push(Target {
                    name: board.name.clone(),
                    shape: Shape::Polygon(polygon),
                    role: Role::Board,
                    paint: color::paint(&self.scene, &board.color)?,
                });
            }
        }
        Ok(targets)
    }
}

/// Walls, floor and ceiling, transformed into another frame.
pub(crate) fn wall_targets(scene: &Scene, frame_from_room: &Pose, paint: &Paint) -> Vec<Target> {
    room::walls(scene)
        .into_iter()
        .filter_map(|(name, corners)| {
            Some(Target {
                name: name.to_owned(),
                shape: Shape::Polygon(placed(frame_from_room, corners)?),
                role: Role::Wall,
                paint: paint.clone(),
            })
        })
        .collect()
}

/// A polygon whose corners are transformed into another frame.
fn placed(frame_from_room: &Pose, corners: Vec<Point3<f64>>) -> Option<Polygon> {
    Polygon::new(corners.iter().map(|c| frame_from_room * c).collect())
}
