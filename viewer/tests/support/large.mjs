// A report as large as is wished, of a made-up sheet with smooth modes, for what is measured and not looked at.

export function makeLargeReport({points = 30000, modes = 65, frames = 240} = {}) {
  const across = Math.max(2, Math.round(Math.sqrt(points * 4 / 3))), along = Math.max(2, Math.round(points / across)), count = across * along;
  const blobs = {}, arrays = {}, tolerance = 0.001;
  const add = (name, array) => {
    blobs[name] = {type: {Float32Array: 'f32', Uint32Array: 'u32', Int8Array: 'i8'}[array.constructor.name], count: array.length, deflate: true};
    arrays[name] = array;
    return name;
  };
  const rest = new Float32Array(3 * count), triangles = new Uint32Array(6 * (across - 1) * (along - 1));
  let at = 0;
  for (let j = 0; j < along; ++j) {
    for (let i = 0; i < across; ++i) {
      const v = j * across + i;
      rest.set([i / (across - 1) - 0.5, j / (along - 1), 0.1 * Math.sin(i / across * 9) * Math.cos(j / along * 7)], 3 * v);
      if (i + 1 < across && j + 1 < along) {
        triangles.set([v, v + 1, v + across + 1, v, v + across + 1, v + across], at);
        at += 6;
      }
    }
  }
  const basis = new Int8Array(modes * 3 * count), rows = new Float32Array(frames * modes), residual = new Int8Array(frames * 3 * count);
  for (let k = 0; k < modes; ++k) {
    for (let i = 0; i < 3 * count; ++i) basis[k * 3 * count + i] = 120 * Math.sin((k + 1) * rest[i] * 5 + i % 3);
    for (let f = 0; f < frames; ++f) rows[f * modes + k] = Math.sin(f / 20 + k) / (k + 1) ** 1.5;
  }
  for (let f = 0; f < frames; ++f) for (let i = 0; i < 3 * count; ++i) residual[f * 3 * count + i] = 6 * Math.sin(f / 9 + i / 700);
  const wave = (middle) => Array.from({length: frames}, (_, f) => middle * (1 + 0.3 * Math.sin(f / 7)));
  const meta = {
    format: 1, title: 'Large', rig: 'large.yaml', points: count, blobs, rest: add('rest', rest), meshes: [{name: 'sheet', first: 0, count, triangles: add('triangles', triangles)}],
    accelerated: true, tolerance, reasons: ['hit'], shape: {modes, basis: add('basis', basis), scale: add('scale', new Float32Array(modes).fill(0.05)), rows: add('rows', rows), precision: 1e-5},
    clips: [{
      name: 'wave', frames, fps: 60, begin: 0, test: true, first_row: 0, verdicts: new Array(frames).fill(0), reasons: new Array(frames).fill(0), scores: wave(0.5), full_us: wave(900), accelerated_us: wave(90),
      max_error: wave(0.0006), rms_error: wave(0.0002), residual: {blob: add('residual', residual), step: tolerance / 16},
    }],
  };
  return {meta, arrays};
}
