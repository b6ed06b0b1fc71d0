//! Times per ray as curves: across by doublings, up in nanoseconds from 0.

use std::fmt::Write;

pub struct Panel {
    pub what: &'static str,
    /// Across, and nanoseconds of a primary, a bounce and an occlusion ray.
    pub points: Vec<(f64, [f64; 3])>,
}

const KINDS: [(&str, &str); 3] = [
    ("primary", "#1f5fa8"),
    ("bounce", "#b5472a"),
    ("occlusion", "#3d8048"),
];

/// A panel's size, and what is left free around it.
const SIZE: [f64; 2] = [420.0, 300.0];
const LEFT: f64 = 60.0;
const TOP: f64 = 30.0;

/// The panels side by side, on one scale.
pub fn svg(panels: &[Panel]) -> String {
    let times = panels
        .iter()
        .flat_map(|panel| &panel.points)
        .flat_map(|(_, times)| times);
    let most = (times.fold(0f64, |a, &b| a.max(b)) / 500.0).ceil() * 500.0;
    let (width, height) = (
        (SIZE[0] + LEFT + 40.0) * panels.len() as f64,
        SIZE[1] + TOP + 60.0,
    );
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" font-family=\"sans-serif\" \
         font-size=\"13\"><rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n"
    );
    for (k, panel) in panels.iter().enumerate() {
        let left = LEFT + k as f64 * (SIZE[0] + LEFT + 40.0);
        draw(&mut svg, panel, left, most).expect("a string takes all");
    }
    svg.push_str("</svg>\n");
    svg
}

fn draw(svg: &mut String, panel: &Panel, left: f64, most: f64) -> std::fmt::Result {
    let bottom = TOP + SIZE[1];
    let logarithms = |points: &[(f64, [f64; 3])]| {
        let across = points.iter().map(|(x, _)| x.log2());
        (
            across.clone().fold(f64::INFINITY, f64::min),
            across.fold(f64::NEG_INFINITY, f64::max),
        )
    };
    let (low, high) = logarithms(&panel.points);
    let x = |count: f64| left + (count.log2() - low) / (high - low) * SIZE[0];
    let y = |time: f64| bottom - time / most * SIZE[1];
    for step in 0..=(most / 500.0) as u32 {
        let (time, right) = (f64::from(step) * 500.0, left + SIZE[0]);
        let y = y(time);
        writeln!(
            svg,
            "<line x1=\"{left}\" y1=\"{y:.1}\" x2=\"{right}\" y2=\"{y:.1}\" stroke=\"#ddd\"/>"
        )?;
        writeln!(
            svg,
            "<text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{time} ns</text>",
            left - 6.0,
            y + 4.0
        )?;
    }
    for (count, _) in &panel.points {
        let (x, y) = (x(*count), bottom + 18.0);
        writeln!(
            svg,
            "<text x=\"{x:.1}\" y=\"{y}\" font-size=\"11\" text-anchor=\"middle\">{count}</text>"
        )?;
    }
    let (middle, under) = (left + 0.5 * SIZE[0], bottom + 42.0);
    writeln!(
        svg,
        "<text x=\"{middle}\" y=\"{under}\" text-anchor=\"middle\">{}</text>",
        panel.what
    )?;
    for (kind, (name, colour)) in KINDS.iter().enumerate() {
        let line: Vec<String> = panel
            .points
            .iter()
            .map(|(count, times)| format!("{:.1},{:.1}", x(*count), y(times[kind])))
            .collect();
        writeln!(
            svg,
            "<polyline points=\"{}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"2\"/>",
            line.join(" ")
        )?;
        let (x, y) = (left + 10.0 + 90.0 * kind as f64, TOP - 10.0);
        writeln!(
            svg,
            "<text x=\"{x}\" y=\"{y}\" fill=\"{colour}\">{name}</text>"
        )?;
    }
    Ok(())
}
