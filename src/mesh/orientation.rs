//! Which side of a surface is its outside: neighbours agree on it, and closed bodies face outward.

use std::collections::VecDeque;

use glam::DVec3;

use super::report::RepairReport;
use super::topology::Sides;

/// Turns triangles over until neighbours across every two-triangle edge agree, following the first
/// triangle of the body, on the side that most were on. Whether any was turned.
pub(super) fn orient(triangles: &mut [[u32; 3]], sides: &Sides, report: &mut RepairReport) -> bool {
    let runs = |tri: [u32; 3], a: u32, b: u32| (0..3).any(|i| tri[i] == a && tri[(i + 1) % 3] == b);
    let mut visited = vec![false; triangles.len()];
    let mut flipped = vec![false; triangles.len()];
    for start in 0..triangles.len() {
        if visited[start] {
            continue;
        }
        visited[start] = true;
        let mut members = vec![start];
        let mut queue = VecDeque::from([start]);
        while let Some(t) = queue.pop_front() {
            for e in sides.of_triangles[t] {
                let edge = &sides.edges[e as usize];
                if edge.triangles.len() != 2 {
                    continue;
                }
                let other = edge.triangles[usize::from(edge.triangles[0] as usize == t)] as usize;
                if visited[other] {
                    continue;
                }
                visited[other] = true;
                if runs(triangles[t], edge.a, edge.b) == runs(triangles[other], edge.a, edge.b) {
                    triangles[other].swap(1, 2);
                    flipped[other] = true;
                }
                members.push(other);
                queue.push_back(other);
            }
        }
        // The first triangle is as likely to be the wrong one: keep the side that most were on.
        if 2 * members.iter().filter(|&&t| flipped[t]).count() > members.len() {
            for &t in &members {
                triangles[t].swap(1, 2);
                flipped[t] = !flipped[t];
            }
        }
    }
    report.flipped_triangles = flipped.iter().filter(|&&f| f).count();
    report.flipped_triangles > 0
}

/// A closed body encloses a positive volume when its triangles face outward; an open one has no outside
/// of its own and stays as its file says. Whether it was turned.
pub(super) fn turn_outward(
    positions: &[DVec3],
    triangles: &mut [[u32; 3]],
    report: &mut RepairReport,
) -> bool {
    let origin = positions[0];
    let volume: f64 = triangles
        .iter()
        .map(|tri| {
            let [a, b, c] = tri.map(|v| positions[v as usize] - origin);
            a.dot(b.cross(c))
        })
        .sum();
    if volume < 0.0 {
        for tri in triangles.iter_mut() {
            tri.swap(1, 2);
        }
        report.flipped_triangles = triangles.len() - report.flipped_triangles;
    }
    volume < 0.0
}
