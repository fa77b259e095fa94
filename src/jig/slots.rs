//! Heights of rings on a rod: each as near to its gauge as the others leave room.

/// Heights (mm) nearest to those that are wanted (ascending), in the sense of least squares, at least `apart` from each other
/// and from `lowest`: the pools of adjacent violators (Ayer et al. 1955). What would leave less than `thin` between two is
/// closed up.
#[must_use]
pub fn slots(wanted: &[f64], lowest: f64, apart: f64, thin: f64) -> Vec<f64> {
    // Without the distances between them heights need only not descend.
    let free = wanted.iter().enumerate().map(|(k, z)| z - k as f64 * apart);
    let mut pools: Vec<(f64, usize)> = Vec::new();
    for z in free {
        pools.push((z, 1));
        while let [.., (a, n), (b, m)] = pools[..]
            && a > b
        {
            let both = (a * n as f64 + b * m as f64) / (n + m) as f64;
            pools.truncate(pools.len() - 2);
            pools.push((both, n + m));
        }
    }
    let even = pools
        .iter()
        .flat_map(|&(z, n)| std::iter::repeat_n(z.max(lowest), n));
    let mut slots: Vec<f64> = even
        .enumerate()
        .map(|(k, z)| z + k as f64 * apart)
        .collect();
    let mut before = lowest - apart;
    for slot in &mut slots {
        let gap = *slot - before - apart;
        if gap < thin {
            *slot -= gap;
        }
        before = *slot;
    }
    slots
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rings_make_room_for_each_other() {
        assert_eq!(slots(&[20.0, 40.0], 3.0, 6.0, 1.0), [20.0, 40.0]);
        // Three at one height spread about it.
        assert_eq!(slots(&[30.0; 3], 3.0, 6.0, 1.0), [24.0, 30.0, 36.0]);
        // The seat is in the way of the first.
        assert_eq!(slots(&[1.0, 30.0], 3.0, 6.0, 1.0), [3.0, 30.0]);
        // A sleeve of half a millimetre cannot be made.
        let closed = slots(&[20.0, 26.5, 60.0], 3.0, 6.0, 1.0);
        assert_eq!(closed, [20.0, 26.0, 60.0]);
    }
}
