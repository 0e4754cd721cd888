"""The characters that bench/other_characters.py makes can be read, and their clips move them."""
import pathlib
import runpy
import sys

import numpy as np
import pytest

import kpsa

SCRIPT = pathlib.Path(__file__).resolve().parents[2] / "bench" / "other_characters.py"


def make(monkeypatch, *arguments):
    monkeypatch.setattr(sys, "argv", [str(SCRIPT), *map(str, arguments)])
    runpy.run_path(str(SCRIPT), run_name="__main__")


@pytest.mark.parametrize("name", ["quadruped", "face", "snake", "clothed", "cartoon", "arm", "machine"])
def test_all_kinds(tmp_path, monkeypatch, name):
    make(monkeypatch, tmp_path, 5, name)
    path = tmp_path / f"{name}.yaml"
    path.write_text(f"kpsa: 1\ncharacter: {name}.glb\n")
    rig = kpsa.load(path)
    scene = rig.scene()
    for clip in rig.clips:
        scene.play(clip.name)
        moved = 0.0
        for mesh in rig.meshes:
            scene.set_time(0)
            before = scene.points(mesh.name).copy()
            scene.set_time(1)
            after = scene.points(mesh.name)
            assert np.isfinite(after).all()
            moved = max(moved, float(np.abs(after - before).max()))
        assert moved > 1e-3, clip.name


def test_a_seed_gives_the_same_bytes(tmp_path, monkeypatch):
    for folder, seed in (("a", 5), ("b", 5), ("c", 6)):
        make(monkeypatch, tmp_path / folder, seed, "machine")
    a, b, c = ((tmp_path / folder / "machine.glb").read_bytes() for folder in "abc")
    assert a == b != c


def test_a_wrong_name_is_told(tmp_path, monkeypatch):
    with pytest.raises(SystemExit, match="there is no \"horse\", expected quadruped"):
        make(monkeypatch, tmp_path, 5, "horse")
