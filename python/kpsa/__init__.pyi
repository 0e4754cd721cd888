"""Evaluates character rigs: YAML on glTF characters, exactly or by trained subspaces."""
import os
from typing import Any, Callable, Mapping, Optional, Sequence, Union, overload

import numpy as np
import numpy.typing as npt

__version__: str

class Error(RuntimeError):
    """What was asked for could not be done; file, line and node are those of the first problem. __cause__ is what a node's
    Python function raised, if that was it."""
    problems: list[Problem]
    file: str
    line: int
    node: str

class Problem:
    """One thing that is wrong."""
    kind: str  # "usage", "input", "evaluation", "failed check", "interrupted"
    file: str
    line: int  # counted from 1; 0: unknown
    column: int
    node: str
    message: str

class Control:
    """A plug that animators move, in the units of the rig's file."""
    name: str
    min: float
    max: float
    value: float  # at rest
    si: float  # metres, radians or seconds for one of the file's units

class Clip:
    name: str
    begin: float  # seconds
    end: float

class Mesh:
    name: str
    vertices: int
    stages: list[str]  # of its deformer stack
    stage_nodes: list[str]  # by stage: the node that computes it
    triangles: npt.NDArray[np.uint32]  # [N, 3]

class Plug:
    """An attribute of a node: "node.name", of an array "node.name[2]"."""
    name: str
    type: str  # "double", "int", "bool", "enum", "double3", "quaternion", "matrix", "points", "string", ...
    unit: str  # "", "length", "angle" or "time"
    doc: str
    output: bool  # computed; all others are set or driven
    structural: bool  # read when a plan is made
    array: bool
    elements: int  # of an array that are set or driven
    choices: list[str]  # of an enum

class Node:
    """A node of a rig's graph."""
    name: str
    type: str
    file: str  # where the rig writes it; "" for what the character brings
    line: int
    column: int
    plugs: list[Plug]

class Connection:
    source: str  # "squeeze.outValue"
    destination: str

class Verdict:
    """What SoftCache said of a frame."""
    hit: bool
    full_share: float  # of the full evaluation: 0 a hit, 1 a miss, a blend in between
    score: float  # the smaller, the more like the training
    reason: str

class TrainingReport:
    subspace: str  # the file that was written
    points: int
    cues: int
    modes: int
    held_out_rms: float  # metres
    held_out_max: float
    tolerance: float
    hit_rate: float  # expected of frames like those of the clips
    warning: str

class BenchReport:
    """Full against accelerated over the frames of clips; times are milliseconds a frame, errors metres between final points,
    misses included."""
    clips: list[str]
    frames: int
    hits: int
    blends: int  # all others are misses
    hit_rate: float
    most_frequent_reason: str  # of frames that are no hits
    full_ms: float
    accelerated_ms: float
    speedup: float  # misses included
    speedup_on_hits: float  # 0 where no frame hits
    error_rms: float
    error_max: float
    tolerance: float
    violation_rate: float
    beyond_tolerance: int  # accepted frames that are
    promise_kept: bool
    notes: list[str]

class GraphEdit:
    """The graph of a copy of a rig, within Rig.edited."""
    def add_node(self, type: str, name: str) -> None: ...
    def set(self, plug: str, value: Union[float, str, Sequence[float]]) -> None:
        """A number in the units of the rig's file, a choice, a text, or 3, 4 or 16 numbers."""
    def connect(self, source: str, destination: str) -> None:
        """As `connections:` of a rig. A plug that something drives takes the new source."""
    def disconnect(self, destination: str) -> None: ...
    def deform(self, mesh: str, node: str) -> None:
        """Puts a deformer at the end of a mesh's stack."""

class Rig:
    """A loaded rig. Immutable; threads may share it."""
    path: str
    fps: float
    controls: list[Control]
    clips: list[Clip]
    meshes: list[Mesh]  # those that are shown
    notes: list[str]
    is_accelerated: bool
    nodes: list[Node]  # of the graph, in the order of their creation; without clips and subspaces
    connections: list[Connection]
    def value(self, plug: str) -> Union[float, str, npt.NDArray[np.float64]]:
        """What a plug holds where nothing drives it: a number, an array, a matrix [4, 4] or a text."""
    def accelerated(self, subspace: str = "", *, tolerance: Optional[float] = None, violation_rate: Optional[float] = None,
                    stale_is_miss: bool = False) -> Rig:
        """The rig whose accelerated points come from subspaces ("": those that it names). tolerance: metres."""
    def train(self, subspace: str = "", *, entry: str = "", samples: Optional[int] = None, tolerance: Optional[float] = None,
              violation_rate: Optional[float] = None, clips: Sequence[str] = (), seed: int = 1, seconds: Optional[float] = None,
              threads: int = 0, paper: bool = False,
              progress: Optional[Callable[[str, float], Optional[bool]]] = None) -> TrainingReport:
        """Trains a subspace and writes it to a .kpsa file. progress(what, share) is called on the way; False cancels."""
    def bench(self, *, clips: Sequence[str] = (), runs: int = 5, threads: int = 1,
              progress: Optional[Callable[[int], Optional[bool]]] = None) -> BenchReport:
        """Full against accelerated, by turns, on clips (none: the rig's test clips). progress(frames) is called on the way;
        False cancels."""
    def edited(self, edit: Callable[[GraphEdit], Any]) -> Rig:
        """A rig like this one with a graph that edit(graph) has changed."""
    def scene(self) -> Scene:
        """A state of the rig, at rest."""

class Scene:
    """A state of a rig: a clip, a time, controls. Used by one thread at a time."""
    rig: Rig
    verdict: Verdict  # of the latest points() or values()
    def __init__(self, rig: Rig) -> None: ...
    def play(self, clip: Optional[str]) -> None:
        """Lets a clip drive the character; None: the rest pose."""
    def set_time(self, seconds: float) -> None: ...
    @overload
    def set(self, plug: str, value: float) -> None:
        """A control, or any other plug that may vary, in the units of the rig's file."""
    @overload
    def set(self, values: Mapping[str, float]) -> None: ...
    def reset(self) -> None:
        """All controls at rest."""
    def points(self, mesh: str, out: Optional[npt.NDArray[np.float32]] = None) -> npt.NDArray[np.float32]:
        """[V, 3], metres: "head_mesh", or up to a stage, "head_mesh@skin". Into `out`, if it is given."""
    def values(self, plug: str) -> Union[float, npt.NDArray[np.float64]]:
        """A number, an array of three or four, or a matrix [4, 4]."""
    def profile(self, seconds: Sequence[float]) -> list[dict[str, Any]]:
        """A dict a step (node, type, label, evaluations, points, milliseconds), dearest first."""
    def frames(self, seconds: Sequence[float], out: Optional[Mapping[str, npt.NDArray[np.float32]]] = None, *, threads: int = 0,
               progress: Optional[Callable[[int], Optional[bool]]] = None) -> dict[str, npt.NDArray[Any]]:
        """Frames of the clip that plays: float32 [T, V, 3] by mesh, and "verdicts", an array of (hit, full_share, score)."""

class Library:
    """The node types that rigs are made of."""
    def __init__(self) -> None: ...
    def add_plugin(self, path: str) -> None: ...
    def add_node(self, name: str, inputs: Optional[Mapping[str, Any]] = None,
                 outputs: Union[Mapping[str, str], Sequence[str], None] = None, compute: Optional[Callable[..., Any]] = None, *,
                 deformer: bool = False, doc: str = "") -> Callable[..., Any]:
        """A node type that a Python function computes: for prototypes, as it is slow, frames with it run on one thread, and no
        points that need it are trained. inputs: defaults by name (a number, three, four, a matrix [4, 4]); outputs: names, or kinds by
        name ("number", "vector", "quaternion", "matrix"). compute(**inputs) gives the output, a tuple of them or a dict; of a
        deformer, compute(points, **inputs) gives points [P, 3], or changes them and gives None. Without compute: a decorator."""
    def load(self, path: str, *, variant: Optional[str] = None, fps: Optional[float] = None, plugins: bool = True, trust: Sequence[str] = ...) -> Rig:
        """A rig (.yaml) or a character (.glb, .gltf, .vrm)."""

def load(path: Union[str, os.PathLike[str]], *, variant: Optional[str] = None, fps: Optional[float] = None, plugins: bool = True, trust: Sequence[Union[str, os.PathLike[str]]] = ...) -> Rig:
    """A rig (.yaml) or a character (.glb, .gltf, .vrm), with the standard node types."""
