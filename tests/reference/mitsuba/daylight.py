"""The CIE general sky and the disc of the sun as one Mitsuba emitter that is sampled through openings.

Directions are unit vectors in the room's frame, z up; luminance in cd/m2, illuminance in lux.
"""

import math

import drjit as dr
import mitsuba as mi

# a, b, c, d, e of the types 1 to 15 (CIE S 011)
CIE = {
    1: (4.0, -0.70, 0, -1.0, 0), 2: (4.0, -0.70, 2, -1.5, 0.15), 3: (1.1, -0.8, 0, -1.0, 0),
    4: (1.1, -0.80, 2, -1.5, 0.15), 5: (0, -1.0, 0, -1.0, 0), 6: (0, -1.0, 2, -1.5, 0.15),
    7: (0, -1.0, 5, -2.5, 0.30), 8: (0, -1.0, 10, -3.0, 0.45), 9: (-1, -0.55, 2, -1.5, 0.15),
    10: (-1, -0.55, 5, -2.5, 0.30), 11: (-1, -0.55, 10, -3.0, 0.45), 12: (-1, -0.32, 10, -3.0, 0.45),
    13: (-1, -0.32, 16, -3.0, 0.30), 14: (-1, -0.15, 16, -3.0, 0.30), 15: (-1, -0.15, 24, -2.8, 0.15),
}

SUN_HALF_ANGLE = math.radians(959.63 / 3600)

# distance of a point of the sky, in metres: shadow rays end there, well outside of the room
FAR = 1000.0


def sun_direction(sky, rotation_deg):
    """Unit vector to the sun in the frame of a room whose +y axis has the azimuth `rotation_deg`."""
    position = sky["sun_position"]
    altitude = math.radians(position["altitude_deg"])
    azimuth = math.radians(position["azimuth_deg"] - rotation_deg)
    return (math.cos(altitude) * math.sin(azimuth), math.cos(altitude) * math.cos(azimuth), math.sin(altitude))


def unpolarised(luminance):
    """The same luminance in all channels."""
    return mi.mueller.depolarizer(mi.UnpolarizedSpectrum(luminance)) if mi.is_polarized else mi.Spectrum(luminance)


class Daylight(mi.Emitter):
    """Sky and sun, infinitely far away.

    A vertex looks for them through `openings`, discs x, y, z, radius that lie level: half of the samples toward even points
    of a disc, the other half toward the sun's disc (all toward openings where there is no beam). Whatever else reaches the
    sky does so by a path's own continuation; the integrator weighs the two by their densities, so that neither needs to be
    complete.
    """

    def __init__(self, properties):
        mi.Emitter.__init__(self, properties)
        self.m_flags = int(+mi.EmitterFlags.Infinite)
        self.a, self.b, self.c, self.d, self.e = CIE[int(properties["cie_type"])]
        self.sun = [float(properties[f"sun_{axis}"]) for axis in "xyz"]
        # what closures and collectors let through, the same for every direction
        self.transmittance = float(properties["transmittance"])
        zenith = math.acos(self.sun[2])
        indicatrix = 1 + self.c * (math.exp(self.d * zenith) - math.exp(self.d * math.pi / 2)) + self.e * self.sun[2] ** 2
        gradation = 1 + self.a * math.exp(self.b)
        self.scale = float(properties["zenith_luminance"]) * self.transmittance / (indicatrix * gradation)
        beam = float(properties["beam"]) * self.transmittance
        self.sun_luminance = beam / (math.pi * math.sin(SUN_HALF_ANGLE) ** 2)
        self.sun_density = 1 / (4 * math.pi * math.sin(SUN_HALF_ANGLE / 2) ** 2)
        self.sun_share = 0.5 if beam > 0 else 0.0
        numbers = [float(number) for number in str(properties["openings"]).split()]
        self.openings = [numbers[k : k + 4] for k in range(0, len(numbers), 4)]

    def luminance(self, d):
        """Luminance of sky and sun in the direction `d`."""
        sun = mi.Vector3f(*self.sun)
        angle = dr.atan2(dr.norm(dr.cross(sun, d)), dr.dot(sun, d))
        indicatrix = 1 + self.c * (dr.exp(self.d * angle) - math.exp(self.d * math.pi / 2))
        indicatrix += self.e * dr.square(dr.dot(sun, d))
        gradation = 1 + self.a * dr.exp(self.b / dr.maximum(d.z, 1e-6))
        sky = self.scale * indicatrix * gradation
        return dr.select(d.z > 0, sky + dr.select(self.in_sun(d), self.sun_luminance, 0.0), 0.0)

    def in_sun(self, d):
        # by the chord: single precision has no digits of 1 - cos left
        return dr.norm(d - mi.Vector3f(*self.sun)) <= 2 * math.sin(SUN_HALF_ANGLE / 2)

    def density(self, p, d):
        """Density per sr with which a vertex at `p` is given the direction `d`."""
        even = mi.Float(0)
        for x, y, z, radius in self.openings:
            height = z - p.z
            at_x, at_y = p.x + d.x / d.z * height, p.y + d.y / d.z * height
            inside = (d.z > 0) & (height > 0) & (dr.square(at_x - x) + dr.square(at_y - y) < radius * radius)
            even += dr.select(inside, dr.square(height / d.z) / (math.pi * radius * radius * d.z), 0.0)
        sun = dr.select(self.in_sun(d), self.sun_density, 0.0)
        return (1 - self.sun_share) / len(self.openings) * even + self.sun_share * sun

    def to_opening(self, p, sample):
        """Direction from `p` to an even point of an opening, each as likely."""
        scaled = sample.x * len(self.openings)
        chosen = dr.minimum(mi.UInt32(scaled), len(self.openings) - 1)
        on_disc = mi.warp.square_to_uniform_disk_concentric(mi.Point2f(scaled - mi.Float(chosen), sample.y))
        target = mi.Point3f(0)
        for number, (x, y, z, radius) in enumerate(self.openings):
            here = mi.Point3f(x + radius * on_disc.x, y + radius * on_disc.y, z)
            target = dr.select(chosen == number, here, target)
        return dr.normalize(target - p)

    def to_sun(self, sample):
        """Direction to an even point of the sun's disc."""
        polar = 2 * dr.asin(dr.sqrt(sample.x) * math.sin(SUN_HALF_ANGLE / 2))
        sin, cos = dr.sincos(2 * math.pi * sample.y)
        local = mi.Vector3f(dr.sin(polar) * cos, dr.sin(polar) * sin, dr.cos(polar))
        return mi.Frame3f(mi.Vector3f(*self.sun)).to_world(local)

    def sample_direction(self, it, sample, active=True):
        sample = mi.Point2f(sample)
        sun = sample.x < self.sun_share
        rest = dr.select(sun, sample.x / max(self.sun_share, 1e-9), (sample.x - self.sun_share) / (1 - self.sun_share))
        sample.x = dr.minimum(rest, 1 - 1e-7)
        d = dr.select(sun, self.to_sun(sample), self.to_opening(it.p, sample))
        ds = dr.zeros(mi.DirectionSample3f)
        ds.p, ds.n, ds.d, ds.dist = it.p + d * FAR, -d, d, mi.Float(FAR)
        ds.time, ds.delta = it.time, mi.Bool(False)
        ds.pdf = self.density(it.p, d)
        ds.emitter = mi.EmitterPtr(self)
        return ds, unpolarised(dr.select(active & (ds.pdf > 0), self.luminance(d) / ds.pdf, 0.0))

    def pdf_direction(self, it, ds, active=True):
        return dr.select(active, self.density(it.p, ds.d), 0.0)

    def eval_direction(self, it, ds, active=True):
        return unpolarised(dr.select(active, self.luminance(ds.d), 0.0))

    def eval(self, si, active=True):
        return unpolarised(dr.select(active, self.luminance(-si.wi), 0.0))

    def bbox(self):
        return mi.ScalarBoundingBox3f()

    def traverse(self, callback):
        pass

    def to_string(self):
        return "Daylight[]"


mi.register_emitter("daylight", Daylight)
