//! Numbers of surfaces, and the objects that they belong to.

use std::num::NonZeroU32;

use crate::scene::Face;

/// Number of a surface of a compiled scene.
///
/// The faces of the room come first, then six faces of each box, then front and back of each facet of a mesh, then the luminaires, then
/// one black surface, the upper side of all openings that hang into the room, and last the lower sides of the closures. [`Numbering`] gives
/// the first number of each kind.
// one more than the number, so that an `Option` of it takes no more room
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct SurfaceId(NonZeroU32);

/// Number of faces of a box.
const FACES: usize = Face::ALL.len();

/// Number of sides of a facet.
const SIDES: usize = 2;

/// The side of a facet of a mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// The side toward which the facet's normal points.
    Front,
    /// The other side.
    Back,
}

/// An object that stands in a room.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum RoomObject {
    /// Number of a box in the scene.
    Box(usize),
    /// Number of a mesh object in the scene.
    Mesh(usize),
}

impl SurfaceId {
    #[inline]
    const fn new(index: usize) -> Self {
        Self(NonZeroU32::MIN.saturating_add(index as u32))
    }

    /// Returns the number of a face of a room in box form.
    #[inline]
    pub const fn of_face(face: Face) -> Self {
        Self::new(face as usize)
    }

    /// Returns the surface at an index into lists of all surfaces.
    #[inline]
    pub const fn numbered(index: usize) -> Self {
        Self::new(index)
    }

    /// Returns the index of the surface into lists of all surfaces.
    #[inline]
    pub const fn index(self) -> usize {
        self.0.get() as usize - 1
    }
}

/// Layout of the surface numbers of one scene, given by its numbers of faces, boxes, facets, luminaires and tubes.
#[derive(Clone, Copy, Debug)]
pub struct Numbering {
    /// Number of faces of the room.
    pub faces: usize,
    /// Number of boxes.
    pub boxes: usize,
    /// Number of facets of all meshes.
    pub facets: usize,
    /// Number of luminaires.
    pub luminaires: usize,
    /// Number of tubes.
    pub tubes: usize,
}

impl Numbering {
    /// Returns the number of face `face` (0..6, counted as by [`Face`]) of box `object`.
    #[inline]
    pub fn box_face(self, object: usize, face: usize) -> SurfaceId {
        SurfaceId::new(self.faces + FACES * object + face)
    }

    /// Returns the number of one side of a facet.
    #[inline]
    pub fn facet_side(self, facet: usize, side: Side) -> SurfaceId {
        SurfaceId::new(self.first_facet() + SIDES * facet + side as usize)
    }

    /// Returns the number of the surface of a luminaire.
    #[inline]
    pub fn luminaire(self, luminaire: usize) -> SurfaceId {
        SurfaceId::new(self.first_luminaire() + luminaire)
    }

    /// Finds the box that has this surface.
    #[inline]
    pub fn box_of(self, surface: SurfaceId) -> Option<usize> {
        let object = surface.index().checked_sub(self.faces)? / FACES;
        (object < self.boxes).then_some(object)
    }

    /// Finds the facet that has this surface.
    #[inline]
    pub fn facet_of(self, surface: SurfaceId) -> Option<usize> {
        let facet = surface.index().checked_sub(self.first_facet())? / SIDES;
        (facet < self.facets).then_some(facet)
    }

    /// Finds the luminaire that has this surface.
    #[inline]
    pub fn luminaire_of(self, surface: SurfaceId) -> Option<usize> {
        let luminaire = surface.index().checked_sub(self.first_luminaire())?;
        (luminaire < self.luminaires).then_some(luminaire)
    }

    /// Returns the number of the black surface that is the upper side of all openings that hang into the room.
    #[inline]
    pub fn above_openings(self) -> SurfaceId {
        self.luminaire(self.luminaires)
    }

    /// Returns the number of the lower side of a tube's closure.
    #[inline]
    pub fn closure(self, tube: usize) -> SurfaceId {
        SurfaceId::new(self.above_openings().index() + 1 + tube)
    }

    /// Finds the tube whose closure has this lower side.
    #[inline]
    pub fn closure_of(self, surface: SurfaceId) -> Option<usize> {
        surface.index().checked_sub(self.closure(0).index())
    }

    /// Returns the number of all surfaces.
    pub fn count(self) -> usize {
        self.closure(self.tubes).index()
    }

    fn first_facet(self) -> usize {
        self.faces + FACES * self.boxes
    }

    fn first_luminaire(self) -> usize {
        self.first_facet() + SIDES * self.facets
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_surface_has_one_owner_and_every_owner_its_surfaces() {
        for (faces, boxes, facets, luminaires, tubes) in
            [(6, 0, 0, 0, 0), (8, 2, 0, 3, 2), (6, 0, 5, 0, 1), (5, 3, 4, 2, 0)]
        {
            let numbering = Numbering { faces, boxes, facets, luminaires, tubes };
            let mut surfaces: Vec<_> = (0..faces).map(SurfaceId::numbered).collect();
            for (object, face) in (0..boxes).flat_map(|object| (0..FACES).map(move |face| (object, face))) {
                let surface = numbering.box_face(object, face);
                assert_eq!(numbering.box_of(surface), Some(object));
                surfaces.push(surface);
            }
            for (facet, side) in (0..facets).flat_map(|facet| [(facet, Side::Front), (facet, Side::Back)]) {
                let surface = numbering.facet_side(facet, side);
                assert_eq!(numbering.facet_of(surface), Some(facet));
                surfaces.push(surface);
            }
            for luminaire in 0..luminaires {
                let surface = numbering.luminaire(luminaire);
                assert_eq!(numbering.luminaire_of(surface), Some(luminaire));
                surfaces.push(surface);
            }
            surfaces.push(numbering.above_openings());
            surfaces.extend((0..tubes).map(|tube| numbering.closure(tube)));
            assert_eq!(surfaces.len(), numbering.count());
            for (index, surface) in surfaces.into_iter().enumerate() {
                assert_eq!(surface.index(), index);
                let owners = [
                    index < faces,
                    surface == numbering.above_openings(),
                    numbering.closure_of(surface).is_some(),
                    numbering.box_of(surface).is_some(),
                    numbering.facet_of(surface).is_some(),
                    numbering.luminaire_of(surface).is_some(),
                ];
                assert_eq!(owners.iter().filter(|owner| **owner).count(), 1, "{surface:?}: {owners:?}");
            }
        }
    }
}
