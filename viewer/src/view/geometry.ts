// Arithmetic on points: bounds, the vertex under the pointer, places in the picture.
import {Box3, Vector3, type Camera} from 'three';
import type {Model} from '../data/model';

export function boundsOf(points: Float32Array): Box3 {
  const box = new Box3(), p = new Vector3();
  for (let i = 0; i < points.length; i += 3) {
    p.fromArray(points, i);
    if (Number.isFinite(p.x + p.y + p.z)) box.expandByPoint(p);
  }
  if (box.isEmpty()) box.set(new Vector3(-1, -1, -1), new Vector3(1, 1, 1));
  return box;
}

/** The vertex nearest to where a ray meets the surface first, or -1. x and y are -1 to 1. */
export function vertexUnder(model: Model, points: Float32Array, camera: Camera, x: number, y: number): number {
  const from = new Vector3().setFromMatrixPosition(camera.matrixWorld);
  const ray = new Vector3(x, y, 0.5).unproject(camera).sub(from).normalize();
  const a = new Vector3(), b = new Vector3(), c = new Vector3(), normal = new Vector3(), to = new Vector3();
  let nearest = Infinity, found = -1;
  for (const {triangles} of model.meshes) {
    for (let t = 0; t < triangles.length; t += 3) {
      a.fromArray(points, 3 * triangles[t]);
      b.fromArray(points, 3 * triangles[t + 1]).sub(a);
      c.fromArray(points, 3 * triangles[t + 2]).sub(a);
      normal.crossVectors(ray, c);
      const det = b.dot(normal);
      if (Math.abs(det) < 1e-20) continue;
      to.subVectors(from, a);
      const u = to.dot(normal) / det;
      if (u < 0 || u > 1) continue;
      to.cross(b);
      const v = ray.dot(to) / det;
      if (v < 0 || u + v > 1) continue;
      const distance = c.dot(to) / det;
      if (distance <= 0 || distance >= nearest) continue;
      nearest = distance;
      const weights = [1 - u - v, u, v];
      found = triangles[t + weights.indexOf(Math.max(...weights))];
    }
  }
  return found;
}

/** Where a place is in a picture of that size, in pixels from the upper left; null behind the camera. */
export function toPixels(place: Vector3, camera: Camera, width: number, height: number): {x: number; y: number} | null {
  const p = place.clone().project(camera);
  return p.z > 1 || p.z < -1 ? null : {x: (p.x + 1) / 2 * width, y: (1 - p.y) / 2 * height};
}
