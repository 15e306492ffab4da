"""What Mitsuba has no plugin for: the glossy lobe with compensation, and tabulated sheets.

Both answer in Mitsuba's shading frame: the normal is z, and values contain the cosine of the direction of exit.
"""

import json
import math

import drjit as dr
import mitsuba as mi
import numpy as np


def smith_lambda(cosine, alpha):
    """Lambda of the GGX distribution (Heitz 2014); numpy or DrJit."""
    root = np.sqrt if isinstance(cosine, np.ndarray) else dr.sqrt
    tangent2 = (1 - cosine * cosine) / (cosine * cosine)
    return (root(1 + alpha * alpha * tangent2) - 1) / 2


# albedo of a lobe at cosines k^2 / N^2
N = 512


def lobe_albedo(alpha):
    """Directional albedo E of D G2 / (4 cos cos) at the cosines (k / N)^2, and 2 int E c dc.

    The mean of G2 / G1 over reflections at visible normals, which are drawn by spherical caps (Dupuy and Benyoub 2023), at
    the midpoints of 128 x 256 cells.
    """
    u, v = np.meshgrid((np.arange(256) + 0.5) / 256, (np.arange(128) + 0.5) / 128)
    cosines = np.maximum((np.arange(N + 1) / N) ** 2, 1e-7)
    albedo = []
    for cosine in cosines:
        wi = np.array([math.sqrt(1 - cosine * cosine), 0, cosine])
        stretched = wi * [alpha, alpha, 1]
        stretched /= np.linalg.norm(stretched)
        z = (1 - v) * (1 + stretched[2]) - stretched[2]
        sine = np.sqrt(np.maximum(0, 1 - z * z))
        half = np.stack([sine * np.cos(2 * np.pi * u), sine * np.sin(2 * np.pi * u), z]) + stretched[:, None, None]
        normal = half * np.array([alpha, alpha, 1])[:, None, None]
        normal /= np.linalg.norm(normal, axis=0)
        wo = 2 * np.einsum("i,ijk->jk", wi, normal) * normal - wi[:, None, None]
        up = wo[2] > 0
        lambda_i = smith_lambda(np.array(cosine), alpha)
        lambda_o = smith_lambda(np.where(up, wo[2], 1.0), alpha)
        albedo.append(np.where(up, (1 + lambda_i) / (1 + lambda_i + lambda_o), 0).mean())
    albedo = np.array(albedo)
    # c = t^2: 2 E c dc = 4 E t^3 dt
    t = np.arange(N + 1) / N
    return albedo, np.trapezoid(4 * albedo * t**3, t)


class Lobe(mi.BSDF):
    """A Lambertian part and a lobe of GGX microfacets with the compensation of Kulla and Conty.

    f = diffuse / pi + specular (D G2 / (4 cos_i cos_o) + (1 - E(cos_i)) (1 - E(cos_o)) / (pi (1 - mean E))), alpha =
    roughness^2, G2 height-correlated, no Fresnel factor (docs/physics/diffusers.md).
    """

    def __init__(self, properties):
        mi.BSDF.__init__(self, properties)
        self.diffuse = mi.Color3f(properties["diffuse"])
        self.specular = mi.Color3f(properties["specular"])
        self.alpha = float(properties["roughness"]) ** 2
        albedo, mean = lobe_albedo(self.alpha)
        self.missing = mi.Float((1 - albedo).astype(np.float32))
        self.mean_missing = float(1 - mean)
        self.microfacets = mi.MicrofacetDistribution(mi.MicrofacetType.GGX, self.alpha, True)
        both = mi.BSDFFlags.GlossyReflection | mi.BSDFFlags.FrontSide
        self.m_components = [both]
        self.m_flags = both

    def lost(self, cosine):
        """1 - E, linear between the cosines of its table."""
        at = dr.sqrt(dr.clip(cosine, 0, 1)) * N
        low = dr.minimum(mi.UInt32(at), N - 1)
        # linear in the cosine
        left, right = dr.square(mi.Float(low) / N), dr.square((mi.Float(low) + 1) / N)
        part = (cosine - left) / (right - left)
        return dr.lerp(dr.gather(mi.Float, self.missing, low), dr.gather(mi.Float, self.missing, low + 1), part)

    def value_and_density(self, wi, wo, active):
        cos_i, cos_o = mi.Frame3f.cos_theta(wi), mi.Frame3f.cos_theta(wo)
        active = active & (cos_i > 0) & (cos_o > 0)
        half = dr.normalize(wi + wo)
        distribution = self.microfacets.eval(half)
        lambda_i = smith_lambda(cos_i, self.alpha)
        lambda_o = smith_lambda(cos_o, self.alpha)
        single = distribution / ((1 + lambda_i + lambda_o) * 4 * cos_i * cos_o)
        several = self.lost(cos_i) * self.lost(cos_o) / (math.pi * self.mean_missing)
        value = (self.diffuse / math.pi + self.specular * (single + several)) * cos_o
        density = 0.5 * distribution / ((1 + lambda_i) * 4 * cos_i) + 0.5 * cos_o / math.pi
        return value & active, dr.select(active, density, 0.0)

    def sample(self, ctx, si, sample1, sample2, active=True):
        normal, _ = self.microfacets.sample(si.wi, sample2)
        wo = dr.select(sample1 < 0.5, mi.reflect(si.wi, normal), mi.warp.square_to_cosine_hemisphere(sample2))
        value, density = self.value_and_density(si.wi, wo, active)
        return sampled(wo, density, mi.BSDFFlags.GlossyReflection), (value / density) & (density > 0)

    def eval(self, ctx, si, wo, active=True):
        return self.value_and_density(si.wi, wo, active)[0]

    def pdf(self, ctx, si, wo, active=True):
        return self.value_and_density(si.wi, wo, active)[1]

    def eval_pdf(self, ctx, si, wo, active=True):
        return self.value_and_density(si.wi, wo, active)

    def traverse(self, callback):
        pass

    def to_string(self):
        return "Lobe[]"


class Sheet(mi.BSDF):
    """A sheet without thickness by tables over the angles of incidence and exit, bilinear in them, the same from both sides.

    `optics` is the JSON of a measured diffuser of a job document: rows are angles of incidence.
    """

    def __init__(self, properties):
        mi.BSDF.__init__(self, properties)
        optics = json.loads(str(properties["optics"]))
        self.incidence = [math.radians(angle) for angle in optics["incidence_deg"]]
        self.exit = [math.radians(angle) for angle in optics["exit_deg"]]
        size = (len(self.incidence), len(self.exit))
        through = np.array(optics["btdf_per_sr"], dtype=float)
        back = np.array(optics.get("brdf_per_sr", np.zeros(size)), dtype=float)
        assert through.shape == back.shape == size
        self.through, self.back = through.tolist(), back.tolist()
        flags = mi.BSDFFlags.GlossyReflection | mi.BSDFFlags.GlossyTransmission
        flags = flags | mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide
        self.m_components = [flags]
        self.m_flags = flags

    @staticmethod
    def hats(angles, x):
        """Shares that each of `angles` has in the value at `x`."""
        shares = []
        for k, angle in enumerate(angles):
            share = mi.Float(1)
            if k > 0:
                share = dr.minimum(share, (x - angles[k - 1]) / (angle - angles[k - 1]))
            if k + 1 < len(angles):
                share = dr.minimum(share, (angles[k + 1] - x) / (angles[k + 1] - angle))
            shares.append(dr.maximum(share, 0))
        return shares

    def value_and_density(self, wi, wo, active):
        cos_i, cos_o = mi.Frame3f.cos_theta(wi), mi.Frame3f.cos_theta(wo)
        # paths run backward: `wi` is where the light leaves, and a table need not be reciprocal
        rows = self.hats(self.incidence, dr.acos(dr.clip(dr.abs(cos_o), 0, 1)))
        columns = self.hats(self.exit, dr.acos(dr.clip(dr.abs(cos_i), 0, 1)))
        through, back = mi.Float(0), mi.Float(0)
        for i, row in enumerate(rows):
            for o, column in enumerate(columns):
                through += self.through[i][o] * row * column
                back += self.back[i][o] * row * column
        value = dr.select(cos_i * cos_o < 0, through, back) * dr.abs(cos_o)
        density = 0.5 * dr.abs(cos_o) / math.pi
        return mi.Spectrum(value) & active, dr.select(active, density, 0.0)

    def sample(self, ctx, si, sample1, sample2, active=True):
        wo = mi.warp.square_to_cosine_hemisphere(sample2)
        wo.z = dr.select(sample1 < 0.5, wo.z, -wo.z)
        value, density = self.value_and_density(si.wi, wo, active)
        return sampled(wo, density, mi.BSDFFlags.GlossyTransmission), (value / density) & (density > 0)

    def eval(self, ctx, si, wo, active=True):
        return self.value_and_density(si.wi, wo, active)[0]

    def pdf(self, ctx, si, wo, active=True):
        return self.value_and_density(si.wi, wo, active)[1]

    def eval_pdf(self, ctx, si, wo, active=True):
        return self.value_and_density(si.wi, wo, active)

    def traverse(self, callback):
        pass

    def to_string(self):
        return "Sheet[]"


def sampled(wo, density, flags):
    sample = dr.zeros(mi.BSDFSample3f)
    sample.wo, sample.pdf, sample.eta = wo, density, mi.Float(1)
    sample.sampled_type, sample.sampled_component = mi.UInt32(+flags), mi.UInt32(0)
    return sample


mi.register_bsdf("lobe", Lobe)
mi.register_bsdf("sheet", Sheet)
