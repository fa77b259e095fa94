//! Ten gauges of the bundled limb that live touch is held on, whatever a choice makes of that limb: how far off a light touch
//! is after ten minutes, or how often a palm is told from a finger, differs from one set to another.

use hapdef::project::ChosenSite;

/// Places (mm) and directions.
const GAUGES: [[[f64; 3]; 2]; 10] = [
    [[-31.733, 1.547, 34.651], [0.047, 0.9989, 0.0047]],
    [[20.99, 23.884, 66.15], [-0.0461, 0.0442, 0.998]],
    [[19.384, 25.234, 19.95], [-0.5511, 0.4248, 0.7182]],
    [[18.99, -25.543, 99.75], [0.5629, 0.4159, 0.7142]],
    [[-27.71, 15.518, 3.152], [0.4871, 0.8719, 0.0504]],
    [[-31.781, 1.549, 112.35], [-0.0492, -0.9988, 0.0052]],
    [[-31.75, 1.548, 61.949], [0.0471, 0.9989, 0.0058]],
    [[-28.883, -13.204, 3.152], [0.4129, -0.9084, 0.0652]],
    [[-24.152, 20.693, 116.55], [0.6497, 0.7594, 0.0358]],
    [[18.99, -25.542, 26.25], [0.2109, 0.157, 0.9648]],
];

pub fn sites() -> Vec<ChosenSite> {
    let site = |[position_mm, direction]: [[f64; 3]; 2]| ChosenSite {
        position_mm,
        direction,
    };
    GAUGES.map(site).to_vec()
}
