// A model in the picture: its surfaces, edges and marks, and how they are coloured.
import {Vector3} from 'three';
import type {Model} from '../data/model';
import {Marks, type Mark} from '../draw/marks';
import type {Paint, Scene, Surface} from '../draw/scene';
import {edgesOf} from '../shape/edges';
import {Normals} from '../shape/normals';
import {Positions, type Side} from '../shape/positions';
import type {ViewMode} from '../state';
import {errorTable, fieldTable} from './colours';

export class ModelView implements Scene {
  readonly positions: Positions;
  readonly meshes: Model['meshes'];
  readonly points: number;
  solid: Surface;
  ghost: Surface | null = null;
  paint: Paint | null = null;
  edges: Uint32Array[] | null = null;
  readonly cues = new Marks([1, 0.78, 0.2], 9);
  readonly picked = new Marks([0.3, 0.85, 1], 9);
  readonly handles = new Marks([0.76, 0.6, 1], 13);
  readonly marks = [this.cues, this.picked, this.handles];
  private readonly normals: Normals;
  private readonly surfaces: Record<Side, Surface>;
  private readonly errors: Paint;
  private field: Paint | null = null;
  private allEdges: Uint32Array[] | null = null;
  private cueMarks: readonly Mark[] = [];
  cueOf: readonly number[] = [];
  private mode: ViewMode = 'full';

  constructor(private readonly model: Model, private readonly invalidate: () => void) {
    this.meshes = model.meshes;
    this.points = model.points;
    this.positions = new Positions(model);
    this.normals = new Normals(model.rest, model.meshes);
    const surface = (): Surface => ({points: model.rest, normals: new Float32Array(3 * model.points), version: -1});
    this.surfaces = {accelerated: surface(), full: surface()};
    this.solid = this.surfaces.full;
    this.errors = {values: new Float32Array(), top: 0.001, table: errorTable(2), version: -1};
    this.handles.set((model.meta.handles ?? []).map(({position, kind}) => ({vertex: -1, offset: position, diamond: kind === 'move'})));
  }

  /** Whether edges are those that were modelled; else they are those of triangles. */
  get edgesAreModelled(): boolean {
    return this.model.meshes.every((mesh) => mesh.edges);
  }

  /** The side whose surface is solid. */
  get side(): Side {
    return this.mode === 'full' || this.mode === 'overlay' ? 'full' : 'accelerated';
  }

  setMode(mode: ViewMode): void {
    this.mode = mode;
    this.invalidate();
  }

  /** The errors that the colours span, in metres, and how many tolerances that is. */
  setErrorTop(top: number, inTolerances: number): void {
    this.errors.top = top;
    this.errors.table = errorTable(inTolerances);
    this.invalidate();
  }

  /** Values of 0 to 1 as colours; null for the meshes' own. */
  setField(values: ArrayLike<number> | null, scale: number): void {
    const version = (this.field?.version ?? 0) + 1;
    this.field = values && {values: Float32Array.from(values, (x) => x * scale), top: 1, table: fieldTable(), version};
    this.invalidate();
  }

  setEdges(visible: boolean): void {
    if (visible) this.allEdges ??= this.model.meshes.map((mesh) => mesh.edges ?? edgesOf(mesh.triangles, this.points));  // not before somebody wants to see them
    this.edges = visible ? this.allEdges : null;
    this.invalidate();
  }

  /** Marks of cues; `cueOf`: which cue each of them is. */
  setCueMarks(marks: readonly Mark[], cueOf: readonly number[]): void {
    this.cueMarks = marks;
    this.cueOf = cueOf;
    this.cues.set(marks);
  }

  showCues(visible: boolean, selected: number): void {
    this.cues.visible = visible;
    this.cues.emphasized = this.cueOf.indexOf(selected);
    this.invalidate();
  }

  showHandles(visible: boolean, held: number): void {
    this.handles.visible = visible;
    this.handles.emphasized = held;
    this.invalidate();
  }

  setPicked(vertices: readonly number[], selected: number): void {
    const all = selected >= 0 && !vertices.includes(selected) ? [...vertices, selected] : vertices;
    this.picked.set(all.map((vertex) => ({vertex, offset: [0, 0, 0]})));
    this.picked.emphasized = all.indexOf(selected);
    this.invalidate();
  }

  /** Where a mark is now. */
  cuePlace(index: number): Vector3 {
    const {vertex, offset} = this.cueMarks[index];
    const place = new Vector3(...offset);
    return vertex < 0 ? place : place.add(new Vector3().fromArray(this.shownPoints(), 3 * vertex));
  }

  get cueCount(): number {
    return this.cueMarks.length;
  }

  shownPoints(): Float32Array {
    return this.positions.of(this.side);
  }

  /** Computes what is shown, as far as it has changed. */
  update(): void {
    this.solid = this.surfaceOf(this.side);
    this.ghost = this.mode === 'overlay' ? this.surfaceOf('accelerated') : null;
    this.paint = this.mode === 'difference' ? this.errors : this.field;
    if (this.mode === 'difference' && this.errors.version !== this.positions.version) {
      this.errors.values = this.positions.errors();
      this.errors.version = this.positions.version;
    }
  }

  private surfaceOf(side: Side): Surface {
    const surface = this.surfaces[side], {version} = this.positions;
    if (surface.version === version) return surface;
    surface.points = this.positions.of(side);
    this.normals.compute(surface.points, surface.normals);
    surface.version = version;
    return surface;
  }
}
