"""Renders the job documents of this folder with Mitsuba 3 and stores the numbers beside them.

    python make.py [NAME ...]       all documents, or those named; writes NAME.result.json

Needs CPython 3.11, `pip install mitsuba==3.9.1 numpy` and libLLVM (Debian: libllvm19; DRJIT_LIBLLVM_PATH names the file where
it is not found; versions 14 and 15 fail on processors with AVX-512). Some twelve minutes of one core for all; THREADS takes more.

Every number is the mean of independent renders with seeds of their own; their spread is its standard error.
"""

import json
import os
import subprocess
import sys
import time

import drjit as dr
import mitsuba as mi
import numpy as np

HERE = os.path.dirname(os.path.abspath(__file__))

sys.dont_write_bytecode = True

RENDERS = 24

# paths of one sensor, and of one pixel, in one render; what the sun does takes more
PATHS = {"grid": 16384, "view": 512}
IN_THE_SUN = 2

BLOCK = 8

REC709_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])

# no path is cut: a roulette that has no bias ends them
INTEGRATOR = {"type": "path", "max_depth": -1, "rr_depth": 12}


def renders(scene, sensor, paths):
    """Luminance in cd/m2 of the film's pixels, top row first, by independent renders."""
    integrator = mi.load_dict(INTEGRATOR)
    for seed in range(RENDERS):
        # few paths at once: the film adds up in single precision
        parts = [
            np.array(mi.render(scene, sensor=sensor, integrator=integrator, spp=part, seed=seed * 1000 + k))
            for k, part in enumerate(split(paths))
        ]
        image = np.mean(parts, axis=0, dtype=float)
        yield image @ REC709_LUMINANCE if image.shape[-1] == 3 else image[..., 0]


def split(paths):
    return [4096] * (paths // 4096) or [paths]


def blocks(image):
    rows, columns = (size // BLOCK for size in image.shape)
    return image.reshape(rows, BLOCK, columns, BLOCK).mean(axis=(1, 3))


def numbers(values, unit):
    """Mean and standard error of each place, and of the mean of all places."""
    values = np.array(values)
    error = values.std(axis=0, ddof=1) / np.sqrt(len(values))
    whole = values.mean(axis=tuple(range(1, values.ndim)))
    return {
        unit: digits(values.mean(axis=0)),
        f"standard_error_{unit}": digits(error),
        f"mean_{unit}": digits(whole.mean()),
        f"mean_standard_error_{unit}": digits(whole.std(ddof=1) / np.sqrt(len(whole))),
    }


def digits(values):
    """Seven digits of each number."""
    return [digits(value) for value in values] if np.ndim(values) > 0 else float(f"{values:.7g}")


def variant(document):
    """Glass polarises; single precision, as there is no other on the Python package index."""
    domes = any(tube.get("collector", {}).get("kind") == "dielectric_dome" for tube in document["tubes"])
    return "llvm_ad_mono_polarized" if domes else "llvm_ad_rgb"


def make(name):
    with open(os.path.join(HERE, f"{name}.json")) as file:
        document = json.load(file)
    mi.set_variant(variant(document))
    dr.set_thread_count(int(os.environ.get("THREADS", "1")))
    import translate  # its classes belong to the variant

    begun = time.process_time()
    scene = translate.scene(document)
    effort = IN_THE_SUN if document["sky"]["direct_normal_illuminance_lux"] > 0 else 1
    paths = {kind: effort * number for kind, number in PATHS.items()}
    result = {
        "program": f"Mitsuba {mi.__version__}", "variant": mi.variant(), "integrator": INTEGRATOR,
        "renders": RENDERS, "seeds": f"1000 n + k: render n of {RENDERS} from 0 on, its k-th 4096 paths", "grids": [], "views": [],
    }
    grids = document.get("grids", [])
    if grids:
        found = [image[0] * np.pi for image in renders(scene, translate.meter(document), paths["grid"])]
        first = 0
        for grid in grids:
            columns, rows = grid["cells"]
            of_grid = [values[first : first + rows * columns].reshape(rows, columns) for values in found]
            first += rows * columns
            result["grids"].append({"name": grid["name"], "paths": paths["grid"], **numbers(of_grid, "lux")})
    for view in document.get("views", []):
        found = [blocks(image) for image in renders(scene, translate.camera(view), paths["view"])]
        result["views"].append({"name": view["name"], "paths": paths["view"], "block_px": BLOCK, **numbers(found, "cd_m2")})
    with open(os.path.join(HERE, f"{name}.result.json"), "w") as file:
        json.dump(result, file, indent=1)
        file.write("\n")
    for output in result["grids"] + result["views"]:
        unit = "lux" if "lux" in output else "cd_m2"
        relative = np.array(output[f"standard_error_{unit}"]) / np.maximum(output[unit], 1e-9)
        print(f"{name}, {output['name']}: mean {output[f'mean_{unit}']:.4g} +- {output[f'mean_standard_error_{unit}']:.2g}"
              f" {unit}, errors {100 * relative.min():.2f} to {100 * relative.max():.2f} %,"
              f" {time.process_time() - begun:.0f} s of CPU", flush=True)


def names():
    files = sorted(os.listdir(HERE))
    return [file[: -len(".json")] for file in files if file.endswith(".json") and not file.endswith(".result.json")]


if __name__ == "__main__":
    asked = sys.argv[1:] or names()
    if len(asked) == 1:
        make(asked[0])
    else:
        # a process has one variant
        for one in asked:
            subprocess.run([sys.executable, __file__, one], check=True)
