// Marks into arrays of pixels: what the shader of gpu_materials.ts does.
import {cover, rimBegins, rimColour, selectedColour, selectedScale, type Marks} from './marks';
import {around, nothing, toTarget} from './projection';
import type {Box, Target} from './raster';
import type {Camera} from 'three';

/** How many pixels the widest of them reaches from its middle. */
const reachOf = (size: number): number => size * selectedScale / 2 + 1;

export interface Place {
  x: number;
  y: number;
  mark: number;
}

/** Where those marks are that are in front of the camera, and the pixels that they may take. */
export function placesOf(marks: Marks, points: Float32Array, camera: Camera, target: Target, ratio: number): {places: Place[]; box: Box} {
  const m = toTarget(camera, target), at = marks.places(points), reach = reachOf(marks.size * ratio), places: Place[] = [];
  let box = nothing;
  for (let mark = 0; mark < marks.marks.length; ++mark) {
    const [x, y, z] = [at[3 * mark], at[3 * mark + 1], at[3 * mark + 2]], w = m[3] * x + m[7] * y + m[11] * z + m[15];
    if (!(w > 0)) continue;
    const place = {x: (m[0] * x + m[4] * y + m[8] * z + m[12]) / w, y: (m[1] * x + m[5] * y + m[9] * z + m[13]) / w, mark};
    places.push(place);
    box = around(box, {left: place.x - reach, top: place.y - reach, right: place.x + reach, bottom: place.y + reach});
  }
  return {places, box};
}

export function stamp({width, height, colours}: Target, marks: Marks, places: readonly Place[], ratio: number): void {
  const step = (from: number, to: number, at: number): number => {
    const t = Math.min(1, Math.max(0, (at - from) / (to - from)));
    return t * t * (3 - 2 * t);
  };
  for (const {x, y, mark} of places) {
    const strong = mark === marks.emphasized, radius = marks.size * ratio * (strong ? selectedScale : 1) / 2, inner = strong ? selectedColour : marks.base;
    const soft = (marks.marks[mark].diamond ? Math.SQRT2 : 1) / radius;  // what a pixel is of the radius
    for (let row = Math.max(0, Math.floor(y - radius)); row < Math.min(height, y + radius); ++row) {
      for (let column = Math.max(0, Math.floor(x - radius)); column < Math.min(width, x + radius); ++column) {
        const across = Math.abs(column + 0.5 - x) / radius, down = Math.abs(row + 0.5 - y) / radius;
        const r = marks.marks[mark].diamond ? across + down : Math.sqrt(across * across + down * down);
        const alpha = (1 - step(1 - soft, 1, r)) * cover, rim = step(rimBegins - soft, rimBegins, r);
        if (alpha <= 0) continue;
        const p = row * width + column, behind = colours[p];
        let mixed = 255 << 24;
        for (let c = 0; c < 3; ++c) {
          const own = 255 * (inner[c] * (1 - rim) + rimColour[c] * rim), was = behind >>> 8 * c & 255;
          mixed |= Math.round(was + (own - was) * alpha) << 8 * c;
        }
        colours[p] = mixed;
      }
    }
  }
}
