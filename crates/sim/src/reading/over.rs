//! Neighboring beams over a structure whose part in their ways is known: what leaves it is cast into the room together,
//! and sub-rays that go one way to one surface are added in a row.

use super::part::{Parts, Place};
use super::{Return, Sensor, is_chief};
use crate::cast::Hit;
use crate::detect::Pulse;
use crate::footprint;
use crate::optics::{Rig, Run, Setting, Then, Ways};
use crate::power::{self, Target};
use catoptric_model::beam;
use std::ops::Range;

/// What the legs of a beam that leave the structure meet in the room, and the cosines of the incidence there.
struct InRoom<'a> {
    hits: &'a [Option<Hit>],
    cosines: &'a [f64],
}

/// Sub-rays that leave the structure alike, and what is around it.
#[derive(Clone, Copy)]
struct Group<'a> {
    setting: &'a Setting<'a>,
    ways: Ways<'a>,
    run: &'a Run,
}

impl Sensor {
    /// The structure's part in the ways of all sub-rays, for [`Sensor::observe_over`]; `bare` holds nothing else.
    pub fn compile(&self, bare: &Setting<'_>) -> Rig {
        Rig::compile(bare, beam::COUNT, |beam| self.rays(beam))
    }

    /// What neighboring beams from `first` on bring home: the same to the last bit, with the structure's part already
    /// followed and the room's for all of them together.
    ///
    /// Every beam has a setting of its own: the same one, or what is seen of it from elsewhere; `rig` must
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
            setting.leave(rig.ways(beam).leaving, &mut beyond);
        }
        if let Some(any) = settings.first() {
            any.cast_into_room(&mut beyond);
        }
        let mut from = 0;
        for ((setting, beam), place) in settings.iter().zip(first..).zip(returns) {
            let ways = rig.ways(beam);
            let hits = &beyond.hits[from..from + ways.leaving.len()];
            from += ways.leaving.len();
            beyond.cosines.clear();
            setting.incidences(ways.leaving, hits, &mut beyond.cosines);
            let cosines = &beyond.cosines;
            self.illuminate_over(ways, setting, beam, &InRoom { hits, cosines }, parts);
            *place = self.receive(setting, parts.as_slice());
        }
        parts.beyond = beyond;
    }

    /// [`Sensor::illuminate`] from where the sub-rays depart from the structure.
    fn illuminate_over(
        &self,
        ways: Ways<'_>,
        setting: &Setting<'_>,
        beam: usize,
        room: &InRoom<'_>,
        parts: &mut Parts,
    ) {
        parts.begin();
        let mut left = 0;
        for run in ways.runs {
            let group = Group { setting, ways, run };
            let all = run.sub_rays.clone();
            match run.then {
                Then::Leaves => {
                    let legs = left..left + all.len();
                    left = legs.end;
                    self.illuminate_room(&group, beam, &room.only(legs), parts);
                }
                Then::EndsOn(surface, cos_incidence) => {
                    let end = |length| (length, cos_incidence);
                    let ends = ways.lengths[all.clone()].iter().copied().map(end);
                    self.add_light(&group, all.clone(), surface, ends, parts);
                    self.add_on_mirrors(&group, all, parts);
                }
                Then::Trapped => self.add_on_mirrors(&group, all, parts),
            }
        }
        if self.lacks_chief() {
            Self::add_chief(parts, &self.chief_path(setting, beam));
        }
        parts.end();
    }

    /// Adds the light of sub-rays that leave alike, with what they meet in the room.
    fn illuminate_room(&self, group: &Group<'_>, beam: usize, room: &InRoom<'_>, parts: &mut Parts) {
        let Group { setting, ways, run } = *group;
        let mut done = 0;
        while let Some(first) = room.hits.get(done) {
            let hit = first.map(|hit| setting.hit_in_room(&hit));
            let mirror = hit.filter(|hit| setting.is_mirror(hit.surface));
            // Mirrors are looked at ray by ray.
            let count = mirror.map_or_else(|| room.alike(done), |_| 1);
            let legs = done..done + count;
            let from = run.sub_rays.start;
            let sub_rays = from + legs.start..from + legs.end;
            done = legs.end;
            if mirror.is_some_and(|hit| setting.reflecting(&hit).is_some()) {
                // Its light may come back to the structure.
                let sub_ray = &self.sub_rays[sub_rays.start];
                let ray = footprint::ray(&self.shape, beam::azimuth(beam), sub_ray);
                self.illuminate_along(setting, sub_ray, &ray, &setting.trace(&ray), parts);
                continue;
            }
            if let Some(hit) = hit {
                let ends = room.ends(&ways.lengths[sub_rays.clone()], legs);
                self.add_light(group, sub_rays.clone(), hit.surface, ends, parts);
            }
            self.add_on_mirrors(group, sub_rays, parts);
        }
    }

    /// Adds sub-rays of a run that end on one surface, each at a range and under an incidence of a cosine.
    fn add_light(
        &self,
        group: &Group<'_>,
        which: Range<usize>,
        surface: usize,
        ends: impl Iterator<Item = (f64, f64)>,
        parts: &mut Parts,
    ) {
        let Group { setting, ways, run } = *group;
        let reflectivity = setting.paint(surface).reflectivity;
        let target = Target::new(&self.light, reflectivity, self.mirrors[run.silvered] * run.gain);
        let facets = ways.facets(run);
        let part = parts.of(surface, facets);
        let known = part.pulses.len();
        let mut chief = None;
        let sub_rays = which.clone().zip(&self.sub_rays[which.clone()]);
        part.add(
            sub_rays
                .zip(ends)
                .map(|((number, sub_ray), (range, cos_incidence))| {
                    let power = target.received(sub_ray.weight, range, cos_incidence);
                    if is_chief(sub_ray) {
                        chief = Some((number, range, cos_incidence));
                    }
                    (Pulse { range, power }, sub_ray.weight * run.gain, cos_incidence)
                }),
        );
        let cosines = |number| ways.meetings(run, number).iter().map(|m| m.cos_incidence);
        if !facets.is_empty() {
            part.add_cosines(known, which.map(cosines));
        }
        if let Some((number, range, cos_incidence)) = chief {
            part.chief = Some(Place::new(range, cos_incidence, cosines(number)));
        }
    }

    /// Adds what the mirrors on the ways of sub-rays of a run scatter themselves.
    fn add_on_mirrors(&self, group: &Group<'_>, which: Range<usize>, parts: &mut Parts) {
        let Group { setting, ways, run } = *group;
        if setting.diffuse_reflectivity() <= 0.0 {
            return;
        }
        let facets = ways.facets(run);
        for number in which {
            let (sub_ray, meetings) = (&self.sub_rays[number], ways.meetings(run, number));
            for arrival in self.on_mirrors(setting, sub_ray, meetings.iter().copied()) {
                let on = &arrival.on;
                let cosines = meetings[..arrival.bounces].iter().map(|m| m.cos_incidence);
                let (power, share) = (power::received(&self.light, on), on.share * arrival.gain);
                let way = (arrival.surface, &facets[..arrival.bounces]);
                let place = (on.range, on.cos_incidence);
                parts.add(way, power, share, place, cosines, is_chief(sub_ray));
            }
        }
    }
}

impl<'a> InRoom<'a> {
    /// Some of the legs.
    fn only(&self, legs: Range<usize>) -> InRoom<'a> {
        Self {
            hits: &self.hits[legs.clone()],
            cosines: &self.cosines[legs],
        }
    }

    /// How many legs in a row, from one on, meet the same surface, or nothing.
    fn alike(&self, first: usize) -> usize {
        let surface = |hit: &Option<Hit>| hit.as_ref().map(|hit| hit.surface);
        let met = surface(&self.hits[first]);
        self.hits[first..]
            .iter()
            .take_while(|hit| surface(hit) == met)
            .count()
    }

    /// Ranges and incidences where these legs end, after ways of these lengths.
    fn ends(&self, lengths: &[f64], legs: Range<usize>) -> impl Iterator<Item = (f64, f64)> {
        let distance = |hit: &Option<Hit>| hit.as_ref().map_or(f64::INFINITY, |hit| hit.distance);
        let ends = self.hits[legs.clone()].iter().map(distance);
        let ends = ends.zip(&self.cosines[legs]).zip(lengths);
        ends.map(|((distance, cosine), length)| (length + distance, *cosine))
    }
}
