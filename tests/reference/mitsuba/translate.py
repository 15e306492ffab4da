"""From a job document to a scene of Mitsuba: the part of the document's language that the scenes here use."""

import json
import math
import os

import mitsuba as mi
import numpy as np

import daylight
import surfaces  # noqa: F401 (registers what scatters)

HERE = os.path.dirname(os.path.abspath(__file__))

DEFAULTS = {"floor": 0.2, "walls": 0.5, "ceiling": 0.7}

# faces reach out of the room, so that no ray slips through an edge; walls hardly above the ceiling, where the sky lights them
BEYOND = 0.05
ABOVE = 1e-3

# a diffuser that is an area light hangs so far below the ceiling, in metres
BELOW = 1e-4

# rays leave a surface this share of one metre and of their largest coordinate off it (Mitsuba's offset in single precision)
RAY_OFFSET = 1500 * 2.0**-24

# side of the white squares that stand for sensors, in metres
SENSOR = 2e-3

SIDES = 720

Transform = mi.ScalarTransform4f


def rgb(value):
    return {"type": "rgb", "value": list(value) if isinstance(value, list) else [value] * 3}


def colour(value):
    return np.array(value if isinstance(value, list) else [value] * 3, dtype=float)


def scattering(surface):
    """Both sides of a surface of a document."""
    diffuse, specular = colour(surface["reflectance"]), colour(surface.get("specular", 0))
    if not specular.any():
        front = {"type": "diffuse", "reflectance": rgb(diffuse.tolist())}
    elif surface.get("roughness", 0) > 0:
        front = {"type": "lobe", "diffuse": mi.ScalarColor3f(diffuse), "specular": mi.ScalarColor3f(specular),
                 "roughness": surface["roughness"]}
    else:
        # a weighted sum of two, each scaled up by its share
        share = float(specular.mean() / (specular + diffuse).mean())
        mirror = {"type": "conductor", "material": "none", "specular_reflectance": rgb((specular / share).tolist())}
        matt = {"type": "diffuse", "reflectance": rgb((diffuse / (1 - share)).tolist() if share < 1 else 0.0)}
        front = {"type": "blendbsdf", "weight": share, "a": matt, "b": mirror}
    return {"type": "twosided", "bsdf": front}


BLACK = {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": [0.0] * 3}}}


def quad(centre, normal, half_u, half_v, bsdf):
    """A rectangle of sides 2 `half_u` and 2 `half_v`; u lies level in walls and along x in level faces."""
    up = [0, 1, 0] if abs(normal[2]) > 0.5 else [0, 0, 1]
    frame = Transform().look_at(origin=centre, target=[c + n for c, n in zip(centre, normal)], up=up)
    return {"type": "rectangle", "to_world": frame @ Transform().scale([half_u, half_v, 1]), "bsdf": bsdf}


def faces(room, holes):
    """The six faces; the ceiling has round `holes` x, y, radius."""
    width, depth, height = room["size_m"]
    given = room.get("surfaces", {})

    def surface(name):
        general = "walls" if name.startswith("wall") else name
        return scattering(given.get(name) or given.get(general) or {"reflectance": DEFAULTS[general]})

    u, v, w = 0.5 * width + BEYOND, 0.5 * depth + BEYOND, 0.5 * (height + ABOVE)
    x, y, z = 0.5 * width, 0.5 * depth, w
    shapes = {
        "floor": quad([x, y, 0], [0, 0, 1], u, v, surface("floor")),
        "wall_south": quad([x, 0, z], [0, 1, 0], u, w, surface("wall_south")),
        "wall_north": quad([x, depth, z], [0, -1, 0], u, w, surface("wall_north")),
        "wall_west": quad([0, y, z], [1, 0, 0], v, w, surface("wall_west")),
        "wall_east": quad([width, y, z], [-1, 0, 0], v, w, surface("wall_east")),
    }
    if holes:
        shapes["ceiling"] = pierced(width, depth, height, holes, surface("ceiling"))
    else:
        shapes["ceiling"] = quad([x, y, height], [0, 0, -1], u, v, surface("ceiling"))
    return shapes


def pierced(width, depth, height, holes, bsdf):
    """The ceiling with round holes, each a polygon of `SIDES` sides on its circle; holes do not share an x. It is black from
    above: what leaves a dome downward would see it in the light of the sky.
    """
    points, triangles = [], []

    def point(x, y):
        points.append([x, y, height])
        return len(points) - 1

    def corners_of(a, b, c, d):
        triangles.extend([[a, b, c], [a, c, d]])

    def rectangle(x0, y0, x1, y1):
        corners_of(point(x0, y0), point(x0, y1), point(x1, y1), point(x1, y0))

    south, north = -BEYOND, depth + BEYOND
    done = -BEYOND
    for x, y, radius in sorted(holes):
        west, east = x - radius - 1e-3, x + radius + 1e-3
        assert west >= done
        rectangle(done, south, west, north)
        # each side of the hole is carried on to the southern or the northern edge of this strip
        corners = [(x + radius * math.cos(a), y + radius * math.sin(a)) for a in np.linspace(0, 2 * math.pi, SIDES + 1)]
        for k in range(SIDES):
            (x0, y0), (x1, y1) = corners[k], corners[k + 1]
            edge = north if k < SIDES // 2 else south
            corners_of(point(x0, y0), point(x1, y1), point(x1, edge), point(x0, edge))
        rectangle(west, south, x - radius, north)
        rectangle(x + radius, south, east, north)
        done = east
    rectangle(done, south, width + BEYOND, north)
    # normals point down
    below = {"type": "twosided", "below": bsdf["bsdf"], "above": BLACK["bsdf"]}
    return triangle_mesh("ceiling", points, triangles, below)


def dome(number, x, y, z, inner, collector):
    """Two hemispheres of glass, their rim black; smooth by their normals."""
    assert collector.get("absorption_per_m", 0) == 0
    index = collector["refractive_index"]
    outer = inner + collector["thickness_m"]
    # the inside of a surface is where its normal does not point
    glass = {"outer": (outer, {"int_ior": index, "ext_ior": 1.0}), "inner": (inner, {"int_ior": 1.0, "ext_ior": index})}
    rings, sides = 128, 512
    polar, turn = np.meshgrid(np.linspace(0, math.pi / 2, rings + 1), np.arange(sides) * 2 * math.pi / sides, indexing="ij")
    normals = np.stack([np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), np.cos(polar)], axis=-1).reshape(-1, 3)
    triangles = []

    def here(ring, side):
        return ring * sides + side % sides

    for ring in range(rings):
        for side in range(sides):
            a, b, c, d = here(ring, side), here(ring + 1, side), here(ring + 1, side + 1), here(ring, side + 1)
            triangles += [[a, b, c], [a, c, d]] if ring > 0 else [[a, b, c]]
    shapes = {}
    for name, (radius, indices) in glass.items():
        points = normals * radius + [x, y, z]
        shapes[f"dome_{number}_{name}"] = triangle_mesh(name, points, triangles, {"type": "dielectric", **indices}, normals)
    circle = [(math.cos(a), math.sin(a)) for a in np.linspace(0, 2 * math.pi, SIDES + 1)]
    points = [[x + radius * c, y + radius * s, z] for c, s in circle for radius in (inner, outer)]
    rim = [[2 * k + first, 2 * k + second, 2 * k + 3] for k in range(SIDES) for first, second in ((0, 1), (2, 0))]
    shapes[f"dome_{number}_rim"] = triangle_mesh("rim", points, rim, BLACK)
    return shapes


def triangle_mesh(name, points, triangles, bsdf, normals=None):
    properties = mi.Properties()
    properties["bsdf"] = mi.load_dict(bsdf)
    mesh = mi.Mesh(name, len(points), len(triangles), props=properties, has_vertex_normals=normals is not None)
    values = mi.traverse(mesh)
    values["vertex_positions"] = np.array(points, dtype=np.float32).ravel()
    values["faces"] = np.array(triangles, dtype=np.uint32).ravel()
    if normals is not None:
        values["vertex_normals"] = np.array(normals, dtype=np.float32).ravel()
    values.update()
    return mesh


UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001}


def placed(thing):
    """Frame of an object of the room: turned clockwise seen from above."""
    turn = Transform().rotate([0, 0, 1], -thing.get("rotation_deg", 0))
    return Transform().translate(thing["position_m"]) @ turn


def objects(room):
    shapes = {}
    for number, thing in enumerate(room.get("objects", [])):
        if thing["kind"] == "box":
            half = [0.5 * size for size in thing["size_m"]]
            frame = placed(thing) @ Transform().translate([0, 0, half[2]]) @ Transform().scale(half)
            shapes[f"object_{number}"] = {"type": "cube", "to_world": frame, "bsdf": scattering(thing["surface"])}
        else:
            (surface,) = thing["surfaces"].values()
            frame = placed(thing) @ Transform().scale(UNITS[thing["unit"]])
            shapes[f"object_{number}"] = {
                "type": "obj", "filename": os.path.join(HERE, thing["mesh"]), "face_normals": True,
                "to_world": frame, "bsdf": scattering(surface),
            }
    return shapes


def disc(x, y, z, radius, **more):
    """A level disc that looks down."""
    frame = Transform().translate([x, y, z]) @ Transform().rotate([1, 0, 0], 180) @ Transform().scale(radius)
    return {"type": "disk", "to_world": frame, **more}


def is_even_lamp(sky, tube):
    """Whether a diffuser's light is known in closed form.

    A mirror of reflectance 1 loses nothing and hands on a uniform luminance as it is; what the room sends up the pipe leaves
    it. So the sheet is a Lambertian lamp of the luminance transmittance x sky.
    """
    return sky["cie_type"] == 5 and tube["reflectance"] == 1 and tube["diffuser"]["kind"] == "lambertian"


def sheet(optics):
    return {"type": "sheet", "optics": json.dumps(optics)}


def even_table(transmittance, reflectance):
    """A Lambertian sheet as a table."""
    return {
        "incidence_deg": [0, 90], "exit_deg": [0, 90],
        "btdf_per_sr": [[transmittance / math.pi] * 2] * 2, "brdf_per_sr": [[reflectance / math.pi] * 2] * 2,
    }


def tubes(document):
    """Lamps, or pipes under the sky, and the holes of the ceiling."""
    sky, height = document["sky"], document["room"]["size_m"][2]
    shapes, holes, openings, transmittances = {}, [], [], set()
    for number, tube in enumerate(document["tubes"]):
        (x, y), radius = tube["centre_m"], 0.5 * tube["diameter_m"]
        (segment,) = tube["segments"]
        collector = tube.get("collector", {"kind": "open"})
        assert segment.get("tilt_deg", 0) == 0
        let_in = collector.get("transmittance", 1.0)
        diffuser = tube["diffuser"]
        if is_even_lamp(sky, tube):
            assert sky.get("direct_normal_illuminance_lux", 0) == 0
            luminance = colour(diffuser["transmittance"]) * let_in * sky["zenith_luminance_cd_m2"]
            reflectance = rgb(diffuser.get("reflectance", 0))
            shapes[f"tube_{number}"] = disc(
                x, y, height - BELOW, radius,
                bsdf={"type": "diffuse", "reflectance": reflectance},
                emitter={"type": "area", "radiance": rgb(luminance.tolist())},
            )
            continue
        top = height + segment["length_m"]
        if diffuser["kind"] in ("measured", "mixed"):
            # rays to the sky start off the sheet, and would see a shorter pipe
            top += RAY_OFFSET * (1 + max(height, x + radius, y + radius))
        mirror = {"type": "conductor", "material": "none", "specular_reflectance": rgb(tube["reflectance"])}
        shapes[f"pipe_{number}"] = {
            "type": "cylinder", "p0": [x, y, height], "p1": [x, y, top], "radius": radius, "flip_normals": True,
            "bsdf": mirror if tube["reflectance"] > 0 else BLACK,
        }
        holes.append((x, y, radius))
        openings += [x, y, top, radius]
        if collector["kind"] == "dielectric_dome":
            # a dome sends some of the room's light back: there must be no sheet whose share the sky has
            assert diffuser["kind"] == "open"
            shapes.update(dome(number, x, y, top, radius, collector))
        if diffuser["kind"] == "measured":
            shapes[f"sheet_{number}"] = disc(x, y, height, radius, bsdf=sheet(diffuser))
        elif diffuser["kind"] == "mixed":
            # the sheet stands under a sky that has the clear zone's share already
            assert diffuser["inner"] == "lambertian"
            let_in *= diffuser["clear_transmittance"]
            optics = even_table(
                diffuser["lambertian_transmittance"] / diffuser["clear_transmittance"],
                diffuser.get("lambertian_reflectance", 0),
            )
            shapes[f"sheet_{number}"] = disc(x, y, height, diffuser["lambertian_radius_m"], bsdf=sheet(optics))
        else:
            # nothing that a straight open pipe sends up comes back: the share that a clear sheet keeps may be the sky's
            assert diffuser["kind"] in ("clear", "open")
            let_in *= diffuser.get("transmittance", 1.0)
        transmittances.add(let_in)
    if holes:
        (transmittance,) = transmittances
        direction = daylight.sun_direction(sky, document["room"].get("rotation_deg", 0))
        shapes["daylight"] = {
            "type": "daylight", "cie_type": sky["cie_type"], "zenith_luminance": float(sky["zenith_luminance_cd_m2"]),
            "beam": float(sky["direct_normal_illuminance_lux"]), "transmittance": float(transmittance),
            "openings": " ".join(repr(number) for number in openings),
            **{f"sun_{axis}": value for axis, value in zip("xyz", direction)},
        }
    return shapes, holes


def sensors(document):
    """Points of all grids, row by row from the south-west."""
    width, depth, _ = document["room"]["size_m"]
    for grid in document.get("grids", []):
        columns, rows = grid["cells"]
        margin = grid.get("margin_m", 0.0)
        for row in range(rows):
            for column in range(columns):
                x = margin + (column + 0.5) * (width - 2 * margin) / columns
                y = margin + (row + 0.5) * (depth - 2 * margin) / rows
                yield x, y, grid["height_m"]


def scene(document):
    shapes, holes = tubes(document)
    room = document["room"]
    shapes.update(faces(room, holes))
    shapes.update(objects(room))
    white = {"type": "diffuse", "reflectance": rgb(1.0)}
    for number, (x, y, z) in enumerate(sensors(document)):
        shapes[f"sensor_{number}"] = quad([x, y, z + BELOW], [0, 0, 1], 0.5 * SENSOR, 0.5 * SENSOR, white)
    return mi.load_dict({"type": "scene", **shapes})


def film(width, height):
    return {"type": "hdrfilm", "width": width, "height": height, "rfilter": {"type": "box"}, "pixel_format": "rgb",
            "component_format": "float32"}


def meter(document):
    """One sensor that looks at all white squares: their luminance times pi is the illuminance."""
    points = list(sensors(document))
    meters = {
        f"meter_{number}": {"type": "radiancemeter", "origin": [x, y, z + BELOW + 1e-2], "direction": [0, 0, -1],
                            "film": film(1, 1)}
        for number, (x, y, z) in enumerate(points)
    }
    return mi.load_dict({"type": "batch", **meters, "film": film(len(points), 1)})


def camera(view):
    width, height = view["size_px"]
    frame = Transform().look_at(origin=view["eye_m"], target=view["look_at_m"], up=view.get("up", [0, 0, 1]))
    return mi.load_dict({
        "type": "perspective", "fov": view["vertical_fov_deg"], "fov_axis": "y", "near_clip": 1e-3, "far_clip": 100.0,
        "to_world": frame, "film": film(width, height), "sampler": {"type": "independent"},
    })
