"""The module as a TD uses it. KPSA_SCENES is the folder of bundled rigs."""
import os
import pathlib
import shutil
import threading

import numpy as np
import pytest

import kpsa

SCENES = pathlib.Path(os.environ["KPSA_SCENES"])


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("hello")
    for name in ("hello.yaml", "hello.glb"):
        shutil.copy(SCENES / "hello" / name, place)
    return place


@pytest.fixture(scope="module")
def rig(folder):
    return kpsa.load(folder / "hello.yaml")


@pytest.fixture(scope="module")
def fast(rig):
    seen = []
    report = rig.train(samples=200, progress=lambda what, share: seen.append((what, share)))
    assert report.cues > 0 and report.points > 0 and 0 < report.hit_rate <= 1
    assert os.path.exists(report.subspace)
    assert len({what for what, _ in seen}) >= 3
    return rig.accelerated()


def test_bench(rig, fast):
    seen = []
    report = fast.bench(clips=["wave"], runs=1, progress=seen.append)
    scene = fast.scene()
    scene.play("wave")
    (clip,) = [c for c in rig.clips if c.name == "wave"]
    assert report.clips == ["wave"] and report.frames == round((clip.end - clip.begin) * rig.fps) + 1
    hits = scene.frames(clip.begin + np.arange(report.frames) / rig.fps)["verdicts"]["hit"]
    assert report.hits == hits.sum() and report.hit_rate == pytest.approx(hits.mean())
    assert report.full_ms > 0 and report.speedup == pytest.approx(report.full_ms / report.accelerated_ms)
    assert 0 < report.error_rms <= report.error_max and seen == sorted(seen) and seen
    assert report.promise_kept and report.beyond_tolerance <= report.violation_rate * report.frames
    raised = []

    def late(frames):  # while frames are timed
        if frames > report.frames:
            raised.append(frames)
            raise ZeroDivisionError(len(raised))

    with pytest.raises(ZeroDivisionError, match="1"):
        fast.bench(clips=["wave"], progress=late)
    assert len(raised) == 1
    with pytest.raises(kpsa.Error, match="wave"):
        fast.bench(clips=["wav"])


def test_what_a_rig_has(rig):
    assert [c.name for c in rig.controls] == ["upper.rotateX", "upper.rotateZ"]
    assert rig.controls[1].min == pytest.approx(-75)
    assert "wave" in [c.name for c in rig.clips]
    (mesh,) = rig.meshes
    assert mesh.triangles.dtype == np.uint32 and mesh.triangles.shape[1] == 3
    assert mesh.triangles.max() < mesh.vertices
    with pytest.raises(ValueError):
        mesh.triangles[0, 0] = 1
    assert kpsa.__version__


def test_sets_and_pulls(rig):
    scene = rig.scene()
    rest = scene.points("column")
    assert rest.dtype == np.float32 and rest.shape == (rig.meshes[0].vertices, 3)
    scene.set("upper.rotateZ", -60)
    bent = scene.points("column")
    assert np.abs(bent - rest).max() > 0.001
    assert scene.values("upper.rotateZ") == pytest.approx(-60)
    matrix = scene.values("upper.worldMatrix")
    assert matrix.shape == (4, 4) and matrix[3] == pytest.approx([0, 0, 0, 1])
    scene.reset()
    assert (scene.points("column") == rest).all()
    scene.set({"upper.rotateZ": -60, "upper.rotateX": 0})
    assert (scene.points("column") == bent).all()


def test_points_go_into_the_callers_buffer(rig):
    scene = rig.scene()
    out = np.empty((rig.meshes[0].vertices, 3), np.float32)
    assert scene.points("column", out) is out or np.shares_memory(scene.points("column", out), out)
    assert (out == scene.points("column")).all()
    with pytest.raises(ValueError, match="shape"):
        scene.points("column", np.empty((3, 3), np.float32))
    with pytest.raises(TypeError):
        scene.points("column", np.empty(out.shape, np.float64))


def test_errors_say_where(rig, tmp_path):
    (tmp_path / "bad.yaml").write_text("kpsa: 1\ncharacter: none.glb\nnodes:\n  a: {type: latice}\n")
    with pytest.raises(kpsa.Error) as error:
        kpsa.load(tmp_path / "bad.yaml")
    assert error.value.file.endswith("bad.yaml") and error.value.line == 2
    assert error.value.problems[0].kind == "input"
    scene = rig.scene()
    with pytest.raises(kpsa.Error, match="rotateZ"):
        scene.set("upper.rotatez", 1)
    with pytest.raises(kpsa.Error, match="did you mean"):
        scene.points("colum")
    with pytest.raises(kpsa.Error, match="no such file"):
        rig.accelerated("none.kpsa")


def test_rigs_name_files_of_trusted_folders(tmp_path, monkeypatch):
    monkeypatch.delenv("KPSA_TRUST", raising=False)
    (tmp_path / "rig").mkdir()
    path = tmp_path / "rig" / "rig.yaml"
    shutil.copy(SCENES / "hello" / "hello.glb", tmp_path / "hello.glb")
    path.write_text("kpsa: 1\ncharacter: ../hello.glb\n")
    with pytest.raises(kpsa.Error, match="leads out of the rig's folder.* trust ") as error:
        kpsa.load(path)
    assert error.value.line == 2
    assert kpsa.load(path, trust=[tmp_path]).meshes
    with pytest.raises(kpsa.Error, match="nowhere"):
        kpsa.load(path, trust=[tmp_path / "nowhere"])
    monkeypatch.setenv("KPSA_TRUST", str(tmp_path))
    assert kpsa.load(path).meshes


def test_frames_are_the_same_on_any_number_of_threads(fast):
    scene = fast.scene()
    scene.play("wave")
    seconds = np.arange(25) / fast.fps
    one, three = scene.frames(seconds, threads=1), scene.frames(seconds, threads=3)
    assert one["column"].shape == (25, fast.meshes[0].vertices, 3)
    assert (one["column"] == three["column"]).all()
    assert (one["verdicts"] == three["verdicts"]).all()
    assert one["verdicts"]["hit"].sum() > 12
    scene.set_time(seconds[7])
    assert (scene.points("column") == one["column"][7]).all()
    assert scene.verdict.hit == one["verdicts"]["hit"][7]
    out = {"column": np.empty_like(one["column"])}
    scene.frames(seconds, out)
    assert (out["column"] == one["column"]).all()


def test_plugins_add_node_types(folder):
    library = kpsa.Library()
    library.add_plugin(os.environ["KPSA_WOBBLE"])
    edited = library.load(str(folder / "hello.yaml")).edited(lambda graph: graph.add_node("wobble", "sway"))
    scene = edited.scene()
    scene.set("sway.input", 0.5)
    assert scene.values("sway.output") == pytest.approx(1)
    with pytest.raises(kpsa.Error, match="expected a shared library"):
        kpsa.Library().add_plugin(str(folder))


def test_graphs_are_edited_in_a_copy(rig):
    kept = []

    def edit(graph):
        kept.append(graph)
        graph.add_node("cluster", "lift")
        graph.set("mush.iterations", 3)
        graph.deform("column", "lift")

    edited = rig.edited(edit)
    assert edited.meshes[0].stages == ["skin", "cage", "mush", "lift"]
    assert rig.meshes[0].stages == ["skin", "cage", "mush"]
    with pytest.raises(ValueError, match="no longer"):
        kept[0].add_node("cluster", "late")
    with pytest.raises(kpsa.Error, match="did you mean"):
        rig.edited(lambda graph: graph.add_node("clutser", "x"))
    with pytest.raises(KeyError):
        rig.edited(lambda graph: {}["mine"])


def test_profiles_are_dicts(rig):
    scene = rig.scene()
    scene.play("wave")
    steps = scene.profile([0.1, 0.2, 0.3])
    (mush,) = [step for step in steps if step["node"] == "mush" and not step["label"]]
    assert mush["type"] == "deltaMush" and mush["evaluations"] == 3 and mush["points"] > 100
    assert [s["milliseconds"] for s in steps] == sorted((s["milliseconds"] for s in steps), reverse=True)


def test_progress_may_end_or_raise(rig, fast, tmp_path):
    scene = fast.scene()
    scene.play("wave")
    seconds = np.arange(25) / fast.fps
    seen = []
    scene.frames(seconds, threads=1, progress=lambda done: seen.append(done) or len(seen) < 3)
    assert seen == [1, 2, 3]

    def fail(*_):
        raise KeyError("mine")

    with pytest.raises(KeyError):
        scene.frames(seconds, progress=fail)
    with pytest.raises(KeyError):
        rig.train(str(tmp_path / "no.kpsa"), samples=50, progress=fail)
    with pytest.raises(kpsa.Error) as error:
        rig.train(str(tmp_path / "no.kpsa"), samples=50, progress=lambda *_: False)
    assert error.value.problems[0].kind == "interrupted"
    assert not (tmp_path / "no.kpsa").exists()


def test_scenes_on_threads_share_a_rig(rig):
    expected = rig.scene()
    expected.set("upper.rotateZ", -40)
    expected = expected.points("column")
    got = [None] * 4

    def work(k):
        scene = rig.scene()
        for angle in range(41):
            scene.set("upper.rotateZ", -angle)
            got[k] = scene.points("column")

    threads = [threading.Thread(target=work, args=(k,)) for k in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all((points == expected).all() for points in got)
