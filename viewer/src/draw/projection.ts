// Points of a surface as a rasteriser needs them: where they are in the picture, and how light they are.
import {Matrix4, Vector3, type Camera, type PerspectiveCamera} from 'three';
import {stride, type Box, type Target} from './raster';
import type {Paint, Surface} from './scene';
import {fillLight, keyLight, lightOf} from './shades';

export const nothing: Box = {left: Infinity, top: Infinity, right: -Infinity, bottom: -Infinity};

export const everything = ({width, height}: Target): Box => ({left: 0, top: 0, right: width, bottom: height});

export function around(a: Box, b: Box): Box {
  return {left: Math.min(a.left, b.left), top: Math.min(a.top, b.top), right: Math.max(a.right, b.right), bottom: Math.max(a.bottom, b.bottom)};
}

/** The part of it that is in a picture, of whole pixels. */
export function inside({left, top, right, bottom}: Box, {width, height}: Target): Box {
  const within = (x: number, size: number): number => Math.min(size, Math.max(0, x));
  return {left: within(Math.floor(left), width), top: within(Math.floor(top), height), right: within(Math.ceil(right), width), bottom: within(Math.ceil(bottom), height)};
}

/** From places to pixels, to be divided by w. */
export function toTarget(camera: Camera, {width, height}: Target): Float64Array {
  camera.updateMatrixWorld();
  const seen = new Matrix4().multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse);
  const pixels = new Matrix4().set(width / 2, 0, 0, width / 2, 0, -height / 2, 0, height / 2, 0, 0, 1, 0, 0, 0, 0, 1);
  return Float64Array.from(pixels.multiply(seen).elements);
}

/** Fills `out`, `stride` numbers a point, and says where it all is, and whether some of it is nearer than the camera sees: behind. */
export function project(surface: Surface, paint: Paint | null, camera: Camera, target: Target, out: Float32Array): {box: Box; behind: boolean} {
  const {points, normals} = surface, count = points.length / 3, near = (camera as PerspectiveCamera).near, m = toTarget(camera, target);
  const [key, fill, up] = [keyLight, fillLight, [0, 1, 0] as const].map((light) => new Vector3(...light).transformDirection(camera.matrixWorld));
  const kx = key.x, ky = key.y, kz = key.z, fx = fill.x, fy = fill.y, fz = fill.z, ux = up.x, uy = up.y, uz = up.z;
  const keySize = Math.hypot(...keyLight), fillSize = Math.hypot(...fillLight);
  let left = Infinity, top = Infinity, right = -Infinity, bottom = -Infinity, behind = false;
  for (let i = 0, at = 0, o = 0; i < count; ++i, at += 3, o += stride) {
    const x = points[at], y = points[at + 1], z = points[at + 2], w = m[3] * x + m[7] * y + m[11] * z + m[15];
    const nx = normals[at], ny = normals[at + 1], nz = normals[at + 2];
    const k = keySize * (nx * kx + ny * ky + nz * kz), f = fillSize * (nx * fx + ny * fy + nz * fz), n = nx * ux + ny * uy + nz * uz;
    out[o + 3] = lightOf(k, f, n);
    out[o + 4] = lightOf(-k, -f, -n);
    if (!(w > near)) {
      out[o + 2] = 0;
      behind = true;
      continue;
    }
    const by = 1 / w, px = (m[0] * x + m[4] * y + m[8] * z + m[12]) * by, py = (m[1] * x + m[5] * y + m[9] * z + m[13]) * by;
    if (px < left) left = px;
    if (px > right) right = px;
    if (py < top) top = py;
    if (py > bottom) bottom = py;
    out[o] = px;
    out[o + 1] = py;
    out[o + 2] = by;
  }
  if (paint) {
    const {values, top: most} = paint, by = 255.9 / most;
    for (let i = 0, o = 5; i < count; ++i, o += stride) out[o] = Math.min(255.9, Math.max(0, values[i] * by));
  }
  return {box: behind ? everything(target) : {left, top, right: right + 1, bottom: bottom + 1}, behind};
}
