"""Evaluates character rigs: YAML on glTF characters, exactly or by trained subspaces."""
import os
from typing import Any, Callable, Mapping, Optional, Sequence, Union, overload

import numpy as np
import numpy.typing as npt

__version__: str

class Error(RuntimeError):
    """What was asked for could not be done; file, line and node are those of the first problem."""
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
    triangles: npt.NDArray[np.uint32]  # [N, 3]

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

class GraphEdit:
    """The graph of a copy of a rig, within Rig.edited."""
    def add_node(self, type: str, name: str) -> None: ...
    def set(self, plug: str, value: Union[float, str, Sequence[float]]) -> None:
        """A number in the units of the rig's file, a choice, a text, or 3, 4 or 16 numbers."""
    def connect(self, source: str, destination: str) -> None:
        """A plug that something drives takes the new source."""
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
    def accelerated(self, subspace: str = "", *, tolerance: Optional[float] = None, violation_rate: Optional[float] = None,
                    stale_is_miss: bool = False) -> Rig:
        """The rig whose accelerated points come from subspaces ("": those that it names). tolerance: metres."""
    def train(self, subspace: str = "", *, entry: str = "", samples: Optional[int] = None, tolerance: Optional[float] = None,
              violation_rate: Optional[float] = None, clips: Sequence[str] = (), seed: int = 1, seconds: Optional[float] = None,
              threads: int = 0, paper: bool = False,
              progress: Optional[Callable[[str, float], Optional[bool]]] = None) -> TrainingReport:
        """Trains a subspace and writes it to a .kpsa file. progress(what, share) is called on the way; False cancels."""
    def edited(self, edit: Callable[[GraphEdit], Any]) -> Rig:
        """A rig like this one with a graph that edit(graph) has changed."""
    def scene(self) -> Scene:
        """A state of the rig, at rest."""

class Scene:
    """A state of a rig: a clip, a time, controls. Used by one thread at a time."""
    rig: Rig
    verdict: Verdict  # of the latest points()
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
    def load(self, path: str, *, variant: Optional[str] = None, fps: Optional[float] = None, plugins: bool = True) -> Rig:
        """A rig (.yaml) or a character (.glb, .gltf, .vrm)."""

def load(path: Union[str, os.PathLike[str]], *, variant: Optional[str] = None, fps: Optional[float] = None, plugins: bool = True) -> Rig:
    """A rig (.yaml) or a character (.glb, .gltf, .vrm), with the standard node types."""
