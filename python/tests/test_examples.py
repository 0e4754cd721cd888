"""The examples, on the smallest rig; what they draw is drawn where matplotlib is there."""
import os
import pathlib
import runpy
import shutil
import sys

import pytest

import kpsa

EXAMPLES = pathlib.Path(__file__).resolve().parents[1] / "examples"
SCENES = pathlib.Path(os.environ["KPSA_SCENES"])


@pytest.fixture(scope="module")
def rig(tmp_path_factory):
    place = tmp_path_factory.mktemp("hello")
    for name in ("hello.yaml", "hello.glb"):
        shutil.copy(SCENES / "hello" / name, place)
    path = place / "hello.yaml"
    kpsa.load(path).train(samples=200)
    return path


def test_error_over_a_clip(rig):
    example = runpy.run_path(str(EXAMPLES / "error_over_a_clip.py"))
    seconds, largest, verdicts = example["errors"](kpsa.load(rig), "wave")
    assert len(seconds) == len(largest) == len(verdicts)
    assert largest[verdicts["hit"]].max() < 0.002


def test_what_a_control_moves(rig):
    reach = runpy.run_path(str(EXAMPLES / "what_a_control_moves.py"))["reach"](kpsa.load(rig))
    share, farthest = reach["upper.rotateZ"]
    assert 0 < share <= 1 and farthest > 0.01


@pytest.mark.parametrize("name, arguments", [("error_over_a_clip", ["wave"]), ("what_a_control_moves", [])])
def test_they_draw(rig, tmp_path, monkeypatch, name, arguments):
    pytest.importorskip("matplotlib")
    picture = tmp_path / "picture.png"
    monkeypatch.setattr(sys, "argv", [name, str(rig), *arguments, "-o", str(picture)])
    runpy.run_path(str(EXAMPLES / f"{name}.py"), run_name="__main__")
    assert picture.read_bytes()[:4] == b"\x89PNG"


def test_the_first_lines(rig, monkeypatch, capsys):
    monkeypatch.chdir(rig.parent)
    runpy.run_path(str(EXAMPLES / "look.py"), run_name="__main__")
    assert "794 vertices" in capsys.readouterr().out


def test_a_node_in_python(rig, monkeypatch, capsys):
    monkeypatch.chdir(rig.parent)
    runpy.run_path(str(EXAMPLES / "prototype_node.py"), run_name="__main__")
    assert "782 vertices breathe" in capsys.readouterr().out
