// What is drawn, as plain arrays: the two pictures (gpu_picture.ts, software_picture.ts) draw the same.
import type {Camera} from 'three';
import type {Mesh} from '../data/model';
import type {Marks} from './marks';

export interface Surface {
  points: Float32Array;   // x y z of each point
  normals: Float32Array;  // of length 1
  version: number;        // counts changes of both
}

/** Colours by a value of each point: 0 is the first of 256 colours, `top` the last. */
export interface Paint {
  values: Float32Array;
  top: number;
  table: Uint8Array<ArrayBuffer>;  // r g b a; another array where another table is meant
  version: number;  // counts changes of the values
}

export interface Scene {
  readonly meshes: readonly Mesh[];
  readonly points: number;
  solid: Surface;
  ghost: Surface | null;  // see-through, in a colour of its own, over the solid one
  paint: Paint | null;    // of the solid surface; without it a mesh has its own colour
  edges: readonly Uint32Array[] | null;  // of each mesh, two points an edge
  readonly marks: readonly Marks[];
}

export const ghostColour: readonly [number, number, number] = [0.98, 0.55, 0.13];

export interface Picture {
  readonly canvas: HTMLCanvasElement;
  readonly name: string;
  /** Takes another scene; what belonged to the one before goes. */
  show(scene: Scene): void;
  /** In pixels of CSS, and how many of the canvas each of them is. */
  resize(width: number, height: number, ratio: number): void;
  setBackground(colour: readonly [number, number, number]): void;
  draw(camera: Camera): void;
  /** Resolves when what was drawn last is in the canvas. */
  finished(): Promise<void>;
  /** Returns when it is; for what is measured. */
  wait(): void;
}
