//! OBJ: polygons are cut into triangles; objects and groups become named groups of vertices.

use std::io::Cursor;
use std::path::Path;

use glam::DVec3;

use super::Soup;

pub fn read(bytes: &[u8]) -> Result<Soup, String> {
    let options = tobj::LoadOptions {
        triangulate: true,
        ignore_points: true,
        ignore_lines: true,
        ..Default::default()
    };
    let no_materials = |_: &Path| Err(tobj::LoadError::GenericFailure);
    let (models, _) = tobj::load_obj_buf(&mut Cursor::new(bytes), &options, no_materials)
        .map_err(|e| format!("not a readable OBJ file ({e})"))?;
    let mut soup = Soup::default();
    for model in models {
        let base = soup.positions.len() as u32;
        let first = soup.triangles.len();
        soup.positions.extend(
            model
                .mesh
                .positions
                .chunks_exact(3)
                .map(|p| DVec3::new(p[0].into(), p[1].into(), p[2].into())),
        );
        soup.triangles.extend(
            model
                .mesh
                .indices
                .chunks_exact(3)
                .map(|t| [t[0], t[1], t[2]].map(|v| base.saturating_add(v))),
        );
        soup.group(&model.name, first);
    }
    Ok(soup)
}
