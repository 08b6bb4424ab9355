//! Observes neighboring beams with the compiled paths via the structure: what leaves it is cast into the room together,
//! and consecutive sub-rays that take one path to one surface are added together.

use super::part::{Parts, Place};
use super::returned::Return;
use super::sensor::{BeamIn, Sensor, is_chief, lacks_chief};
use crate::light::footprint::{self, SubRay};
use crate::light::optics::{BeamPaths, Rig, Run, Setting, Then};
use crate::light::power::{self, Target};
use crate::receive::detect::Pulse;
use catoptric_cast::Hit;
use std::ops::Range;

/// Sub-rays that leave the structure identically, and what is around it.
#[derive(Clone, Copy)]
struct RunContext<'a> {
    within: BeamIn<'a>,
    sub_rays: &'a [SubRay],
    paths: &'a BeamPaths<'a>,
    run: &'a Run,
}

impl Sensor {
    /// Compiles the paths of all sub-rays via the structure, for [`Sensor::observe_over`]; `bare` contains nothing
    /// else, but [its edges](Sensor::edge_rays) if the scene treats them.
    pub fn compile(&self, bare: &Setting<'_>) -> Rig {
        Rig::compile(
            bare,
            self.scan.beams(),
            |beam| self.rays(beam, self.sub_rays_in(bare, beam)),
            |beam| self.long_axis(beam),
        )
    }

    /// What neighboring beams from `first` on receive: bit for bit the same as [`Sensor::observe`], but with the
    /// structure's part of the paths already compiled and the room's cast for all of them together.
    ///
    /// Every beam has a setting of its own: the same one, or what is seen of it from another pose; `rig` must
    /// [hold](Rig::holds_in) in them.
    pub fn observe_over(
        &self,
        rig: &Rig,
        settings: &[Setting<'_>],
        first: usize,
        parts: &mut Parts,
        returns: &mut [Option<Return>],
    ) {
        let mut beyond = std::mem::take(&mut parts.beyond);
        beyond.clear();
        for (setting, beam) in settings.iter().zip(first..) {
            setting.leave(rig.leaving(), rig.paths(beam).leaving, &mut beyond);
        }
        if let Some(any) = settings.first() {
            any.cast_into_room(&mut beyond);
        }
        let mut in_room = beyond.hits.as_slice();
        for ((setting, beam), place) in settings.iter().zip(first..).zip(returns) {
            let paths = rig.paths(beam);
            let (own, others) = in_room.split_at(paths.leaving.len());
            in_room = others;
            self.illuminate_over(&paths, setting, beam, own, parts);
            *place = self.receive(setting, parts.as_slice());
        }
        parts.beyond = beyond;
    }

    /// [`Sensor::illuminate`] from where the sub-rays leave the structure.
    fn illuminate_over(
        &self,
        paths: &BeamPaths<'_>,
        setting: &Setting<'_>,
        beam: usize,
        in_room: &[Option<Hit>],
        parts: &mut Parts,
    ) {
        parts.begin();
        let within = self.beam_in(setting, beam);
        let sub_rays = self.sub_rays_in(setting, beam);
        let mut left = 0;
        for run in paths.runs {
            let context = RunContext {
                within,
                sub_rays,
                paths,
                run,
            };
            let all = run.sub_rays.clone();
            match run.then {
                Then::Leaves => {
                    let legs = left..left + all.len();
                    left = legs.end;
                    self.illuminate_room(&context, beam, &in_room[legs], parts);
                }
                Then::EndsOn(surface, cos_incidence) => {
                    let end = |length| (length, cos_incidence);
                    let ends = paths.lengths[all.clone()].iter().copied().map(end);
                    self.add_light(&context, all.clone(), surface, ends, parts);
                    self.add_on_mirrors(&context, beam, all, parts);
                }
                Then::Trapped => self.add_on_mirrors(&context, beam, all, parts),
            }
        }
        if lacks_chief(sub_rays) {
            Self::add_chief(parts, &self.chief_path(setting, beam));
        }
        self.vignette(setting, beam, parts);
        parts.end();
    }

    /// Adds the light of sub-rays that leave identically, with what they hit in the room.
    fn illuminate_room(
        &self,
        context: &RunContext<'_>,
        beam: usize,
        in_room: &[Option<Hit>],
        parts: &mut Parts,
    ) {
        let RunContext {
            within,
            sub_rays: all,
            paths,
            run,
        } = *context;
        let mut done = 0;
        while let Some(first) = in_room.get(done) {
            let surface = first.map(|hit| within.setting.surface_in_room(&hit));
            let mirror = surface.filter(|surface| within.setting.is_mirror(*surface));
            // Mirrors are handled ray by ray.
            let count = if mirror.is_some() {
                1
            } else {
                same_surface(&in_room[done..])
            };
            let hits = &in_room[done..done + count];
            let from = run.sub_rays.start + done;
            let sub_rays = from..from + count;
            done += count;
            let front = first.is_some_and(|hit| hit.front());
            if mirror.is_some_and(|mirror| within.setting.reflecting(mirror, front).is_some()) {
                // Its light may return to the structure.
                let sub_ray = &all[sub_rays.start];
                let ray = footprint::ray(&self.shape, self.scan.azimuth(beam), sub_ray);
                self.illuminate_along(&within, sub_ray, &ray, &within.setting.trace(&ray), parts);
                continue;
            }
            if let Some(surface) = surface {
                let ends = hits.iter().zip(&paths.lengths[sub_rays.clone()]);
                // All of these hits exist.
                let ends = ends.map(|(hit, length)| {
                    let end = |hit: &Hit| (length + hit.distance, hit.cos_incidence());
                    hit.as_ref().map_or((f64::INFINITY, 0.0), end)
                });
                self.add_light(context, sub_rays.clone(), surface, ends, parts);
            }
            self.add_on_mirrors(context, beam, sub_rays, parts);
        }
    }

    /// Adds sub-rays of a run that end on one surface, each with its range and the cosine of its incidence.
    fn add_light(
        &self,
        context: &RunContext<'_>,
        which: Range<usize>,
        surface: usize,
        ends: impl Iterator<Item = (f64, f64)>,
        parts: &mut Parts,
    ) {
        let RunContext {
            within,
            sub_rays: all,
            paths,
            run,
        } = *context;
        let reflectivity = within.setting.paint(surface).reflectivity;
        let reflecting = |passed: f64| Target::new(&self.light, reflectivity, passed * run.gain);
        let target = reflecting(self.mirrors[run.silvered]);
        let facets = paths.facets(run);
        let part = parts.of(surface, facets);
        let known = part.pulses.len();
        let mut chief = None;
        let sub_rays = which.clone().zip(&all[which.clone()]);
        part.add(
            sub_rays
                .zip(ends)
                .map(|((number, sub_ray), (range, cos_incidence))| {
                    let coated = paths.passed.get(number).map(|passed| reflecting(*passed));
                    let power =
                        coated
                            .as_ref()
                            .unwrap_or(&target)
                            .received(sub_ray.weight, range, cos_incidence)
                            * within.overlap(sub_ray, range);
                    let power = match paths.spreads.get(number) {
                        Some(Some(spread)) => power * spread.gain(range, self.lens.area()),
                        _ => power,
                    };
                    if is_chief(sub_ray) {
                        chief = Some((number, range, cos_incidence));
                    }
                    (Pulse { range, power }, sub_ray.weight * run.gain, cos_incidence)
                }),
        );
        let cosines = |number| paths.meetings(run, number).iter().map(|m| m.cos_incidence);
        if !facets.is_empty() {
            part.add_cosines(known, which.map(cosines));
        }
        if let Some((number, range, cos_incidence)) = chief {
            part.chief = Some(Place::new(range, cos_incidence, cosines(number)));
        }
    }

    /// Adds the light that the mirrors on the paths of a run's sub-rays scatter themselves.
    fn add_on_mirrors(&self, context: &RunContext<'_>, beam: usize, which: Range<usize>, parts: &mut Parts) {
        let RunContext {
            within,
            sub_rays: all,
            paths,
            run,
        } = *context;
        if within.setting.diffuse_reflectivity() <= 0.0 {
            return;
        }
        let facets = paths.facets(run);
        for number in which {
            let (sub_ray, meetings) = (&all[number], paths.meetings(run, number));
            let ray = footprint::ray(&self.shape, self.scan.azimuth(beam), sub_ray);
            for arrival in self.on_mirrors(&within, (sub_ray, &ray), meetings.iter().copied()) {
                let on = &arrival.on;
                let cosines = meetings[..arrival.bounces].iter().map(|m| m.cos_incidence);
                let (power, share) = (power::received(&self.light, on), on.share * arrival.gain);
                let path = (arrival.surface, &facets[..arrival.bounces]);
                let place = (on.range, on.cos_incidence);
                parts.add(path, power, share, place, cosines, is_chief(sub_ray));
            }
        }
    }
}

/// Number of consecutive legs, from the first on, that hit the same surface, or nothing.
fn same_surface(in_room: &[Option<Hit>]) -> usize {
    let surface = |hit: &Option<Hit>| hit.as_ref().map(|hit| hit.surface);
    let met = in_room.first().and_then(surface);
    in_room.iter().take_while(|hit| surface(hit) == met).count()
}
