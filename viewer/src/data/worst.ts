// Where and when a report's error is largest.
import type {ClipInfo} from './meta';
import type {Model} from './model';
import {rowOf} from './residual';

export interface WorstFrame {
  clip: number;
  frame: number;
  metres: number;
}

/** Of all clips; null where no error is known, or all are 0. */
export function worstFrame(clips: readonly ClipInfo[]): WorstFrame | null {
  let worst: WorstFrame | null = null;
  clips.forEach(({max_error: errors}, clip) => errors?.forEach((metres, frame) => {
    if (typeof metres === 'number' && metres > (worst?.metres ?? 0)) worst = {clip, frame, metres};
  }));
  return worst;
}

/** The root of the mean square over all frames of all clips, metres; null where a frame's is not known. */
export function rmsOfAll(clips: readonly ClipInfo[]): number | null {
  let sum = 0, frames = 0;
  for (const {rms_error: errors, frames: count} of clips) {
    if (!errors || errors.length < count || errors.some((error) => typeof error !== 'number')) return null;
    for (const error of errors) sum += (error as number) ** 2;
    frames += count;
  }
  return frames ? Math.sqrt(sum / frames) : null;
}

/** The vertex that is farthest off in a frame, or -1 where that is not stored. */
export async function worstVertex(model: Model, {clip, frame}: WorstFrame): Promise<number> {
  const info = model.meta.clips![clip], row = rowOf(info, frame);
  if (!info.residual || row < 0) return -1;
  const values = await model.blob(info.residual.blob), first = row * model.points * 3;
  let most = 0, found = -1;
  for (let v = 0; v < model.points; ++v) {
    const x = values[first + 3 * v], y = values[first + 3 * v + 1], z = values[first + 3 * v + 2], square = x * x + y * y + z * z;
    if (square > most) {
      most = square;
      found = v;
    }
  }
  return found;
}

/** The joint that has most of a vertex, by the fields of a report; null where that is not told. */
export async function jointOf(model: Model, vertex: number): Promise<string | null> {
  let most = 0, found: string | null = null;
  for (const field of model.meta.fields ?? []) {
    if (field.group !== 'joints' || !field.blob) continue;
    const weight = (await model.blob(field.blob))[vertex];
    if (weight > most) {
      most = weight;
      found = field.label ?? field.name;
    }
  }
  return found;
}
