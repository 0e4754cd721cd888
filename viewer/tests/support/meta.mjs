// The meta of the made-up character: controls, cues, nodes and tables.
import {makeErrors, residualStep, tolerance} from './character.mjs';

export function makeMeta(character, {accelerated = true, live = false} = {}) {
  const blobs = {}, arrays = {};
  const add = (name, array) => {
    const type = {Float32Array: 'f32', Uint32Array: 'u32', Int16Array: 'i16', Int8Array: 'i8', Uint8Array: 'u8'}[array.constructor.name];
    blobs[name] = {type, count: array.length, deflate: !live};
    arrays[name] = array;
    return name;
  };
  const {points, rest, modes, sheet, knob} = character;
  const moves = (of) => Uint8Array.from({length: points}, (_, v) => Math.round(255 * of(rest[3 * v], rest[3 * v + 1])));
  const controls = [
    {name: 'bend.rotateX', group: 'Spine', label: 'bend', min: -60, max: 60, value: 0, unit: 'deg', moves: add('moves-bend', moves((x, y) => Math.min(1, y * y / 1.4))), moves_max: 0.31},
    {name: 'twist.rotateY', group: 'Spine', label: 'twist', min: -45, max: 45, value: 0, unit: 'deg', moves: add('moves-twist', moves((x, y) => Math.min(1, Math.abs(x) * 2 * y))), moves_max: 0.12},
    {name: 'squash.weight', group: 'Shapes', min: 0, max: 1, value: 0, moves: add('moves-squash', moves((x, y) => y > 0.9 ? 0 : 0.5 * (1 - Math.abs(x)))), moves_max: 0.05},
    {name: 'detail.level', group: 'Shapes', label: 'detail', min: 0, max: 3, value: 1, kind: 'integer'},
    {name: 'mirror.on', group: 'Shapes', label: 'mirror', min: 0, max: 1, value: 0, kind: 'switch'},
    ...Array.from({length: 8}, (_, i) => ({name: `finger_${i}.curl`, group: 'Fingers', min: 0, max: 90, value: 5, unit: 'deg'})),
  ];
  const meta = {
    format: 1, title: 'Bending sheet </script> & knob', rig: 'sheet.yaml', character: 'sheet.glb', program: 'kpsa 0.9 (test)', made: '2026-11-25',
    unit: {name: 'mm', metres: 0.001}, points, blobs, rest: add('rest', rest),
    meshes: [
      {name: 'sheet', first: 0, count: sheet.count, triangles: add('sheet-triangles', sheet.triangles), edges: add('sheet-edges', sheet.edges), colour: '#c9a58c'},
      {name: 'knob', first: sheet.count, count: knob.count, triangles: add('knob-triangles', knob.triangles), colour: '#8fa7bf'},
    ],
    accelerated, controls,
    fields: [{name: 'spine', group: 'Weights', blob: live ? null : add('field-spine', Float32Array.from({length: points}, (_, v) => Math.min(1, rest[3 * v + 1])))}],
    nodes: makeNodes(accelerated), tables: makeTables(),
  };
  meta.clips = character.clips.map((clip) => ({...clip}));
  if (live) Object.assign(meta, {generation: 1, handles: [{name: 'bend', kind: 'turn', controls: ['bend.rotateX'], position: [-0.2, 0.8, 0.1]}]});
  if (accelerated) {
    Object.assign(meta, {
      tolerance, reasons: ['bend.rotateX is outside its trained range', 'bent farther than the trained poses (most at sheet, points from 896 on)'], cues: makeCues(character),
      summary: [{label: 'times as fast', value: '9.8', note: 'misses included'}, {label: 'frames that hit', value: '80 %'}, {label: 'max error', value: '1.9 mm'}],
      tolerances: [[0.0005, 0.1, 1.1], [0.001, 0.5, 1.9], [0.002, 0.8, 4.2], [0.004, 0.95, 8], [0.008, 1, 11]].map(([t, hit_rate, speedup]) => ({tolerance: t, hit_rate, speedup})),
    });
  }
  if (!live) {
    meta.shape = {modes, basis: add('basis', character.basis), scale: add('scale', character.scale), rows: add('rows', character.rows), precision: 0.0001};
    let first = 0;
    meta.clips.forEach((clip, c) => {
      clip.first_row = first;
      first += clip.frames;
      if (!accelerated) return;
      const {residual, info} = makeErrors(character, c);
      Object.assign(clip, info, {residual: {blob: add(`residual-${c}`, residual), step: residualStep}});
    });
  }
  return {meta, arrays};
}

function makeCues({rest, sheet}) {
  const cues = [];
  for (let i = 0; i < 12; ++i) {
    const vertex = Math.floor((i + 0.5) / 12 * sheet.count);
    cues.push({name: `sheet.points[${vertex}]`, kind: 'point', stage: 'sheet@skin', vertex, position: [...rest.subarray(3 * vertex, 3 * vertex + 3)], cost_us: 0.4 + i / 20,
      sees: 'the bend of the spine, and what the delta mush does about it'});
  }
  cues.push({name: 'spine_2.matrix', kind: 'matrix', stage: null, vertex: 900, position: [0, 0.45, -0.05], cost_us: 0.1, sees: 'where the middle joint turns'});
  cues.push({name: 'squash.weight', kind: 'scalar', cost_us: 0.02, sees: 'the weight itself'});
  cues.push({name: 'bend x twist', kind: 'product', cost_us: 0.01, sees: 'both at once'});
  return cues;
}

function makeNodes(accelerated) {
  const nodes = [], states = ['kept', 'cues only', 'never run', 'switched off'];
  for (let i = 0; i < 260; ++i) {
    const joint = i < 180;
    nodes.push({
      name: joint ? `joint_${String(i).padStart(3, '0')}` : i === 259 ? 'delta_mush_final' : `deformer_${i - 180}`, type: joint ? 'transform' : i === 259 ? 'deltaMush' : 'skinCluster',
      state: accelerated ? states[joint ? 0 : i === 259 ? 2 : 1 + i % 3] : null, full_us: joint ? 0.2 + (i % 7) / 10 : 5 + i % 13 * 9, accelerated_us: accelerated ? joint ? 0.2 : i % 3 ? 0 : 2 : null,
      points: joint ? null : 1804, inputs: joint ? i > 2 ? [Math.floor((i - 1) / 3)] : [] : [i - 180, (i * 7) % 180, ...i > 180 ? [i - 1] : []], reason: i === 259 ? 'only a miss needs it' : null,
    });
  }
  return nodes;
}

function makeTables() {
  return [
    {title: 'Bench', note: 'Medians of 5 runs on 2 cores.', columns: [{name: 'clip'}, {name: 'frames'}, {name: 'full', unit: 'µs'}, {name: 'accelerated', unit: 'µs'}, {name: 'speedup'}],
      rows: [['bend', 40, 661.2, 120.4, 5.49], ['wave', 30, 659.8, 55.1, 11.97], ['all', 70, 660.6, 92.4, 7.15]]},
    {title: 'Promise', columns: [{name: 'kind of pose'}, {name: 'poses'}, {name: 'violations', unit: '%'}], rows: [['clips', 2000, 0.4], ['neighbours', 1000, 0.9], ['beyond the ranges', 500, null]]},
  ];
}
