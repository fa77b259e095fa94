use super::*;

/// A cube of six tetrahedra.
pub fn cube() -> VolumeMesh {
    let nodes: Vec<DVec3> = (0..8)
        .map(|i| DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2)))
        .collect();
    let corners = [
        [0, 1, 3, 7],
        [0, 5, 1, 7],
        [0, 3, 2, 7],
        [0, 2, 6, 7],
        [0, 4, 5, 7],
        [0, 6, 4, 7],
    ];
    VolumeMesh::of_linear(nodes, &corners).checked().unwrap()
}

fn volume(mesh: &VolumeMesh) -> f64 {
    let of = |t: &[u32; 10]| {
        let p = t.map(|n| mesh.nodes[n as usize]);
        (p[1] - p[0]).cross(p[2] - p[0]).dot(p[3] - p[0]) / 6.0
    };
    mesh.tetrahedra.iter().map(of).sum()
}

#[test]
fn a_cube_keeps_its_volume_and_surface_when_it_is_refined() {
    let cube = cube();
    let fine = cube.refined().checked().unwrap();
    assert_eq!(fine.tetrahedra.len(), 48);
    // A lattice of five nodes a side.
    assert_eq!(fine.nodes.len(), 125);
    for mesh in [&cube, &fine] {
        assert!((volume(mesh) - 1.0).abs() < 1e-12);
        let (_, surface, pieces) = mesh.body(0).unwrap();
        assert_eq!((surface.boundary_edges().count(), pieces), (0, 1));
        assert!((surface.area() - 6.0).abs() < 1e-12);
        let outward = (0..surface.triangles().len() as u32).all(|t| {
            let middle = surface.corners(t).iter().sum::<DVec3>() / 3.0;
            surface.facet_normal(t).dot(middle - DVec3::splat(0.5)) > 0.0
        });
        assert!(outward);
    }
}

#[test]
fn what_is_no_tetrahedron_is_named() {
    let flat = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::ONE.with_z(0.0)];
    let mesh = VolumeMesh::of_linear(flat.to_vec(), &[[0, 1, 2, 3]]);
    assert!(matches!(
        mesh.checked(),
        Err(VolumeError::Flat { element: 0, .. })
    ));
}

#[test]
fn what_lies_over_its_neighbour_is_named() {
    let nodes = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z, DVec3::splat(0.4)];
    // Both lie above the face 0, 1, 2.
    let mesh = VolumeMesh::of_linear(nodes.to_vec(), &[[0, 1, 2, 3], [0, 1, 2, 4]]);
    let found = mesh.checked().unwrap_err();
    assert_eq!(found.element(), Some(1));
    assert!(matches!(found, VolumeError::Overlapping { .. }));
}

#[test]
fn linear_and_quadratic_neighbours_share_the_nodes_between_them() {
    let corners = [
        DVec3::ZERO,
        DVec3::X,
        DVec3::Y,
        DVec3::Z,
        DVec3::new(1.0, 1.0, 1.0),
    ];
    let quadratic = VolumeMesh::of_linear(corners.to_vec(), &[[0, 1, 2, 3]]);
    let own: [u32; 10] = quadratic.tetrahedra[0];
    let mut mixed = [
        Tetrahedron {
            corners: [0, 1, 2, 3],
            middles: std::array::from_fn(|k| Some(own[4 + k])),
        },
        Tetrahedron {
            corners: [1, 2, 3, 4],
            middles: [None; 6],
        },
    ];
    // The nodes of the first, the far corner, and those on the three edges to it.
    let mesh = VolumeMesh::of(quadratic.nodes.clone(), &mixed).unwrap();
    assert_eq!(mesh.nodes.len(), 11 + 3);
    // Another node on the edge 1, 2 would let them move apart.
    mixed[1].middles = [own[4], own[8], own[9], own[6], own[6], own[7]].map(Some);
    let torn = VolumeMesh::of(quadratic.nodes.clone(), &mixed).unwrap_err();
    assert_eq!(torn, VolumeError::Torn { element: 1 });
    // A node on two edges could not be moved for one of them.
    mixed[1].middles = [Some(own[5]), None, None, Some(own[4]), None, None];
    let astray = VolumeMesh::of(quadratic.nodes, &mixed).unwrap_err();
    assert_eq!(astray, VolumeError::Astray { element: 1 });
}
