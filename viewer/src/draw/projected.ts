// A surface as a rasteriser takes it: its points in the picture, and its triangles, those that reach behind the eye cut off before it.
import type {Camera, PerspectiveCamera} from 'three';
import {nothing, project, toTarget} from './projection';
import {stride, type Box, type Target} from './raster';
import type {Paint, Scene, Surface} from './scene';

export interface Part {
  mesh: number;
  vertices: Float32Array;
  triangles: Uint32Array;
}

export class Projected {
  vertices = new Float32Array();
  parts: Part[] = [];
  box: Box = nothing;

  take({meshes}: Scene, surface: Surface, paint: Paint | null, camera: Camera, target: Target): void {
    const size = stride * surface.points.length / 3;
    if (this.vertices.length !== size) this.vertices = new Float32Array(size);
    const {vertices} = this, {box, behind} = project(surface, paint, camera, target, vertices);
    this.box = box;
    this.parts = meshes.map(({triangles}, mesh) => ({mesh, vertices, triangles}));
    if (behind) this.parts.push(...meshes.map(({triangles}, mesh) => ({mesh, ...cut(surface.points, vertices, triangles, camera, target)})));
  }
}

/** What is before the eye of the triangles that are on both sides of it, which are not drawn otherwise. */
function cut(points: Float32Array, vertices: Float32Array, triangles: Uint32Array, camera: Camera, target: Target): Omit<Part, 'mesh'> {
  const m = toTarget(camera, target), near = (camera as PerspectiveCamera).near, all: number[] = [], corners: number[] = [];
  const isSeen = (v: number): boolean => vertices[stride * v + 2] > 0;
  const at = (v: number): number[] => [0, 1, 3].map((row) => m[row] * points[3 * v] + m[row + 4] * points[3 * v + 1] + m[row + 8] * points[3 * v + 2] + m[row + 12]);
  for (let t = 0; t + 2 < triangles.length; t += 3) {
    const seen = [0, 1, 2].filter((c) => isSeen(triangles[t + c])).length, first = all.length / stride;
    if (seen === 0 || seen === 3) continue;
    for (let c = 0; c < 3; ++c) {
      const a = triangles[t + c], b = triangles[t + (c + 1) % 3];
      if (isSeen(a)) all.push(...vertices.subarray(stride * a, stride * a + stride));
      if (isSeen(a) === isSeen(b)) continue;
      const [xa, ya, wa] = at(a), [xb, yb, wb] = at(b), share = (near - wa) / (wb - wa), mixed = (from: number, to: number): number => from + share * (to - from);
      all.push(mixed(xa, xb) / near, mixed(ya, yb) / near, 1 / near, ...[3, 4, 5].map((i) => mixed(vertices[stride * a + i], vertices[stride * b + i])));
    }
    for (let last = first + 2; last < all.length / stride; ++last) corners.push(first, last - 1, last);
  }
  return {vertices: Float32Array.from(all), triangles: Uint32Array.from(corners)};
}
