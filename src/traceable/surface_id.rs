//! Numbers of surfaces.

/// Number of a surface: 0..6 the faces of the room, then six for each box, then two for each facet of a mesh (its front
/// and its back), then one for each luminaire.
pub type SurfaceId = u32;

/// Stands for no surface, e.g. where light comes out of an opening.
pub const NO_SURFACE: SurfaceId = SurfaceId::MAX;
