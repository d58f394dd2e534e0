//! Surface of an imported body, for drawing only.

use flexbody_model::SurfaceMesh;

/// Returns polygons and lines of a file as the surface of `n` nodes. Polygons are split into triangles from
/// their first corner. If indices refer to no node, the surface is dropped and `omissions` states it.
///
/// * `name`: name of the array in the file.
pub(crate) fn surface(
    name: &str,
    polygons: &[Vec<i64>],
    n: usize,
    omissions: &mut Vec<String>,
) -> Option<SurfaceMesh> {
    let (mut triangles, mut edges) = (Vec::new(), Vec::new());
    let index = |i: i64| u32::try_from(i).unwrap_or(u32::MAX);
    for corners in polygons {
        match corners[..] {
            [] | [_] => {}
            [a, b] => edges.push([index(a), index(b)]),
            [first, ref others @ ..] => {
                triangles
                    .extend(others.windows(2).map(|pair| [index(first), index(pair[0]), index(pair[1])]));
            }
        }
    }
    if triangles.is_empty() && edges.is_empty() {
        return None;
    }
    SurfaceMesh::new(triangles, edges, n)
        .map_err(|problem| {
            omissions.push(format!("`{name}`: {problem}; the body is converted without a surface"))
        })
        .ok()
}
