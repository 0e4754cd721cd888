#!/usr/bin/env python3
"""Characters of other kinds than bench_untouched makes, to try training on: glTF files with clips, from a seed.

    python3 bench/other_characters.py FOLDER SEED [NAME...]   # needs Debian's python3-numpy
    cd FOLDER && kpsa init face.glb -o face.yaml && kpsa train face.yaml && kpsa bench face.yaml

quadruped: four legs, neck, tail. face: 64 joints that shift a skin by millimetres, and a jaw. snake: a chain of 60 joints.
clothed: a body with shirt, skirt and hair, meshes of their own, and six shapes. cartoon: joints that are stretched and
squashed. arm: a close-up with five fingers, and ten shapes that follow the joints. machine: rigid parts without a skin.
"""
import argparse
import json
import struct
import sys
from pathlib import Path

import numpy as np

FPS = 30


class Glb:
    """A glTF document with one buffer (glTF 2.0, 4.4)."""

    TYPES = {1: "SCALAR", 3: "VEC3", 4: "VEC4", 16: "MAT4"}
    COMPONENTS = {"float32": 5126, "uint16": 5123, "uint32": 5125}

    def __init__(self):
        self.bytes = bytearray()
        self.json = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": []}]}
        for key in ("nodes", "meshes", "skins", "accessors", "bufferViews", "animations"):
            self.json[key] = []

    def accessor(self, values, bounds=False):
        values = np.ascontiguousarray(values)
        self.bytes += bytes(-len(self.bytes) % 4)
        self.json["bufferViews"].append({"buffer": 0, "byteOffset": len(self.bytes), "byteLength": values.nbytes})
        self.bytes += values.tobytes()
        width = 1 if values.ndim == 1 else values.shape[1]
        made = {"bufferView": len(self.json["bufferViews"]) - 1, "componentType": self.COMPONENTS[values.dtype.name],
                "count": len(values), "type": self.TYPES[width]}
        if bounds:
            made["min"] = np.atleast_1d(values.min(0)).tolist()
            made["max"] = np.atleast_1d(values.max(0)).tolist()
        self.json["accessors"].append(made)
        return len(self.json["accessors"]) - 1

    def save(self, path):
        self.json["buffers"] = [{"byteLength": len(self.bytes)}]
        document = {key: value for key, value in self.json.items() if value != []}
        text = json.dumps(document).encode()
        text += b" " * (-len(text) % 4)
        data = bytes(self.bytes) + bytes(-len(self.bytes) % 4)
        header = struct.pack("<4sII", b"glTF", 2, 28 + len(text) + len(data))
        path.write_bytes(header + struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(data), b"BIN\0") + data)


class Skeleton:
    """Joints by number; at rest all have the world's axes. Positions in metres."""

    def __init__(self):
        self.names, self.parents, self.places = [], [], []

    def add(self, name, parent, place):
        self.names.append(name)
        self.parents.append(parent)
        self.places.append(np.asarray(place, float))
        return len(self.names) - 1

    def chain(self, name, parent, start, end, count):
        joints = []
        for i in range(count):
            parent = self.add(f"{name}{i + 1}", parent, np.asarray(start, float) + (np.asarray(end, float) - start) * i / count)
            joints.append(parent)
        return joints

    def path(self, joints, *more):
        return [self.places[j] for j in joints] + [np.asarray(place, float) for place in more]

    def offset(self, joint):
        parent = self.parents[joint]
        return self.places[joint] - (self.places[parent] if parent >= 0 else 0)


def quaternion(axis, angle):
    """[n, 4] xyzw of angles [n] about an axis."""
    half = np.asarray(angle, float)[..., None] / 2
    return np.concatenate([np.sin(half) * np.asarray(axis, float), np.cos(half)], -1)


def product(a, b):
    """Of quaternions [n, 4]; b turns first."""
    v = np.cross(a[..., :3], b[..., :3]) + a[..., 3:] * b[..., :3] + b[..., 3:] * a[..., :3]
    w = a[..., 3:] * b[..., 3:] - (a[..., :3] * b[..., :3]).sum(-1, keepdims=True)
    return np.concatenate([v, w], -1)


def turned(x=0.0, y=0.0, z=0.0):
    """A rotation track of angles [n], about X first."""
    x, y, z = np.broadcast_arrays(*(np.asarray(angle, float) for angle in (x, y, z)))
    return {"rotation": product(product(quaternion([0, 0, 1], z), quaternion([0, 1, 0], y)), quaternion([1, 0, 0], x))}


class Motion:
    """Smooth random tracks of one clip."""

    def __init__(self, random, frames, knots):
        self.random, self.frames, self.knots = random, frames, knots
        self.time = np.arange(frames)

    def curve(self, reach, shape=(), knots=None):
        """[frames, *shape] about 0: a uniform cubic B-spline through random knots."""
        knots = knots or self.knots
        values = self.random.normal(size=(knots + 3, *shape)) * reach
        at = np.linspace(1, knots + 1, self.frames)
        k = np.minimum(at.astype(int), knots)
        f = (at - k).reshape((-1,) + (1,) * len(shape))
        a, b, c, d = values[k - 1], values[k], values[np.minimum(k + 1, knots + 2)], values[np.minimum(k + 2, knots + 2)]
        return ((-a + 3 * b - 3 * c + d) * f**3 / 6 + (3 * a - 6 * b + 3 * c) * f**2 / 6 + (c - a) * f / 2 + (a + 4 * b + c) / 6) * 1.6

    def turns(self, x, y, z, knots=None):
        return turned(*(self.curve(reach, knots=knots) for reach in (x, y, z)))


def tube(path, radii, along, around, closed=True):
    """A surface about a path, with round ends where it is closed: points [n, 3], triangles [m, 3]."""
    path, radii = np.asarray(path, float), np.asarray(radii, float)
    kept = [0] + [k for k in range(1, len(path)) if np.linalg.norm(path[k] - path[k - 1]) > 1e-6]
    path, radii = path[kept], radii[kept]
    at = np.linspace(0, len(path) - 1, along)
    k = np.minimum(at.astype(int), len(path) - 2)
    f = at - k
    middle = path[k] * (1 - f)[:, None] + path[k + 1] * f[:, None]
    ends = np.clip(np.minimum(np.arange(along), np.arange(along)[::-1]) / max(2, along * 0.06), 0, 1)
    radius = radii[k] * (1 - f) + radii[k + 1] * f
    if closed:
        radius *= np.sqrt(np.clip(1 - (1 - ends) ** 2, 0.02, 1))
    forward = np.gradient(middle, axis=0)
    forward /= np.linalg.norm(forward, axis=1)[:, None]
    aside = np.cross(forward, [0.0, 0, 1] if np.abs(forward[:, 2]).mean() < 0.8 else [1.0, 0, 0])
    aside /= np.linalg.norm(aside, axis=1)[:, None]
    angle = np.linspace(0, 2 * np.pi, around, endpoint=False)[None, :, None]
    ring = np.cos(angle) * aside[:, None] + np.sin(angle) * np.cross(forward, aside)[:, None]
    return (middle[:, None] + radius[:, None, None] * ring).reshape(-1, 3), sheet(along, around)


def ball(centre, radii, along, around):
    theta, phi = np.meshgrid(np.linspace(0.03, np.pi - 0.03, along), np.linspace(0, 2 * np.pi, around, endpoint=False), indexing="ij")
    unit = np.stack([np.sin(theta) * np.sin(phi), np.cos(theta), np.sin(theta) * np.cos(phi)], -1).reshape(-1, 3)
    return unit * radii + centre, sheet(along, around)


def sheet(along, around):
    """Triangles of a grid whose columns are closed."""
    index = np.arange(along * around).reshape(along, around)
    beside = np.roll(index, -1, 1)
    corners = [(index[:-1], beside[:-1], index[1:]), (beside[:-1], beside[1:], index[1:])]
    return np.concatenate([np.stack(three, -1).reshape(-1, 3) for three in corners])


def merged(parts):
    first = np.cumsum([0] + [len(points) for points, _ in parts])
    return np.concatenate([points for points, _ in parts]), np.concatenate([t + f for (_, t), f in zip(parts, first)])


def skinned(points, skeleton, joints, sharpness=4.0):
    """Four weights a point, by the distance to bones (from a joint to the middle of its children)."""
    distances = []
    for joint in joints:
        start = skeleton.places[joint]
        children = [skeleton.places[c] for c in joints if skeleton.parents[c] == joint]
        bone = np.mean(children, 0) - start if children else skeleton.offset(joint) * (skeleton.parents[joint] >= 0) / 2
        along = np.clip((points - start) @ bone / (bone @ bone + 1e-12), 0, 1)
        distances.append(np.linalg.norm(points - start - along[:, None] * bone, axis=1))
    distances = np.stack(distances, 1) + 1e-6
    return strongest(np.asarray(joints), (distances.min(1, keepdims=True) / distances) ** sharpness)


def strongest(joints, weights):
    """The four largest of weights [n, joints], of joints [joints] or [n, joints]: numbers and weights, for glTF."""
    order = np.argsort(-weights, 1, kind="stable")[:, :4]
    kept = np.take_along_axis(weights, order, 1)
    kept[kept < 0.02] = 0
    kept /= kept.sum(1, keepdims=True)
    numbers = np.take_along_axis(np.broadcast_to(joints, weights.shape), order, 1)
    numbers = np.where(kept > 0, numbers, numbers[:, :1])
    return numbers.astype(np.uint16), kept.astype(np.float32)


def write(path, skeleton, meshes, clips):
    """meshes: (name, (points, triangles), (joints, weights) or the joint that carries it, {shape: deltas});
    clips: {name: {joint, or name of a mesh: {track: values}}}, a key a frame."""
    glb = Glb()
    nodes = glb.json["nodes"]
    for joint, name in enumerate(skeleton.names):
        nodes.append({"name": name, "translation": skeleton.offset(joint).tolist()})
    for joint, parent in enumerate(skeleton.parents):
        children = nodes[parent].setdefault("children", []) if parent >= 0 else glb.json["scenes"][0]["nodes"]
        children.append(joint)
    bind = np.tile(np.eye(4, dtype=np.float32), (len(nodes), 1, 1))
    bind[:, 3, :3] = -np.asarray(skeleton.places)
    if any(not isinstance(skin, int) for _, _, skin, _ in meshes):
        glb.json["skins"].append({"joints": list(range(len(nodes))), "inverseBindMatrices": glb.accessor(bind.reshape(-1, 16))})
    at = {}
    for name, (points, triangles), skin, shapes in meshes:
        attributes = {"POSITION": glb.accessor(points.astype(np.float32), True)}
        node = {"name": name, "mesh": len(glb.json["meshes"])}
        if isinstance(skin, int):
            node["translation"] = (-skeleton.places[skin]).tolist()
            nodes[skin].setdefault("children", []).append(len(nodes))
        else:
            attributes |= {"JOINTS_0": glb.accessor(skin[0]), "WEIGHTS_0": glb.accessor(skin[1])}
            node["skin"] = 0
            glb.json["scenes"][0]["nodes"].append(len(nodes))
        primitive = {"attributes": attributes, "indices": glb.accessor(triangles.reshape(-1).astype(np.uint32))}
        mesh = {"name": name, "primitives": [primitive]}
        if shapes:
            primitive["targets"] = [{"POSITION": glb.accessor(d.astype(np.float32), True)} for d in shapes.values()]
            mesh |= {"extras": {"targetNames": list(shapes)}, "weights": [0.0] * len(shapes)}
        glb.json["meshes"].append(mesh)
        at[name] = len(nodes)
        nodes.append(node)
    for name, tracks in clips.items():
        animation = {"name": name, "channels": [], "samplers": []}
        for target, values in ((t, v) for t, of in tracks.items() for v in of.items()):
            kind, keys = values
            keys = np.asarray(keys, np.float32)
            times = glb.accessor((np.arange(len(keys)) / FPS).astype(np.float32), True)
            output = glb.accessor(keys.reshape(-1) if kind == "weights" else keys)
            animation["channels"].append({"sampler": len(animation["samplers"]), "target": {"node": at.get(target, target), "path": kind}})
            animation["samplers"].append({"input": times, "output": output, "interpolation": "LINEAR"})
        glb.json["animations"].append(animation)
    glb.save(path)


def quadruped(path, random):
    bones = Skeleton()
    root = bones.add("root", -1, [0, 1.2, 0])
    spine = bones.chain("spine", root, [0, 1.2, 0], [0, 1.3, 1], 5)
    neck = bones.chain("neck", spine[-1], [0, 1.35, 1.05], [0, 1.9, 1.5], 4)
    head = bones.add("head", neck[-1], [0, 1.95, 1.55])
    jaw = bones.add("jaw", head, [0, 1.88, 1.65])
    tail = bones.chain("tail", root, [0, 1.25, -0.1], [0, 0.7, -0.7], 7)
    legs = []
    for side, x in (("L", 0.22), ("R", -0.22)):
        legs.append(bones.chain(f"fore{side}", spine[-1], [x, 1.15, 0.95], [x, 0.02, 0.95], 4))
        legs.append(bones.chain(f"hind{side}", root, [x, 1.1, 0], [x, 0.02, -0.05], 4))
    parts = [tube(bones.path([]) + [bones.places[root] - [0, 0, 0.15]] + bones.path(spine, [0, 1.3, 1.1]), [0.2, 0.27, 0.28, 0.29, 0.28, 0.27, 0.2], 70, 44),
             tube(bones.path(neck + [head]), [0.18, 0.15, 0.13, 0.12, 0.11], 40, 30),
             tube([[0, 1.93, 1.49], [0, 1.87, 1.85]], [0.12, 0.07], 24, 26), tube(bones.path(tail, [0, 0.6, -0.8]), [0.05] * 7 + [0.02], 40, 14)]
    for leg in legs:
        top, foot = bones.places[leg[0]], bones.places[leg[-1]]
        parts.append(tube([top + [0, 0.1, 0]] + bones.path(leg, [foot[0], 0.02, foot[2] + 0.05]), [0.14, 0.15, 0.1, 0.065, 0.05, 0.055], 44, 22))

    def gait(frames, period, reach, phases, sway=0.2):
        motion, clip = Motion(random, frames, 6), {}
        t = motion.time / period * 2 * np.pi
        for k, (leg, phase) in enumerate(zip(legs, phases)):
            clip[leg[0]] = turned(reach * np.sin(t + phase), z=sway * motion.curve(0.2))
            clip[leg[1]] = turned(reach * 0.9 * (1 + np.sin(t + phase + 1.2)) * (1 if k % 2 else -0.9))
            clip[leg[2]] = turned(-reach * 0.8 * (1 + np.sin(t + phase + 1.9)))
            clip[leg[3]] = turned(reach * 0.6 * np.sin(t + phase + 2.4))
        for i, joint in enumerate(spine):
            clip[joint] = turned(0.06 * reach * np.sin(2 * t + i), sway * motion.curve(0.08) + 0.05 * np.sin(t), 0.03 * np.sin(t + i))
        for joint in neck + [head]:
            clip[joint] = motion.turns(0.12, 0.1, 0.06)
        clip[jaw] = turned(np.abs(motion.curve(0.2)))
        for i, joint in enumerate(tail):
            clip[joint] = turned(0.1 * np.sin(t - i / 2) + motion.curve(0.05), 0.2 * np.sin(0.7 * t - 0.6 * i) + motion.curve(0.08))
        clip[root] = turned(0.05 * np.sin(t), 0.03 * np.sin(t)) | {"translation": np.stack([0 * t, 1.2 + 0.04 * np.sin(2 * t), 0 * t], -1)}
        return clip

    pi = np.pi
    surface = merged(parts)
    write(path, bones, [("horse", surface, skinned(surface[0], bones, range(len(bones.names))), {})], {
        "walk": gait(180, 30, 0.35, [0, pi, pi / 2, 3 * pi / 2]), "trot": gait(150, 20, 0.5, [0, pi, pi, 0]),
        "graze": gait(200, 90, 0.15, [0, 1, 2, 3], 1), "canter": gait(150, 17, 0.6, [0, 2.5, 0.6, 3.1]), "gallop": gait(140, 15, 0.55, [0, 2.9, 0.4, 3.3])})


def face(path, random):
    bones = Skeleton()
    neck = bones.add("neck", -1, [0, 1.5, 0])
    head = bones.add("head", neck, [0, 1.6, 0.02])
    jaw = bones.add("jaw", head, [0, 1.6, 0.05])
    centre, radii, local = np.array([0, 1.68, 0.03]), np.array([0.085, 0.125, 0.1]), []
    for k in range(64):
        a, b = random.uniform(-1.1, 1.1), random.uniform(-0.8, 0.8)
        place = centre + radii * [np.sin(a) * np.cos(b), np.sin(b), np.cos(a) * np.cos(b)]
        local.append(bones.add(f"f{k:02d}", jaw if b < -0.35 else head, place))
    points, triangles = ball(centre, radii, 80, 110)
    nose = np.exp(-((points[:, 0] / 0.02) ** 2 + ((points[:, 1] - 1.67) / 0.03) ** 2)) * (points[:, 2] > 0)
    points[:, 2] += 0.02 * nose
    near = np.stack([np.exp(-((np.linalg.norm(points - bones.places[j], axis=1) / 0.022) ** 2)) for j in local], 1)
    base = np.where(points[:, 1:2] < 1.61, jaw, head)
    joints, weights = strongest(np.concatenate([base, np.tile(local, (len(points), 1))], 1), np.concatenate([np.full((len(points), 1), 0.25), near], 1))
    throat = tube([[0, 1.45, 0], [0, 1.58, 0.01]], [0.06, 0.06], 14, 40)
    share = np.clip((throat[0][:, 1] - 1.46) / 0.1, 0.02, 0.98)
    of_throat = strongest(np.array([neck, head, jaw, local[0]]), np.stack([1 - share, share, 0 * share, 0 * share], 1))
    expressions = random.normal(size=(12, len(local), 3)) * 0.004 * (random.random((12, len(local), 1)) < 0.35)

    def acting(frames, knots, reach, talk):
        motion, clip = Motion(random, frames, knots), {}
        active = np.abs(motion.curve(reach, (12,)))
        shifted = np.einsum("nk,kjd->njd", active, expressions) + motion.curve(0.0006, (len(local), 3))
        for i, joint in enumerate(local):
            clip[joint] = motion.turns(0.04, 0.04, 0.04) | {"translation": bones.offset(joint) + shifted[:, i]}
        clip[jaw] = turned(talk * np.abs(motion.curve(0.12, knots=2 * knots)), motion.curve(0.02))
        clip[head] = motion.turns(0.1, 0.2, 0.08, max(4, knots // 2))
        return clip

    write(path, bones, [("face", merged([(points, triangles), throat]), (np.concatenate([joints, of_throat[0]]), np.concatenate([weights, of_throat[1]])), {})], {
        "expressions": acting(240, 16, 1, 0.4), "talk": acting(200, 24, 0.5, 1.3), "range": acting(220, 12, 1.3, 0.8), "dialog": acting(180, 20, 0.7, 1)})


def snake(path, random):
    bones = Skeleton()
    joints = [bones.add("s0", -1, [0, 0, 0])]
    for i in range(1, 60):
        joints.append(bones.add(f"s{i}", joints[-1], [0, 0, i * 0.05]))
    surface = tube(bones.path(joints, [0, 0, 3.02]), [0.03] + [0.06 + 0.03 * np.sin(i / 59 * np.pi) for i in range(59)] + [0.01], 330, 36)

    def slither(frames, wave, reach, speed, coil=0.0):
        motion = Motion(random, frames, 6)
        t, i = motion.time[:, None], np.arange(60)[None]
        aside = reach * np.sin(2 * np.pi * (i / wave - t / speed)) + coil * np.clip(motion.curve(1, (1,), 4), -1.2, 1.2)
        up = 0.3 * reach * np.sin(2 * np.pi * (i / (1.7 * wave) - t / (1.3 * speed))) + motion.curve(0.02, (60,))
        return {joint: turned(up[:, k], aside[:, k]) for k, joint in enumerate(joints)}

    write(path, bones, [("snake", surface, skinned(surface[0], bones, joints), {})], {
        "slither": slither(200, 24, 0.12, 40), "fast": slither(160, 18, 0.15, 22), "coil": slither(200, 30, 0.06, 60, 0.06), "hunt": slither(180, 21, 0.13, 30, 0.03)})


def clothed(path, random):
    bones = Skeleton()
    hips = bones.add("hips", -1, [0, 1, 0])
    spine = bones.chain("spine", hips, [0, 1.05, 0], [0, 1.45, 0], 3)
    neck = bones.add("neck", spine[-1], [0, 1.5, 0])
    head = bones.add("head", neck, [0, 1.6, 0])
    limbs, fingers = [], []
    parts = [tube([[0, 0.9, 0], [0, 1, 0], [0, 1.2, 0], [0, 1.4, 0], [0, 1.5, 0]], [0.12, 0.15, 0.13, 0.16, 0.08], 60, 48),
             tube([[0, 1.48, 0], [0, 1.6, 0.01], [0, 1.72, 0.02], [0, 1.78, 0.02]], [0.06, 0.07, 0.1, 0.06], 44, 40)]
    for side, x in (("L", 1), ("R", -1)):
        limb, parent = {"x": x}, spine[-1]
        for name, place in (("clavicle", 0.05), ("upper", 0.18), ("fore", 0.45), ("twist", 0.57), ("hand", 0.7)):
            limb[name] = parent = bones.add(name + side, parent, [place * x, 1.42, 0])
        for f in range(5):
            fingers.append((x, bones.chain(f"finger{f}{side}_", limb["hand"], [0.78 * x, 1.42, 0.03 - 0.018 * f], [0.88 * x, 1.42, 0.035 - 0.021 * f], 3)))
            parts.append(tube([[0.77 * x, 1.42, 0.03 - 0.018 * f], [0.91 * x, 1.42, 0.036 - 0.0215 * f]], [0.011, 0.008], 18, 10))
        parent = hips
        for name, place in (("thigh", [0.1 * x, 0.95, 0]), ("shin", [0.1 * x, 0.52, 0]), ("foot", [0.1 * x, 0.1, 0]), ("toe", [0.1 * x, 0.03, 0.12])):
            limb[name] = parent = bones.add(name + side, parent, place)
        limbs.append(limb)
        parts += [tube([[p * x, 1.42, 0] for p in (0.1, 0.3, 0.45, 0.6, 0.75, 0.78)], [0.07, 0.06, 0.045, 0.04, 0.03, 0.04], 60, 24),
                  tube([[0.1 * x, p, 0] for p in (0.98, 0.75, 0.52, 0.3, 0.08)], [0.1, 0.09, 0.065, 0.06, 0.04], 60, 28),
                  tube([[0.1 * x, 0.06, -0.05], [0.1 * x, 0.04, 0.17]], [0.045, 0.035], 20, 20)]
    of_body, angles = list(range(len(bones.names))), np.arange(10) / 10 * 2 * np.pi
    skirt = [bones.chain(f"skirt{k}_", hips, [0.16 * np.sin(a), 0.92, 0.12 * np.cos(a)], [0.3 * np.sin(a), 0.45, 0.27 * np.cos(a)], 3) for k, a in enumerate(angles)]
    hair = [bones.chain(f"hair{k}_", head, [0.06 * np.sin(k), 1.72, -0.05 + 0.02 * np.cos(k)], [0.14 * np.sin(k), 1.35, -0.14], 4) for k in range(5)]
    body = merged(parts)
    sleeves = [tube([[p * x, 1.42, 0] for p in (0.1, 0.3, 0.45, 0.62)], [0.085, 0.075, 0.062, 0.06], 40, 30, closed=False) for x in (1, -1)]
    shirt = merged([tube([[0, 1, 0], [0, 1.2, 0], [0, 1.4, 0], [0, 1.48, 0]], [0.165, 0.145, 0.175, 0.1], 60, 60, closed=False)] + sleeves)
    cloth = tube([[0, 1, 0], [0, 0.9, 0], [0, 0.7, 0], [0, 0.45, 0]], [0.15, 0.18, 0.25, 0.31], 50, 80, closed=False)
    strands = merged([tube(bones.path(chain, [1.1 * bones.places[chain[-1]][0], 1.3, -0.15]), [0.03, 0.035, 0.03, 0.02, 0.01], 40, 16) for chain in hair])
    shapes = {}
    for k in range(6):
        middle = np.array([random.uniform(-0.06, 0.06), random.uniform(1.58, 1.72), 0.09])
        shapes[f"shape{k}"] = np.exp(-((body[0] - middle) ** 2).sum(1) / 0.02**2)[:, None] * random.normal(size=3) * 0.012

    def acting(frames, knots, reach, period):
        motion, clip = Motion(random, frames, knots), {}
        for limb in limbs:
            x, phase = limb["x"], 2 * np.pi * motion.time / period + (0 if limb["x"] > 0 else np.pi)
            clip[limb["clavicle"]] = motion.turns(0.03, 0.06, 0.08)
            clip[limb["upper"]] = turned(reach * motion.curve(0.3), reach * motion.curve(0.4), reach * motion.curve(0.5) - 0.6 * x)
            clip[limb["fore"]] = turned(y=-x * (0.5 + reach * np.abs(motion.curve(0.7))))
            clip[limb["twist"]] = turned(motion.curve(0.4 * reach))
            clip[limb["hand"]] = motion.turns(0.1 * reach, 0.3 * reach, 0.3 * reach)
            clip[limb["thigh"]] = turned(-0.45 * reach * np.sin(phase) + motion.curve(0.1), motion.curve(0.1), motion.curve(0.08))
            clip[limb["shin"]] = turned(0.4 * reach * (1 + np.sin(phase + 1.1)))
            clip[limb["foot"]] = turned(0.25 * reach * np.sin(phase + 2))
            clip[limb["toe"]] = turned(-0.2 * np.abs(np.sin(phase)))
        for x, finger in fingers:
            grip = np.abs(motion.curve(0.5))
            for k, joint in enumerate(finger):
                clip[joint] = turned(0, motion.curve(0.03), -x * grip * (0.6 + 0.3 * k) + motion.curve(0.02))
        for joint in spine + [neck, head]:
            clip[joint] = motion.turns(0.1 * reach, 0.15 * reach, 0.08 * reach)
        waves = motion.curve(0.12, (5,), 2 * knots), motion.curve(0.05, (5,), 2 * knots)
        for a, chain in zip(angles, skirt):  # neighbours swing alike, outwards and sideways
            around = np.array([1, np.cos(a), np.sin(a), np.cos(2 * a) / 2, np.sin(2 * a) / 2])
            out, aside = quaternion([np.cos(a), 0, -np.sin(a)], waves[0] @ around), quaternion([np.sin(a), 0, np.cos(a)], waves[1] @ around)
            clip |= {joint: {"rotation": product(out, aside)} for joint in chain}
        for chain in hair:
            clip |= dict.fromkeys(chain, motion.turns(0.15, 0.05, 0.1, 2 * knots))
        place = np.stack([motion.curve(0.1), 1 + 0.05 * np.sin(4 * np.pi * motion.time / period), motion.curve(0.1)], -1)
        clip[hips] = motion.turns(0.05, 0.5, 0.05) | {"translation": place}
        clip["body"] = {"weights": np.clip(np.abs(motion.curve(0.4, (6,), 2 * knots)), 0, 1)}
        return clip

    chains = {"skirt": [hips] + sum(skirt, []), "hair": [head] + sum(hair, [])}
    write(path, bones, [("body", body, skinned(body[0], bones, of_body, 5), shapes), ("shirt", shirt, skinned(shirt[0], bones, of_body, 3), {}),
                        ("skirt", cloth, skinned(cloth[0], bones, chains["skirt"], 3), {}), ("hair", strands, skinned(strands[0], bones, chains["hair"]), {})], {
        "walk": acting(200, 8, 0.6, 32), "dance": acting(300, 18, 1, 24), "idle": acting(200, 6, 0.4, 90), "act": acting(240, 12, 0.8, 48), "perform": acting(220, 12, 0.75, 40)})


def cartoon(path, random):
    bones = Skeleton()
    base = bones.add("base", -1, [0, 0, 0])
    body = bones.chain("b", base, [0, 0.1, 0], [0, 1, 0], 4)
    arms = [bones.chain(f"arm{side}", body[2], [0.25 * x, 0.75, 0], [0.8 * x, 0.6, 0], 4) for side, x in (("L", 1), ("R", -1))]
    surface = merged([tube([[0, y, 0] for y in (0, 0.3, 0.7, 1, 1.2)], [0.2, 0.35, 0.33, 0.3, 0.15], 90, 64)] +
                     [tube(bones.path(arm, [0.9 * x, 0.57, 0]), [0.1, 0.08, 0.07, 0.07, 0.09], 60, 28) for arm, x in zip(arms, (1, -1))])

    def acting(frames, knots, reach):
        motion, clip = Motion(random, frames, knots), {}

        def grown(axis, by):
            size = np.exp(motion.curve(by * reach))
            return {"scale": np.stack([size if a == axis else 1 / np.sqrt(size) for a in range(3)], -1)}

        for joint in body:
            clip[joint] = motion.turns(0.2 * reach, 0.2 * reach, 0.2 * reach) | grown(1, 0.15)
        for joint in arms[0] + arms[1]:
            clip[joint] = motion.turns(0.2, 0.35 * reach, 0.35 * reach) | grown(0, 0.12)
        clip[base] = {"translation": np.abs(motion.curve(0.3, (1,))) * [0, 1, 0]}
        return clip

    write(path, bones, [("cartoon", surface, skinned(surface[0], bones, range(len(bones.names)), 3), {})], {
        "bounce": acting(200, 14, 1), "idle": acting(150, 6, 0.5), "jump": acting(180, 20, 1.1), "run": acting(160, 16, 0.9)})


def arm(path, random):
    bones = Skeleton()
    parent, joints = -1, {}
    for name, x in (("shoulder", 0), ("upper", 0.05), ("fore", 0.35), ("twist", 0.5), ("hand", 0.63)):
        joints[name] = parent = bones.add(name, parent, [x, 0, 0])
    fingers = [bones.chain(f"f{k}_", parent, [0.71, 0, 0.035 - 0.02 * k], [0.81, 0, 0.04 - 0.023 * k], 3) for k in range(4)]
    fingers.append(bones.chain("thumb", parent, [0.67, -0.01, 0.04], [0.72, -0.02, 0.09], 3))
    tips = [bones.places[f[-1]] + 0.6 * (bones.places[f[-1]] - bones.places[f[0]]) for f in fingers]
    surface = merged([tube([[x, 0, 0] for x in (-0.05, 0.05, 0.2, 0.35, 0.45, 0.6, 0.7)], [0.08, 0.075, 0.07, 0.05, 0.055, 0.035, 0.045], 150, 80)] +
                     [tube(bones.path(finger, tip), [0.012, 0.011, 0.01, 0.007], 50, 24) for finger, tip in zip(fingers, tips)])
    points, shapes = surface[0], {}
    out = points * [0, 1, 1]
    out /= np.linalg.norm(out, axis=1)[:, None].clip(1e-3)
    for k in range(10):
        middle = points[random.integers(150 * 80)]
        shapes[f"muscle{k}"] = np.exp(-((points - middle) ** 2).sum(1) / 0.05**2)[:, None] * out * 0.012
    drive = random.normal(size=(10, 4))

    def acting(frames, knots, reach):
        motion, clip = Motion(random, frames, knots), {}
        bend, twist = np.clip(0.9 + motion.curve(0.7 * reach), 0, 2.2), motion.curve(0.5 * reach)
        lift, aside = motion.curve(0.4 * reach), motion.curve(0.4 * reach)
        clip[joints["upper"]] = turned(motion.curve(0.3 * reach), lift, aside)
        clip[joints["fore"]] = turned(y=-bend)
        clip[joints["twist"]] = turned(twist)
        clip[joints["hand"]] = motion.turns(0.1, 0.4 * reach, 0.35 * reach)
        for finger in fingers:
            grip = np.clip(0.4 + motion.curve(0.5 * reach), -0.1, 1.4)
            for k, joint in enumerate(finger):
                clip[joint] = turned(0, motion.curve(0.03), -grip * (0.8 + 0.2 * k))
        clip["arm"] = {"weights": 1 / (1 + np.exp(-2 * np.stack([bend - 0.9, twist, lift, aside], -1) @ drive.T))}
        return clip

    write(path, bones, [("arm", surface, skinned(points, bones, range(len(bones.names)), 6), shapes)], {
        "flex": acting(200, 10, 1), "reach": acting(200, 8, 0.8), "fist": acting(180, 14, 1), "throw": acting(150, 10, 0.9)})


def machine(path, random):
    bones = Skeleton()
    base = bones.add("base", -1, [0, 1, 0])
    meshes, legs = [("hull", ball(np.array([0, 1, 0]), np.array([0.5, 0.25, 0.5]), 40, 60), base, {})], []
    for k in range(6):
        out = np.array([np.sin(k / 3 * np.pi), 0, np.cos(k / 3 * np.pi)])
        leg = [bones.add(f"leg{k}_0", base, out * 0.4 + [0, 1, 0])]
        leg.append(bones.add(f"leg{k}_1", leg[0], out * 0.8 + [0, 1.1, 0]))
        leg.append(bones.add(f"leg{k}_2", leg[1], out * 1.1 + [0, 0.5, 0]))
        ends = bones.path(leg[1:], bones.places[leg[2]] - [0, 0.5, 0])
        meshes += [(f"part{k}_{i}", tube([bones.places[j], end], [0.08 - 0.02 * i, 0.06 - 0.02 * i], 24, 20), j, {}) for i, (j, end) in enumerate(zip(leg, ends))]
        legs.append(leg)

    def march(frames, period, reach):
        motion, clip = Motion(random, frames, 6), {}
        t = motion.time / period * 2 * np.pi
        for k, leg in enumerate(legs):
            phase = k % 2 * np.pi
            lift = 0.3 * reach * np.maximum(0, np.cos(t + phase))
            clip[leg[0]] = turned(y=0.4 * reach * np.sin(t + phase))
            clip[leg[1]] = turned(lift * np.cos(k), 0, lift * np.sin(k))
            clip[leg[2]] = motion.turns(0.05, 0.05, 0.05)
        clip[base] = {"translation": np.stack([motion.curve(0.1), 1 + 0.03 * np.sin(2 * t), 0.01 * motion.time], -1)}
        return clip

    write(path, bones, meshes, {"march": march(120, 30, 1), "run": march(100, 18, 1.2), "turn": march(110, 24, 1.1)})


KINDS = {made.__name__: made for made in (quadruped, face, snake, clothed, cartoon, arm, machine)}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("seed", type=int)
    parser.add_argument("names", nargs="*", metavar="name", help="of " + ", ".join(KINDS))
    asked = parser.parse_args()
    unknown = [name for name in asked.names if name not in KINDS]
    if unknown:
        sys.exit(f"other_characters.py: there is no \"{unknown[0]}\", expected {', '.join(KINDS)}")
    asked.folder.mkdir(parents=True, exist_ok=True)
    for number, (name, make) in enumerate(KINDS.items()):
        if not asked.names or name in asked.names:
            make(asked.folder / f"{name}.glb", np.random.default_rng([asked.seed, number]))


if __name__ == "__main__":
    main()
