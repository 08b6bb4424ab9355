//! The kinds of manufacturing errors, to apply individually.

use catoptric_sim::Scene;
use catoptric_sim::scene::AsBuilt;

catoptric_model::closed_set! {
    /// A kind of error.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    pub enum Cause {
        /// Facets are turned.
        Tilt,
        /// Facets are shifted.
        Shift,
        /// Mirrors are thicker or thinner than specified.
        Thickness,
        /// Mirrors have slope errors.
        Flatness,
        /// The scanner is misaligned in its housing.
        Mount,
    }
}

impl Cause {
    /// Its name in files and for people.
    pub fn name(self) -> &'static str {
        match self {
            Self::Tilt => "tilt",
            Self::Shift => "shift",
            Self::Thickness => "thickness",
            Self::Flatness => "flatness",
            Self::Mount => "mount",
        }
    }

    /// Returns the scene with errors of this kind alone; `None` if the scene has none of them.
    pub fn alone(self, scene: &Scene) -> Option<Scene> {
        let as_built = &scene.superstructure.as_built;
        let mount = &scene.scanner.mount;
        let size = match self {
            Self::Tilt => as_built.tilt_sd_deg,
            Self::Shift => as_built.shift_sd_mm,
            Self::Thickness => as_built.thickness_sd_mm,
            Self::Flatness => as_built.slope_rms_mrad,
            Self::Mount => mount
                .yaw_tolerance_deg
                .max(mount.tilt_tolerance_deg)
                .max(mount.shift_tolerance_mm),
        };
        if size == 0.0 {
            return None;
        }
        let only = |kind: Self, value: f64| if self == kind { value } else { 0.0 };
        let mut alone = scene.clone();
        alone.superstructure.as_built = AsBuilt {
            tilt_sd_deg: only(Self::Tilt, as_built.tilt_sd_deg),
            shift_sd_mm: only(Self::Shift, as_built.shift_sd_mm),
            slope_rms_mrad: only(Self::Flatness, as_built.slope_rms_mrad),
            thickness_sd_mm: only(Self::Thickness, as_built.thickness_sd_mm),
        };
        if self != Self::Mount {
            let mount = &mut alone.scanner.mount;
            mount.yaw_tolerance_deg = 0.0;
            mount.tilt_tolerance_deg = 0.0;
            mount.shift_tolerance_mm = 0.0;
        }
        Some(alone)
    }
}
