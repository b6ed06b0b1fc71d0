//! Timing in interleaved rounds, so that a machine's moods meet every contestant alike.

use std::hint::black_box;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use prismarch::ray::{Ray, RayPacket};
use prismarch::trace::Tracer;
use rustix::time::{ClockId, clock_gettime};

use super::rays::{Packets, Rays};

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

    /// As [`time`](Self::time), for work that `threads` threads do: of one thread its own CPU time, so that other
    /// programs on the machine are not counted.
    pub fn time_on(&mut self, threads: usize, work: impl FnOnce() -> usize) {
        if threads > 1 {
            self.time(work);
            return;
        }
        let start = thread_seconds();
        black_box(work());
        self.0.push(thread_seconds() - start);
    }

    /// Takes over what another has timed.
    pub fn time_of(&mut self, other: &Self) {
        self.0.extend(&other.0);
    }

    /// The longest, seconds; 0 without any.
    pub fn most(&self) -> f64 {
        self.0.iter().copied().fold(0.0, f64::max)
    }

    /// The middle of all rounds, seconds; NaN without any.
    pub fn median(&self) -> f64 {
        let mut sorted = self.0.clone();
        sorted.sort_by(f64::total_cmp);
        sorted.get(sorted.len() / 2).copied().unwrap_or(f64::NAN)
    }
}

/// CPU time of this thread.
fn thread_seconds() -> f64 {
    let time = clock_gettime(ClockId::ThreadCPUTime);
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
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
    in_chunks(rays, 4096, threads, |ray| {
        usize::from(match query {
            Query::Intersect => black_box(tracer.intersect(ray)).is_some(),
            Query::Occluded => tracer.occluded(ray),
        })
    })
}

/// Traces all packets on `threads` threads and returns the number of hits.
pub fn trace_packets(
    tracer: &dyn Tracer,
    packets: &[RayPacket],
    query: Query,
    threads: usize,
) -> usize {
    in_chunks(
        packets,
        4096 / RayPacket::LANES,
        threads,
        |packet| match query {
            Query::Intersect => black_box(tracer.intersect8(packet))
                .iter()
                .flatten()
                .count(),
            Query::Occluded => tracer.occluded8(packet).count_ones() as usize,
        },
    )
}

/// The sum of `count` over all items, taken in chunks by `threads` threads.
fn in_chunks<T: Sync>(
    items: &[T],
    size: usize,
    threads: usize,
    count: impl Fn(&T) -> usize + Sync,
) -> usize {
    let next = AtomicUsize::new(0);
    let sum = AtomicUsize::new(0);
    let work = || {
        loop {
            let start = next.fetch_add(size, Ordering::Relaxed);
            let Some(rest) = items.get(start..) else {
                break;
            };
            let chunk = &rest[..rest.len().min(size)];
            sum.fetch_add(chunk.iter().map(&count).sum(), Ordering::Relaxed);
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
    sum.into_inner()
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
            .time_on(threads, || trace(tracer, &rays.primary, intersect, threads));
        self.bounce
            .time_on(threads, || trace(tracer, &rays.bounce, intersect, threads));
        self.occlusion.time_on(threads, || {
            trace(tracer, &rays.occlusion, Query::Occluded, threads)
        });
    }

    /// One more round of the same rays as packets.
    pub fn round_of_packets(&mut self, tracer: &dyn Tracer, packets: &Packets, threads: usize) {
        let intersect = Query::Intersect;
        self.primary.time_on(threads, || {
            trace_packets(tracer, &packets.primary, intersect, threads)
        });
        self.bounce.time_on(threads, || {
            trace_packets(tracer, &packets.bounce, intersect, threads)
        });
        self.occlusion.time_on(threads, || {
            trace_packets(tracer, &packets.occlusion, Query::Occluded, threads)
        });
    }

    /// Millions of rays per second, median over the rounds: primary, bounce, occlusion.
    pub fn rates(&self, rays: &Rays) -> [f64; 3] {
        let rate = |rays: &[Ray], times: &Times| rays.len() as f64 / times.median() / 1e6;
        [
            rate(&rays.primary, &self.primary),
            rate(&rays.bounce, &self.bounce),
            rate(&rays.occlusion, &self.occlusion),
        ]
    }

    /// The rates as three cells of a Markdown table.
    pub fn cells(&self, rays: &Rays) -> String {
        let [primary, bounce, occlusion] = self.rates(rays);
        format!("{primary:.2} | {bounce:.2} | {occlusion:.2}")
    }
}

/// The number after `--name` on the command line, or `default`.
///
/// # Panics
///
/// When what follows is not a number.
pub fn option(name: &str, default: usize) -> usize {
    match word(name) {
        Some(value) => value
            .parse()
            .unwrap_or_else(|_| panic!("{name} {value}: expected a number")),
        None => default,
    }
}

/// The word after `--name` on the command line.
pub fn word(name: &str) -> Option<String> {
    let mut arguments = std::env::args().skip_while(|argument| argument != name);
    arguments.next();
    arguments.next()
}
