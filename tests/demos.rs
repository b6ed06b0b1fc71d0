//! Every demo, small: that it renders, and in how much memory.

mod program;

use program::{Folder, stderr, stdout};
use serde_json::Value;

fn run(folder: &Folder, arguments: &str) -> String {
    let arguments: Vec<&str> = arguments.split(' ').collect();
    let output = folder.run(&arguments);
    assert!(output.status.success(), "{}", stderr(&output));
    stdout(&output)
}

/// docs/render.md: the program and its libraries, then twice what is loaded, since a picture file and what is made of it are there
/// together for a moment; and 1/4 more, so that another allocator or Embree does not fail the test.
fn bound(stats: &Value, pixel: u64) -> u64 {
    const PROGRAM: u64 = 16 << 20;
    let bytes = |value: &Value| value.as_u64().unwrap();
    let loaded = bytes(&stats["memory"]["total"]) + bytes(&stats["memory"]["pictures"]);
    let pixels = bytes(&stats["width"]) * bytes(&stats["height"]);
    (PROGRAM + 2 * loaded + pixel * pixels) * 5 / 4
}

#[test]
fn every_demo_renders_in_the_memory_that_is_stated() {
    let folder = Folder::empty();
    let list = run(&folder, "demo --list");
    let names = list.lines().filter_map(|line| line.split(' ').next());
    let mut count = 0;
    for name in names {
        run(&folder, &format!("demo {name} --map-size 768 --no-render"));
        // Bytes per pixel, with all AOVs and without.
        for (file, pixel) in [("a.exr", 450), ("a.png", 60)] {
            run(
                &folder,
                &format!(
                    "render {name}/{name}.toml -o {file} --size 160x120 --spp 1 --stats a.json"
                ),
            );
            let stats: Value = serde_json::from_str(&folder.text("a.json")).unwrap();
            let bound = bound(&stats, pixel);
            // Where the system does not tell, there is nothing to check.
            let Some(peak) = stats["peak_memory"].as_u64() else {
                continue;
            };
            println!("{name} {file}: {} of {} MB", peak >> 20, bound >> 20);
            assert!(peak > 1 << 20, "{name}: {peak}");
            assert!(
                peak <= bound,
                "{name} {file}: {peak} bytes, stated are {bound}"
            );
        }
        count += 1;
    }
    assert!(count >= 6, "{list}");
}
