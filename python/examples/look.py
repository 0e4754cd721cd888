import kpsa

rig = kpsa.load("hello.yaml")
scene = rig.scene()  # one a thread
scene.set("upper.rotateZ", -60)
xyz = scene.points("column")  # float32 [V, 3], world space, metres
print(f"{len(xyz)} vertices, the first at {xyz[0]}")
