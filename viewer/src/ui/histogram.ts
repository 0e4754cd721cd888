// How the errors of a clip are distributed.
import type {ClipInfo} from '../data/meta';
import type {Model} from '../data/model';
import {isSame, rowOf} from '../data/residual';

export interface Histogram {
  x: number[];       // the middles of the bins, metres
  share: number[];   // of all points of all frames
}

const mostBins = 40;

/** Of all points of all frames whose difference is known, in bins up to the largest error. */
export function residualHistogram(clip: ClipInfo, points: number, values: Int8Array | Int16Array, step: number): Histogram {
  const stored: [begin: number, end: number][] = [];
  let same = 0, most = 0;
  for (let frame = 0; frame < clip.frames; ++frame) {
    const row = rowOf(clip, frame);
    if (row >= 0) stored.push([row * points * 3, (row + 1) * points * 3]);
    else if (isSame(clip, frame)) ++same;
  }
  for (const [begin, end] of stored) {
    for (let i = begin; i < end; i += 3) {
      const square = values[i] * values[i] + values[i + 1] * values[i + 1] + values[i + 2] * values[i + 2];
      if (square > most) most = square;
    }
  }
  // at least a step wide, or bins between two steps would be empty
  const top = Math.max(1e-9, Math.sqrt(most)), bins = Math.min(mostBins, Math.max(1, Math.floor(top))), count = new Float64Array(bins);
  count[0] = same * points;
  for (const [begin, end] of stored) {
    for (let i = begin; i < end; i += 3) {
      const size = Math.hypot(values[i], values[i + 1], values[i + 2]);
      ++count[Math.min(bins - 1, Math.floor(size / top * bins))];
    }
  }
  const all = Math.max(1, (stored.length + same) * points);
  return {x: Array.from(count, (_, i) => (i + 0.5) / bins * top * step), share: Array.from(count, (n) => n / all)};
}

/** Of the largest errors of frames. */
export function frameHistogram(errors: readonly (number | null)[]): Histogram {
  const known = errors.filter((e): e is number => e !== null), top = known.reduce((most, e) => Math.max(most, e), 1e-9), bins = mostBins, count = new Float64Array(bins);
  for (const e of known) ++count[Math.min(bins - 1, Math.floor(e / top * bins))];
  return {x: Array.from(count, (_, i) => (i + 0.5) / bins * top), share: Array.from(count, (n) => n / Math.max(1, known.length))};
}

/** A point's error in each frame, metres; null where it is not stored. */
export function errorsOfPoint(model: Model, clip: number, vertex: number, values: Int8Array | Int16Array): (number | null)[] {
  const info = model.meta.clips![clip], residual = info.residual!;
  return Array.from({length: info.frames}, (_, frame) => {
    const row = rowOf(info, frame);
    if (row < 0) return isSame(info, frame) ? 0 : null;
    const at = (row * model.points + vertex) * 3;
    return Math.hypot(values[at], values[at + 1], values[at + 2]) * residual.step;
  });
}
