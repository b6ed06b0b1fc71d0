//! Timing in interleaved rounds, so that a machine's moods meet every contestant alike.

use std::hint::black_box;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use prismarch::ray::Ray;
use prismarch::trace::Tracer;

use super::rays::Rays;

/// Seconds of every round of one contestant.
#[derive(Clone, Debug, Default)]
pub struct Times(Vec<f64>);

impl Times {
    /// Runs and times `work` once more.
    pub fn time<T>(&mut self, work: impl FnOnce() -> T) -> T {
        let start = Instant::now();
        let result = black_box(work());
        self.0.push(start.elapsed().as_secs_f64());
        result
    }

    /// The middle of all rounds, seconds; NaN without any.
    pub fn median(&self) -> f64 {
        let mut sorted = self.0.clone();
        sorted.sort_by(f64::total_cmp);
        sorted.get(sorted.len() / 2).copied().unwrap_or(f64::NAN)
    }
}

/// How rays are asked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Query {
    /// First hits.
    Intersect,
    /// Any hit.
    Occluded,
}

/// Traces all rays on `threads` threads and returns the number of hits.
pub fn trace(tracer: &dyn Tracer, rays: &[Ray], query: Query, threads: usize) -> usize {
    const CHUNK: usize = 4096;
    let next = AtomicUsize::new(0);
    let hits = AtomicUsize::new(0);
    let work = || {
        loop {
            let start = next.fetch_add(CHUNK, Ordering::Relaxed);
            let Some(rest) = rays.get(start..) else { break };
            let chunk = &rest[..rest.len().min(CHUNK)];
            let found = match query {
                Query::Intersect => chunk
                    .iter()
                    .filter(|ray| black_box(tracer.intersect(ray)).is_some())
                    .count(),
                Query::Occluded => chunk.iter().filter(|ray| tracer.occluded(ray)).count(),
            };
            hits.fetch_add(found, Ordering::Relaxed);
        }
    };
    if threads == 1 {
        work();
    } else {
        std::thread::scope(|scope| {
            for _ in 0..threads {
                scope.spawn(work);
            }
        });
    }
    hits.into_inner()
}

/// Times of the three kinds of rays.
#[derive(Clone, Debug, Default)]
pub struct RayTimes {
    primary: Times,
    bounce: Times,
    occlusion: Times,
}

impl RayTimes {
    /// One more round of all rays.
    pub fn round(&mut self, tracer: &dyn Tracer, rays: &Rays, threads: usize) {
        let intersect = Query::Intersect;
        self.primary
            .time(|| trace(tracer, &rays.primary, intersect, threads));
        self.bounce
            .time(|| trace(tracer, &rays.bounce, intersect, threads));
        self.occlusion
            .time(|| trace(tracer, &rays.occlusion, Query::Occluded, threads));
    }

    /// Three cells of a Markdown table: millions of rays per second, median over the rounds.
    pub fn cells(&self, rays: &Rays) -> String {
        let rate = |rays: &[Ray], times: &Times| rays.len() as f64 / times.median() / 1e6;
        format!(
            "{:.2} | {:.2} | {:.2}",
            rate(&rays.primary, &self.primary),
            rate(&rays.bounce, &self.bounce),
            rate(&rays.occlusion, &self.occlusion),
        )
    }
}

/// The number after `--name` on the command line, or `default`.
///
/// # Panics
///
/// When what follows is not a number.
pub fn option(name: &str, default: usize) -> usize {
    let mut arguments = std::env::args().skip_while(|argument| argument != name);
    arguments.next();
    match arguments.next() {
        Some(value) => value
            .parse()
            .unwrap_or_else(|_| panic!("{name} {value}: expected a number")),
        None => default,
    }
}
