"""The type stubs name what the module has, and no more."""
import ast
import pathlib

import kpsa

STUBS = ast.parse((pathlib.Path(kpsa.__file__).parent / "__init__.pyi").read_text())
SELDOM = {"problems", "file", "line", "node"}  # of instances of Error alone


def members(node):
    for item in node.body:
        if isinstance(item, ast.AnnAssign):
            yield item.target.id, None
        elif isinstance(item, ast.FunctionDef):
            arguments = item.args
            yield item.name, [a.arg for a in arguments.posonlyargs + arguments.args + arguments.kwonlyargs if a.arg != "self"]


def test_classes_are_those_of_the_module():
    classes = {node.name: node for node in STUBS.body if isinstance(node, ast.ClassDef)}
    assert set(classes) | {"load"} == set(kpsa.__all__)
    for name, node in classes.items():
        kind = getattr(kpsa, name)
        stub = dict(members(node))
        real = {m for m in vars(kind) if not m.startswith("_") and m != "pybind11"}
        if name == "Error":
            assert set(stub) == SELDOM
            continue
        assert {m for m in stub if not m.startswith("_")} == real, name
        for method, arguments in members(node):
            doc = getattr(kind, method).__doc__ or ""
            for argument in arguments or []:
                assert argument in doc, f"{name}.{method} has no argument {argument}"
