import kpsa

library = kpsa.Library()


@library.add_node("breathe", {"amount": 0.0}, deformer=True)
def breathe(points, amount):
    """points: float32 [V, 3], world space, metres; changed in place, or a new array is returned."""
    points[:, 2] *= 1 + amount


rig = library.load("hello.yaml")
rig = rig.edited(lambda graph: (graph.add_node("breathe", "chest"), graph.deform("column", "chest")))
scene = rig.scene()
before = scene.points("column").copy()
scene.set("chest.amount", 0.1)
after = scene.points("column")
print(f"{(before != after).any(axis=1).sum()} vertices breathe")
