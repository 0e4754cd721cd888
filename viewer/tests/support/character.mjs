// A made-up character: a sheet that bends and a knob over it, 8 modes, two clips with hits, blends and misses. All arithmetic in plain
// double precision, so that it says what the page's shader must come to.

const across = 44, along = 41;

function grid() {
  const rest = [], triangles = [], edges = [];
  for (let j = 0; j < along; ++j) for (let i = 0; i < across; ++i) rest.push((i / (across - 1) - 0.5) * 0.8, (j / (along - 1)) * 0.9, 0.06 * Math.cos(i / across * 7));
  const at = (i, j) => j * across + i;
  for (let j = 0; j + 1 < along; ++j) {
    for (let i = 0; i + 1 < across; ++i) {
      triangles.push(at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j), at(i + 1, j + 1), at(i, j + 1));
      edges.push(at(i, j), at(i + 1, j), at(i, j), at(i, j + 1));
    }
  }
  return {rest, triangles, edges};
}

function ball(first) {
  const rest = [], triangles = [], rings = 12, segments = 20;
  for (let j = 0; j <= rings; ++j) {
    for (let i = 0; i < segments; ++i) {
      const p = Math.PI * j / rings, a = 2 * Math.PI * i / segments, r = 0.11;
      rest.push(r * Math.sin(p) * Math.cos(a), 1.06 + r * Math.cos(p), r * Math.sin(p) * Math.sin(a));
    }
  }
  for (let j = 0; j < rings; ++j) {
    for (let i = 0; i < segments; ++i) {
      const a = first + j * segments + i, b = first + j * segments + (i + 1) % segments;
      triangles.push(a, b, b + segments, a, b + segments, a + segments);
    }
  }
  return {rest, triangles};
}

// Small, repeatable noise in -1..1.
function noise(seed) {
  let x = seed >>> 0 || 1;
  return () => {
    x ^= x << 13; x >>>= 0;
    x ^= x >>> 17;
    x ^= x << 5; x >>>= 0;
    return x / 2147483648 - 1;
  };
}

export function makeCharacter({modes = 8, wide = false} = {}) {
  const sheet = grid(), knob = ball(sheet.rest.length / 3);
  const rest = Float32Array.from([...sheet.rest, ...knob.rest]), points = rest.length / 3;
  const full = wide ? 32767 : 127;
  const basis = wide ? new Int16Array(modes * points * 3) : new Int8Array(modes * points * 3), scale = new Float32Array(modes);
  for (let k = 0; k < modes; ++k) {
    scale[k] = 0.12 / (1 + k);
    for (let v = 0; v < points; ++v) {
      const x = rest[3 * v], y = rest[3 * v + 1], at = (k * points + v) * 3;
      basis[at] = Math.round(full * 0.5 * Math.sin(y * (1 + k)) * (k % 2));
      basis[at + 1] = Math.round(full * -0.3 * y * y * Math.cos(k));
      basis[at + 2] = Math.round(full * 0.9 * y * y / 1.4 * Math.cos(x * (k + 1) * 2));
    }
  }
  const clips = [{name: 'bend', frames: 40, fps: 24, begin: 0, test: true}, {name: 'wave', frames: 30, fps: 30, begin: 0.5, test: false}];
  const count = clips.reduce((sum, clip) => sum + clip.frames, 0), rows = new Float32Array(count * modes);
  let row = 0;
  for (const [c, clip] of clips.entries()) {
    for (let f = 0; f < clip.frames; ++f, ++row) {
      for (let k = 0; k < modes; ++k) rows[row * modes + k] = Math.sin(2 * Math.PI * f / clip.frames * (1 + (k + c) % 3) + k) * (c ? 0.6 : 1) - (k ? 0 : 0.2);
    }
  }
  /** Where all points are for these coefficients, as the contract says. */
  const place = (coefficients) => {
    const out = Float64Array.from(rest);
    for (let k = 0; k < modes; ++k) {
      const c = coefficients[k] * scale[k] / full;
      for (let i = 0; i < points * 3; ++i) out[i] += c * basis[k * points * 3 + i];
    }
    return out;
  };
  return {points, rest, modes, basis, scale, rows, clips, place, full,
    sheet: {count: sheet.rest.length / 3, triangles: Uint32Array.from(sheet.triangles), edges: Uint32Array.from(sheet.edges)},
    knob: {count: knob.rest.length / 3, triangles: Uint32Array.from(knob.triangles)},
    rowOf: (r) => rows.subarray(r * modes, (r + 1) * modes)};
}

export const tolerance = 0.002, residualStep = 0.004 / 127;

/** What is off where, and the verdicts of a clip. Frames 18 to 25 of the first are hard. */
export function makeErrors(character, clip) {
  const {points, clips} = character, {frames} = clips[clip], random = noise(7 + clip);
  const residual = new Int8Array(frames * points * 3), verdicts = [], maxError = [], rmsError = [], fullUs = [], acceleratedUs = [], scores = [], reasons = [];
  for (let f = 0; f < frames; ++f) {
    const hard = clip === 0 && f >= 18 && f <= 25, miss = clip === 0 && f >= 20 && f <= 23;
    verdicts.push(miss ? 2 : hard ? 1 : 0);
    reasons.push(miss ? 0 : hard ? 1 : -1);
    scores.push(miss ? 1.8 : hard ? 0.95 : 0.3 + 0.2 * Math.sin(f / 3));
    let most = 0, sum = 0;
    for (let v = 0; v < points && !miss; ++v) {
      const y = character.rest[3 * v + 1], size = (f === 26 ? 90 : 40 + 15 * Math.sin(f / 4)) * y * Math.abs(Math.sin(9 * character.rest[3 * v] + f / 9));
      let square = 0;
      for (let c = 0; c < 3; ++c) {
        const n = Math.round(size * (c === 2 ? 0.8 : 0.3) + 2 * random());
        residual[(f * points + v) * 3 + c] = n;
        square += n * n;
      }
      most = Math.max(most, square);
      sum += square;
    }
    maxError.push(Math.sqrt(most) * residualStep);
    rmsError.push(Math.sqrt(sum / points) * residualStep);
    fullUs.push(640 + 40 * Math.abs(random()));
    acceleratedUs.push(miss ? 700 + 30 * Math.abs(random()) : hard ? 260 : 52 + 6 * Math.abs(random()));
  }
  return {residual, info: {verdicts, reasons, scores, max_error: maxError, rms_error: rmsError, full_us: fullUs, accelerated_us: acceleratedUs}};
}
