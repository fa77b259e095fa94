use super::*;

/// White, more or less (splitmix64): −3 to 3.
fn noise(k: u32, of: u64) -> f64 {
    let z = (4 * u64::from(k) + of + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) % 7) as f64 - 3.0
}

/// Takes the lines off sample `k` of a board at a rate (Hz).
fn take_off(hum: &mut Hum, k: u32, rate: f64, counts: &mut [f64], at_rest: bool) {
    let step_s = if k == 0 { 0.0 } else { rate.recip() };
    hum.take_off(step_s, counts, at_rest);
}

/// Two channels that hum, over a level, with noise.
fn read(k: u32, rate: f64, hertz: f64, size: f64) -> (f64, [f64; 2]) {
    let now = f64::from(k) / rate;
    let hum = |turned: f64| size * (TAU * hertz * now + turned).sin();
    (
        now,
        [
            2000.0 + hum(0.3) + noise(k, 0),
            900.0 - 0.5 * hum(1.9) + noise(k, 1),
        ],
    )
}

#[test]
fn hum_is_found_at_its_frequency_and_taken_off() {
    for (rate, hertz) in [
        (1000.0, 49.93),
        (1000.0, 60.05),
        (400.0, 100.1),
        (4000.0, 50.0),
        (90.0, 50.02),
    ] {
        let mut hum = Hum::default();
        let mut left = Vec::new();
        for k in 0..(4.0 * rate) as u32 {
            let (now, mut counts) = read(k, rate, hertz, 20.0);
            take_off(&mut hum, k, rate, &mut counts, true);
            if now > 2.0 {
                left.push(counts[0] - 2000.0);
            }
        }
        let rms = (left.iter().map(|x| x * x).sum::<f64>() / left.len() as f64).sqrt();
        assert!(rms < 2.3, "{rate} {hertz}: {rms}, {:?}", hum.lines);
        let shown = (hertz - (hertz / rate).round() * rate).abs();
        assert!((hum.lines[0].hertz - shown).abs() < 0.02, "{:?}", hum.lines);
        assert!((hum.rms(0) - 14.14).abs() < 0.5);
    }
}

/// Also where a board sends four samples a period, and somebody drums on the limb.
#[test]
fn what_hums_goes_on_behind_steep_touches_at_any_rate() {
    for rate in [200.0, 250.0, 1000.0] {
        let mut hum = Hum::default();
        let mut worst = 0.0_f64;
        for k in 0..(13.0 * rate) as u32 {
            let (now, mut counts) = read(k, rate, 50.03, 20.0);
            let drums = (3.0..12.0).contains(&now);
            let pressed = if drums && now % 0.5 < 0.12 {
                1500.0
            } else {
                0.0
            };
            counts[0] += pressed;
            take_off(&mut hum, k, rate, &mut counts, now < 3.0);
            if now > 3.0 {
                worst = worst.max((counts[0] - 2000.0 - pressed).abs());
            }
        }
        assert!(worst < 6.0, "{rate} Hz: {worst}");
    }
}

/// A grid wanders, while a hand that trembles presses a second and lets go for half of one: no second of rest to look at.
#[test]
fn what_hums_is_followed_where_its_frequency_wanders_and_hands_tremble() {
    for rate in [250.0, 500.0, 1000.0] {
        let mut hum = Hum::default();
        let mut worst = 0.0_f64;
        for k in 0..(40.0 * rate) as u32 {
            let now = f64::from(k) / rate;
            let wander = 0.05 * 20.0 / TAU * (1.0 - (TAU * now / 20.0).cos());
            let at = 49.93 * now + wander;
            let (_, mut counts) = read(k, rate, 0.0, 0.0);
            let of = [20.0, -10.0].map(|size| size * (TAU * at).sin());
            for (count, of) in counts.iter_mut().zip(of) {
                *count += of;
            }
            let is_touched = now > 3.0 && now % 1.5 < 1.0;
            let pressed = if is_touched {
                1500.0 * (1.0 + 0.04 * (TAU * 8.3 * now).sin())
            } else {
                0.0
            };
            counts[0] += pressed;
            take_off(&mut hum, k, rate, &mut counts, !is_touched);
            if now > 3.0 {
                worst = worst.max((counts[0] - 2000.0 - pressed).abs());
            }
        }
        assert!(worst < 6.0, "{rate} Hz: {worst}");
    }
}

#[test]
fn a_touch_is_no_hum_and_does_not_move_what_hums() {
    let mut hum = Hum::default();
    let mut worst = 0.0_f64;
    for k in 0..6000 {
        let (now, mut counts) = read(k, 1000.0, 50.0, 20.0);
        let pressed = if now > 3.0 { 400.0 } else { 0.0 };
        counts[0] += pressed;
        hum.take_off(0.001, &mut counts, now < 3.0);
        if now > 3.0 {
            worst = worst.max((counts[0] - 2000.0 - pressed).abs());
        }
    }
    assert!(worst < 5.0, "{worst}");
    let mut calm = Hum::default();
    for k in 0..3000 {
        let (_, mut counts) = read(k, 1000.0, 50.0, 0.0);
        calm.take_off(0.001, &mut counts, true);
    }
    assert!(calm.lines.is_empty(), "{:?}", calm.lines);
}

/// Noise and a hand that taps every half second, with hum from some second on that is taken for a touch: how far what is read is off
/// at most, from some second on, without the tap; and how many lines there are.
fn begun_behind(rate: f64, size: f64, begins_s: f64, from_s: f64) -> (f64, usize) {
    let mut hum = Hum::default();
    let mut worst = 0.0_f64;
    for k in 0..(from_s + 6.0) as u32 * rate as u32 {
        let now = f64::from(k) / rate;
        let (_, mut counts) = read(k, rate, 49.96, if now < begins_s { 0.0 } else { size });
        let tapped = now > 3.0 && now % 0.5 < 0.1;
        let pressed = if tapped {
            700.0 * (1.0 + 0.1 * (TAU * 7.7 * now).sin())
        } else {
            0.0
        };
        for count in &mut counts {
            *count += pressed;
        }
        let at_rest = !tapped && (now < begins_s || now > from_s);
        take_off(&mut hum, k, rate, &mut counts, at_rest);
        if now > from_s {
            worst = worst.max((counts[0] - 2000.0 - pressed).abs());
        }
    }
    (worst, hum.lines.len())
}

#[test]
fn what_begins_to_hum_behind_touches_is_found() {
    for rate in [200.0, 500.0, 1000.0, 2500.0, 4000.0] {
        for size in [6.0, 40.0] {
            let (worst, lines) = begun_behind(rate, size, 6.0, 8.0);
            assert!(
                worst < 6.0 && lines == 1,
                "{rate} Hz, {size}: {worst}, {lines} lines"
            );
        }
    }
}

/// Though these taps come twenty-five periods of mains after one another.
#[test]
fn taps_are_no_hum() {
    for rate in [200.0, 500.0, 1000.0] {
        let (_, lines) = begun_behind(rate, 0.0, 6.0, 9.5);
        assert_eq!(lines, 0, "{rate} Hz");
    }
}

/// Hours of touches on a slow board of coarse counts.
#[test]
fn noise_behind_a_touch_is_no_hum() {
    for rate in [60.0_f64, 100.0, 120.0, 200.0] {
        let mut hum = Hum::default();
        let mut lines = 0;
        for k in 0..(3600.0 * rate) as u32 {
            let mut counts = [0, 1, 2, 3].map(|of| (noise(k, of) / 4.0).round());
            take_off(&mut hum, k, rate, &mut counts, k < 3 * rate as u32);
            lines = lines.max(hum.lines.len());
        }
        assert_eq!(lines, 0, "{rate} Hz");
    }
}

/// Means of several samples are of a while before the last of them.
#[test]
fn a_line_found_on_a_fast_board_has_the_phase_of_the_last_sample() {
    for rate in [1000.0, 2500.0, 4000.0] {
        let row = |k| {
            let (now, counts) = read(k, rate, 50.0, 400.0);
            (now, counts.to_vec())
        };
        let mut rows: HumSamples = (0..rate as u32).map(row).collect();
        let found = behind::line_near(&rows, rate, [&[50.0], &[]], &[2.0, 2.0]);
        let mut line = found.expect("a line of 400 counts");
        // As `take_from` has it.
        for [a, b] in &mut line.waves {
            let (sin, cos) = line.phase.sin_cos();
            (*a, *b) = (*a * cos + *b * sin, *b * cos - *a * sin);
        }
        line.take_from(&mut rows);
        let of_the_last = rows.range(rows.len() - 50..).map(|r| r.1[0] - 2000.0);
        let worst = of_the_last.fold(0.0_f64, |worst, off| worst.max(off.abs()));
        assert!(worst < 20.0, "{rate} Hz: {worst}");
    }
}

/// What mains do at 100 and 120 Hz shows at 10 Hz where a board sends 110 samples a second, and hands tremble at 8 Hz.
#[test]
fn a_trembling_hand_draws_no_line_after_it() {
    let (rate, shown) = (110.0, 10.0);
    let mut hum = Hum::default();
    for k in 0..(20.0 * rate) as u32 {
        let (now, mut counts) = read(k, rate, 60.0 * 2.0, 4.0);
        let pressed = if now > 3.0 {
            500.0 * (1.0 + 0.1 * (TAU * 8.0 * now).sin())
        } else {
            0.0
        };
        for count in &mut counts {
            *count += pressed;
        }
        take_off(&mut hum, k, rate, &mut counts, now < 3.0);
    }
    assert!((hum.lines[0].hertz - shown).abs() < 0.6, "{:?}", hum.lines);
}
