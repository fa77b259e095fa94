//! Pictures from the command line, on a real adapter.

use std::process::{Command, Output};

fn render(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_hapdef"))
        .arg("render")
        .args(arguments)
        .output()
        .unwrap()
}

#[test]
fn a_picture_has_the_size_the_limb_and_its_gauges() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("limb.png");
    let path = out.to_str().unwrap();
    let drawn = render(&[
        "--view",
        "front",
        "--size",
        "320x480",
        "--transparent",
        "--out",
        path,
    ]);
    assert!(
        drawn.status.success(),
        "{}",
        String::from_utf8_lossy(&drawn.stderr)
    );
    let picture = image::open(&out).unwrap().to_rgba8();
    assert_eq!(picture.dimensions(), (320, 480));
    let count = |is: &dyn Fn([u8; 4]) -> bool| picture.pixels().filter(|p| is(p.0)).count();
    let all = 320 * 480;
    let empty = count(&|p| p[3] == 0);
    let limb = count(&|p| p[3] == 255 && p[0].abs_diff(p[2]) < 60);
    let gauges = count(&|p| p[3] == 255 && p[0] > 200 && p[2] < 80);
    assert!(
        empty > all / 5 && limb > all / 5,
        "{empty} empty, {limb} limb"
    );
    assert!(gauges > 60, "{gauges} pixels of gauges");
    // It fills the height.
    let row = |y: u32| (0..320).any(|x| picture.get_pixel(x, y).0[3] == 255);
    assert!(row(40) && row(440) && !row(2) && !row(477));
    let opaque = folder.path().join("opaque.png");
    assert!(
        render(&["--size", "64x64", "--out", opaque.to_str().unwrap()])
            .status
            .success()
    );
    let picture = image::open(&opaque).unwrap().to_rgba8();
    assert!(picture.pixels().all(|p| p.0[3] == 255));
}

#[test]
fn a_limb_stands_on_a_floor_and_its_edges_are_drawn() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("limb.png");
    let size = ["--size", "400x600", "--backdrop", "neutral", "--out"];
    let drawn = render(&[&size[..], &[out.to_str().unwrap()]].concat());
    assert!(drawn.status.success());
    let picture = image::open(&out).unwrap().to_rgba8();
    assert_eq!(picture.get_pixel(3, 3).0, [206, 211, 217, 255]);
    // In the shadow the backdrop keeps its hue: both differences shrink with its light.
    let in_shadow = |p: &&image::Rgba<u8>| {
        let [r, g, b, _] = p.0;
        let share = f32::from(g) / 211.0;
        let hue = |c: u8, of: f32| (f32::from(c) - of * share).abs() < 1.2;
        (0.3..0.96).contains(&share) && hue(r, 206.0) && hue(b, 217.0)
    };
    let shadow = picture.pixels().filter(in_shadow).count();
    assert!(shadow > 2000, "{shadow} pixels in the shadow");
    // A line is darker than what lies three pixels to its left and its right, or above and below. Drawn without edges there are 750
    // such pixels, most of them gauges.
    let light = |x: u32, y: u32| i32::from(picture.get_pixel(x, y).0[1]);
    let inside = (3..597).flat_map(|y| (3..397).map(move |x| (x, y)));
    let lines = inside.filter(|&(x, y)| {
        let darker = |a: i32, b: i32| light(x, y) < a.min(b) - 30;
        darker(light(x - 3, y), light(x + 3, y)) || darker(light(x, y - 3), light(x, y + 3))
    });
    let lines = lines.count();
    assert!(lines > 2500, "{lines} pixels of lines");
    let without = [&["--no-floor"], &size[..], &[out.to_str().unwrap()]].concat();
    assert!(render(&without).status.success());
    let picture = image::open(&out).unwrap().to_rgba8();
    let left = picture.pixels().filter(in_shadow).count();
    assert!(left < shadow / 2, "{left} of {shadow} pixels");
}

#[test]
fn what_cannot_be_drawn_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("limb.png");
    let path = out.to_str().unwrap();
    for (size, code, word) in [
        ("99999x3", 1, "between 1 and"),
        ("0x3", 2, "pixels"),
        ("wide", 2, "1920x1080"),
    ] {
        let refused = render(&["--size", size, "--out", path]);
        let said = String::from_utf8_lossy(&refused.stderr);
        assert_eq!(refused.status.code(), Some(code), "{said}");
        assert!(said.contains(word) && !said.contains("panicked"), "{said}");
    }
    assert!(!out.exists());
    let nowhere = render(&["--size", "64x64", "--out", "/nowhere/limb.png"]);
    assert_eq!(nowhere.status.code(), Some(1));
}
