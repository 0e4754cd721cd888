"""The graph to walk, nodes that Python functions compute, and what errors say. KPSA_SCENES is the folder of bundled rigs."""
import concurrent.futures
import gc
import os
import pathlib
import shutil
import signal
import threading
import time
import weakref

import numpy as np
import pytest

import kpsa

SCENES = pathlib.Path(os.environ["KPSA_SCENES"])
MUSH = "  mush: {type: deltaMush, iterations: 10}\n"


@pytest.fixture
def folder(tmp_path):
    for name in ("hello.yaml", "hello.glb"):
        shutil.copy(SCENES / "hello" / name, tmp_path)
    return tmp_path


def load(folder, library=None, more=""):
    """The smallest rig with more nodes and connections, from line 9 on."""
    path = folder / "hello.yaml"
    text = path.read_text()
    assert MUSH in text
    path.write_text(text.replace(MUSH + "connections:\n", MUSH + more if more else MUSH + "connections:\n"))
    return (library or kpsa.Library()).load(str(path))


def test_the_graph_is_walked(folder):
    rig = load(folder)
    nodes = {node.name: node for node in rig.nodes}
    mush = nodes["mush"]
    assert mush.type == "deltaMush" and mush.file == str(folder / "hello.yaml") and mush.line == 8
    plugs = {plug.name: plug for plug in mush.plugs}
    assert plugs["iterations"].type == "int" and plugs["iterations"].structural and not plugs["iterations"].output
    assert plugs["outPoints"].output and plugs["outPoints"].array and plugs["outPoints"].doc
    assert plugs["space"].choices == ["world", "mesh"]
    assert {plug.name: plug.unit for plug in nodes["upper"].plugs}["rotate"] == "angle"
    assert nodes["upper"].file == "" and nodes["upper"].line == 0
    assert ("squeeze.outValue", "cage.points[4].x") in {(c.source, c.destination) for c in rig.connections}
    assert all(c.source.split(".")[0] in nodes for c in rig.connections)
    assert rig.meshes[0].stage_nodes[2] == "mush" and len(rig.meshes[0].stage_nodes) == 3
    assert rig.value("mush.iterations") == 10 and rig.value("mush.space") == "world"
    assert rig.value("squeeze.inputMax") == pytest.approx(-75)
    assert rig.value("cage.divisions").tolist() == [2, 5, 2]
    assert rig.value("upper.rotateZ") == 0 and rig.value("upper.rotate").shape == (3,)
    with pytest.raises(AttributeError):
        mush.name = "other"
    assert repr(mush) == "<Node mush deltaMush>" and "iterations int" in repr(plugs["iterations"])


def test_functions_compute_nodes(folder):
    library = kpsa.Library()
    seen = []

    @library.add_node("half", inputs={"input": 2.0, "shift": (0, 0, 1)}, outputs={"output": "number", "moved": "vector"})
    def half(input, shift):
        seen.append(threading.get_ident())
        return input / 2, shift + [input, 0, 0]

    library.add_node("turn", {"matrix": np.eye(4), "rotation": (0, 0, 0, 1)}, {"m": "matrix", "q": "quaternion"},
                     lambda matrix, rotation: {"m": matrix.T @ np.diag([1, 2, 3, 1]), "q": rotation})
    library.add_node("one", outputs=["output"], compute=lambda: 1)
    rig = load(folder, library, "  h: {type: half, input: upper.poseRotateZ}\n  t: {type: turn, matrix: upper.worldMatrix}\n"
               "  o: {type: one}\nconnections:\n  - o.output -> mush.envelope\n")
    scene = rig.scene()
    scene.set("upper.rotateZ", -60)
    assert scene.values("h.output") == pytest.approx(-30) and seen == [threading.get_ident()] * len(seen)
    assert scene.values("h.moved") == pytest.approx([-60, 0, 1])
    world = scene.values("upper.worldMatrix")
    assert scene.values("t.m") == pytest.approx(world.T @ np.diag([1, 2, 3, 1]))
    assert scene.values("t.q") == pytest.approx([0, 0, 0, 1])
    scene.values("h.output")  # what was read for the first time since has made another plan
    calls = len(seen)
    scene.values("h.output")
    assert len(seen) == calls, "nothing has changed"
    assert half(4, np.zeros(3))[0] == 2, "the decorator gives the function back"
    plain = rig.edited(lambda graph: graph.disconnect("mush.envelope")).scene()
    plain.set("upper.rotateZ", -60)
    assert (scene.points("column") == plain.points("column")).all()


def test_functions_deform(folder):
    library = kpsa.Library()
    library.add_node("push", {"by": 0.5}, deformer=True, compute=lambda points, by: points + [0, 0, by])

    @library.add_node("flatten", deformer=True)
    def flatten(points):
        points[:, 1] = 0

    plain = load(folder, library)
    rig = plain.edited(lambda graph: (graph.add_node("push", "up"), graph.deform("column", "up")))
    before = plain.scene().points("column")
    scene = rig.scene()
    assert scene.points("column") == pytest.approx(before + [0, 0, 0.5])
    scene.set("up.by", 0.25)
    assert scene.points("column") == pytest.approx(before + [0, 0, 0.25])
    flat = plain.edited(lambda graph: (graph.add_node("flatten", "f"), graph.deform("column", "f"))).scene()
    assert flat.points("column")[:, 1].max() == 0 and flat.points("column")[:, 0] == pytest.approx(before[:, 0])
    # Frames are evaluated on this thread, or refused
    scene.play("wave")
    seconds = np.arange(4) / rig.fps
    frames = scene.frames(seconds)
    assert (frames["column"] == scene.frames(seconds, threads=1)["column"]).all()
    with pytest.raises(kpsa.Error, match="one frame at a time: expected 0 or 1 threads, got 2") as error:
        scene.frames(seconds, threads=2)
    assert error.value.node == "up" and error.value.file.endswith("hello.yaml")
    # Points that do not need such a node are trained, others are not
    rig.train(str(folder / "some.kpsa"), samples=50)
    library.add_node("half", {"turn": 0}, ["output"], lambda turn: 0.5)
    driven = load(folder, library, "  half: {type: half}\nconnections:\n  - half.output -> mush.envelope\n")
    with pytest.raises(kpsa.Error, match="no points that need such a node are trained") as error:
        driven.train(str(folder / "no.kpsa"))
    assert error.value.node == "half" and not (folder / "no.kpsa").exists()


def test_what_functions_raise_is_told(folder):
    library = kpsa.Library()

    def divide(by):
        return 1 / by

    library.add_node("divide", {"by": 1}, ["output"], divide)
    library.add_node("wrong", {"what": 0}, {"output": "vector"},
                     lambda what: [[1, 2, 3], [1, 2], "text", None, {"put": 1}][int(what)])
    library.add_node("bad", deformer=True, compute=lambda points: points[1:])
    library.add_node("stop", {"now": 0}, ["output"], lambda now: signal.raise_signal(signal.SIGINT) if now else 0)
    rig = load(folder, library, "  d: {type: divide}\n  w: {type: wrong}\n  s: {type: stop}\n"
               "connections:\n  - d.output -> mush.envelope\n")
    scene = rig.scene()
    scene.points("column")
    scene.set("d.by", 0)
    for ask in (lambda: scene.points("column"), lambda: scene.values("d.output"), lambda: scene.frames([0.5]),
                lambda: scene.profile([0.5])):
        with pytest.raises(kpsa.Error, match=r'node "d" \(divide\): ZeroDivisionError: (float )?division by zero') as error:
            ask()
        assert error.value.node == "d" and error.value.line == 9 and error.value.file == str(folder / "hello.yaml")
        assert error.value.problems[0].kind == "evaluation"
        cause = error.value.__cause__
        assert isinstance(cause, ZeroDivisionError) and cause.__traceback__.tb_frame.f_code.co_name == "divide"
    scene.set("d.by", 1)
    scene.points("column")
    assert scene.values("w.output").tolist() == [1, 2, 3]
    for what, text in ((1, "output: expected 3 numbers, got 2"), (2, "expected numbers, got 'text'"), (3, "got"), (4, "output")):
        scene.set("w.what", what)
        with pytest.raises(kpsa.Error, match=text) as error:
            scene.values("w.output")
        assert error.value.node == "w"
    with pytest.raises(kpsa.Error, match=r"expected points of shape \(\d+, 3\)"):
        rig.edited(lambda graph: (graph.add_node("bad", "b"), graph.deform("column", "b"))).scene().points("column")
    scene.set("s.now", 1)
    with pytest.raises(KeyboardInterrupt):
        scene.values("s.output")


def test_declarations_are_checked(folder):
    library = kpsa.Library()
    with pytest.raises(kpsa.Error, match="kpsa itself has already"):
        library.add_node("deltaMush", outputs=["output"], compute=lambda: 0)
    with pytest.raises(ValueError, match="a: expected a number, three, four, or a matrix"):
        library.add_node("n", {"a": [1, 2]}, ["output"], lambda a: 0)
    with pytest.raises(ValueError, match='output: expected "number", "vector"'):
        library.add_node("n", {}, {"output": "points"}, lambda: 0)
    with pytest.raises(kpsa.Error, match="expected an output"):
        library.add_node("n", {"a": 1}, compute=lambda a: 0)
    with pytest.raises(TypeError, match="outputs: expected names"):
        library.add_node("n", outputs="output", compute=lambda: 0)
    with pytest.raises(TypeError, match="expected numbers"):
        library.add_node("n", {"a": "text"}, ["output"], lambda a: 0)
    library.add_node("n", outputs=["output"], compute=lambda: 0)
    with pytest.raises(kpsa.Error, match="which the program has already"):
        library.add_node("n", outputs=["output"], compute=lambda: 0)


def test_functions_are_let_go(folder):
    def compute():
        return 0

    alive = weakref.ref(compute)
    library = kpsa.Library()
    library.add_node("n", outputs=["output"], compute=compute)
    scene = load(folder, library, "  a: {type: n}\nconnections:\n").scene()
    scene.values("a.output")
    del compute, library
    gc.collect()
    assert scene.values("a.output") == 0 and alive() is not None
    del scene
    gc.collect()
    assert alive() is None


def test_functions_on_threads(folder):
    library = kpsa.Library()
    library.add_node("twice", {"input": 1.0}, ["output"], lambda input: 2 * input)
    rig = load(folder, library, "  a: {type: twice}\nconnections:\n  - a.output -> mush.envelope\n")

    def work(k):
        scene = rig.scene()
        values = []
        for i in range(50):
            scene.set("a.input", (k * 50 + i) / 1000)
            scene.points("column")
            values.append(scene.values("a.output"))
        return values

    with concurrent.futures.ThreadPoolExecutor(4) as pool:
        values = [value for some in pool.map(work, range(4)) for value in some]
    assert values == pytest.approx(np.arange(200) / 500)


def test_a_signal_ends_frames(folder):
    class Rang(Exception):
        pass

    def ring(*_):
        raise Rang

    scene = load(folder).scene()
    scene.play("wave")
    count = 40000
    out = {"column": np.empty((count, scene.rig.meshes[0].vertices, 3), np.float32)}
    out["column"][-1] = np.nan
    seconds = np.linspace(0, 1, count)
    before = signal.signal(signal.SIGALRM, ring)
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.1)
        with pytest.raises(Rang):
            scene.frames(seconds, out, threads=1)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
    assert np.isnan(out["column"][-1]).all(), "it has not waited for the last frame"


def test_a_signal_ends_the_way_to_a_late_time(folder):
    class Rang(Exception):
        pass

    def ring(*_):
        raise Rang

    rig = load(folder, more="  lag: {type: jiggle}\nconnections:\n")
    scene = rig.edited(lambda graph: graph.deform("column", "lag")).scene()
    scene.play("wave")
    late = 500000 / rig.fps
    scene.set_time(late)
    before = signal.signal(signal.SIGALRM, ring)
    try:
        for ask in (lambda: scene.points("column"), lambda: scene.values("upper.worldMatrix"),
                    lambda: scene.frames([late]), lambda: scene.profile([late])):
            signal.setitimer(signal.ITIMER_REAL, 0.1)
            begin = time.monotonic()
            with pytest.raises(Rang):
                ask()
            assert time.monotonic() - begin < 2, "it has not gone all the way"
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
    scene.set_time(0)
    assert np.isfinite(scene.points("column")).all()


def test_errors_of_every_kind_carry_file_line_and_node(folder):
    rig = load(folder)
    path = str(folder / "hello.yaml")
    scene = rig.scene()
    library = kpsa.Library()
    (folder / "cut.kpsa").write_text("nothing of the kind")
    (folder / "bad.yaml").write_text("kpsa: 1\ncharacter: hello.glb\nnodes:\n  a: {type: latice}\n")

    def edit(change):
        return lambda: rig.edited(change)

    cases = [  # what fails, and the file, line and node that it says
        (lambda: library.load(str(folder / "none.yaml")), str(folder / "none.yaml"), 0, ""),
        (lambda: library.load(str(folder / "bad.yaml")), str(folder / "bad.yaml"), 4, ""),
        (lambda: library.load(path, variant="none"), path, 0, ""),
        (lambda: library.add_plugin(path), path, 0, ""),
        (lambda: rig.accelerated("none.kpsa"), "none.kpsa", 0, ""),
        (lambda: rig.accelerated(str(folder / "cut.kpsa")), str(folder / "cut.kpsa"), 0, ""),
        (lambda: rig.accelerated(tolerance=-1), path, 0, ""),
        (lambda: rig.bench(), path, 0, ""),
        (lambda: rig.train(entry="none"), path, 0, ""),
        (lambda: rig.train(seconds=-1), path, 0, ""),
        (lambda: rig.train(clips=["none"]), path, 0, ""),
        (lambda: rig.train(str(folder / "none" / "x.kpsa")), None, 0, ""),
        (lambda: rig.train(str(folder / "no.kpsa"), samples=20, progress=lambda *_: False), path, 0, ""),
        (lambda: rig.value("mush.none"), path, None, ""),
        (lambda: rig.value("mush.outPoints"), path, None, "mush"),
        (lambda: scene.play("none"), path, 0, ""),
        (lambda: scene.set("none.x", 1), path, 0, ""),
        (lambda: scene.set("mush.envelope", 7), path, 8, "mush"),
        (lambda: scene.set("cage.points[0,2,0].x", 7), path, 6, "cage"),
        (lambda: scene.points("none"), path, 0, ""),
        (lambda: scene.points("column@none"), path, 0, ""),
        (lambda: scene.values("none.x"), path, 0, ""),
        (lambda: scene.values("mush.outPoints[0]"), path, 8, "mush"),
        (edit(lambda graph: graph.add_node("none", "x")), path, 0, "x"),
        (edit(lambda graph: graph.set("mush.envelope", 7)), path, 8, "mush"),
        (edit(lambda graph: graph.connect("mush.envelope", "cage.none")), path, 0, ""),
        (edit(lambda graph: graph.connect("squeeze.outValue", "squeeze.input")), path, 7, "squeeze"),
        (edit(lambda graph: graph.deform("column", "squeeze")), path, 7, "squeeze"),
        (edit(lambda graph: graph.deform("none", "mush")), path, None, None),
    ]
    for k, (ask, file, line, node) in enumerate(cases):
        with pytest.raises(kpsa.Error) as error:
            ask()
        first = error.value.problems[0]
        assert (error.value.file, error.value.line, error.value.node) == (first.file, first.line, first.node), k
        assert error.value.file and (file is None or error.value.file == file), (k, error.value)
        assert line is None or error.value.line == line, (k, error.value.line, error.value)
        assert node is None or error.value.node == node, (k, error.value.node, error.value)
        assert first.message in str(error.value), k
