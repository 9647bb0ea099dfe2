"""Reads with other software what the binary wrote, and compares it with the binary's own reports.

usage: read_back.py HITHER FOLDER
"""

import json
import math
import subprocess
import sys
from pathlib import Path

import numpy
import OpenEXR
import PIL.Image
import trimesh

HITHER, FOLDER = sys.argv[1], Path(sys.argv[2])
NOTHING = 0xFFFFFFFF
WORLDS = ["office?n=2", "boxcity?parts=1", "clutter", "spheres"]


def hither(*arguments):
    done = subprocess.run([HITHER, *map(str, arguments)], capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"hither {' '.join(map(str, arguments))}: {done.stderr}")
    return json.loads(done.stdout) if "-" in arguments else None


def check(what, found, expected):
    if found != expected:
        sys.exit(f"{what}: found {found}, expected {expected}")


def check_world(spec):
    path = FOLDER / (spec.split("?")[0] + ".glb")
    hither("world", spec, "-o", path)
    info = hither("info", f"world:{spec}", "--json", "-")
    scene = trimesh.load_scene(path, process=False)
    shown = [scene.graph[node] for node in scene.graph.nodes_geometry]
    triangles = sum(len(scene.geometry[name].faces) for _, name in shown)
    check(f"{spec}: triangles in trimesh", triangles, info["triangles"])
    lower, upper = scene.bounds
    for corner, axis_values in (("min", lower), ("max", upper)):
        for ours, theirs in zip(info["bounds"][corner], axis_values):
            if not math.isclose(ours, theirs, rel_tol=1e-6, abs_tol=1e-4):
                sys.exit(f"{spec}: bounds {corner}: {theirs} in trimesh, {ours} in hither")
    # Read back by hither itself, it is the same scene.
    again = hither("info", path, "--json", "-")
    for count in ("triangles", "instances"):
        check(f"{spec}: {count} read back", again[count], info[count])
    names = lambda report, what: [entry["name"] for entry in report[what]]
    check(f"{spec}: cameras", names(again, "cameras"), names(info, "cameras"))
    check(f"{spec}: animations", names(again, "animations"), names(info, "animations"))
    print(f"{spec}: {triangles} triangles in {len(shown)} parts, the same in trimesh")


def check_pictures():
    exr_path, png_path = FOLDER / "view.exr", FOLDER / "view.png"
    arguments = ["render", "world:office?n=2", "--camera", "corridor", "--size", "160x90"]
    report = hither(*arguments, "-o", exr_path, "--json", "-")
    hither(*arguments, "-o", png_path)
    with OpenEXR.File(str(exr_path), separate_channels=True) as exr:
        channels = {name: channel.pixels for name, channel in exr.channels().items()}
    check("EXR channels", sorted(channels), sorted(["R", "G", "B", "A", "Z", "instance", "triangle"]))
    check("EXR size", channels["Z"].shape, (90, 160))
    check("EXR id type", channels["instance"].dtype, numpy.dtype("uint32"))
    seen = channels["instance"] != NOTHING
    frame = report["frames"][0]
    check("EXR pixels covered", int(seen.sum()), frame["pixels_covered"])
    check("EXR instances", len(numpy.unique(channels["instance"][seen])), frame["instances_seen"])
    check("EXR distance where there is nothing", bool(numpy.isinf(channels["Z"][~seen]).all()), True)
    check("EXR distance where there is something", bool(numpy.isfinite(channels["Z"][seen]).all()), True)

    picture = numpy.asarray(PIL.Image.open(png_path).convert("RGBA"), dtype=float) / 255
    opaque = (channels["A"] == 1) & (picture[..., 3] == 1)
    for i, name in enumerate("RGB"):
        linear = channels[name][opaque].astype(float).clip(0, 1)
        srgb = numpy.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
        worst = float(numpy.abs(srgb - picture[..., i][opaque]).max(initial=0))
        if worst > 0.51 / 255:
            sys.exit(f"PNG and EXR differ in {name} by {worst * 255:.2f} of 255")
    print(f"EXR and PNG: {int(seen.sum())} pixels covered, the same in OpenEXR and Pillow")


for world in WORLDS:
    check_world(world)
check_pictures()
