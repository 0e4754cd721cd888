// The contract of docs/viewer-data.md as types. Everything but the first five keys of Meta is optional.

export type BlobType = 'f32' | 'u32' | 'i16' | 'i8' | 'u8';
export type BlobArray = Float32Array | Uint32Array | Int16Array | Int8Array | Uint8Array;
export type Maybe<T> = T | null | undefined;

export interface BlobInfo {
  type: BlobType;
  count: number;
  deflate?: boolean;
}

export interface MeshInfo {
  name: string;
  first: number;
  count: number;
  triangles: string;
  colour?: Maybe<string>;
  edges?: Maybe<string>;
}

export interface ShapeInfo {
  modes: number;
  basis: string;
  scale: string;
  rows: string;
  precision?: Maybe<number>;
}

export interface ResidualInfo {
  blob: string;
  step: number;
  rows?: Maybe<number[]>;
}

export type Numbers = Maybe<number>[];

export interface ClipInfo {
  name: string;
  frames: number;
  fps: number;
  begin: number;
  test?: Maybe<boolean>;
  first_row?: Maybe<number>;
  verdicts?: Maybe<Numbers>;
  reasons?: Maybe<Numbers>;
  scores?: Maybe<Numbers>;
  full_us?: Maybe<Numbers>;
  accelerated_us?: Maybe<Numbers>;
  max_error?: Maybe<Numbers>;
  rms_error?: Maybe<Numbers>;
  residual?: Maybe<ResidualInfo>;
}

export interface ControlInfo {
  name: string;
  group?: Maybe<string>;
  label?: Maybe<string>;
  min?: Maybe<number>;
  max?: Maybe<number>;
  value?: Maybe<number>;
  unit?: Maybe<string>;
  kind?: Maybe<'number' | 'integer' | 'switch'>;
  moves?: Maybe<string>;
  moves_max?: Maybe<number>;
}

export interface CueInfo {
  name: string;
  kind: 'point' | 'matrix' | 'scalar' | 'product';
  stage?: Maybe<string>;
  vertex?: Maybe<number>;
  position?: Maybe<[number, number, number]>;
  cost_us?: Maybe<number>;
  sees?: Maybe<string>;
}

/** A point in the picture that is dragged, live. */
export interface HandleInfo {
  name: string;
  kind: 'move' | 'turn';
  controls: string[];
  position: [number, number, number];
}

export type NodeState = 'kept' | 'cues only' | 'never run' | 'switched off';

export interface NodeInfo {
  name: string;
  type: string;
  state?: Maybe<NodeState>;
  full_us?: Maybe<number>;
  accelerated_us?: Maybe<number>;
  points?: Maybe<number>;
  inputs: number[];
  reason?: Maybe<string>;
}

export type Cell = string | number | null;

export interface TableInfo {
  title: string;
  note?: Maybe<string>;
  columns: {name: string; unit?: Maybe<string>; note?: Maybe<string>}[];
  rows: Cell[][];
}

export interface ToleranceInfo {
  tolerance: number;
  hit_rate: number;
  speedup: Maybe<number>;
}

export interface FieldInfo {
  name: string;
  group?: Maybe<string>;
  label?: Maybe<string>;
  blob?: Maybe<string>;
}

export interface Problem {
  message: string;
  severity?: Maybe<'error' | 'warning'>;
  file?: Maybe<string>;
  line?: Maybe<number>;
  column?: Maybe<number>;
  suggestion?: Maybe<string>;
}

export interface Meta {
  format: number;
  points: number;
  blobs: Record<string, BlobInfo>;
  meshes: MeshInfo[];
  rest: string;
  title?: Maybe<string>;
  rig?: Maybe<string>;
  character?: Maybe<string>;
  program?: Maybe<string>;
  made?: Maybe<string>;
  unit?: Maybe<{name: string; metres: number}>;
  accelerated?: Maybe<boolean>;
  tolerance?: Maybe<number>;
  summary?: Maybe<{label: string; value: string; note?: Maybe<string>}[]>;
  shape?: Maybe<ShapeInfo>;
  clips?: Maybe<ClipInfo[]>;
  reasons?: Maybe<string[]>;
  controls?: Maybe<ControlInfo[]>;
  cues?: Maybe<CueInfo[]>;
  handles?: Maybe<HandleInfo[]>;
  nodes?: Maybe<NodeInfo[]>;
  tables?: Maybe<TableInfo[]>;
  tolerances?: Maybe<ToleranceInfo[]>;
  fields?: Maybe<FieldInfo[]>;
  generation?: Maybe<number>;
}

/** The meta of a JSON value, or an Error that says what is wrong with it. */
export function checkMeta(value: unknown): Meta {
  const meta = value as Meta;
  if (typeof meta !== 'object' || meta === null) throw new Error('the data of this page is not an object');
  if (meta.format !== 1) throw new Error(`the data of this page has format ${String(meta.format)}, and this viewer reads format 1`);
  if (!Number.isInteger(meta.points) || meta.points < 1) throw new Error('the data of this page has no points');
  if (!meta.blobs || !Array.isArray(meta.meshes) || !meta.rest) throw new Error('the data of this page lacks blobs, meshes or rest');
  for (const clip of meta.clips ?? []) checkClip(clip, meta);
  return meta;
}

const mostFrames = 1_000_000;

function checkClip(clip: ClipInfo, {blobs, points}: Meta): void {
  const refuse = (what: string): never => { throw new Error(`clip ${clip.name} has ${what}`); };
  const {frames, fps, first_row: first, residual} = clip;
  if (!Number.isInteger(frames) || frames < 0 || frames > mostFrames) refuse(`${String(frames)} frames; 0 to ${mostFrames} are possible`);
  if (!Number.isFinite(fps) || fps <= 0) refuse(`${String(fps)} frames a second`);
  if (first !== null && first !== undefined && (!Number.isInteger(first) || first < 0)) refuse(`first_row ${String(first)}`);
  if (!residual) return;
  const {rows} = residual;
  if (rows && rows.length !== frames) refuse(`${rows.length} rows of a residual for ${frames} frames`);
  if (!blobs[residual.blob]) refuse(`a residual in ${residual.blob}, and there is no such blob`);
  const stored = Math.floor(blobs[residual.blob].count / (3 * points));
  if (!rows && frames > stored) refuse(`${frames} frames, and its residual has ${stored}`);
  for (const row of rows ?? []) if (!Number.isInteger(row) || row < -1 || row >= stored) refuse(`row ${String(row)} of a residual that has ${stored}`);
}
